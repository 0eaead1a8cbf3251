"""Elementary functions of the kernel against mpmath, on every compiler and for every scalar."""

from __future__ import annotations

import importlib.util
import math
import random
import re
import shutil
import struct
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import mpmath as mp
import pytest
from support.builds import ZIG, compile_program

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "include"
FLAGS = [
    "-std=c++20",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-Wno-psabi",
    f"-I{INCLUDE}",
]
COMPILERS = {"gcc": ["g++"], "clang": [*ZIG]}
SEED = 20210331
RANGE = 2.0**20  # of sincos

Case = tuple[str, float, float]  # function, its arguments (the second may be idle)

# The bounds that math.hpp states, in units of the last place of the correctly rounded result.
BOUND = {"sincos": 1.0, "exp": 1.0, "log": 1.0, "atan2": 2.0}


def available(compiler: str) -> list[str]:
    command = COMPILERS[compiler]
    if compiler == "gcc" and shutil.which("g++") is None:
        pytest.skip("g++ is not installed")
    if compiler == "clang" and importlib.util.find_spec("ziglang") is None:
        pytest.skip("ziglang, which brings clang, is not installed")
    return command


def build(compiler: str, program: str, folder: Path) -> Path:
    target = folder / f"{program}-{compiler}"
    source = ROOT / "tests" / "cpp" / f"{program}.cpp"
    compile_program([*available(compiler), *FLAGS], source, target)
    return target


