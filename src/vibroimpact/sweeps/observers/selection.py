"""Observers as they are requested of a sweep, run by the kernel, and returned.

Each is requested by its name, or as an object with options; several at once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, cast

import numpy as np

from vibroimpact._core.checks import check_choice, shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import as_python
from vibroimpact._core.types import Arrays
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.member_status import NOT_COMPUTED, MemberStatus
from vibroimpact.sweeps.observers.observer import KERNEL, ROWS, Observer, Variable, Variables
from vibroimpact.sweeps.observers.table import OBSERVERS


def observer_of(name: str) -> Observer:
    """Return the observer with this name and its default options.

    Raises
    ------
    InvalidParameterError
        There is none.
    """
    check_choice("observe", name, OBSERVERS)
    return OBSERVERS[name]()


def resolve(observe: str | Observer | Sequence[str | Observer]) -> tuple[Observer, ...]:
    """Names and observers as observers, equal ones once.

    Raises
    ------
    InvalidParameterError
        No such observer; two of one kind with different options and the same label, if it has one;
        nothing.
    """
    listed = [observe] if isinstance(observe, str) or not isinstance(observe, Sequence) else observe
    found: dict[tuple[str, str], Observer] = {}
    for one in listed:
        observer: object = observer_of(one) if isinstance(one, str) else one
        if not isinstance(observer, Observer):
            name = one.__name__ if isinstance(one, type) else "Symbol"
            raise InvalidParameterError(
                f"observe = {shown(one)}: must be a name or an observer, such as {name}()."
            )
        key = key_of(observer)
        if found.setdefault(key, observer) != observer:
            options = asdict(cast(Any, observer))
            mend = "Give one a label" if "label" in options else "Keep one; take two sweeps"
            raise InvalidParameterError(
                f"observe = {found[key]!r}, {observer!r}: their results have the same names. "
                f"{mend}."
            )
    if not found:
        raise InvalidParameterError("observe = []: needs at least one observer.")
    return tuple(found.values())


def key_of(observer: Observer) -> tuple[str, str]:
    """Name and label: no two observers of a sweep have the same."""
    return observer.name, observer.label


def describe(observers: Sequence[Observer]) -> list[dict[str, Any]]:
    """Names and options, ready for JSON."""
    return [{"observer": one.name, **_options(one)} for one in observers]


def described_observers(described: list[dict[str, Any]]) -> list[Observer]:
    """Observers of what :func:`describe` gave."""
    return [OBSERVERS[one.pop("observer")](**one) for one in described]


def _options(observer: Observer) -> dict[str, Any]:
    options = asdict(cast(Any, observer))
    return {name: as_python(value) for name, value in options.items()}


def _most_rows(observer: Observer) -> int:
    """Largest number of rows of its kind in a run; 0 for an observer without rows, which is there once."""
    options, _ = KERNEL[observer.name]
    return int(options[ROWS][1]) if ROWS in options else 0


def rounds(observers: Sequence[Observer]) -> list[tuple[Observer, ...]]:
    """The runs that observers need: the kernel has one of a kind, but many rows to watch."""
    found: list[list[Observer]] = [[]]
    before = Counter[str]()
    for one in observers:
        at = 0 if _most_rows(one) else before[one.name]
        before[one.name] += 1
        if at == len(found):
            found.append([])
        found[at].append(one)
    return [tuple(some) for some in found]


def kernel_observers(observers: Sequence[Observer]) -> dict[str, Any]:
    """The argument of ``_kernel.Batch.run``: options by name of the observer."""
    options: dict[str, Any] = {}
    for one in observers:
        own = _options(one)
        own.pop("label", None)
        if _most_rows(one):
            own[ROWS] = own.pop("row")
            of_rows = options.setdefault(one.name, {name: [] for name in own})
            for name, value in own.items():
                of_rows[name].append(value)
        else:
            options[one.name] = own
    return options


def variables_of(observers: Sequence[Observer], mechanism: Mechanism) -> Variables:
    """Every variable of a member by name, ``end`` and ``time`` first.

    Raises
    ------
    InvalidParameterError
        A contact, stop or row that the mechanism does not have; too many rows; a label that
        makes the name of another result.
    """
    table = {"end": _end(), "time": _time()}
    rows, columns = Counter[str](), Counter[str]()  # of what several observers share
    for one in observers:
        found = {
            name: _placed(variable, one.name, columns[one.name])
            for name, variable in one.variables(mechanism).items()
        }
        if most := _most_rows(one):
            rows[one.name] += 1 if one.row else mechanism.degrees
            columns[one.name] = max(variable.columns.stop for variable in found.values())
            if rows[one.name] > most:
                raise InvalidParameterError(f"observe: at most {most} rows of {one.name}.")
        for name in sorted(found.keys() & table.keys()):
            raise InvalidParameterError(
                f"observe = {one!r}: {name} is the result of another observer. Take another label."
            )
        table |= found
    return table


def results(observers: Sequence[Observer], mechanism: Mechanism, raw: Arrays) -> Arrays:
    """Variables of every member by name, from the tables of the kernel."""
    count = len(raw["end"])
    return {
        name: np.ascontiguousarray(
            raw[variable.table].reshape(count, -1)[:, variable.columns], dtype=variable.dtype
        ).reshape(count, *variable.shape)
        for name, variable in variables_of(observers, mechanism).items()
    }


def _placed(variable: Variable, observer: str, by: int) -> Variable:
    """The variable in the table of an observer of the kernel, behind so many columns of others."""
    at, table = variable.columns, f"{observer}.{variable.table}"
    moved = slice(at.start + by, at.stop + by, at.step) if by else at
    return variable._replace(table=table, columns=moved)


def _end() -> Variable:
    attrs = {
        "long_name": "why the run ended",
        "flag_values": np.array([NOT_COMPUTED, *MemberStatus], dtype=np.int8),
        "flag_meanings": " ".join(["not_computed", *(one.name.lower() for one in MemberStatus)]),
    }
    return Variable((), (), np.dtype(np.int8), NOT_COMPUTED, attrs, "end")


def _time() -> Variable:
    attrs = {"long_name": "time reached since the start", "quantity": "time"}
    return Variable((), (), np.dtype(float), np.nan, attrs, "time")
