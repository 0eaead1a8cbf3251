"""Common style of all figures: sizes on screen and in print, font, colours that colour-blind readers distinguish."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from io import BytesIO
from itertools import cycle, islice
from os import PathLike
from typing import Any, cast
from weakref import WeakSet

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.ticker import AutoLocator, LogFormatterSciNotation, ScalarFormatter

from vibroimpact._core.checks import check_count, check_kind, path_of
from vibroimpact._core.files import check_target, write_files
from vibroimpact._core.quantities import prefixed
from vibroimpact.results.files import PICTURES

# Okabe and Ito's palette (https://jfly.uni-koeln.de/color/)
BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
YELLOW = "#F0E442"
# colours that are not from the palette
GREY = "#8C8C8C"  # guide lines
SILVER = "#C4C4C4"  # areas: everything else
NOTHING = "#E9E9E9"  # areas without a number

UNDATED: Any = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}  # metadata by suffix

WIDTH = 3.4  # inches
HEIGHT = 2.5
COLUMNS = {1: 3.4, 2: 7.0}  # inches: one column of a journal and two, 86 mm and 178 mm
# Heights of figures in print are these parts of those on screen, at least and at most.
LEAST_HEIGHT_SHARE, LARGEST_HEIGHT_SHARE = 0.75, 1.2
LEGEND_ROW_INCHES = 0.17  # a row of a legend is so high
LABELS_INCHES = 0.55  # tick labels and the label of an ordinate are so wide
BAR_INCHES = 0.8  # a colour bar and its labels are so wide
LARGEST_SHARE_BESIDE = (
    0.36  # a legend that takes more of the width is above the axes, not beside them
)
TICKS_SHARE = 0.85  # tick labels that take more of the room between them are too near to each other
LEAST_TEXT_SHARE = 0.5  # texts of a drawing have this part of their size at least
FEWER_TICKS = (7, 6, 5, 4, 3, 2, 1)  # intervals between ticks then
MOST_VECTOR_POINTS = 2000  # a scatter of more points is stored as pixels, not as one path each
PIXELS_PER_INCH = 300
LEGEND_MARKER = 4.0  # points
FOOT_OF_AXES = 0.012  # the first row of marks at the lower edge is so high, relative to the axes
SHADES = ((BLACK, 0.0), (BLACK, 0.45), ("#FFFFFF", 0.45), (BLACK, 0.7), ("#FFFFFF", 0.7))
CONSTANT_RELATIVE_RANGE = 1e-6  # a number that varies less along an axis is drawn as constant

UNIT_OF_LABEL = re.compile(r"(.*)\[([^\[\]]+)\]")

RC: Any = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 10.0,
    "axes.labelsize": 11.0,
    "axes.titlesize": 10.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.offset_threshold": 6,  # digits that all ticks share, before these are set apart
    "axes.formatter.limits": (-4, 6),
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "legend.handletextpad": 0.4,
    "lines.linewidth": 1.0,
    "lines.solid_capstyle": "round",
    "savefig.dpi": PIXELS_PER_INCH,
    "pdf.fonttype": 42,  # letters of a font that journals accept
    "svg.fonttype": "path",  # looks the same without the fonts
    "svg.hashsalt": "vibroimpact",  # the same data give the same file
}


PRINT: Any = RC | {
    "font.size": 8.0, "axes.labelsize": 8.0, "axes.titlesize": 8.0, "xtick.labelsize": 7.0, "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0, "lines.linewidth": 0.9, "figure.constrained_layout.use": True,
}  # fmt: skip
_PRINTED: ContextVar[int] = ContextVar(
    "printed", default=0
)  # columns of the figures that are drawn; 0 on screen
_OWN: WeakSet[Figure] = WeakSet()  # figures that were made here, whose size may change
_WITH_BAR: WeakSet[Axes] = WeakSet()  # axes beside which is a colour bar


@contextmanager
def print_style(columns: int = 1) -> Iterator[None]:
    """Draw figures for a journal, as wide as its column or two, with letters of 7 and 8 points.

    Parameters
    ----------
    columns
        1 for figures of 3.4 inches (86 mm), 2 for figures of 7 inches (178 mm), at which they are to be printed.

    Notes
    -----
    Inside of ``with plotting.print_style():`` every plot has this style, and ``plt.subplots`` too, so that several
    plots are drawn beside each other. Everything is of one font, STIX, which agrees with Times. Legends have as many
    columns as fit, and lie beside or above their axes; a figure that they do not fit into is higher.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> from vibroimpact import plotting
    >>> oscillator = vi.ImpactOscillator(zeta=0.02, omega=2.0, restitution=0.8, clearance=0.0)
    >>> run = vi.simulate(oscillator, oscillator.free_start(), impacts=20)
    >>> with plotting.print_style(columns=1):
    ...     figure = run.plot().get_figure()
    >>> float(figure.get_figwidth())
    3.4
    """
    check_count("columns", columns, 1, max(COLUMNS))
    before = _PRINTED.set(columns)
    try:
        with mpl.rc_context(PRINT | {"figure.figsize": (COLUMNS[columns], HEIGHT)}):
            yield
    finally:
        _PRINTED.reset(before)


@contextmanager
def drawing(ax: Axes | None, *, width: float = WIDTH, height: float = HEIGHT) -> Iterator[Axes]:
    """Set the style while drawing on ``ax`` or a new figure, then restore the user's rcParams."""
    check_kind("ax", ax, (Axes, type(None)), "the Axes to draw on, or None for a new figure")
    columns = _PRINTED.get()
    with mpl.rc_context(PRINT if columns else RC):
        if ax is None:
            if columns:
                share = COLUMNS[columns] / width
                height *= min(max(share, LEAST_HEIGHT_SHARE), LARGEST_HEIGHT_SHARE)
                width = COLUMNS[columns]
            ax = plt.subplots(figsize=(width, height), layout="constrained")[1]
            _OWN.add(figure_of(ax))
        yield ax
        prefix_units(ax)
        _space_ticks(ax)


