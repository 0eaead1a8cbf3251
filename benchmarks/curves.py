"""Neimark-Sacker curves in two parameters, and how their cost grows.

Every point has all test functions of its curve: resonances up to 1:12, the cubic coefficient, the multipliers
of the other directions, touches. Answers are asserted before anything is timed: at the resonances 1:4 of the
damper the closed-form orbit has the half multipliers i and -i; every curve keeps a pair of product one.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import vibroimpact as vi
from benchmarks import machine
from benchmarks.branches import damper, longer, seconds

POINTS = 200
PLANE = ("omega", "half_clearance")
ATLAS = ((0.5, 1.3), (2.0, 20.0))
R4 = ((0.927753603544, 5.071506969507), (0.978148017411, 6.014041414363))  # of the closed form
WIDE = ((0.72, 1.1), (3.0, 14.0))
NEAR, AROUND = 0.79, (0.75, 0.82)  # frequencies: of the start, and of the branch with the point
CLEARANCE = 9.0  # where no resonance is near
IMPACTS = (2, 4, 8)
DEGREES = (2, 3, 5, 8)
MASS, RATE, DAMPING = 0.01, 3.0, 0.2  # of an absorber; frequency of the first, damping ratio
LAW = "elements[0].restitution"
ON = 1e-8  # of a product of multipliers


@dataclass(slots=True)
class Row:
    """One line of the table."""

    what: str
    degrees: int
    impacts: int
    points: int
    seconds_per_200: float


def start() -> vi.ImpactDamper:
    """Set A with a wider clearance, beside a Neimark-Sacker point."""
    return replace(damper(), omega=NEAR, half_clearance=CLEARANCE)


def symmetric() -> vi.Orbit:
    """Its symmetric orbit, of which half is solved."""
    return vi.find_orbit(start(), vi.symmetric_orbits(start())[0])


def with_absorbers(machine: vi.ImpactDamper, degrees: int) -> vi.Mechanism:
    """A damper with so many coordinates: absorbers on its main mass, each stiffer than the one before."""
    plain = machine.mechanism
    mass, stiffness, damping = np.zeros((3, degrees, degrees))
    pairs = ((mass, plain.mass), (stiffness, plain.stiffness), (damping, plain.damping))
    for whole, part in pairs:
        whole[:2, :2] = part
    for j in range(2, degrees):
        rate = RATE + j
        mass[j, j] = MASS
        spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
        stiffness[np.ix_([0, j], [0, j])] += MASS * rate**2 * spring
        damping[np.ix_([0, j], [0, j])] += 2.0 * DAMPING * MASS * rate * spring
    more = (0.0,) * (degrees - 2)
    forces = [replace(f, sine=(*f.sine, *more), cosine=(*f.cosine, *more)) for f in plain.forces]
    return replace(
        plain,
        mass=mass,
        stiffness=stiffness,
        damping=damping,
        constant_force=np.zeros(degrees),
        forces=tuple(forces),
        elements=tuple(replace(c, row=(*c.row, *more)) for c in plain.elements),
    )


def moving_along(degrees: int) -> vi.Orbit:
    """Orbit of that mechanism, from the symmetric one of the damper, the absorbers moving along."""
    state = carried(vi.symmetric_orbits(start())[0].state, degrees)
    system = with_absorbers(start(), degrees)
    return vi.find_orbit(system, state, stops="AB", cycles=1, symmetric=True)


def carried(state: vi.State, degrees: int) -> vi.State:
    """A state of the damper with absorbers that move as its main mass."""
    more = degrees - 2
    return vi.State(
        (*state.position, *(state.position[0],) * more),
        (*state.velocity, *(state.velocity[0],) * more),
        state.phase,
    )


def torus_of(orbit: vi.Orbit) -> vi.BifurcationPoint:
    """The Neimark-Sacker point near an orbit, by frequency."""
    assert orbit.converged, orbit
    branch = vi.continue_orbit(orbit, "omega", AROUND)
    return next(point for point in branch.special_points if point.kind == "NS")


def assert_resonances() -> None:
    """The resonances 1:4 of the damper are those of its closed form."""
    curve = vi.continue_bifurcation(torus_of(symmetric()), PLANE, WIDE)
    for label in ("R4_1", "R4_2"):
        at = replace(damper(), **curve[label].parameters)
        off = [min(abs(orbit.half_multipliers - 1j)) for orbit in vi.symmetric_orbits(at)]
        assert min(off) < ON, (label, off)


def row_of(what: str, point: vi.BifurcationPoint, names: tuple[str, str], rounds: int) -> Row:
    """A curve from a point; a pair of its multipliers has the product one all along."""
    bounds = WIDE if names == PLANE else (AROUND, (0.7, 0.9))
    steps = vi.Steps(first=0.005, largest=0.02, points=POINTS // 2)

    def follow() -> vi.BifurcationCurve:
        return vi.continue_bifurcation(point, names, bounds, steps=steps)

    curve = follow()
    every = np.triu_indices(curve.multipliers.shape[1], 1)
    products = curve.multipliers[:, every[0]] * curve.multipliers[:, every[1]]
    assert np.abs(products - 1.0).min(axis=1).max() < ON, what
    orbit = point.orbit
    return Row(
        what, orbit.mechanism.degrees, len(orbit.signature.impacts), len(curve),
        seconds(follow, rounds) / len(curve) * POINTS,
    )  # fmt: skip


def rows(rounds: int, few: slice) -> Iterator[Row]:
    """Lines of the table, of a few of the sizes."""
    yield row_of("damper, symmetric", torus_of(symmetric()), PLANE, rounds)
    for impacts in IMPACTS[few]:
        yield row_of("damper", torus_of(longer(symmetric(), impacts)), PLANE, rounds)
    for degrees in DEGREES[few]:
        point = torus_of(moving_along(degrees))
        yield row_of("with absorbers, symmetric", point, ("omega", LAW), rounds)


def atlas_seconds() -> float:
    """Seconds for an atlas of set A, with the curves of orbits 2-2-2; both resonances 1:4 are in it."""
    orbit = vi.symmetric_orbits(replace(damper(), omega=0.95))[0]
    found: list[vi.Atlas] = []

    def search() -> None:
        found.append(vi.bifurcation_atlas(orbit, PLANE, ATLAS))

    taken = seconds(search, 1)
    at = [point.parameters for point in found[-1].points if point.kind == "R4"]
    for known in R4:
        assert min(np.abs(np.subtract(known, place)).max() for place in at) < ON, known
    return taken


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Time curves, and an atlas."""
    assert_resonances()
    with machine.one_core():
        table = list(rows(options.rounds, slice(1 if options.quick else None)))
        if not options.quick:
            print(f"atlas of set A: {atlas_seconds():.1f} s")
    print(f"{'orbit':26} {'degrees':>7} {'impacts':>7} {'points':>7} {'s / 200 points':>15}")
    for row in table:
        print(
            f"{row.what:26} {row.degrees:7} {row.impacts:7} {row.points:7} {row.seconds_per_200:15.2f}"
        )
    return {"rows": table}
