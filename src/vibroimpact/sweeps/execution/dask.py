"""Tiles as tasks of a Dask cluster, of one machine or of many.

Method      a tile goes to a worker with the numbers it needs, and its results come back to this
            process, which alone writes; a few tiles per worker thread are under way at a time.
            What a worker that died had begun is done again by another. Where there is no worker,
            the sweep waits for one, and says so.
Fails       a tile under which workers die again and again ends the sweep, and so does a scheduler
            that is lost or a client that is closed
"""

from __future__ import annotations

import asyncio
import time
import warnings
from collections.abc import Coroutine, Generator, Iterator, Sequence
from concurrent.futures import wait
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

AHEAD = 3  # tiles per worker thread that are under way: a worker never waits for this process
RETRIES = 3  # of a tile whose task failed
LOOK = 1.0  # seconds between two looks at the cluster while no tile comes
PATIENCE = 60.0  # seconds without a worker after which the user is told

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
        done, watch = distributed.as_completed(loop=cluster.loop), Watch(cluster)
        try:
            while True:
                room = AHEAD * max(watch.threads(), 1) - len(under_way)
                for tile in islice(todo, max(room, 0)):
                    task = _submitted(cluster, plan.block(tile.place))
                    under_way[task] = tile
                    done.add(task)
                if not under_way:
                    return
                yield watch.result(_next_of(done, under_way))
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
    return cluster.submit(_task, block, _kernel.version(), pure=False, retries=RETRIES)


def _task(block: Plan, version: str) -> Arrays:
    """Compute a tile on a worker."""
    if _kernel.version() != version:
        raise VibroImpactError(
            f"backend = 'dask': a worker has version {_kernel.version()} of vibroimpact, "
            f"{version} is wanted. Install the same one everywhere."
        )
    return compute(block)


async def _next_of(done: Any, under_way: dict[Any, Tile]) -> Done:
    """The next tile that is done, with its results; runs in the thread of the client."""
    task = await anext(done)
    arrays = await task
    return under_way.pop(task), arrays


class Watch:
    """Waits for results, and looks whether the cluster is there."""

    def __init__(self, cluster: Any) -> None:
        self.cluster, self.seen, self.told = cluster, time.monotonic(), False

    def result(self, coroutine: Coroutine[Any, Any, Done]) -> Done:
        """What a coroutine of the client's thread returns."""
        result = asyncio.run_coroutine_threadsafe(coroutine, self.cluster.loop.asyncio_loop)
        while not wait([result], LOOK).done:
            self.threads()
        return result.result()

    def threads(self) -> int:
        """Threads of all workers; the user is told, once, when there are none for long."""
        if self.cluster.status != "running":
            raise ClusterLostError(LOST)
        threads: int = sum(self.cluster.nthreads().values())
        if threads:
            self.seen = time.monotonic()
        elif not self.told and time.monotonic() - self.seen > PATIENCE:
            self._tell()
        return threads

    def _tell(self) -> None:
        self.told = True
        warnings.warn(
            f"backend = 'dask': at {time.strftime('%H:%M')} the cluster has had no worker for "
            f"{PATIENCE:g} s. The sweep waits, and goes on by itself when workers come. "
            "Ctrl-C ends it and says what is kept.",
            stacklevel=2,
        )


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
