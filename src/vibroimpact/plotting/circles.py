"""Plots of circles at a Neimark-Sacker point: predicted by the normal form, and simulated."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullLocator

from vibroimpact.plotting import style
from vibroimpact.plotting.sections import symbol
from vibroimpact.plotting.variables import check_dataset

COORDINATES = {"x1": style.BLUE, "v1": style.VERMILION}
MARKERS = ("o", "x", "s")  # by start, in the order of the data
DISTANCE = r"$|\omega-\omega_c|$"
MAKER = "vibroimpact_papers.impact_damper.circles"
HEADROOM_FACTOR = 3.0  # the upper limit of the errors leaves so much room for the words


def plot_circle_half_width(circles: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw half-widths of the circles in x1 and v1 over |omega - omega_c|, both logarithmic.

    Parameters
    ----------
    circles
        Dims ``offset`` (omega - omega_c), ``start``, ``coordinate``, with the variables
        ``predicted_half_width`` (offset, coordinate) and ``half_width`` (start, offset,
        coordinate).

    Returns
    -------
    Axes
        The Axes drawn on. Line: leading order of the normal form. Marks: simulated.
    """
    check_dataset("circles", circles, MAKER, ["offset", "predicted_half_width", "half_width"])
    distance = np.abs(circles["offset"].values)
    with style.drawing(ax) as ax:
        for name, colour in COORDINATES.items():
            at = circles.sel(coordinate=name)
            ax.loglog(distance, at["predicted_half_width"], color=colour, label=symbol(name))
            _marks(ax, circles, at["half_width"].values, color=colour)
        ax.set(xlabel=DISTANCE, ylabel="half-width")
        _few_ticks(ax)
        ax.legend(loc="upper left")
    return ax


def plot_circle_error(circles: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw the relative error of the predicted radius over |omega - omega_c|.

    Parameters
    ----------
    circles
        Dims ``offset`` and ``start``, with ``predicted_radius`` (offset) and ``radius`` (start,
        offset).

    Returns
    -------
    Axes
        The Axes drawn on. The line has slope one and passes through the last error of the first
        start.
    """
    check_dataset("circles", circles, MAKER, ["offset", "predicted_radius", "radius"])
    distance = np.abs(circles["offset"].values)
    error = np.abs(circles["radius"].values / circles["predicted_radius"].values - 1.0)
    with style.drawing(ax) as ax:
        ax.loglog(distance, error[0, -1] * distance / distance[-1], color=style.GREY,
                  label="slope 1")  # fmt: skip
        _marks(ax, circles, error, color=style.BLACK, named=True)
        ax.set(xlabel=DISTANCE, ylabel="relative error of radius")
        _few_ticks(ax)
        ax.set_ylim(top=ax.get_ylim()[1] * HEADROOM_FACTOR)
        ax.legend(loc="upper left")
    return ax


def plot_circles(circles: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw predicted circles as lines and simulated states as dots, in the paper's projection.

    Parameters
    ----------
    circles
        Dataset with ``predicted_points`` (offset, phase_of_z, coordinate) and ``points`` (offset,
        point, coordinate), states minus the critical one.
    """
    check_dataset("circles", circles, MAKER, ["offset", "predicted_points", "points"])
    with style.drawing(ax) as ax:
        for i in range(circles.sizes["offset"]):
            here = circles.isel(offset=i)
            x, y = (here["points"].sel(coordinate=c).values for c in COORDINATES)
            style.points(ax, x, y, color=style.SKY, markersize=2.6, rasterized=True)
            loop = here["predicted_points"].values[[*range(here.sizes["phase_of_z"]), 0]]
            names = circles["coordinate"].values.tolist()
            x, y = (loop[:, names.index(c)] for c in COORDINATES)
            ax.plot(x, y, color=style.BLACK, linewidth=0.6)
        across, up = (f"{symbol(name)} minus critical" for name in COORDINATES)
        ax.set(xlabel=across, ylabel=up)
    return ax


def _marks(ax: Axes, circles: xr.Dataset, values: Any, *, color: str, named: bool = False) -> None:
    """Draw one mark per distance and start; open, so that coinciding marks are both visible."""
    distance = np.abs(circles["offset"].values)
    names = circles["start"].values.tolist()
    for name, row, marker in zip(names, values, MARKERS, strict=False):
        ax.plot(distance, row, linestyle="none", marker=marker, markersize=5.0, color=color,
                markerfacecolor="none", label=f"from the {name}" if named else None)  # fmt: skip


def _few_ticks(ax: Axes) -> None:
    """Numbers at 1, 2, 5 of each decade, because few decades are shown."""
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(
            LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(np.inf, np.inf))
        )
        axis.set_minor_locator(NullLocator())
