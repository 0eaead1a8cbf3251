"""Base class of results: dataset, table and picture follow from the declaration of the fields."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import fields
from enum import Enum, IntEnum
from importlib import import_module
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.checks import check_choice, path_of
from vibroimpact._core.files import check_target, write_files
from vibroimpact._core.lazy import pd, xr
from vibroimpact._core.quantities import UNITS, prefixed
from vibroimpact._core.types import Complexes
from vibroimpact._core.words import missing_attribute

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DIMS, ROWS, MERGED, ATTRS, SIZES = "dims", "rows", "merged", "attrs", "sizes"
INSIDE = {MERGED: True}
"""Metadata of a field that holds a dataclass whose own variables are variables of the dataset, too."""


def along(*dims: str, codes: type[IntEnum] | None = None, **attrs: str) -> dict[str, Any]:
    """Metadata of a field that holds an array with these dims.

    ``attrs`` describe it: ``quantity`` (a key of ``UNITS``) where its unit is that of the system, or ``units``. Of
    ``codes`` datasets hold the meanings, and tables the names.
    """
    return {DIMS: dims, ATTRS: attrs | (meanings(codes) if codes else {})}


def meanings(codes: type[IntEnum]) -> dict[str, Any]:
    """Attributes of a variable that holds codes: what each of them means, by its ``words`` or its name."""
    words = [str(getattr(one, "words", one.name.lower())) for one in codes]
    return {
        "flag_values": np.array([*codes], dtype=np.int32),
        "flag_meanings": " ".join(word.replace(" ", "_") for word in words),
    }


def words_of_codes(variable: xr.DataArray) -> dict[int, str]:
    """Meanings of the codes that a variable holds, by code; empty where it holds none."""
    words = str(variable.attrs.get("flag_meanings", "")).split()
    values = np.ravel(variable.attrs["flag_values"]).tolist() if words else []
    return dict(zip(values, words, strict=True))


def rows(dim: str, *more: str) -> dict[str, Any]:
    """Metadata of a field that holds records along a dim.

    Datasets have a column for each plain entry of theirs, and for further attributes by their names.
    """
    return {ROWS: (dim, *more)}


CSV = ".csv"
UNIT_OF_ENTRY = re.compile(r"\[([^]]*)\]")


def plotting(module: str) -> Any:
    """Module of the room above all others, imported when something is drawn: with it comes matplotlib."""
    return import_module(f"vibroimpact.plotting.{module}")


def sized(*dims: str) -> dict[str, Any]:
    """Metadata of a field that holds an array with these dims, and is no variable of the dataset."""
    return {SIZES: dims}


def check_dataset(data: xr.Dataset) -> None:
    """Refuse a dataset of a sweep with values that no sweep returns; the room of sweeps knows what they are."""
    import_module("vibroimpact.sweeps.reading").check_dataset(data)


class Shown:
    """Base of what a notebook shows with a picture."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        return cast(str, plotting("notebook").html_of(self))


