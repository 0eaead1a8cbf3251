"""Observers: what is computed of every member while it runs, without storing its motion.

Each is asked for by its name, or as an object with options (kinds.py); several at once.
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
from vibroimpact.model.stop import Stop
from vibroimpact.sweeps.member_status import NOT_COMPUTED, Outcome
from vibroimpact.sweeps.observers.kinds import (
    Extremes,
    Final,
    Impacts,
    Lyapunov,
    Observer,
    Power,
    Rms,
    Rotation,
    Section,
    Settling,
    Shares,
    Spectrum,
    Speeds,
    Stroboscopic,
    Symbol,
)  # fmt: skip
from vibroimpact.sweeps.observers.variables import Output, Table

__all__ = [
    "Extremes", "Final", "Impacts", "Lyapunov", "Observer", "Outcome", "Output", "Power", "Rms",
    "Rotation", "Section", "Settling", "Shares", "Spectrum", "Speeds",
    "Stroboscopic", "Symbol", "describe",
    "kernel_observers", "key_of", "observer_of", "outputs", "resolve", "results", "rounds",
]  # fmt: skip


MOST_ROWS = 16  # of all Extremes, or of all Rms: room in the kernel
WATCHES = {
    "extremes": "extremes",
    "rms": "averages",
}  # rows on the coordinates: names in the kernel

OBSERVERS: dict[str, type[Observer]] = {
    kind.name: kind
    for kind in (
        Section, Symbol, Impacts, Speeds, Power, Extremes, Rms, Lyapunov, Spectrum, Shares,
        Settling, Final, Rotation, Stroboscopic,
    )
}  # fmt: skip


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
        observer = observer_of(one) if isinstance(one, str) else one
        if not isinstance(observer, tuple(OBSERVERS.values())):
            name = one.__name__ if isinstance(one, type) else "Symbol"
            raise InvalidParameterError(
                f"observe = {shown(one)}: must be a name or an observer, such as {name}()."
            )
        key = key_of(observer)
        if found.setdefault(key, observer) != observer:
            mend = "Give one a label" if hasattr(observer, "label") else "Keep one; take two sweeps"
            raise InvalidParameterError(
                f"observe = {found[key]!r}, {observer!r}: their results have the same names. "
                f"{mend}."
            )
    if not found:
        raise InvalidParameterError("observe = []: needs at least one observer.")
    return tuple(found.values())


def key_of(observer: Observer) -> tuple[str, str]:
    """Name and label: no two observers of a sweep have the same."""
    return observer.name, getattr(observer, "label", "")


def describe(observers: Sequence[Observer]) -> list[dict[str, Any]]:
    """Names and options, ready for JSON."""
    return [{"observer": one.name, **_options(one)} for one in observers]


def _options(observer: Observer) -> dict[str, Any]:
    options = asdict(cast(Any, observer))
    return {name: as_python(value) for name, value in options.items()}


def rounds(observers: Sequence[Observer]) -> list[tuple[Observer, ...]]:
    """The runs that observers need: the kernel has one of a kind, but many rows to watch."""
    found: list[list[Observer]] = [[]]
    before = Counter[str]()
    for one in observers:
        at = 0 if one.name in WATCHES else before[one.name]
        before[one.name] += 1
        if at == len(found):
            found.append([])
        found[at].append(one)
    return [tuple(some) for some in found]


def kernel_observers(observers: Sequence[Observer]) -> dict[str, Any]:
    """What ``_kernel.Batch.run`` is told: options by name of the observer."""
    spec: dict[str, Any] = {}
    for one in observers:
        options = _options(one)
        if one.name in WATCHES:
            spec.setdefault(WATCHES[one.name], []).append(list(options["row"]))
            continue
        options.pop("label", None)
        if "stop" in options:
            options["side"] = Stop.at(options.pop("stop")).side
        if "points" in options:
            options["last"] = options.pop("points")
        spec[one.name] = options
    return spec


def outputs(observers: Sequence[Observer], mechanism: Mechanism) -> Table:
    """By name: every variable of a member, ``end`` and ``time`` first.

    Raises
    ------
    InvalidParameterError
        A contact, stop or row that the mechanism does not have; more than 16 rows; a label that
        makes the name of another result.
    """
    table = {"end": _end(), "time": _time()}
    used = dict.fromkeys(WATCHES.values(), 0)  # columns of each table
    for one in observers:
        found = one.outputs(mechanism)
        if one.name in WATCHES:
            at = WATCHES[one.name]
            found = {name: _moved(output, used[at]) for name, output in found.items()}
            used[at] += 2 * max(1, *(sum(output.shape) for output in found.values()))
        for name in sorted(found.keys() & table.keys()):
            raise InvalidParameterError(
                f"observe = {one!r}: {name} is the result of another observer. Take another label."
            )
        table |= found
    if max(used.values()) > 2 * MOST_ROWS:
        raise InvalidParameterError(f"observe: at most {MOST_ROWS} rows of Extremes, and of Rms.")
    return table


def results(observers: Sequence[Observer], mechanism: Mechanism, raw: Arrays) -> Arrays:
    """By name: the variables of every member, from the tables of the kernel."""
    count = len(raw["end"])
    return {
        name: np.ascontiguousarray(
            raw[output.table].reshape(count, -1)[:, output.columns], dtype=output.dtype
        ).reshape(count, *output.shape)
        for name, output in outputs(observers, mechanism).items()
    }


def _moved(output: Output, by: int) -> Output:
    at = output.columns
    return output._replace(columns=slice(at.start + by, at.stop + by, at.step))


def _end() -> Output:
    attrs = {
        "long_name": "why the run ended",
        "flag_values": np.array([NOT_COMPUTED, *Outcome], dtype=np.int8),
        "flag_meanings": " ".join(["not_computed", *(one.name.lower() for one in Outcome)]),
    }
    return Output((), (), np.dtype(np.int8), NOT_COMPUTED, attrs, "end")


def _time() -> Output:
    attrs = {"long_name": "time reached since the start", "quantity": "time"}
    return Output((), (), np.dtype(float), np.nan, attrs, "time")
