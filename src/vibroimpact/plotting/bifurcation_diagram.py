"""Bifurcation diagram: a section's coordinate over a parameter."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from vibroimpact.ensembles.states import COORDINATE
from vibroimpact.errors import InvalidParameterError
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import parameter_label
from vibroimpact.plotting.sections import symbol
from vibroimpact.plotting.variables import check_dataset, label_of, variable_of

# Drawn in this order: large and light below, small and dark above, so that both are seen where
# they agree.
DIRECTIONS: dict[str, dict[str, Any]] = {
    "up": {"color": style.ORANGE, "markersize": 1.6},
    "down": {"color": style.BLUE, "markersize": 0.7},
}
OTHERS = (style.VERMILION, style.GREEN, style.PURPLE, style.BLACK)
BESIDE = ("direction", "start", "point")  # dims beside that of the parameter


def plot_bifurcation_diagram(
    diagram: xr.Dataset, *, variable: str = "v1", ax: Axes | None = None
) -> Axes:
    """Draw a coordinate of the section over a parameter, each direction in its colour.

    Parameters
    ----------
    diagram
        Dims of the parameter and ``point``; with a dim ``direction`` ("down", "up", or other names
        of starts) each is drawn in its own colour; with a dim ``start`` all in one. NaN points are
        left out.
    variable
        Name of the data variable: "x1", "v1", "phase", or another number of each member.
    ax
        Where to draw; a new figure if not given.

    Returns
    -------
    Axes
        What was drawn on.
    """
    check_dataset("diagram", diagram, "vi.bifurcation_sweep")
    array = variable_of(diagram, variable, "Coordinates are those of vi.bifurcation_sweep.")
    parameter = parameter_of(array)
    with style.drawing(ax, width=1.6 * style.WIDTH, height=1.1 * style.HEIGHT) as ax:
        if "direction" not in array.dims:
            _draw(ax, array, parameter, color=style.BLUE)
        else:
            for name, looks in looks_of(array).items():
                _draw(ax, array.sel(direction=name), parameter, **looks)
            style.legend_outside(ax)
        along = symbol(variable) if COORDINATE.fullmatch(variable) else label_of(array)
        ax.set(xlabel=parameter_label(parameter), ylabel=along)
    return ax


def looks_of(array: xr.DataArray) -> dict[str, dict[str, Any]]:
    """Colour and label of each direction that there is, in the order of drawing."""
    parameter = parameter_of(array)
    sign = r"$\omega$" if parameter == "omega" else parameter_label(parameter)
    present = [str(name) for name in array["direction"].values]
    others = [name for name in present if name not in DIRECTIONS]
    looks = {n: {"label": f"followed with {sign} {n}"} | look for n, look in DIRECTIONS.items()}
    looks |= {n: {"label": n, "color": OTHERS[i % len(OTHERS)]} for i, n in enumerate(others)}
    return {name: look for name, look in looks.items() if name in present}


def parameter_of(array: xr.DataArray) -> str:
    """The dim that is drawn across."""
    names = [str(name) for name in array.dims if name not in BESIDE]
    if len(names) != 1:
        raise InvalidParameterError(
            f"{array.name} has the dims {', '.join(map(str, array.dims))}: must have one "
            "parameter. Over two, plot_plane draws it; or select one value with .isel(...)."
        )
    return names[0]


def _draw(ax: Axes, array: xr.DataArray, parameter: str, **looks: Any) -> None:
    y = array.transpose(parameter, ...).values.reshape(array.sizes[parameter], -1)
    value = np.broadcast_to(array[parameter].values[:, None], y.shape)
    known = np.isfinite(y)
    style.points(ax, value[known], y[known], **({"markersize": 0.7} | looks))
