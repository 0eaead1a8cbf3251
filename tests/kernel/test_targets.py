"""Instruction sets: one exact fma, the best module that the processor runs, the same sweeps."""

from __future__ import annotations

import hashlib
import json
import math
import os
import random
import struct
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.builds import BUILDS, output
from support.members import cases, chain

import vibroimpact as vi
from vibroimpact import _cpu, _kernel
from vibroimpact.compile.hybrid import hybrid_of
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.table import OBSERVERS

SEED = 20211121
INF, NAN = math.inf, math.nan
HERE = Path(__file__).parent
PATHS = os.pathsep.join(map(str, (Path(vi.__file__).parents[1], HERE, HERE.parent)))
LEAST, TINY, HUGE = 2.0**-1074, 2.0**-1022, sys.float_info.max
ULP = 2.0**-52

Triple = tuple[float, ...]  # a, b, c


def fused(a: float, b: float, c: float) -> float:
    """a b + c rounded once, by exact rational arithmetic."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a * b + c
    if not math.isfinite(c):
        return c  # whatever is finite beside it, also where a * b would overflow
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    if exact == 0:  # the sign of 0 + 0, and + of x - x
        return a * b + c if a == 0.0 or b == 0.0 else 0.0
    try:
        return exact.numerator / exact.denominator  # int / int is correctly rounded
    except OverflowError:
        return INF if exact > 0 else -INF


def random_double(rng: random.Random, exponents: range, bits: int) -> float:
    """A number with so many random bits in its significand."""
    fraction = rng.getrandbits(bits) << (52 - bits)
    pattern = rng.getrandbits(1) << 63 | rng.choice(exponents) << 52 | fraction
    return float(struct.unpack("<d", struct.pack("<Q", pattern))[0])


def triples() -> list[Triple]:
    """Numbers of all sizes, of like sizes, short ones (ties), tiny, cancelling and huge ones."""
    rng = random.Random(SEED)  # noqa: S311 - not for secrets
    everything, near, low = range(2047), range(1000, 1046), range(60)
    out = []
    for _ in range(1500):
        out += [
            tuple(random_double(rng, everything, 52) for _ in range(3)),
            tuple(random_double(rng, near, 52) for _ in range(3)),
            tuple(random_double(rng, near, rng.randrange(1, 30)) for _ in range(3)),
        ]
        a, b = random_double(rng, range(500, 530), 52), random_double(rng, range(480, 520), 40)
        out += [(a, b, random_double(rng, low, 52)), (a, b, 0.0)]  # results around the smallest
        a, b = random_double(rng, near, 52), random_double(rng, near, 52)
        out.append((a, b, -a * b * (1.0 + rng.randrange(-2, 3) * ULP)))
        a, b = random_double(rng, range(1500, 1540), 52), random_double(rng, range(1510, 1540), 52)
        out.append((a, b, random_double(rng, range(2000, 2047), 52)))  # around the largest
        a, b = random_double(rng, range(615, 635), 52), random_double(rng, range(1415, 1430), 52)
        out.append((a, b, random_double(rng, range(215, 230), 52)))  # where whole numbers take over
    return out


SPECIAL: list[Triple] = [
    *((a, b, c) for a in (0.0, -0.0, 1.5) for b in (0.0, -0.0, -2.0) for c in (0.0, -0.0, 3.0)),
    *((a, b, c) for a in (INF, -INF, 1.0, 0.0) for b in (INF, -2.0, 0.0) for c in (INF, -INF, 1.0)),
    *((NAN, 1.0, 1.0), (1.0, NAN, 1.0), (1.0, 1.0, NAN), (HUGE, HUGE, -INF), (HUGE, -HUGE, INF)),
    *((HUGE, 1.0, HUGE), (HUGE, 2.0, -HUGE), (HUGE, 1.0, 2.0**969), (HUGE, 1.0, 2.0**970)),
    *((LEAST, LEAST, 0.0), (LEAST, -LEAST, 0.0), (LEAST, LEAST, 1.0), (LEAST, -LEAST, 1.0)),
    *((LEAST, 0.5, 0.0), (LEAST, 0.5, LEAST), (3.0 * LEAST, 0.5, 0.0), (LEAST, 1.5, 0.0)),
    *((TINY, 1.0 - ULP / 2, 0.0), (TINY, 0.5, LEAST), (TINY, 1.0, -LEAST), (TINY, -1.0, TINY)),
    *((1.0 + ULP, 1.0 + ULP, -1.0 - 2 * ULP), (1.0 + ULP, 1.0 - ULP, -1.0), (1.0, 1.0, LEAST)),
    *((1.0, 1.0, ULP / 2), (1.0 + ULP, 1.0, ULP / 2), (1.0, -1.0, ULP / 4), (2.0**52, 2.0, 1.0)),
]  # fmt: skip


def like(x: float, y: float) -> bool:
    """Equal, zeros with their sign; any NaN is any other."""
    return (x != x and y != y) or (x == y and math.copysign(1.0, x) == math.copysign(1.0, y))


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.slow
def test_fma_is_exact_in_whole_numbers_by_exact_sums_and_as_the_target_does_it(
    build: str, tmp_path: Path
) -> None:
    cases = SPECIAL + triples()
    given = "".join(f"{a.hex()} {b.hex()} {c.hex()}\n" for a, b, c in cases)
    lines = output(tmp_path, "fma_test", build, given=given).splitlines()
    for case, line in zip(cases, lines, strict=True):
        for found in map(float.fromhex, line.split()):
            assert like(found, fused(*case)), (case, found)


# Choosing a module --------------------------------------------------------------------------------


def test_the_best_installed_instruction_set_is_chosen_unless_another_is_wanted() -> None:
    assert _kernel.chosen(["avx2", "baseline"], None) == "avx2"
    assert _kernel.chosen(["avx2", "baseline"], "baseline") == "baseline"


def test_an_instruction_set_that_is_not_there_is_refused_with_those_that_are() -> None:
    with pytest.raises(ImportError, match="VIBROIMPACT_TARGET = 'avx512': must be one of avx2, ba"):
        _kernel.chosen(["avx2", "baseline"], "avx512")


def test_a_package_built_for_other_processors_says_so() -> None:
    with pytest.raises(ImportError, match="built for other processors than this one"):
        _kernel.chosen([], None)


def test_every_processor_runs_the_baseline_and_tries_it_last() -> None:
    assert _cpu.supported()[-1] == "baseline"
    assert _kernel.target in _kernel.installed(_cpu.supported())


def in_a_child(code: str, wanted: str | None, path: str) -> subprocess.CompletedProcess[str]:
    """A new interpreter with this VIBROIMPACT_TARGET and PYTHONPATH."""
    environment = {k: v for k, v in os.environ.items() if k != "VIBROIMPACT_TARGET"}
    environment["PYTHONPATH"] = path
    if wanted is not None:
        environment["VIBROIMPACT_TARGET"] = wanted
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )


HOLD = """
import threading
import test_targets
from vibroimpact.compile.hybrid import compile_mechanism
held = threading.Event()
def hold():
    system = compile_mechanism(test_targets.chain())
    held.set()
    threading.Event().wait()
