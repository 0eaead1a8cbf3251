"""A run whose last coordinate is driven along straight lines: at given times it is put on the next one.

Nothing acts on that coordinate, such as the value of a force record (transients/driven.py); all others go on.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.compile.hybrid import Compiled, compile_mechanism
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import Run, RunEnd, assembled, begin, phases_of, settled
from vibroimpact.simulation.simulator import ENDLESS_EVENTS


class Lines(NamedTuple):
    """Lines that a coordinate follows: where each begins, its value and slope there, its length.

    All of shape (k,); times are since the start of the run.
    """

    begin: Floats
    value: Floats
    slope: Floats
    length: Floats


def simulate_driven(system: System, state: State, lines: Lines) -> Run:
    """Simulate a motion whose last coordinate follows given lines.

    Parameters
    ----------
    system
        Its last coordinate is free of forces.
    state
        The state at the start, but for the last coordinate and velocity, which the first line
        gives.
    lines
        One at least; each begins where the one before ends.

    Returns
    -------
    Run
        With an event HORIZON at the end of each line. It ends with the last one, or before for a
        reason other than HORIZON.
    """
    m = mechanism_of(system)
    n = m.degrees - 1
    position, velocity = state.position[:n], state.velocity[:n]
    parts: list[Any] = []
    starts: list[tuple[list[float], int]] = []
    first = State((*position, lines.value[0]), (*velocity, lines.slope[0]), state.phase)
    compiled = compile_mechanism(m, first)
    at, why = begin(compiled, first), RunEnd.HORIZON
    for time, value, slope, length in zip(*(part.tolist() for part in lines), strict=True):
        if parts:
            phases = phases_of(m, state.phase + m.omega * time)
            after = parts[-1]["after"][-1].tolist()
            place, speed = [*after[:n], value], [*after[n + 1 : 2 * n + 1], slope]
            at = settled(compiled, compiled.kernel.start(place, speed, phases)["at"])
        starts.append((at.y, at.mode))
        why = _piece(compiled, at, time, length, parts)
        if why is not RunEnd.HORIZON:
            break
    _hand_over(parts, starts, lines)
    y, mode = starts[0]
    return assembled(system, first, compiled, np.array(y), mode, parts, why)


def _piece(compiled: Compiled, at: Any, time: float, length: float, parts: list[Any]) -> RunEnd:
    """Run along one line, and put its times on the clock of the run."""
    while True:
        part = compiled.kernel.simulate(at, length, math.inf, ENDLESS_EVENTS, ENDLESS_EVENTS)
        high = part["high"] + time
        rest = high - time  # two-sum: what the clock loses goes to its lower part
        part["low"] = part["low"] + ((time - (high - rest)) + (part["high"] - rest))
        part["high"] = high
        parts.append(part)
        why = RunEnd(part["why"])
        if why is not RunEnd.MISSING or not compiled.add_code(part["code"]):
            return why


def _hand_over(parts: list[Any], starts: list[tuple[list[float], int]], lines: Lines) -> None:
    """Hand the motion after the event at the end of each line over to the beginning of the next."""
    ends = [part for part in parts if part["why"] == RunEnd.HORIZON]
    followed = zip(ends, starts[1:], lines.value[1:], lines.slope[1:], strict=False)
    for part, (y, mode), value, slope in followed:
        degrees = part["after"].shape[1] // 2
        part["y"][-1], part["mode"][-1] = y, mode
        part["after"][-1, degrees - 1], part["after"][-1, -1] = value, slope
