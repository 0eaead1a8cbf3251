"""Branches of orbits and normal forms, and how both grow.

Answers are asserted before anything is timed: the special points of the impact damper's symmetric
branch against 50-digit references, determinant identities everywhere.
"""

from __future__ import annotations

import argparse
import time
import tomllib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import vibroimpact as vi
from benchmarks.case import SET_A
from vibroimpact.orbits.find import repeated, unfolded
from vibroimpact.simulation.simulate import before_stops

POINTS = 200
RANGE = (0.5, 1.5)
REFERENCE = Path(__file__).parents[1] / "tests" / "reference" / "bifurcations.toml"
DEGREES = (1, 2, 5, 10)
IMPACTS = (2, 4, 8, 12)
# A machine of two coordinates, where its branch begins, and how far it is followed, through changes of the sequence.
THROUGH: dict[str, tuple[vi.Element, float, tuple[float, float]]] = {
    "soft stop": (vi.SoftStop((0.0, 1.0), upper=0.3, stiffness=10.0, damping=0.2), 0.9, (0.8, 1.3)),
    "stick and slip": (vi.Friction((1.0, 0.0), kinetic=0.6, static=0.6), 0.5, (0.4, 0.7)),
    "rest, plastic impacts": (
        vi.RigidStop((0.0, 1.0), upper=0.2, restitution=0.0), 0.5, (0.45, 0.65),
    ),
    "rest after chatter": (vi.RigidStop((0.0, 1.0), upper=0.1, restitution=0.4), 0.3, (0.25, 0.32)),
}  # fmt: skip
NARROW = 0.02  # of omega: a branch of POINTS / 2 points in each direction is cut off there


@dataclass(slots=True)
class Row:
    """One line of the table."""

    what: str
    degrees: int
    impacts: int
    points: int
    branch_seconds_per_200: float
    normal_form_milliseconds: float


def damper() -> vi.ImpactDamper:
    """Set A in steady motion."""
    return vi.ImpactDamper(**{**asdict(SET_A), "omega": 1.1})


def chain(n: int) -> vi.Mechanism:
    """Equal masses between springs, damped out of proportion, the last against a stop."""
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    push, row = np.zeros(n), np.zeros(n)
    push[0], row[-1] = 1.0, 1.0
    return vi.Mechanism(
        mass=np.eye(n),
        damping=0.05 * stiffness + 0.02 * np.diag(np.arange(n)),
        stiffness=stiffness,
        forces=(vi.Harmonic(1.0, tuple(push)),),
        elements=(vi.RigidStop(tuple(row), upper=0.3, restitution=0.7),),
    )


def assert_special_points() -> None:
    """The branch of set A has the bifurcations of the references, to 1e-10."""
    branch = vi.continue_orbit(vi.symmetric_orbits(damper())[0], "omega", RANGE)
    points = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))["bifurcation"]
    for point in (one for one in points if one["set"] == "A"):
        near = [p.parameter for p in branch.special_points if p.kind == point["kind"]]
        assert min(abs(x - float(point["omega"])) for x in near) < 1e-10, (point, branch)


def longer(orbit: vi.Orbit, impacts: int) -> vi.Orbit:
    """The same orbit, gone round several times: as many unknowns as an orbit of its length."""
    times = impacts // len(orbit.signature.impacts)
    return vi.find_orbit(
        orbit.system,
        repeated(unfolded(orbit), orbit.signature.cycles, times),
        stops=orbit.signature.impacts * times,
        cycles=orbit.signature.cycles * times,
    )


