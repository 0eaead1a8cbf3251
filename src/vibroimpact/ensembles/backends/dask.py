"""Tiles as tasks of a Dask cluster, of one machine or of many.

Method      a tile goes to a worker with the numbers it needs, and its results come back to this
            process, which alone writes; a few tiles per worker thread are under way at a time.
            What a worker that died had begun is done again by another.
Fails       a tile under which workers die again and again ends the sweep
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any

from vibroimpact import _kernel
from vibroimpact.ensembles.backends.threads import cores
from vibroimpact.ensembles.batch import Arrays
from vibroimpact.ensembles.compute import Done, compute
from vibroimpact.ensembles.plan import Plan
from vibroimpact.ensembles.tiles import Tile
from vibroimpact.errors import BackendUnavailableError, VibroImpactError

AHEAD = 3  # tiles per worker thread that are under way: a worker never waits for this process
RETRIES = 3  # of a tile whose task failed


def compute_tiles(
    plan: Plan, tiles: Sequence[Tile], workers: int | None, client: Any = None
) -> Generator[Done, None, None]:
    """Compute tiles; closing the generator cancels what is under way.

    Parameters
    ----------
    client
        Of the cluster; None for the one that is in use, or a cluster of ``workers`` threads of
        this process where there is none.
    """
    distributed = _distributed()
    todo = iter(tiles)
    under_way: dict[str, Tile] = {}
    with _connected(distributed, client, workers) as cluster:
        done = distributed.as_completed(loop=cluster.loop)
        try:
            while True:
                room = AHEAD * max(sum(cluster.nthreads().values()), 1) - len(under_way)
                for tile in islice(todo, max(room, 0)):
                    task = _submitted(cluster, plan.block(tile.place))
                    under_way[task.key] = tile
                    done.add(task)
                if not under_way:
                    return
                task = next(done)
                yield under_way.pop(task.key), result_of(distributed, task)
        finally:
            cluster.cancel(list(done.futures))


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
    if client is None:
        try:
            client = distributed.get_client()
        except ValueError:
            with (
                distributed.LocalCluster(
                    n_workers=1,
                    threads_per_worker=workers or cores(),
                    processes=False,  # threads are as fast: the kernel lets go of the interpreter
                    dashboard_address=None,
                ) as cluster,
                distributed.Client(cluster, set_as_default=False) as own,
            ):
                yield own
            return
    yield client


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


def result_of(distributed: Any, task: Any) -> Arrays:
    """The results of a task that is done, or its error."""
    try:
        arrays: Arrays = task.result()
    except distributed.KilledWorker as error:
        raise VibroImpactError(
            f"backend = 'dask': {error.allowed_failures + 1} workers died under the same tile. "
            "If they lacked memory, give fewer members per tile."
        ) from error
    return arrays
