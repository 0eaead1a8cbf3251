"""Stores of sweeps: killed, interrupted, on a full disc, asked something else; nothing is lost."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.sweeps.observers.table import OBSERVERS
from vibroimpact.sweeps.schema import END

pytest.importorskip("zarr", reason="the extra `store` is not installed")

DAMPER = paper_damper("A", 1.2)
PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))
OVER = {"omega": np.linspace(1.0, 1.2, 4), "half_clearance": np.linspace(2.0, 5.0, 6)}
ASKED = {
    "over": OVER, "start": PLAIN, "observe": ("symbol", "final"), "settle_periods": 20, "periods": 10,
    "progress": False,
}  # fmt: skip
TILES = 8  # of three members

# A child that asks the same question; %s stands for what happens to it.
CHILD = """
import os, signal, resource, sys, threading
import numpy as np
import vibroimpact as vi
%s
vi.sweep(
    vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
                    half_clearance=5.0, omega=1.2),
    over={"omega": np.linspace(1.0, 1.2, 4), "half_clearance": np.linspace(2.0, 5.0, 6)},
    start=vi.State((0.0, 0.0), (0.0, 1.0)), observe=("symbol", "final"), settle_periods=20, periods=10,
    tile=3, store=sys.argv[1], progress=%s,
)
"""


def swept(store: Path | None = None, **options):
    return vi.sweep(DAMPER, **(ASKED | options), store=store)


def child(store: Path, before: str = "", progress: str = "False"):
    return ran(CHILD % (textwrap.dedent(before), progress), str(store))


def ran(script: str, *arguments: str, patience: float | None = None):
    """A script in another process, which hears Ctrl-C."""
    return subprocess.run(
        [sys.executable, "-c", script, *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=patience,
        # background jobs ignore it
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def tiles_in(store: Path) -> int:
    chunks = store / END / "c"
    return sum(1 for chunk in chunks.rglob("*") if chunk.is_file()) if chunks.exists() else 0


def assert_resumes(store: Path, tiles: int = TILES, **options) -> None:
    """What is there is kept, the rest is computed, and all has the bits of an undisturbed sweep."""
    chunks = {f: f.stat().st_mtime_ns for f in (store / END / "c").rglob("*") if f.is_file()}
    told: list[tuple[int, int]] = []
    found = swept(
        store, progress=lambda report: told.append((report.done, report.total)), **options
    )
    missing = 24 - 24 // tiles * len(chunks)
    assert told[-1:] == ([(missing, missing)] if missing else [])
    assert all(f.stat().st_mtime_ns == t for f, t in chunks.items())
    xr.testing.assert_identical(found.load(), swept(**options))
    assert not list(store.rglob("*.partial"))


# --- the store ------------------------------------------------------------------------------------


def test_a_store_holds_the_dataset_of_the_memory_and_is_read_when_used(tmp_path: Path):
    found = swept(tmp_path / "sweep.zarr", tile=3)
    assert not any(found[name].variable._in_memory for name in found)
    xr.testing.assert_identical(found.load(), swept())
    by_itself = xr.open_zarr(tmp_path / "sweep.zarr", consolidated=False)
    del by_itself.attrs["digest"]
    xr.testing.assert_identical(by_itself[list(found)].load(), found)


def test_every_observer_is_stored_and_goes_to_netcdf(tmp_path: Path):
    found = swept(tmp_path / "sweep.zarr", observe=tuple(OBSERVERS)).load()
    xr.testing.assert_identical(found, swept(observe=tuple(OBSERVERS)))
    found.to_netcdf(tmp_path / "sweep.nc", engine="h5netcdf")
    again = xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf")
    xr.testing.assert_identical(again[list(found)], found)


def test_a_store_that_is_complete_is_read_only_again(tmp_path: Path):
    swept(tmp_path / "sweep.zarr", tile=3)
    assert_resumes(tmp_path / "sweep.zarr")


def test_starts_and_followed_axes_are_stored(tmp_path: Path):
    starts = vi.GridStarts({"v1": [-1.0, 0.5], "x2": [-7.0, 0.0, 3.0]}, PLAIN)
    options = {"start": starts, "follow": "-omega", "observe": "section"}
    found = swept(tmp_path / "sweep.zarr", tile=5, **options)
    xr.testing.assert_identical(found.load(), swept(**options))


def test_a_store_knows_its_listed_starts(tmp_path: Path):
    starts, others = (vi.ListedStarts([[0.0, 0.0], [0.0, x]], np.ones((2, 2))) for x in (1.0, 1.5))
    store = tmp_path / "sweep.zarr"
    found = swept(store, start=starts)
    xr.testing.assert_identical(found.load(), swept(start=starts))
    with pytest.raises(vi.InvalidParameterError, match=r"start\.sha256"):
        swept(store, start=others)
    xr.testing.assert_identical(swept(store, start=starts).load(), found)


# --- after an end ---------------------------------------------------------------------------------


@pytest.mark.parametrize("moment", [9, 60])
def test_a_killed_sweep_resumes_with_equal_bits(tmp_path: Path, moment: int):
    # Every chunk and its folder are forced to the disc: the process is killed in the middle of the
    # first tile, and some tiles later.
    store = tmp_path / "sweep.zarr"
    killed = child(
        store,
        f"""
        calls, to_disc = [], os.fsync
        def fsync(handle):
            calls.append(handle)
            if len(calls) == {moment}:
                os.kill(os.getpid(), signal.SIGKILL)
            to_disc(handle)
        os.fsync = fsync
        """,
    )
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert (store / "time").exists()
    assert tiles_in(store) < TILES
    assert_resumes(store)


class Killed(BaseException):
    """The end of a process, as far as the disc can tell."""


@pytest.mark.slow
def test_a_sweep_that_ends_at_any_write_resumes_with_equal_bits(tmp_path: Path, monkeypatch):
    calls, to_disc = [0], os.fsync

    def fsync(handle: int) -> None:
        calls[0] -= 1
        if calls[0] == 0:
            raise Killed
        to_disc(handle)

    monkeypatch.setattr(os, "fsync", fsync)
    moments = 2 * 2 * len(swept(observe="power").data_vars)  # two tiles; a file and its folder
    for moment in range(1, moments + 1):
        calls[0] = moment
        store = tmp_path / f"{moment}.zarr"
        with pytest.raises(Killed):
            swept(store, tile=12, observe="power")
        assert_resumes(store, tiles=2, observe="power")
    calls[0] = moments + 1
    swept(tmp_path / "all.zarr", tile=12, observe="power")


def test_a_chunk_that_lost_its_bytes_with_the_power_is_computed_again(tmp_path: Path):
    store = tmp_path / "sweep.zarr"
    swept(store, tile=4)  # the second chunk of a row is cut by the edge of the grid
    for name in (END, "time"):
        (store / name / "c" / "0" / "1").write_bytes(b"")
    (store / "time" / "c" / "0" / "1.0123.partial").write_bytes(b"half of")
    found = swept(store)
    xr.testing.assert_identical(found.load(), swept())
    assert not list(store.rglob("*.partial"))


def test_an_interrupted_sweep_says_how_to_go_on_and_does(tmp_path: Path):
    store = tmp_path / "sweep.zarr"
    stopped = child(
        store,
        """
        def interrupt(report):
            if report.done == 6:
                os.kill(os.getpid(), signal.SIGINT)
        """,
        progress="interrupt",
    )
    assert stopped.returncode == -signal.SIGINT
    last = stopped.stderr.strip().splitlines()[-1]
    assert "KeyboardInterrupt: sweep: interrupted; 2 of 8 tiles are in" in last
    assert "the same call goes on" in last
    assert_resumes(store)


def assert_interrupted(script: str, patience: float) -> None:
    """A script that interrupts itself ends so, within some seconds."""
    stopped = ran(script, patience=patience)
    assert stopped.returncode == -signal.SIGINT, stopped.stderr
    words = r"^KeyboardInterrupt: \w+: interrupted; nothing is kept"
    assert re.search(words, stopped.stderr, re.MULTILINE), stopped.stderr


# What follows begins to interrupt once members run.
BEGUN = """
import signal, threading
import numpy as np
import vibroimpact as vi
from vibroimpact.sweeps.execution import compute, threads

damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
                         half_clearance=5.0, omega=1.2)
begun, run_members = threading.Event(), compute.run_members

def seen(*arguments):
    begun.set()
    return run_members(*arguments)

compute.run_members = seen
"""

# A followed motion of half a minute, or tiles of a second; Ctrl-C as the sweep begins to wait for
# members, and again as it begins to wait for their end.
IMPATIENT = f"""{BEGUN}
interrupts, wait = [signal.SIGINT] * 2, threads.wait

def impatient(*running, **how):
    begun.wait()
    if interrupts:
        signal.raise_signal(interrupts.pop())
    return wait(*running, **how)

threads.wait = impatient
try:
    vi.sweep(damper, over={{"omega": np.linspace(1.0, 1.2, %d)}}, settle_periods=2000, periods=10,
             start=vi.State((0.0, 0.0), (0.0, 1.0)), tile=50_000, follow=%r, progress=False)
finally:
    assert not interrupts
    assert threading.active_count() == 1
"""


@pytest.mark.parametrize(("values", "follow"), [(100_000, "omega"), (1_000_000, None)])
def test_a_second_interruption_is_no_worse_than_the_first(values: int, follow: str | None):
    assert_interrupted(IMPATIENT % (values, follow), patience=20)


ENDLESS = f"""{BEGUN}
stiff = vi.Mechanism(
    mass=[[1, 0], [0, 1]], damping=[[5e3, 1], [1, 0.1]], stiffness=[[1e8, 1], [1, 1]],
    forces=[vi.Harmonic(1.2, (0, 1))],
    elements=[vi.RigidStop((0, 1), lower=-5e-6 * k) for k in range(1, 6)],
)

