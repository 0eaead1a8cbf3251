"""Branches of a period-doubling cascade, and a branch diagram.

The oscillator x'' + 0.04 x' + x = cos(omega t), x <= 1.26, restitution 0.8. Before it is timed each
branch is checked: where the branch before it doubles its period it has a branch point, and the
multipliers of its orbits have the product that damping and restitution give them.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

import vibroimpact as vi

POINTS = 100  # in each direction
STEPS = vi.Steps(first=0.02, largest=0.5, points=POINTS)
RANGE, WIDE = (0.55, 0.8), (0.3, 3.0)
LEVELS = 4  # from 1-2-0 to 16-32-0
ROUNDING = 1e-12  # of multipliers below 10: the smaller ones are exact relative to the largest


def oscillator(omega: float) -> vi.Mechanism:
    """The oscillator at a forcing frequency."""
    return vi.Mechanism(
        mass=[[1.0]],
        damping=[[0.04]],
        stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=1.26, restitution=0.8),),
    )


def check(branch: vi.Branch, doubling: vi.BifurcationPoint | None) -> None:
    """The facts of the first paragraph."""
    if doubling is not None:
        where = [abs(p.parameter - doubling.parameter) for p in branch.special_points]
        assert min(where) < 1e-9, (branch, doubling)
    for index in np.linspace(0, len(branch) - 1, 5).astype(int):
        orbit = branch.orbit(int(index))
        if abs(orbit.multipliers[0]) < 10.0:
            product = float(np.abs(orbit.multipliers).prod())
            assert orbit.determinant_error * product < ROUNDING, orbit


def cascade(orbit: vi.Orbit) -> None:
    """Follow the branches of the cascade, each from the last admissible doubling before it."""
    doubling = None
    for level in range(LEVELS + 1):
        begin = time.process_time()
        if doubling is None:
            branch = vi.continue_orbit(orbit, "omega", RANGE, steps=STEPS)
        else:
            found = vi.switch_branch(doubling, steps=STEPS)
            assert isinstance(found, vi.Branch), found
            branch = found
        spent = time.process_time() - begin
        assert branch.symbol == f"{2**level}-{2 ** (level + 1)}-0"
        check(branch, doubling)
        print(
            f"{branch.symbol:>8}: {len(branch)} points, {len(branch.special_points)} special, "
            f"{spent:.1f} s, {1e3 * spent / len(branch):.1f} ms a point",
            flush=True,
        )
        doublings = [p for p in branch.special_points if p.kind == "PD" and p.admissible]
        doubling = doublings[-1] if doublings else None


def diagram(orbit: vi.Orbit) -> None:
    """Ten branches around the first, none of them twice."""
    begin = time.process_time()
    found = vi.branch_diagram(orbit, "omega", WIDE, depth=4, most_branches=10, points=0)
    spent = time.process_time() - begin
    assert len(found.branches) == 10, found
    points = sum(len(branch) for branch in found.branches)
    print(f"diagram of {len(found.branches)} branches: {points} points, {spent:.1f} s")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Print the cascade, and the time of a branch diagram."""
    orbit = vi.find_orbit(oscillator(0.66), vi.State((1.26,), (-1.5,)))
    assert orbit.symbol == "1-2-0", orbit
    cascade(orbit)
    if not options.quick:
        diagram(orbit)
    return {}
