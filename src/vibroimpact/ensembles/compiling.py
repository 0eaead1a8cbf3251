"""Compile a system for many values of its parameters at once.

Method      The system is built once with a column (columns.py) for each parameter that varies, and
            compiled as any other: every number of it comes out as a column. Where systems disagree
            on a branch, those on either side are compiled apart (path splitting). Where the code of
            a system is beyond columns, or one is refused, each is compiled alone.
Accuracy    Every array has the bits that compiling each system alone gives.
Fails       A system that is refused alone is refused here; the message says which one it is. One
            that is forced at resonance is left out: a grid may hit it by chance.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibroimpact.columns import Column, Split
from vibroimpact.ensembles.tables import Stacks, Tables, joined, stacks_of
from vibroimpact.errors import InvalidParameterError, ResonanceError, VibroImpactError
from vibroimpact.hybrid import Hybrid
from vibroimpact.mechanism import Mechanism
from vibroimpact.parameters import with_parameters
from vibroimpact.simulate import System, mechanism_of

Values = dict[str, NDArray[np.float64]]
Rows = NDArray[np.intp]
Part = tuple[Rows, Tables]  # numbers of systems, and what they compile to


@dataclass(frozen=True)
class Compilation:
    """Systems compiled with columns, and those that are compiled alone when they are wanted.

    Attributes
    ----------
    system, values, codes
        What was asked for: see :func:`compile_together`.
    mechanism
        Of ``system``.
    parts
        Numbers of systems, rising, and what they compile to, each part of one structure.
    apart
        Systems that columns will not do for, rising.
    """

    system: System
    values: Values
    codes: tuple[int, ...]
    mechanism: Mechanism
    parts: list[tuple[Rows, Stacks]]
    apart: Rows

    @property
    def count(self) -> int:
        """How many systems."""
        return _count(self.values)

    def tables(self, place: slice) -> list[Part]:
        """Arrays of some systems, numbered from the first of them, in parts of one structure.

        Raises
        ------
        InvalidParameterError
            One of them is refused, or its code fails; the message names its parameters.
        """
        structures = dict[object, list[Part]]()
        for part in self._found(place):
            structures.setdefault(part[1].structure, []).append(part)
        return [_merged(same) for same in structures.values()]

    def _found(self, place: slice) -> Iterator[Part]:
        for systems, stacks in self.parts:
            inside = _inside(systems, place)
            if inside.stop > inside.start:
                yield systems[inside] - place.start, stacks.tables(inside)
        for k in self.apart[_inside(self.apart, place)]:
            alone = _alone(self.system, self.values, k, self.codes)
            if alone:
                yield np.array([k - place.start]), alone.tables(slice(0, 1))


def compile_together(system: System, values: Values, codes: tuple[int, ...] = ()) -> Compilation:
    """Compile every system but those at resonance.

    Parameters
    ----------
    system, values
        As for :func:`vibroimpact.ensembles.batch.batch_of`; arrays of one length.
    codes
        Modes wanted beside those that every system begins with.

    Notes
    -----
    A refused system raises once its tables are wanted.
    """
    pending = [np.arange(_count(values))]
    parts, apart = list[tuple[Rows, Stacks]](), [np.arange(0)]
    while pending:
        systems = pending.pop()
        try:
            stacks = _together(system, values, systems, codes)
        except ResonanceError:
            continue
        except Split as split:
            pending += [systems[~split.mask], systems[split.mask]]
            continue
        if stacks:
            parts.append((systems, stacks))
        else:
            apart.append(systems)
    m, rising = mechanism_of(system), np.sort(np.concatenate(apart))
    return Compilation(system, values, codes, m, parts, rising)


def _count(values: Values) -> int:
    return len(next(iter(values.values()))) if values else 1


def _inside(systems: Rows, place: slice) -> slice:
    """Where in rising numbers those of a stretch are."""
    first, last = np.searchsorted(systems, [place.start, place.stop])
    return slice(int(first), int(last))


def _merged(parts: list[Part]) -> Part:
    if len(parts) == 1:
        return parts[0]
    return np.concatenate([systems for systems, _ in parts]), joined([t for _, t in parts])


def _together(system: System, values: Values, systems: Rows, codes: Sequence[int]) -> Stacks | None:
    """Systems compiled with columns; None where columns will not do."""
    if len(systems) == 1:
        return None
    columns = {name: Column(x[systems]) for name, x in values.items()}
    try:
        with np.errstate(all="ignore"):  # as Python's floats
            mechanism = _built(system, columns)
            return None if mechanism is None else stacks_of(Hybrid(mechanism), codes)
    except ResonanceError:
        raise
    except (VibroImpactError, ArithmeticError):  # refused: each is asked alone
        return None


def _built(system: System, columns: dict[str, Column]) -> Mechanism | None:
    """The mechanism of all systems; None where one is refused, or its code is beyond columns."""
    try:
        return mechanism_of(with_parameters(system, columns))
    except Exception:  # a system's code may raise anything
        return None


def _alone(system: System, values: Values, k: int, codes: Sequence[int]) -> Stacks | None:
    """One system; None at resonance."""
    numbers = {name: float(x[k]) for name, x in values.items()}
    try:
        return stacks_of(Hybrid(mechanism_of(with_parameters(system, numbers))), codes)
    except ResonanceError:
        return None
    except Exception as error:
        what = str(error) if isinstance(error, InvalidParameterError) else repr(error)
        which = ", ".join(f"{name} = {x!r}" for name, x in numbers.items())
        raise InvalidParameterError(f"{what} System: {which}." if which else what) from error
