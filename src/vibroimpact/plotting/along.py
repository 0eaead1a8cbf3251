"""Plot of a number of each member along a parameter: Lyapunov exponent, impact speeds, ..."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from vibroimpact.plotting import style
from vibroimpact.plotting.bifurcation_diagram import parameter_of, shown
from vibroimpact.plotting.branch_looks import parameter_label
from vibroimpact.plotting.variables import check_dataset, label_of, units_of_sweep, variable_of

MARK_POINTS = 1.8  # marks are so large
DIRECTION_SIZE = 1.4  # times the size in a diagram, where more points are beside each other


def plot_along(along: xr.Dataset, *, variable: str = "lyapunov", ax: Axes | None = None) -> Axes:
    """Draw a number of each member along a parameter.

    Parameters
    ----------
    along
        Dataset with ``variable`` over one parameter, and optionally over "direction" or "start": a
        sweep, or a result of :func:`vibroimpact.bifurcation_sweep`.
    variable
        Name of the data variable. For "lyapunov" the line of zero is drawn: above it the motion is
        chaotic, and motions without impacts have no point. Minus infinity, as for motions that
        stick, is a triangle at the lower edge.
    """
    check_dataset("along", along, "vi.sweep or vi.bifurcation_sweep")
    variable_of(along, variable, "Others are observed with observe=[...].")
    units = units_of_sweep(along)
    array = along[variable]
    parameter = parameter_of(array)
    with style.drawing(ax, width=1.6 * style.WIDTH, height=style.HEIGHT) as ax:
        if variable == "lyapunov":
            ax.axhline(0.0, color=style.GREY, linewidth=0.6, zorder=0)
        if array.dtype.kind in "iu":
            ax.yaxis.set_major_locator(MaxNLocator(integer=True))
        _lines(ax, array, parameter)
        style.whole_range(ax, array[parameter].values)
        ax.set(xlabel=parameter_label(parameter, units), ylabel=label_of(array, units))
    return ax


def _lines(ax: Axes, array: xr.DataArray, parameter: str) -> None:
    several = "direction" in array.dims
    for rows, looks in shown(array) if several else [(array, {"color": style.BLUE})]:
        flat = rows.transpose(parameter, ...).values.reshape(rows.sizes[parameter], -1)
        value = np.repeat(array[parameter].values, flat.shape[1])
        _points(ax, value, flat.ravel(), **looks)
    if several:
        style.legend_outside(ax)


def _points(ax: Axes, value: Any, numbers: Any, **looks: Any) -> None:
    numbers = np.asarray(numbers)
    size = DIRECTION_SIZE * looks["markersize"] if "markersize" in looks else MARK_POINTS
    style.points(ax, value, numbers, **(looks | {"markersize": size}))
    below = np.asarray(value)[np.isneginf(numbers)]
    if below.size:
        looks |= {"label": "_", "marker": "v", "markersize": 2.0 * MARK_POINTS, "clip_on": False}
        style.points(ax, below, np.zeros(below.size), transform=ax.get_xaxis_transform(), **looks)
