"""Tiles: blocks of the grid, the unit of work, of storing and of loss.

Method      the sizes of a tile are filled from the last dimension to the first, so that a tile is a
            contiguous stretch of the grid, cut to a box; a followed dimension is never cut   (1)
            a tile has as many members as fit into TILE_SECONDS, not so many that there are fewer
            than ENOUGH_TILES tiles unless they had fewer than FEWEST_MEMBERS members, and along a followed
            axis so many side by side that a step takes CALL_SECONDS; all within TILE_BYTES   (2)
Accuracy    results do not depend on tiles: a member has the same bits in any
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.plan import Place

TILE_SECONDS = 1.0
SECONDS_PER_PERIOD = 1e-7  # a member takes so long: two impacts, some 50 ns each
TILE_BYTES = 2**28
ENOUGH_TILES = 64  # with so many the threads of one machine end at about the same time
CALL_SECONDS = 1e-3  # what a call of the kernel costs beside its members
FEWEST_MEMBERS = 1024  # what a call costs beside so many members is little


class Tile(NamedTuple):
    """A block of the grid."""

    chunk: tuple[int, ...]  # its place in the grid of tiles
    place: Place  # one slice per dimension of the grid

    @property
    def size(self) -> int:
        """Number of members."""
        return math.prod(part.stop - part.start for part in self.place)


def members_per_tile(size: int, cycles: float, member_bytes: int, along: int = 1) -> int:
    """Members of a tile by rule (2).

    Parameters
    ----------
    size
        Members of the whole grid.
    cycles
        Forcing periods of one member.
    member_bytes
        Size of its results and of its compiled system.
    along
        Length of the followed axis.
    """
    seconds = SECONDS_PER_PERIOD * max(cycles, 1.0)
    by_count = max(math.ceil(size / ENOUGH_TILES), FEWEST_MEMBERS)
    side_by_side = math.ceil(CALL_SECONDS / seconds)
    members = max(min(TILE_SECONDS / seconds, by_count), along * side_by_side)
    return max(1, int(min(members, TILE_BYTES // max(member_bytes, 1))))


def compiled_bytes(mechanism: Mechanism) -> int:
    """Rough size of a compiled system: twice the tables of its modes, which is more than it needs.

    What systems share is there once (tables.py).
    """
    n, lines, contacts = mechanism.degrees, len(mechanism.forces), len(mechanism.rigid_stops)
    size = 2 * (n + lines)
    states = math.prod(len(e.states) for e in mechanism.switching)
    modes = states * (3**contacts if contacts <= 2 else 1)  # others come when they are wanted
    numbers = modes * size * (contacts + 4 * n + 2 * lines + size) + contacts * (
        2 * size + contacts
    )
    return 2 * 8 * numbers


def tile_shape(shape: tuple[int, ...], members: int, followed: int | None) -> tuple[int, ...]:
    """Sizes of a tile of about so many members by rule (1)."""
    sizes = [1] * len(shape)
    if followed is not None:
        sizes[followed] = shape[followed]
        members = max(members // shape[followed], 1)
    for i in reversed(range(len(shape))):
        if i != followed:
            sizes[i] = min(shape[i], members)
            members = max(members // sizes[i], 1)
    return tuple(sizes)


def tiles_of(shape: tuple[int, ...], sizes: tuple[int, ...]) -> Iterator[Tile]:
    """All tiles, the last dimension fastest."""
    counts = [math.ceil(n / size) for n, size in zip(shape, sizes, strict=True)]
    for index in itertools.product(*map(range, counts)):
        yield Tile(
            index,
            tuple(
                slice(i * size, min((i + 1) * size, n))
                for i, size, n in zip(index, sizes, shape, strict=True)
            ),
        )
