"""The one engine on every scalar and target: lanes, jets, counts, NVRTC, WebAssembly."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.builds import BUILDS, FLAGS, INCLUDE, ZIG, output
from support.system_file import system_text

import vibroimpact as vi
from vibroimpact import _cpu
from vibroimpact.compile import hybrid
from vibroimpact.simulation.simulate import begin

if TYPE_CHECKING:
    from collections.abc import Iterable

WASM_FLAGS = [
    *("-target", "wasm32-freestanding", "-mcpu=generic+simd128", "-O2", "-fno-exceptions"),
    *("-fno-rtti", "-nostdlib", "-Wl,--no-entry", "-Wl,--export=one_event"),
]
SEED = 20211121
SETS = {  # parameter sets of the founding paper: chaotic, with chatter and sticking
    "A": ({"mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, "restitution": 0.8}, 5.0, 0.970453),
    "B": ({"mass_ratio": 0.04, "omega_n": 0.6, "zeta": 0.025, "restitution": 0.7}, 8.0, 0.9386),
    "C": ({"mass_ratio": 0.05092, "omega_n": 1.0, "zeta": 0.015, "restitution": 0.7}, 6.0, 0.4205),
    # soon steady: flights are repeated
    "A, steady": ({"mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, "restitution": 0.8}, 5.0, 1.2),
}


COUPLED = "coupled"  # as large as the damper


def system_of(name: str) -> vi.Mechanism:
    """One of the sets at one of its frequencies, or two masses that dashpots couple."""
    if name == COUPLED:
        return vi.Mechanism(
            mass=[[1.0, 0.0], [0.0, 0.6]],
            damping=[[0.12, -0.02], [-0.02, 0.03]],
            stiffness=[[2.0, -0.8], [-0.8, 1.2]],
            forces=(vi.Harmonic(0.8, (1.0, 0.3)),),
            contacts=(vi.Contact((0.0, 1.0), -0.5, 0.5, 0.7),),
        )
    rest, half_clearance, omega = SETS[name]
    return vi.ImpactDamper(**rest, half_clearance=half_clearance, omega=omega).mechanism


def starts_of(name: str, count: int) -> list[vi.State]:
    """Seeded starts: on stop A, leaving it, or about the middle."""
    rng = np.random.default_rng(SEED)
    if name == COUPLED:
        return [
            vi.State(tuple(x), tuple(v), phase)
            for x, v, phase in zip(
                rng.normal(0.0, 0.05, (count, 2)),
                rng.normal(0.0, 1.0, (count, 2)),
                rng.uniform(0.0, 6.28, count),
                strict=True,
            )
        ]
    rest, half_clearance, omega = SETS[name]
    damper = vi.ImpactDamper(**rest, half_clearance=half_clearance, omega=omega)
    return [
        damper.on_stop("A", x1=x1, v1=v1, v2=v1 - leave, phase=phase)
        for x1, v1, leave, phase in zip(
            rng.normal(0.0, 1.0, count),
            rng.normal(0.0, 1.0, count),
            rng.exponential(2.0, count),
            rng.uniform(0.0, 6.28, count),
            strict=True,
        )
    ]


@pytest.fixture(scope="session")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiled programs and system files of this session."""
    return tmp_path_factory.mktemp("engine")


def run(folder: Path, build: str, name: str, what: str, events: int, starts: int = 16) -> str:
    """What engine_test says about one set."""
    file = folder / f"{name}-{starts}.txt"
    if not file.exists():
        file.write_text(system_text(system_of(name), starts_of(name, starts)))
    program = "engine_test_mixed" if name == COUPLED else "engine_test"
    return output(folder, program, build, str(file), what, str(events))


# FNV-1a of 16 starts of 400 events each: a change means other bits, to be announced as breaking.
GOLDEN = {"A": "ad87c2e2b96b57b5", "B": "672478712d2b4d39", "C": "fa94d54b65692dc1",
          "A, steady": "9e2f6a43a7bccd69", COUPLED: "db9e50e9708a319d"}  # fmt: skip
# Every build for the damper; for coupled masses one of another machine: the package is native.
RUNS = [*((build, name) for build in BUILDS for name in SETS), ("gcc, neon", COUPLED)]
LANES = {"avx512": "8", "avx2": "4", "baseline": "2"}  # that a register has


def lanes_of(build: str) -> list[str]:
    """What packs it compiles: of every width in one build, as wide as registers in the others."""
    if build == "gcc":
        return ["2", "4", "8"]
    return [LANES[_cpu.supported()[0] if build == "clang" else BUILDS[build].target]]


def usual(name: str) -> str:
    """A build that is there for other tests."""
    return "gcc, neon" if name == COUPLED else "gcc"


