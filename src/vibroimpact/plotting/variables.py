"""Variables of a dataset by name, and their labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import xarray as xr

from vibroimpact._core.checks import check_choice, check_kind
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.machines.json_text import system_of
from vibroimpact.machines.units import Units, units_of

LABELS = {
    "rotation": r"rotation number $\rho$",
    "lyapunov": r"largest Lyapunov exponent $\Lambda$",
    "period": "period in forcing periods",
    "attractors": "attractors met",
}


def variable_of(dataset: xr.Dataset, variable: str, otherwise: str = "") -> xr.DataArray:
    """Variable of a dataset; an error lists the variables there are, and gives advice."""
    check_choice("variable", variable, [str(name) for name in dataset.data_vars], otherwise)
    return dataset[variable]


def check_dataset(name: str, given: object, makers: str, holds: Sequence[str] = ()) -> None:
    """Refuse a value that is not a dataset, or lacks variables."""
    check_kind(name, given, xr.Dataset, f"a Dataset, as {makers} gives")
    if missing := [one for one in holds if one not in cast(xr.Dataset, given)]:
        raise InvalidParameterError(
            f"{name}: has no variable {', '.join(missing)}. Give what {makers} returned."
        )


def units_of_sweep(members: xr.Dataset) -> Units:
    """Units of a dataset, by the system in its attributes."""
    text = members.attrs.get("system_numbers")
    return units_of(system_of(text) if text else None)


def label_of(field: xr.DataArray, of: Units) -> str:
    """Label of a variable in words, with its unit or the unit of counting."""
    name, units = str(field.name), str(field.attrs.get("units", ""))
    kind, _, rest = name.partition("_")
    words = LABELS[kind] + f", {rest}" * bool(rest) if kind in LABELS else name.replace("_", " ")
    words = f"{words} {units}" if units.startswith("per ") else words
    return of.label(words, str(field.attrs.get("quantity", "")))


def combination(row: Sequence[float] | Floats, symbol: str = "x") -> str:
    """Formula of row . x, the positive terms first."""
    text = ""
    for i in sorted((i for i in range(len(row)) if row[i]), key=lambda i: row[i] < 0.0):
        size = "" if abs(row[i]) == 1.0 else rf"{abs(row[i]):g}\,"
        text += ("-" if row[i] < 0.0 else "+" if text else "") + f"{size}{symbol}_{{{i + 1}}}"
    return text
