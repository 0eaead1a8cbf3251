"""Effect of the parameter on a critical fixed point.

Method      x_p  = (I - A)^-1 F_p                   drift of the fixed point                 (1)
            nu_p = <p, A_p q + B(q, x_p)>           slope of the critical multiplier         (2)
Assumes     1 is not a multiplier
Accuracy    rounding times the conditions of I - A and of the multiplier
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 4.7: exact derivatives, along
            the branch of fixed points
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats, Positive
from vibroimpact.normal_forms.critical import Critical
from vibroimpact.normal_forms.forms import Multilinear, with_parameter
from vibroimpact.normal_forms.terms import off, sized

Part = TypeVar("Part")


def given(name: str, part: Part | None) -> Part:
    """Return a part of a normal form that needs the parameter, or raise if it was left out."""
    if part is None:
        raise InvalidParameterError(
            f"{name} = None: this normal form was computed without the parameter. "
            "Compute it with unfolded=True."
        )
    return part


@dataclass(frozen=True)
class Unfolding:
    """Derivatives with respect to the parameter along the branch of fixed points."""

    drift: Floats  # x_p, shape (dimension,)
    multiplier_slope: complex  # d nu / d p
    scale: Positive  # size of the terms whose sum the slope is


def unfold(at: Multilinear, A: Floats, critical: Critical) -> Unfolding:
    """Return (1) and (2). Cost: 1 first and at most 4 second derivatives."""
    parameter = with_parameter(np.zeros(len(A)), 1.0)
    drift = off(A, 1.0, at.real(parameter))  # (1)
    slope = sized(critical.p, 1.0, at(critical.q, parameter), at(critical.q, drift))  # (2)
    return Unfolding(drift, slope.value, slope.scale)
