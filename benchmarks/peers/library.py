"""vibroimpact itself: the engine alone, and `vibroimpact.simulate` with all its records."""

from __future__ import annotations

import math
import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.peers.method import Result, require

FLIGHT_LIMIT = 1e4
"""A flight without contact for this long is given up, as in ``program.hpp``."""


def _problem(starts: Floats, parameters: Parameters) -> tuple[Any, list[Any]]:
    """Make the damper and its states on or between the stops."""
    vi = require("vibroimpact", ".")
    states = [
        vi.State((x1, x2), (v1, v2), phase=phase) for x1, x2, v1, v2, phase, _ in starts.tolist()
    ]
    return vi.ImpactDamper(**asdict(parameters)), states


def _simulate(damper: Any, states: list[Any], impacts: int) -> Result:
    """Simulate the states one after another; time all of it."""
    simulate = require("vibroimpact", ".").simulate
    times = np.full((len(states), impacts), np.nan)
    begin = time.perf_counter()
    for row, state in zip(times, states, strict=True):
        run = simulate(damper, state, impacts=impacts)
        found = run.time[run.impacts]
        row[: len(found)] = found
    return Result(time.perf_counter() - begin, times)


@dataclass(frozen=True, slots=True)
class Simulate:
    """`vibroimpact.simulate`, records of every impact included."""

    name: str = "vibroimpact.simulate, Python"
    settings: str = "one call per start, all impact records kept"
    max_starts: int | None = 100
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate the starts one after another."""
        return _simulate(*_problem(starts, parameters), impacts)


@dataclass(frozen=True, slots=True)
class Engine:
    """The scalar engine as the package compiles it, without records."""

    name: str = "vibroimpact engine, scalar"
    settings: str = "first contact certified; one call of the extension per start, no record kept"
    max_starts: int | None = None
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Take the impact times from `simulate`; time the same runs without records."""
        damper, states = _problem(starts, parameters)
        found = _simulate(damper, states, impacts)
        compiled = require("vibroimpact.hybrid", ".").compile_mechanism(damper.mechanism)
        positions = [require("vibroimpact.simulate", ".").begin(compiled, s) for s in states]
        advance, most_events = compiled.kernel.advance, 1000 * impacts
        begin = time.perf_counter()
        for position in positions:
            advance(position, math.inf, FLIGHT_LIMIT, most_events, impacts)
        return Result(time.perf_counter() - begin, found.times)
