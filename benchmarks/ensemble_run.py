"""Ensembles of the library run by their impacts: how long, and whether each impact is right.

A member ends at an exact number of impacts (its outcome is MAX_IMPACTS), so the time that it reached is the
time of that impact.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

import vibroimpact as vi
from benchmarks import witness
from benchmarks.case import Floats
from benchmarks.equality import ImpactsDifferError
from benchmarks.structures import Ensemble
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.observer import Observer

Arrays = dict[str, Any]

WINDOW = 1e9  # units of time: no member reaches it
COMPARED_IMPACTS, COMPARED_MEMBERS = 5, 64
WITNESS_TOLERANCE = 1e-6  # of SciPy's impact times, as in peers/scipy_dop853.py
SHORTEST = 0.1  # seconds: shorter runs are repeated, until a cold start hardly counts
CHUNKS = 8  # pieces of work for each thread, so that none waits long for the last


class Prepared:
    """An ensemble compiled and ready to run: nothing of this is timed."""

    def __init__(self, ensemble: Ensemble, impacts: int) -> None:
        count = len(ensemble)
        self.ensemble, self.impacts = ensemble, impacts
        self.batch = batch_of(ensemble.system, {})
        self.members = Members(
            system=np.zeros(count, dtype=np.int32),
            position=ensemble.position,
            velocity=ensemble.velocity,
            phase=ensemble.phase,
            settle=np.zeros(count),
            observe=np.full(count, WINDOW),
            most_impacts=impacts,
        )

    def run(self, observers: tuple[Observer, ...] = (), impacts: int | None = None) -> Arrays:
        """Run all members in one call; to another number of impacts, if one is given."""
        members = replace(self.members, most_impacts=impacts or self.impacts)
        return run_members(self.batch, members, observers)

    def run_on(self, pool: ThreadPoolExecutor, pieces: Sequence[Members]) -> Arrays:
        """Run pieces of the ensemble on threads; the results are those of one call."""
        parts = list(pool.map(lambda piece: run_members(self.batch, piece, ()), pieces))
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def pieces(self, count: int) -> list[Members]:
        """Return the members in so many pieces."""
        rows = np.array_split(np.arange(len(self.ensemble)), count)
        return [self.members.of(some, self.members.system[some]) for some in rows]

    def seconds(self, threads: int = 1) -> float:
        """Time a run; short ones are repeated."""
        if threads == 1:
            return seconds_of(self.run)
        with ThreadPoolExecutor(threads) as pool:
            pieces = self.pieces(CHUNKS * threads)
            assert_same(self.run(), self.run_on(pool, pieces))
            return seconds_of(lambda: self.run_on(pool, pieces))


def seconds_of(run: Callable[[], Arrays]) -> float:
    """Time of one run, from as many as last `SHORTEST`; their counts of impacts are asserted."""
    runs, begin = 0, time.perf_counter()
    while True:
        out = run()
        runs, spent = runs + 1, time.perf_counter() - begin
        if spent >= SHORTEST:
            assert_all_had_their_impacts(out)
            return spent / runs


def assert_same(one: Arrays, other: Arrays) -> None:
    """Raise unless two runs reached the same times, bit by bit."""
    if not np.array_equal(one["time"], other["time"]):
        raise ImpactsDifferError("the threads' impact times are not those of one call")


def assert_all_had_their_impacts(out: Arrays) -> None:
    """Raise unless every member ended at its last impact: then the count of impacts is exact."""
    others = np.unique(out["end"][out["end"] != MemberStatus.MAX_IMPACTS])
    if others.size:
        raise ImpactsDifferError(f"members ended as {[MemberStatus(int(x)).name for x in others]}")


def nanoseconds(ensemble: Ensemble, impacts: int, rounds: int, threads: int = 1) -> float:
    """Return the time per impact: the median of some rounds."""
    prepared = Prepared(ensemble, impacts)
    spent = [prepared.seconds(threads) for _ in range(rounds)]
    return 1e9 * median(spent) / (impacts * len(ensemble))


def impact_times(prepared: Prepared) -> Floats:
    """Return the times of the impacts of every member, shape (N, impacts): where so many end it."""
    counts = range(1, prepared.impacts + 1)
    return np.column_stack([prepared.run((), k)["time"] for k in counts])


def assert_right(ensemble: Ensemble) -> None:
    """Compare some members' first impacts: with the scalar engine bit by bit, and with SciPy.

    Raises
    ------
    ImpactsDifferError
        One of them differs; for the first member, from SciPy by more than `WITNESS_TOLERANCE`.
    """
    some = ensemble.first(COMPARED_MEMBERS)
    times = impact_times(Prepared(some, COMPARED_IMPACTS))
    if not np.array_equal(times, _scalar_times(some)):
        raise ImpactsDifferError(f"{some.system!r}: impact times are not those of `simulate`")
    start = some.position[0], some.velocity[0], float(some.phase[0])
    mechanism = getattr(some.system, "mechanism", some.system)
    expected = witness.impact_times(mechanism, start, COMPARED_IMPACTS)
    if expected.shape != times[0].shape or np.any(abs(times[0] - expected) > WITNESS_TOLERANCE):
        raise ImpactsDifferError(f"{some.system!r}: impacts at {times[0]}, SciPy has {expected}")


def _scalar_times(ensemble: Ensemble) -> Floats:
    rows = []
    for x, v, phase in zip(ensemble.position, ensemble.velocity, ensemble.phase, strict=True):
        state = vi.State(tuple(x), tuple(v), float(phase))
        run = vi.simulate(ensemble.system, state, impacts=COMPARED_IMPACTS)
        rows.append(run.time[run.impacts])
    return np.array(rows)
