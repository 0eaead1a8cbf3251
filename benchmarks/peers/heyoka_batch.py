"""heyoka's Taylor method in batch mode: one trajectory in each SIMD lane.

The equations, the events and the impact law of ``heyoka_taylor.py``. The propagation is one call
for all starts: a lane whose start has had its impacts takes the next start, inside the callback, so
that no lane waits for another. The last starts to end leave lanes idle.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.peers.heyoka_taylor import (
    LONGEST_RUN_PER_IMPACT,
    equations,
    impact_law,
    state_of,
)
from benchmarks.peers.method import Result, require

IDLE = -1


class _Lanes:
    """Callback of both events: record the time, apply the impact law, refill the lane."""

    def __init__(self, parameters: Parameters) -> None:
        self.to_main, self.to_free = impact_law(parameters)
        self.state: Any = None  # memoryviews of the integrator's state and times
        self.time: Any = None

    def restart(self, starts: Floats, times: Floats) -> None:
        """Fill every lane; `times` takes the results."""
        lanes = self.state.shape[1]
        self.starts, self.times, self.left = starts, times, len(starts)
        self.waiting: Iterator[int] = iter(range(len(starts)))
        self.running, self.begun, self.found = [IDLE] * lanes, [0.0] * lanes, [0] * lanes
        for lane in range(lanes):
            self._refill(lane)

    def _refill(self, lane: int) -> None:
        """Put the next start into a lane; without one, let it run unrecorded."""
        self.running[lane] = start = next(self.waiting, IDLE)
        if start == IDLE:
            return
        self.begun[lane], self.found[lane] = self.time[lane], 0
        for row, value in enumerate(state_of(self.starts[start])):
            self.state[row, lane] = value

    def __call__(self, _integrator: Any, _sign: int, lane: int) -> bool:
        state, start, k = self.state, self.running[lane], self.found[lane]
        v1, v2 = state[2, lane], state[3, lane]
        state[2, lane] = self.to_main[0] * v1 + self.to_main[1] * v2
        state[3, lane] = self.to_free[0] * v1 + self.to_free[1] * v2
        if start == IDLE:
            return True
        self.times[start, k] = self.time[lane] - self.begun[lane]
        self.found[lane] = k + 1
        if k + 1 == self.times.shape[1]:
            self._refill(lane)
            self.left -= 1
        return self.left > 0

    def __deepcopy__(self, _memo: object) -> _Lanes:
        return self  # heyoka copies callbacks; this one must stay shared with its caller


@cache
def _integrator(parameters: Parameters) -> tuple[Any, _Lanes]:
    heyoka = require("heyoka", "heyoka")
    (right_hand_side, u), lanes = equations(parameters), _Lanes(parameters)
    delta, direction = parameters.half_clearance, heyoka.event_direction
    events = [
        heyoka.t_event_batch(u - delta, callback=lanes, direction=direction.positive),
        heyoka.t_event_batch(u + delta, callback=lanes, direction=direction.negative),
    ]
    state = np.zeros((6, heyoka.recommended_simd_size()))
    integrator = heyoka.taylor_adaptive_batch(right_hand_side, state=state, t_events=events)
    lanes.state, lanes.time = memoryview(integrator.state), memoryview(integrator.time)
    return integrator, lanes


@dataclass(frozen=True, slots=True)
class HeyokaBatch:
    """heyoka, one trajectory per SIMD lane, double precision."""

    name: str = "heyoka taylor_adaptive_batch"
    settings: str = "as taylor_adaptive; batch of the recommended SIMD width, lanes refilled"
    max_starts: int | None = 200
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate all starts in one propagation; just-in-time compilation is not timed."""
        integrator, lanes = _integrator(parameters)
        times = np.full((len(starts), impacts), np.nan)
        integrator.set_time(0.0)
        integrator.state[:] = 0.0  # a lane that gets no start rests in the middle
        integrator.reset_cooldowns()
        begin = time.perf_counter()
        lanes.restart(starts, times)
        integrator.propagate_until(
            np.full(integrator.batch_size, LONGEST_RUN_PER_IMPACT * times.size)
        )
        return Result(time.perf_counter() - begin, times)
