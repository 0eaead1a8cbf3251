"""One trajectory at a time, by all methods, which must agree."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks import comparison, double_roots
from benchmarks.case import SET_A, random_starts
from benchmarks.peers import compiled, heyoka_taylor, library, numba_sampled, scipy_dop853
from benchmarks.peers.method import Method

BASELINE: Method = compiled.SAMPLED
REFERENCE: Method = compiled.CERTIFIED
METHODS: tuple[Method, ...] = (
    library.Engine(),
    library.Simulate(),
    REFERENCE,
    BASELINE,
    numba_sampled.Numba(),
    heyoka_taylor.Heyoka(),
    scipy_dop853.SciPy(),
)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Compare and time one trajectory at a time."""
    count, impacts, constructed = (8, 20, 8) if options.quick else (500, 200, 320)
    rng = np.random.default_rng(options.seed)
    starts = random_starts(SET_A, count, rng)
    flights = double_roots.construct(SET_A, constructed, rng)
    rows = comparison.check(METHODS, REFERENCE, starts, flights)
    comparison.measure(rows, BASELINE, starts, impacts, options.rounds)
    print(comparison.table(list(rows.values()), len(flights)))
    print("\n".join(f"  {row.method}: {row.settings}" for row in rows.values()))
    return {"parameters": SET_A, "starts": count, "impacts": impacts, "rows": list(rows.values())}
