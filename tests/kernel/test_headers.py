"""The kernel on other devices, and headers by themselves: NVRTC, WebAssembly."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from support.builds import FLAGS, INCLUDE, ZIG

WASM_FLAGS = [
    *("-target", "wasm32-freestanding", "-mcpu=generic+simd128", "-O2", "-fno-exceptions"),
    *("-fno-rtti", "-nostdlib", "-Wl,--no-entry", "-Wl,--export=one_event"),
]
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
    map->template impact<3>(*stop, z[threadIdx.x], map->field.at_time(t), t);
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
    return m->impact<3>(*stop, *z, m->field.at_time(t), t).c[7];
}
"""
)


@pytest.mark.slow
def test_the_kernel_compiles_for_a_gpu() -> None:
    """No GPU is used: headers that NVRTC takes are free-standing."""
    core = pytest.importorskip("cuda.core", reason="cuda-core is not installed on this platform")
    options = core.ProgramOptions(
        std="c++20",
        arch="sm_90",
        fma=False,
        include_path=[str(INCLUDE)],
        device_as_default_execution_space=True,
        ofast_compile="max",  # nothing runs
    )
    program = core.Program(CUDA, "c++", options)
    code = program.compile("cubin", name_expressions=["one_segment<map>"])
    assert len(code.code) > 1000


@pytest.mark.slow
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


@pytest.mark.slow
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
