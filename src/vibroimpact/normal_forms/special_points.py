"""Common parts of points of codimension two: critical multipliers, and the curves that begin there.

Method      several critical multipliers nu_k at once, A q_k = nu_k q_k, A^T p_k = conj(nu_k) p_k,
            |q_k| = 1, <p_k, q_k> = 1, each with the sign or phase of critical.py            (1)
Assumes     nothing: hypotheses are checked
Accuracy    rounding times |p_k|
Fails       a Refusal where a multiplier is missing, not simple, or another is critical
Tolerance   an error delta of the parameters moves a double multiplier by its square root, and at
            a fold the fixed point with all of its multipliers: these are accepted to sqrt(1e-6),
            others to 1e-6. A coefficient that locates a point counts as zero below the share
            sqrt(1e-6) of its terms
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, chapter 9; the conventions are those
            of MatContM
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.pencils import vectors
from vibroimpact._core.types import AnyComplexes, Complexes, Count, Floats
from vibroimpact.normal_forms.critical import (
    ON_CIRCLE,
    Critical,
    NormalForm,
    Refusal,
    Status,
    described,
    distance,
    listed,
    normalised,
    partner,
    rough_jacobian,
    zero,
)
from vibroimpact.normal_forms.kind import PointKind

AT_THE_POINT = math.sqrt(ON_CIRCLE)
"""Largest deviation of what the square root of an error moves: see Tolerance above."""

STRONGEST_SUM = 4
"""Relations between multipliers with up to so many factors leave a term of order three or less."""


@dataclass(frozen=True, slots=True)
class NewCurve:
    """A curve of bifurcations that begins at a point of codimension two.

    Attributes
    ----------
    kind
        Label of its kind; where an orbit touches a stop, that of the touch.
    period
        Period of the orbits on it, in iterates of the map whose forms were given, >= 1. For the half map
        of a symmetric orbit two iterates are one period of the full map.
    neutral_saddle
        Whether it is a curve of neutral saddles, a real pair nu, 1 / nu, which solves the equations
        of NS without being a bifurcation.

    Examples
    --------
    >>> str(NewCurve("SN", 4))
    'SN of period 4'
    """

    kind: str
    period: Count
    neutral_saddle: bool = False

    def __str__(self) -> str:
        name = "neutral saddle" if self.neutral_saddle else self.kind
        return name if self.period == 1 else f"{name} of period {self.period}"


NO_CURVES: tuple[NewCurve, ...] = ()


@dataclass(frozen=True, eq=False)
class CodimensionTwo:
    """Normal form at a point of codimension two: its coefficients, and what is born there.

    Attributes
    ----------
    kind
        CP, GPD, CH, R1 to R4, LPPD, LPNS, PDNS or NSNS.
    numbers
        Coefficients and invariants by their letters, which the function of the kind states, for
        |q| = 1. Each is an attribute too: ``form.a``.
    vectors
        Critical eigenvectors and second-order terms of the centre manifold by their letters, shape
        (dimension,); attributes too.
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether all multipliers that are not critical lie inside the unit circle.
    meaning
        One sentence: what is born at the point.
    switchable
        Curves of bifurcations of periodic orbits that begin here, besides those that cross.
    why_not
        A sentence where ``switchable`` is empty; else an empty string.
    """

    kind: str
    numbers: Mapping[str, Any]
    vectors: Mapping[str, NDArray[Any]] = field(repr=False)
    multipliers: AnyComplexes = field(repr=False)
    others_inside: bool
    meaning: str = ""
    switchable: tuple[NewCurve, ...] = NO_CURVES
    why_not: str = ""

    def __getattr__(self, letter: str) -> Any:
        for letters in (vars(self).get("numbers", {}), vars(self).get("vectors", {})):
            if letter in letters:
                return letters[letter]
        raise AttributeError(f"{letter!r}: a normal form of this kind has no such coefficient.")

    def born(self, meaning: str, *switchable: NewCurve, why_not: str = "", **numbers: Any) -> Self:
        """Copy with the curves that begin at the point, and further numbers."""
        numbers = {**self.numbers, **numbers}
        return replace(
            self, numbers=numbers, meaning=meaning, switchable=switchable, why_not=why_not
        )


def vanishing(form: NormalForm, *checks: tuple[str, float, float, str]) -> Refusal | None:
    """Refuse the first of (name, value, scale, meaning) that is zero to half of the digits."""
    refused = (zero(n, v, s, Status.DEGENERATE, why, form) for n, v, s, why in checks)
    return next((r for r in refused if r is not None), None)


def critical_multipliers(of: PointKind, A: Floats) -> tuple[Critical, ...] | Refusal:
    """Find several critical multipliers of a Jacobian.

    Parameters
    ----------
    of
        Kind of the point, with the critical multipliers wanted. Pairs are returned by their angle,
        the smaller first.
    A
        Jacobian, shape (d, d).

    Returns
    -------
    tuple of Critical or Refusal
        In the order wanted; ``others`` of each are those that are not critical. Refused as
        NOT_SMOOTH, NOT_CRITICAL, OTHERS_CRITICAL, or STRONG_RESONANCE where a product of up to
        four critical multipliers is 1 without need.

    Notes
    -----
    Cost: one eigenvalue problem.
    """
    wanted, kind = of.critical, of.label
    rough = rough_jacobian(kind, A)
    if rough:
        return rough
    values, left, right = vectors(A)
    places: list[int] = []
    allowed = AT_THE_POINT if 1.0 in wanted else ON_CIRCLE
    for target in wanted:
        off = distance(values, target)
        off[places] = np.inf
        places.append(int(np.argmin(off)))
        if not off[places[-1]] <= allowed:
            return _missing(kind, target, values)
    reals = [at for at, target in zip(places, wanted, strict=True) if target is not None]
    pairs = sorted(set(places) - set(reals), key=lambda at: float(np.angle(values[at])))
    taken = {*places, *(partner(values, at) for at in pairs)}
    others = np.delete(values, sorted(taken))
    refused = _crowded(kind, wanted, others, values) or _resonant(kind, wanted, values, pairs)
    if refused:
        return refused
    return tuple(
        Critical(complex(values[at]), *normalised(right[:, at], left[:, at]), values, others)
        for at in reals + pairs
    )


def _missing(kind: str, target: float | None, values: Complexes) -> Refusal:
    reason = (
        f"{kind} needs {described(target)} besides the other critical ones; the multipliers are "
        f"{listed(values)}."
    )
    return Refusal(kind, Status.NOT_CRITICAL, reason, values)


def _crowded(
    kind: str, wanted: tuple[float | None, ...], others: Complexes, values: Complexes
) -> Refusal | None:
    """Refusal where a multiplier that is not wanted is critical, or one wanted is not simple."""
    near = np.abs(np.abs(others) - 1.0) <= ON_CIRCLE
    for target in wanted:
        if target is not None:
            near |= np.abs(others - target) <= AT_THE_POINT
    if not np.any(near):
        return None
    reason = (
        f"{kind} needs every other multiplier off the unit circle; also critical: "
        f"{listed(others[near])}."
    )
    return Refusal(kind, Status.OTHERS_CRITICAL, reason, values)


def _resonant(
    kind: str, wanted: tuple[float | None, ...], values: Complexes, pairs: list[int]
) -> Refusal | None:
    """Refusal where (-1)^m nu1^k nu2^l = 1 with m + |k| + |l| <= 4: such terms do not go away."""
    nus = [complex(values[at] / abs(values[at])) for at in pairs]
    reach = range(-STRONGEST_SUM, STRONGEST_SUM + 1)
    for m, *powers in itertools.product(range(1 + (-1.0 in wanted)), *[reach] * len(nus)):
        if not any(powers) or m + sum(map(abs, powers)) > STRONGEST_SUM:
            continue
        factors = [(nu, k) for nu, k in zip(nus, powers, strict=True) if k]
        off = abs((-1.0) ** m * math.prod((nu**k for nu, k in factors), start=1) - 1.0)
        if off <= ON_CIRCLE:
            text = " ".join(["-1"] * m + [f"({nu:.6g})^{k}" for nu, k in factors])
            reason = (
                f"{kind} needs multipliers without a resonance of order four or less, but "
                f"{text} = 1 (off by {off:.2g}): the normal form has more terms."
            )
            return Refusal(kind, Status.STRONG_RESONANCE, reason, values)
    return None
