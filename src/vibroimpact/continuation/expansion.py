"""Expansions of functions on an interval, and their changes of sign.

Method      f(s) = sum_k c_k T_k(x), s = middle + half x, through x_j = -cos(pi j / K)    (1)
            f changes sign once between two neighbouring extrema of opposite signs, and nowhere
            else; extrema are the zeros of the series of f' (colleague matrix)                   (2)
            an extremum whose value is below the error of (1) is doubtful: f itself is expanded
            once more on an interval around it, just wide enough for f to exceed the error       (3)
Assumes     f analytic; the last coefficients bound the truncation error of (1)
Accuracy    two zeros of f that are 1e-7 of the interval apart are separated by (3); closer
            ones, and a double zero, are a touch: no change of sign
Reference   [trefethen2013] ch. 3, 8, 18
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev as series

from vibroimpact._core.chebyshev import real_zeros
from vibroimpact._core.types import Floats

DEGREE = 12  # K of (1): the cheapest for curves resolved to 1e-8; 10 and 14 cost 5 to 10 % more
# The last two coefficients measure the truncation error, for f may be even or odd.
TAIL_COEFFICIENTS = 2
# An extremum is doubtful below so many times the largest of the last coefficients; of more than the
# last two, for these may be small by chance where there is rounding: it affects all coefficients
# equally, and 13 of one size add up.
DOUBT_FACTOR = 16.0
LAST_COEFFICIENTS = 4
ERRORS_AT_EDGE = 30.0  # the interval of (3) ends where f is so many times the error
NARROWING_SHARE = 0.9  # (3) is repeated only if the interval shrinks to this share of itself
# On such an interval f is nearly a parabola: coefficients from this degree on are rounding.
FIRST_ROUNDED_DEGREE = 5
# So many expansions are nested at most; each gains the square root of the error.
DEEPEST_EXPANSIONS = 3
# f is rounded by so much at least, relative to its size.
ROUNDING_OF_VALUES = 16.0 * float(np.finfo(float).eps)

Function = Callable[[float], float]
Edge = tuple[float, float]  # a point and the value of f there


def _lobatto() -> tuple[Floats, Floats]:
    points: Floats = -np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
    points[DEGREE // 2] = 0.0
    return points, np.asarray(np.linalg.inv(series.chebvander(points, DEGREE)), dtype=float)


LOBATTO_POINTS, TO_COEFFICIENTS = _lobatto()


def positions(low: float, high: float) -> Floats:
    """The points of (1) in [low, high], both ends included exactly."""
    s: Floats = (low + high) / 2.0 + (high - low) / 2.0 * LOBATTO_POINTS
    s[0], s[-1] = low, high
    return s


@dataclass(frozen=True)
class Expansion:
    """Functions by their values at the points (1) of an interval."""

    # the interval
    low: float
    high: float
    values: Floats  # shape (K + 1,) or (K + 1, m)

    @cached_property
    def coefficients(self) -> Floats:
        """The c_k of (1), shape of ``values``."""
        return TO_COEFFICIENTS @ self.values

    @property
    def tail(self) -> Floats:
        """Size of the truncation error of (1), for each function."""
        return np.asarray(np.abs(self.coefficients[-TAIL_COEFFICIENTS:]).max(axis=0))

    def _x(self, s: float) -> float:
        return (2.0 * s - self.low - self.high) / (self.high - self.low)

    def at(self, s: float) -> Floats:
        """Value of the series at s."""
        return np.asarray(series.chebval(self._x(s), self.coefficients))

    def slope(self, s: float) -> Floats:
        """Derivative of the series by s."""
        rate = series.chebval(self._x(s), series.chebder(self.coefficients))
        return np.asarray(rate * (2.0 / (self.high - self.low)))

    def integral(self) -> Floats:
        """Integral of the series from low to each of the points (1)."""
        whole = series.chebint(self.coefficients, lbnd=-1) * ((self.high - self.low) / 2.0)
        values: Floats = series.chebval(LOBATTO_POINTS, whole)
        return values

    def extrema(self) -> list[float]:
        """Zeros of f' strictly inside (2), for one function."""
        slopes = series.chebder(self.coefficients)
        kept = np.abs(slopes) > np.finfo(float).eps * np.abs(slopes).max(initial=0.0)
        x = real_zeros(np.where(kept, slopes, 0.0))
        s = (self.low + self.high) / 2.0 + (self.high - self.low) / 2.0 * x
        return sorted({float(at) for at in s if self.low < at < self.high})


