"""Tiles on a CUDA device: systems compiled by threads of this process, members run by the card.

Members of systems whose flow is a full matrix, and those that close a set of contacts whose mode
their systems do not have yet, run on the processor: with the same bits.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from functools import partial

from vibroimpact.compile.tables import Runs, Stacks
from vibroimpact.sweeps.execution.compute import Done
from vibroimpact.sweeps.execution.cuda.batch import DeviceBatch, Machine
from vibroimpact.sweeps.execution.cuda.card import open_card
from vibroimpact.sweeps.execution.threads import compute_in_threads
from vibroimpact.sweeps.execution.tiles import Tile
from vibroimpact.sweeps.plan import Plan


def compute_tiles(
    plan: Plan,
    tiles: Sequence[Tile],
    workers: int | None,
    client: object = None,  # noqa: ARG001 - for clusters
) -> Generator[Done, None, None]:
    """Compute tiles; closing the generator waits for those that have begun."""
    yield from compute_in_threads(plan, tiles, workers, partial(runs_on, open_card()))


def runs_on(machine: Machine, stacks: Stacks) -> Runs:
    """What runs members of these systems: the machine, or the processor for dense flows."""
    return stacks.kernel() if stacks.dense else DeviceBatch(stacks.tables(), machine)
