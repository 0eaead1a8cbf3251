"""Compiled systems as the arrays that the kernel's ``Batch`` takes: leading axis, the systems."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel
from vibroimpact.columns import Column
from vibroimpact.hybrid import Hybrid, Mode, closed_from_code

Floats = NDArray[np.float64]


class Runs(Protocol):
    """What runs members of systems of one structure: ``_kernel.Batch``, or its like elsewhere."""

    def run(self, *args: Any, **kwargs: Any) -> dict[str, NDArray[Any]]:
        """Arguments and results are those of ``_kernel.Batch.run``."""


@dataclass(frozen=True)
class Tables:
    """Systems of one structure: arguments of ``_kernel.Batch`` and of its ``add_mode``.

    Attributes
    ----------
    dense, degrees
        What all systems share.
    systems
        Arrays with one entry per system; shapes as ``_kernel.Batch`` says.
    modes
        One dictionary per mode, arrays likewise.
    """

    dense: bool
    degrees: int
    systems: dict[str, Floats]
    modes: list[dict[str, Any]]

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Coordinates, contacts and forcing lines."""
        lines = self.systems["omegas"].shape[1]
        return self.degrees, self.systems["restitution"].shape[1], lines

    @property
    def structure(self) -> tuple[object, ...]:
        """What systems of one kernel batch have in common."""
        return self.dense, self.sizes, tuple(mode["code"] for mode in self.modes)

    def kernel(self) -> _kernel.Batch:
        """Hand them to the kernel."""
        batch = _kernel.Batch(dense=self.dense, degrees=self.degrees, **self.systems)
        for mode in self.modes:
            batch.add_mode(**mode)
        return batch


class Stack(NamedTuple):
    """One array of every system: what all share, and which numbers vary.

    Attributes
    ----------
    shape
        Of one system.
    row
        Its numbers, shape (1, k); zeros stand for those that vary.
    columns
        Of these by place in the row: the number of the column.
    """

    shape: tuple[int, ...]
    row: Floats
    columns: dict[int, int]


@dataclass(frozen=True)
class Stacks:
    """Systems of one structure as they are compiled: :class:`Tables` with stacks for arrays.

    Attributes
    ----------
    dense, degrees, systems, modes
        As there.
    columns
        The numbers that vary, shape (V, S).
    """

    dense: bool
    degrees: int
    systems: dict[str, Stack]
    modes: list[dict[str, Any]]
    columns: Floats

    def tables(self, place: slice) -> Tables:
        """Arrays of some of the systems, one after the other."""
        modes = [self._arrays(mode, place) for mode in self.modes]
        return Tables(self.dense, self.degrees, self._arrays(self.systems, place), modes)

    def _arrays(self, part: dict[str, Any], place: slice) -> dict[str, Any]:
        """The same with arrays for stacks."""
        return {
            name: self._array(x, place) if isinstance(x, Stack)
            else self._arrays(x, place) if isinstance(x, dict) else x
            for name, x in part.items()
        }  # fmt: skip

    def _array(self, stack: Stack, place: slice) -> Floats:
        count = place.stop - place.start
        out = np.repeat(stack.row, count, axis=0)
        for i, column in stack.columns.items():
            out[:, i] = self.columns[column, place]
        return out.reshape(count, *stack.shape)


def stacks_of(hybrid: Hybrid, codes: Sequence[int] = ()) -> Stacks:
    """Numbers of compiled systems.

    Parameters
    ----------
    hybrid
        Compiled with columns, or with floats: one system, or all alike.
    codes
        Modes wanted beside those that every system begins with.

    Raises
    ------
    InvalidParameterError
        A mode wanted whose contact forces are not determined.
    """
    m, laws, stack = hybrid.mechanism, hybrid.laws(), _Stacker()
    contacts, lines, size = len(m.contacts), len(m.forces), hybrid.size
    systems = {
        "omegas": stack(hybrid.omegas, lines),
        "kappas": stack(hybrid.kappas, lines),
        "steps": stack(hybrid.step),
        "impulse": stack([law[0] for law in laws], contacts, size),
        "mobility": stack([law[1] for law in laws], contacts, contacts),
        "shift": stack([law[2] for law in laws], contacts, size),
        "restitution": stack([law[3:] for law in laws], contacts, 2),
    }
    wanted = [(), *hybrid.closed, *(closed_from_code(code, contacts) for code in codes)]
    modes = [_mode(hybrid.mode(closed), hybrid, stack) for closed in wanted]
    return Stacks(hybrid.dense, m.degrees, systems, modes, np.array(stack.columns))


def _mode(mode: Mode, hybrid: Hybrid, stack: _Stacker) -> dict[str, Any]:
    c, n, size = mode.coordinates, hybrid.mechanism.degrees, hybrid.size
    contacts, lines = len(mode.guards), len(hybrid.omegas)
    rows, gains, lower, upper, side = zip(*mode.guards, strict=True)
    shapes = {"b": (size, size), "constant": (size,)} if hybrid.dense else {}
    return {
        "code": mode.code,
        "flow": {k: stack(x, *shapes.get(k, (size // 2,))) for k, x in c.flow.items()},
        "rows": stack(rows, contacts, size),
        "gains": stack(gains, contacts),
        "lower": stack(lower, contacts),
        "upper": stack(upper, contacts),
        "side": list(side),
        "to_x": stack(c.to_x, n, size),
        "to_v": stack(c.to_v, n, size),
        "offset": stack(c.offset, n),
        "from_x": stack(c.from_x, size, n),
        "from_v": stack(c.from_v, size, n),
        "particular": stack(c.particular, size, 2 * lines),
    }


class _Stacker:
    """Makes stacks, and keeps the columns met."""

    def __init__(self) -> None:
        self.columns = list[Floats]()

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
        return Stack(shape, np.array([flat], dtype=float), columns)


def joined(parts: Sequence[Tables]) -> Tables:
    """Systems of one structure, one part after the other."""
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    systems = {name: np.concatenate([p.systems[name] for p in parts]) for name in first.systems}
    modes = [_joined_modes(modes) for modes in zip(*(p.modes for p in parts), strict=True)]
    return Tables(first.dense, first.degrees, systems, modes)


def _joined_modes(modes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    first = modes[0]
    flow = {k: np.concatenate([mode["flow"][k] for mode in modes]) for k in first["flow"]}
    same = {"code": first["code"], "flow": flow, "side": first["side"]}
    return {k: same[k] if k in same else np.concatenate([mode[k] for mode in modes]) for k in first}
