"""Critical multipliers of a fixed point, their eigenvectors, and refusals.

Method      A q = nu q,  A^T p = conj(nu) p,  |q| = 1,  <p, q> = conj(p) . q = 1             (1)
            with 0 < arg(nu) < pi for a pair, and the entry of q of largest modulus > 0. A normal
            form holds where nu is simple and no other multiplier lies on the unit circle.   (2)
Assumes     nothing: hypotheses are checked
Accuracy    rounding times the condition |p| of the multiplier
Fails       a :class:`Refusal` that names the hypothesis that does not hold
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4; the conventions are
            those of MatContM
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol, runtime_checkable

import numpy as np

from vibroimpact._core.pencils import vectors
from vibroimpact._core.types import AnyComplexes, Complexes, Floats
from vibroimpact.normal_forms.kind import PointKind

ON_CIRCLE = 1e-6
"""A multiplier with ||nu| - 1| up to this counts as critical.

Special points are located to about 1e-10 in the parameter; coefficients change by the same relative
amount as nu.
"""

HALF_OF_THE_DIGITS = 2.0**-26
"""A coefficient below this share of the terms whose sum it is counts as zero.

It has lost half of its digits by cancellation, and at a point that is located to half of the digits
it cannot be distinguished from zero.
"""

NOT_FINITE = "is not finite: the map is not smooth here (a grazing or sticking orbit)."


class Status(StrEnum):
    """Reasons for refusing a normal form."""

    NOT_CRITICAL = "multiplier not critical"
    OTHERS_CRITICAL = "other multipliers critical"
    STRONG_RESONANCE = "strong resonance"
    DEGENERATE = "coefficient vanishes"
    NOT_TRANSVERSAL = "no transversality"
    NOT_SMOOTH = "map not smooth"


@runtime_checkable
class NormalForm(Protocol):
    """Normal form: coefficients, and what is born."""

    @property
    def kind(self) -> str:
        """Label of the kind."""

    @property
    def multipliers(self) -> Complexes:
        """All multipliers of the map at the point."""

    @property
    def others_inside(self) -> bool:
        """Whether all multipliers that are not critical lie inside the unit circle."""


@dataclass(frozen=True, eq=False)
class Refusal:
    """Result where a normal form does not exist, or does not decide.

    Attributes
    ----------
    kind
        The requested kind.
    status
        The hypothesis that fails.
    reason
        A sentence with the numbers.
    multipliers
        All multipliers of the fixed point, shape (d,).
    critical
        The part that could be computed, without the parameter, where a coefficient vanishes or
        transversality fails; else None.
    """

    kind: str
    status: Status
    reason: str
    multipliers: AnyComplexes = field(repr=False)
    critical: NormalForm | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Critical:
    """Simple critical multiplier with its eigenvectors."""

    multiplier: complex  # nu, in the upper half plane where complex
    # its right and left eigenvectors (1), shape (d,)
    q: Complexes
    p: Complexes
    # all multipliers, shape (d,), and all but nu and conj(nu)
    multipliers: AnyComplexes
    others: AnyComplexes

    @property
    def on_circle(self) -> complex:
        """The multiplier brought to the unit circle."""
        return self.multiplier / abs(self.multiplier)

    def project(self, vector: Complexes | Floats) -> complex:
        """<p, vector>: the part of a vector along q."""
        return complex(np.vdot(self.p, vector))

    @property
    def others_inside(self) -> bool:
        """Whether every other multiplier lies inside the unit circle."""
        return bool(np.all(np.abs(self.others) < 1.0))


def critical_multiplier(of: PointKind, A: Floats) -> Critical | Refusal:
    """Find the critical multiplier of a Jacobian.

    Parameters
    ----------
    of
        Kind of the bifurcation, with one critical multiplier.
    A
        Jacobian, shape (d, d).

    Returns
    -------
    Critical or Refusal
        Refused as NOT_SMOOTH, NOT_CRITICAL, STRONG_RESONANCE (a pair that has merged at 1 or -1)
        or OTHERS_CRITICAL.
    """
    (target,), kind = of.critical, of.label
    rough = rough_jacobian(kind, A)
    if rough:
        return rough
    values, left, right = vectors(A)
    off = distance(values, target)
    at = int(np.argmin(off))
    if not np.isfinite(off[at]):
        return _all_real(kind, values)
    nu = complex(values[at])
    if off[at] > ON_CIRCLE:
        reason = (
            f"{kind} needs {described(target)}; the nearest is {nu:.9g}, off by {off[at]:.2g} "
            f"(allowed {ON_CIRCLE:g})."
        )
        return Refusal(kind, Status.NOT_CRITICAL, reason, values)
    others = np.delete(values, [at, partner(values, at)] if target is None else at)
    crowd = others[np.abs(np.abs(others) - 1.0) <= ON_CIRCLE]
    if len(crowd):
        return _crowded(kind, nu, crowd, values)
    q, p = normalised(right[:, at], left[:, at])
    return Critical(nu, q, p, values, others)


def distance(values: Complexes, target: float | None) -> Floats:
    """Distance of each multiplier from the one sought; infinite if it is of no pair sought."""
    if target is not None:
        return np.asarray(np.abs(values - target), np.float64)
    return np.where(values.imag > 0.0, np.abs(np.abs(values) - 1.0), np.inf)


def described(target: float | None) -> str:
    """Text of the multiplier sought."""
    return "a pair on the unit circle" if target is None else f"a multiplier {target:+.0f}"


def listed(values: Complexes) -> str:
    """Text of several multipliers."""
    return ", ".join(f"{value:.9g}" for value in values)


def partner(values: Complexes, at: int) -> int:
    """Index of the conjugate of a multiplier."""
    off = np.abs(values - np.conj(values[at]))
    off[at] = np.inf
    return int(np.argmin(off))


def _all_real(kind: str, values: Complexes) -> Refusal:
    """Refusal where no pair exists: it may have merged at 1 or -1."""
    for q, target in ((1, 1.0), (2, -1.0)):
        if np.count_nonzero(np.abs(values - target) <= ON_CIRCLE) > 1:
            reason = f"two multipliers are {target:+.0f}: the pair has met at the resonance 1:{q}."
            return Refusal(kind, Status.STRONG_RESONANCE, reason, values)
    reason = f"{kind} needs a pair on the unit circle; all multipliers are real."
    return Refusal(kind, Status.NOT_CRITICAL, reason, values)


def normalised(right: Complexes, left: Complexes) -> tuple[Complexes, Complexes]:
    """(q, p) of (1)."""
    largest = right[np.argmax(np.abs(right))]
    q = right * (abs(largest) / largest / np.linalg.norm(right))
    return q, left / np.vdot(q, left)


def _crowded(kind: str, nu: complex, crowd: Complexes, values: Complexes) -> Refusal:
    reason = (
        f"{kind} at nu = {nu:.9g} needs every other multiplier off the unit circle and nu simple; "
        f"also critical: {listed(crowd)}. This is a point of higher codimension."
    )
    return Refusal(kind, Status.OTHERS_CRITICAL, reason, values)


def not_smooth(kind: str, name: str, multipliers: Complexes) -> Refusal:
    """Refuse what is not finite."""
    return Refusal(kind, Status.NOT_SMOOTH, f"{name} {NOT_FINITE}", multipliers)


def rough_jacobian(kind: str, A: Floats) -> Refusal | None:
    """Refuse a Jacobian that is not finite: its multipliers are not known."""
    if np.all(np.isfinite(A)):
        return None
    return not_smooth(kind, "the Jacobian", np.full(len(A), np.nan, dtype=np.complex128))


def zero(
    name: str, value: float, scale: float, status: Status, meaning: str, form: NormalForm
) -> Refusal | None:
    """Refuse a coefficient that is zero next to the size of its terms, or not finite.

    Parameters
    ----------
    name, value, scale
        The coefficient, and the size of the terms whose sum it is.
    status, meaning
        Status and text where it is zero (``HALF_OF_THE_DIGITS``).
    form
        The normal form without the parts that depend on it.
    """
    if not math.isfinite(value):
        return not_smooth(form.kind, name, form.multipliers)
    if abs(value) > HALF_OF_THE_DIGITS * scale:
        return None
    reason = f"{name} = {value:.3g} is zero to half of the digits: {meaning}."
    return Refusal(form.kind, status, reason, form.multipliers, form)
