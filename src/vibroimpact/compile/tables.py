"""Compiled systems as arguments of the kernel's ``Batch``.

Method      Systems of one structure share most of their numbers. Shared numbers are kept once,
            those that vary as columns, and the kernel takes them in this form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel
from vibroimpact._core.columns import Column
from vibroimpact._core.types import Floats, Rows
from vibroimpact.compile.hybrid import Hybrid
from vibroimpact.compile.modes import ElementOfKernel, Mode
from vibroimpact.compile.pace import paced_parts, paces_of
from vibroimpact.compile.piecewise import Piecewise

WATCHED = ("watch_element", "watch_held", "watch_reset", "watch_target")


class Stack(NamedTuple):
    """One array of every system: the shared numbers, and those that vary."""

    shared: Floats  # the array of one system; its entries that vary are ignored
    # for entries that vary: the number of the column, by place in the flat array
    columns: dict[int, int]

    def of(self, columns: Floats) -> Floats:
        """Array of every system, on a leading axis."""
        count = columns.shape[1]
        out = np.repeat(self.shared.reshape(1, -1), count, axis=0)
        for i, column in self.columns.items():
            out[:, i] = columns[column]
        return out.reshape(count, *self.shared.shape)


@dataclass(frozen=True, eq=False)
class Stacks:
    """Systems of one structure as they are compiled."""

    # properties that all systems share; elements as `_kernel.Batch` takes them
    dense: bool
    mixed: bool
    piecewise: bool
    sequential: bool
    given: bool
    degrees: int
    elements: list[ElementOfKernel]
    systems: dict[str, Stack]  # stacks, by name of the argument of `_kernel.Batch`
    modes: list[dict[str, Any]]  # stacks, by name of the argument of its `add_mode`
    # how fast motions of a system meet its stops (pace.py): `parts`, and `own`, its fastest rate, which serves up
    # to `most`
    pace: dict[str, Stack]
    columns: Floats  # the numbers that vary, shape (V, S)

    @cached_property
    def _paced(self) -> tuple[Floats, Floats, Floats]:
        """Parts, own rate and most pace of every system, or of one, where they are shared."""
        every = (self.pace["parts"], self.pace["own"], self.pace["most"])
        some = self.columns if any(x.columns for x in every) else self.columns[:, :1]
        if not some.size:
            some = np.empty((0, 1))
        parts, own, most = (x.of(some) for x in every)
        return parts, own, most

    def paces(self, system: Rows, position: Floats, velocity: Floats, run: Floats) -> Floats:
        """Pace of each member's run of some length from its start; zero where own rates serve, shape (N,)."""
        parts, own, most = self._paced
        which = system if len(parts) > 1 else np.zeros_like(system)
        return paces_of(parts, own, most, which, position, velocity, run, elements=self.piecewise)

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Coordinates, rigid contacts and forcing lines."""
        systems = self.systems
        return self.degrees, len(systems["restitution"].shared), systems["omegas"].shared.size

    @property
    def structure(self) -> tuple[object, ...]:
        """Properties that systems of one kernel batch have in common."""
        laws = self.sequential, tuple(self.elements)
        kinds = self.dense, self.mixed, self.piecewise, self.sizes, laws
        modes = (
            (mode["code"], *(tuple(mode["piecewise"].get(name, ())) for name in WATCHED))
            for mode in self.modes
        )
        return *kinds, tuple(modes)

    @property
    def omegas(self) -> Floats:
        """Frequencies of the forcing lines, shape (S, L)."""
        return self.systems["omegas"].of(self.columns)

    def kernel(self) -> _kernel.Batch:
        """Kernel batch of the systems."""
        batch = _kernel.Batch(
            dense=self.dense, mixed=self.mixed, degrees=self.degrees, columns=self.columns,
            piecewise=self.piecewise, sequential=self.sequential, elements=[*self.elements], given=self.given,
            **kernel_arguments(self.systems),
        )  # fmt: skip
        for mode in self.modes:
            batch.add_mode(**kernel_arguments(mode))
        return batch


def kernel_arguments(part: dict[str, Any]) -> dict[str, Any]:
    """Arguments of the kernel for stacks: the arrays of one system, and ``varied``."""
    flat = part | part.get("flow", {}) | part.get("piecewise", {})
    varied = {name: x.columns for name, x in flat.items() if isinstance(x, Stack) and x.columns}
    return _mapped(lambda stack: stack.shared, part) | {"varied": varied}


def _mapped(function: Callable[..., Any], *parts: dict[str, Any]) -> dict[str, Any]:
    """Apply a function to the stacks of dictionaries with the same names."""
    out = dict[str, Any]()
    for name, x in parts[0].items():
        same = [part[name] for part in parts]
        inside = _mapped(function, *same) if isinstance(x, dict) else x
        out[name] = function(*same) if isinstance(x, Stack) else inside
    return out


def stacks_of(
    hybrid: Hybrid | Piecewise,
    grid: tuple[int, ...],
    codes: Sequence[int] = (),
    columns: list[Floats] | None = None,
) -> Stacks:
    """Stacks of compiled systems.

    Parameters
    ----------
    hybrid
        Compiled with columns, or with floats: all systems are equal.
    grid
        Sizes of the grid of the systems that it represents.
    codes
        Modes needed in addition to those that every system begins with.
    columns
        Where the numbers that vary are appended as they are; a list of their own by default.

    Raises
    ------
    InvalidParameterError
        A mode is needed whose contact forces are not determined.
    """
    m, laws, stack = hybrid.mechanism, hybrid.laws(), _Stacker(columns)
    contacts, lines, size = len(m.rigid_stops), len(m.forces), hybrid.size
    systems = {
        "omegas": stack(hybrid.omegas, lines),
        "kappas": stack(hybrid.kappas, lines),
        "steps": stack(hybrid.step),
        "impulse": stack([law.impulse for law in laws], contacts, size),
        "mobility": stack([law.mobilities for law in laws], contacts, contacts),
        "shift": stack([law.shift for law in laws], contacts, size),
        "restitution": stack(
            [(law.restitution_lower, law.restitution_upper) for law in laws], contacts, 2
        ),
        "damping": stack(m.damping, m.degrees, m.degrees),
        "reset_shift": stack([jump.shift for jump in hybrid.resets], len(hybrid.resets), size),
        "reset_matrix": stack(
            [jump.matrix for jump in hybrid.resets], len(hybrid.resets), size, size
        ),
    }
    parts = paced_parts(m)
    pace = {
        "parts": stack(parts, len(parts), m.degrees + 5),
        "own": stack(hybrid.own),
        "most": stack(hybrid.most_pace),
    }
    modes = [_mode(hybrid.mode(code), hybrid, stack) for code in (*hybrid.codes, *codes)]
    table = stack.table(grid)
    return Stacks(
        hybrid.dense, hybrid.mixed, isinstance(hybrid, Piecewise), m.impact_law == "sequential",
        hybrid.given, m.degrees, hybrid.elements, systems, modes, pace, table,
    )  # fmt: skip


def _mode(mode: Mode, hybrid: Hybrid | Piecewise, stack: _Stacker) -> dict[str, Any]:
    c, n, size = mode.coordinates, hybrid.mechanism.degrees, hybrid.size
    contacts, lines = len(mode.guards), len(hybrid.omegas)
    guards = mode.guards
    square, row = (size, size), (size,)
    shapes = {"b": square, "constant": row, "norm": square, "growth": (1,)} if hybrid.dense else {}
    flow = {k: stack(x, *shapes.get(k, (size // 2,))) for k, x in c.flow.items() if k != "step"}
    return {
        "code": mode.code,
        "flow": flow,
        "rows": stack([guard.row for guard in guards], contacts, size),
        "gains": stack([guard.gain for guard in guards], contacts),
        "lower": stack([guard.lower for guard in guards], contacts),
        "upper": stack([guard.upper for guard in guards], contacts),
        "side": [guard.side for guard in guards],
        "to_x": stack(c.to_x, n, size),
        "to_v": stack(c.to_v, n, size),
        "offset": stack(c.offset, n),
        "from_x": stack(c.from_x, size, n),
        "from_v": stack(c.from_v, size, n),
        "particular": stack(c.particular, size, 2 * lines),
        "piecewise": _watched(mode, size, stack) if isinstance(hybrid, Piecewise) else {},
    }


def _watched(mode: Mode, size: int, stack: _Stacker) -> dict[str, Any]:
    """Arrays that modes with elements have besides: their step, a shift, watches, rows for observers."""
    watches, count, elements = mode.watches, len(mode.watches), len(mode.work)
    return {
        "mode_step": stack(cast(list[float], mode.coordinates.flow["step"]), 1),
        "map_shift": stack(mode.coordinates.shift, size),
        "watch_rows": stack([watch.row for watch in watches], count, size),
        "watch_gains": stack([watch.gain for watch in watches], count),
        "watch_lower": stack([watch.lower for watch in watches], count),
        "watch_upper": stack([watch.upper for watch in watches], count),
        "watch_element": [watch.element for watch in watches],
        "watch_held": [int(watch.held) for watch in watches],
        "watch_reset": [watch.reset for watch in watches],
        "watch_target": [watch.target for watch in watches],
        "element_rows": stack(chain.from_iterable(mode.work), 2 * elements, size + 1),
    }


class _Stacker:
    """Builder of stacks, which collects the columns."""

    def __init__(self, columns: list[Floats] | None = None) -> None:
        self.columns = list[Floats]() if columns is None else columns

    def __call__(self, entries: Any, *shape: int) -> Stack:
        """Nested entries, floats or columns, as an array of this shape for each system."""
        flat = list(entries) if shape else [entries]
        for _ in shape[1:]:
            flat = list(chain.from_iterable(flat))
        columns = dict[int, int]()
        for i, x in enumerate(flat):
            if isinstance(x, Column):
                columns[i], flat[i] = len(self.columns), 0.0
                self.columns.append(x.values)
        return Stack(np.array(flat, dtype=float).reshape(shape), columns)

    def table(self, grid: tuple[int, ...]) -> Floats:
        """The columns of all systems of a grid, shape (V, S)."""
        out = np.empty((len(self.columns), *grid))
        for i, column in enumerate(self.columns):
            out[i] = column
        return out.reshape(len(out), math.prod(grid))


def joined(parts: Sequence[Stacks], order: NDArray[np.intp]) -> Stacks:
    """Concatenate systems of one structure, then put them in order."""
    first, columns = parts[0], list[Floats]()

    def stack(*same: Stack) -> Stack:
        arrays = [x.of(part.columns) for x, part in zip(same, parts, strict=True)]
        rows = np.concatenate(arrays).reshape(len(order), -1)[order]
        bits = rows.view(np.int64)
        varied = np.flatnonzero((bits != bits[0]).any(axis=0)).tolist()
        numbers = {i: len(columns) + k for k, i in enumerate(varied)}
        columns.extend(rows.T[varied])
        return Stack(rows[0].reshape(same[0].shared.shape), numbers)

    systems = _mapped(stack, *(part.systems for part in parts))
    modes = [_mapped(stack, *same) for same in zip(*(part.modes for part in parts), strict=True)]
    pace = _mapped(stack, *(part.pace for part in parts))
    table = np.array(columns).reshape(len(columns), len(order))
    return replace(first, systems=systems, modes=modes, pace=pace, columns=table)
