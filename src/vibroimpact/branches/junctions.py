"""Junctions of branches: special points of several of them that are one.

Method      Points at one parameter value (SAME_JUNCTION_OF_RANGE) that share their loop (same_orbit.py), up to its
            first impact and the mirror image, are one junction; a loop at PD or BP may be a double one, one at ZERO is
            that of the grazing orbit. From one junction orbits are followed once.                         (1)
Accuracy    the tolerances stated
Fails       never
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from vibroimpact.branches.branch import Reached
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.branches.same_orbit import Loop, junction_of, same_loop
from vibroimpact.model.system import mechanism_of

# Junctions at values that are so near, relative to the range, are one.
SAME_JUNCTION_OF_RANGE = 1e-7
# States at one junction agree so well, relative to their size: square roots halve the digits.
JUNCTION_OF_STATES = 1e-4
NEW, KNOWN = "new", "known"


def named(how: str) -> str:
    """Result for a branch that is a known one, or its mirror image."""
    return KNOWN if how == "same" else how


class _Junction(NamedTuple):
    """Point at which branches meet."""

    parameter: float
    loop: Loop
    touching: bool


@dataclass(frozen=True)
class Known:
    """What is known of a junction: the result at another of its points, None where it was left."""

    result: Reached | None


@dataclass
class Junctions:
    """Junctions found so far within a range of the parameter, and the result at each."""

    bounds: tuple[float, float]
    _every: list[tuple[_Junction, Reached | None]] = field(default_factory=list)

    def add(self, point: BifurcationPoint, result: Reached | None) -> None:
        """Record what was reached at a point; None if it is left."""
        self._every.append((_junction(point), result))

    def find(self, number: int, point: BifurcationPoint) -> Known | None:
        """What is known of a point of a branch: the result at its junction (1); None if it is at none."""
        here = _junction(point)
        mechanism = mechanism_of(point.orbit.system)
        span = self.bounds[1] - self.bounds[0]
        for known, result in self._every:
            near = abs(known.parameter - here.parameter) <= SAME_JUNCTION_OF_RANGE * span
            if not near or known.touching != here.touching:
                continue
            if how := same_loop(known.loop, here.loop, mechanism, JUNCTION_OF_STATES):
                return Known(result and _at_junction(number, point.label, result, how))
        return None


def _at_junction(number: int, label: str, first: Reached, how: str) -> Reached:
    """Result of a point at a junction at which another point was followed before."""
    if first.to is None:
        return Reached(number, label, None, first.how)
    back = first.to == number != first.branch
    return Reached(number, label, first.branch if back else first.to, named(how))


def _junction(point: BifurcationPoint) -> _Junction:
    loop = junction_of(point, JUNCTION_OF_STATES)
    return _Junction(point.parameter, loop, point.record.touch)
