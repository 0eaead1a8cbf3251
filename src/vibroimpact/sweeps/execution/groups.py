"""Groups of tiles whose systems are compiled together.

Method      Compiling costs a millisecond or two however few systems there are, and little more for
            thousands. The systems of tiles that follow each other are therefore compiled together
            by the thread that first wants one of them, and every tile runs in what that makes.
Assumes     A group holds at most GROUP_BYTES of compiled systems, or one tile: a grid may be bigger
            than memory, and its tiles any of it.
Accuracy    Results do not depend on groups: a system has the same bits in any.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise, starmap
from threading import Lock

import numpy as np

from vibroimpact._core.types import Arrays
from vibroimpact.compile.many_systems import Compilation, Values, compile_together
from vibroimpact.sweeps.execution.batch import batch_from
from vibroimpact.sweeps.execution.compute import columns_of, compute_with
from vibroimpact.sweeps.execution.tiles import Tile, compiled_bytes
from vibroimpact.sweeps.plan import Plan

GROUP_BYTES = 2**26


class Group:
    """Tiles that follow each other; some may differ in their starts only and share systems."""

    def __init__(self, plan: Plan, tiles: Sequence[Tile]) -> None:
        self._plan, self._lock = plan, Lock()
        self._compiled: Compilation | None = None
        self._tiles = {_systems_of(plan, tile): tile for tile in tiles}
        ends = np.cumsum([0, *(_count(plan, tile) for tile in self._tiles.values())]).tolist()
        self._places = dict(zip(self._tiles, starmap(slice, pairwise(ends)), strict=True))

    def compute(self, tile: Tile, stopped: Callable[[], bool]) -> Arrays:
        """Run every member of a tile, or as many as there is time for (compute.py)."""
        place = self._places[_systems_of(self._plan, tile)]
        batch = batch_from(self._compilation(), place)
        return compute_with(self._plan.block(tile.place), batch, stopped)

    def _compilation(self) -> Compilation:
        """The systems of all tiles, compiled by the thread that comes first."""
        with self._lock:
            if self._compiled is None:
                self._compiled = compile_together(self._plan.system, self._values())
            return self._compiled

    def _values(self) -> Values:
        parts = [columns_of(self._plan.block(tile.place)) for tile in self._tiles.values()]
        return {name: np.concatenate([part[name] for part in parts]) for name in self._plan.axes}


def grouped(plan: Plan, tiles: Iterable[Tile]) -> Iterator[tuple[Tile, Group]]:
    """Tiles in their order, with their groups."""
    most = GROUP_BYTES // compiled_bytes(plan.mechanism)
    for together in _cut(plan, tiles, most):
        group = Group(plan, together)
        yield from ((tile, group) for tile in together)


def _cut(plan: Plan, tiles: Iterable[Tile], most: int) -> Iterator[list[Tile]]:
    """Stretches of tiles that have at most so many systems, or one tile's."""
    together, systems = list[Tile](), 0
    for tile in tiles:
        known = bool(together) and _systems_of(plan, together[-1]) == _systems_of(plan, tile)
        if together and not known and systems + _count(plan, tile) > most:
            yield together
            together, systems = [], 0
        together.append(tile)
        systems += 0 if known else _count(plan, tile)
    if together:
        yield together


def _systems_of(plan: Plan, tile: Tile) -> tuple[int, ...]:
    """Key of the systems of a tile: its place in the grid of tiles without the starts."""
    return tile.chunk[: len(plan.axes)]


def _count(plan: Plan, tile: Tile) -> int:
    """Number of systems of a tile."""
    return math.prod(part.stop - part.start for part in tile.place[: len(plan.axes)])
