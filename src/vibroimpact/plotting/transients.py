"""Pictures of transients: free decay, sine sweeps, records and the responses to them, spectra."""

from __future__ import annotations

import re

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from vibroimpact._core.checks import check_choice, check_kind
from vibroimpact.machines.units import Units, units_of
from vibroimpact.measures.measure import Peak, Row
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import band_label
from vibroimpact.plotting.history import STOPS
from vibroimpact.transients.force_record import ForceRecord
from vibroimpact.transients.free_decay import FreeDecay
from vibroimpact.transients.record_response import RecordResponse
from vibroimpact.transients.response_spectrum import ResponseSpectrum
from vibroimpact.transients.sine_sweep import SineSweep

TRANSIENT_POINTS = 6000  # a curve of a transient has so many points
MOST_LARGE_MARKS = 200  # marks of more impacts are small
SHOWN_FALLS = 1.3  # a decay is cut off after so many times the later fall
PANEL_HEIGHTS = (1, 3)  # a record and the response to it have heights in this ratio
SPECTRA = {  # labels and quantities
    "displacement": ("largest $|x|$", "length"),
    "pseudo_velocity": ("pseudo-velocity", "velocity"),
    "pseudo_acceleration": ("pseudo-acceleration", "acceleration"),
    "acceleration": ("largest acceleration", "acceleration"),
    "impulse": ("largest impulse", "impulse"),
    "impacts": ("impacts", ""),
}


def plot_free_decay(decay: FreeDecay, *, ax: Axes | None = None) -> Axes:
    """Draw the decay of a row with impacts and without, and when each has fallen.

    Parameters
    ----------
    decay
        A result of :func:`vibroimpact.free_decay`.

    Notes
    -----
    Dashed lines are the part of the largest value below which the row has to stay, ticks at the lower
    edge are impacts.
    """
    check_kind("decay", decay, FreeDecay, "a FreeDecay, as vi.free_decay gives")
    units = units_of(decay.system)
    falls = [time for time in (decay.time, decay.time_without) if np.isfinite(time)]
    end = min(decay.duration, SHOWN_FALLS * max(falls, default=np.inf)) or decay.duration
    cut = max(1.0, decay.duration / end)
    t, with_impacts, without = decay.histories(int(TRANSIENT_POINTS * min(cut, 50.0)))
    shown = t <= end
    looks = ((without, decay.time_without, style.ORANGE, "without impacts"),
             (with_impacts, decay.time, style.BLUE, "with impacts"))  # fmt: skip
    with style.drawing(ax, width=1.6 * style.WIDTH) as ax:
        for values, fall, colour, name in looks:
            if values is None:
                continue
            until = units.text(fall, quantity="time", digits=4) if np.isfinite(fall) else "never"
            ax.plot(t[shown], values[shown], color=colour, linewidth=0.8, label=f"{name}: {until}")
            if np.isfinite(fall) and fall <= end:
                ax.axvline(fall, color=colour, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=0)
        level = decay.remaining * decay.reference
        for y in (level, -level):
            label = f"{100.0 * decay.remaining:g} % of the largest" if y > 0.0 else None
            ax.axhline(y, color=style.GREY, linewidth=0.7, linestyle=(0, (4, 2)), label=label)
        hit = decay.run.time[decay.run.impacts]
        style.at_foot(ax, hit[hit <= end], style.BLACK)
        if hit.size:
            ax.plot([], [], "s", color=style.BLACK, label="impacts")
        ax.set(
            xlabel=units.label("time $t$", "time"), xlim=(0.0, end),
            ylabel=_of_row(units, decay.row),
        )  # fmt: skip
        style.legend_outside(ax, columns=2)
    return ax


def plot_sine_sweep(swept: SineSweep, quantity: str = "peak", *, ax: Axes | None = None) -> Axes:
    """Draw what was observed in each step of a sine sweep, up and down.

    Parameters
    ----------
    swept
        A result of :func:`vibroimpact.sine_sweep`.
    quantity
        "peak", "amplitude", "rms", "mean" or "impacts".
    """
    check_kind("swept", swept, SineSweep, "a SineSweep, as vi.sine_sweep gives")
    found = swept.quantity(quantity)
    units = units_of(swept.system)
    looks = {
        "up": (style.BLUE, "-", "upwards"),
        "down": (style.VERMILION, (0, (3, 1)), "downwards"),
    }
    x = swept.values
    with style.drawing(ax, width=1.3 * style.WIDTH) as ax:
        for way, values in zip(swept.directions, found.values, strict=True):
            colour, line, name = looks[way]
            ax.plot(x, values, color=colour, linestyle=line, label=name)
        ylabel = (
            "impacts per forcing period" if quantity == "impacts"
            else _of_row(units, swept.row, f"{quantity} of ")
        )  # fmt: skip
        ax.set(xlabel=band_label(swept.band, units), ylabel=ylabel, xlim=(x[0], x[-1]))
        if quantity in ("peak", "amplitude", "rms"):
            ax.set_ylim(bottom=0.0)
        style.legend_outside(ax)
    return ax


