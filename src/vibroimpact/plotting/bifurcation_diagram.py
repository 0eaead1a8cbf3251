"""Bifurcation diagrams: a section's coordinate over a parameter."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.model.state import COORDINATE
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import parameter_label
from vibroimpact.plotting.sections import coordinate_label
from vibroimpact.plotting.variables import check_dataset, label_of, units_of_sweep, variable_of
from vibroimpact.sweeps.member_status import MemberStatus

# Drawn in this order: large and light below, small and dark above.
DIRECTIONS: dict[str, dict[str, Any]] = {
    "up": {"color": style.ORANGE, "markersize": 1.6},
    "down": {"color": style.BLUE, "markersize": 0.7},
}
BOTH: dict[str, Any] = {"color": style.BLACK, "markersize": 0.7, "label": "both ways"}
# Points that are nearer, relative to the ordinate, are drawn as one.
RESOLUTION_OF_ORDINATE = 1 / 300
# Kolmogorov and Smirnov's bound at 5 % is so many times the root of 2 / (number of points).
KOLMOGOROV_FACTOR = 1.36
NO_IMPACT = "at the foot: no impact at this stop"
OTHER_COLOURS = (style.VERMILION, style.GREEN, style.PURPLE, style.BLACK)
# An array may have these dims beside that of the parameter.
DIMS_BESIDE = ("direction", "start", "point", "strobe")


def plot_bifurcation_diagram(
    diagram: xr.Dataset, *, variable: str = "v1", ax: Axes | None = None
) -> Axes:
    """Draw a coordinate of the section over a parameter, each direction in its colour.

    Where the points of up and down agree, as samples of one set, they are black: "both ways".

    Parameters
    ----------
    diagram
        Dims of the parameter and ``point``; with a dim ``direction`` ("down", "up", or other names
        of starts) each is drawn in its own colour; with a dim ``start`` all in one. NaN points are
        left out.
    variable
        Name of the data variable: "x1", "v1", "phase", or another number of each member.

    Returns
    -------
    Axes
        The Axes drawn on. The axis holds all values of the parameter; marks at its foot, in the
        colours of the directions, are those at which a whole window passes without an impact at
        the stop. ``at_phase`` of :func:`~vibroimpact.bifurcation_sweep` shows such motions.
    """
    check_dataset("diagram", diagram, "vi.bifurcation_sweep")
    variable_of(diagram, variable, "Coordinates are those of vi.bifurcation_sweep.")
    units = units_of_sweep(diagram)
    array = diagram[variable]
    parameter = parameter_of(array)
    with style.drawing(ax, width=1.6 * style.WIDTH, height=1.1 * style.HEIGHT) as ax:
        if "direction" not in array.dims:
            _draw(ax, array, parameter, color=style.BLUE)
        else:
            for rows, looks in shown(array):
                _draw(ax, rows, parameter, **looks)
        if COORDINATE.fullmatch(variable):
            _mark_silent(ax, array, diagram.get("end"))
        if ax.get_legend_handles_labels()[0]:
            style.legend_outside(ax)
        after = "strobe" not in array.dims
        own = COORDINATE.fullmatch(variable)
        along = coordinate_label(variable, units, after) if own else label_of(array, units)
        style.whole_range(ax, array[parameter].values)
        ax.set(xlabel=parameter_label(parameter, units), ylabel=along)
    return ax


def looks_of(array: xr.DataArray) -> dict[str, dict[str, Any]]:
    """Colour and label of each direction that there is, in the order of drawing."""
    parameter = parameter_of(array)
    sign = r"$\omega$" if parameter == "omega" else parameter_label(parameter)
    present = [str(name) for name in array["direction"].values]
    others = [name for name in present if name not in DIRECTIONS]
    looks = {n: {"label": f"followed with {sign} {n}"} | look for n, look in DIRECTIONS.items()}
    looks |= {
        n: {"label": n, "color": OTHER_COLOURS[i % len(OTHER_COLOURS)]}
        for i, n in enumerate(others)
    }
    return {name: look for name, look in looks.items() if name in present}


def shown(array: xr.DataArray) -> Iterator[tuple[xr.DataArray, dict[str, Any]]]:
    """Points of each direction with their style; up and down together where they agree."""
    looks = looks_of(array)
    rows = {name: array.sel(direction=name, drop=True) for name in looks}
    if set(DIRECTIONS) <= set(looks):
        both = _agreement(*(rows[name] for name in DIRECTIONS))
        rows |= {name: rows[name].where(~both) for name in DIRECTIONS}
        rows["both"] = array.sel(direction=list(DIRECTIONS)).where(both)
        looks["both"] = BOTH
    yield from ((rows[name], looks[name]) for name in looks)


def _agreement(up: xr.DataArray, down: xr.DataArray) -> xr.DataArray:
    """Whether the points of both ways are samples of one set, value by value of the parameter."""
    parameter = parameter_of(up)
    size = up.sizes[parameter]
    columns = [way.transpose(parameter, ...).values.reshape(size, -1) for way in (up, down)]
    known = np.concatenate([column[np.isfinite(column)] for column in columns])
    near = RESOLUTION_OF_ORDINATE * float(np.ptp(known)) if known.size else 0.0
    same = [_same_set(a, b, near) for a, b in zip(*columns, strict=True)]
    return xr.DataArray(same, {parameter: up[parameter].values}, [parameter])


def _same_set(first: Floats, second: Floats, near: float) -> bool:
    """Whether distributions of points agree, within the resolution of the figure."""
    a, b = (np.sort(points[np.isfinite(points)]) for points in (first, second))
    if not (a.size and b.size):
        return False
    apart = max(
        float(np.max(np.arange(1, len(x) + 1) / len(x)
                     - np.searchsorted(y, x + near, side="right") / len(y)))
        for x, y in ((a, b), (b, a))
    )  # fmt: skip
    return bool(apart < min(0.5, KOLMOGOROV_FACTOR * np.sqrt(1.0 / len(a) + 1.0 / len(b))))


def _mark_silent(ax: Axes, array: xr.DataArray, end: xr.DataArray | None) -> None:
    """Mark members that reached their end without a section point, a row for each direction."""
    parameter = parameter_of(array)
    silent = array.isnull().all([d for d in ("point", "strobe", "start") if d in array.dims])
    if end is not None:
        silent &= (end == MemberStatus.OK).all([d for d in ("start",) if d in end.dims])
    ways = looks_of(array) if "direction" in array.dims else {"": {"color": style.BLUE}}
    for row, (name, looks) in enumerate(ways.items()):
        here = silent.sel(direction=name) if name else silent
        style.at_foot(ax, array[parameter].values[here.values], looks["color"], row)
    if silent.any():
        ax.plot([], [], "s", color=style.GREY, label=NO_IMPACT)


def parameter_of(array: xr.DataArray) -> str:
    """Dim of the abscissa."""
    names = [str(name) for name in array.dims if name not in DIMS_BESIDE]
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