def evaluate(program: Path, cases: list[Case]) -> str:
    lines = "".join(f"{name} {a.hex()} {b.hex()}\n" for name, a, b in cases)
    done = subprocess.run([program], input=lines, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def parsed(output: str) -> list[tuple[float, float]]:
    return [
        (float.fromhex(first), float.fromhex(second))
        for first, second in (line.split() for line in output.splitlines())
    ]


def random_double(random_: random.Random) -> float:
    """Any bit pattern but NaN and infinity."""
    while True:
        x: float = struct.unpack("<d", random_.randbytes(8))[0]
        if math.isfinite(x):
            return x


# Arguments ----------------------------------------------------------------------------------------


def multiples_of_half_pi() -> Iterator[float]:
    """The doubles nearest to n pi/2 and their neighbours, for n over the whole range."""
    with mp.workdps(60):
        counts = [*range(1, 400), *(int(1.013**k) for k in range(465, 1033))]
        for n in counts:
            x = float(n * mp.pi / 2)
            if x < RANGE:
                yield from (x, math.nextafter(x, 0.0), math.nextafter(x, math.inf))


def closest_to_half_pi() -> Iterator[float]:
    """The doubles m 2^e that come closest of all to a multiple of pi/2, one or more for each e.

    m 2^e = n pi/2 (1 + tiny) makes n / m a convergent of the continued fraction of 2^e / (pi/2).
    """
    with mp.workdps(80):
        for e in range(-53, -32):
            ratio = mp.mpf(2) ** e / (mp.pi / 2)
            before, m, rest = 0, 1, 1 / (ratio - mp.floor(ratio))
            while m < 2**53:
                if m >= 2**30:
                    yield math.ldexp(m, e)
                before, m = m, int(rest) * m + before
                rest = 1 / (rest - mp.floor(rest))


def sincos_arguments(random_: random.Random) -> Iterator[float]:
    yield from multiples_of_half_pi()
    yield from closest_to_half_pi()
    yield from (0.0, 5e-324, 1e-310, 2.0**-27, RANGE, math.nextafter(RANGE, 0.0))
    yield from (random_.uniform(0.0, math.pi / 4) for _ in range(1500))
    yield from (random_.uniform(-10.0, 10.0) for _ in range(1500))
    yield from (random_.uniform(-RANGE, RANGE) for _ in range(1500))
    yield from (math.ldexp(random_.uniform(1.0, 2.0), -k) for k in range(1074))


def exp_arguments(random_: random.Random) -> Iterator[float]:
    half_steps = [(k + 0.5) * math.log(2) for k in range(-1075, 1023)]
    for x in half_steps:
        yield from (x, math.nextafter(x, -math.inf), math.nextafter(x, math.inf))
    yield from (0.0, -0.0, 5e-324, -1e-17, 709.782712893384, 709.7827128933841, -745.1332191019411)
    yield from (random_.uniform(-1.0, 1.0) for _ in range(2000))
    yield from (random_.uniform(-708.0, 709.0) for _ in range(2000))
    yield from (random_.uniform(-745.0, -708.0) for _ in range(300))


def log_arguments(random_: random.Random) -> Iterator[float]:
    yield from (abs(random_double(random_)) for _ in range(2000))
    yield from (random_.uniform(0.5, 2.0) for _ in range(2000))
    yield from (1.0 + math.ldexp(random_.uniform(-1.0, 1.0), -k) for k in range(1, 53))
    yield from (5e-324, 1e-310, 2.2250738585072014e-308, sys.float_info.max, 1.0)
    root = math.sqrt(0.5)
    for k in range(-30, 30):
        yield from (math.ldexp(math.nextafter(root, end), k) for end in (0.0, 1.0))


def atan2_arguments(random_: random.Random) -> Iterator[tuple[float, float]]:
    for _ in range(2500):
        angle = random_.uniform(-math.pi, math.pi)
        size = 2.0 ** random_.uniform(-100, 100)
        yield size * math.sin(angle), size * math.cos(angle)
        yield random_double(random_), random_double(random_)
        x = random_.uniform(-1.0, 1.0)
        yield x * random_.uniform(0.4, 0.6), x  # about where the reduction changes
    for k in range(-60, 61):
        yield from ((2.0**k * s, 1.7) for s in (1.1, -1.3))
    for ratio in (0.5, 2.0, 1.0):
        for end in (0.0, ratio, 9.0):
            t = math.nextafter(ratio, end)
            yield from ((t, 1.0), (t, -1.0), (-t, 1.0), (-t, -1.0))
    top, least = sys.float_info.max, 5e-324
    yield from ((top, top), (-top, -top), (least, least), (least, -1.0), (top, least), (least, top))


@cache
def accuracy_cases() -> list[Case]:
    random_ = random.Random(SEED)  # noqa: S311 -- not for secrets
    cases: list[Case] = [("sincos", s * x, 0.0) for x in sincos_arguments(random_) for s in (1, -1)]
    cases += [("exp", x, 0.0) for x in exp_arguments(random_)]
    cases += [("log", x, 0.0) for x in log_arguments(random_)]
    cases += [("atan2", y, x) for y, x in atan2_arguments(random_)]
    return cases


# References ---------------------------------------------------------------------------------------


def ulps(computed: float, exact: mp.mpf) -> float:
    """Error in units of the last place of the rounded exact value; infinity is 2^1024."""
    rounded = float(exact)
    if math.isinf(rounded) or math.isinf(computed):
        return 0.0 if rounded == computed else math.inf
    return float(abs(mp.mpf(computed) - exact) / math.ulp(rounded))


EXACT: dict[str, Callable[[mp.mpf, mp.mpf], tuple[mp.mpf, ...]]] = {
    "sincos": lambda a, _: (mp.sin(a), mp.cos(a)),
    "exp": lambda a, _: (mp.exp(a),),
    "log": lambda a, _: (mp.log(a),),
    "atan2": lambda a, b: (mp.atan2(a, b),),
}


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build("gcc", "math_test", tmp_path_factory.mktemp("math"))


@pytest.fixture(scope="module")
def outputs(program: Path) -> str:
    """What the accuracy cases give with g++."""
    return evaluate(program, accuracy_cases())


@pytest.mark.parametrize("function", BOUND)
@pytest.mark.slow
def test_errors_stay_within_the_stated_bound(function: str, outputs: str) -> None:
    worst = (0.0, 0.0, 0.0)
    with mp.workdps(60):
        for (name, a, b), computed in zip(accuracy_cases(), parsed(outputs), strict=True):
            if name == function:
                exact = EXACT[name](mp.mpf(a), mp.mpf(b))
                error = max(ulps(c, e) for c, e in zip(computed, exact, strict=False))
                worst = max(worst, (error, a, b))
    error, a, b = worst
    print(f"{function}: at most {error:.3f} ulp, at ({a.hex()}, {b.hex()})")
    assert error <= BOUND[function], f"{error:.3f} ulp at ({a.hex()}, {b.hex()}), seed {SEED}"


def test_compilers_give_the_same_bits(outputs: str, tmp_path: Path) -> None:
    other = build("clang", "math_test", tmp_path)
    assert evaluate(other, accuracy_cases()) == outputs


INF, NAN = math.inf, math.nan
SPECIAL: list[tuple[Case, tuple[float, ...]]] = [
    (("sincos", 0.0, 0.0), (0.0, 1.0)),
    (("sincos", -0.0, 0.0), (-0.0, 1.0)),
    (("sincos", math.nextafter(RANGE, INF), 0.0), (NAN, NAN)),
    (("sincos", -1e300, 0.0), (NAN, NAN)),
    (("sincos", INF, 0.0), (NAN, NAN)),
    (("sincos", NAN, 0.0), (NAN, NAN)),
    (("exp", 0.0, 0.0), (1.0,)),
    (("exp", 709.7827128933841, 0.0), (INF,)),
    (("exp", 1e300, 0.0), (INF,)),
    (("exp", INF, 0.0), (INF,)),
    (("exp", -745.2, 0.0), (0.0,)),
    (("exp", -1e300, 0.0), (0.0,)),
    (("exp", -INF, 0.0), (0.0,)),
    (("exp", NAN, 0.0), (NAN,)),
    (("log", 1.0, 0.0), (0.0,)),
    (("log", 0.0, 0.0), (-INF,)),
    (("log", -0.0, 0.0), (-INF,)),
    (("log", -1.0, 0.0), (NAN,)),
    (("log", -INF, 0.0), (NAN,)),
    (("log", INF, 0.0), (INF,)),
    (("log", NAN, 0.0), (NAN,)),
    (("atan2", NAN, 1.0), (NAN,)),
    (("atan2", 1.0, NAN), (NAN,)),
    (("atan2", INF, NAN), (NAN,)),
    (("atan2", NAN, INF), (NAN,)),
    (("sqrt", 2.0, 0.0), (math.sqrt(2.0),)),
    (("sqrt", -1.0, 0.0), (NAN,)),
    (("copysign", 3.0, -0.0), (-3.0,)),
    (("copysign", -INF, 1.0), (INF,)),
]
ENDS = (0.0, -0.0, 1.0, -1.0, INF, -INF)
SPECIAL += [(("atan2", y, x), (math.atan2(y, x),)) for y in ENDS for x in ENDS]
ROUNDED = (
    0.0,
    0.3,
    0.5,
    0.7,
    1.5,
    2.5,
    1e9 + 0.5,
    2.0**51 + 0.5,
    2.0**52 - 0.5,
    2.0**52 + 1,
    1e300,
)
SPECIAL += [
    (("floor", s * x, 0.0), (math.copysign(math.floor(s * x), s),))
    for x in ROUNDED
    for s in (1, -1)
]
SPECIAL += [
    (("nearbyint", s * x, 0.0), (math.copysign(round(s * x), s),)) for x in ROUNDED for s in (1, -1)
]
SPECIAL += [((f, x, 0.0), (x,)) for f in ("floor", "nearbyint") for x in (INF, -INF, NAN)]


def test_special_values_follow_the_c_standard(program: Path) -> None:
    results = parsed(evaluate(program, [case for case, _ in SPECIAL]))
    for (case, expected), computed in zip(SPECIAL, results, strict=True):
        for c, e in zip(computed, expected, strict=False):
            same_sign = math.copysign(1.0, c) == math.copysign(1.0, e)
            assert (math.isnan(c) and math.isnan(e)) or (c == e and same_sign), (case, c, e)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_scalar_types_keep_their_promises(compiler: str, tmp_path: Path) -> None:
    subprocess.run([build(compiler, "scalar_test", tmp_path)], check=True)


@pytest.mark.slow
def test_roots_are_found_where_newtons_method_goes_round(tmp_path: Path) -> None:
    subprocess.run([build("clang", "root_test", tmp_path)], check=True)


@pytest.mark.slow
def test_what_is_called_clear_keeps_the_stated_margins(tmp_path: Path) -> None:
    subprocess.run([build("clang", "margin_test", tmp_path)], check=True)


@pytest.mark.slow
def test_how_far_a_contact_gets_is_bounded_by_no_less(tmp_path: Path) -> None:
    subprocess.run([build("clang", "reach_test", tmp_path)], check=True)


# Coefficients -------------------------------------------------------------------------------------


def generator() -> ModuleType:
    path = ROOT / "tools" / "math_coefficients.py"
    spec = importlib.util.spec_from_file_location("math_coefficients", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_coefficients_are_the_generators(capsys: pytest.CaptureFixture[str]) -> None:
    """Every number the generator prints stands in math.hpp, and each polynomial in its order."""
    with mp.workdps(15):  # main sets its own and this restores it
        generator().main()
    blocks = capsys.readouterr().out.strip().split("\n\n")
    number = re.compile(r"-?\d\.\d{16}e[+-]\d+")
    header = " ".join(
        number.findall((INCLUDE / "vibroimpact" / "numeric" / "math.hpp").read_text())
    )
    assert len(blocks) == 10
    for block in blocks:
        title, *values = block.splitlines()
        wanted = [value.strip() for value in values]
        if "truncation" in title:
            assert " ".join(wanted) in header, title
        else:
            assert all(value in header for value in wanted), title


# Freestanding targets -----------------------------------------------------------------------------

EVERYTHING = """
#include "vibroimpact/numeric/math.hpp"
#include "vibroimpact/numeric/counting.hpp"
#include "vibroimpact/numeric/jet.hpp"
namespace vi {
template <class T> VI_HD T everything(const T& x, const T& y) {
    const auto w = sincos(x);
    return exp(w.s) + log(y) / w.c + atan2(x, y) + sqrt(abs(min(x, y)));
}
template double everything<double>(const double&, const double&);
VI_HD double slope(double x) { return everything(jet<double, 1>::variable(x, 0), {2.0}).d[0]; }
}
"""


def test_webassembly_module_needs_nothing_from_outside(tmp_path: Path) -> None:
    source, module = tmp_path / "everything.cpp", tmp_path / "everything.wasm"
    vectors = '#include "vibroimpact/numeric/pack.hpp"\ntemplate vi::pack<2> vi::everything'
    source.write_text(
        EVERYTHING + vectors + "<vi::pack<2>>(const vi::pack<2>&, const vi::pack<2>&);\n"
        'extern "C" double slope(double x) { return vi::slope(x); }\n'
    )
    target = ["-target", "wasm32-freestanding", "-mcpu=generic+simd128"]
    bare = ["-fno-exceptions", "-fno-rtti", "-nostdlib", "-Wl,--no-entry", "-Wl,--export=slope"]
    command = [*available("clang"), *target, *FLAGS, *bare, str(source), "-o", str(module)]
    subprocess.run(command, check=True)
    # Undefined symbols would be an error of the linker: nothing permits imports.
    assert module.read_bytes()[:4] == b"\0asm"


def test_nvrtc_compiles_the_headers_for_a_gpu() -> None:
    core = pytest.importorskip("cuda.core", reason="cuda-core is not installed")
    kernel = """
    extern "C" __global__ void evaluate(double* y, const double* x) {
        y[threadIdx.x] = vi::everything(x[threadIdx.x], y[threadIdx.x]) + vi::slope(y[threadIdx.x]);
    }
    """
    options = core.ProgramOptions(std="c++20", arch="sm_90", fma=False, include_path=[str(INCLUDE)])
    assert core.Program(EVERYTHING + kernel, "c++", options).compile("cubin").code