class _Prefixed(ScalarFormatter):
    """Tick labels of an axis whose numbers are shown in a part or a multiple of the unit of its data."""

    def __init__(self, factor: float, unit: str) -> None:
        super().__init__()
        self.factor, self.unit = factor, unit

    def set_axis(self, axis: Any) -> None:
        self.shown, self.axis = axis, None
        self.create_dummy_axis()

    def set_locs(self, locs: Any) -> None:
        cast(Any, self.axis).set_view_interval(*(self.shown.get_view_interval() / self.factor))
        super().set_locs(cast(Any, np.asarray(locs) / self.factor))

    def __call__(self, x: float, pos: int | None = None) -> str:
        return super().__call__(x / self.factor, pos)

    def format_data_short(self, value: Any) -> str:
        return f"{float(value) / self.factor:.6g}"


class _PrefixedLog(LogFormatterSciNotation):
    """The same of a logarithmic axis."""

    def __init__(self, factor: float, unit: str, **given: Any) -> None:
        super().__init__(**given)
        self.factor, self.unit = factor, unit

    def __call__(self, x: float, pos: int | None = None) -> str:
        return super().__call__(x / self.factor, pos)

    def format_data_short(self, value: Any) -> str:
        return f"{float(value) / self.factor:.6g}"


def prefix_units(ax: Axes) -> None:
    """Show the numbers of axes in mm or kN where they read better so: the data stay in the unit that is labelled."""
    for axis in (ax.xaxis, ax.yaxis):
        found = UNIT_OF_LABEL.fullmatch(axis.get_label_text())
        scale = axis.get_scale()
        if not found or scale not in ("linear", "log"):
            continue
        unit, before = found[2], axis.get_major_formatter()
        ours = before if isinstance(before, _Prefixed | _PrefixedLog) else None
        if ours and unit == prefixed(ours.factor, ours.unit)[1]:
            unit = ours.unit  # the label is that of an earlier call
        factor, shown = prefixed(float(np.abs(axis.get_view_interval()).max()), unit)
        if factor == 1.0 and not ours:
            continue
        axis.set_label_text(f"{found[1]}[{shown}]")
        if scale == "linear":
            axis.set_major_formatter(_Prefixed(factor, unit))
        else:
            axis.set_major_formatter(_PrefixedLog(factor, unit))
            axis.set_minor_formatter(
                _PrefixedLog(factor, unit, labelOnlyBase=False, minor_thresholds=(2, 0.5))
            )


def _space_ticks(ax: Axes) -> None:
    """Take fewer ticks along the abscissa where their labels would touch."""
    locator = ax.xaxis.get_major_locator()
    if not isinstance(locator, AutoLocator) or not ax.axison:
        return
    low, high = sorted(ax.get_xlim())
    scale = TICKS_SHARE * width_of_axes(ax) * figure_of(ax).dpi / (high - low)
    for fewer in FEWER_TICKS:
        places = np.asarray(ax.xaxis.get_majorticklocs())
        widths = np.array([one.get_window_extent().width for one in ax.xaxis.get_majorticklabels()])
        if len(widths) < len(places):
            return  # labels are not shown
        seen = (places >= low) & (places <= high)
        apart, half = scale * np.diff(places[seen]), widths[seen] / 2.0
        if np.all(apart >= half[1:] + half[:-1]):
            return
        locator.set_params(nbins=fewer, min_n_ticks=1)


def size_of_slot(ax: Axes) -> tuple[float, float]:
    """Width and height in inches of the place of axes in their figure, labels included."""
    width, height = (float(one) for one in figure_of(ax).get_size_inches())
    spec = ax.get_subplotspec()
    if spec is None:
        place = ax.get_position()
        return width * float(place.width), height * float(place.height)
    rows, columns = spec.get_gridspec().nrows, spec.get_gridspec().ncols
    return width * len(spec.colspan) / columns, height * len(spec.rowspan) / rows


def width_of_axes(ax: Axes) -> float:
    """Width in inches that a layout will give to axes, about."""
    labels = LABELS_INCHES + BAR_INCHES * (ax in _WITH_BAR)
    return max(size_of_slot(ax)[0] - labels, LABELS_INCHES)


