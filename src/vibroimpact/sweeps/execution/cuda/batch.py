"""Systems of one structure whose members run on a device.

Method      arrays go to the memory of the machine; one thread builds each mode of each system, one
            thread runs each member; tables of results come back. Members that need more than the
            free memory go in pieces.
Assumes     modal flows; dense ones stay on the processor
Accuracy    the bits of ``_kernel.Batch``
Fails       MISSING: a member that closes contacts without a mode; sweeps/execution/batch.py runs it again,
            on the processor
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.errors import VibroImpactError
from vibroimpact._core.types import Arrays
from vibroimpact.compile.tables import Tables
from vibroimpact.sweeps.execution.cuda.layout import Asked, Sizes, asked_of, batch_arrays
from vibroimpact.sweeps.execution.cuda.program import Kernels

FLOW = ("k", "c", "a")
MODE = (
    "rows", "gains", "lower", "upper",
    "to_x", "to_v", "offset", "from_x", "from_v", "particular",
)  # fmt: skip
MEMBER = ("position", "velocity", "phases", "settle", "observe")
# Entries of entry_sizes, in its order, and how many of each there are.
PER_SYSTEM, PER_MODE, PER_MAP, PER_WATCHED, PER_POINT, PER_KEPT, PER_STRUCT = range(7)
SHARE = 0.8  # of the free memory that is used


class Memory(Protocol):
    """Memory of a machine, all of it given back at the end."""

    def put(self, array: NDArray[Any]) -> int:
        """Address of a copy of an array."""

    def room(self, size: int) -> int:
        """Address of so many bytes, all zero."""

    def get(self, address: int, into: NDArray[Any]) -> None:
        """Copy from an address into an array."""

    def launch(self, kernels: Kernels, name: str, threads: int, argument: int) -> None:
        """Run so many threads of a kernel with an address, and wait for them."""


class Machine(Protocol):
    """What runs kernels."""

    def memory(self) -> AbstractContextManager[Memory]:
        """Memory for one piece of work; no other has the machine meanwhile."""

    def free(self) -> int:
        """Bytes of memory that are free."""


@dataclass(frozen=True, eq=False)
class DeviceBatch:
    """Stands in for ``_kernel.Batch``.

    Attributes
    ----------
    tables
        The systems.
    machine
        Where their members run.
    """

    tables: Tables = field(repr=False)
    machine: Machine

    @property
    def sizes(self) -> Sizes:
        """Coordinates, contacts, lines; whether flows are mixed."""
        return Sizes(*self.tables.sizes, int(self.tables.mixed))

    def run(
        self, *, system: NDArray[np.int32], observers: dict[str, Any], most_impacts: int,
        **members: NDArray[np.float64],
    ) -> Arrays:  # fmt: skip
        """Run members; arguments and results are those of ``_kernel.Batch.run``."""
        asked, count = asked_of(observers, self.sizes), len(system)
        out: Arrays = {name: np.empty((count, width)) for name, width in asked.widths.items()}
        out["end"] = np.empty(count, dtype=np.int8)
        entries = self._entry_sizes(asked)
        for rows in self._pieces(asked, entries, count):
            part = {name: x[rows] for name, x in members.items()}
            self._run_piece(asked, entries, system[rows], part, most_impacts,
                            {name: x[rows] for name, x in out.items()})  # fmt: skip
        return out

    def _entry_sizes(self, asked: Asked) -> list[int]:
        sizes = np.zeros(PER_STRUCT + 1, dtype=np.int64)
        with self.machine.memory() as memory:
            address = memory.room(sizes.nbytes)
            memory.launch(asked.kernels, "entry_sizes", 1, address)
            memory.get(address, sizes)
        if sizes[PER_STRUCT] != batch_arrays().itemsize:
            raise VibroImpactError(
                f"backend = 'cuda': kernels read {sizes[PER_STRUCT]} bytes of arguments, "
                f"{batch_arrays().itemsize} are written. Report this, with your compiler's version."
            )
        return [int(x) for x in sizes]

    def _pieces(self, asked: Asked, entries: list[int], count: int) -> Iterator[slice]:
        """Members that fit into the memory together, each with a system of its own."""
        arrays = (*self.tables.systems.values(), *(x for m in self.tables.modes for x in _of(m)))
        count_of_systems = len(self.tables.systems["steps"])
        size = sum(x.nbytes for x in arrays) // count_of_systems + sum(self._room(asked, entries))
        size += 8 * (sum(asked.widths.values()) + 2 * self.sizes.dimension + 4)
        step = int(SHARE * self.machine.free()) // size
        if step == 0:
            raise VibroImpactError(
                f"backend = 'cuda': one member needs {size} bytes of the device's memory, "
                f"{self.machine.free()} are free. Ask for fewer section points, or free memory."
            )
        for first in range(0, count, step):
            yield slice(first, min(first + step, count))

    def _room(self, asked: Asked, entries: list[int]) -> tuple[int, ...]:
        """Bytes of what is built for one system (first six) and for one member (last two)."""
        modes = len(self.tables.modes)
        watched = [modes * len(rows) * entries[PER_WATCHED] for rows in asked.rows.values()]
        return (
            entries[PER_SYSTEM], modes * entries[PER_MODE],
            modes * entries[PER_MAP], modes * entries[PER_MAP], *watched,
            int(asked.options["last"] + asked.options["strobe_last"]) * entries[PER_POINT],
            int(asked.options["longest"]) * entries[PER_KEPT],
        )  # fmt: skip

    def _run_piece(
        self, asked: Asked, entries: list[int], system: NDArray[np.int32], members: Arrays,
        most_impacts: int, out: Arrays,
    ) -> None:  # fmt: skip
        used, number = np.unique(system, return_inverse=True)
        counts = {"systems": len(used), "modes": len(self.tables.modes), "members": len(system),
                  **self.sizes._asdict()}  # fmt: skip
        arrays = self._arrays(used) | {"system": number.astype(np.int32)}
        arrays |= {f"{name}_rows": rows for name, rows in asked.rows.items()}
        arrays |= {name: members[name] for name in MEMBER}
        with self.machine.memory() as memory:
            results = {name: memory.room(x.nbytes) for name, x in out.items()}
            room = self._room(asked, entries)
            built = {
                name: memory.room(size * len(used if i < len(_BUILT) - 2 else system))
                for i, (name, size) in enumerate(zip(_BUILT, room, strict=True))
            }
            struct = np.zeros((), dtype=batch_arrays())
            addresses = {name: memory.put(x) for name, x in arrays.items()}
            fields = counts | asked.options | addresses | results | built
            for name, value in (fields | {"most_impacts": most_impacts}).items():
                struct[name] = value
            argument = memory.put(struct)
            memory.launch(asked.kernels, "build", counts["systems"] * counts["modes"], argument)
            memory.launch(asked.kernels, "run", counts["members"], argument)
            for name, x in out.items():
                memory.get(results[name], x)

    def _arrays(self, used: NDArray[np.int32]) -> Arrays:
        """Some of the systems, modes stacked on a leading axis."""
        modes = self.tables.modes
        arrays: Arrays = {name: x[used] for name, x in self.tables.systems.items()}
        arrays |= {name: np.stack([m["flow"][name][used] for m in modes]) for name in FLOW}
        arrays |= {name: np.stack([m[name][used] for m in modes]) for name in MODE}
        arrays["codes"] = np.array([m["code"] for m in modes], dtype=np.int32)
        arrays["side"] = np.array([m["side"] for m in modes], dtype=np.int32)
        return arrays


_BUILT = (
    "built_systems", "built_modes", "built_from_free", "built_to_free", "built_extremes",
    "built_averages", "points", "kept",
)  # fmt: skip


def _of(mode: dict[str, Any]) -> Iterator[NDArray[np.float64]]:
    """The arrays of a mode."""
    yield from (mode["flow"][name] for name in FLOW)
    yield from (mode[name] for name in MODE)
