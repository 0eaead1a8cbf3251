"""Base class of observers: options, and the variables that they return.

Each kind is a frozen dataclass in a file that has its name, and a header of the kernel that computes it
(include/vibroimpact/observe/observer.hpp). The kernel's table says which there are, which options they
take, and in which tables their results are.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.checks import (
    check_count,
    check_stop_name,
    in_range,
    refusal,
    share,
    vector,
)
from vibroimpact._core.checks import real as real_number
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.mechanism import Mechanism

COORDINATE, CONTACT, EXPONENT = "coordinate", "contact", "exponent"  # dimensions
ELEMENT, PART, STATE = "element", "part", "state"  # parts are contacts, then elements
QUANTITIES = {"position": "length", "velocity": "velocity", "time": "time"}
LARGEST = float(np.finfo(float).max)
FINITE, AMOUNT, EXPONENTS = (-LARGEST, LARGEST), (0.0, LARGEST), (-math.inf, LARGEST)  # ranges
ANY = (-math.inf, math.inf)  # of a state that may have diverged
ROWS = "rows"  # the option of observers that can be there several times in one run
OF_ROWS = "of_rows"  # kind of options that have a value for each of these rows

KERNEL = _kernel.observers()  # by name: options with their kinds and ranges, tables


class Observer(ABC):
    """An observer with its options: a frozen dataclass."""

    name: ClassVar[str]
    label: str = ""  # of kinds that have one
    row: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the options, in the ranges that the kernel gives."""
        options, _ = KERNEL[self.name]
        for name, (kind, *limits) in options.items():
            if kind == "count":
                check_count(name, getattr(self, name), *limits)
            elif kind == "share":
                share(name, getattr(self, name))
            elif kind == "real":
                object.__setattr__(self, name, real_number(name, getattr(self, name)))
            elif kind == "stop":
                check_stop_name(getattr(self, name))
            elif kind == OF_ROWS:
                object.__setattr__(self, name, in_range(name, getattr(self, name), *limits))
            else:
                object.__setattr__(self, "row", _row(self.row, self.label))
        _check_own_label(self.label)

    @abstractmethod
    def variables(self, mechanism: Mechanism) -> Variables:
        """Variables that it returns of a member, by name."""


class Variable(NamedTuple):
    """A variable that an observer returns."""

    # beyond those of the members
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    # type, and the value where nothing was computed
    dtype: np.dtype[Any]
    fill: float
    # `long_name` and, where it has one, `units`, or the `quantity` that it measures in units of the system: length,
    # velocity, time, rate, force, impulse or power
    attrs: dict[str, Any]
    # where the kernel puts it
    table: str
    columns: slice = slice(None)
    within: tuple[float, float] = (
        FINITE  # least and largest value; where nothing was computed stands the fill
    )

    def admits(self, values: Any) -> bool:
        """Whether values are of its type and range, or stand for none."""
        if values.dtype.kind != self.dtype.kind:
            return False
        least, most = self.within
        return bool(np.all((values >= least) & (values <= most) | (values != values)))


Variables = dict[str, Variable]


def need_forcing(observer: Observer, mechanism: Mechanism, why: str) -> None:
    """Refuse a mechanism without forcing."""
    if not mechanism.forces:
        raise InvalidParameterError(
            f"observe = {type(observer).__name__}: the system has no forcing, so that {why}"
        )


def check_label(label: Any) -> None:
    """Refuse what cannot be a part of a variable's name."""
    if not isinstance(label, str) or not label.isidentifier():
        raise refusal("label", label, "a name, such as 'relative'")


def _check_own_label(label: Any) -> None:
    """Refuse a label that is neither empty nor a name."""
    if not isinstance(label, str) or label:
        check_label(label)


def labelled(name: str, label: str) -> str:
    """Name of a variable of one of several observers."""
    return f"{name}_{label}" if label else name


def _row(row: Any, label: Any) -> tuple[float, ...]:
    """A row on the state and the accelerations, which has a name; none: each coordinate."""
    check_label(label)
    numbers = vector("row", row)
    if numbers and not any(numbers):
        raise InvalidParameterError(
            "row = 0: must involve a position, a velocity or an acceleration."
        )
    if not numbers and label != "x":
        raise InvalidParameterError(f"label = {label!r}: give the row that it names.")
    return numbers


def real(
    table: str, text: str, columns: slice = slice(None), units: str = "",
    dims: tuple[str, ...] = (), shape: tuple[int, ...] = (), quantity: str = "",
    within: tuple[float, float] = FINITE,
) -> Variable:  # fmt: skip
    """Numbers, NaN where nothing was computed."""
    known = {"units": units, "quantity": quantity}
    attrs = {"long_name": text} | {name: said for name, said in known.items() if said}
    return Variable(dims, shape, np.dtype(float), np.nan, attrs, table, columns, within)


def whole(
    table: str, text: str, column: int, dtype: str,
    dims: tuple[str, ...] = (), shape: tuple[int, ...] = (),
) -> Variable:  # fmt: skip
    """Integers, 0 where nothing was computed, from one column on."""
    attrs, columns = {"long_name": text}, slice(column, column + math.prod(shape))
    return Variable(dims, shape, np.dtype(dtype), 0, attrs, table, columns, AMOUNT)


def reals(
    table: str, texts: dict[str, str], units: str = "", quantity: str = "",
    within: tuple[float, float] = FINITE,
) -> Variables:  # fmt: skip
    """Real variables, each of one column of the kernel."""
    return {
        name: real(table, text, slice(i, i + 1), units, quantity=quantity, within=within)
        for i, (name, text) in enumerate(texts.items())
    }