def shrink_texts(ax: Axes, width: float, height: float) -> None:
    """Shrink the texts of a drawing of so many inches where its place is smaller."""
    here = size_of_slot(ax)
    share = max(min(1.0, here[0] / width, here[1] / height), LEAST_TEXT_SHARE)
    for text in ax.texts:
        text.set_fontsize(share * float(text.get_fontsize()))


def colour_bar(ax: Axes, colours: ScalarMappable, label: str, **bar: Any) -> Colorbar:
    """Draw a colour bar beside axes."""
    _WITH_BAR.add(ax)
    drawn = figure_of(ax).colorbar(colours, ax=ax, label=label, **bar)
    prefix_units(drawn.ax)
    return drawn


def series(count: int) -> list[str]:
    """Colours of so many lines, up to 31 different: the palette, then darker and lighter ones."""
    palette = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
    shaded = [mixed(colour, by, share) for by, share in SHADES[1:] for colour in palette[:-1]]
    return list(islice(cycle([*palette, *shaded]), count))


def mixed(colour: str, other: str, share: float) -> str:
    """Mix a colour with a share of another."""
    pair = np.array([to_rgb(colour), to_rgb(other)])
    return to_hex((1.0 - share) * pair[0] + share * pair[1]).upper()


def widen_constant(ax: Axes, axis: str = "y", size: float = 0.0) -> bool:
    """Widen an axis where the data vary by rounding only, beside their size or a given one; whether they do."""
    low, high = getattr(ax, f"get_{axis}lim")()
    middle, size = (low + high) / 2.0, max(abs(low), abs(high), size)
    constant = bool(abs(high - low) < CONSTANT_RELATIVE_RANGE * size)
    if constant:
        getattr(ax, f"set_{axis}lim")(middle - 0.05 * size, middle + 0.05 * size)
    return constant


def save(ax: Axes, path: str | PathLike[str]) -> None:
    """Write the figure of ``ax`` to an SVG, PNG or PDF file, without a date inside.

    Parameters
    ----------
    ax
        The Axes that a plot function returned.
    path
        Name of the file; the suffix decides the format.

    Raises
    ------
    InvalidParameterError
        No Axes, another suffix, no such folder, no permission.
    """
    check_kind("ax", ax, Axes, "the Axes that a plot function returned")
    target = path_of("path", path)
    check_target(target, PICTURES, "path")
    write_files({target: content_of_picture(ax, target.suffix.lower())})


def content_of_picture(ax: Axes, suffix: str) -> bytes:
    """Content of a file of the figure of ``ax``, without a date inside."""
    figure, data = figure_of(ax), BytesIO()
    with mpl.rc_context(RC):
        figure.savefig(data, format=suffix[1:], metadata=UNDATED.get(suffix))
    return data.getvalue()


def whole_range(ax: Axes, values: Any) -> None:
    """Extend the abscissa to all values of a parameter, including those without a point."""
    low, high = float(np.min(values)), float(np.max(values))
    if low < high:
        margin = ax.get_xmargin() * (high - low)
        ax.set_xlim(low - margin, high + margin)


def at_foot(ax: Axes, x: Any, colour: str, row: int = 0) -> None:
    """Draw marks in a row at the lower edge, for values of a parameter without a point."""
    if len(x):
        y, looks = FOOT_OF_AXES * (1 + 2 * row), {"color": colour, "marker": "s", "markersize": 2.0}
        points(ax, x, np.full(len(x), y), transform=ax.get_xaxis_transform(), **looks)


def points(ax: Axes, x: Any, y: Any, **style: Any) -> None:
    """Scatter points, smaller and as pixels when they are many."""
    count = len(x)
    given: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "markeredgewidth": 0.0,
        "markersize": 1.0 if count > MOST_VECTOR_POINTS else 1.8 if count > 100 else 4.0,
        "rasterized": count > MOST_VECTOR_POINTS,
    }
    ax.plot(x, y, **(given | style))


def legend_outside(ax: Axes, *, columns: int = 3, **given: Any) -> Legend:
    """Place a legend above the axes, where it covers no data, in as many columns as fit, with visible marks."""
    entries = len(given.get("handles") or ax.get_legend_handles_labels()[0])
    look = {
        "borderaxespad": 0.0,
        "borderpad": 0.2,
        "columnspacing": 1.2,
        "handlelength": 1.4,
    } | given
    for count in range(max(min(columns, entries), 1), 0, -1):
        legend = ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=count, **look)
        if count == 1 or width_of(legend) <= width_of_axes(ax):
            break
    figure, rows = figure_of(ax), -(-entries // count)
    if _PRINTED.get() and figure in _OWN:
        figure.set_figheight(figure.get_figheight() + (rows - 1) * LEGEND_ROW_INCHES)
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and "handles" not in given:
            handle.set_markersize(LEGEND_MARKER)
    return legend


def width_of(legend: Legend) -> float:
    """Width of a legend in inches."""
    return float(legend.get_window_extent().width / figure_of(legend).dpi)


def figure_of(artist: Artist) -> Figure:
    """Whole figure of a part of it."""
    return cast(Figure, artist.get_figure(root=True))
