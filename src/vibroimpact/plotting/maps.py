"""Maps over a grid of two coordinates: categories with a legend, numbers with a colour bar."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize
from matplotlib.patches import Patch
from numpy.typing import NDArray

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.plotting import style

EDGE = "#B0B0B0"  # around the patches of a legend, so that a white one is visible
FAILED = ("#A08060", "#55351A", "#E3D2B8", "#7A5A3A", "#C2A27E")  # statuses, one after the other
CYCLES = re.compile(r"\d+-(?=\d+-\d)")
PAIR = re.compile(r"(\d+)-(\d+)")  # impacts at stops A and B of a contact
SHOWN_QUANTILE = 0.995  # this part of the numbers on each side is shown: the rest saturates
# Steps that are meant to be equal differ by less, relative to the values.
EQUAL_STEPS_RELATIVE = 64.0 * np.finfo(float).eps


class Shade(NamedTuple):
    """Category of a legend: its codes, words and colour."""

    codes: tuple[int, ...]
    words: str
    colour: str


def with_mirrors(sizes: Mapping[str, float]) -> list[str]:
    """Names of motions from the largest to the smallest, mirror images next to each other.

    Of the two, that with more impacts at stops A comes first, whichever is larger: figures of the
    same motions then have the same colours.
    """

    def key(name: str) -> tuple[float, str, list[int]]:
        image = _image(name)
        return -max(sizes[name], sizes.get(image, -np.inf)), min(name, image), _less_at_a(name)

    return sorted(sizes, key=key)


def _image(name: str) -> str:
    """Name n-q-p of the mirror image of n-p-q, for every contact; other names are kept."""
    cycles, pairs = _parts(name)
    return cycles + PAIR.sub(r"\2-\1", pairs) if PAIR.match(pairs) else name


def _less_at_a(name: str) -> list[int]:
    """Impacts at B minus those at A, of every contact."""
    return [int(b) - int(a) for a, b in PAIR.findall(_parts(name)[1])]


def _parts(name: str) -> tuple[str, str]:
    """Cycles with their dash, empty without forcing, and the pairs of contacts."""
    cycles = CYCLES.match(name)
    return (cycles[0], name[cycles.end() :]) if cycles else ("", name)


def shades(
    words: Mapping[int, str], own: Mapping[int, str], rest: str, plain: Mapping[str, str]
) -> list[Shade]:
    """Colours of categories: ``own`` ones for some, one for the ``rest``, and those of statuses.

    Parameters
    ----------
    words
        Words by code, in the order of the legend; codes of statuses are negative, and come last.
    own
        Colours by code, for categories with a colour of their own.
    plain
        Colours of negative codes by their words; others are brown.
    """
    found = [Shade((code,), words[code], colour) for code, colour in own.items()]
    if beyond := tuple(code for code in words if code >= 0 and code not in own):
        found.append(Shade(beyond, rest, style.SILVER))
    browns = cycle(FAILED)
    statuses = {code: text for code, text in words.items() if code < 0}
    return found + [Shade((k,), w, plain.get(w) or next(browns)) for k, w in statuses.items()]


def over_two(field: xr.DataArray) -> tuple[str, str]:
    """Names of the two coordinates, the first for the abscissa.

    Raises
    ------
    InvalidParameterError
        A field over another number of coordinates.
    """
    if field.ndim != 2:
        raise InvalidParameterError(
            f"{field.name} has the dims {', '.join(map(str, field.dims)) or 'none'}: must have "
            "two. Over one, plot_along draws it; of more, select one value with .isel(...)."
        )
    across, up = (str(name) for name in field.dims)
    return across, up


def categories(ax: Axes, field: xr.DataArray, shades: Sequence[Shade]) -> None:
    """Draw each category in its colour, with a legend beside the axes."""
    place = {code: i for i, shade in enumerate(shades) for code in shade.codes}
    values, inverse = np.unique(field.values, return_inverse=True)
    index = np.array([place[int(value)] for value in values], dtype=float)
    colours = ListedColormap([shade.colour for shade in shades])
    norm = BoundaryNorm(np.arange(len(shades) + 1) - 0.5, len(shades))
    mesh(ax, field.copy(data=index[inverse.reshape(field.shape)]), colours, norm)
    _legend(ax, "upper left", [(shade.words, shade.colour) for shade in shades])


def numbers(
    ax: Axes, field: xr.DataArray, colours: Colormap, norm: Normalize, label: str,
    missing: str = "no number", **bar: Any,
) -> Colorbar:  # fmt: skip
    """Draw numbers with a colour bar; cells without a number keep the background."""
    mesh(ax, field, colours, norm)
    if field.isnull().any():
        _legend(ax, "lower right", [(missing, style.NOTHING)])
    return style.colour_bar(ax, ScalarMappable(norm, colours), label, pad=0.02, **bar)


def _legend(
    ax: Axes, corner: Literal["upper left", "lower right"], patches: Sequence[tuple[str, str]]
) -> None:
    """Legend of words and colours, with a corner at the upper right one of the axes; above them where it is wide."""
    handles = [
        Patch(facecolor=colour, edgecolor=EDGE, linewidth=0.4, label=words)
        for words, colour in patches
    ]
    look: dict[str, Any] = {
        "handles": handles, "handlelength": 1.0, "handleheight": 1.0, "labelspacing": 0.35,
    }  # fmt: skip
    legend = ax.legend(loc=corner, bbox_to_anchor=(1.0, 1.0), borderaxespad=0.3, **look)
    beside = style.LARGEST_SHARE_BESIDE * style.width_of_axes(ax)
    if corner == "upper left" and style.width_of(legend) > beside:
        style.legend_outside(ax, columns=4, **look)


def ends(values: NDArray[np.float64]) -> tuple[float, float]:
    """Quantiles near the ends, so that single outliers do not decide the colours."""
    known = values[np.isfinite(values)]
    if not known.size:
        return 0.0, 1.0
    low, high = np.quantile(known, [1.0 - SHOWN_QUANTILE, SHOWN_QUANTILE])
    return float(low), float(high)


def mesh(ax: Axes, field: xr.DataArray, colours: Colormap, norm: Normalize) -> None:
    """Draw one cell around each point of the grid, stored as pixels."""
    across, up = over_two(field)
    field = field.sortby([across, up])  # edges() needs points in order
    x, y = (np.asarray(field[name].values, dtype=float) for name in (across, up))
    ax.set_facecolor(style.NOTHING)
    for points, set_scale in ((x, ax.set_xscale), (y, ax.set_yscale)):
        if geometric(points):
            set_scale("log")
    ax.pcolormesh(edges(x), edges(y), field.values.T, cmap=colours, norm=norm, rasterized=True)


def geometric(points: NDArray[np.float64]) -> bool:
    """Whether three or more positive points have equal ratios and no equal steps."""
    if len(points) < 3 or min(points) <= 0.0 or _even(points):
        return False
    return _even(np.log(points))


def _even(points: NDArray[np.float64]) -> bool:
    """Whether steps are equal within rounding."""
    size = float(np.abs(points).max()) + 1.0
    return bool(np.ptp(np.diff(points)) <= EQUAL_STEPS_RELATIVE * size)


def edges(centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edges of the cells around points in order: midway to the neighbours on their scale."""
    if geometric(centres):
        return np.asarray(np.exp(_midway(np.log(centres))))
    return _midway(centres)


def _midway(centres: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(centres) == 1:
        half = 0.5 * abs(float(centres[0])) or 0.5
        return np.array([centres[0] - half, centres[0] + half])
    middle = (centres[1:] + centres[:-1]) / 2.0
    first, last = 2.0 * centres[0] - middle[0], 2.0 * centres[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])
