"""Common style of all figures: sizes, fonts, colours that colour-blind readers can distinguish."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from itertools import cycle, islice
from os import PathLike
from typing import Any, cast

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from vibroimpact._core.checks import check_kind, path_of
from vibroimpact._core.files import check_target, write_files
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

WIDTH = 3.4  # inches: one column of a journal
HEIGHT = 2.5
LEGEND_ROW_INCHES = 0.17  # a row of a legend is so high
MOST_VECTOR_POINTS = 2000  # a scatter of more points is stored as pixels, not as one path each
PIXELS_PER_INCH = 300
LEGEND_MARKER = 4.0  # points
FOOT_OF_AXES = 0.012  # the first row of marks at the lower edge is so high, relative to the axes
SHADES = ((BLACK, 0.0), (BLACK, 0.45), ("#FFFFFF", 0.45), (BLACK, 0.7), ("#FFFFFF", 0.7))
CONSTANT_RELATIVE_RANGE = 1e-6  # a number that varies less along an axis is drawn as constant

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
    "svg.fonttype": "path",  # looks the same without the fonts
    "svg.hashsalt": "vibroimpact",  # the same data give the same file
}


@contextmanager
def drawing(ax: Axes | None, *, width: float = WIDTH, height: float = HEIGHT) -> Iterator[Axes]:
    """Set the style while drawing on ``ax`` or a new figure, then restore the user's rcParams."""
    check_kind("ax", ax, (Axes, type(None)), "the Axes to draw on, or None for a new figure")
    with mpl.rc_context(RC):
        if ax is None:
            ax = plt.subplots(figsize=(width, height), layout="constrained")[1]
        yield ax


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
    figure, data = cast(Figure, ax.get_figure(root=True)), BytesIO()
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


def legend_outside(ax: Axes, *, columns: int = 3) -> None:
    """Place a legend above the axes, where it covers no data, with visible marks."""
    legend = ax.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns,
        borderaxespad=0.0, borderpad=0.2, columnspacing=1.2, handlelength=1.4,
    )  # fmt: skip
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            handle.set_markersize(LEGEND_MARKER)