def interrupt():
    begun.wait()
    signal.pthread_kill(threading.get_ident(), signal.SIGINT)  # the main thread sleeps on

threading.Thread(target=interrupt).start()
vi.sweep(%s, over={{"omega": [1.0, 1.2]}}, start=vi.State((0.0, 0.0), (0.0, 1.0)), observe=%r,
         settle_periods=%g, periods=1e9, most_impacts=10**12, progress=False)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("system", "observe", "settle"),
    [
        ("damper", "impacts", 1.0),
        ("damper", "impacts", 1e9),
        ("damper", "lyapunov", 1.0),
        ("damper", "rms", 1.0),
        ("stiff", "impacts", 1.0),
        ("stiff", "extremes", 1.0),
    ],
)
def test_an_interruption_ends_the_members_under_way(system: str, observe: str, settle: float):
    """They would run for hours."""
    assert_interrupted(ENDLESS % (system, observe, settle), patience=60)


def test_an_interruption_without_a_store_says_that_nothing_is_kept():
    def interrupt(_: vi.ProgressReport) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="nothing is kept"):
        swept(progress=interrupt)


def test_a_failing_disc_ends_with_a_clear_error_and_a_store_that_resumes(tmp_path: Path):
    # No file may grow beyond 40 bytes once two tiles are done: the next chunk cannot be written.
    store = tmp_path / "sweep.zarr"
    failed = child(
        store,
        """
        def limit(report):
            if report.done == 6:
                resource.setrlimit(resource.RLIMIT_FSIZE, (40, resource.RLIM_INFINITY))
        """,
        progress="limit",
    )
    assert failed.returncode == 1
    last = failed.stderr.strip().splitlines()[-1]
    assert last.startswith("vibroimpact._core.errors.StoreError: store = ")
    assert "cannot be written (File too large)" in last
    assert tiles_in(store) == 2
    assert_resumes(store)


