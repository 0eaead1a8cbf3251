"""What an observer returns: variables with dimensions, types and attributes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.checks import refusal

COORDINATE, CONTACT, EXPONENT = "coordinate", "contact", "exponent"  # dimensions
POINT, STROBE = "point", "strobe"  # of impact sections, of stroboscopic ones


class Output(NamedTuple):
    """A variable that an observer returns.

    Attributes
    ----------
    dims, shape
        Beyond those of the members.
    dtype, fill
        Type, and the value where nothing was computed.
    attrs
        ``long_name`` and, where it has one, ``units``, or the ``quantity`` that it measures in
        units of the system: length, velocity, time, rate or power.
    table, columns
        Where the kernel puts it.
    """

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    fill: float
    attrs: dict[str, Any]
    table: str
    columns: slice = slice(None)


Table = dict[str, Output]


def check_label(label: Any) -> None:
    """Refuse what cannot be a part of a variable's name."""
    if not isinstance(label, str) or not label.isidentifier():
        raise refusal("label", label, "a name, such as 'relative'")


def labelled(name: str, label: str) -> str:
    """Name of a variable of one of several observers."""
    return f"{name}_{label}" if label else name


def real(
    table: str, text: str, columns: slice = slice(None), units: str = "",
    dims: tuple[str, ...] = (), shape: tuple[int, ...] = (), quantity: str = "",
) -> Output:  # fmt: skip
    """Numbers, NaN where nothing was computed."""
    known = {"units": units, "quantity": quantity}
    attrs = {"long_name": text} | {name: said for name, said in known.items() if said}
    return Output(dims, shape, np.dtype(float), np.nan, attrs, table, columns)


def whole(
    table: str, text: str, column: int, dtype: str,
    dims: tuple[str, ...] = (), shape: tuple[int, ...] = (),
) -> Output:  # fmt: skip
    """Integers, 0 where nothing was computed, from one column on."""
    attrs, columns = {"long_name": text}, slice(column, column + math.prod(shape))
    return Output(dims, shape, np.dtype(dtype), 0, attrs, table, columns)


def reals(table: str, texts: dict[str, str], units: str = "", quantity: str = "") -> Table:
    """One number per column."""
    return {
        name: real(table, text, slice(i, i + 1), units, quantity=quantity)
        for i, (name, text) in enumerate(texts.items())
    }
