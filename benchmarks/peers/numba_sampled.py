"""The sampled closed form of ``sampled_closed_form.cpp`` in Python, compiled by numba."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar, cast

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.peers.method import Result, UnavailableError

try:
    from numba import njit
except ImportError:
    njit = None  # type: ignore[assignment]

Function = TypeVar("Function", bound=Callable[..., Any])

SAMPLES_PER_PERIOD = 64
ROOT_TOLERANCE = 1e-14
LONGEST_FLIGHT = 1e4

Constants = tuple[float, float, float, float, float, float, float]
"""a, b, decay, omega_d, amplitude, omega, tau of ``closed_form.hpp``, equation (1)."""


def compiled(function: Function) -> Function:
    """Compile a function just in time; leave it alone without numba."""
    return function if njit is None else cast(Function, njit(function))


@compiled
def _motion(t: float, flight: Constants) -> tuple[float, float]:
    a, b, decay, omega_d, amplitude, omega, tau = flight
    c, s, e = math.cos(omega_d * t), math.sin(omega_d * t), math.exp(-decay * t)
    forced = omega * t + tau
    x1 = e * (a * c + b * s) + amplitude * math.sin(forced)
    v1 = e * ((b * omega_d - a * decay) * c - (a * omega_d + b * decay) * s)
    return x1, v1 + amplitude * omega * math.cos(forced)


@compiled
def _polish(
    low: float, high: float, x2: float, v2: float, delta: float, flight: Constants
) -> float:
    t = 0.5 * (low + high)
    while True:
        x1, v1 = _motion(t, flight)
        u = x2 + v2 * t - x1
        side = math.copysign(1.0, u)
        gap = delta - side * u
        low, high = (t, high) if gap > 0 else (low, t)
        slope = side * (v2 - v1)
        new = t + gap / slope if slope != 0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) <= ROOT_TOLERANCE * max(1.0, t):
            return new
        t = new


@compiled
def _first_contact(x2: float, v2: float, delta: float, step: float, flight: Constants) -> float:
    a, b, decay, omega_d, amplitude, omega, tau = flight
    for k in range(1, int(LONGEST_FLIGHT / step) + 1):
        t = k * step
        transient = a * math.cos(omega_d * t) + b * math.sin(omega_d * t)
        x1 = math.exp(-decay * t) * transient + amplitude * math.sin(omega * t + tau)
        if abs(x2 + v2 * t - x1) >= delta:
            return _polish(t - step, t, x2, v2, delta, flight)
    return math.nan


@compiled
def _simulate(start: Floats, p: tuple[float, ...], times: Floats) -> None:
    mu, omega_n, zeta, R, delta, omega, force = p
    x1, x2, v1, v2, phase, _ = start
    decay, omega_d = zeta * omega_n, omega_n * math.sqrt(1 - zeta * zeta)
    stiff, damped = omega_n * omega_n - omega * omega, 2 * decay * omega
    amplitude, lag = force / math.hypot(stiff, damped), math.atan2(damped, stiff)
    step = 2 * math.pi / omega / SAMPLES_PER_PERIOD
    elapsed = 0.0
    for k in range(len(times)):
        tau = phase - lag
        a = x1 - amplitude * math.sin(tau)
        b = (v1 - amplitude * omega * math.cos(tau) + decay * a) / omega_d
        flight = (a, b, decay, omega_d, amplitude, omega, tau)
        t = _first_contact(x2, v2, delta, step, flight)
        if math.isnan(t):
            return
        elapsed += t
        times[k] = elapsed
        x1, w1 = _motion(t, flight)
        x2 = x1 + math.copysign(delta, x2 + v2 * t - x1)
        v1 = ((1 - mu * R) * w1 + mu * (1 + R) * v2) / (1 + mu)
        v2 = ((1 + R) * w1 + (mu - R) * v2) / (1 + mu)
        phase = (phase + omega * t) % (2 * math.pi)


@dataclass(frozen=True, slots=True)
class Numba:
    """The sampled closed form in numba."""

    name: str = "numba closed form, sampled"
    settings: str = f"{SAMPLES_PER_PERIOD} samples per forcing period, njit"
    max_starts: int | None = None
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Simulate the starts one after another; just-in-time compilation is not timed."""
        if njit is None:
            raise UnavailableError("numba is not installed: pip install numba")
        p = tuple(parameters.as_array().tolist())
        _simulate(starts[0], p, np.empty(1))
        times = np.full((len(starts), impacts), np.nan)
        begin = time.perf_counter()
        for start, row in zip(starts, times, strict=True):
            _simulate(start, p, row)
        return Result(time.perf_counter() - begin, times)
