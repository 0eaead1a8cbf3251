"""Measures taken of sweeps, beside that of a position: velocities, accelerations, harmonics, forces, powers.

Asserted before anything is timed: of a settled periodic motion every measure is that of its orbit, to 1e-9.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import vibroimpact as vi
from benchmarks import branches
from vibroimpact.model.parameters import parameter_value

SETTLE, PERIODS, SIDE = 50, 200, 10  # periods; values along each of two parameters
QUICK_SIDE = 3
AGREE = 1e-9
POSITION = "x1"
OF_DAMPER = (
    POSITION,
    "v1",
    "a1",
    "rms x1",
    "rms v1",
    "harmonic 1 x1",
    "harmonic 3 a1",
    "power of dashpots",
    "impulse",
)
OF_STOPS = (
    POSITION,
    "a1",
    "harmonic 3 x1",
    "contact force 0",
    "power 0",
    "power 1",
    "power of dashpots",
)


class Row(NamedTuple):
    """One line of the table."""

    machine: str
    measure: str
    milliseconds: float  # CPU, of a member


def damper() -> vi.ImpactDamper:
    """Set A of the impact damper."""
    return replace(branches.damper(), omega=1.2)


def rubbing(k: float, w: float) -> vi.Mechanism:
    """A mass between soft stops, with friction."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(w, (0.0,), (1.0,)),),
        elements=(vi.SoftStop((1.0,), -0.6, 0.6, stiffness=k, damping=0.5), vi.Friction((1.0,), 0.1)),
    )  # fmt: skip


MACHINES: dict[str, Any] = {
    "impact damper": (
        damper(), OF_DAMPER, {"restitution": (0.78, 0.82), "omega": (1.19, 1.21)}, damper().free_start(),
    ),
    "soft stops and friction": (
        vi.Family(rubbing, k=29.0, w=0.9), OF_STOPS, {"k": (25.0, 33.0), "w": (0.8, 1.0)}, vi.State((0.0,), (0.0,)),
    ),
}  # fmt: skip


def sweep_of(system: Any, name: str, over: dict[str, Any], start: vi.State, settle: int) -> Any:
    """Sweep for a measure, and take it of all members."""
    measure = vi.measure_of(system, name)
    members = vi.sweep(
        system, over=over, start=start, observe=measure.observers, settle_periods=settle, periods=PERIODS,
        workers=1, progress=False,
    )  # fmt: skip
    return measure.of_sweep(members)


def assert_right(system: Any, names: tuple[str, ...], start: vi.State, parameter: str) -> None:
    """Compare with the orbit on which the motion settles."""
    orbit = vi.find_orbit(system, vi.simulate(system, start, impacts=2000).last)
    here: dict[str, Any] = {parameter: [parameter_value(system, parameter)]}
    for name in names:
        exact = vi.measure_of(system, name).of_orbit(orbit)
        found = float(sweep_of(system, name, here, orbit.state, 0).values.ravel()[0])
        assert abs(found - exact) < AGREE * max(abs(exact), AGREE), (
            f"{name}: {found}, exact {exact}"
        )


def rows_of(side: int, rounds: int) -> list[Row]:
    """Check, then time each measure, alternating with the others."""
    rows = []
    for machine, (system, names, ranges, start) in MACHINES.items():
        assert_right(system, names, start, next(iter(ranges)))
        over = {name: np.linspace(*ends, side) for name, ends in ranges.items()}
        took = dict.fromkeys(names, np.inf)
        for _ in range(rounds):
            for name in names:
                begin = time.process_time()
                sweep_of(system, name, over, start, SETTLE)
                took[name] = min(took[name], time.process_time() - begin)
        rows += [Row(machine, name, 1e3 * took[name] / side**2) for name in names]
    return rows


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Time measures of sweeps."""
    rows = rows_of(QUICK_SIDE if options.quick else SIDE, options.rounds)
    position = {row.machine: row.milliseconds for row in rows if row.measure == POSITION}
    for row in rows:
        ratio = row.milliseconds / position[row.machine]
        print(
            f"{row.machine:26s} {row.measure:20s} {row.milliseconds:9.3f} ms a member {ratio:8.2f} x position"
        )
    return {"rows": rows}
