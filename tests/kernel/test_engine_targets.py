"""The one engine on every instruction set, and for coupled masses on another machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from support.builds import BUILDS
from support.engine_program import COUPLED, GOLDEN, SETS, check_lanes, run

from vibroimpact import _kernel

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.slow

# The package stands for its own target: it has the hashes (test_engine.py), and clang's lanes are as wide.
OTHERS = [
    build
    for build in ("gcc, avx2", "gcc, avx512", "gcc, neon")
    if build == "gcc, neon" or BUILDS[build].target != _kernel.target
]
# Coupled masses in one of them: the package, which has their hash, too, is native.
RUNS = [*((build, name) for build in OTHERS for name in SETS), ("gcc, neon", COUPLED)]


@pytest.fixture(scope="session")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiled programs and system files of this session."""
    return tmp_path_factory.mktemp("engine")


@pytest.mark.parametrize(("build", "name"), RUNS)
def test_runs_have_the_golden_hash_on_every_target(workplace: Path, build: str, name: str) -> None:
    assert run(workplace, build, name, "hash", 400) == GOLDEN[name]


@pytest.mark.parametrize(("build", "name"), RUNS)
def test_each_lane_of_a_pack_has_the_bits_of_the_scalar_engine(
    workplace: Path, build: str, name: str
) -> None:
    check_lanes(run(workplace, build, name, "lanes", 400), build, name)


def test_jets_of_coupled_masses_equal_the_product_of_saltation_matrices(workplace: Path) -> None:
    assert float.fromhex(run(workplace, "gcc, neon", COUPLED, "jet", 12)) < 1e-10


def test_an_impact_of_coupled_masses_costs_some_hundred_operations(workplace: Path) -> None:
    assert 250.0 < float(run(workplace, "gcc, neon", COUPLED, "count", 200)) < 900.0
