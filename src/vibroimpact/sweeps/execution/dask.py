"""Tiles as tasks of a Dask cluster, of one machine or of many.

Method      a tile goes to a worker with the numbers it needs, and its results come back to this
            process, which alone writes; a few tiles per worker thread are under way at a time.
            What a worker that died had begun is done again by another. Where there is no worker,
            the sweep waits for one.
Fails       a tile under which workers die again and again ends the sweep, and so does a scheduler
            that is lost or a client that is closed
"""

from __future__ import annotations

import asyncio
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import islice
from typing import Any

from vibroimpact import _kernel
from vibroimpact._core.checks import refusal
from vibroimpact._core.errors import (
    BackendUnavailableError,
    ClusterLostError,
    InvalidParameterError,
    VibroImpactError,
)
from vibroimpact._core.types import Arrays
from vibroimpact.sweeps.execution.compute import Done, compute
from vibroimpact.sweeps.execution.threads import cores
from vibroimpact.sweeps.execution.tiles import Tile
from vibroimpact.sweeps.plan import Plan

# So many tiles per worker thread are under way: a worker never waits for this process.
TILES_PER_THREAD = 3
TASK_RETRIES = 3  # a tile whose task failed is tried again so often
LOOK_SECONDS = 1.0  # the cluster is looked at so often while no tile comes

LOST = "backend = 'dask': the connection to the cluster was lost"
CANCELLED = "backend = 'dask': the cluster has cancelled the tasks"


def compute_tiles(
    plan: Plan, tiles: Sequence[Tile], workers: int | None, client: Any = None
) -> Generator[Done, None, None]:
    """Compute tiles; closing the generator cancels what is under way.

    Parameters
    ----------
    client
        Of the cluster, or the address of its scheduler; None for the one that is in use, or a
        cluster of ``workers`` threads of this process where there is none.
    """
    distributed = _distributed()
    todo = iter(tiles)
    under_way: dict[Any, Tile] = {}
    with _connected(distributed, client, workers) as cluster, explained(distributed, cluster):
        try:
            while True:
                room = TILES_PER_THREAD * max(sum(cluster.nthreads().values()), 1) - len(under_way)
                for tile in islice(todo, max(room, 0)):
                    under_way[_submitted(cluster, plan.block(tile.place))] = tile
                if not under_way:
                    return
                for task in completed(distributed, cluster, list(under_way)):
                    yield under_way.pop(task), result_of(distributed, cluster, task)
        finally:
            with suppress(Exception):  # of a cluster that is lost nothing is left to cancel
                cluster.cancel(list(under_way))


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise BackendUnavailableError(
            "backend = 'dask': needs Dask, which is not installed. "
            "Run: pip install 'vibroimpact[cluster]'."
        ) from None
    return distributed


@contextmanager
def _connected(distributed: Any, client: Any, workers: int | None) -> Iterator[Any]:
    """The client given, the one in use, or one of a cluster made for this sweep."""
    if isinstance(client, str):
        with _client_at(distributed, client) as own:
            yield own
        return
    if client is None:
        try:
            client = distributed.get_client()
        except ValueError:
            with (
                distributed.LocalCluster(
                    n_workers=1,
                    threads_per_worker=workers or cores(),
                    processes=False,  # threads are as fast: the kernel lets go of the interpreter
                    dashboard_address="127.0.0.1:0",  # None is port 8787, which may be taken
                    scheduler_kwargs={"dashboard": False},
                ) as cluster,
                distributed.Client(cluster, set_as_default=False) as own,
            ):
                yield own
            return
    if getattr(client, "status", None) != "running":
        raise refusal("client", client, "a distributed.Client that is connected, or an address")
    yield client


def _client_at(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InvalidParameterError(
            f"client = {address!r}: no scheduler answers there ({error}). Start one, or correct "
            "the address, such as tcp://node:8786."
        ) from error


def _submitted(cluster: Any, block: Plan) -> Any:
    return cluster.submit(_task, block, _kernel.version(), pure=False, retries=TASK_RETRIES)


def _task(block: Plan, version: str) -> Arrays:
    """Compute a tile on a worker."""
    if _kernel.version() != version:
        raise VibroImpactError(
            f"backend = 'dask': a worker has version {_kernel.version()} of vibroimpact, "
            f"{version} is wanted. Install the same one everywhere."
        )
    return compute(block)


def completed(distributed: Any, cluster: Any, tasks: list[Any]) -> Iterable[Any]:
    """Wait for the first tasks that are done; a cluster that is lost is not waited for."""
    while cluster.status == "running":
        with cluster.as_current(), suppress(distributed.TimeoutError):
            done: set[Any] = distributed.wait(tasks, LOOK_SECONDS, "FIRST_COMPLETED").done
            return done
    raise ClusterLostError(LOST)


def result_of(distributed: Any, cluster: Any, task: Any) -> Any:
    """Result of a task that is done; its worker may be gone, and the cluster lost, before it is here."""
    while cluster.status == "running":
        if task.status == "error":
            return task.result()  # raises what the task has raised, a TimeoutError too
        with suppress(distributed.TimeoutError):
            return task.result(LOOK_SECONDS)
    raise ClusterLostError(LOST)


@contextmanager
def explained(distributed: Any, cluster: Any) -> Iterator[None]:
    """Say in a sentence what became of the cluster."""
    try:
        yield
    except VibroImpactError:
        raise
    except distributed.KilledWorker as error:
        raise VibroImpactError(
            f"backend = 'dask': {error.allowed_failures + 1} workers died under the same tile. "
            "If they lacked memory, give fewer members per tile."
        ) from error
    except (distributed.CancelledError, asyncio.CancelledError) as error:
        raise ClusterLostError(CANCELLED if cluster.status == "running" else LOST) from error
    except distributed.comm.CommClosedError as error:  # the client may notice only later
        raise ClusterLostError(LOST) from error
    except Exception as error:
        if cluster.status == "running":
            raise
        raise ClusterLostError(LOST) from error
