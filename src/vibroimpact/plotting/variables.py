"""Variables of a dataset: one of them by its name, and its name in words."""

from __future__ import annotations

import xarray as xr

from vibroimpact.errors import InvalidParameterError

LABELS = {
    "rotation": r"rotation number $\rho$",
    "lyapunov": r"largest Lyapunov exponent $\Lambda$",
    "period": "period in forcing periods",
    "attractors": "attractors met",
}


def variable_of(dataset: xr.Dataset, variable: str, otherwise: str = "") -> xr.DataArray:
    """A variable, or an error that lists what there is, with a sentence on what else to do."""
    if variable not in dataset:
        raise InvalidParameterError(
            f"variable = {variable!r}: must be one of {', '.join(map(str, dataset.data_vars))}."
            f"{otherwise}"
        )
    return dataset[variable]


def label_of(field: xr.DataArray) -> str:
    """A variable in words, with what it is counted per."""
    name, units = str(field.name), str(field.attrs.get("units", ""))
    kind, _, rest = name.partition("_")
    words = LABELS[kind] + f", {rest}" * bool(rest) if kind in LABELS else name.replace("_", " ")
    return f"{words} {units}" if units.startswith("per ") else words
