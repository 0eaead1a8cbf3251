"""``python -m benchmarks``: check that all methods agree, time them, print one table."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks import double_roots, equality, machine
from benchmarks.case import SET_A, Floats, random_starts
from benchmarks.peers import compiled, heyoka_taylor, library, numba_sampled, scipy_dop853
from benchmarks.peers.method import Method, UnavailableError

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


@dataclass(slots=True)
class Row:
    """One line of the table."""

    method: str
    settings: str
    largest_error: float
    double_roots_found: int
    nanoseconds_per_impact: float = 0.0
    faster_than_baseline: float = 0.0


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


def check(starts: Floats, flights: list[double_roots.DoubleRoot]) -> dict[Method, Row]:
    """Assert equal impacts and count double roots; leave out methods that cannot run here."""
    expected = equality.reference(REFERENCE, starts, SET_A)
    print(f"compared impacts: {expected.comparable.mean():.0%} of the first {equality.IMPACTS}")
    rows = {}
    for method in METHODS:
        try:
            error = equality.assert_equal(method, SET_A, expected)
        except UnavailableError as missing:
            print(f"left out: {method.name}: {missing}")
            continue
        found = double_roots.count_found(method, SET_A, flights)
        rows[method] = Row(method.name, method.settings, error, found)
    return rows


def nanoseconds(method: Method, starts: Floats, impacts: int) -> float:
    """Time one run; return nanoseconds per impact found."""
    result = method.run(starts[: method.max_starts], SET_A, impacts)
    return 1e9 * result.seconds / np.count_nonzero(np.isfinite(result.times))


def measure(rows: dict[Method, Row], starts: Floats, impacts: int, rounds: int) -> None:
    """Fill in the speeds: every round times every method once."""
    spent: dict[Method, list[float]] = {method: [] for method in rows}
    for _ in range(rounds):
        for method in rows:
            spent[method].append(nanoseconds(method, starts, impacts))
    for method, row in rows.items():
        row.nanoseconds_per_impact = median(spent[method])
        row.faster_than_baseline = median(spent[BASELINE]) / row.nanoseconds_per_impact


def table(rows: list[Row], flights: int) -> str:
    """Format the table."""
    lines = [
        f"{'method':42} {'ns/impact':>10} {'x baseline':>10} {'double roots':>13} {'error':>8}"
    ]
    lines += [
        f"{row.method:42} {row.nanoseconds_per_impact:10.0f} {row.faster_than_baseline:10.3g} "
        f"{row.double_roots_found:>7}/{flights:<5} {row.largest_error:8.0e}"
        for row in rows
    ]
    return "\n".join(lines)


def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    options = parse(argv)
    rng = np.random.default_rng(options.seed)
    starts = random_starts(SET_A, options.starts, rng)
    flights = double_roots.construct(SET_A, options.double_roots, rng)
    rows = check(starts, flights)
    measure(rows, starts, options.impacts, options.rounds)
    about = machine.describe()
    print("\n".join(f"{key}: {value}" for key, value in about.items()))
    print(table(list(rows.values()), len(flights)))
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
