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


def states_of(starts: Floats) -> list[Any]:
    """Return the starts as states of the library."""
    state = require("vibroimpact", ".").State
    return [state((x1, x2), (v1, v2), phase=phase) for x1, x2, v1, v2, phase, _ in starts.tolist()]


def damper_of(parameters: Parameters) -> Any:
    """Return the damper as a system of the library."""
    return require("vibroimpact", ".").ImpactDamper(**asdict(parameters))


def settled(starts: Floats, parameters: Parameters, impacts: int) -> Floats:
    """Return where so many impacts lead, as starts: steady motion, if there are enough of them."""
    simulate, damper = require("vibroimpact", ".").simulate, damper_of(parameters)
    rows = []
    for state in states_of(starts):
        run = simulate(damper, state, impacts=impacts)
        (x1, x2), (v1, v2) = run.last.position, run.last.velocity
        rows.append((x1, x2, v1, v2, run.last.phase, float(run.side[-1])))
    return np.array(rows)


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
        return _simulate(damper_of(parameters), states_of(starts), impacts)


@dataclass(frozen=True, slots=True)
class Engine:
    """The scalar engine as the package compiles it, without records."""

    name: str = "vibroimpact engine, scalar"
    settings: str = "first contact certified; one call of the extension per start, no record kept"
    max_starts: int | None = None
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Take the impact times from `simulate`; time the same runs without records."""
        damper, states = damper_of(parameters), states_of(starts)
        found = _simulate(damper, states, impacts)
        compiled = require("vibroimpact.compile.hybrid", ".").compile_mechanism(damper.mechanism)
        positions = [
            require("vibroimpact.simulation.simulate", ".").begin(compiled, s) for s in states
        ]
        advance, most_events = compiled.kernel.advance, 1000 * impacts
        begin = time.perf_counter()
        for position in positions:
            advance(position, math.inf, FLIGHT_LIMIT, most_events, impacts)
        return Result(time.perf_counter() - begin, found.times)