def plot_record(record: ForceRecord, *, ax: Axes | None = None) -> Axes:
    """Draw a record over time.

    Parameters
    ----------
    record
        A :class:`vibroimpact.ForceRecord`.
    """
    check_kind("record", record, ForceRecord, "a ForceRecord")
    with style.drawing(ax, width=1.6 * style.WIDTH, height=0.8 * style.HEIGHT) as ax:
        _record(ax, record, units_of(record))
        ax.set(
            xlabel=units_of(record).label("time $t$", "time"),
            xlim=(record.time[0], record.time[-1]),
        )
    return ax


def plot_record_response(
    response: RecordResponse, row: Row = "x1", *, ax: Axes | None = None
) -> Axes:
    """Draw the response to a record over time, the impacts, and the record above them.

    Parameters
    ----------
    response
        A result of :func:`vibroimpact.simulate_record`.
    row
        "x1", "v1" or a sum such as "x2 - x1".
    ax
        Axes to draw the response on, without the record; a new figure of both if not given.

    Returns
    -------
    Axes
        The Axes of the response.
    """
    check_kind(
        "response", response, RecordResponse, "a RecordResponse, as vi.simulate_record gives"
    )
    units = units_of(response.system)
    first = float(response.record.time[0])
    last = first + response.duration
    hits = np.clip(response.impact_times, first, last)
    t = np.union1d(np.linspace(first, last, TRANSIENT_POINTS), hits)
    alone = ax is not None
    with style.drawing(ax, width=1.8 * style.WIDTH, height=1.3 * style.HEIGHT) as ax:
        if not alone:
            _record(_above(ax), response.record, units)
        ax.plot(t, response.row_at(row, t), color=style.BLACK, linewidth=0.7)
        small = len(hits) > MOST_LARGE_MARKS
        for side, name, colour, marker in STOPS:
            chosen = hits[response.run.side[response.run.impacts] == side]
            if chosen.size:
                ax.plot(
                    chosen, response.row_at(row, chosen), marker, color=colour, markersize=2.0 if small else 3.5,
                    label=f"impact at {name}", zorder=3, markeredgewidth=0.0, rasterized=small,
                )  # fmt: skip
        ax.set(
            xlabel=units.label("time $t$", "time"),
            xlim=(first, last),
            ylabel=_of_row(units, Peak(row).text),
        )
        if hits.size:
            style.legend_outside(ax)
    return ax


def plot_response_spectrum(
    spectrum: ResponseSpectrum, quantity: str = "pseudo_acceleration", *, ax: Axes | None = None
) -> Axes:
    """Draw a response spectrum over the natural frequency.

    Parameters
    ----------
    spectrum
        A result of :func:`vibroimpact.response_spectrum`.
    quantity
        "displacement", "pseudo_velocity", "pseudo_acceleration", "acceleration", "impacts" or "impulse".
    ax
        Axes to draw on, such as those of another spectrum; a new figure if not given.
    """
    check_kind(
        "spectrum", spectrum, ResponseSpectrum, "a ResponseSpectrum, as vi.response_spectrum gives"
    )
    check_choice("quantity", quantity, list(SPECTRA))
    values = getattr(spectrum, quantity)
    units = units_of(spectrum.record)
    at = units.text(spectrum.clearance, quantity="length")
    stops = "no stops" if np.isinf(spectrum.clearance) else f"stops at {at}"
    with style.drawing(ax, width=1.3 * style.WIDTH) as ax:
        colour = style.series(len(ax.get_lines()) + 1)[-1]
        ax.plot(
            spectrum.frequency, values, color=colour,
            label=rf"$\zeta={spectrum.zeta:g}$, {stops}",
        )  # fmt: skip
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        ax.xaxis.set_minor_locator(NullLocator())
        name = r"$\omega_n$" if spectrum.unit == "rad/s" else "$f_n$"
        ax.set(
            xlabel=f"natural frequency {name} [{spectrum.unit}]",
            ylabel=units.label(*SPECTRA[quantity]),
        )
        ax.set_ylim(bottom=0.0)
        style.legend_outside(ax, columns=2)
    return ax


def _above(ax: Axes) -> Axes:
    """Axes above those of a figure, for the same times."""
    figure = style.figure_of(ax)
    grid = figure.add_gridspec(2, 1, height_ratios=PANEL_HEIGHTS)
    ax.set_subplotspec(grid[1])
    above: Axes = figure.add_subplot(grid[0], sharex=ax)
    above.tick_params(bottom=False, labelbottom=False)
    above.spines["bottom"].set_visible(False)
    return above


def _record(ax: Axes, record: ForceRecord, units: Units) -> None:
    name = "$a$" if record.kind == "base" else "$f$"
    ax.plot(record.time, record.values, color=style.GREEN, linewidth=0.7)
    ax.axhline(0.0, color=style.GREY, linewidth=0.5, zorder=0)
    ax.set_ylabel(units.label(name, record.quantity))
    style.prefix_units(ax)


def _of_row(units: Units, row: str, before: str = "") -> str:
    """Label of a row: its letters with indices, and its unit."""
    letters = re.sub(r"([xva])(\d+)", r"\1_{\2}", row.replace("*", ""))
    quantity = {"x": "length", "v": "velocity", "a": "acceleration"}[re.findall("[xva]", row)[0]]
    return units.label(f"{before}${letters}$", quantity)
