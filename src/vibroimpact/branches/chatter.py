"""Ends of completed chatter on a branch: the law there, and the place at which a curve ends a little before."""

from __future__ import annotations

from vibroimpact.branches.family import CHATTER, rests_of
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.normal_forms.chatter import ChatterEnd
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.orbit import Orbit

# A rest after chatter at the end of a curve is that of a vanishing one where it takes less of the period.
SHORT_REST_OF_PERIOD = 1e-2


def chatter_end(kind: PointKind, point: BifurcationPoint) -> ChatterEnd:
    """Law of a point at which completed chatter begins or ends."""
    return _law(kind.label, point.orbit, point.segment, point.name, point.parameter)


def _law(label: str, orbit: Orbit, segment: int, name: str, at: float) -> ChatterEnd:
    stop = orbit.signature.impacts[segment]
    restitution = stop.restitution(orbit.mechanism.rigid_stops)
    return ChatterEnd(label, name, at, stop.words, restitution)


def distance_left(orbit: Orbit, before: Orbit) -> tuple[int, float] | None:
    """Segment of a rest after chatter that vanishes beyond the last orbit of a curve, and how far beyond.

    The distance is a multiple of that between the last two orbits, from the law of the time of the rest. None where no
    such rest is short.
    """
    for k, what in rests_of(orbit.mechanism, orbit.signature).items():
        short, longer = float(orbit.durations[k]), float(before.durations[k])
        if what == CHATTER and short < min(longer, SHORT_REST_OF_PERIOD * orbit.period):
            power = _law("", orbit, k, "", 0.0).power
            ratio = (short / longer) ** (1.0 / power)
            return k, ratio / (1.0 - ratio)
    return None
