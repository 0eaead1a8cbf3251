"""Sweeps on Dask clusters: the bits of threads, whatever happens to the cluster."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import traceback
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.sweeps.execution import dask as backend

dask = pytest.importorskip("dask", reason="the extra `cluster` is not installed")
distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))
OVER = {"omega": np.linspace(1.0, 1.2, 8), "half_clearance": np.linspace(2.0, 5.0, 6)}


def swept(**options):
    asked = {
        "over": OVER, "start": PLAIN, "observe": ("symbol", "final"), "settle_periods": 20, "periods": 10,
        "progress": False,
    }  # fmt: skip
    return vi.sweep(paper_damper("A", 1.2), **(asked | options))


@pytest.fixture(scope="module")
def cluster():
    """Two workers, each a process."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_a_cluster_of_this_process_gives_the_bits_of_threads():
    xr.testing.assert_identical(swept(backend="dask", workers=2, tile=5), swept())


def test_a_cluster_of_this_process_stands_beside_another_without_a_warning():
    with socket.socket() as taken, suppress(OSError):
        taken.bind(("", 8787))  # where Dask's schedulers show themselves, unless told otherwise
        taken.listen()
        swept(backend="dask", workers=1)


def test_workers_give_the_bits_of_threads(cluster):
    found = swept(backend="dask", client=cluster, tile=5)
    xr.testing.assert_identical(found, swept())


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_worker_that_dies_loses_nothing(cluster):
    workers = list(cluster.run(os.getpid).values())
    told: list[int] = []

    def kill(report: vi.ProgressReport) -> None:
        if not told:
            os.kill(workers[0], signal.SIGKILL)
        told.append(report.done)

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


def test_a_tile_that_takes_workers_down_again_and_again_is_an_error(cluster):
    with (
        pytest.raises(vi.VibroImpactError, match="4 workers died under the same tile"),
        backend.explained(distributed, cluster),
    ):
        raise distributed.KilledWorker("tile", None, 3)


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(vi.BackendUnavailableError, match=r"vibroimpact\[cluster\]"):
        swept(backend="dask")


# ---- a cluster that is lost ----------------------------------------------------------------------


@pytest.fixture
def lone():
    """One worker, all in this process; the test may lose any part of it."""
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),  # to what is lost, at the end
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0"
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client
    client._loop_runner.stop()  # a client that its cluster closed leaves its thread running


def after(members, act):
    """Act once, when so many members are done."""
    return lambda report: act() if report.done == members else None


class Leaving(distributed.SchedulerPlugin):
    """Notices when the last worker has left the scheduler."""

    def __init__(self):
        self.left = threading.Event()

    def remove_worker(self, scheduler, **_):
        if not scheduler.workers:
            self.left.set()


def without_workers(client):
    """Take the worker away."""
    leaving = Leaving()
    client.cluster.scheduler.add_plugin(leaving, name="leaving")
    client.cluster.scale(0)
    assert leaving.left.wait(60.0)


def assert_resumes(store: Path, done: int):
    """The same call computes what is missing, and only that; with the store the bits are equal."""
    totals: list[int] = []
    found = swept(store=store, progress=lambda report: totals.append(report.total))
    assert totals[0] == 48 - done
    xr.testing.assert_identical(found.load(), swept())


LOST = "the connection to the cluster was lost"
LOSSES = {
    "the cluster closes": (lambda client: client.cluster.close(), LOST),
    "the scheduler closes": (lambda client: client.sync(client.cluster.scheduler.close), LOST),
    "the client closes": (lambda client: client.close(), LOST),
    "the cluster restarts": (
        lambda client: client.restart(wait_for_workers=False),
        "the cluster has cancelled the tasks",
    ),
}


@pytest.mark.parametrize(("lose", "message"), LOSSES.values(), ids=LOSSES)
@pytest.mark.slow
def test_a_cluster_that_is_lost_ends_the_sweep_and_the_store_resumes(
    lone, lose, message, tmp_path: Path
):
    store = tmp_path / "sweep.zarr"
    kept = f"{message}; 4 of 24 tiles are in .*: the same call goes on there"
    with pytest.raises(vi.VibroImpactError, match=kept) as caught:
        swept(
            backend="dask", client=lone, tile=2, store=store, progress=after(8, lambda: lose(lone))
        )
    assert "cancel-keys" not in "".join(traceback.format_exception(caught.value))
    assert_resumes(store, 8)


