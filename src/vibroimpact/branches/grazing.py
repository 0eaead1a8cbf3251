"""Grazing points of a branch of orbits: a gap's extremum within a flight reaches zero.

Method      For each stop and each flight the least gap at interior extrema (admissibility.py) is a
            continuous function L of the curve's arclength, smooth except where another extremum
            becomes the least; own extrema of impacts, which appear and vanish at speed zero, are
            left out. Where L changes sign between neighbouring points, its zero is found by Brent's
            method, every value at an orbit corrected on the curve. Where L has a minimum above zero
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

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.branches.family import SPEED
from vibroimpact.branches.verify import VANISHED_OF_LARGEST
from vibroimpact.compile.prescribed import GAP_WATCH, PHASE, End
from vibroimpact.continuation import Curve, LocatedPoint, Unresolved
from vibroimpact.continuation.expansion import brent
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
UNKNOWN = "the least gap is not known all the way between two points"
# An extremum that is so near to an impact on the same stop, relative to the flight, belongs to it.
EDGE_OF_FLIGHT = 1e-2


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
        self, family: OrbitCurve, curve: Curve, i: int, bounds: tuple[float, float], place: Place
    ) -> None:
        self.family, self.curve, self.i, self.place = family, curve, i, place
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

    def gap(self, share: float) -> float:
        """L at this share: NaN where the orbit is unknown, infinite without such an extremum."""
        found = self.at(share)
        if not found or not found[1].converged:
            return math.nan
        gaps = found[1].gaps
        return gaps[self.place].gap if self.place in gaps else math.inf

    def grazing(self, share: float, crossing: int) -> Grazing | Unresolved | None:
        """Orbit at this share, if it grazes (2)."""
        found = self.at(share)
        if found is None:
            return self.unresolved(UNKNOWN)
        node, orbit = found
        nearest = orbit.gaps.get(self.place) if orbit.converged else None
        if nearest is None:
            return self.unresolved(UNKNOWN)
        if belongs_to_impact(orbit, nearest):
            return None
        if why := _no_touch(orbit, nearest):
            return self.unresolved(why)
        z, p = self.problem.solution(node.y)
        length = self.curve.arclength
        at = float(length[self.i] + share * (length[self.i + 1] - length[self.i]))
        tangent = node.tangent * self.problem.sizes
        moved = abs(tangent[-1]) * float(np.linalg.norm(self.step)) * FINEST_OF_DISTANCE
        error = moved + math.ulp(p)
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

    def unresolved(self, reason: str) -> Unresolved | None:
        """Part between the two points in which a grazing may be missed, unless (2) excludes it."""
        speeds = [f for name, f in self.curve.tests.items() if name.startswith(SPEED)]
        if any(f[self.i] * f[self.i + 1] <= 0.0 for f in speeds):
            return None
        return Unresolved(TEST, self.i, self.i + 1, reason)


def belongs_to_impact(orbit: Orbit, nearest: Nearest) -> bool:
    """Whether a gap vanishes for another reason: zero speed of an impact, two impacts at once."""
    k, stop = nearest.segment, (nearest.contact, nearest.side)
    if np.abs(orbit.durations).min() < NO_TIME_OF_PERIOD * float(np.abs(orbit.durations).sum()):
        return True  # two impacts at once: SIM
    share = nearest.time / float(orbit.durations[k])
    begun, ended = orbit.signature.impacts[k], orbit.signature.solved[k]
    if nearest.watch != GAP_WATCH:  # guards of an element change with its state
        begun, ended = (Stop(end.contact, nearest.side) for end in (begun, ended))
    return (share < EDGE_OF_FLIGHT and stop == begun) or (
        share > 1.0 - EDGE_OF_FLIGHT and stop == ended
    )


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


def grazings(
    family: OrbitCurve,
    curve: Curve,
    gaps: Sequence[Mapping[Place, Nearest]],
    bounds: tuple[float, float],
) -> Iterator[Grazing | Unresolved]:
    """Every grazing of a curve, and parts that may hold one, from the least gaps at its points."""
    for place in sorted({place for here in gaps for place in here if not place.own}):
        values = np.array([here[place].gap if place in here else math.inf for here in gaps])
        for i in range(len(curve) - 1):
            if np.all(np.isfinite(values[i : i + 2])):
                yield from _within(_Between(family, curve, i, bounds, place), values, i)


def _within(here: _Between, gaps: Floats, i: int) -> Iterator[Grazing | Unresolved]:
    """Grazings between points i and i + 1 (1)."""
    from scipy.optimize import minimize_scalar

    if _crosses(gaps, i):
        yield from _zero(here, 0.0, 1.0)
    elif gaps[i] > 0.0 and _dips(gaps, i):
        most = float(gaps[i : i + 2].max())  # where L is infinite, its extremum has vanished
        low = minimize_scalar(
            lambda share: min(here.gap(share), most), bounds=(0.0, 1.0), method="bounded"
        )
        if not low.fun >= 0.0:
            yield from _zero(here, 0.0, float(low.x))
            yield from _zero(here, float(low.x), 1.0)


def _crosses(gaps: Floats, i: int) -> bool:
    """Whether the least gap changes its sign between points i and i + 1; at i + 1 if it ends there.

    A gap that is zero to the last digit has no sign: that before counts.
    """
    low, high = gaps[i : i + 2]
    if high == 0.0:
        return bool(low != 0.0 and i + 2 == len(gaps))
    return bool(low * high < 0.0 or (low == 0.0 and (i == 0 or gaps[i - 1] * high < 0.0)))


def _dips(gaps: Floats, i: int) -> bool:
    """Whether the least gap may have a minimum below zero between points i and i + 1."""
    fall = gaps[i - 1] - gaps[i] if i > 0 else 0.0
    rise = gaps[i + 2] - gaps[i + 1] if i + 2 < len(gaps) else 0.0
    return bool(fall > 0.0 and rise > 0.0 and min(gaps[i : i + 2]) < max(fall, rise))


def _zero(here: _Between, low: float, high: float) -> Iterator[Grazing | Unresolved]:
    at_low, at_high = here.gap(low), here.gap(high)
    if at_low * at_high > 0.0:
        return
    share = brent(here.gap, low, high)
    crossing = 1 if at_high > at_low else -1
    found = here.grazing(share, crossing) if math.isfinite(share) else here.unresolved(UNKNOWN)
    if found is not None:
        yield found
