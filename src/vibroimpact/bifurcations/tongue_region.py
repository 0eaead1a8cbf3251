"""The region between the sides of a tongue, as far from the tip as both sides bound it.

Method      every side from its end next to the tip, along one parameter up to where it first turns back; both sides
            up to the nearer of the two ends. Of the two parameters, the one in which this is farther, relative to
            the extent of the sides
Assumes     nothing beyond: where a side turns back, other curves may bound the locked orbits
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.tongue import Tongue

TINY = float(np.finfo(float).tiny)


class TongueRegion(NamedTuple):
    """Region between the sides: axis (0 or 1) along which it extends, signed reach from the tip, corners (n, 2)."""

    axis: int
    reach: float
    corners: Floats


def region_of(tongue: Tongue) -> TongueRegion:
    """Region next to the tip between both sides."""
    tip = np.array([tongue.tip.parameters[name] for name in tongue.sides[0].names])
    sides = [_from_tip(side.values, tip) for side in tongue.sides]
    size = np.ptp(np.vstack([tip, *sides]), axis=0) + TINY
    reached = [_reach([side[:, axis] - tip[axis] for side in sides]) for axis in (0, 1)]
    axis = int(np.argmax(np.abs(reached) / size))
    parts = [_cut(side, tip, axis, reached[axis]) for side in sides]
    return TongueRegion(axis, reached[axis], np.vstack([parts[0], parts[1][::-1]]))


def _from_tip(values: Floats, tip: Floats) -> Floats:
    """Points of a side, from its end next to the tip."""
    size = np.ptp(np.vstack([values, tip]), axis=0) + TINY
    near, far = (float(np.hypot(*((values[i] - tip) / size))) for i in (0, -1))
    return values if near <= far else values[::-1]


def _reach(distances: Sequence[Floats]) -> float:
    """Signed distance from the tip that both sides reach before one turns back; 0 if they part."""
    ends = [float(d[_rising(np.diff(d) * np.sign(d[0]))]) for d in distances]
    return min(ends, key=abs) if ends[0] * ends[1] > 0.0 else 0.0


def _rising(steps: Floats) -> int:
    """Index of the last point before the first step backwards."""
    back = np.flatnonzero(steps <= 0.0)
    return int(back[0]) if back.size else len(steps)


def _cut(side: Floats, tip: Floats, axis: int, reach: float) -> Floats:
    """The part of a side up to a distance from the tip along an axis, with a point there."""
    along = (side[:, axis] - tip[axis]) * np.sign(reach)
    count = _rising(np.diff(along)) + 1
    along, side = along[:count], side[:count]
    end = [np.interp(abs(reach), along, side[:, i]) for i in (0, 1)]
    cut: Floats = np.vstack([side[along < abs(reach)], end])
    return cut
