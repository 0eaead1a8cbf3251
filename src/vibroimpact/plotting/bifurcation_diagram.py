"""Bifurcation diagram: a section's coordinate over omega."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from vibroimpact.errors import InvalidParameterError
from vibroimpact.plotting import style
from vibroimpact.plotting.sections import symbol

# Drawn in this order: large and light below, small and dark above, so that both are seen where
# they agree.
DIRECTIONS: dict[str, dict[str, Any]] = {
    "up": {"color": style.ORANGE, "markersize": 1.6},
    "down": {"color": style.BLUE, "markersize": 0.7},
}
OTHERS = (style.VERMILION, style.GREEN, style.PURPLE, style.BLACK)


def plot_bifurcation_diagram(
    diagram: xr.Dataset, *, variable: str = "v1", ax: Axes | None = None
) -> Axes:
    """Draw a coordinate of the section over omega, each direction of following in its colour.

    Parameters
    ----------
    diagram
        Dims ``omega`` and ``point``; with a dim ``direction`` ("down", "up", or other names of
        starts) each is drawn in its own colour. NaN points are left out.
    variable
        Name of the data variable: "x1", "v1", "phase", ...
    ax
        Where to draw; a new figure if not given.

    Returns
    -------
    Axes
        What was drawn on.
    """
    if variable not in diagram:
        raise InvalidParameterError(
            f"variable = {variable!r}: must be one of {', '.join(map(str, diagram.data_vars))}."
        )
    array = diagram[variable]
    with style.drawing(ax, width=1.6 * style.WIDTH, height=1.1 * style.HEIGHT) as ax:
        if "direction" not in array.dims:
            _draw(ax, array, color=style.BLUE)
        else:
            _directions(ax, array)
        ax.set(xlabel=r"forcing frequency $\omega$", ylabel=symbol(variable))
    return ax


def _directions(ax: Axes, array: xr.DataArray) -> None:
    present = [str(name) for name in array["direction"].values]
    others = [name for name in present if name not in DIRECTIONS]
    looks = DIRECTIONS | {name: {"color": OTHERS[i % len(OTHERS)]} for i, name in enumerate(others)}
    for name in [name for name in looks if name in present]:
        label = rf"followed with $\omega$ {name}" if name in DIRECTIONS else name
        _draw(ax, array.sel(direction=name), label=label, **looks[name])
    style.legend_outside(ax)


def _draw(ax: Axes, array: xr.DataArray, **looks: Any) -> None:
    y = array.transpose("omega", "point").values
    omega = np.broadcast_to(array["omega"].values[:, None], y.shape)
    known = np.isfinite(y)
    style.points(ax, omega[known], y[known], **({"markersize": 0.7} | looks))
