"""How far a motion without impacts stays from the rigid stops, in words: a clearance in other units is seen at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import Units, units_of
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.system import mechanism_of

LAST_PERIODS = 8  # the motion of so many forcing periods is looked at
SAMPLES = 1000


def reach_in_words(run: Any) -> str:
    """How the coordinate of the nearest stop of a run moves in the end, and where the stop is; "" without one."""
    m = mechanism_of(run.system)
    stops = [stop for stop in m.rigid_stops if not stop.motion]
    if not stops or not len(run):
        return ""
    end = float(run.time[-1])
    last = LAST_PERIODS * 2.0 * math.pi / m.omega if m.omega else end
    places, _ = run.at(np.linspace(max(0.0, end - last), end, SAMPLES))
    units = units_of(run.system)
    return min(_reach(stop, places @ np.array(stop.row), units) for stop in stops)[1]


def _reach(stop: RigidStop, moved: Floats, units: Units) -> tuple[float, str]:
    """Least gap relative to the range of the motion, and the sentence."""
    low, high = float(moved.min()), float(moved.max())
    ends = [(x, gap) for x, gap in ((stop.upper, stop.upper - high), (stop.lower, low - stop.lower))
            if not is_infinite(x)]  # fmt: skip
    gap = min(gap for _, gap in ends)
    at = " and ".join(units.text(x, quantity="length", digits=4) for x, _ in ends)
    entries = sorted(
        ((x, i) for i, x in enumerate(stop.row, 1) if x), key=lambda entry: entry[0] < 0.0
    )
    words = (
        f"{'-' if x < 0.0 else '+'} {'' if abs(x) == 1.0 else f'{abs(x):g} '}x{i}"
        for x, i in entries
    )
    named = " ".join(words).removeprefix("+ ")
    return gap / max(high - low, math.ulp(0.0)), (
        f"{named} moves from {units.text(low, high, quantity='length', digits=4)} in the end, and the stop is at {at}: "
        f"{units.text(gap, quantity='length', digits=4)} are left"
    )