@pytest.mark.parametrize(("build", "name"), RUNS)
def test_runs_have_the_golden_hash_with_every_compiler_and_target(
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


@pytest.mark.parametrize(("build", "name"), RUNS)
def test_each_lane_of_a_pack_has_the_bits_of_the_scalar_engine(
    workplace: Path, build: str, name: str
) -> None:
    said = run(workplace, build, name, "lanes", 400)
    for what in ("lanes", "tangents"):
        found = re.findall(rf"{what} (\d) equal, statuses (\d+)", said)
        assert [lanes for lanes, _ in found] == lanes_of(build)
        if name == "C":  # chatter (bit 2), stick (3) and release (4) happened in the lanes too
            assert all(int(statuses) & 0b11100 == 0b11100 for _, statuses in found)


@pytest.mark.parametrize("name", GOLDEN)
def test_jets_through_the_engine_equal_the_product_of_saltation_matrices(
    workplace: Path, name: str
) -> None:
    # 12 impacts: each product of matrices adds some ulp, amplified by conditioning below 1e4
    assert float.fromhex(run(workplace, usual(name), name, "jet", 12)) < 1e-10


@pytest.mark.parametrize(("name", "most"), [("A", 700.0), (COUPLED, 900.0)])
def test_an_impact_costs_some_hundred_operations(workplace: Path, name: str, most: float) -> None:
    # at least 250: five times ahead, a root and a jump of a system with six coordinates
    assert 250.0 < float(run(workplace, usual(name), name, "count", 200)) < most


def test_a_flight_that_repeats_costs_less_than_half(workplace: Path) -> None:
    def operations(impacts: int) -> float:
        return float(run(workplace, "gcc", "A, steady", "count", impacts)) * impacts

    late, early = operations(400) - operations(300), operations(100)
    assert late < early / 2


KERNEL = """
#include "vibroimpact/engine/run.hpp"
#include "vibroimpact/flow/dense.hpp"
#include "vibroimpact/orbit/prescribed.hpp"
#include "vibroimpact/numeric/jet.hpp"
#include "vibroimpact/numeric/mixed_jet.hpp"
using small = vi::modal_flow<double, vi::fixed<6, 1, 1>>;
using dense = vi::dense_flow<double, vi::bounded<8, 2>>;
using jet = vi::jet<double, 2>;
using map = vi::prescribed<double, vi::bounded<8, 2>>;
using form = vi::mixed_jet<3>;
%s
"""
CUDA = (
    KERNEL
    % """
extern "C" __global__ void one_event(const vi::hybrid<small>* s,
                                     vi::trajectory<double, vi::fixed<6, 1, 1>>* at, double* t) {
    t[threadIdx.x] = vi::step(*s, at[threadIdx.x], 1e6).duration;
}
template <class Map>
__global__ void one_segment(const Map* map, const typename Map::stop_type* stop,
                            vi::orbit_state<form>* z, double t) {
    map->template impact<3>(*stop, z[threadIdx.x], t);
}
"""
)
WASM = (
    KERNEL
    % """
using point = vi::trajectory<double, vi::fixed<6, 1, 1>>;
using jets = vi::trajectory<jet, vi::bounded<8, 2>>;
extern "C" double one_event(const vi::hybrid<small>* s, point* at,
                            const vi::hybrid<dense>* t, jets* to) {
    return vi::step(*s, *at, 1e6).duration + vi::step(*t, *to, 1e6).duration.v;
}
extern "C" double one_segment(const map* m, const map::stop_type* stop,
                              vi::orbit_state<form>* z, double t) {
    return m->impact<3>(*stop, *z, t).c[7];
}
"""
)


def test_the_kernel_compiles_for_a_gpu() -> None:
    """No GPU is used: headers that NVRTC takes are free-standing."""
    core = pytest.importorskip("cuda.core", reason="cuda-core is not installed on this platform")
    options = core.ProgramOptions(
        std="c++20",
        arch="sm_90",
        fma=False,
        include_path=[str(INCLUDE)],
        device_as_default_execution_space=True,
    )
    program = core.Program(CUDA, "c++", options)
    code = program.compile("cubin", name_expressions=["one_segment<map>"])
    assert len(code.code) > 1000


def test_the_engine_compiles_for_webassembly_without_imports(tmp_path: Path) -> None:
    source, out = tmp_path / "engine.cpp", tmp_path / "engine.wasm"
    source.write_text(WASM)
    subprocess.run(
        [*ZIG, *WASM_FLAGS, *FLAGS, str(source), "-o", str(out)],
        check=True,
    )
    assert out.read_bytes()[:4] == b"\0asm"
    assert 2 not in section_numbers(out.read_bytes())  # section 2 would list imports


def section_numbers(module: bytes) -> list[int]:
    """Numbers of the sections of a WebAssembly module."""
    at, found = 8, []
    while at < len(module):
        found.append(module[at])
        at, size, shift = at + 1, 0, 0
        while True:
            byte = module[at]
            size |= (byte & 127) << shift
            at, shift = at + 1, shift + 7
            if byte < 128:
                break
        at += size
    return found


def test_every_header_stands_alone(tmp_path: Path) -> None:
    headers = sorted(INCLUDE.rglob("*.hpp"))
    lines = [f'#include "{h.relative_to(INCLUDE)}"\n' for h in headers]
    assert len(headers) > 15
    for i, line in enumerate(lines):
        (tmp_path / f"{i}.cpp").write_text(line)
    sources = [str(tmp_path / f"{i}.cpp") for i in range(len(lines))]
    assert shutil.which("g++"), "g++ is needed to build the package"
    subprocess.run(["g++", *FLAGS, "-fsyntax-only", *sources], check=True)


def test_the_kernel_includes_no_standard_header_but_those_of_vector_instructions() -> None:
    found = {
        (str(header.relative_to(INCLUDE)), line)
        for header in INCLUDE.rglob("*.hpp")
        for line in header.read_text().splitlines()
        if re.match(r"\s*#\s*include\s*<", line)
    }
    pack = "vibroimpact/numeric/pack.hpp"
    assert found == {(pack, "#include <immintrin.h>"), (pack, "#include <arm_neon.h>")}