def seconds(
    run: Callable[[], object], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> float:
    """Median time of a call, by a clock."""
    spent = []
    for _ in range(rounds):
        begin = clock()
        run()
        spent.append(clock() - begin)
    return median(spent)


def row_of(what: str, orbit: vi.Orbit, rounds: int) -> Row:
    """Branch and normal form of one orbit; its determinant identity is asserted first."""
    assert orbit.converged, orbit
    assert orbit.determinant_error < 1e-8, orbit
    omega = orbit.mechanism.omega
    bounds = (omega * (1.0 - NARROW), omega * (1.0 + NARROW))
    steps = vi.Steps(first=0.002, largest=0.02, points=POINTS // 2)
    points = len(vi.continue_orbit(orbit, "omega", bounds, steps=steps))

    def follow(offset: float) -> vi.Branch:  # another start: nothing is remembered from before
        start = vi.find_orbit(_at(orbit, omega * (1.0 + offset)), orbit)
        return vi.continue_orbit(start, "omega", bounds, steps=steps)

    offsets = iter(1e-6 * np.arange(1, rounds + 1))
    spent = seconds(lambda: follow(next(offsets)), rounds)
    forms = vi.full_map(orbit, "omega")
    directions = np.eye(forms.dimension)[:2]

    def normal_form() -> None:  # what a Neimark-Sacker coefficient asks of the map
        forms.jacobian()
        for _ in range(9):
            forms.derivative(directions[0], directions[1])
        for _ in range(4):
            forms.derivative(directions[0], directions[0], directions[1])
        for _ in range(4):
            forms.derivative(directions[0], np.append(np.zeros(forms.dimension), 1.0))

    per_200 = spent / points * POINTS
    milliseconds = 1e3 * seconds(normal_form, 3 * rounds)
    return Row(
        what, orbit.mechanism.degrees, len(orbit.signature.impacts), points, per_200, milliseconds
    )


def _at(orbit: vi.Orbit, omega: float) -> vi.ImpactDamper | vi.Mechanism:
    system = orbit.system
    if isinstance(system, vi.ImpactDamper):
        return replace(system, omega=omega)
    assert isinstance(system, vi.Mechanism)
    line = system.forces[0]
    return replace(system, forces=(vi.Harmonic(omega, line.sine, line.cosine),))


@dataclass(slots=True)
class Through:
    """One line of the second table."""

    what: str
    sequences: int
    points: int
    seconds_per_200: float


def through(what: str, rounds: int) -> Through:
    """Branch of one machine of two coordinates, which follows what exists; it is asserted that simulation returns."""
    element, omega, bounds = THROUGH[what]
    machine = vi.Mechanism(
        mass=np.eye(2), damping=[[0.15, -0.05], [-0.05, 0.1]], stiffness=[[2.0, -1.0], [-1.0, 2.0]],
        forces=(vi.Harmonic(omega, (0.0, 0.0), (1.5, 0.0)),), elements=(element,),
    )  # fmt: skip

    def begin(offset: float) -> vi.Orbit:  # another start: nothing is remembered from before
        here = replace(
            machine, forces=(vi.Harmonic(omega * (1.0 + offset), (0.0, 0.0), (1.5, 0.0)),)
        )
        return vi.find_orbit(here, vi.State((0.0, 0.0), (0.0, 0.0)))

    starts = [begin(offset) for offset in 1e-6 * np.arange(rounds + 1)]
    parts = [branch := vi.continue_orbit(starts[0], "omega", bounds), *branch.others]
    for part in parts:
        orbit = part.orbit(len(part) // 2)
        start = before_stops(orbit.system, orbit.state)
        end = vi.simulate(orbit.system, start, t_max=1.001 * orbit.period).at([orbit.period])
        away = np.abs(end[0][0] - orbit.state.position).max()
        assert away < 1e-6, (what, orbit, away)
    waiting = iter(starts[1:])
    spent = seconds(
        lambda: vi.continue_orbit(next(waiting), "omega", bounds), rounds, time.process_time
    )
    points = sum(map(len, parts))
    return Through(what, len(parts), points, spent / points * POINTS)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Time branches and normal forms."""
    few = slice(1 if options.quick else None)
    assert_special_points()
    symmetric = vi.find_orbit(damper(), vi.symmetric_orbits(damper())[0])
    rows = [row_of("damper, symmetric", symmetric, options.rounds)]
    rows += [row_of("damper", longer(symmetric, m), options.rounds) for m in IMPACTS[few]]
    for n in DEGREES[few]:
        start = vi.State((0.0,) * n, (0.0,) * n)
        rows.append(row_of("chain", vi.find_orbit(chain(n), start), options.rounds))
    heads = f"{'orbit':20} {'degrees':>7} {'impacts':>7} {'points':>7}"
    print(f"{heads} {'s / 200 points':>15} {'normal form ms':>15}")
    for row in rows:
        print(
            f"{row.what:20} {row.degrees:7} {row.impacts:7} {row.points:7} "
            f"{row.branch_seconds_per_200:15.2f} {row.normal_form_milliseconds:15.2f}"
        )
    print(f"\n{'orbits with':22} {'sequences':>9} {'points':>7} {'CPU s / 200 points':>18}")
    names = list(THROUGH)[: 1 if options.quick else None]
    lines = [through(what, options.rounds) for what in names]
    for line in lines:
        print(f"{line.what:22} {line.sequences:9} {line.points:7} {line.seconds_per_200:18.2f}")
    return {"rows": rows, "through": lines}
