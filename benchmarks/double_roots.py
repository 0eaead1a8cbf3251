"""Flights whose first contact is a nearly double root, and how many of them a method finds.

Method    At a drawn time t* the gap coordinate u = x2 - x1 is given a maximum just beyond a stop:
          u(t*) = +-(delta + depth), u'(t*) = 0. The main mass is drawn; the free mass flies
          straight, so both conditions are linear in its start:
              v2 = x1'(t*),    x2(0) = +-(delta + depth) + x1(t*) - v2 t*                       (1)
          A flight is kept if it starts inside the clearance, u turns back at t* (u'' towards the
          middle, at least `LEAST_CURVATURE`), and no contact comes before the entry.
Witness   Entry and exit (the two roots), and that the entry is the first contact at all, in
          `DIGITS`-digit arithmetic from the rounded start, by strides that cannot step over a root:
          |g''| <= M, stride to the positive root of g + g' s - M s^2 / 2 = 0.                   (2)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpmath import mp, mpf  # type: ignore[import-untyped]

from benchmarks.case import Floats, Parameters
from benchmarks.peers.method import Method

DEPTHS = [10.0**-k for k in range(3, 13)]
DIGITS = 40
LEAST_CURVATURE = 0.05
DEPTH_TOLERANCE = 0.01
"""Allowed relative change of the depth by rounding the start to double precision."""


@dataclass(frozen=True, slots=True)
class DoubleRoot:
    """A start, and the two times between which the free mass would be inside the stop."""

    start: tuple[float, ...]
    depth: float
    entry: float
    exit: float

    def is_found_by(self, time: float) -> bool:
        """Tell whether a first impact at `time` is the entry: within a quarter of the passage."""
        return abs(time - self.entry) <= (self.exit - self.entry) / 4


class Flight:
    """The closed-form motion from one start in `DIGITS`-digit arithmetic."""

    def __init__(self, p: Parameters, x1: float, v1: float, phase: float) -> None:
        omega_n, zeta, self.omega = mpf(p.omega_n), mpf(p.zeta), mpf(p.omega)
        stiff, damped = omega_n**2 - self.omega**2, 2 * zeta * omega_n * self.omega
        self.decay, self.omega_d = zeta * omega_n, omega_n * mp.sqrt(1 - zeta**2)
        self.amplitude = p.force / mp.hypot(stiff, damped)
        self.tau = mpf(phase) - mp.atan2(damped, stiff)
        self.a = x1 - self.amplitude * mp.sin(self.tau)
        forced = self.amplitude * self.omega * mp.cos(self.tau)
        self.b = (v1 - forced + self.decay * self.a) / self.omega_d
        self.bound = (
            mp.hypot(self.a, self.b) * omega_n**2 + abs(self.amplitude) * self.omega**2
        )  # (2): |x1''| <= M

    def main_mass(self, t: mpf) -> tuple[mpf, mpf, mpf]:
        """Return position, velocity and acceleration of the main mass."""
        c, s, e = mp.cos(self.omega_d * t), mp.sin(self.omega_d * t), mp.exp(-self.decay * t)
        a, b, d, w = self.a, self.b, self.decay, self.omega_d
        a1, b1 = b * w - a * d, -a * w - b * d
        a2, b2 = b1 * w - a1 * d, -a1 * w - b1 * d
        sine, cosine = mp.sin(self.omega * t + self.tau), mp.cos(self.omega * t + self.tau)
        forced = (sine, self.omega * cosine, -(self.omega**2) * sine)
        transient = (e * (a * c + b * s), e * (a1 * c + b1 * s), e * (a2 * c + b2 * s))
        x, v, acc = (q + self.amplitude * f for q, f in zip(transient, forced, strict=True))
        return x, v, acc

    def distance(self, x2: float, v2: float, t: mpf) -> tuple[mpf, mpf]:
        """Return u and u' at time t."""
        x1, v1, _ = self.main_mass(t)
        return x2 + v2 * t - x1, v2 - v1

    def first_contact(self, x2: float, v2: float, delta: float) -> mpf:
        """Return the first time at which |u| = delta, by (2)."""
        t = mpf(0)
        while True:
            u, du = self.distance(x2, v2, t)
            gaps = ((delta - u, -du), (delta + u, du))
            step = min(self._stride(g, dg) for g, dg in gaps)
            if step < mpf(10) ** (10 - DIGITS):
                return t
            t += step

    def _stride(self, gap: mpf, slope: mpf) -> mpf:
        return 2 * gap / (mp.sqrt(slope**2 + 2 * self.bound * gap) - slope)


def _try(p: Parameters, depth: float, rng: np.random.Generator) -> DoubleRoot | None:
    """Draw one flight by (1) and check it in high precision; None if it does not qualify."""
    side = float(rng.choice((-1.0, 1.0)))
    x1, v1 = (float(v) for v in rng.uniform(-2, 2, 2))
    phase, turn = float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(0.25, 1.5) * p.period)
    flight = Flight(p, x1, v1, phase)
    x1_turn, v1_turn, acceleration = flight.main_mass(mpf(turn))
    v2 = float(v1_turn)
    x2 = float(side * (p.half_clearance + depth) + x1_turn - v1_turn * turn)
    if abs(x2 - x1) >= p.half_clearance or side * acceleration < LEAST_CURVATURE:
        return None
    return _witness(p, flight, depth, (x1, x2, v1, v2, phase, 0.0), (turn, side, acceleration))


def _witness(
    p: Parameters, flight: Flight, depth: float, start: tuple[float, ...], turn: tuple[float, ...]
) -> DoubleRoot | None:
    """Measure depth, entry and exit of the rounded start; None if they are not as constructed."""
    _, x2, _, v2, _, _ = start
    near, side, acceleration = turn

    def beyond(t: mpf) -> mpf:
        return side * flight.distance(x2, v2, t)[0] - p.half_clearance

    top = mp.findroot(lambda t: flight.distance(x2, v2, t)[1], mpf(near))
    passage = 4 * mp.sqrt(2 * depth / abs(acceleration))
    entry = flight.first_contact(x2, v2, p.half_clearance)
    if abs(beyond(top) - depth) > DEPTH_TOLERANCE * depth or not 0 < top - entry < passage:
        return None
    if beyond(top + passage) >= 0:
        return None
    leaving = mp.findroot(beyond, (top, top + passage), solver="anderson")
    return DoubleRoot(start, float(beyond(top)), float(entry), float(leaving))


def construct(parameters: Parameters, count: int, rng: np.random.Generator) -> list[DoubleRoot]:
    """Construct `count` flights, as many of each depth in `DEPTHS`."""
    flights: list[DoubleRoot] = []
    with mp.workdps(DIGITS):
        while len(flights) < count:
            made = _try(parameters, DEPTHS[len(flights) % len(DEPTHS)], rng)
            if made is not None:
                flights.append(made)
    return flights


def count_found(method: Method, parameters: Parameters, flights: list[DoubleRoot]) -> int:
    """Count the flights whose first impact the method finds at its entry."""
    starts: Floats = np.array([flight.start for flight in flights])
    first = method.run(starts, parameters, 1).times[:, 0]
    return sum(f.is_found_by(float(t)) for f, t in zip(flights, first, strict=True))
