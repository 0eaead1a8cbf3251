"""Plot of a plane of two parameters, by category or by number."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, LogNorm, Normalize, TwoSlopeNorm
from matplotlib.ticker import MaxNLocator

from vibroimpact._core.checks import check_count, check_kind, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.units import Units
from vibroimpact.plotting import maps, motion_colours, rotation_look, style
from vibroimpact.plotting.branch_looks import parameter_label
from vibroimpact.plotting.variables import check_dataset, label_of, units_of_sweep, variable_of
from vibroimpact.sweeps.analyses.motion_codes import Category, categories
from vibroimpact.sweeps.analyses.plane import ADDED, MADE_OF, with_motions

MOST_MOTIONS = 7  # so many symbols have a colour of their own at most
OTHER = "other periodic"
SYMBOL = re.compile(r"(\d+-)?\d+-\d+(,\d+-\d+)*( \(contact \d+(, \d+)*\))?")
PLAIN = {
    "not periodic": motion_colours.NOT_PERIODIC,
    "chaotic": motion_colours.CHAOTIC,
    "no impacts": motion_colours.WITHOUT_IMPACTS,
    "not computed": style.NOTHING,
}
MOST_STEPS = 12  # whole numbers that have a step of colour each
SIGNED, RISING = "RdBu_r", "cividis"  # distinguishable for colour-blind readers


def plot_plane(
    plane: xr.Dataset,
    *,
    variable: str = "motion",
    ax: Axes | None = None,
    most_motions: int = 7,
    symbols: Sequence[str] | None = None,
) -> Axes:
    """Draw a plane of two parameters.

    Parameters
    ----------
    plane
        A result of :func:`vibroimpact.plane` or :func:`vibroimpact.multistability`, a sweep or its
        store after reopening, or any dataset whose ``variable`` has two dims.
    variable
        "motion" (a colour per symbol n-p-q), "period", "impacts" (at all stops), "lyapunov" (blue
        below zero, darkest at minus infinity, white at zero, red above; each side has a scale of
        its own), "rotation" (grey also where the error is above 0.01), "attractors" (the number of
        attractors), or another number in the dataset.
    most_motions
        Symbols with a colour of their own, 1 to 7, the most frequent ones, mirror images next to
        each other; the rest is "other periodic". A symbol has the same colour in every picture.
    symbols
        These symbols instead, up to 7, in the order of the legend: ``["1-1-1", "2-2-2"]``.

    Returns
    -------
    Axes
        The Axes drawn on. The first dim is the abscissa, an axis of equal ratios (``np.geomspace``)
        on a logarithmic scale. Cells without a number are grey; for whole numbers those of 0, too.
    """
    check_dataset("plane", plane, "vi.plane, vi.multistability or vi.sweep")
    check_kind("variable", variable, str, "the name of a variable")
    plane = _completed(plane, variable)
    variable_of(plane, variable)
    units = units_of_sweep(plane)
    check_count("most_motions", most_motions, 1, MOST_MOTIONS)
    if symbols is not None:
        _check_symbols(symbols, variable)
    across, up = maps.over_two(plane[variable])
    with style.drawing(ax, width=1.5 * style.WIDTH, height=1.3 * style.HEIGHT) as ax:
        _draw(ax, plane, variable, most_motions if symbols is None else symbols, units)
        ax.set(xlabel=parameter_label(across, units), ylabel=parameter_label(up, units))
    return ax


def _completed(plane: xr.Dataset, variable: str) -> xr.Dataset:
    """Complete a sweep, as a store holds it, with the variables of :func:`vibroimpact.plane`."""
    made = variable not in plane and variable in ADDED and {*MADE_OF} <= set(plane.data_vars)
    return with_motions(plane, [variable]) if made else plane


def _check_symbols(symbols: Sequence[str], variable: str) -> None:
    """Refuse a value that is not a list of different symbols, at most as many as colours."""
    if variable != "motion":
        raise InvalidParameterError(
            f"symbols = {symbols!r}, variable = {variable!r}: symbols are the colours of 'motion'."
        )
    listed = isinstance(symbols, list | tuple) and 0 < len(symbols) <= MOST_MOTIONS
    words = [s for s in symbols if SYMBOL.fullmatch(str(s))] if listed else []
    if not listed or len(set(words)) < len(symbols):
        raise refusal(
            "symbols", symbols, f"1 to {MOST_MOTIONS} different ones, such as ['1-1-1', '2-2-2']"
        )


def _own_colours(found: Sequence[Category], chosen: Sequence[str] | int) -> dict[int, str]:
    """Colours by code, for the most frequent symbols or for the named ones that occur."""
    counts = {one.words: one.members for one in found if one.code >= 0}
    if isinstance(chosen, int):
        chosen = maps.with_mirrors(counts)[:chosen]
    code_of = {one.words: one.code for one in found}
    pairs = zip(chosen, motion_colours.colours_of(chosen), strict=True)
    return {code_of[symbol]: colour for symbol, colour in pairs if symbol in code_of}


def _draw(
    ax: Axes, plane: xr.Dataset, variable: str, chosen: Sequence[str] | int, units: Units
) -> None:
    field = plane[variable]
    field = field.astype(np.int8) if field.dtype == bool else field
    label = label_of(field, units)
    if "flag_meanings" in field.attrs:
        found = categories(field)
        words = {one.code: one.words for one in found}
        own = _own_colours(found, chosen)
        maps.categories(ax, field, maps.shades(words, own, OTHER, PLAIN))
    elif field.dtype.kind in "iu":
        _counts(ax, field, label)
    elif variable == "lyapunov":
        norm = _signed(field)
        field = field.where(field != -np.inf, norm.vmin)
        maps.numbers(
            ax, field, colormaps[SIGNED], norm, label, extend="both", ticks=_both_sides(norm)
        )
    elif rotation_look.draws(plane, variable):
        rotation_look.draw(ax, plane, variable, label)
    else:
        low, high = maps.ends(field.values)
        arrows = {0: "neither", 1: "min", 2: "max", 3: "both"}  # where numbers are beyond
        beyond = int((field < low).any()) + 2 * int((field > high).any())
        scale = Normalize(low, high)
        maps.numbers(ax, field, colormaps[RISING], scale, label, extend=arrows[beyond])


def _counts(ax: Axes, field: xr.DataArray, label: str) -> None:
    """Draw whole numbers, with one colour each or, if many, by ratio; zero and below are grey."""
    top = max(int(field.max()), 1)
    norm: Normalize = Normalize(0.5, 1.5)
    ticks: Any = MaxNLocator(integer=True, min_n_ticks=1)
    if top > MOST_STEPS:
        bits = top.bit_length()
        norm, ticks = LogNorm(1, top), [2**k for k in range(0, bits, 1 + bits // 10)]
    elif top > 1:
        norm = BoundaryNorm(np.arange(0.5, top + 1.0), 256)
    bar = {"ticks": ticks, "format": "{x:.0f}"}
    shown = field.where(field > 0)
    maps.numbers(ax, shown, colormaps[RISING], norm, label, "none", **bar).minorticks_off()


def _signed(field: xr.DataArray) -> TwoSlopeNorm:
    """Norm with zero in the middle of the colours and one scale on each side."""
    low, high = maps.ends(field.values)
    floor = 1e-3 * (max(abs(low), abs(high)) or 1.0)
    return TwoSlopeNorm(0.0, min(low, -floor), max(high, floor))


def _both_sides(norm: TwoSlopeNorm) -> list[float]:
    """Round numbers on both sides of zero, some four on each."""
    assert norm.vmin is not None
    assert norm.vmax is not None
    round_ones = MaxNLocator(4)
    below, above = round_ones.tick_values(norm.vmin, 0.0), round_ones.tick_values(0.0, norm.vmax)
    return [t for t in [*below[:-1], *above] if norm.vmin <= t <= norm.vmax]