def test_a_client_that_is_closed_is_refused(lone):
    lone.close()
    with pytest.raises(vi.InvalidParameterError, match=r"client = .*: must be .* connected"):
        swept(backend="dask", client=lone)


def test_an_address_stands_for_the_client_of_its_scheduler(cluster):
    address = cluster.scheduler_info()["address"]
    xr.testing.assert_identical(swept(backend="dask", client=address, tile=9), swept())
    assert cluster.status == "running"


def test_an_address_at_which_no_scheduler_answers_is_refused():
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        pytest.raises(vi.InvalidParameterError, match="no scheduler answers there"),
    ):
        swept(backend="dask", client="tcp://127.0.0.1:1")


def test_what_a_lost_cluster_raises_is_said_in_a_sentence_and_other_errors_stay(lone):
    with pytest.raises(ZeroDivisionError), backend.explained(distributed, lone):
        _ = 1 / 0
    with pytest.raises(vi.VibroImpactError, match=LOST), backend.explained(distributed, lone):
        raise distributed.comm.CommClosedError  # before the client itself notices
    lone.close()
    with pytest.raises(vi.VibroImpactError, match=LOST), backend.explained(distributed, lone):
        lone.nthreads()


def test_a_client_that_looks_for_its_scheduler_is_not_waited_for():
    searching = SimpleNamespace(status="connecting")  # nothing else of it is touched
    with pytest.raises(vi.VibroImpactError, match=LOST):
        backend.completed(distributed, searching, [])


def test_a_result_whose_worker_is_gone_is_not_waited_for_once_the_cluster_is_lost():
    cluster = SimpleNamespace(status="running")

    def result(_timeout):
        cluster.status = "closed"
        raise distributed.TimeoutError

    with pytest.raises(vi.VibroImpactError, match=LOST):
        backend.result_of(distributed, cluster, SimpleNamespace(status="finished", result=result))


def test_a_task_that_has_raised_a_timeout_says_so_and_is_not_waited_for():
    def result(_timeout=None):
        raise distributed.TimeoutError("of the task")

    task = SimpleNamespace(status="error", result=result)
    with pytest.raises(distributed.TimeoutError, match="of the task"):
        backend.result_of(distributed, SimpleNamespace(status="running"), task)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(backend, "LOOK_SECONDS", 0.01)


def swept_until_no_worker(client, then, **options):
    """A sweep whose worker is taken away when 8 members, 4 tiles, are done; then it waits.

    It waits for a tile, or for the result of one that was done when the worker went.
    """

    def watched(call):
        def waiting(*given):
            if not client.nthreads():
                patch.undo()
                threading.Thread(target=then).start()
            return call(*given)

        return waiting

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(distributed, "wait", watched(distributed.wait))
        patch.setattr(distributed.Future, "result", watched(distributed.Future.result))
        act = after(8, lambda: without_workers(client))
        return swept(backend="dask", client=client, tile=2, progress=act, **options)


@pytest.mark.slow
def test_a_sweep_without_workers_goes_on_with_the_next(lone, tmp_path: Path):
    found = swept_until_no_worker(
        lone, lambda: lone.cluster.scale(1), store=tmp_path / "sweep.zarr"
    )
    xr.testing.assert_identical(found.load(), swept())


@pytest.mark.usefixtures("impatient")
def test_a_cluster_that_is_lost_while_the_sweep_waits_ends_it(lone):
    with pytest.raises(vi.VibroImpactError, match=f"{LOST}; nothing is kept. With a store"):
        swept_until_no_worker(lone, lone.close)


@pytest.fixture
def heard():
    """Listen to Ctrl-C, which a process that was started in the background does not."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard")
@pytest.mark.slow
def test_ctrl_c_ends_a_sweep_that_waits_for_workers_and_the_store_resumes(lone, tmp_path: Path):
    store = tmp_path / "sweep.zarr"
    with pytest.raises(KeyboardInterrupt, match="interrupted; 4 of 24 tiles are in"):
        swept_until_no_worker(lone, lambda: os.kill(os.getpid(), signal.SIGINT), store=store)
    assert_resumes(store, 8)
