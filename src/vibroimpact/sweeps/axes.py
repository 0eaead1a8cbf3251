"""Axes of a sweep: named values, checked first."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import numbers, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.model.hybrid_system import HybridSystem
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import parameter_value, with_parameters, with_values
from vibroimpact.model.state import COORDINATE
from vibroimpact.model.system import System, mechanism_of


def axis_of(argument: str, name: str, values: ArrayLike) -> Floats:
    """Return the values of one axis, or refuse them with the reason.

    Parameters
    ----------
    argument
        Name of the argument that holds the axis, for the message.
    name
        Name of the axis.
    values
        Finite numbers, all different, at least one.
    """
    label = f"{argument}[{name!r}]"
    axis = numbers(label, values, "numbers, such as np.linspace(1, 2, 101)")
    if axis.ndim != 1 or axis.size == 0:
        raise InvalidParameterError(f"{label} has shape {axis.shape}: must be (k,) with k >= 1.")
    different, counts = np.unique(axis, return_counts=True)
    if counts.max() > 1:
        twice = different[counts > 1][0]
        raise InvalidParameterError(
            f"{label} = {twice}: is given {counts.max()} times. Give each value once."
        )
    axis.flags.writeable = False
    return axis


def parameter_axes(system: System, over: Mapping[str, ArrayLike]) -> dict[str, Floats]:
    """Check the parameters of a sweep and their values.

    Raises
    ------
    InvalidParameterError
        No such parameter; no, repeated or non-finite values; a value that the system refuses; two
        names for the same number.

    Notes
    -----
    The system is built at the corners of the grid only. A value inside that it refuses ends the
    sweep when it is reached.
    """
    if not isinstance(over, Mapping):
        raise refusal("over", over, "a dictionary from names of parameters to values")
    mechanism_of(system)
    axes = {}
    for name, values in over.items():
        parameter_value(system, name)  # refuses an unknown one
        axes[name] = axis_of("over", name, values)
    _refuse_twins(system, axes)
    for corner in corners(axes):
        _build(system, corner)
    return axes


def corners(axes: Mapping[str, Floats]) -> Iterator[dict[str, float]]:
    """Combinations of the least and largest values of the parameters."""
    ends = ({float(axis.min()), float(axis.max())} for axis in axes.values())
    for values in itertools.product(*ends):
        yield dict(zip(axes, values, strict=True))


def is_coordinate(system: System, name: Any) -> bool:
    """Whether a name is one of a coordinate of a state, x1, v1, phase, and of no parameter of the system."""
    if not isinstance(name, str) or not COORDINATE.fullmatch(name):
        return False
    try:
        parameter_value(system, name)
    except InvalidParameterError:
        return True
    return False


def _build(system: System, values: Mapping[str, float]) -> None:
    """Refuse values for which the system cannot be built, with a message that names them."""
    try:
        mechanism_of(with_parameters(system, values))
    except InvalidParameterError as error:
        if not isinstance(system, Mechanism | HybridSystem):
            raise
        raise InvalidParameterError(with_values(str(error), values)) from error


def _refuse_twins(system: System, axes: Mapping[str, Floats]) -> None:
    """Refuse two names of the same number, such as stiffness[0][1] and stiffness[1][0]."""
    for one, other in itertools.permutations(axes, 2):
        here = parameter_value(system, one)
        there = next((float(x) for x in axes[one] if x != here), here)
        try:
            moved = parameter_value(with_parameters(system, {one: there}), other)
        except InvalidParameterError:
            continue  # a value that is refused alone is judged with the others, at the corners
        if moved != parameter_value(system, other):
            raise InvalidParameterError(
                f"over = [{one!r}, {other!r}]: one changes the other. Take one of them."
            )
