"""Compile a system for many values of its parameters at once.

Method      The system is built once with a column (columns.py) for each parameter that varies, and
            compiled as any other: every number of it becomes a column. In a grid of parameters a
            number is computed once for all systems that share the parameters on which it depends.
            Where systems disagree on a branch, those on either side are compiled apart (path
            splitting). Where the code of a system cannot compute with columns, or one system is
            refused, each is compiled alone.
Accuracy    Every array has the same bits as if each system was compiled alone.
Fails       A system that is refused alone is refused here; the message gives its parameters
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel
from vibroimpact._core.columns import Column, Split
from vibroimpact._core.errors import InvalidParameterError, VibroImpactError
from vibroimpact._core.types import Floats, Rows
from vibroimpact.compile.hybrid import hybrid_of, hybrid_of_numbers
from vibroimpact.compile.tables import Stacks, joined, stacks_of
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameters, with_values
from vibroimpact.model.system import System, mechanism_of

Values = dict[str, NDArray[np.float64]]


class Part(NamedTuple):
    """Compiled systems of one structure."""

    systems: Rows  # their numbers, rising
    stacks: Stacks  # their compiled arrays
    omegas: Floats  # frequencies of their forcing lines, shape (S, L)
    kernel: _kernel.Batch  # the kernel that runs their members


@dataclass(frozen=True)
class Compilation:
    """Systems compiled with columns, and those that are compiled alone when they are needed."""

    # the arguments of compile_together
    system: System
    values: Values
    codes: tuple[int, ...]
    pace: float
    mechanism: Mechanism
    parts: list[Part]  # systems compiled with columns
    apart: Rows  # systems that cannot be compiled with columns, rising

    @property
    def count(self) -> int:
        """Number of systems."""
        return _count(self.values)

    def inside(self, place: slice) -> list[tuple[Part, slice]]:
        """Parts with some of the systems, and the places of these in each.

        Raises
        ------
        InvalidParameterError
            One of them is refused, or its code fails; the message names its parameters.
        """
        parts = [*self.parts, *_parts_of(self._alone(place))]
        found = [(part, _inside(part.systems, place)) for part in parts]
        return [(part, where) for part, where in found if where.stop > where.start]

    def _alone(self, place: slice) -> Iterator[tuple[Rows, Stacks]]:
        for k in self.apart[_inside(self.apart, place)]:
            yield np.array([k]), _alone(self.system, self.values, k, self.codes, self.pace)


def compile_together(
    system: System, values: Values, codes: tuple[int, ...] = (), pace: float = 0.0
) -> Compilation:
    """Compile every system.

    Parameters
    ----------
    system, values
        As for :func:`vibroimpact.sweeps.execution.batch.batch_of`; arrays of one length.
    codes
        Modes needed in addition to those that every system begins with.
    pace
        That of the motions (pace.py).

    Notes
    -----
    A refused system raises when it is needed.
    """
    pending = [np.arange(_count(values))]
    together, apart = list[tuple[Rows, Stacks]](), [np.arange(0)]
    while pending:
        systems = pending.pop()
        try:
            stacks = _together(system, values, systems, codes, pace)
        except Split as split:
            pending += [systems[~split.mask], systems[split.mask]]
            continue
        if stacks:
            together.append((systems, stacks))
        else:
            apart.append(systems)
    m, rising = mechanism_of(system), np.sort(np.concatenate(apart))
    return Compilation(system, values, codes, pace, m, _parts_of(together), rising)


def _count(values: Values) -> int:
    return len(next(iter(values.values()))) if values else 1


def _inside(systems: Rows, place: slice) -> slice:
    """Positions, within rising numbers, of those in a range."""
    first, last = np.searchsorted(systems, [place.start, place.stop])
    return slice(int(first), int(last))


def _parts_of(compiled: Iterable[tuple[Rows, Stacks]]) -> list[Part]:
    """One part for each structure."""
    structures = dict[object, list[tuple[Rows, Stacks]]]()
    for one in compiled:
        structures.setdefault(one[1].structure, []).append(one)
    return [_merged(same) for same in structures.values()]


def _merged(same: list[tuple[Rows, Stacks]]) -> Part:
    systems, stacks = same[0]
    if len(same) > 1:
        systems = np.concatenate([numbers for numbers, _ in same])
        order = np.argsort(systems)
        systems, stacks = systems[order], joined([one for _, one in same], order)
    return Part(systems, stacks, stacks.omegas, stacks.kernel())


def spread(arrays: list[Floats]) -> tuple[list[Floats], tuple[int, ...]]:
    """Axes and sizes of a grid from flat arrays of its points, the last one varying fastest.

    Each axis has as many dimensions as there are arrays, and spreads over the grid. Arrays that
    do not form a grid are returned as they are, with their length.
    """
    whole, sizes = arrays[0].size, list[int]()
    for x in arrays[:-1]:
        bits = _bits(x[:whole])
        other = np.flatnonzero(bits != bits[0])
        same = int(other[0]) if other.size else whole
        sizes.append(whole // same)
        whole = same
    grid = (*sizes, whole)
    if math.prod(grid) == arrays[0].size:
        boxes = [x.reshape(grid) for x in arrays]
        axes = [_axis(box, i) for i, box in enumerate(boxes)]
        if all(np.all(_bits(axis) == _bits(box)) for axis, box in zip(axes, boxes, strict=True)):
            return axes, grid
    return arrays, arrays[0].shape


def _bits(x: Floats) -> NDArray[np.int64]:
    return x.view(np.int64)


def _axis(x: Floats, i: int) -> Floats:
    """Entries along one dimension, at the first place of the others."""
    return x[tuple(slice(None if k == i else 1) for k in range(x.ndim))]


def _together(
    system: System, values: Values, systems: Rows, codes: Sequence[int], pace: float
) -> Stacks | None:
    """Systems compiled with columns; None where that is impossible."""
    if len(systems) == 1:
        return None
    parts, grid = spread([x[systems] for x in values.values()])
    columns = {name: Column(part) for name, part in zip(values, parts, strict=True)}
    try:
        with np.errstate(all="ignore"):  # as Python's floats
            mechanism = _built(system, columns)
            if mechanism is None:
                return None
            return stacks_of(hybrid_of(mechanism, pace), grid, codes)
    except Split as split:
        raise Split(np.broadcast_to(split.mask, grid).ravel()) from None
    except (VibroImpactError, ArithmeticError):  # refused: each is compiled alone
        return None


def _built(system: System, columns: dict[str, Column]) -> Mechanism | None:
    """Mechanism of all systems; None where one is refused, or cannot compute with columns."""
    try:
        return mechanism_of(with_parameters(system, columns))
    except Exception:  # a system's code may raise anything
        return None


def _alone(system: System, values: Values, k: int, codes: Sequence[int], pace: float) -> Stacks:
    """One system compiled alone."""
    numbers = {name: float(x[k]) for name, x in values.items()}
    try:
        mechanism = mechanism_of(with_parameters(system, numbers))
        return stacks_of(hybrid_of_numbers(mechanism, pace), (1,), codes)
    except Exception as error:
        what = str(error) if isinstance(error, InvalidParameterError) else repr(error)
        raise InvalidParameterError(with_values(what, numbers)) from error
