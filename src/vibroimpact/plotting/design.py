"""Plots of designs: response before and after, the search, maps over a plane, a Pareto front."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from vibroimpact._core.checks import check_choice, check_kind
from vibroimpact.design.maps import DesignMap
from vibroimpact.design.objective import Judge
from vibroimpact.design.optimise import Design
from vibroimpact.design.pareto import ParetoFront
from vibroimpact.design.search import UNVALUED_WORTH
from vibroimpact.machines.units import Units, units_of
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import band_label, parameter_label

LINEAR_VALUES = 200  # the linear machine is drawn through so many values
KINDS = ("response", "search")
JUDGED = (
    style.SILVER,
    style.SKY,
    style.BLUE,
    style.BLACK,
)  # machines by their judge, the last the finest


def plot_design(design: Design, *, what: str = "response", ax: Axes | None = None) -> Axes:
    """Draw a design: its response over the band beside that without impacts, or the search for it.

    Parameters
    ----------
    design
        A result of :func:`vibroimpact.optimise`.
    what
        "response": the worst motion at each value of the band, from all starts; "search": every
        machine that was tried, a colour for each number of values and starts by which it was judged, with a
        line for the best so far.
    """
    check_kind("design", design, Design, "a Design, as vi.optimise gives")
    check_choice("what", what, KINDS)
    with style.drawing(ax, width=1.5 * style.WIDTH, height=1.2 * style.HEIGHT) as ax:
        if what == "response":
            _response(ax, design)
        else:
            _search(ax, design)
    return ax


def _response(ax: Axes, design: Design) -> None:
    judge, row = design.judge, np.array(list(design.parameters.values()))
    units, over = units_of(design.system), judge.band.factor
    fine, coarse = judge.band.values(LINEAR_VALUES), judge.band.values(judge.objective.points)
    ax.plot(over * fine, judge.opened(LINEAR_VALUES), color=style.GREY, label="without impacts")
    ax.plot(
        over * coarse, judge.over_band(row), color=style.BLUE, marker="o", markersize=2.5,
        label="best machine, verified, worst of all starts",
    )  # fmt: skip
    ax.set(xlabel=band_label(judge.band, units), ylabel=_text(judge, units))
    ax.set_ylim(bottom=0.0)
    style.legend_outside(ax, columns=2)


def _search(ax: Axes, design: Design) -> None:
    search = design.search
    worth, levels = np.array(search.worth), np.array(search.levels)
    values = np.where(worth < UNVALUED_WORTH, design.objective.sign * worth, np.nan)
    tried, (count, best) = np.arange(1, len(values) + 1), map(np.array, design.history)
    for level, judge in enumerate(search.judges):
        o, at = judge.objective, levels == level
        colour = JUDGED[min(level, len(JUDGED) - 1)]
        text = f"{o.points} values, {o.starts} starts"
        style.points(ax, tried[at], values[at], color=colour, label=text)
        own = levels[count - 1] == level
        ax.step(count[own], best[own], where="post", color=colour)
    ax.set(xlabel="machines tried", ylabel=_text(design.judge, units_of(design.system)))
    valued = values[np.isfinite(values)]
    low, high = float(valued.min()), float(np.quantile(valued, 0.95))
    ax.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    style.legend_outside(ax, columns=2)


def plot_design_map(found: DesignMap, *, ax: Axes | None = None) -> Axes:
    """Draw a design map: reduction in decibels, the best second parameter, the region within 1 dB.

    Parameters
    ----------
    found
        A result of :func:`vibroimpact.design_map`.

    Returns
    -------
    Axes
        The Axes drawn on; the region within 1 dB of the best machine is outlined.
    """
    check_kind("found", found, DesignMap, "a DesignMap, as vi.design_map gives")
    units = units_of(found.system)
    first, second = found.axes
    x, y = found.axes.values()
    gains: Any = np.ma.masked_invalid(found.reduction_db.T)
    size = float(np.abs(gains).max() or 1.0)
    with style.drawing(ax, width=1.4 * style.WIDTH, height=1.3 * style.HEIGHT) as ax:
        mesh = ax.pcolormesh(
            x, y, gains, cmap="RdBu", norm=Normalize(-size, size), shading="nearest",
            rasterized=True,
        )  # fmt: skip
        if min(found.within.shape) > 1:
            ax.contour(
                x, y, found.within.T.astype(float), [0.5], colors=style.BLACK, linewidths=0.8
            )
        ax.plot(
            x, found.ridge, color=style.BLACK,
            linestyle="--", linewidth=0.9, label=f"best {second.replace('_', ' ')}",
        )  # fmt: skip
        style.colour_bar(ax, mesh, "reduction [dB]")
        ax.set(xlabel=parameter_label(first, units), ylabel=parameter_label(second, units))
        style.legend_outside(ax, columns=1)
    return ax


def plot_pareto_front(front: ParetoFront, *, ax: Axes | None = None) -> Axes:
    """Draw a Pareto front: one point for each machine.

    Parameters
    ----------
    front
        A result of :func:`vibroimpact.pareto_front`.
    """
    check_kind("front", front, ParetoFront, "a ParetoFront, as vi.pareto_front gives")
    units = units_of(front.system)
    with style.drawing(ax, width=1.2 * style.WIDTH, height=1.2 * style.HEIGHT) as ax:
        ax.plot(
            *front.values.T, color=style.BLUE, marker="o", markersize=3.0,
            linewidth=0.6, drawstyle="steps-post",
        )  # fmt: skip
        ax.set(**{
            f"{axis}label": _text(judge, units)
            for axis, judge in zip("xy", front.judges, strict=True)
        })  # fmt: skip
    return ax


def _text(judge: Judge, units: Units) -> str:
    text = re.sub(r"\b([xva])(\d+)", r"$\1_{\2}$", judge.measure.label)
    return units.label(f"{judge.objective.kind} {text}", judge.measure.dimension)
