"""Plot of multipliers in the complex plane, with the unit circle."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import ArrayLike, NDArray

from vibroimpact._core.checks import check_flag, numbers, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.units import Units, units_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.plotting import style

STRONG = (1, 2, 3, 4)  # orders q of the strong resonances exp(2 pi i p / q)
MARKS = "sx^v+"  # distinguishable where they lie on each other
COLOURS = "cividis"  # even in lightness for every reader


def plot_multipliers(
    path: Orbit | Sequence[Orbit] | ArrayLike, *, omega: ArrayLike | None = None,
    half: bool | None = None,
    labels: Sequence[str] | None = None, ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """Draw the multipliers as omega varies, with the unit circle.

    Parameters
    ----------
    path
        An orbit, orbits along omega, or their multipliers, complex, shape (n_omega, n_multiplier).
    omega
        Colours the points, shape (n_omega,); taken from the orbits if these are given.
    half
        Draw nu of the half map (True) or lambda = nu^2 of the full map (False); by default nu where every
        orbit has a half map. Names the axes if ``path`` is an array, by default as nu.
    labels
        Names of a few orbits instead of a path: each has a colour and a mark, with a legend.

    Returns
    -------
    Axes
        The Axes drawn on. Stars on the unit circle are the strong resonances 1:1 to 1:4.
    """
    path = [path] if isinstance(path, Orbit) else path
    half = _has_half_map(path) if half is None else half
    values, along = _values(path, None if labels else omega, half)
    units = units_of(*(getattr(one, "system", None) for one in cast(Any, path) if omega is None))
    with style.drawing(ax, height=style.WIDTH * 0.85) as ax:
        unit_circle(ax)
        if labels is None:
            _points(ax, values, along, units)
            style.legend_outside(ax, columns=1)
        else:
            _named(ax, values, labels)
        symbol = r"\nu" if half else r"\lambda"
        ax.set(
            xlabel=rf"$\mathrm{{Re}}\,{symbol}$",
            ylabel=rf"$\mathrm{{Im}}\,{symbol}$",
            aspect="equal",
        )
    return ax


def _has_half_map(path: Any) -> bool:
    """Whether no orbit of the path is without a half map."""
    orbits = [one for one in path if isinstance(one, Orbit)] if isinstance(path, Sequence) else []
    return all(one.half_multipliers is not None for one in orbits)


def _values(
    path: Sequence[Orbit] | ArrayLike, omega: ArrayLike | None, half: bool
) -> tuple[NDArray[np.complex128], NDArray[np.float64] | None]:
    check_flag("half", half)
    if not isinstance(path, Sequence | np.ndarray) or isinstance(path, str):
        raise refusal("path", path, "orbits, or their multipliers")
    items: list[Any] = list(path)
    if items and all(isinstance(o, Orbit) for o in items):
        found = [o.half_multipliers if half else o.multipliers for o in items]
        if any(one is None for one in found):
            raise InvalidParameterError(
                "half = True: an orbit that is not symmetric has no half map. Take half=False."
            )
        values = np.array(found)
        omega = [o.mechanism.omega for o in items] if omega is None else omega
    else:
        values = _complex("path", items)
    colours = None if omega is None else numbers("omega", omega)
    if values.ndim != 2 or (colours is not None and colours.shape != values.shape[:1]):
        raise InvalidParameterError(
            f"path has shape {values.shape}: must be (n_omega, n_multiplier), omega (n_omega,)."
        )
    return values, colours


def _complex(name: str, items: list[Any]) -> NDArray[np.complex128]:
    try:
        array = np.array(items)
    except (TypeError, ValueError):
        array = np.array(None)
    if array.dtype.kind not in "iufc":
        raise refusal(name, items, "orbits, or their multipliers in rows")
    return array.astype(complex)


def unit_circle(ax: Axes) -> None:
    """Draw the unit circle with the strong resonances, and the axes of the plane."""
    turn = np.exp(2j * np.pi * np.linspace(0.0, 1.0, 361))
    ax.axhline(0.0, color=style.GREY, linewidth=0.4, zorder=0)
    ax.axvline(0.0, color=style.GREY, linewidth=0.4, zorder=0)
    ax.plot(turn.real, turn.imag, color=style.BLACK, linewidth=0.8, zorder=1)
    strong = np.exp(2j * np.pi * np.array(sorted({p / q for q in STRONG for p in range(q)})))
    ax.plot(strong.real, strong.imag, linestyle="none", marker=(8, 2, 0), markersize=5.5, color=style.GREY,
            label="strong resonances 1:1 to 1:4", zorder=2)  # fmt: skip


def _named(ax: Axes, values: NDArray[np.complex128], labels: Sequence[str]) -> None:
    if len(labels) != len(values):
        raise InvalidParameterError(
            f"labels = {labels!r}: must be as many names as orbits, {len(values)}."
        )
    for row, name, colour, mark in zip(
        values, labels, style.series(len(values)), cycle(MARKS), strict=False
    ):
        ax.plot(row.real, row.imag, linestyle="none", marker=mark, color=colour, label=name,
                markerfacecolor="none", markersize=5.0, zorder=3)  # fmt: skip
    style.legend_outside(ax, columns=1)


def _points(
    ax: Axes, values: NDArray[np.complex128], along: NDArray[np.float64] | None, units: Units
) -> None:
    each = np.repeat(np.arange(len(values)), values.shape[1])
    flat = values.ravel()
    look: dict[str, Any] = {
        "s": 5.0,
        "linewidths": 0.0,
        "zorder": 3,
        "rasterized": flat.size > style.MOST_VECTOR_POINTS,
    }
    if along is None:
        ax.scatter(flat.real, flat.imag, color=style.BLUE, **look)
        return
    norm = Normalize(float(along.min()), float(along.max()))
    colours = mpl.colormaps[COLOURS]
    ax.scatter(flat.real, flat.imag, c=along[each], cmap=colours, norm=norm, **look)
    label = units.label(r"$\omega$", "frequency")
    style.colour_bar(ax, ScalarMappable(norm, colours), label, shrink=0.9)
