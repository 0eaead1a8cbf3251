"""``python -m benchmarks``: check that all methods agree, time them, print one table."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from benchmarks import comparison, double_roots, machine
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


def parse(argv: list[str] | None) -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--starts", type=int, default=500, help="random starts")
    parser.add_argument("--impacts", type=int, default=200, help="impacts per start")
    parser.add_argument("--rounds", type=int, default=5, help="interleaved rounds; median printed")
    parser.add_argument("--double-roots", type=int, default=320, help="constructed flights")
    parser.add_argument("--seed", type=int, default=20, help="seed of starts and flights")
    parser.add_argument("--json", type=Path, help="also write the table to this file")
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    options = parse(argv)
    rng = np.random.default_rng(options.seed)
    starts = random_starts(SET_A, options.starts, rng)
    flights = double_roots.construct(SET_A, options.double_roots, rng)
    rows = comparison.check(METHODS, REFERENCE, starts, flights)
    comparison.measure(rows, BASELINE, starts, options.impacts, options.rounds)
    about = machine.show()
    print(comparison.table(list(rows.values()), len(flights)))
    print("\n".join(f"  {row.method}: {row.settings}" for row in rows.values()))
    if options.json:
        content = {
            "machine": about,
            "parameters": asdict(SET_A),
            "options": {key: value for key, value in vars(options).items() if key != "json"},
            "rows": [asdict(row) for row in rows.values()],
        }
        options.json.write_text(json.dumps(content, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
