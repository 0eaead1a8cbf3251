"""Methods beside each other: equal impacts first, then double roots, then time.

Each round times every method once, so that a change of the machine's speed meets all of them; the
median of the rounds counts. Slow methods run fewer of the same starts (`Method.max_starts`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from benchmarks import double_roots, equality
from benchmarks.case import SET_A, Floats
from benchmarks.peers.method import Method, UnavailableError


@dataclass(slots=True)
class Row:
    """One line of the table."""

    method: str
    settings: str
    largest_error: float
    double_roots_found: int | None
    nanoseconds_per_impact: float = 0.0
    faster_than_baseline: float = 0.0


def check(
    methods: Sequence[Method],
    reference: Method,
    starts: Floats,
    flights: list[double_roots.DoubleRoot] | None,
) -> dict[Method, Row]:
    """Assert equal impacts, count double roots if there are any; leave out what cannot run here.

    A method that is known to miss impacts is reported where it does, and timed all the same.
    """
    expected = equality.reference(reference, starts, SET_A)
    print(f"compared impacts: {expected.comparable.mean():.0%} of the first {equality.IMPACTS}")
    rows = {}
    for method in methods:
        try:
            error = equality.assert_equal(method, SET_A, expected)
        except UnavailableError as missing:
            print(f"left out: {method.name}: {missing}")
            continue
        except equality.ImpactsDifferError as differs:
            if not getattr(method, "misses_impacts", False):
                raise
            print(f"differs: {differs}")
            error = math.nan
        found = double_roots.count_found(method, SET_A, flights) if flights else None
        rows[method] = Row(method.name, method.settings, error, found)
    return rows


def nanoseconds(method: Method, starts: Floats, impacts: int) -> float:
    """Time one run; return nanoseconds per impact found."""
    result = method.run(starts[: method.max_starts], SET_A, impacts)
    return 1e9 * result.seconds / np.count_nonzero(np.isfinite(result.times))


def measure(
    rows: dict[Method, Row], baseline: Method, starts: Floats, impacts: int, rounds: int
) -> None:
    """Fill in the speeds."""
    spent: dict[Method, list[float]] = {method: [] for method in rows}
    for _ in range(rounds):
        for method in rows:
            spent[method].append(nanoseconds(method, starts, impacts))
    for method, row in rows.items():
        row.nanoseconds_per_impact = median(spent[method])
        row.faster_than_baseline = median(spent[baseline]) / row.nanoseconds_per_impact


def digits(nanoseconds: float) -> str:
    """Format a time: whole nanoseconds, or three digits."""
    return f"{nanoseconds:.0f}" if nanoseconds >= 100 else f"{nanoseconds:.3g}"


def table(rows: Sequence[Row], flights: int) -> str:
    """Format the table; `flights` is the number of double roots."""
    lines = [
        f"{'method':42} {'ns/impact':>10} {'x baseline':>10} {'double roots':>13} {'error':>8}"
    ]
    for row in rows:
        found = "" if row.double_roots_found is None else f"{row.double_roots_found}/{flights}"
        lines.append(
            f"{row.method:42} {digits(row.nanoseconds_per_impact):>10} "
            f"{row.faster_than_baseline:10.3g} {found:>13} {row.largest_error:8.0e}"
        )
    return "\n".join(lines)
