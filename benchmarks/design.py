"""Response and best damper of the frame of docs/design.md, beside SciPy for one point.

Asserted before anything is timed: at one frequency SciPy's integrator, stopped at every impact, settles on the same
amplitude. Asserted of responses: orbits in the middle of their branches, measured alone, have the values of the curves;
of the best damper: a sweep of that machine alone has its worst amplitude. CPU times are those of all threads together:
other work on the machine counts little.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import vibroimpact as vi
from benchmarks.case import Floats

HERTZ, BAND = 8.0, (6.0, 10.0)
AT = 6.4  # Hz: 1-1-1 orbits, beside motion without impacts
AGREE = 1e-6  # relative, of the amplitude
SETTLE, PERIODS = 300, 20  # of SciPy's run
NUMBER, STARTS, MOST_BRANCHES = 200, 16, 9
SPINDLE_BAND = (40.0, 50.0)
VARY = {"mass_ratio": (0.02, 0.15), "half_clearance": (0.0013, 0.053), "restitution": (0.3, 0.9)}
TURN = 2.0 * math.pi


@dataclass(slots=True)
class Row:
    """One line of the table."""

    what: str
    seconds: float
    cpu: float  # seconds of all threads
    members: int  # motions that were settled and observed


@dataclass(slots=True)
class Clocks:
    """Time since it was made: on the wall, and of the processor."""

    wall: float = field(default_factory=time.perf_counter)
    cpu: float = field(default_factory=time.process_time)

    def read(self) -> tuple[float, float]:
        """Seconds of both."""
        return time.perf_counter() - self.wall, time.process_time() - self.cpu


def frame(hertz: float = HERTZ) -> vi.ImpactDamper:
    """120 kg at 8 Hz with 2 % of damping and 400 N, a ball of 6 kg with 20 mm of play."""
    w = TURN * HERTZ
    return vi.ImpactDamper.from_physical(
        M1=120.0, M2=6.0, K=120.0 * w**2, C=0.04 * 120.0 * w, F0=400.0, Omega=TURN * hertz,
        D=0.02, restitution=0.6,
    )  # fmt: skip


def by_scipy(damper: vi.ImpactDamper, start: vi.State) -> float:
    """Amplitude of x1 over the last periods, integrated from impact to impact."""

    def rates(t: float, y: Floats) -> Floats:
        force = damper.force / damper.mass * math.sin(damper.omega * t + start.phase)
        pull = -2.0 * damper.zeta * damper.omega_n * y[1] - damper.omega_n**2 * y[0]
        return np.array([y[1], force + pull, y[3], 0.0])

    def gap(side: float) -> object:
        def left(_t: float, y: Floats) -> float:
            return damper.half_clearance - side * (y[2] - y[0])

        left.terminal, left.direction = True, -1.0  # type: ignore[attr-defined]
        return left

    t, y = 0.0, np.array([*np.ravel(list(zip(start.position, start.velocity, strict=True)))])
    end, watched = (SETTLE + PERIODS) * damper.period, SETTLE * damper.period
    largest, smallest = -math.inf, math.inf
    share = damper.mass_ratio / (1.0 + damper.mass_ratio)
    while t < end:
        found = solve_ivp(
            rates, (t, end), y, method="DOP853", rtol=1e-10, atol=1e-14,
            events=(gap(1.0), gap(-1.0)), dense_output=True,
        )  # fmt: skip
        t, y = float(found.t[-1]), found.y[:, -1].copy()
        if t > watched:
            fine = found.sol(np.linspace(max(found.t[0], watched), t, 4000))[0]
            largest, smallest = max(largest, fine.max()), min(smallest, fine.min())
        if found.status == 1:
            change = (1.0 + damper.restitution) * (y[3] - y[1])
            y[1] += share * change
            y[3] -= (1.0 - share) * change
    return 0.5 * (largest - smallest)


def spindle() -> vi.ImpactDamper:
    """12 kg at 45 Hz with 2 % of damping and 60 N, a ball of 0.4 kg with 4 mm of play: it is hardly met."""
    return vi.ImpactDamper.from_physical(
        M1=12.0, M2=0.4, K=9.6e5, C=130.0, F0=60.0, Omega=282.7, D=4e-3, restitution=0.6
    )


def response_rows(
    what: str, system: vi.ImpactDamper, band: tuple[float, float], most: int
) -> list[Row]:
    """Time a response, and the first picture of it; a few of its values are asserted."""
    first: list[tuple[float, float]] = []
    clocks = Clocks()
    found = vi.frequency_response(
        system, "omega", band, unit="Hz", measure="x1", points=NUMBER, starts=STARTS, most_branches=most,
        so_far=lambda _: first or first.append(clocks.read()), progress=False,
    )  # fmt: skip
    whole = clocks.read()
    curves = [curve for curve in found.curves if curve.branch is not None]
    for curve in curves:
        k = len(curve.value) // 2
        alone = curve.at(float(curve.parameter[k]))
        assert any(abs(answer.value - curve.value[k]) < AGREE * answer.value for answer in alone)
    count, members = len(curves), NUMBER * STARTS
    branches = f"with {count} branch{'es' if count > 1 else ''}, {sum(len(c.value) for c in curves)} points"
    return [
        Row(
            f"{what}, {NUMBER} frequencies x {STARTS} starts, the first picture", *first[0], members
        ),
        Row(f"the same, {branches}", *whole, members),
    ]


def rows_of() -> list[Row]:
    """Check one point, then time."""
    damper = frame(AT)
    orbit = vi.find_orbit(damper, vi.simulate(damper, damper.free_start(), impacts=4000).last)
    exact = vi.measure_of(damper, "x1").of_orbit(orbit)
    clocks = Clocks()
    sampled = by_scipy(damper, orbit.state)
    alone = clocks.read()
    assert abs(sampled - exact) < AGREE * exact, f"{orbit.symbol}: SciPy {sampled}, exact {exact}"
    return [
        Row(f"SciPy, {SETTLE + PERIODS} periods from one start at one frequency", *alone, 1),
        *response_rows("frame", frame(), BAND, MOST_BRANCHES),
        *response_rows("spindle", spindle(), SPINDLE_BAND, MOST_BRANCHES),
        best_of(),
    ]


def best_of() -> Row:
    """Time the search of docs/optimisation.md for three parameters of the frame."""
    over = vi.Objective("omega", BAND, "x1", unit="Hz")
    clocks = Clocks()
    best = vi.optimise(frame(), VARY, over, progress=False)
    took = clocks.read()
    row = np.array([[best.parameters[name] for name in VARY]])
    again = float(best.judge.values(row)[0])
    assert abs(again - best.value) < AGREE * again, f"best {best.value}, again {again}"
    return Row(f"the best of {best.machines} machines in three parameters", *took, best.machines)


def run(_: argparse.Namespace) -> dict[str, Any]:
    """Time responses, and the search of a damper."""
    rows = rows_of()
    for row in rows:
        each = 1e3 * row.seconds / row.members
        print(f"{row.what:70s} {row.seconds:8.2f} s {row.cpu:8.2f} s of CPU {each:10.2f} ms each")
    return {"rows": rows}
