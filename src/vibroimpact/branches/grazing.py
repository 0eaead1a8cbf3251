"""Grazing points of a branch of orbits: a gap's extremum within a flight reaches zero.

Method      For each stop and each flight the least gap at interior extrema (admissibility.py) is a
            continuous function L of the curve's arclength, smooth except where another extremum
            becomes the least; own extrema of impacts, which appear and vanish at speed zero, are
            left out. Where L changes sign between neighbouring points, its zero is found by Brent's
            method, every value at an orbit corrected on the curve, from the zero of a polynomial through
            the points around, and from the shares of mirror images. Where L has a minimum above zero
            among the points, it is minimised between its neighbours, to find two zeros closer than
            the points.                                                                       (1)
            It is a grazing if L is zero there, at an extremum: neither a jump of L nor the gap at
            another contact's impact. Where an impact speed vanishes, an extremum begins or ends
            in that impact: that point is a touch of kind ZERO.                                     (2)
Assumes     L has no more than one minimum between two points, which resolve the curve to 1e-8
Accuracy    1e-12 of the distance of two points
Fails       ``Unresolved``: an orbit on the way that Newton's method does not reach or that has no
            such extremum; a zero that (2) refuses
Reference   theory.md, "Branches"
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import NamedTuple, Protocol

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.branches.family import SPEED
from vibroimpact.branches.verify import VANISHED_OF_LARGEST
from vibroimpact.compile.prescribed import GAP_WATCH, PHASE, End
from vibroimpact.continuation import Curve, LocatedPoint, Unresolved
from vibroimpact.continuation.expansion import Function, brent
from vibroimpact.continuation.newton import Node, correct
from vibroimpact.continuation.problem import Problem, scaled
from vibroimpact.model.stop import Stop
from vibroimpact.orbits.admissibility import Nearest, Place
from vibroimpact.orbits.maps import NO_TIME_OF_PERIOD
from vibroimpact.orbits.newton import guard_sizes, scale_of
from vibroimpact.orbits.orbit import Orbit

TEST = "gap"  # name of the least gap as a test function
FINEST_OF_DISTANCE = 1e-13  # a point is known so well, relative to the distance of two points
# a curve that turns further between two points is followed along the chord
LEAST_COSINE_SQUARED = 0.25
NEIGHBOURS = 6  # points of the polynomial from whose zero the search begins
LEAST_NEIGHBOURS = 4
NARROWEST_BRACKET = 1e-9  # half of a bracket around that zero, as a share of the distance, at least
WIDENING_FACTOR = 16.0  # it is widened by this factor where L does not change its sign in it
UNKNOWN = "the least gap is not known all the way between two points"
# An extremum that is so near to an impact on the same stop, relative to the shortest flight, belongs to it.
EDGE_OF_SHORTEST_FLIGHT = 1e-2


class Grazing(NamedTuple):
    """Orbit on the curve that touches a stop without impact."""

    point: LocatedPoint  # crossing +1 where the gap opens with the arclength
    orbit: Orbit
    nearest: Nearest


class OrbitCurve(Problem, Protocol):
    """Problem whose solutions are orbits."""

    def orbit(self, z: Floats, p: float) -> Orbit:
        """Orbit at a point of the curve."""
        ...


class _Between:
    """Orbits between two neighbouring points of a curve, by their share of the distance."""

    def __init__(
        self, family: OrbitCurve, curve: Curve, i: int, bounds: tuple[float, float]
    ) -> None:
        self.family, self.curve, self.i = family, curve, i
        self.problem = scaled(family, bounds)
        ends = [self.problem.scaled(curve.z[k], curve.parameter[k]) for k in (i, i + 1)]
        self.start, self.step = ends[0], ends[1] - ends[0]
        self.size = float(self.step @ self.step)
        self.turns = [self._turn(curve.tangent[k]) for k in (i, i + 1)]
        self.known: dict[float, tuple[Node, Orbit] | None] = {}

    def _turn(self, tangent: Floats) -> Floats:
        """What the direction at a point has beside the chord; zero where it is nearly across the chord."""
        unit = self.problem.unit(tangent)
        along = float(self.step @ unit)
        if along**2 < LEAST_COSINE_SQUARED * self.size:
            return np.zeros_like(unit)
        turn: Floats = unit * (self.size / along) - self.step
        return turn

    def at(self, share: float) -> tuple[Node, Orbit] | None:
        """Point and orbit at this share, kept; None where Newton's method does not converge.

        It begins on the cubic through both points along the curve's directions there.
        """
        if share not in self.known:
            bend = (1.0 - share) * self.turns[0] - share * self.turns[1]
            guess = self.start + share * self.step + share * (1.0 - share) * bend
            target = float(self.step @ self.start) + share * self.size
            node = correct(self.problem, guess, self.step, target).node
            orbit = node and self.family.orbit(*self.problem.solution(node.y))
            self.known[share] = (node, orbit) if node and orbit else None
        return self.known[share]

    def place_of(self, k: int) -> float:
        """Share of the distance at which the projection of another point of the curve is."""
        y = self.problem.scaled(self.curve.z[k], self.curve.parameter[k])
        return float(self.step @ (y - self.start)) / self.size

    def unresolved(self, reason: str) -> Unresolved | None:
        """Part between the two points in which a grazing may be missed, unless (2) excludes it."""
        speeds = [f for name, f in self.curve.tests.items() if name.startswith(SPEED)]
        if any(f[self.i] * f[self.i + 1] <= 0.0 for f in speeds):
            return None
        return Unresolved(TEST, self.i, self.i + 1, reason)


class _Gap:
    """L of one stop and flight between two neighbouring points, at which it is known."""

    def __init__(self, between: _Between, place: Place, values: Floats) -> None:
        self.between, self.place, self.values = between, place, values
        i = between.i
        self.ends = {0.0: float(values[i]), 1.0: float(values[i + 1])}

    def __call__(self, share: float) -> float:
        """L at this share: NaN where the orbit is unknown, infinite without such an extremum."""
        if share in self.ends:
            return self.ends[share]
        found = self.between.at(share)
        if not found or not found[1].converged:
            return math.nan
        gaps = found[1].gaps
        return gaps[self.place].gap if self.place in gaps else math.inf

    def zero(self, low: float, high: float) -> float:
        """A zero in a bracket; NaN where a value on the way is none."""
        return brent(self, *self._narrowed(*self._between_known(low, high)))

    def _between_known(self, low: float, high: float) -> tuple[float, float]:
        """The shares that are known already between which the sign changes.

        Where a mirror image of this stop or flight has been touched they are close.
        """
        shares = [low, *sorted(x for x in self.between.known if low < x < high), high]
        pairs = itertools.pairwise(shares)
        return next((pair for pair in pairs if self(pair[0]) * self(pair[1]) <= 0.0), (low, high))

    def _narrowed(self, low: float, high: float) -> tuple[float, float]:
        """A smaller bracket, around the zero of a polynomial through neighbouring points."""
        i, count = self.between.i, len(self.values)
        first = max(0, min(i - 2, count - NEIGHBOURS))
        near = [
            k for k in range(first, min(first + NEIGHBOURS, count)) if np.isfinite(self.values[k])
        ]
        at = np.array([self.between.place_of(k) for k in near])
        if len(near) < LEAST_NEIGHBOURS or np.any(np.diff(at) <= 0.0):
            return low, high
        fewer = slice(1, None) if i - near[0] > 1 else slice(-1)
        share, other = (
            brent(_through(at[part], self.values[near][part]), low, high)
            for part in (slice(None), fewer)
        )
        width = abs(share - other) + NARROWEST_BRACKET
        while True:
            bracket = max(low, share - width), min(high, share + width)
            if bracket == (low, high) or not self(bracket[0]) * self(bracket[1]) > 0.0:
                return bracket
            width *= WIDENING_FACTOR

    def grazing(self, share: float, crossing: int) -> Grazing | Unresolved | None:
        """Orbit at this share, if it grazes (2)."""
        found = self.between.at(share)
        if found is None:
            return self.between.unresolved(UNKNOWN)
        node, orbit = found
        nearest = orbit.gaps.get(self.place) if orbit.converged else None
        if nearest is None:
            return self.between.unresolved(UNKNOWN)
        if belongs_to_impact(orbit, nearest):
            return None
        if why := _no_touch(orbit, nearest):
            return self.between.unresolved(why)
        z, p = self.between.problem.solution(node.y)
        begun, ended = self.between.curve.arclength[self.between.i :][:2]
        at = float(begun + share * (ended - begun))
        tangent = node.tangent * self.between.problem.sizes
        step = float(np.linalg.norm(self.between.step))
        error = abs(tangent[-1]) * step * FINEST_OF_DISTANCE + math.ulp(p)
        point = LocatedPoint(
            test=TEST,
            parameter=p,
            z=z,
            tangent=tangent,
            arclength=at,
            error=error,
            crossing=crossing,
        )
        return Grazing(point, orbit, nearest)


def belongs_to_impact(orbit: Orbit, nearest: Nearest) -> bool:
    """Whether a gap vanishes for another reason: zero speed of an impact, two impacts at once."""
    k, stop = nearest.segment, (nearest.contact, nearest.side)
    durations = np.delete(orbit.durations, [*orbit.problem.at_once])
    if np.abs(durations).min() < NO_TIME_OF_PERIOD * float(np.abs(durations).sum()):
        return True  # two impacts at once: SIM
    edge = EDGE_OF_SHORTEST_FLIGHT * float(durations.min())
    begun, ended = orbit.signature.impacts[k], orbit.signature.solved[k]
    if nearest.watch != GAP_WATCH:  # guards of an element change with its state
        begun, ended = (Stop(end.contact, nearest.side) for end in (begun, ended))
    left = float(orbit.durations[k]) - nearest.time
    return (nearest.time < edge and stop == begun) or (left < edge and stop == ended)


def _no_touch(orbit: Orbit, nearest: Nearest) -> str:
    """Reason why a change of sign of a least gap is no touch; "" where it is one."""
    problem, k = orbit.problem, nearest.segment
    sizes = scale_of(problem, problem.packed(orbit.states, orbit.durations))
    end = End(nearest.contact, nearest.side, problem.modes[k], nearest.watch)
    if abs(nearest.gap) > VANISHED_OF_LARGEST * guard_sizes(problem, sizes, [end])[0]:
        return f"a least gap changes its sign by a jump: {nearest}"
    ends = {0.0: orbit.signature.impacts[k], float(orbit.durations[k]): orbit.signature.solved[k]}
    if nearest.time in ends and ends[nearest.time].contact != PHASE:
        return f"two impacts at once, one of them not among the prescribed: {nearest}"
    return ""


def _through(at: Floats, values: Floats) -> Function:
    """The polynomial with these values at these places."""
    fitted = np.polynomial.Polynomial.fit(at, values, len(at) - 1)
    return lambda share: float(fitted(share))


def grazings(
    family: OrbitCurve,
    curve: Curve,
    gaps: Sequence[Mapping[Place, Nearest]],
    bounds: tuple[float, float],
) -> Iterator[Grazing | Unresolved]:
    """Every grazing of a curve, and parts that may hold one, from the least gaps at its points."""
    places = sorted({place for here in gaps for place in here if not place.own})
    values = [
        np.array([here[place].gap if place in here else math.inf for here in gaps])
        for place in places
    ]
    for i in range(len(gaps) - 1):
        between = cache(lambda i: _Between(family, curve, i, bounds))  # of all places
        for place, gap in zip(places, values, strict=True):
            if np.isfinite(gap[i : i + 2]).all():
                yield from _within(between, place, curve.arclength, gap, i)


def _within(
    between: Callable[[int], _Between], place: Place, arclength: Floats, gaps: Floats, i: int
) -> Iterator[Grazing | Unresolved]:
    """Grazings between points i and i + 1 (1)."""
    from scipy.optimize import minimize_scalar

    if _crosses(gaps, i):
        yield from _zero(_Gap(between(i), place, gaps), 0.0, 1.0)
    elif gaps[i] > 0.0 and _dips(arclength, gaps, i):
        gap = _Gap(between(i), place, gaps)
        most = float(gaps[i : i + 2].max())  # where L is infinite, its extremum has vanished
        low = minimize_scalar(
            lambda share: min(gap(share), most), bounds=(0.0, 1.0), method="bounded"
        )
        if not low.fun >= 0.0:
            yield from _zero(gap, 0.0, float(low.x))
            yield from _zero(gap, float(low.x), 1.0)


def _crosses(gaps: Floats, i: int) -> bool:
    """Whether the least gap changes its sign between points i and i + 1; at i + 1 if it ends there.

    A gap that is zero to the last digit has no sign: that before counts.
    """
    low, high = gaps[i : i + 2]
    if high == 0.0:
        return bool(low != 0.0 and i + 2 == len(gaps))
    return bool(low * high < 0.0 or (low == 0.0 and (i == 0 or gaps[i - 1] * high < 0.0)))


def _dips(arclength: Floats, gaps: Floats, i: int) -> bool:
    """Whether the least gap may have a minimum below zero between points i and i + 1.

    Where it is convex it lies above the chords from both sides, extended to where they meet.
    """
    if not 0 < i < len(gaps) - 2:
        return False
    fall, rise = (
        float((gaps[k + 1] - gaps[k]) / (arclength[k + 1] - arclength[k])) for k in (i - 1, i + 1)
    )
    if not fall < 0.0 < rise:
        return False
    if not (math.isfinite(fall) and math.isfinite(rise)):
        return True
    whole = float(arclength[i + 1] - arclength[i])
    meet = (rise * whole - float(gaps[i + 1] - gaps[i])) / (rise - fall)
    return float(gaps[i]) + fall * min(max(meet, 0.0), whole) < 0.0


def _zero(gap: _Gap, low: float, high: float) -> Iterator[Grazing | Unresolved]:
    at_low, at_high = gap(low), gap(high)
    if at_low * at_high > 0.0:
        return
    share = gap.zero(low, high)
    crossing = 1 if at_high > at_low else -1
    found = (
        gap.grazing(share, crossing) if math.isfinite(share) else gap.between.unresolved(UNKNOWN)
    )
    if found is not None:
        yield found
