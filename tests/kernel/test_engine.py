"""The one engine on every scalar, by two compilers: lanes, jets, counts of operations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.engine_program import GOLDEN, SETS, check_lanes, run, starts_of, system_of

from vibroimpact.compile import hybrid
from vibroimpact.simulation.simulate import begin

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

RUNS = [(build, name) for build in ("gcc", "clang") for name in SETS]


@pytest.fixture(scope="session")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiled programs and system files of this session."""
    return tmp_path_factory.mktemp("engine")


@pytest.mark.slow
@pytest.mark.parametrize(("build", "name"), RUNS)
def test_runs_have_the_golden_hash_with_every_compiler(
    workplace: Path, build: str, name: str
) -> None:
    assert run(workplace, build, name, "hash", 400) == GOLDEN[name]


def fnv(values: Iterable[float]) -> int:
    """FNV-1a over the bytes of doubles, as engine_test computes it."""
    state = 14695981039346656037
    for byte in np.fromiter(values, float).tobytes():
        state = ((state ^ byte) * 1099511628211) & 0xFFFFFFFFFFFFFFFF
    return state


@pytest.mark.parametrize("name", GOLDEN)
def test_the_installed_package_gives_the_same_hash(name: str) -> None:
    compiled, values = hybrid.compile_mechanism(system_of(name)), []
    for state in starts_of(name, 16):
        r = compiled.kernel.simulate(begin(compiled, state), 1e300, 1e6, 400, 10**9)
        for i in range(400):
            values += [r[key][i] for key in ("status", "side", "high", "low", "rate_after")]
            values += list(r["y"][i])
    assert f"{fnv(values):016x}" == GOLDEN[name]


@pytest.mark.slow
@pytest.mark.parametrize(("build", "name"), RUNS)
def test_each_lane_of_a_pack_has_the_bits_of_the_scalar_engine(
    workplace: Path, build: str, name: str
) -> None:
    check_lanes(run(workplace, build, name, "lanes", 400), build, name)


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_jets_through_the_engine_equal_the_product_of_saltation_matrices(
    workplace: Path, name: str
) -> None:
    # 12 impacts: each product of matrices adds some ulp, amplified by conditioning below 1e4
    assert float.fromhex(run(workplace, "gcc", name, "jet", 12)) < 1e-10


@pytest.mark.slow
def test_an_impact_costs_some_hundred_operations(workplace: Path) -> None:
    # at least 250: five times ahead, a root and a jump of a system with six coordinates
    assert 250.0 < float(run(workplace, "gcc", "A", "count", 200)) < 700.0


@pytest.mark.slow
def test_a_flight_that_repeats_costs_less_than_half(workplace: Path) -> None:
    def operations(impacts: int) -> float:
        return float(run(workplace, "gcc", "A, steady", "count", impacts)) * impacts

    late, early = operations(400) - operations(300), operations(100)
    assert late < early / 2
