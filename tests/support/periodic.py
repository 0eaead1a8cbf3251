"""Periodic orbits of the references, and of random mechanisms."""

from __future__ import annotations

import math
import tomllib
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import vibroimpact as vi
from vibroimpact.model.stop import Stop
from vibroimpact.orbits.search import find_orbits

from .systems import oscillator, paper_damper, random_symmetric

if TYPE_CHECKING:
    from vibroimpact.orbits.orbit import Orbit

REFERENCE = Path(__file__).parent.parent / "reference"
PAPER_RANGES = {"A": (0.6, 1.4), "B": (0.6, 1.3), "C": (0.3, 1.0)}  # of omega
SIDES = {"upper": 1, "lower": -1}


def table(name: str) -> dict[str, Any]:
    """A file of references."""
    return tomllib.loads((REFERENCE / name).read_text(encoding="utf-8"))


def numbers(values: Any) -> Any:
    """Strings as doubles, in lists of any depth."""
    return [numbers(v) for v in values] if isinstance(values, list) else float(values)


def mechanism_of_entry(entry: dict[str, Any]) -> vi.Mechanism:
    """The mechanism of a reference."""
    line = vi.Harmonic(float(entry["omega"]), numbers(entry["sine"]), numbers(entry["cosine"]))
    contacts = tuple(
        vi.RigidStop(
            tuple(numbers(c["row"])), float(c.get("lower", -math.inf)),
            float(c.get("upper", math.inf)), float(c["restitution"]),
        )
        for c in entry["contacts"]
    )  # fmt: skip
    matrices = {name: numbers(entry[name]) for name in ("mass", "damping", "stiffness")}
    return vi.Mechanism(**matrices, forces=(line,), elements=contacts)


def impacts_of(signature: list[list[Any]]) -> list[Stop]:
    """[[0, "upper"], ..] as (contact, side)."""
    return [Stop(int(contact), SIDES[side]) for contact, side in signature]


def guess_of_entry(entry: dict[str, Any]) -> vi.Guess:
    """States after the impacts and the flight that each begins, the first impact of all first."""
    durations = np.roll(np.array(numbers(entry["times"])), -1)
    passed = np.concatenate([[0.0], np.cumsum(durations[:-1])])
    phases = float(entry["phases"][0]) + float(entry["omega"]) * passed
    return vi.Guess(np.column_stack([numbers(entry["after"]), phases]), durations)


def chain(n: int, seed: int) -> vi.Mechanism:
    """Masses in a row, damped out of proportion, each third of them against a stop."""
    rng = np.random.default_rng([n, seed])
    springs = rng.uniform(0.5, 1.5, n + 1)
    stiffness = np.diag(springs[:-1] + springs[1:])
    stiffness -= np.diag(springs[1:-1], 1) + np.diag(springs[1:-1], -1)
    rows = np.eye(n)[::3]
    stops = tuple(
        vi.RigidStop(tuple(row), upper=rng.uniform(0.1, 0.4), restitution=rng.uniform(0.4, 0.8))
        for row in rows
    )
    return vi.Mechanism(
        mass=np.eye(n) + 0.3 * random_symmetric(rng, n, n),
        damping=0.1 * np.eye(n) + 0.2 * random_symmetric(rng, n, n),
        stiffness=stiffness,
        forces=(vi.Harmonic(rng.uniform(0.8, 1.6), tuple(rng.normal(size=n))),),
        elements=stops,
    )


@cache
def orbits_of_chains() -> list[Orbit]:
    """Orbits with impacts, up to six degrees of freedom and two contacts, stable, unstable, inadmissible."""
    searches = [
        find_orbits(chain(n, seed), most_cycles=1, most_impacts=4, starts=3)
        for n in range(1, 7)
        for seed in range(2)
    ]
    every = [orbit for search in searches for orbit in search.orbits]
    return [orbit for orbit in every if not orbit.signature.eventless]


@cache
def damper_orbits() -> list[Orbit]:
    """Symmetric orbits of the paper's sets, admissible or not."""
    return [
        vi.find_orbit(closed.system, closed)
        for name, (low, high) in PAPER_RANGES.items()
        for omega in np.linspace(low, high, 21)
        for closed in vi.symmetric_orbits(paper_damper(name, omega))
    ]


def coco(amplitude: float = 1.0, omega: float = 1.0) -> vi.Mechanism:
    """x'' + 0.1 x' + x = A cos(omega t) before a wall at 1, restitution 0.8."""
    force = vi.Harmonic(omega, (0.0,), (amplitude,))
    return oscillator(stiffness=1.0, damping=0.1, forces=(force,), lower=-math.inf, upper=1.0,
                      restitution=0.8)  # fmt: skip


def largest(values: NDArray[Any]) -> float:
    """The largest modulus."""
    return float(np.abs(values).max())
