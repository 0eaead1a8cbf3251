"""Branches and curves of bifurcations that several test modules share, each followed once in a process."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import vibroimpact as vi
from vibroimpact.continuation import Steps

from .systems import paper_damper

PLANE = ("omega", "half_clearance")
COARSE = Steps(first=0.3, largest=4.0, tolerance=1e-3, points=200)  # points are as exact, and fewer


@cache
def torus_of_set_a() -> vi.BifurcationCurve:
    """Neimark-Sacker curve of set A, with the resonances R4_1, R4_2 and 2/9_1."""
    orbit = vi.symmetric_orbits(paper_damper("A", 0.95))[0]
    branch = vi.continue_orbit(orbit, "omega", (0.9, 1.0))
    return vi.continue_bifurcation(branch["NS1"], PLANE, ((0.8, 1.05), (3.5, 8.0)), steps=COARSE)


@cache
def torus_of_set_c() -> vi.BifurcationCurve:
    """Neimark-Sacker curve of set C, with the resonances R3_1 and R4_1."""
    orbit = vi.symmetric_orbits(paper_damper("C", 0.44))[0]
    branch = vi.continue_orbit(orbit, "omega", (0.42, 0.45))
    return vi.continue_bifurcation(branch["NS1"], PLANE, ((0.41, 0.45), (4.4, 8.1)), steps=COARSE)


@cache
def torus_of_a_map() -> vi.BifurcationCurve:
    """NS of a map, through R1, weak resonances, R4, R3 and R2 into neutral saddles on both sides."""
    henon = vi.ExplicitMap(
        lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2 + 0.5 * x[0] * x[1]],
        dimension=2,
        parameters=("alpha", "beta"),
    )
    start = vi.map_bifurcation("NS", henon, (2 / 3, 2 / 3), (16 / 9, 4 / 3))
    return vi.continue_bifurcation(start, ("alpha", "beta"), ((-3.0, 6.0), (-2.5, 2.5)))


@cache
def oscillator_branch(omega: float = 2.0) -> vi.Branch:
    """Orbits 1-1-0 of an oscillator with one stop."""
    oscillator = vi.ImpactOscillator(zeta=0.02, omega=2.0, restitution=0.8, clearance=0.0)
    start = vi.find_orbit(oscillator, vi.State((-1.0,), (0.0,)))
    along = vi.continue_orbit(start, "omega", (1.9, 2.5))
    there = along.orbit(int(np.argmin(np.abs(along.values - omega))))
    return vi.continue_orbit(there, "clearance", (-0.5, 0.5), inadmissible=True)


@cache
def double_of_set_c(label: str) -> vi.BifurcationPoint:
    """R2_1 of set C, on the orbit of sign +1, or R1_1, on that of sign -1."""
    place, at, omegas, bounds = {
        "R2_1": (0, (0.4995, 1.63), (0.4985, 0.4999), ((0.4985, 0.5005), (1.5, 1.7))),
        "R1_1": (1, (0.364, 8.93), (0.362, 0.366), ((0.3605, 0.367), (8.8, 9.05))),
    }[label]
    damper = replace(paper_damper("C", at[0]), half_clearance=at[1])
    orbit = vi.symmetric_orbits(damper)[place]
    branch = vi.continue_orbit(orbit, "omega", omegas, steps=COARSE)
    return vi.continue_bifurcation(branch["NS1"], PLANE, bounds, steps=COARSE)[label]
