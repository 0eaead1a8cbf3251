"""The picture of the scaling curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, NullFormatter

from benchmarks.scaling import Point
from vibroimpact.plotting import style

LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.BLUE, "marker": "o", "linestyle": "-"},
    {"color": style.VERMILION, "marker": "s", "linestyle": "--"},
)
PANELS = ("degrees of freedom", "contacts", "members", "threads")
SIZE = (2.2 * style.WIDTH, 2.2 * style.HEIGHT)


def draw(points: Sequence[Point], path: Path) -> None:
    """Write one panel for each quantity that varies."""
    with mpl.rc_context(style.RC):
        figure, axes = plt.subplots(2, 2, figsize=SIZE, layout="constrained")
        for ax, against in zip(axes.flat, PANELS, strict=True):
            panel(ax, against, [p for p in points if p.against == against])
        style.save(axes.flat[0], path)
        plt.close(figure)


def panel(ax: Axes, against: str, points: Sequence[Point]) -> None:
    """Draw the curves against one quantity; threads as a gain over one thread."""
    for curve, look in zip(dict.fromkeys(p.curve for p in points), LOOKS, strict=False):
        mine = [p for p in points if p.curve == curve]
        gain = against == "threads"
        y = [mine[0].nanoseconds / p.nanoseconds if gain else p.nanoseconds for p in mine]
        ax.plot([p.x for p in mine], y, label=curve, markersize=style.LEGEND_MARKER, **look)
    ax.set_xlabel(against)
    if against == "threads":
        ends = (1, max((p.x for p in points), default=1))
        ax.plot(ends, ends, color=style.GREY, linestyle=":", label="ideal")
        ax.set_ylabel("times as fast as one")
    else:
        ax.set_ylabel("ns per impact")
        ax.set_yscale("log")
        ax.yaxis.set_major_formatter("{x:g}")
        ax.yaxis.set_minor_formatter(NullFormatter())
        decades = [math.floor(math.log10(p.nanoseconds)) for p in points]
        ax.set_ylim(10.0 ** min(decades), 10.0 ** (max(decades) + 1))
    if against == "members":
        ax.set_xscale("log")
    else:
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.legend()
