"""Lyapunov exponents do not depend on the units of length, time and mass, to the last bit."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support.random_machines import KINDS, random_machine, random_start, scaled

import vibroimpact as vi

QUICK, MANY = 2, 8  # machines of each kind
SLOW = pytest.mark.slow
COUNTS = [pytest.param(0, QUICK, id="quick"), pytest.param(QUICK, MANY, id="many", marks=SLOW)]
KIND = pytest.mark.parametrize("kind", KINDS)
COUNTED = pytest.mark.parametrize(("first", "last"), COUNTS)
Found = list[tuple[str, Any]]


def of_sweeps(m: vi.Mechanism, start: vi.State) -> Found:
    names = ["lyapunov"] if m.massless else ["lyapunov", "spectrum"]
    found = vi.sweep(m, over={}, start=vi.GridStarts({"phase": [start.phase]}, start), observe=names,
                     settle_periods=20, periods=20, progress=False)  # fmt: skip
    return [(name, found[name].values) for name in names]


def of_motions(m: vi.Mechanism, start: vi.State) -> Found:
    one = vi.lyapunov_exponent(m, start, impacts=1024, settle_impacts=50)
    several = vi.lyapunov_spectrum(m, start, impacts=1024, settle_impacts=50)
    return [
        ("exponent", [one.value, one.error]),
        ("exponents", several.values), ("errors", several.errors),
        ("contraction", several.contraction),
    ]  # fmt: skip


def compare(kind: str, first: int, last: int, exponents: Callable[..., Found]) -> None:
    """The same numbers in any unit, and some that are finite."""
    wrong, finite = [], 0
    for seed in range(first, last):
        rng = np.random.default_rng([zlib.crc32(kind.encode()), seed])
        m = random_machine(rng, KINDS[kind])
        start = random_start(rng, m)
        units = [2.0 ** int(rng.integers(-k, k + 1)) for k in (40, 31, 40)]
        if alone := seed % 4:  # one unit alone tells which
            units = [u if k == alone - 1 else 1.0 for k, u in enumerate(units)]
        own, there = exponents(m, start), exponents(scaled(m, *units), scaled(start, *units))
        for (name, one), (_, other) in zip(own, there, strict=True):
            finite += int(np.isfinite(one).sum())
            if not np.array_equal(one, np.multiply(other, units[1]), equal_nan=True):
                bits = [f"2^{math.log2(u):.0f}" for u in units]
                wrong.append(f"seed {seed}, {bits}: {name} {one}, not {other}")
    assert not wrong, f"{len(wrong)} of {last - first}:\n" + "\n".join(wrong)
    assert finite >= (last - first) // 8  # bodies at rest have none


@KIND
@COUNTED
@pytest.mark.one_in(3)
def test_exponents_of_sweeps_have_the_same_bits_in_units_of_powers_of_two(
    kind: str, first: int, last: int
) -> None:
    compare(kind, first, last, of_sweeps)


@pytest.mark.slow
@KIND
def test_estimated_exponents_have_the_same_bits_in_units_of_powers_of_two(kind: str) -> None:
    compare(kind, 0, 2, of_motions)


@pytest.mark.parametrize("units", [(2.0**-20, 2.0**-30, 2.0**-40), (2.0**9, 2.0**5, 2.0**21)])
def test_exponents_of_lanes_have_the_same_bits_in_units_of_powers_of_two(
    units: tuple[float, float, float],
) -> None:
    """The largest exponent is found for several members at once: chaos, chatter, and periodic motion."""
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    ).mechanism
    start, time = vi.State((0.0, 0.0), (0.0, 1.0)), units[1]

    def found(m: vi.Mechanism, s: vi.State, unit: float) -> Any:
        over = {"omega": np.linspace(0.4, 1.3, 40) / unit}
        swept = vi.sweep(m, over=over, start=s, observe=["lyapunov"], settle_periods=50, periods=40,
                         progress=False)  # fmt: skip
        return swept.lyapunov.values * unit

    one, other = (
        found(damper, start, 1.0),
        found(scaled(damper, *units), scaled(start, *units), time),
    )
    assert (one > 0.01).any()
    assert (one < -0.01).any()
    np.testing.assert_array_equal(one, other)
