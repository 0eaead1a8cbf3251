"""The CUDA backend: its kernels as C++ against the kernel, as machine code, and what goes wrong."""

from __future__ import annotations

import re
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.host_device import HostDevice
from support.members import cases, chain
from support.systems import ball, paper_damper, random_mechanism

import vibroimpact as vi
from benchmarks import gpu
from benchmarks.case import random_starts
from vibroimpact.compile.hybrid import Hybrid
from vibroimpact.sweeps.execution import batch as batch_module
from vibroimpact.sweeps.execution import cuda_backend as backend
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.execution.cuda import card, program
from vibroimpact.sweeps.execution.cuda.layout import SEEN, Sizes, asked_of, batch_arrays
from vibroimpact.sweeps.execution.cuda.program import Kernels, compile_kernels
from vibroimpact.sweeps.execution.cuda_backend import runs_on
from vibroimpact.sweeps.observers.observer import OBSERVERS, Outcome, kernel_observers, resolve

sys.path.append(str(Path(__file__).resolve().parents[2]))  # benchmarks are not installed


SEED = 20211121
WATCH = vi.observe.Extremes(row=(-1.0, 1.0), label="relative")
EVERYTHING = (
    vi.observe.Section(points=7, stride=2), "symbol", "impacts", "speeds", "power", "extremes",
    WATCH, "rms", "lyapunov", "spectrum", "shares", vi.observe.Settling(longest=8), "final",
    vi.observe.Rotation(stop="B", tolerance=1e-9), vi.observe.Stroboscopic(points=5, phase=1.0),
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Kernels compiled for this processor."""
    return tmp_path_factory.mktemp("kernels")


def members_of(count: int, degrees: int, systems: int, **changes: Any) -> Members:
    """Seeded starts between the stops, and windows of different lengths."""
    rng = np.random.default_rng(SEED)
    given = {
        "system": rng.integers(0, systems, count).astype(np.int32),
        "position": rng.uniform(-0.3, 0.3, (count, degrees)),
        "velocity": rng.normal(0.0, 1.0, (count, degrees)),
        "phase": rng.uniform(0.0, 2.0 * np.pi, count),
        "settle": rng.uniform(0.0, 80.0, count),
        "observe": rng.uniform(50.0, 150.0, count),
        "most_impacts": 2000,
    }
    return Members(**(given | changes))


def check_equal_bits(
    system: Any, values: Any, members: Members, observe: Any, device: HostDevice
) -> Any:
    """Members run by the device's kernels and by the kernel of this processor."""
    observers = resolve(observe)
    here = run_members(batch_of(system, values), members, observers)
    there = run_members(batch_of(system, values, partial(runs_on, device)), members, observers)
    assert device.launched
    assert list(here) == list(there)
    for name, one in here.items():
        assert one.tobytes() == there[name].tobytes(), name
    return here


# --- equal bits -----------------------------------------------------------------------------------


def test_every_observer_has_the_bits_of_the_processor(folder: Path) -> None:
    damper = paper_damper("C", 0.4268)
    values = {
        "omega": np.array([0.4205, 0.7, 1.05, damper.omega]),
        "restitution": np.array([0.3, 0.5, 0.8, damper.restitution]),
    }
    members = members_of(24, 2, 3, settle=np.linspace(0.0, 400.0, 24))
    members.position[0] = (0.0, 1e3)  # behind a stop
    members.position[1:3] = (0.0, 6.0)  # on a stop: towards it, and at rest there
    members.velocity[1:3] = ((0.0, 1.0), (0.3, 0.3))
    members.system[3] = 3  # on a closed curve
    members.settle[3], members.observe[3] = 200.0 * damper.period, 400.0 * damper.period
    found = check_equal_bits(damper, values, members, EVERYTHING, HostDevice(folder))
    assert {Outcome.OK, Outcome.BEHIND_STOP} <= set(found["end"])
    assert found["chatters"].any()
    assert (found["share_at_rest"] > 0.0).any()
    assert (found["n"] > 0).any()
    assert np.isfinite(found["settling"]).any()
    assert found["rotation_error"][3] < 1e-3


def test_two_contacts_and_their_modes_have_the_bits_of_the_processor(folder: Path) -> None:
    values = {"contacts[0].upper": np.linspace(0.8, 1.2, 4)}
    members = members_of(16, 3, 4, most_impacts=300)
    check_equal_bits(chain(), values, members, ("final", "impacts", "power"), HostDevice(folder))


def test_coupled_damping_has_the_bits_of_the_processor(folder: Path) -> None:
    """Every observer, tangents of lanes among them; 6, 1, 1 is compiled apart elsewhere."""
    system = random_mechanism(np.random.default_rng(3), 2)
    values = {"damping[0][0]": system.damping[0][0] + np.linspace(0.0, 0.3, 4)}
    assert Hybrid(system).mixed
    members = members_of(16, 2, 4, position=np.zeros((16, 2)), most_impacts=400)
    found = check_equal_bits(system, values, members, EVERYTHING, HostDevice(folder))
    assert (found["end"] == Outcome.OK).any()


def test_systems_without_forcing_have_the_bits_of_the_processor(folder: Path) -> None:
    members = members_of(6, 1, 1, position=np.full((6, 1), 1.0))
    check_equal_bits(ball(0.9), {}, members, ("final", "symbol"), HostDevice(folder))


def test_members_go_in_pieces_where_memory_is_short(folder: Path) -> None:
    values = {"omega": np.linspace(0.9, 1.1, 12)}
    members, whole = members_of(40, 2, 12), HostDevice(folder)
    members = members.of(np.arange(40), np.sort(members.system))
    check_equal_bits(paper_damper("B", 1.0), values, members, ("final", "symbol"), whole)
    short = HostDevice(folder, free=whole.lent // 3)
    check_equal_bits(paper_damper("B", 1.0), values, members, ("final", "symbol"), short)
    assert len([name for name, _ in short.launched if name == "run"]) > 3
    assert short.lent < short.free()


def test_no_memory_at_all_is_an_error(folder: Path) -> None:
    device = HostDevice(folder, free=1000)
    with pytest.raises(vi.VibroImpactError, match=r"one member needs .* 1000 are free"):
        check_equal_bits(paper_damper("B", 1.0), {}, members_of(1, 2, 1), ("symbol",), device)


def test_dense_flows_stay_on_the_processor(folder: Path) -> None:
    case, device = cases()["dense"], HostDevice(folder)
    batch = batch_of(case.system, {}, partial(runs_on, device))
    run_members(batch, members_of(2, 3, 1), resolve("final"))
    assert device.launched == []


def falling() -> vi.Mechanism:
    """Three balls above one floor: sets of closed contacts are compiled when they are wanted."""
    return vi.Mechanism(
        mass=np.diag([1.0, 2.0, 3.0]).tolist(),
        damping=[[0.0] * 3] * 3,
        stiffness=[[0.1, -0.1, 0.0], [-0.1, 0.2, -0.1], [0.0, -0.1, 0.1]],
        forces=(vi.Harmonic(1.0, (0.2, 0.0, 0.0)),),
        constant_force=(-1.0, -2.0, -3.0),
        contacts=tuple(
            vi.Contact(tuple(float(i == k) for i in range(3)), 0.0, np.inf, 0.5) for k in range(3)
        ),
    )


def test_modes_that_are_missing_are_added_on_the_processor(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finished: list[int] = []
    finish = batch_module._finish

    def counted(batch: Any, members: Any, observers: Any, rows: Any, out: Any) -> None:
        finished.append(len(rows))
        finish(batch, members, observers, rows, out)

    monkeypatch.setattr(batch_module, "_finish", counted)
    members = members_of(3, 3, 1, position=np.full((3, 3), 0.5), settle=np.zeros(3))
    found = check_equal_bits(falling(), {}, members, ("final",), HostDevice(folder))
    assert finished[0] > 0
    assert np.all(found["end"] == Outcome.OK)


# --- the backend ----------------------------------------------------------------------------------


@pytest.mark.parametrize("follow", [None, "-omega"])
def test_a_sweep_on_a_device_is_that_on_threads(
    folder: Path, monkeypatch: pytest.MonkeyPatch, follow: str | None
) -> None:
    device = HostDevice(folder)
    monkeypatch.setattr(backend, "open_card", lambda: device)
    asked: dict[str, Any] = {
        "over": {"omega": [1.0, 1.1, 1.2], "half_clearance": [2.0, 3.0, 4.0]},
        "start": vi.State((0.0, 0.0), (0.0, 1.0)),
        "observe": ("final", "symbol"),
        "settle": 10, "periods": 5, "progress": False, "follow": follow, "tile": 4, "workers": 2,
    }  # fmt: skip
    found = vi.sweep(paper_damper("A", 1.2), **asked, backend="cuda")
    xr.testing.assert_identical(found, vi.sweep(paper_damper("A", 1.2), **asked))
    assert device.launched


# --- machine code ---------------------------------------------------------------------------------

GATE = Kernels(dimension=6, lines=1, contacts=1, mixed=0, tangents=0, observers=1 << 1)  # symbol
COUPLED = GATE._replace(mixed=1, contacts=2)
LARGEST = asked_of(kernel_observers(resolve(list(OBSERVERS))), Sizes(2, 1, 1, 0)).kernels
OLD_AND_NEW = ("sm_75", "sm_90")


# Bytes of one function at most: the certified step, called for few events, has 1552, 1204 and 7160.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kernels", "archs", "most"),
    [
        (GATE, OLD_AND_NEW, 2048),
        (COUPLED, OLD_AND_NEW, 2048),
        (LARGEST, ("sm_90",), 9000),
    ],
    ids=["symbol", "coupled damping, two contacts", "all observers, the spectrum"],
)
def test_kernels_compile_without_many_spills(
    kernels: Kernels, archs: tuple[str, ...], most: int
) -> None:
    pytest.importorskip("cuda.core", reason="cuda-core is not installed")
    with ThreadPoolExecutor() as pool:
        built = list(pool.map(partial(compile_kernels, kernels), archs))
    for code, log in built:
        assert code[:4] == b"\x7fELF"
        assert all(name.encode() in code for name in program.KERNELS)
        spilled = [int(x) for x in re.findall(r"(\d+) bytes spill stores", log)]
        assert len(spilled) >= len(program.KERNELS), log
        assert max(spilled) <= most, log


def test_the_largest_kernels_have_every_observer_and_the_tangents_of_the_damper() -> None:
    assert GATE._replace(observers=(1 << len(SEEN)) - 1, tangents=5) == LARGEST
    assert asked_of(kernel_observers(resolve("symbol")), Sizes(2, 1, 1, 0)).kernels == GATE


def test_kernels_are_compiled_once_and_again_after_a_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("cuda.bindings.nvrtc", reason="cuda-bindings is not installed")
    asked: list[tuple[Kernels, str]] = []

    def compiled(kernels: Kernels, arch: str) -> tuple[bytes, str]:
        asked.append((kernels, arch))
        return arch.encode(), ""

    monkeypatch.setattr(program, "compile_kernels", compiled)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for arch in ("sm_75", "sm_90", "sm_75"):
        assert program.kept_kernels(GATE, arch) == arch.encode()
    assert len(asked) == 2
    monkeypatch.setattr(program, "_sources", lambda: "other headers")
    program.kept_kernels(GATE, "sm_75")
    assert len(asked) == 3
    assert len(list(tmp_path.rglob("*.cubin"))) == 3


def test_a_cache_that_cannot_be_written_is_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("cuda.bindings.nvrtc", reason="cuda-bindings is not installed")
    (tmp_path / "vibroimpact").write_text("a file, not a folder")
    monkeypatch.setattr(program, "compile_kernels", lambda *_: (b"code", ""))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert program.kept_kernels(GATE, "sm_90") == b"code"


def test_arguments_are_fields_of_eight_bytes() -> None:
    fields = batch_arrays()
    assert {fields[name].itemsize for name in fields.names or ()} == {8}
    assert (fields.names or ())[0] == "systems"
    assert (fields.names or ())[-1] == "kept"


# --- what goes wrong ------------------------------------------------------------------------------


class Driver:
    """Stands in for the driver of a machine."""

    def __init__(self, version: int, status: int) -> None:
        self.version, self.status = version, status

    def cuDriverGetVersion(self) -> tuple[int, int]:
        return 0, self.version

    def cuInit(self, flags: int) -> tuple[int]:  # noqa: ARG002
        return (self.status,)

    def cuGetErrorString(self, status: int) -> tuple[int, bytes]:  # noqa: ARG002
        return 0, b"no CUDA-capable device is detected"


def refused() -> str:
    """Message of a sweep on a device that is not there."""
    card.open_card.cache_clear()
    with pytest.raises(vi.BackendUnavailableError) as caught:
        vi.sweep(
            paper_damper("A", 1.2), over={"omega": [1.0]}, start=vi.State((0.0, 0.0), (0.0, 1.0)),
            backend="cuda", progress=False,
        )  # fmt: skip
    return str(caught.value)


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cuda.core", None)
    assert "pip install 'vibroimpact[cuda]'" in refused()


def test_without_a_driver_the_error_says_so() -> None:
    pytest.importorskip("cuda.core", reason="cuda-core is not installed")
    if device_here():
        pytest.skip("there is a device")
    assert re.search("no NVIDIA driver was found|no device can be used", message := refused())
    assert "backend='threads'" in message


@pytest.mark.parametrize(
    ("driver", "sentence"),
    [
        (Driver(12080, 0), "the driver supports CUDA 12.8, 13.0 is needed. Install a newer"),
        (Driver(13000, 100), "no device can be used: no CUDA-capable device is detected"),
    ],
)
def test_a_driver_that_cannot_serve_is_an_error(
    monkeypatch: pytest.MonkeyPatch, driver: Driver, sentence: str
) -> None:
    pytest.importorskip("cuda.core", reason="cuda-core is not installed")
    monkeypatch.setattr(card, "_driver", lambda: driver)
    assert sentence in refused()


# --- a device -------------------------------------------------------------------------------------


def device_here() -> str:
    """Name of the device; empty where there is none."""
    try:
        return card.open_card().name
    except vi.BackendUnavailableError:
        return ""


@pytest.mark.gpu
def test_a_device_has_the_bits_of_the_processor() -> None:
    if not device_here():
        pytest.skip("no CUDA device: the kernels ran on the processor only")
    asked: dict[str, Any] = {
        "over": {"omega": np.linspace(0.9, 1.1, 40), "half_clearance": np.linspace(1, 10, 40)},
        "start": vi.State((0.0, 0.0), (0.0, 1.0)),
        "observe": EVERYTHING,
        "settle": 20, "periods": 20, "progress": False,
    }  # fmt: skip
    found = vi.sweep(paper_damper("A", 1.2), **asked, backend="cuda")
    xr.testing.assert_identical(found, vi.sweep(paper_damper("A", 1.2), **asked))


# --- the benchmark --------------------------------------------------------------------------------


def test_the_benchmark_measures_equal_work(folder: Path) -> None:
    rng = np.random.default_rng(SEED)
    starts, device = random_starts(gpu.SET_A, 40, rng), HostDevice(folder)
    for name, values in gpu.ensembles(40, rng).items():
        found = gpu.measure(name, values, starts, 30, 1, device)
        assert min(found["device"], found["whole call"], found["one core"]) > 0.0


def test_the_peak_of_a_card_compiles() -> None:
    core = pytest.importorskip("cuda.core", reason="cuda-core is not installed")
    source = (Path(gpu.__file__).parent / "peak.cu").read_text()
    options = core.ProgramOptions(std="c++20", arch="sm_90")
    assert core.Program(source, "c++", options).compile("cubin").code


def test_the_benchmark_says_that_there_is_no_device() -> None:
    if device_here():
        pytest.skip("there is a device")
    with pytest.raises(vi.BackendUnavailableError, match="backend = 'cuda'"):
        gpu.main([])
