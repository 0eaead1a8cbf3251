"""Basins of attraction over two state coordinates, with the attractors marked."""

from __future__ import annotations

import re

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibroimpact._core.checks import check_flag
from vibroimpact.plotting import maps, motion_colours, style
from vibroimpact.plotting.sections import coordinate_label
from vibroimpact.plotting.variables import check_dataset, units_of_sweep
from vibroimpact.results.result import words_of_codes

MOST_ATTRACTORS = 7  # so many have a colour of their own
LETTER = re.compile(r" [a-z]{1,2}$")  # of attractors with one symbol
OTHER = "other attractors"
BEHIND = "behind stop"  # not a possible start
ELSEWHERE = "attractors marked there\nhave other values of what is not shown"
PENETRATING = "initial penetration"
MARKERS = "oDs^vPX"
MOST_MARKED_POINTS = 400  # so many points of an attractor are marked at most
MOST_LARGE_MARKS = 24  # so many different places, at RESOLUTION_OF_AXES, or fewer have large marks
RESOLUTION_OF_AXES = 1 / 200


def plot_basins(basins: xr.Dataset, *, ax: Axes | None = None, marks: bool = True) -> Axes:
    """Draw basins of attraction: the attractor of each start.

    Parameters
    ----------
    basins
        A result of :func:`vibroimpact.basins`.
    marks
        Mark the attractors at the final states of motions: at whole numbers of forcing periods, at
        the phase of the starts, projected on the plane. Those outside it are not shown.

    Returns
    -------
    Axes
        The Axes drawn on. The legend gives the share of the starts; those behind a stop do not
        count. An attractor may be marked there: its other coordinates are not those of the starts.
    """
    check_dataset("basins", basins, "vi.basins", ["attractor"])
    check_flag("marks", marks)
    units = units_of_sweep(basins)
    labels = basins["attractor"]
    across, up = maps.over_two(labels)
    with style.drawing(ax, width=1.6 * style.WIDTH, height=1.3 * style.HEIGHT) as ax:
        maps.categories(ax, labels, _shades(labels, explained=marks and _over_behind(basins)))
        limits = ax.get_xlim(), ax.get_ylim()
        if marks:
            _mark(ax, basins, (across, up))
        words = [coordinate_label(name, units, after_impact=False) for name in (across, up)]
        ax.set(xlabel=words[0], ylabel=words[1], xlim=limits[0], ylim=limits[1])
    return ax


def _over_behind(basins: xr.Dataset) -> bool:
    """Whether a mark of an attractor lies where no start is possible: its other coordinates differ."""
    labels = basins["attractor"]
    across, up = maps.over_two(labels)
    behind = [
        code
        for code, words in words_of_codes(labels).items()
        if words == PENETRATING.replace(" ", "_")
    ]
    shade = np.isin(labels.transpose(across, up).values, behind)
    found = np.flatnonzero((labels.values >= 0).ravel())
    places = []
    for name in (across, up):
        axis, end = np.asarray(basins[name].values, dtype=float), _final(basins, name)[found]
        inside = (end >= axis.min()) & (end <= axis.max())
        places.append(np.where(inside, np.abs(end[:, None] - axis).argmin(axis=1), -1))
    shown = (places[0] >= 0) & (places[1] >= 0)
    return bool(shade[places[0][shown], places[1][shown]].any())


def _shades(labels: xr.DataArray, *, explained: bool = False) -> list[maps.Shade]:
    """Shades with their shares of the possible starts: those behind a stop have no share."""
    meanings = words_of_codes(labels)
    codes = sorted(meanings, key=lambda code: (code < 0, abs(code)))
    words = {code: meanings[code].replace("_", " ") for code in codes}
    words = {code: BEHIND if word == PENETRATING else word for code, word in words.items()}
    found = maps.shades(words, _colours(labels), OTHER, {BEHIND: style.NOTHING})
    possible = np.isin(labels.values, [code for code in codes if words[code] != BEHIND])
    total = max(int(possible.sum()), 1)

    def label(shade: maps.Shade) -> str:
        share = 100.0 * float(np.isin(labels.values, shade.codes).sum()) / total
        if shade.words == BEHIND:
            return f"{BEHIND} at the start; {ELSEWHERE}" if explained else BEHIND
        return f"{shade.words}, {share:.3g}%"

    return [shade._replace(words=label(shade)) for shade in found]


def _colours(labels: xr.DataArray) -> dict[int, str]:
    """Colours of attractors by code; a part of the dataset has the colours of the whole."""
    held = {code: words for code, words in words_of_codes(labels).items() if code >= 0}
    names = {words.replace("_", " "): code for code, words in held.items()}
    order = maps.with_mirrors({words: -code for words, code in names.items()})
    order = order[:MOST_ATTRACTORS]
    colours = motion_colours.colours_of([LETTER.sub("", name) for name in order])
    return {names[name]: colour for name, colour in zip(order, colours, strict=True)}


def _mark(ax: Axes, basins: xr.Dataset, names: tuple[str, str]) -> None:
    """Mark the final states of members of each basin, with one kind of mark per attractor."""
    ends = [_final(basins, name) for name in names]
    labels, colours = basins["attractor"].values, _colours(basins["attractor"])
    for code in [code for code in words_of_codes(basins["attractor"]) if code >= 0]:
        here = np.flatnonzero((labels == code).ravel())[:MOST_MARKED_POINTS]
        x, y = (end[here] for end in ends)
        few, colour = _places(ax, x, y) <= MOST_LARGE_MARKS, colours.get(code, style.SILVER)
        dark = colour in (motion_colours.CHAOTIC, motion_colours.NOT_PERIODIC)
        ax.plot(
            x, y, linestyle="none", marker=MARKERS[code % len(MARKERS)] if few else ".",
            markersize=5.5 if few else 2.0,
            markerfacecolor=colour if few else "white" if dark else style.BLACK,
            markeredgecolor=style.BLACK, markeredgewidth=0.9 if few else 0.0, clip_on=True,
        )  # fmt: skip


def _places(ax: Axes, x: NDArray[np.float64], y: NDArray[np.float64]) -> int:
    """Number of visibly different places."""
    sizes = np.ptp([ax.get_xlim(), ax.get_ylim()], axis=1) * RESOLUTION_OF_AXES
    return len(np.unique(np.round(np.column_stack([x, y]) / sizes), axis=0))


def _final(basins: xr.Dataset, name: str) -> NDArray[np.float64]:
    """Final value of a coordinate of every member, flat, in the order of the labels."""
    over = basins["attractor"].dims
    if name == "phase":
        array = basins["final_phase"].transpose(*over).values
    else:
        kind = "final_position" if name[0] == "x" else "final_velocity"
        array = basins[kind].transpose(*over, ...).values[..., int(name[1:]) - 1]
    return np.asarray(array, dtype=float).ravel()