def edges(f: Expansion, true: Function) -> list[Edge]:
    """Points between which f is monotone, with values whose signs are certain (2), (3).

    Parameters
    ----------
    f
        Expansion of one function.
    true
        The function itself, evaluated only where the expansion is in doubt.

    Returns
    -------
    list of (s, value)
        From the lower to the upper end; the value is 0 at a touch.
    """
    size = np.abs(f.coefficients)
    error = DOUBT_FACTOR * float(size[-LAST_COEFFICIENTS:].max()) + ROUNDING_OF_VALUES * float(
        np.abs(f.values).max()
    )
    if size[0] - size[1:].sum() > error:  # |T_k| <= 1: of one sign
        return [(f.low, float(f.values[0])), (f.high, float(f.values[-1]))]
    return _edges(f, true, error, DEEPEST_EXPANSIONS)


def _edges(f: Expansion, true: Function, error: float, depth: int) -> list[Edge]:
    extrema = [(s, float(f.at(s))) for s in f.extrema()]
    found: list[Edge] = [(f.low, float(f.values[0]))]
    last = (f.high, float(f.values[-1]))
    for certain, group in itertools.groupby(extrema, lambda edge: abs(edge[1]) > error):
        these = list(group)
        if certain:
            found += these
            continue
        after = next((s for s, _ in extrema if s > these[-1][0]), f.high)
        low = _exceeding(f, these[0][0], found[-1][0], ERRORS_AT_EDGE * error)
        high = _exceeding(f, these[-1][0], after, ERRORS_AT_EDGE * error)
        if depth == 0 or high - low > NARROWING_SHARE * (f.high - f.low):
            found += [(s, 0.0) for s, _ in these]
        else:
            found += _closer(low, high, true, depth)
    return [*found, last]


def _exceeding(f: Expansion, s: float, end: float, size: float) -> float:
    """Nearest point to s, towards ``end``, at which f has this size; or ``end``."""
    width = math.copysign((f.high - f.low) * float(np.finfo(float).eps) ** 0.5, end - s)
    while abs(width) < abs(end - s):
        if abs(float(f.at(s + width))) > size:
            return s + width
        width *= 2.0
    return end


def _closer(low: float, high: float, true: Function, depth: int) -> list[Edge]:
    """The edges of f between two points, from values of f itself (3)."""
    values = np.array([true(float(s)) for s in positions(low, high)])
    f = Expansion(low, high, values)
    rounding = float(np.abs(f.coefficients[FIRST_ROUNDED_DEGREE:]).max())
    return _edges(
        f,
        true,
        DOUBT_FACTOR * rounding + ROUNDING_OF_VALUES * float(np.abs(values).max()),
        depth - 1,
    )


def zero_between(f: Expansion, a: float, b: float) -> float:
    """The zero of the expansion of one function between two points of opposite signs."""
    return brent(lambda s: float(f.at(s)), a, b)


def brent(f: Function, a: float, b: float) -> float:
    """Zero of f in a bracket, to rounding of b; where f has one sign, the end at which it is smaller.

    NaN if a value of f is not finite.
    """
    from scipy.optimize import brentq

    if f(a) * f(b) >= 0.0:
        return min((b, a), key=lambda s: abs(f(s)))
    accuracy = float(np.finfo(float).eps)
    try:
        root, _ = brentq(
            f, a, b, xtol=accuracy * abs(b), rtol=4.0 * accuracy, full_output=True, disp=False
        )
    except ValueError:  # brentq met NaN
        return float("nan")
    return float(root)


def first_zero(f: Expansion) -> float | None:
    """The first change of sign of the expansion of one function."""
    for a, b in sign_changes(edges(f, lambda s: float(f.at(s)))):
        return zero_between(f, a, b)
    return None


def sign_changes(found: Sequence[Edge], before: float = 0.0) -> list[tuple[float, float]]:
    """Intervals in which the sign changes, among edges in order.

    A value 0 has no sign of its own. ``before`` is the sign that f had before the first edge.
    """
    signed = [edge for edge in found if edge[1] != 0.0]
    if signed and before * signed[0][1] < 0.0 and found[0][1] == 0.0:
        signed.insert(0, (found[0][0], before))
    return [(a, b) for (a, u), (b, v) in itertools.pairwise(signed) if u * v < 0.0]
