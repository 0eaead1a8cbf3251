"""Base class of results: dataset, table and picture follow from the declaration of the fields."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import fields
from enum import Enum
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.lazy import pd, xr
from vibroimpact._core.types import Complexes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DIMS, ROWS, MERGED, ATTRS = "dims", "rows", "merged", "attrs"
INSIDE = {MERGED: True}
"""Metadata of a field that holds a dataclass whose own variables are variables of the dataset, too."""


def along(*dims: str, **attrs: str) -> dict[str, Any]:
    """Metadata of a field that holds an array with these dims; ``attrs``, such as ``units``, describe it."""
    return {DIMS: dims, ATTRS: attrs}


def rows(dim: str, *more: str) -> dict[str, Any]:
    """Metadata of a field that holds records along a dim.

    Datasets have a column for each plain entry of theirs, and for further attributes by their names.
    """
    return {ROWS: (dim, *more)}


def plotting(module: str) -> Any:
    """Module of the room above all others, imported when something is drawn: with it comes matplotlib."""
    return import_module(f"vibroimpact.plotting.{module}")


class Result:
    """Base of results, which are dataclasses.

    A field with the metadata of :func:`along` or :func:`rows` is a variable of the dataset, complex ones by real and
    imaginary part. Numbers, words and what else is shown in the repr are attributes.
    """

    __slots__ = ()

    def __getstate__(self) -> dict[str, Any]:
        """Fields: copies, in other processes too, compute again what follows from them."""
        return {one.name: getattr(self, one.name) for one in fields(cast(Any, self))}

    def plot(self, *shown: Any, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the result.

        Parameters
        ----------
        *shown, **options
            As of the function of :mod:`vibroimpact.plotting` that draws such a result.
        ax
            Axes to draw on; a new figure if not given.

        Returns
        -------
        Axes
            The Axes drawn on.
        """
        drawn = plotting("of_results").drawing_of(type(self))
        axes: Axes = drawn(self, *shown, ax=ax, **options)
        return axes

    def to_dataset(self) -> xr.Dataset:
        """Convert to an xarray dataset, whose attributes describe system and result."""
        variables, attrs = _declared(self)
        return xr.Dataset(variables, attrs=attrs | {"version": _kernel.version()})

    def to_dataframe(self) -> pd.DataFrame:
        """Convert to a pandas table: a row for each place along the first dim, a column for each number."""
        return dataframe_of(self.to_dataset())


def _declared(holder: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Variables and attributes of a dataclass, by its fields."""
    variables: dict[str, Any] = {}
    attrs: dict[str, Any] = {}
    for one in fields(holder):
        value, declared = getattr(holder, one.name), one.metadata
        if value is None:
            continue
        if DIMS in declared:
            variables |= _column(one.name, declared[DIMS], value, dict(declared[ATTRS]))
        elif ROWS in declared:
            variables |= _table(value, *declared[ROWS])
        elif MERGED in declared:
            more, about = _declared(value)
            variables, attrs = more | variables, about | attrs
        elif one.repr and not one.name.startswith("_"):
            attrs |= _attribute(one.name, value)
    return variables, attrs


def _column(name: str, dims: tuple[str, ...], value: Any, attrs: dict[str, Any]) -> dict[str, Any]:
    """Variables of an array: two of complex numbers."""
    array = np.asarray(value)
    if np.iscomplexobj(array):
        return complex_columns(name, dims, array)
    return {name: (dims, array.astype(object) if array.dtype.kind == "U" else array, attrs)}


def complex_columns(name: str, dims: tuple[str, ...], array: Complexes) -> dict[str, Any]:
    """Variables of complex numbers: their real and their imaginary part."""
    return {f"{name}_real": (dims, array.real), f"{name}_imaginary": (dims, array.imag)}


def _table(records: Sequence[Any], dim: str, *more: str) -> dict[str, Any]:
    """Columns of records: of the entries, and further attributes, that are numbers or words in all of them."""
    if not records:
        return {}
    names = getattr(records[0], "_fields", None) or [one.name for one in fields(records[0])]
    found: dict[str, Any] = {}
    for name in (*names, *more):
        values = [getattr(one, name) for one in records]
        held = [value for value in values if value is not None]
        if held and all(isinstance(value, str) for value in held):
            words = ["" if value is None else str(value) for value in values]
            found[f"{dim}_{name}"] = dim, np.array(words, dtype=object)
        elif held and all(isinstance(value, int | float | np.number | np.bool_) for value in held):
            numbers = [math.nan if value is None else value for value in values]
            found[f"{dim}_{name}"] = dim, np.array(numbers)
    return found


def _attribute(name: str, value: Any) -> dict[str, Any]:
    """Attribute of a dataset: files have numbers, words and lists of them."""
    if isinstance(value, Enum):
        words = {f"{name}_reason": value.sentence} if hasattr(value, "sentence") else {}
        return {name: value.name} | words
    if isinstance(value, bool):
        return {name: int(value)}
    if isinstance(value, str | int | float):
        return {name: value}
    plain = isinstance(value, tuple | list) and all(isinstance(v, str | int | float) for v in value)
    return {name: list(value) if plain and value else repr(value)}


# ---- tables --------------------------------------------------------------------------------------


def dataframe_of(data: xr.Dataset) -> pd.DataFrame:
    """Table of a dataset: rows along the dims of its first variable that has fewest, a column for each number.

    Further dims of a variable become columns, position_0, position_1; variables along others are left out. Without
    arrays it has one row, of the attributes.
    """
    held = [variable for variable in data.data_vars.values() if variable.ndim]
    if not held:
        return pd.DataFrame([data.attrs])
    lead = min(held, key=lambda variable: variable.ndim).dims
    sizes = [data.sizes[dim] for dim in lead]
    count = int(np.prod(sizes))
    columns: dict[str, Any] = {}
    for dim in lead:
        if dim in data.coords:
            columns[str(dim)] = data[dim].broadcast_like(data[list(lead)]).values.ravel()
    for name, variable in data.data_vars.items():
        if variable.dims[: len(lead)] != lead:
            continue
        flat = variable.values.reshape(count, -1)
        if variable.ndim == len(lead):
            columns[str(name)] = flat[:, 0]
        else:
            further = list(np.ndindex(*variable.shape[len(lead) :]))
            ends = ("_".join(_place(data, variable.dims[len(lead) :], at)) for at in further)
            columns |= {f"{name}_{end}": flat[:, k] for k, end in enumerate(ends)}
    return pd.DataFrame(columns)


def _place(data: xr.Dataset, dims: Sequence[Any], index: Sequence[int]) -> Iterator[str]:
    """Place along dims: by its label where the dim has labels."""
    for dim, k in zip(dims, index, strict=True):
        yield str(data[dim].values[k] if dim in data.coords else k)