threading.Thread(target=hold, daemon=True).start()
assert held.wait(20.0)
"""


@pytest.mark.slow
def test_an_interpreter_ends_in_silence_while_a_thread_holds_a_system() -> None:
    done = in_a_child(HOLD, None, PATHS)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture
def three_modules(tmp_path: Path) -> str:
    """A package with the real ``_kernel.py`` and empty modules: a path to import it from."""
    package = tmp_path / "vibroimpact"
    package.mkdir()
    source = Path(_kernel.__file__).read_text(encoding="utf-8")
    (package / "_kernel.py").write_text(source, encoding="utf-8")
    (package / "__init__.py").touch()
    (package / "_cpu.py").write_text("def supported():\n    return ['avx2', 'baseline']\n")
    for target in ("avx512", "avx2", "baseline"):
        (package / f"_kernel_{target}.py").write_text(f"built_for = {target!r}\n")
    return str(tmp_path)


@pytest.mark.parametrize(
    ("wanted", "loaded"), [(None, "avx2"), ("avx2", "avx2"), ("baseline", "baseline")]
)
def test_the_environment_variable_chooses_which_module_is_loaded(
    three_modules: str, wanted: str | None, loaded: str
) -> None:
    code = (
        "import sys; from vibroimpact import _kernel as k; print(k.target, k.built_for, sep='\\n')"
    )
    code += "\nprint(*(m for m in sys.modules if '_kernel_' in m))"
    said = in_a_child(code, wanted, three_modules)
    assert said.stdout.split() == [loaded, loaded, f"vibroimpact._kernel_{loaded}"], said.stderr


def test_a_module_that_the_processor_does_not_run_is_never_loaded(three_modules: str) -> None:
    said = in_a_child("from vibroimpact import _kernel", "avx512", three_modules)
    assert said.returncode == 1
    assert "must be one of avx2, baseline, which are installed and run on" in said.stderr


def test_the_installed_package_obeys_the_environment_variable() -> None:
    path = str(Path(vi.__file__).parents[1])
    code = "from vibroimpact import _kernel; print(_kernel.target, _kernel._module.__name__)"
    for target in _kernel.installed(_cpu.supported()):
        assert in_a_child(code, target, path).stdout.split() == [
            target,
            f"vibroimpact._kernel_{target}",
        ]
    assert "ImportError: VIBROIMPACT_TARGET = 'mmx'" in in_a_child(code, "mmx", path).stderr


# Sweeps -------------------------------------------------------------------------------------------


def swept() -> dict[str, vi.Mechanism]:
    """Systems of every flow, of written numbers: a BLAS differs from machine to machine."""
    dashpots = [[0.05, 0.0, 0.0], [0.0, 0.04, -0.04], [0.0, -0.04, 0.04]]
    coupled = replace(chain(), damping=dashpots)
    return {
        "chaotic": cases()["chaotic"].mechanism,
        "chatter": cases()["chatter"].mechanism,
        "two contacts": chain(),
        "coupled": coupled,
        "dense": replace(coupled, constant_force=(0.0, 0.0, 0.1)),  # which no spring holds
    } | with_elements()


def with_elements() -> dict[str, vi.Mechanism]:
    """A machine of each kind of element."""
    force = vi.Harmonic(0.9, (0.5, 0.0))
    moving = vi.RigidStop(
        (1.0, 0.0), upper=0.4, restitution=0.6, motion=vi.Harmonic(0.9, (0.0,), (0.1,))
    )
    soft = vi.SoftStop((1.0, -1.0), -0.2, 0.1, stiffness=(9.0, 20.0), damping=(0.4, 0.6))
    rubbing = vi.Friction((0.0, 1.0), 0.2, 0.3, belt_speed=0.05)

    def chained(*elements: Any, damping: Any = ((0.1, 0.0), (0.0, 0.1))) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0, 0.0], [0.0, 0.5]], damping=damping, stiffness=[[2.0, -1.0], [-1.0, 1.5]],
            forces=(force,), elements=elements,
        )  # fmt: skip

    return {
        "soft stop": chained(soft),
        "limited stop": chained(replace(soft, law="limited")),
        "friction": chained(soft, rubbing),
        "moving stop": chained(moving),
        "gyroscopic": chained(replace(moving, motion=()), damping=((0.1, 0.4), (-0.4, 0.1))),
    }


def everything_of(mechanism: vi.Mechanism) -> xr.Dataset:
    """Two systems from six random starts each, seen by every observer."""
    n = mechanism.degrees
    over = {f"v{i + 1}": (-1.0, 1.0) for i in range(n)} | {"phase": (0.0, 6.28)}
    start = vi.RandomStarts(6, SEED, over, vi.State((0.0,) * n, (0.0,) * n))
    return vi.sweep(
        mechanism, over={"mass[0][0]": [1.0, 1.1]}, start=start, observe=tuple(OBSERVERS),
        settle_periods=50, periods=100, progress=False,
    )  # fmt: skip


def hash_of(found: xr.Dataset) -> str:
    """Of the bits of every result; any NaN is any other."""
    digest = hashlib.sha256()
    for result in found.data_vars.values():
        values = np.array(result, dtype=float)
        values[np.isnan(values)] = NAN
        digest.update(values.tobytes())
    return digest.hexdigest()[:16]


def hashes() -> dict[str, str]:
    """Of every sweep, by the kernel of this process."""
    return {name: hash_of(everything_of(mechanism)) for name, mechanism in swept().items()}


# A change means other bits, to be announced as breaking; or another observer.
GOLDEN = {
    "chaotic": "ba5c6d67dcbe9fc7",
    "chatter": "0367af4c55cef21a",
    "two contacts": "fcf2a1353bbcd1b6",
    "coupled": "418f9bc3442cad30",
    "dense": "c3f8b593bd007ce1",
    "soft stop": "d3d5dca6a65668ae",
    "limited stop": "90f74c76187ac4ef",
    "friction": "a0608887a614d4c6",
    "moving stop": "041fdef6df175724",
    "gyroscopic": "b2d43231a56e167d",
}


@pytest.mark.parametrize("target", _kernel.installed(_cpu.supported()))
@pytest.mark.slow
def test_sweeps_have_the_golden_hashes_on_every_installed_target(target: str) -> None:
    code = "import json, test_targets; print(json.dumps(test_targets.hashes()))"
    said = in_a_child(code, target, PATHS)
    assert said.returncode == 0, said.stderr
    assert json.loads(said.stdout) == GOLDEN


@pytest.mark.slow
def test_these_sweeps_have_every_flow_and_a_number_of_every_result() -> None:
    flows = {(h.dense, h.mixed) for h in map(hybrid_of, swept().values())}
    assert flows == {(False, False), (False, True), (True, False)}
    found = [everything_of(mechanism) for mechanism in swept().values()]
    assert all(np.all(one.end == MemberStatus.OK) for one in found)
    for name in found[0].data_vars:
        assert any(np.isfinite(one[name]).any() for one in found), name
    assert any(one.chatters.any() for one in found)
    assert any(one.share_at_rest.any() for one in found)
    assert any((one.lyapunov > 0.1).any() for one in found)
    shares = [one.share_in_state for one in found if one.share_in_state.size]
    assert np.max([share.max(axis=(0, 1, 2)) for share in shares], axis=0).min() > 0.0
