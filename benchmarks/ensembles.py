"""Ensembles beside other programs, and how their cost grows.

Answers are asserted before anything is timed: equal impacts (equality.py, ensemble_run.py), equal
planes (overhead.py).
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks import comparison, double_roots, machine, overhead, scaling
from benchmarks.case import SET_A, Floats, random_starts
from benchmarks.peers import (
    compiled,
    diffrax_dopri8,
    ensemble,
    heyoka_batch,
    heyoka_taylor,
    library,
    numba_sampled,
    scipy_dop853,
)
from benchmarks.peers.method import Method
from benchmarks.scaling_plot import draw

FEW = 256  # of the starts, for methods that take them one after another
BASELINE: Method = replace(compiled.SAMPLED, max_starts=FEW)
REFERENCE: Method = replace(compiled.CERTIFIED, max_starts=FEW)
METHODS: tuple[Method, ...] = (
    ensemble.RunMembers(),
    replace(library.Engine(), max_starts=FEW),
    REFERENCE,
    BASELINE,
    replace(numba_sampled.Numba(), max_starts=FEW),
    heyoka_taylor.Heyoka(),
    heyoka_batch.HeyokaBatch(),
    diffrax_dopri8.Diffrax(),
    scipy_dop853.SciPy(),
)
OBSERVED = (("symbol",), ("symbol", "lyapunov"))


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is run.

    Attributes
    ----------
    starts, impacts
        Of the comparison: members, and impacts of each.
    compared
        Members whose first impacts are compared.
    settling
        Impacts before motion counts as steady.
    double_roots
        Constructed flights.
    rounds
        Interleaved; the median counts.
    side
        Points along each side of the plane.
    sizes
        Of the scaling curves.
    """

    starts: int = 4096
    impacts: int = 200
    compared: int = 200
    settling: int = scaling.SETTLING_IMPACTS
    double_roots: int = 320
    rounds: int = 5
    side: int = 300
    sizes: scaling.Sizes = field(default_factory=scaling.Sizes)


QUICK = Effort(
    starts=32,
    impacts=10,
    compared=8,
    settling=50,
    double_roots=10,
    rounds=1,
    side=3,
    sizes=scaling.Sizes(
        degrees=(1, 2),
        contacts=(1, 2),
        members=(1, 10),
        threads=(1, 2),
        ensemble=16,
        impacts=5,
        rounds=1,
    ),
)


# ---- the parts: each prints, and returns what goes into the file ---------------------------------


@machine.one_core()
def peers(effort: Effort, rng: np.random.Generator) -> dict[str, Any]:
    """Every method on the same starts."""
    starts = random_starts(SET_A, effort.starts, rng)
    steady = library.settled(starts, SET_A, effort.settling)
    flights = double_roots.construct(SET_A, effort.double_roots, rng)
    found: dict[str, Any] = {}
    for motion, rows, some in (("random starts", starts, flights), ("steady motion", steady, None)):
        print(f"\n{motion}, {effort.impacts} impacts each")
        found[motion] = _compared(effort, rows, some)
    return found


def _compared(
    effort: Effort, starts: Floats, flights: list[double_roots.DoubleRoot] | None
) -> list[comparison.Row]:
    rows = comparison.check(METHODS, REFERENCE, starts[: effort.compared], flights)
    comparison.measure(rows, BASELINE, starts, effort.impacts, effort.rounds)
    print(comparison.table(list(rows.values()), effort.double_roots))
    return list(rows.values())


def curves(effort: Effort, rng: np.random.Generator) -> dict[str, Any]:
    """How cost grows."""
    points = []
    with machine.one_core():
        for part in (scaling.degrees, scaling.contacts, scaling.members, scaling.structures):
            points += _shown(part(effort.sizes, rng))
    return {"points": points + _shown(scaling.threads(effort.sizes, rng))}


def _shown(points: Iterable[scaling.Point]) -> list[scaling.Point]:
    """Measure points, then print them."""
    found = list(points)
    print("\n" + scaling.table(found))
    return found


@machine.one_core()
def planes(effort: Effort, _rng: np.random.Generator) -> dict[str, Any]:
    """What the Python layer adds."""
    rows = [overhead.measure(effort.side, names, effort.rounds) for names in OBSERVED]
    print("\n" + overhead.table(rows))
    return {"planes": rows}


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Compare with other programs, and measure how cost grows and what the Python layer adds."""
    effort = QUICK if options.quick else Effort()
    content: dict[str, Any] = {"effort": effort}
    for part in (peers, curves, planes):
        content |= part(effort, np.random.default_rng(options.seed))
    if options.plot:
        draw(content["points"], options.plot)
    return content
