"""Basins of attraction over two state coordinates, with the attractors marked."""

from __future__ import annotations

import re

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibroimpact.checks import check_flag
from vibroimpact.ensembles.motions import flags
from vibroimpact.plotting import maps, style
from vibroimpact.plotting.variables import check_dataset

COLOURS = (
    style.SKY, style.ORANGE, style.GREEN, style.YELLOW, style.PURPLE, style.BLUE, style.VERMILION,
)  # fmt: skip
OTHER = "other attractors"
MARKERS = "oDs^vPX"
MARKED = 400  # points of an attractor that are marked
PLACES = 24  # fewer different places, told apart at RESOLUTION of the axes: large marks
RESOLUTION = 1 / 200


def plot_basins(basins: xr.Dataset, *, ax: Axes | None = None, marks: bool = True) -> Axes:
    """Draw which start leads to which attractor.

    Parameters
    ----------
    basins
        What :func:`vibroimpact.basins` returned.
    ax
        Where to draw; a new figure if not given.
    marks
        Mark the attractors where motions from the starts end: states at whole numbers of forcing
        periods, at the phase of the starts, projected on the plane. Those outside it are not seen.

    Returns
    -------
    Axes
        What was drawn on. The legend gives the share of the starts.
    """
    check_dataset("basins", basins, "vi.basins", ["attractor"])
    check_flag("marks", marks)
    labels = basins["attractor"]
    across, up = maps.over_two(labels)
    with style.drawing(ax, width=1.6 * style.WIDTH, height=1.3 * style.HEIGHT) as ax:
        maps.categories(ax, labels, _shades(labels))
        limits = ax.get_xlim(), ax.get_ylim()
        if marks:
            _mark(ax, basins, (across, up))
        ax.set(xlabel=coordinate_label(across), ylabel=coordinate_label(up))
        ax.set(xlim=limits[0], ylim=limits[1])
    return ax


def coordinate_label(name: str) -> str:
    """A state coordinate as a formula: x1, v1, phase."""
    if name == "phase":
        return r"$\theta$ [rad]"
    kind, number = re.fullmatch(r"([xv])(\d+)", name).groups()  # type: ignore[union-attr]
    return f"$x_{{{number}}}$" if kind == "x" else rf"$\dot x_{{{number}}}$"


def _shades(labels: xr.DataArray) -> list[maps.Shade]:
    """With shares of the starts; attractors keep their colours in a part that others are not in."""
    meanings = flags(labels)
    codes = sorted(meanings, key=lambda code: (code < 0, abs(code)))
    words = {code: meanings[code].replace("_", " ") for code in codes}
    attractors = (code for code in codes if code >= 0)
    found = maps.shades(words, dict(zip(attractors, COLOURS, strict=False)), OTHER, {})
    shares = (100.0 * float(np.isin(labels.values, shade.codes).mean()) for shade in found)
    return [s._replace(words=f"{s.words}, {x:.3g}%") for s, x in zip(found, shares, strict=True)]


def _colour(code: int) -> str:
    """Of an attractor."""
    return COLOURS[code] if code < len(COLOURS) else style.SILVER


def _mark(ax: Axes, basins: xr.Dataset, names: tuple[str, str]) -> None:
    """Where members of each basin end, each attractor with a mark of its own."""
    ends = [_final(basins, name) for name in names]
    labels = basins["attractor"].values
    for code in [code for code in flags(basins["attractor"]) if code >= 0]:
        here = np.flatnonzero((labels == code).ravel())[:MARKED]
        x, y = (end[here] for end in ends)
        few = _places(ax, x, y) <= PLACES
        ax.plot(
            x, y, linestyle="none", marker=MARKERS[code % len(MARKERS)] if few else ".",
            markersize=5.5 if few else 2.0, markerfacecolor=_colour(code) if few else style.BLACK,
            markeredgecolor=style.BLACK, markeredgewidth=0.9 if few else 0.0, clip_on=True,
        )  # fmt: skip


def _places(ax: Axes, x: NDArray[np.float64], y: NDArray[np.float64]) -> int:
    """How many different places the reader sees."""
    sizes = np.ptp([ax.get_xlim(), ax.get_ylim()], axis=1) * RESOLUTION
    return len(np.unique(np.round(np.column_stack([x, y]) / sizes), axis=0))


def _final(basins: xr.Dataset, name: str) -> NDArray[np.float64]:
    """A coordinate of every member at the end, flat, in the order of the labels."""
    over = basins["attractor"].dims
    if name == "phase":
        array = basins["final_phase"].transpose(*over).values
    else:
        kind = "final_position" if name[0] == "x" else "final_velocity"
        array = basins[kind].transpose(*over, ...).values[..., int(name[1:]) - 1]
    return np.asarray(array, dtype=float).ravel()