@pytest.fixture
def small_disc(tmp_path: Path):
    """A file system of 256 kB."""
    disc = tmp_path / "disc"
    disc.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disc)]
    if shutil.which("mount") is None or subprocess.run(mount, check=False).returncode:
        pytest.skip("a small file system cannot be mounted here: that needs root on Linux")
    yield disc
    subprocess.run(["umount", str(disc)], check=True)


def test_a_full_disc_ends_with_a_clear_error_and_a_store_that_resumes(small_disc: Path):
    ballast = small_disc / "ballast"
    store = small_disc / "sweep.zarr"

    def fill(report: vi.ProgressReport) -> None:
        if report.done == 6:
            with ballast.open("wb", buffering=0) as file:
                try:
                    while file.write(b"\0" * 4096):
                        pass
                except OSError:
                    return

    with pytest.raises(vi.StoreError, match=r"No space left on device.*the same call goes on"):
        swept(store, tile=3, progress=fill)
    assert tiles_in(store) == 2
    ballast.unlink()
    assert_resumes(store)


def test_a_store_that_cannot_be_made_leaves_nothing_behind(small_disc: Path):
    (small_disc / "ballast").write_bytes(b"\0" * 4096 * 62)
    with pytest.raises(vi.StoreError, match="cannot be made"):
        swept(small_disc / "sweep.zarr")
    assert [path.name for path in small_disc.iterdir()] == ["ballast"]


# --- another sweep --------------------------------------------------------------------------------

