"""Maps of rotation numbers that have converged, with simple fractions beside the colour bar."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.ticker import FixedFormatter

from vibroimpact.plotting import maps

COLOURS = "viridis"  # lightness rises evenly; distinguishable for colour-blind readers
LARGEST_SHOWN_ERROR = 0.01  # a cell with a larger error, of a range of 1/2, has no colour
MOST_FRACTIONS = 5  # so many fractions are marked at most
FRACTION_DISTANCE_OF_BAR = 0.1  # fractions are so far apart, relative to the bar
LARGEST_DENOMINATOR = 60  # fractions have denominators up to this one


def draws(plane: xr.Dataset, variable: str) -> bool:
    """Whether a variable is a rotation number, of any label."""
    return variable == "rotation" or (
        variable.startswith("rotation_") and f"{variable}_error" in plane
    )


def draw(ax: Axes, plane: xr.Dataset, variable: str, label: str) -> None:
    """Draw a rotation number of a plane where it has converged by its error."""
    field, error = plane[variable], f"{variable}_error"
    if error in plane:
        field = field.where(plane[error] <= LARGEST_SHOWN_ERROR)
    low, high = maps.ends(field.values)
    ticks = {p / q: f"{p}/{q}" if p else "0" for p, q in fractions(low, high)}
    digits = max(3, 1 - math.floor(math.log10(high - low))) if high > low else 3
    for end in (low, high):
        if all(abs(end - mark) > FRACTION_DISTANCE_OF_BAR * (high - low) for mark in ticks):
            ticks[end] = f"{end:.{digits}f}"
    order = sorted(ticks)
    bar = {"ticks": order, "format": FixedFormatter([ticks[mark] for mark in order])}
    maps.numbers(
        ax, field, colormaps[COLOURS], Normalize(low, high), label, "none, or not converged", **bar
    )


def fractions(low: float, high: float) -> list[tuple[int, int]]:
    """Some p/q of a range, the simplest ones first, not too near to each other."""
    found: list[tuple[int, int]] = []
    for q in range(1, LARGEST_DENOMINATOR + 1):
        for p in range(int(np.ceil(low * q)), int(np.floor(high * q)) + 1):
            clear = all(
                abs(p / q - a / b) >= FRACTION_DISTANCE_OF_BAR * (high - low) for a, b in found
            )
            if math.gcd(p, q) == 1 and clear and len(found) < MOST_FRACTIONS:
                found.append((p, q))
    return found
