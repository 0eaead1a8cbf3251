"""How the cost of an impact grows: with degrees of freedom, contacts, members and threads.

Every point is first asserted (`ensemble_run.assert_right`): impact times of the same structure, a
few members of it, equal those of the scalar engine and of SciPy.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.case import SET_A, random_starts
from benchmarks.ensemble_run import assert_right, nanoseconds
from benchmarks.peers.library import settled
from benchmarks.structures import Ensemble, chain, damper, random_ensemble, two_masses

SETTLING_IMPACTS = 500  # of set A from random starts until its motion is steady
SETTLED = 256  # members in steady motion that are computed; more are copies of these


@dataclass(frozen=True, slots=True)
class Sizes:
    """How large the cases are.

    Attributes
    ----------
    degrees, contacts, members, threads
        Abscissae of the four curves.
    ensemble
        Members where their number is not what varies.
    impacts
        Per member.
    rounds
        Of which the median is taken.
    """

    degrees: Sequence[int] = tuple(range(1, 11))
    contacts: Sequence[int] = tuple(range(1, 9))
    members: Sequence[int] = tuple(10**k for k in range(7))
    threads: Sequence[int] = (1, 2)
    ensemble: int = 4096
    impacts: int = 20
    rounds: int = 3


@dataclass(frozen=True, slots=True)
class Point:
    """One point of one curve: nanoseconds per impact."""

    against: str
    curve: str
    x: int
    nanoseconds: float


CHAIN_OF_CONTACTS = 8  # degrees of freedom of the chain whose contacts are counted
LONGER = 10  # times as many members, and impacts of each, on threads: starting work is not the cost


def degrees(sizes: Sizes, rng: np.random.Generator) -> Iterator[Point]:
    """Chains against two stops at the last mass."""
    for curve, damping in (("vibration modes", "classical"), ("coupled by dashpots", "general")):
        for n in sizes.degrees:
            if n == 1 and damping == "general":  # one mass: its damping is classical
                continue
            system = chain(n, 1, damping=damping)
            ensemble = random_ensemble(system, sizes.ensemble, rng)
            yield measured("degrees of freedom", curve, n, ensemble, sizes)


def contacts(sizes: Sizes, rng: np.random.Generator) -> Iterator[Point]:
    """Chains of eight masses, between stops at the last ones."""
    for curve, damping in (("undamped", "none"), ("damped", "classical")):
        for count in sizes.contacts:
            system = chain(CHAIN_OF_CONTACTS, count, damping=damping)
            ensemble = random_ensemble(system, sizes.ensemble, rng)
            yield measured("contacts", curve, count, ensemble, sizes)


def members(sizes: Sizes, rng: np.random.Generator) -> Iterator[Point]:
    """The impact damper, from random starts and in steady motion."""
    for curve, ensemble in dampers(max(sizes.members), rng).items():
        assert_right(ensemble)
        for count in sizes.members:
            yield timed("members", curve, count, ensemble.first(count), sizes)


def threads(sizes: Sizes, rng: np.random.Generator) -> Iterator[Point]:
    """The impact damper on several threads."""
    longer = replace(sizes, impacts=LONGER * sizes.impacts)
    for curve, ensemble in dampers(LONGER * sizes.ensemble, rng).items():
        assert_right(ensemble)
        for count in sizes.threads:
            yield timed("threads", curve, count, ensemble, longer, threads=count)


def structures(sizes: Sizes, rng: np.random.Generator) -> Iterator[Point]:
    """The damper beside a structure of the same size that has no zeros in its matrices."""
    cases = dampers(sizes.ensemble, rng)
    cases["two masses, random starts"] = random_ensemble(two_masses(), sizes.ensemble, rng)
    for curve, ensemble in cases.items():
        yield measured("structure", curve, 2, ensemble, sizes)


def dampers(count: int, rng: np.random.Generator) -> dict[str, Ensemble]:
    """Make ensembles of set A: from random starts, and in steady motion."""
    starts = random_starts(SET_A, count, rng)
    steady = settled(starts[:SETTLED], SET_A, SETTLING_IMPACTS)
    rows = np.resize(np.arange(len(steady)), count)
    return {
        "damper, random starts": damper(SET_A, starts),
        "damper, steady motion": damper(SET_A, steady[rows]),
    }


def measured(against: str, curve: str, x: int, ensemble: Ensemble, sizes: Sizes) -> Point:
    """Assert the impacts, then time them."""
    assert_right(ensemble)
    return timed(against, curve, x, ensemble, sizes)


def timed(
    against: str, curve: str, x: int, ensemble: Ensemble, sizes: Sizes, threads: int = 1
) -> Point:
    """Time an ensemble whose impacts were asserted."""
    return Point(against, curve, x, nanoseconds(ensemble, sizes.impacts, sizes.rounds, threads))


def table(points: Sequence[Point]) -> str:
    """Format the points: one line per curve."""
    lines = []
    for against in dict.fromkeys(p.against for p in points):
        mine = [p for p in points if p.against == against]
        for curve in dict.fromkeys(p.curve for p in mine):
            found = [f"{p.x}: {p.nanoseconds:.3g}" for p in mine if p.curve == curve]
            lines.append(f"ns per impact against {against}, {curve}: {', '.join(found)}")
    return "\n".join(lines)
