"""Diffrax: Dopri8 on many trajectories at once (`jax.vmap`), an `Event` that ends each flight.

Written as its documentation of events suggests: `diffeqsolve` up to the event, the impact law, and
again, in a `lax.scan` over the impacts. The compiled program runs on one core.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.peers.method import Result, require

BATCH = 64  # trajectories side by side: those that finish a flight early wait for the others
RTOL, ATOL = 3e-12, 3e-14
"""Contact times come from the interpolant of a step, which is less accurate than the step: with
rtol 1e-11 some impact times are off by more than `Diffrax.tolerance`."""
ROOT_TOLERANCE = 1e-12
LONGEST_FLIGHT = 1e4
INSTALL = "diffrax"

Array = Any


def _equations(p: Parameters) -> tuple[Callable[..., Array], Callable[..., Array]]:
    """Return the right-hand side and the gap, both of time, state and phase."""
    jnp = require("jax.numpy", INSTALL)

    def right_hand_side(t: Array, y: Array, phase: Array) -> Array:
        x1, _, v1, v2 = y
        force = p.force * jnp.sin(p.omega * t + phase)
        acceleration = force - 2 * p.zeta * p.omega_n * v1 - p.omega_n**2 * x1
        return jnp.array([v1, v2, acceleration, 0.0])

    def gap(t: Array, y: Array, args: Array, **_: object) -> Array:  # noqa: ARG001
        return p.half_clearance - jnp.abs(y[1] - y[0])

    return right_hand_side, gap


def _after_impact(p: Parameters, y: Array) -> Array:
    jnp = require("jax.numpy", INSTALL)
    (x1, x2, v1, v2), mu, R = y, p.mass_ratio, p.restitution
    stop = jnp.sign(x2 - x1) * p.half_clearance
    return jnp.array([x1, x1 + stop, ((1 - mu * R) * v1 + mu * (1 + R) * v2) / (1 + mu),
                      ((1 + R) * v1 + (mu - R) * v2) / (1 + mu)])  # fmt: skip


@cache
def _simulator(p: Parameters) -> Callable[[Floats, int], Array]:
    """Compile nothing yet: return starts, impacts -> impact times, to be compiled when called."""
    jax, diffrax = require("jax", INSTALL), require("diffrax", INSTALL)
    newton = require("optimistix", INSTALL).Newton(ROOT_TOLERANCE, ROOT_TOLERANCE)
    jax.config.update("jax_enable_x64", True)
    right_hand_side, gap = _equations(p)
    term, solver = diffrax.ODETerm(right_hand_side), diffrax.Dopri8()
    controller = diffrax.PIDController(rtol=RTOL, atol=ATOL)
    event = diffrax.Event(gap, newton, direction=False)

    def flight(t: Array, y: Array, phase: Array) -> tuple[Array, Array]:
        end = diffrax.diffeqsolve(
            term, solver, t, t + LONGEST_FLIGHT, None, y, args=phase, event=event, throw=False,
            stepsize_controller=controller, saveat=diffrax.SaveAt(t1=True),
        )  # fmt: skip
        found = end.result == diffrax.RESULTS.event_occurred
        return jax.numpy.where(found, end.ts[0], np.nan), _after_impact(p, end.ys[0])

    def run(start: Array, impacts: int) -> Array:
        def one(at: tuple[Array, Array], _: None) -> tuple[tuple[Array, Array], Array]:
            t, y = flight(*at, start[4])
            return (t, y), t

        return jax.lax.scan(one, (0.0, start[:4]), None, length=impacts)[1]

    compiled: Callable[[Floats, int], Array] = jax.jit(jax.vmap(run, (0, None)), static_argnums=1)
    return compiled


@dataclass(frozen=True, slots=True)
class Diffrax:
    """Diffrax, batches of `BATCH` trajectories, double precision, one core."""

    name: str = "Diffrax Dopri8, vmap"
    settings: str = f"vmap of {BATCH}, rtol={RTOL:g}, Event with Newton on the gap"
    max_starts: int | None = BATCH
    tolerance: float = 1e-6  # that of SciPy
    misses_impacts: bool = True  # two of them within one of its steps

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate the starts in batches; just-in-time compilation is not timed."""
        simulate = _simulator(parameters)
        missing = -len(starts) % BATCH
        filled = np.concatenate([starts, np.repeat(starts[-1:], missing, axis=0)])
        batches = filled.reshape(-1, BATCH, starts.shape[1])
        np.asarray(simulate(batches[0], impacts))  # compiles
        begin = time.perf_counter()
        times = np.concatenate([np.asarray(simulate(batch, impacts)) for batch in batches])
        return Result(time.perf_counter() - begin, times[: len(starts)])