class Result(Shown):
    """Base of results, which are dataclasses.

    A field with the metadata of :func:`along` or :func:`rows` is a variable of the dataset, complex ones by real and
    imaginary part. Numbers, words and what else is shown in the repr are attributes.
    """

    __slots__ = ()

    def __getstate__(self) -> dict[str, Any]:
        """Fields: copies, in other processes too, compute again what follows from them."""
        return {one.name: getattr(self, one.name) for one in fields(cast(Any, self))}

    def __getattr__(self, name: str) -> Any:
        """Say which attribute is meant by one that is not there."""
        if name.startswith("_") or hasattr(type(self), name):
            return object.__getattribute__(self, name)  # raises what it raised
        raise missing_attribute(self, name, [one for one in dir(self) if not one.startswith("_")])

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
        data = xr.Dataset(variables, attrs=attrs | {"version": _kernel.version()})
        return with_units(data) if _in_si(self) else data

    def to_dataframe(self, dim: str = "") -> pd.DataFrame:
        """Convert to a pandas table: a row for each event, point, ..., a column for each number.

        Parameters
        ----------
        dim
            What the rows are: a dim of the dataset, such as "special" for the special points of a branch; by default
            the first.

        Raises
        ------
        InvalidParameterError
            No such dim; the message lists them.
        """
        return dataframe_of(self.to_dataset(), dim)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table of :meth:`to_dataframe` to a file, whole or not at all.

        In SI the titles of columns name the units, such as "position_0 [mm]", and lengths are in mm where that
        reads better.

        Parameters
        ----------
        path
            A name that ends in .csv; an earlier file of that name is replaced.
        """
        target = path_of("path", path)
        check_target(target, (CSV,), "path")
        write_files({target: csv_of(titled(self.to_dataframe()))})


def csv_of(table: pd.DataFrame) -> bytes:
    """Content of a file of the rows of a table."""
    return str(table.to_csv(index=False)).encode()


def _in_si(result: Any) -> bool:
    """Whether a result is one of a system in SI units, its own or that of a result in it."""
    named = {one.name for one in fields(result)}
    for one in ("system", "record"):
        if one in named:
            return bool(getattr(getattr(result, one), "si", False))
    if "si" in named:
        return bool(result.si)
    if "family" in named:
        return bool(getattr(getattr(result.family, "system", None), "si", False))
    inside = (getattr(result, one.name) for one in fields(result) if MERGED in one.metadata)
    return any(_in_si(one) for one in inside if isinstance(one, Result))


def with_units(data: xr.Dataset) -> xr.Dataset:
    """The dataset with the SI unit of each variable that names its quantity."""
    for variable in data.variables.values():
        if unit := UNITS.get(variable.attrs.get("quantity", "")):
            variable.attrs["units"] = unit
    return data


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


def dataframe_of(data: xr.Dataset, dim: str = "") -> pd.DataFrame:
    """Table of a dataset: rows along a dim, by default the dims of its first variable that has fewest.

    A column for each number, whose units are in ``attrs["units"]``; codes with meanings become words. Further dims of a
    variable become columns, position_0, position_1; variables along others are left out. Without arrays it has one row,
    of the attributes.
    """
    held = [variable for variable in data.data_vars.values() if variable.ndim]
    if not held:
        return pd.DataFrame([data.attrs])
    if dim:
        check_choice("dim", dim, [str(one) for one in data.dims])
    lead = (dim,) if dim else min(held, key=lambda variable: variable.ndim).dims
    sizes = [data.sizes[dim] for dim in lead]
    count = int(np.prod(sizes))
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    for along_rows in lead:
        if along_rows in data.coords:
            columns[str(along_rows)] = (
                data[along_rows].broadcast_like(data[list(lead)]).values.ravel()
            )
            units[str(along_rows)] = data[along_rows].attrs.get("units", "")
    for name, given in data.data_vars.items():
        if not set(lead) <= set(given.dims):
            continue
        variable = given.transpose(*lead, ...)
        flat = _in_words(variable).reshape(count, -1)
        if variable.ndim == len(lead):
            named = {str(name): flat[:, 0]}
        else:
            further = list(np.ndindex(*variable.shape[len(lead) :]))
            ends = ("_".join(_place(data, variable.dims[len(lead) :], at)) for at in further)
            named = {f"{name}_{end}": flat[:, k] for k, end in enumerate(ends)}
        columns |= named
        of_entries = UNIT_OF_ENTRY.findall(variable.attrs.get("units_of_entries", ""))
        of_all = [variable.attrs.get("units", "")] * len(named)
        units |= dict(zip(named, of_entries or of_all, strict=True))
    table = pd.DataFrame(columns)
    table.attrs["units"] = {name: unit for name, unit in units.items() if unit not in ("", "1")}
    return table


def titled(table: pd.DataFrame) -> pd.DataFrame:
    """A table for readers: titles name the units; all lengths are in mm, forces in kN, where they read better so."""
    units, shown, titles = table.attrs.get("units", {}), {}, {}
    numbers = {name: table[name].to_numpy(dtype=float) for name in units}
    for unit in set(units.values()):
        names = [name for name in units if units[name] == unit]
        sizes = [np.abs(numbers[name][np.isfinite(numbers[name])]) for name in names]
        factor, short = prefixed(max(size.max(initial=0.0) for size in sizes), unit)
        for name in names:
            titles[name] = f"{name} [{short}]"
            if factor != 1.0:
                # the inverse of a part is a whole number, and so the product is rounded once
                parts = round(1.0 / factor) if factor < 1.0 else 1.0 / factor
                shown[name] = numbers[name] * parts
    return table.assign(**shown).rename(columns=titles)


def _in_words(variable: xr.DataArray) -> Any:
    """Values of a variable; of codes their meanings."""
    known = words_of_codes(variable)
    if not known:
        return variable.values
    named = [known.get(code, str(code)) for code in variable.values.ravel().tolist()]
    return np.array(named, dtype=object).reshape(variable.shape)


def _place(data: xr.Dataset, dims: Sequence[Any], index: Sequence[int]) -> Iterator[str]:
    """Place along dims: by its label where the dim has labels."""
    for dim, k in zip(dims, index, strict=True):
        yield str(data[dim].values[k] if dim in data.coords else k)
