"""Short questions to the kernel: fly, find the first event, differentiate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import vibroimpact as vi
from support import UNIT
from vibroimpact.compile.hybrid import compile_mechanism
from vibroimpact.model.system import mechanism_of
from vibroimpact.simulation.simulate import begin, flight_limit_of, phases_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

RUNG = 32  # steps between refreshes of the kernel's march, and their number between greater ones


def fly(system: Any, state: vi.State, t: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
    """Positions and velocities after free flights of the given lengths."""
    compiled = compile_mechanism(mechanism_of(system))
    dt = np.atleast_1d(np.asarray(t, dtype=float))
    start = compiled.kernel.start(
        list(state.position), list(state.velocity), phases_of(compiled.mechanism, state.phase)
    )  # a flight does not mind a start behind a stop
    y = np.tile(np.array(start["at"].y), (dt.size, 1))
    both = compiled.kernel.evaluate([0] * dt.size, y, dt)
    n = compiled.mechanism.degrees
    return both[:, :n], both[:, n:]


@dataclass(frozen=True)
class FirstEvent:
    """The first event of a flight."""

    status: vi.Status
    time: float
    side: int
    rate: float


def first_event(system: Any, state: vi.State, t_max: float = math.inf) -> FirstEvent:
    """What ends the first flight."""
    compiled = compile_mechanism(mechanism_of(system))
    at = begin(compiled, state)
    out = compiled.kernel.simulate(at, t_max, flight_limit_of(compiled), 1, 1)
    return FirstEvent(
        vi.Status(int(out["status"][0])),
        float(out["high"][0] + out["low"][0]),
        int(out["side"][0]),
        float(out["rate_before"][0]),
    )


def tangents(
    system: Any, state: vi.State, seeds: NDArray[Any], impacts: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Columns d(x, v, theta) after the last impact, and d(time), for seeds in (x, v, theta)."""
    compiled = compile_mechanism(mechanism_of(system))
    out = compiled.kernel.tangents(
        list(state.position), list(state.velocity), phases_of(compiled.mechanism, state.phase),
        np.ascontiguousarray(seeds, dtype=float), math.inf, flight_limit_of(compiled),
        8 * impacts + 8, impacts,
    )  # fmt: skip
    return out["columns"], out["durations"]


def growth(system: Any, state: vi.State, impacts: Sequence[int]) -> float:
    """The largest gain of an error of the start, in state or time, at any of these impacts."""
    seeds = np.eye(2 * len(state.position) + 1)
    gains = [1.0]
    for count in impacts:
        columns, durations = tangents(system, state, seeds, count)
        gains += [float(np.abs(columns).sum(axis=1).max()), float(np.abs(durations).sum())]
    return max(gains)


def stated_eps(damper: vi.ImpactDamper, x1: Any, v1: Any, x2: Any, v2: Any, theta: Any,
               steps: Any, rounds: Any = 0) -> Any:  # fmt: skip
    """eps_g of a step of the march, as search/certified_flight.hpp states it.

    2^-53 (16 + 4 applications) (sum of the terms of u, with their change over a step, + limit);
    a round counts as two applications.
    """
    compiled = compile_mechanism(damper.mechanism)
    d = damper.omega_n**2 - damper.omega**2, 2 * damper.zeta * damper.omega_n * damper.omega
    size = d[0] ** 2 + d[1] ** 2
    p, q = damper.force * d[0] / size, -damper.force * d[1] / size
    s, c = np.sin(theta), np.cos(theta)
    x_free = x1 - p * s - q * c
    v_free = v1 - damper.omega * (p * c - q * s)
    terms = abs(x_free) + abs(x2) + abs(p * s) + abs(q * c)
    change = abs(v_free) + abs(v2) + damper.omega * (abs(q * s) + abs(p * c))
    applied = steps % RUNG + steps // RUNG % RUNG + steps // RUNG**2
    total = terms + compiled.step * change + damper.half_clearance
    return UNIT * (16.0 + 4.0 * (applied + 2 * rounds)) * total
