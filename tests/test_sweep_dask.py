"""Sweeps on Dask clusters: the bits of threads, whatever happens to the workers."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.ensembles.backends.dask import result_of

distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))
OVER = {"omega": np.linspace(1.0, 1.2, 8), "half_clearance": np.linspace(2.0, 5.0, 6)}


def swept(**options):
    asked = {
        "over": OVER, "start": PLAIN, "observe": ("symbol", "final"), "settle": 20, "periods": 10,
        "progress": False,
    }  # fmt: skip
    return vi.sweep(paper_damper("A", 1.2), **(asked | options))


@pytest.fixture(scope="module")
def cluster():
    """Two workers, each a process."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_a_cluster_of_this_process_gives_the_bits_of_threads():
    xr.testing.assert_identical(swept(backend="dask", workers=2, tile=5), swept())


def test_workers_give_the_bits_of_threads(cluster):
    found = swept(backend="dask", client=cluster, tile=5)
    xr.testing.assert_identical(found, swept())


def test_the_cluster_in_use_is_found_and_fills_a_store(cluster, tmp_path: Path):  # noqa: ARG001
    options = {"start": vi.RandomStarts(3, 7, {"v1": (-1.0, 1.0)}, PLAIN), "follow": "-omega"}
    found = swept(backend="dask", tile=16, store=tmp_path / "sweep.zarr", **options)
    xr.testing.assert_identical(found.load(), swept(**options))


def test_a_system_that_is_code_goes_to_the_workers(cluster):
    def build(gap):
        return paper_damper("A", 1.2, half_clearance=2.0 * gap).mechanism

    options = {"over": {"gap": [1.0, 2.0]}, "start": PLAIN, "observe": "final", "progress": False}
    there = vi.sweep(vi.Family(build, gap=1.0), backend="dask", client=cluster, **options)
    xr.testing.assert_identical(there, vi.sweep(vi.Family(build, gap=1.0), **options))


def test_a_worker_that_dies_loses_nothing(cluster):
    workers = list(cluster.run(os.getpid).values())
    told: list[int] = []

    def kill(done: int, _: int) -> None:
        if not told:
            os.kill(workers[0], signal.SIGKILL)
        told.append(done)

    found = swept(backend="dask", client=cluster, tile=2, progress=kill)
    assert told[-1] == 48
    xr.testing.assert_identical(found, swept())
    assert workers[0] not in cluster.run(os.getpid).values()


def test_an_error_on_a_worker_is_that_of_the_sweep(cluster):
    def build(gap):
        restitution = 1.5 if gap == 4.5 else 0.8
        return paper_damper("A", 1.2, half_clearance=gap, restitution=restitution).mechanism

    asked = {"over": {"gap": [4.0, 4.5, 5.0]}, "start": PLAIN, "progress": False}
    for options in ({}, {"backend": "dask", "client": cluster}):
        with pytest.raises(vi.InvalidParameterError, match=r"restitution = 1.5.*gap = 4.5"):
            vi.sweep(vi.Family(build, gap=4.0), **asked, **options)


def test_a_tile_that_takes_workers_down_again_and_again_is_an_error():
    class Task:
        def result(self):
            raise distributed.KilledWorker("tile", None, 3)

    with pytest.raises(vi.VibroImpactError, match="workers died under the same tile"):
        result_of(distributed, Task())


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(vi.BackendUnavailableError, match=r"vibroimpact\[cluster\]"):
        swept(backend="dask")
