"""SciPy's ``solve_ivp`` with terminal events, restarted after every impact."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.peers.method import Result, require

RTOL, ATOL = 1e-10, 1e-12
LONGEST_FLIGHT = 1e4
TERMINAL_EVENT = 1
"""`solve_ivp`'s status when an event ended the integration."""

State = list[float]


def _equations(p: Parameters) -> Callable[[float, State, float], State]:
    damping, stiffness = 2 * p.zeta * p.omega_n, p.omega_n**2

    def right_hand_side(t: float, y: State, phase: float) -> State:
        x1, _, v1, v2 = y
        force = p.force * math.sin(p.omega * t + phase)
        return [v1, v2, force - damping * v1 - stiffness * x1, 0.0]

    return right_hand_side


def _stops(p: Parameters) -> list[Any]:
    def stop_a(_t: float, y: State, _phase: float) -> float:
        return p.half_clearance - (y[1] - y[0])

    def stop_b(_t: float, y: State, _phase: float) -> float:
        return p.half_clearance + (y[1] - y[0])

    events: list[Any] = [stop_a, stop_b]
    for event in events:
        event.terminal, event.direction = True, -1
    return events


def _after_impact(p: Parameters, y: State) -> State:
    x1, x2, v1, v2 = y
    mu, R = p.mass_ratio, p.restitution
    stop = math.copysign(p.half_clearance, x2 - x1)
    return [x1, x1 + stop, ((1 - mu * R) * v1 + mu * (1 + R) * v2) / (1 + mu),
            ((1 + R) * v1 + (mu - R) * v2) / (1 + mu)]  # fmt: skip


@dataclass(frozen=True, slots=True)
class SciPy:
    """``solve_ivp``, DOP853."""

    name: str = "SciPy solve_ivp DOP853"
    settings: str = f"rtol={RTOL:g}, atol={ATOL:g}, terminal events with direction"
    max_starts: int | None = 2
    tolerance: float = 1e-6  # RTOL times `equality.AMPLIFICATION`, and a factor 10
    misses_impacts: bool = True  # two of them within one of its steps

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate the starts one after another."""
        solve_ivp = require("scipy.integrate", "scipy").solve_ivp
        times = np.full((len(starts), impacts), np.nan)
        equations, stops = _equations(parameters), _stops(parameters)
        begin = time.perf_counter()
        for row, start in zip(times, starts, strict=True):
            t, y, phase = 0.0, start[:4].tolist(), (start[4],)
            for k in range(impacts):
                flight = solve_ivp(equations, (t, t + LONGEST_FLIGHT), y, method="DOP853",
                                   rtol=RTOL, atol=ATOL, events=stops, args=phase)  # fmt: skip
                if flight.status != TERMINAL_EVENT:
                    break
                t = row[k] = flight.t[-1]
                y = _after_impact(parameters, flight.y[:, -1].tolist())
        return Result(time.perf_counter() - begin, times)
