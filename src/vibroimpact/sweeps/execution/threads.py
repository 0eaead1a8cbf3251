"""Tiles on the threads of this process: the kernel lets go of the interpreter while it runs."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice

from vibroimpact import _kernel
from vibroimpact._core.types import Arrays
from vibroimpact.sweeps.execution.compute import Done
from vibroimpact.sweeps.execution.groups import grouped
from vibroimpact.sweeps.execution.tiles import Tile
from vibroimpact.sweeps.plan import Plan

TILES_PER_THREAD = 2  # so many tiles are begun or wait: results that nobody has taken yet are few
LOOK_SECONDS = 0.5  # it is looked so often for a Ctrl-C that did not wake the main thread


def compute_tiles(
    plan: Plan,
    tiles: Sequence[Tile],
    workers: int | None,
    client: object = None,  # noqa: ARG001 - for clusters
) -> Generator[Done, None, None]:
    """Compute tiles; closing the generator ends those that have begun, and drops them."""
    threads, stop = workers or cores(), _kernel.StopSign()
    pool = ThreadPoolExecutor(threads, "vibroimpact", _kernel.obey, (stop,))
    todo = grouped(plan, tiles)
    running: dict[Future[Arrays], Tile] = {}
    try:
        while True:
            for tile, group in islice(todo, TILES_PER_THREAD * threads - len(running)):
                running[pool.submit(group.compute, tile, stop.is_set)] = tile
            if not running:
                return
            for future in wait(running, LOOK_SECONDS, FIRST_COMPLETED).done:
                yield running.pop(future), future.result()
    finally:
        stop.set()
        _end(pool, running)


def _end(pool: ThreadPoolExecutor, running: Iterable[Future[Arrays]]) -> None:
    """Wait for what ends soon, deaf to Ctrl-C: a join that is interrupted forgets its thread."""
    while True:
        try:
            pool.shutdown(wait=False, cancel_futures=True)
            wait([future for future in running if not future.cancelled()])
            return pool.shutdown()
        except KeyboardInterrupt:
            continue


def cores() -> int:
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # macOS
        return os.cpu_count() or 1
