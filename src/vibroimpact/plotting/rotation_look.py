"""Rotation numbers as colours: those that have converged, and simple fractions beside the bar."""

from __future__ import annotations

from math import gcd

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.ticker import FixedFormatter

from vibroimpact.plotting import maps

COLOURS = "viridis"  # lightness rises evenly; told apart by every reader
CONVERGED = 0.01  # error, of a range of 1/2, above which a cell has no colour
MARKS, APART, LARGEST = 5, 0.1, 60  # fractions: how many, how far of the bar, denominator


def draw(ax: Axes, plane: xr.Dataset, label: str) -> None:
    """Draw ``rotation`` of a plane where ``rotation_error`` says that it has converged."""
    field = plane["rotation"]
    if "rotation_error" in plane:
        field = field.where(plane["rotation_error"] <= CONVERGED)
    low, high = maps.ends(field.values)
    marks = fractions(low, high)
    bar = {
        "ticks": [p / q for p, q in marks],
        "format": FixedFormatter([f"{p}/{q}" if p else "0" for p, q in marks]),
    }
    maps.numbers(
        ax, field, colormaps[COLOURS], Normalize(low, high), label, **(bar if marks else {})
    )


def fractions(low: float, high: float) -> list[tuple[int, int]]:
    """Some p/q of a range, the simplest ones first, not too near to each other."""
    found: list[tuple[int, int]] = []
    for q in range(1, LARGEST + 1):
        for p in range(int(np.ceil(low * q)), int(np.floor(high * q)) + 1):
            clear = all(abs(p / q - a / b) >= APART * (high - low) for a, b in found)
            if gcd(p, q) == 1 and clear and len(found) < MARKS:
                found.append((p, q))
    return found
