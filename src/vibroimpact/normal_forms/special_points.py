"""What all points of codimension two share: critical multipliers, solves, and what is born.

Method      several critical multipliers nu_k at once, A q_k = nu_k q_k, A^T p_k = conj(nu_k) p_k,
            |q_k| = 1, <p_k, q_k> = 1, each with the sign or phase of critical.py            (1)
            second-order terms h of the centre manifold, of a monomial with the factor mu:
                (mu I - A) h = r              where mu is no multiplier,                     (2)
                (mu I - A) h = r - <p, r> q,  <p, h> = 0   where mu is the one of q and p    (3)
Assumes     nothing: hypotheses are checked
Accuracy    rounding times |p_k|, and the conditions of (2) and of (3) bordered by q and p
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
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.linalg

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.critical import (
    NOT_FINITE,
    ON_CIRCLE,
    Critical,
    NormalForm,
    Refusal,
    Status,
    normalised,
    partner,
    zero,
)

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
        "SN" or "NS".
    period
        Of the orbits on it, in iterates of the map whose forms were given, >= 1. For the half map
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
    period: int
    neutral_saddle: bool = False

    def __str__(self) -> str:
        name = "neutral saddle" if self.neutral_saddle else self.kind
        return name if self.period == 1 else f"{name} of period {self.period}"


NO_CURVES: tuple[NewCurve, ...] = ()


@runtime_checkable
class CodimensionTwo(NormalForm, Protocol):
    """Normal form of codimension two, with what it means and where one can go from it."""

    @property
    def meaning(self) -> str:
        """One sentence: what is born at the point."""

    @property
    def switchable(self) -> tuple[NewCurve, ...]:
        """Curves of bifurcations of periodic orbits that begin here, besides those that cross."""

    @property
    def why_not(self) -> str:
        """A sentence where ``switchable`` is empty; else an empty string."""


@dataclass(frozen=True)
class Sized:
    """A coefficient and the size of the terms whose sum it is."""

    value: complex
    scale: float


def sized(p: Complexes | Floats, divisor: float, *terms: Complexes | Floats) -> Sized:
    """Return <p, sum of the terms> / divisor with its scale."""
    length = float(np.linalg.norm(p)) / divisor
    scale = length * sum(float(np.linalg.norm(term)) for term in terms)
    return Sized(complex(np.vdot(p, sum(terms))) / divisor, scale)


def vanishing(form: NormalForm, *checks: tuple[str, float, float, str]) -> Refusal | None:
    """Refuse the first of (name, value, scale, meaning) that is zero to half of the digits."""
    refused = (zero(n, v, s, Status.DEGENERATE, why, form) for n, v, s, why in checks)
    return next((r for r in refused if r is not None), None)


def off(A: Floats, mu: complex, right: Complexes | Floats) -> Complexes:
    """The solution of (2)."""
    return np.asarray(np.linalg.solve(mu * np.eye(len(A)) - A, right), np.complex128)


def along(A: Floats, critical: Critical, right: Complexes | Floats) -> Complexes:
    """The solution of (3), with mu = the multiplier of ``critical`` brought to the circle."""
    n, q, p = len(A), critical.q, critical.p
    bordered = np.zeros((n + 1, n + 1), dtype=np.complex128)
    bordered[:n, :n] = on_circle(critical) * np.eye(n) - A
    bordered[:n, n], bordered[n, :n] = q, p.conj()
    return np.asarray(np.linalg.solve(bordered, np.append(right, 0.0))[:n], np.complex128)


def on_circle(critical: Critical) -> complex:
    """The critical multiplier brought to the unit circle."""
    return critical.multiplier / abs(critical.multiplier)


def critical_multipliers(
    kind: str, A: Floats, wanted: tuple[float | None, ...]
) -> tuple[Critical, ...] | Refusal:
    """Find several critical multipliers of a Jacobian.

    Parameters
    ----------
    kind
        Kind of the point, for the text of a refusal.
    A
        Jacobian, shape (d, d).
    wanted
        For each +1.0 or -1.0, or None for a pair that is not real. Pairs are returned by their
        angle, the smaller first.

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
    if not np.all(np.isfinite(A)):
        unknown = np.full(len(A), np.nan, dtype=np.complex128)
        return Refusal(kind, Status.NOT_SMOOTH, f"the Jacobian {NOT_FINITE}", unknown)
    values, left, right = scipy.linalg.eig(A, left=True, right=True)
    places: list[int] = []
    allowed = AT_THE_POINT if 1.0 in wanted else ON_CIRCLE
    for target in wanted:
        distance = _distance(values, target, places)
        places.append(int(np.argmin(distance)))
        if not distance[places[-1]] <= allowed:
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


def _distance(values: Complexes, target: float | None, taken: list[int]) -> Floats:
    """Distance of each multiplier from the one wanted; infinite if it is taken."""
    if target is None:
        distance = np.where(values.imag > 0.0, np.abs(np.abs(values) - 1.0), np.inf)
    else:
        distance = np.abs(values - target)
    distance[taken] = np.inf
    return np.asarray(distance, np.float64)


def _missing(kind: str, target: float | None, values: Complexes) -> Refusal:
    wanted = "a pair on the unit circle" if target is None else f"a multiplier {target:+.0f}"
    named = ", ".join(f"{value:.9g}" for value in values)
    reason = f"{kind} needs {wanted} besides the other critical ones; the multipliers are {named}."
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
    named = ", ".join(f"{other:.9g}" for other in others[near])
    reason = f"{kind} needs every other multiplier off the unit circle; also critical: {named}."
    return Refusal(kind, Status.OTHERS_CRITICAL, reason, values)


def _resonant(
    kind: str, wanted: tuple[float | None, ...], values: Complexes, pairs: list[int]
) -> Refusal | None:
    """Refusal where (-1)^m nu1^k nu2^l = 1 with m + |k| + |l| <= 4: such terms do not go away."""
    signs = (1.0, -1.0) if -1.0 in wanted else (1.0,)
    nus = [complex(values[at] / abs(values[at])) for at in pairs]
    reach = range(-STRONGEST_SUM, STRONGEST_SUM + 1)
    for sign in signs:
        room = STRONGEST_SUM - (sign < 0.0)
        for powers in itertools.product(reach, repeat=len(nus)):
            if not 0 < sum(map(abs, powers)) <= room:
                continue
            product = sign * math.prod((nu**k for nu, k in zip(nus, powers, strict=True)), start=1)
            if abs(product - 1.0) <= ON_CIRCLE:
                factors = [f"({nu:.6g})^{k}" for nu, k in zip(nus, powers, strict=True) if k]
                text = " ".join((["-1"] if sign < 0.0 else []) + factors)
                reason = (
                    f"{kind} needs multipliers without a resonance of order four or less, but "
                    f"{text} = 1 (off by {abs(product - 1.0):.2g}): the normal form has more terms."
                )
                return Refusal(kind, Status.STRONG_RESONANCE, reason, values)
    return None
