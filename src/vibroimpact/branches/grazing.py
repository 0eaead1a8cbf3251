"""Where a branch of orbits grazes: a gap's extremum within a flight reaches zero.

Method      For each stop and each flight the least gap at interior extrema (admissibility.py) is a
            continuous function L of the curve's arclength, smooth but where another extremum
            becomes the least. Where L changes sign between neighbouring points, its zero is found
            by Brent's method, every value at an orbit corrected on the curve. Where L has a minimum
            above zero among the points, it is minimised between its neighbours: two zeros closer
            than the points are seen.                                                         (1)
Assumes     L has no more than one minimum between two points, which resolve the curve to 1e-8
Accuracy    1e-12 of the distance of two points
Reference   theory.md, "Branches"
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from vibroimpact.branches.family import OrbitFamily
from vibroimpact.continuation import Curve
from vibroimpact.continuation.newton import correct
from vibroimpact.continuation.problem import scaled
from vibroimpact.periodic.admissibility import Nearest, Place
from vibroimpact.periodic.orbit import Orbit

Floats = NDArray[np.float64]

FINEST = 1e-13  # of the distance of two points
AT_ONCE = 1e-9  # of the period
EDGE = 1e-2  # of a flight: an extremum this near to an impact on the same stop belongs to it


class Grazing(NamedTuple):
    """An orbit on the curve that touches a stop without impact."""

    z: Floats
    parameter: float
    tangent: Floats  # in unscaled unknowns, the parameter last
    arclength: float
    nearest: Nearest
    crossing: int  # +1 where the gap opens with the arclength
    error: float


class _Between:
    """Orbits between two neighbouring points of a curve, by their share of the distance."""

    def __init__(
        self, family: OrbitFamily, curve: Curve, i: int, bounds: tuple[float, float], place: Place
    ) -> None:
        self.family, self.curve, self.i, self.place = family, curve, i, place
        self.problem = scaled(family, bounds)
        ends = [self.problem.scaled(curve.z[k], curve.parameter[k]) for k in (i, i + 1)]
        self.start, self.step = ends[0], ends[1] - ends[0]

    def orbit(self, share: float) -> tuple[Floats, float, Floats]:
        """(z, p, tangent) there."""
        size = float(self.step @ self.step)
        target = float(self.step @ self.start) + share * size
        attempt = correct(self.problem, self.start + share * self.step, self.step, target)
        y = attempt.y if attempt.node is None else attempt.node.y
        direction = self.step if attempt.node is None else attempt.node.direction
        z, p = self.problem.solution(y)
        return z, p, direction / np.linalg.norm(direction) * self.problem.sizes

    def gap(self, share: float) -> float:
        """L there."""
        z, p, _ = self.orbit(share)
        nearest = self.family.orbit(z, p).gaps.get(self.place)
        return nearest.gap if nearest else math.inf

    def grazing(self, share: float, crossing: int) -> Grazing | None:
        """The orbit there, if it grazes."""
        z, p, tangent = self.orbit(share)
        orbit = self.family.orbit(z, p)
        nearest = orbit.gaps.get(self.place)
        if nearest is None or _belongs_to_impact(orbit, nearest):
            return None
        length = self.curve.arclength
        at = float(length[self.i] + share * (length[self.i + 1] - length[self.i]))
        error = abs(tangent[-1]) * float(np.linalg.norm(self.step)) * FINEST + float(np.spacing(p))
        return Grazing(z, p, tangent, at, nearest, crossing, error)


def _belongs_to_impact(orbit: Orbit, nearest: Nearest) -> bool:
    """Whether a gap vanishes for another reason: an impact's own speed, two impacts at once."""
    k, stop = nearest.segment, (nearest.contact, nearest.side)
    if np.abs(orbit.durations).min() < AT_ONCE * float(np.abs(orbit.durations).sum()):
        return True  # two impacts at once: "SIM"
    share = nearest.time / float(orbit.durations[k])
    begun, ended = orbit.signature.impacts[k], orbit.signature.solved[k]
    return (share < EDGE and stop == begun) or (share > 1.0 - EDGE and stop == ended)


def grazings(
    family: OrbitFamily,
    curve: Curve,
    gaps: Sequence[Mapping[Place, Nearest]],
    bounds: tuple[float, float],
) -> Iterator[Grazing]:
    """Every grazing of a curve, given the least gaps at its points."""
    for place in sorted({place for here in gaps for place in here}):
        values = np.array([here[place].gap if place in here else math.inf for here in gaps])
        for i in range(len(curve) - 1):
            if np.all(np.isfinite(values[i : i + 2])):
                yield from _within(_Between(family, curve, i, bounds, place), values, i)


def _within(here: _Between, gaps: Floats, i: int) -> Iterator[Grazing]:
    """The grazings between points i and i + 1 (1)."""
    if gaps[i] * gaps[i + 1] < 0.0:
        yield from _zero(here, 0.0, 1.0)
    elif gaps[i] > 0.0 and _dips(gaps, i):
        low = minimize_scalar(here.gap, bounds=(0.0, 1.0), method="bounded")
        if low.fun < 0.0:
            yield from _zero(here, 0.0, float(low.x))
            yield from _zero(here, float(low.x), 1.0)


def _dips(gaps: Floats, i: int) -> bool:
    """Whether the least gap may have a minimum below zero between points i and i + 1."""
    fall = gaps[i - 1] - gaps[i] if i > 0 else 0.0
    rise = gaps[i + 2] - gaps[i + 1] if i + 2 < len(gaps) else 0.0
    return bool(fall > 0.0 and rise > 0.0 and min(gaps[i : i + 2]) < max(fall, rise))


def _zero(here: _Between, low: float, high: float) -> Iterator[Grazing]:
    at_low, at_high = here.gap(low), here.gap(high)
    if not (math.isfinite(at_low) and math.isfinite(at_high)) or at_low * at_high > 0.0:
        return
    share = float(brentq(here.gap, low, high, xtol=FINEST, rtol=1e-15))
    found = here.grazing(share, 1 if at_high > at_low else -1)
    if found is not None:
        yield found
