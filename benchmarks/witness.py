"""Impact times of any mechanism by SciPy: what the scaling cases are asserted against.

M x'' = f - C x' - K x,   impact at row . x = stop:  v+ = v - (1 + R) u' M^-1 row / (row M^-1 row)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.case import Floats
from benchmarks.peers.scipy_dop853 import ATOL, RTOL, TERMINAL_EVENT

LONGEST_FLIGHT = 1e3
LONGEST_STEP = 0.1  # times the fastest rate: between its steps SciPy sees no impact


def _equations(m: Any) -> Callable[[float, Floats, float], Floats]:
    n, inverse = m.degrees, np.linalg.inv(m.mass)
    damping, stiffness = inverse @ np.array(m.damping), inverse @ np.array(m.stiffness)
    (line,) = m.forces
    push = inverse @ np.array(line.sine)

    def right_hand_side(t: float, y: Floats, phase: float) -> Floats:
        x, v = y[:n], y[n:]
        force = push * math.sin(line.omega * t + phase)
        return np.concatenate([v, force - damping @ v - stiffness @ x])

    return right_hand_side


def _fastest(m: Any) -> float:
    """Return the fastest rate of the free motion and the forcing."""
    squares = np.linalg.eigvals(np.linalg.solve(np.array(m.mass), np.array(m.stiffness)))
    return max(math.sqrt(float(np.abs(squares).max())), *(line.omega for line in m.forces))


def _stops(m: Any) -> list[Any]:
    """Return an event function for each stop, at the lower and the upper end of each contact."""
    events = []
    for contact in m.rigid_stops:
        row = np.array(contact.row)
        for sign, stop in ((1.0, contact.lower), (-1.0, contact.upper)):

            def gap(
                _t: float,
                y: Floats,
                _phase: float,
                row: Floats = sign * row,
                at: float = sign * stop,
            ) -> float:
                return float(row @ y[: row.size]) - at

            event: Any = gap
            event.terminal, event.direction = True, -1
            events.append(event)
    return events


def _after_impact(m: Any, y: Floats, stop: int) -> Floats:
    contact, end = m.rigid_stops[stop // 2], stop % 2
    n, row = m.degrees, np.array(contact.row)
    pull = np.linalg.solve(np.array(m.mass), row)
    restitution = contact.restitutions[end]
    v = y[n:] - (1.0 + restitution) * (row @ y[n:]) / (row @ pull) * pull
    return np.concatenate([y[:n], v])


def impact_times(mechanism: Any, start: tuple[Floats, Floats, float], impacts: int) -> Floats:
    """Return the times of the first impacts from (position, velocity, phase)."""
    equations, stops = _equations(mechanism), _stops(mechanism)
    step = LONGEST_STEP / _fastest(mechanism)
    t, y = 0.0, np.concatenate(start[:2])
    times = []
    for _ in range(impacts):
        flight = solve_ivp(equations, (t, t + LONGEST_FLIGHT), y, method="DOP853", rtol=RTOL,
                           atol=ATOL, max_step=step, events=stops, args=(start[2],))  # fmt: skip
        if flight.status != TERMINAL_EVENT:
            break
        t = flight.t[-1]
        times.append(t)
        stop = next(i for i, found in enumerate(flight.t_events) if found.size)
        y = _after_impact(mechanism, flight.y[:, -1], stop)
    return np.array(times)
