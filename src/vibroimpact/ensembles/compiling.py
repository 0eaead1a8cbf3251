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

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vibroimpact.columns import Column, Split
from vibroimpact.ensembles.tables import Tables, joined, tables_of
from vibroimpact.errors import InvalidParameterError, ResonanceError, VibroImpactError
from vibroimpact.hybrid import Hybrid
from vibroimpact.mechanism import Mechanism
from vibroimpact.parameters import with_parameters
from vibroimpact.simulate import System, mechanism_of

Values = dict[str, NDArray[np.float64]]
Part = tuple[NDArray[np.intp], Tables]  # numbers of systems, and what they compile to


def compile_together(system: System, values: Values, codes: Sequence[int] = ()) -> list[Part]:
    """Compile every system but those at resonance, in parts of one structure.

    Parameters
    ----------
    system, values
        As for :func:`vibroimpact.ensembles.batch.batch_of`; arrays of one length.
    codes
        Modes wanted beside those that every system begins with.

    Raises
    ------
    InvalidParameterError
        A system that is refused, or whose code fails; the message names its parameters.
    """
    count = len(next(iter(values.values()))) if values else 1
    pending, parts = [np.arange(count)], list[Part]()
    while pending:
        systems = pending.pop()
        try:
            parts += _together(system, values, systems, codes)
        except Split as split:
            pending += [systems[~split.mask], systems[split.mask]]
    structures = dict[object, list[Part]]()
    for part in parts:
        structures.setdefault(part[1].structure, []).append(part)
    return [_merged(same) for same in structures.values()]


def _merged(parts: list[Part]) -> Part:
    return np.concatenate([systems for systems, _ in parts]), joined([t for _, t in parts])


def _together(
    system: System, values: Values, systems: NDArray[np.intp], codes: Sequence[int]
) -> list[Part]:
    """Systems compiled with columns; one by one where columns will not do."""
    columns = {name: Column(x[systems]) for name, x in values.items()}
    if len(systems) > 1:
        try:
            with np.errstate(all="ignore"):  # as Python's floats
                mechanism = _built(system, columns)
                if mechanism is not None:
                    return [(systems, tables_of(Hybrid(mechanism), len(systems), codes))]
        except ResonanceError:
            return []
        except (VibroImpactError, ArithmeticError):  # refused: asked again below
            pass
    return [part for k in systems for part in _alone(system, values, k, codes)]


def _built(system: System, columns: dict[str, Column]) -> Mechanism | None:
    """The mechanism of all systems; None where one is refused, or its code is beyond columns."""
    try:
        return mechanism_of(with_parameters(system, columns))
    except Exception:  # a system's code may raise anything
        return None


def _alone(system: System, values: Values, k: int, codes: Sequence[int]) -> list[Part]:
    numbers = {name: float(x[k]) for name, x in values.items()}
    try:
        hybrid = Hybrid(mechanism_of(with_parameters(system, numbers)))
        return [(np.array([k]), tables_of(hybrid, 1, codes))]
    except ResonanceError:
        return []
    except Exception as error:
        what = str(error) if isinstance(error, InvalidParameterError) else repr(error)
        which = ", ".join(f"{name} = {x!r}" for name, x in numbers.items())
        raise InvalidParameterError(f"{what} System: {which}." if which else what) from error