OTHER = {
    "an axis": (
        {"over": OVER | {"omega": [1.0, 1.1, 1.15, 1.2]}},
        r"omega\[1\] = 1.1, not 1.066666",
    ),
    "a longer axis": (
        {"over": OVER | {"omega": np.linspace(1.0, 1.2, 5)}},
        r"Requested is omega = 5 values from 1.0 to 1.2, not 4 values from 1.0 to 1.2\. Name",
    ),
    "other parameters": (
        {"over": {"omega": OVER["omega"], "force": [1.0, 2.0]}},
        r"axes\[1\] = 'force', not 'half_clearance'",
    ),
    "the start": (
        {"start": vi.State((0.0, 0.0), (0.0, 2.0))},
        r"start.base.velocity\[1\] = 2.0, not 1.0",
    ),
    "the observers": ({"observe": "final"}, r"observe\[0\].observer = 'final', not 'symbol'"),
    "the window": ({"settle_periods": 21}, "window.settle_periods = 21.0, not 20.0"),
    "the cap": ({"most_impacts": 9999}, "window.most_impacts = 9999, not"),
    "following": ({"follow": "omega"}, "follow = 'omega', not None"),
}


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with all its tiles."""
    store = tmp_path_factory.mktemp("complete") / "sweep.zarr"
    swept(store, tile=3)
    return store


@pytest.mark.parametrize(("options", "said"), OTHER.values(), ids=OTHER)
def test_a_store_of_another_sweep_is_refused_with_what_differs(complete, options, said):
    with pytest.raises(vi.InvalidParameterError, match=said):
        swept(complete, **options)


def test_a_store_that_was_refused_is_as_it_was(complete):
    with pytest.raises(vi.InvalidParameterError):
        swept(complete, settle_periods=21)
    assert_resumes(complete)


def test_a_store_of_another_system_is_refused_with_its_parameter(complete):
    other = paper_damper("A", 1.2, zeta=0.05)
    with pytest.raises(vi.InvalidParameterError, match=r"system.zeta = 0.05, not 0.045"):
        vi.sweep(other, store=complete, **ASKED)


def test_a_family_whose_code_changed_is_another_system(tmp_path: Path):
    def family(factor):
        def build(gap):
            return paper_damper("A", 1.2, half_clearance=factor * gap).mechanism

        return vi.Family(build, gap=5.0)

    asked = ASKED | {"over": {"gap": [4.0, 5.0]}, "store": tmp_path / "sweep.zarr"}
    vi.sweep(family(1.0), **asked)
    vi.sweep(family(1.0), **asked)
    with pytest.raises(vi.InvalidParameterError, match=r"mechanism.first.elements"):
        vi.sweep(family(1.1), **asked)


# --- other misuse ---------------------------------------------------------------------------------


def test_what_is_no_store_is_refused_and_left_alone(tmp_path: Path):
    folder, file = tmp_path / "folder", tmp_path / "file"
    folder.mkdir()
    (folder / "thesis.tex").write_text("years")
    file.write_text("years")
    for path in (folder, file):
        with pytest.raises(vi.InvalidParameterError, match="is no store of a sweep"):
            swept(path)
    assert (folder / "thesis.tex").read_text() == file.read_text() == "years"


def test_a_tilde_is_the_home_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    vi.sweep(DAMPER, **ASKED, store="~/plane.zarr")
    assert (tmp_path / "plane.zarr" / END).is_dir()


def flipped(store: Path, draws: np.random.Generator) -> tuple[Path, bytes]:
    """A file of a store in which a random byte is changed, and what was in it."""
    names = sorted(path for path in store.rglob("*") if path.is_file())
    path = names[draws.integers(len(names))]
    whole = path.read_bytes()
    at = int(draws.integers(len(whole)))
    path.write_bytes(
        whole[:at] + bytes([whole[at] ^ int(draws.integers(1, 256))]) + whole[at + 1 :]
    )
    return path, whole


@pytest.mark.parametrize(("flips", "seed"), [(6, 1), pytest.param(60, 2, marks=pytest.mark.slow)])
@pytest.mark.filterwarnings("ignore:store = .*a tile is damaged")
@pytest.mark.filterwarnings("ignore:Object at .* is not recognized as a component")
def test_a_changed_byte_in_a_store_is_noticed_and_changes_no_number(
    flips: int, seed: int, tmp_path: Path
) -> None:
    store, draws = tmp_path / "plane.zarr", np.random.default_rng(seed)
    asked = {"over": {"half_clearance": [4.0, 5.0, 6.0]}, "tile": 2, "periods": 1}
    whole = swept(store, **asked).load()
    for _ in range(flips):
        path, before = flipped(store, draws)
        try:
            xr.testing.assert_identical(swept(store, **asked).load(), whole)
        except (vi.InvalidParameterError, vi.StoreError):
            path.write_bytes(before)
        if path.name == "zarr.json":
            path.write_bytes(before)


def test_a_damaged_tile_is_computed_again_with_a_warning(tmp_path: Path):
    path = tmp_path / "plane.zarr"
    whole = swept(path, tile=4).load()  # 4 and 2 of 6 in a row
    chunk = path / "final_phase" / "c" / "3" / "1"
    chunk.write_bytes(b"damaged")
    with pytest.warns(UserWarning, match="a tile is damaged .* and is computed again"):
        xr.testing.assert_identical(swept(path).load(), whole)


def test_a_store_in_no_folder_is_refused(tmp_path: Path):
    with pytest.raises(vi.InvalidParameterError, match="must be a folder"):
        swept(tmp_path / "nowhere" / "sweep.zarr")


def test_other_tiles_than_those_of_the_store_are_refused(complete):
    with pytest.raises(vi.InvalidParameterError, match=r"has tiles of \(1, 3\), not \(1, 2\)"):
        swept(complete, tile=2)


def test_a_store_has_one_writer(complete):
    handle = os.open(complete, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        with pytest.raises(vi.InvalidParameterError, match="another process is writing"):
            swept(complete)
    finally:
        os.close(handle)


def test_without_zarr_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(vi.BackendUnavailableError, match=r"vibroimpact\[store\]"):
        swept(tmp_path / "sweep.zarr")
