"""Backends, which compute tiles: one file each.

A backend is a module with

    compute_tiles(plan, tiles, workers, client) -> generator of (tile, arrays), in any order

that computes ahead of whoever takes the results only by a few tiles, and ends its work when the
generator is closed. To add one, add its file and its name here.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from importlib import import_module
from typing import Any

from vibroimpact._core.checks import check_choice
from vibroimpact.sweeps.execution.compute import Done
from vibroimpact.sweeps.execution.tiles import Tile
from vibroimpact.sweeps.plan import Plan

ComputeTiles = Callable[[Plan, Sequence[Tile], int | None, Any], Generator[Done, None, None]]

BACKENDS = {
    "threads": "vibroimpact.sweeps.execution.threads",
    "dask": "vibroimpact.sweeps.execution.dask",
}


def backend_of(name: str) -> ComputeTiles:
    """The backend of that name; what it needs is imported only now.

    Raises
    ------
    InvalidParameterError
        No such backend, or what it needs is not installed.
    """
    check_choice("backend", name, BACKENDS)
    compute_tiles: ComputeTiles = import_module(BACKENDS[name]).compute_tiles
    return compute_tiles
