"""Every writer is killed at random times: what is there is the old content or the new one, never a third.

A quick sample is in tests/core/test_files.py.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

# A process that has made all contents forks writers, kills each after a random time, and looks at what is there.
PREPARED = """
import functools, os, random, signal, sys, time, warnings
from pathlib import Path
import numpy as np
import matplotlib
matplotlib.use("agg")
import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.plotting import style
from vibroimpact.cli.output import Done, write

forced = os.fsync


def slow(handle):
    '''A slow disk: most kills come while something is written.'''
    forced(handle)
    time.sleep(0.03)


os.fsync = slow
folder, kills = Path(sys.argv[1]), int(sys.argv[2])
draws = random.Random(kills)
damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2)
start = vi.State((0.0, 0.0), (0.0, 1.0))


def killed(work, longest):
    '''Kill a child that works on and on; the work gets its number of the turn.'''
    child = os.fork()
    if not child:
        try:
            turn = 0
            while True:
                work(turn)
                turn += 1
        finally:
            os._exit(1)
    time.sleep(draws.uniform(0.0, longest))
    os.kill(child, signal.SIGKILL)
    assert os.waitpid(child, 0)[1] == signal.SIGKILL, "a writer failed"
"""

FILES = """
runs = [vi.simulate(damper, start, impacts=n) for n in (30, 60)]
swept = [vi.sweep(damper, over={"omega": np.linspace(1.0, 1.2, n)}, start=start, settle_periods=5, periods=5,
                  progress=False) for n in (2, 3)]
drawn = [plotting.plot_history(run) for run in runs]
style.content_of_picture = functools.cache(style.content_of_picture)  # what takes time is to write
pages = [f"<html>{'x' * 100_000 * (k + 1)}</html>" for k in (0, 1)]
writers = {
    "run.nc": lambda path, k: vi.save(runs[k], path),
    "table.csv": lambda path, k: runs[k].to_csv(path),
    "table.xlsx": lambda path, k: vi.save(runs[k], path),
    "sweep.nc": lambda path, k: vi.save(swept[k], path),
    "sweep.csv": lambda path, k: vi.save(swept[k], path),
    "a.png": lambda path, k: plotting.save(drawn[k], path),
    "a.svg": lambda path, k: plotting.save(drawn[k], path),
    "a.pdf": lambda path, k: plotting.save(drawn[k], path),
    "page.html": lambda path, k: write([path], Done((), (), None, lambda: pages[k])),
}
whole = {}
for name, writer in writers.items():
    for k in (0, 1):
        writer(folder / name, k)
        whole[name, k] = (folder / name).read_bytes()
    assert whole[name, 0] != whole[name, 1], name
seen, left = {}, set()
for number in range(kills):
    order = draws.sample(sorted(writers), len(writers))
    killed(lambda turn: [writers[name](folder / name, turn % 2) for name in order], 0.15)
    for name in writers:
        found = (folder / name).read_bytes()
        which = [k for k in (0, 1) if found == whole[name, k]]
        assert which, (number, name, len(found))
        seen[name, which[0]] = seen.get((name, which[0]), 0) + 1
    left |= {*os.listdir(folder)} - {*writers}
for name, writer in writers.items():
    writer(folder / name, 0)
assert sorted(os.listdir(folder)) == sorted(writers), os.listdir(folder)
print(f"{kills} kills, {len(writers)} writers, {len(left)} drafts were left and removed")
"""

STORES = """
import shutil
options = dict(over={"omega": np.linspace(1.0, 1.2, 6)}, start=start, settle_periods=20, periods=20, tile=2,
               progress=False, workers=1)
expected = vi.sweep(damper, **options)
made = folder / "sweep.zarr"
objective = vi.Objective("omega", (0.9, 1.1), "x1", points=3, starts=1, settle_periods=10, periods=5)


def search(store):
    return vi.optimise(damper, {"half_clearance": (2.0, 30.0)}, objective, budget=32, progress=False, store=store,
                       workers=1)


best = search(None)
for number in range(kills):
    shutil.rmtree(made, ignore_errors=True)
    killed(lambda turn: vi.sweep(damper, store=made if not turn else folder / f"{turn}.zarr", **options), 0.15)
    assert vi.sweep(damper, store=made, **options).load().identical(expected), number
    for other in folder.glob("*.zarr"):
        shutil.rmtree(other)
    (folder / "search.nc").unlink(missing_ok=True)
    killed(lambda turn: search(folder / "search.nc"), 0.4)
    again = search(folder / "search.nc")
    assert (again.value, again.parameters) == (best.value, best.parameters), number
assert {one for one in os.listdir(folder) if "search" in one} == {"search.nc"}
assert not [one for one in os.listdir(folder) if one.endswith("lock")], os.listdir(folder)
print(f"{kills} kills of a sweep and of a search; each went on to the same end")
"""


def ends_well(work: str, kills: int, folder: Path) -> None:
    words = [sys.executable, "-W", "ignore", "-c", PREPARED + work, str(folder), str(kills)]
    ended = subprocess.run(words, capture_output=True, text=True, check=False, timeout=1800)
    assert ended.returncode == 0, ended.stderr
    assert f"{kills} kills" in ended.stdout


@pytest.mark.slow
def test_many_killed_writers_leave_the_old_or_the_new_content(tmp_path: Path) -> None:
    ends_well(FILES, 50, tmp_path)


@pytest.mark.slow
def test_killed_sweeps_and_searches_go_on_to_the_same_end(tmp_path: Path) -> None:
    pytest.importorskip("zarr", reason="the extra `store` is not installed")
    ends_well(STORES, 3, tmp_path)
