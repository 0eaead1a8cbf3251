"""heyoka's adaptive Taylor method with two terminal events.

The forcing enters as a phasor (s' = omega c, c' = -omega s), which keeps the right-hand side
linear and its Taylor coefficients cheap. The impact law is applied in the events' callback, so that
one call of ``propagate_until`` runs all impacts of a start.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.peers.method import Result, require

LONGEST_RUN_PER_IMPACT = 1e4
INWARD = 4e-15
"""A start on a stop is moved inside by this, a few ulp of the half clearance: heyoka misses the
next root of an event function that is exactly zero at the start."""


Pair = tuple[float, float]


def impact_law(parameters: Parameters) -> tuple[Pair, Pair]:
    """Return the rows of the matrix that maps (v1, v2) before an impact to after it."""
    mu, R = parameters.mass_ratio, parameters.restitution
    return (
        ((1 - mu * R) / (1 + mu), mu * (1 + R) / (1 + mu)),
        ((1 + R) / (1 + mu), (mu - R) / (1 + mu)),
    )


def equations(parameters: Parameters) -> tuple[list[tuple[Any, Any]], Any]:
    """Return the equations of motion for x1, x2, v1, v2, s, c, and u = x2 - x1."""
    heyoka, p = require("heyoka", "heyoka"), parameters
    x1, x2, v1, v2, s, c = heyoka.make_vars("x1", "x2", "v1", "v2", "s", "c")
    acceleration = p.force * s - 2 * p.zeta * p.omega_n * v1 - p.omega_n**2 * x1
    right_hand_side = [(x1, v1), (x2, v2), (v1, acceleration), (v2, heyoka.expression(0.0)),
                       (s, p.omega * c), (c, -p.omega * s)]  # fmt: skip
    return right_hand_side, x2 - x1


class _Impact:
    """Callback of both events: record the time, apply the impact law, stop after enough impacts."""

    def __init__(self, parameters: Parameters) -> None:
        self.to_main, self.to_free = impact_law(parameters)
        self.state: Any = None  # a memoryview of the integrator's state: fastest from Python
        self.times: list[float] = []
        self.impacts = 0

    def restart(self, impacts: int) -> None:
        self.times, self.impacts = [], impacts

    def __call__(self, integrator: Any, _sign: int) -> bool:
        state = self.state
        v1, v2 = state[2], state[3]
        state[2] = self.to_main[0] * v1 + self.to_main[1] * v2
        state[3] = self.to_free[0] * v1 + self.to_free[1] * v2
        self.times.append(integrator.time)
        return len(self.times) < self.impacts

    def __deepcopy__(self, _memo: object) -> _Impact:
        return self  # heyoka copies callbacks; this one must stay shared with its caller


@cache
def _integrator(parameters: Parameters) -> tuple[Any, _Impact]:
    heyoka = require("heyoka", "heyoka")
    (right_hand_side, u), impact = equations(parameters), _Impact(parameters)
    delta = parameters.half_clearance
    direction = heyoka.event_direction
    events = [
        heyoka.t_event(u - delta, callback=impact, direction=direction.positive),
        heyoka.t_event(u + delta, callback=impact, direction=direction.negative),
    ]
    integrator = heyoka.taylor_adaptive(right_hand_side, state=[0.0] * 6, t_events=events)
    impact.state = memoryview(integrator.state)
    return integrator, impact


def state_of(start: Floats) -> tuple[float, ...]:
    """Return what the equations start from: a few ulp inside a stop, the forcing as a phasor."""
    x1, x2, v1, v2, phase, contact = start
    return (x1, x2 - contact * INWARD, v1, v2, math.sin(phase), math.cos(phase))


def _simulate(integrator: Any, impact: _Impact, start: Floats, impacts: int) -> list[float]:
    integrator.state[:] = state_of(start)
    integrator.time = 0.0
    integrator.reset_cooldowns()
    impact.restart(impacts)
    integrator.propagate_until(LONGEST_RUN_PER_IMPACT * impacts)
    return impact.times


@dataclass(frozen=True, slots=True)
class Heyoka:
    """heyoka, scalar, double precision."""

    name: str = "heyoka taylor_adaptive"
    settings: str = "default tolerance 2.2e-16, terminal events, phasor forcing, Python callback"
    max_starts: int | None = 100
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate the starts one after another; just-in-time compilation is not timed."""
        integrator, impact = _integrator(parameters)
        times = np.full((len(starts), impacts), np.nan)
        begin = time.perf_counter()
        for row, start in zip(times, starts, strict=True):
            found = _simulate(integrator, impact, start, impacts)
            row[: len(found)] = found
        return Result(time.perf_counter() - begin, times)
