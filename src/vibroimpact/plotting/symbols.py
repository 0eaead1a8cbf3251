"""Symbols of mechanical drawings: springs, dashpots, walls, plates, wheels, belts, arrows."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyBboxPatch, Rectangle

from vibroimpact.plotting import style

LINE: dict[str, Any] = {"color": style.BLACK, "linewidth": 1.0}
BODY = "#DCE6EE"  # of masses
HATCH, SLANT = 0.3, 0.24  # distance and size of the strokes of a wall
WINDINGS = 12
Point = tuple[float, float]


def spring(ax: Axes, x0: float, x1: float, y: float, *, size: float = 0.25, **look: Any) -> None:
    """Draw a spring between two abscissas."""
    length = x1 - x0
    ends = [x0, x0 + 0.1875 * length], [x0 + 0.8125 * length, x1]
    coils = np.linspace(x0 + 0.21875 * length, x0 + 0.78125 * length, WINDINGS)
    x = np.concatenate([ends[0], coils, ends[1]])
    up = size * (-1.0) ** np.arange(WINDINGS)
    ax.plot(x, y + np.concatenate([[0, 0], up, [0, 0]]), **(LINE | look))


def dashpot(ax: Axes, x0: float, x1: float, y: float, *, size: float = 0.28, **look: Any) -> None:
    """Draw a dashpot between two abscissas."""
    line, length = LINE | look, x1 - x0
    left, right, piston = x0 + 0.375 * length, x0 + 0.625 * length, x0 + 0.53125 * length
    ax.plot([x0, left], [y, y], **line)
    ax.plot([right, left, left, right], y + size * np.array([1, 1, -1, -1]), **line)
    head = line | {"linewidth": 1.8 * line["linewidth"]}
    ax.plot([piston, piston], [y - 0.7 * size, y + 0.7 * size], **head)
    ax.plot([piston, x1], [y, y], **line)


def wall(ax: Axes, x: float, low: float, high: float, side: int) -> None:
    """Draw a fixed wall at x, its strokes on the left (side -1) or on the right (1)."""
    ax.plot([x, x], [low, high], **LINE)
    for y in np.arange(low + 0.2, high + 0.01, HATCH):
        shift = SLANT * side
        ax.plot([x, x + shift], [y, y + (-0.2 if side < 0 else 0.0) - (0.2 if side > 0 else 0.0)],
                color=style.BLACK, linewidth=0.6)  # fmt: skip


def floor(ax: Axes, left: float, right: float, y: float) -> None:
    """Draw a floor with strokes below it."""
    ax.plot([left, right], [y, y], **LINE)
    for x in np.arange(left + 0.3, right + 0.01, HATCH):
        ax.plot([x, x - 0.2], [y, y - 0.2], color=style.BLACK, linewidth=0.6)


def wheels(ax: Axes, left: float, right: float, y: float, radius: float = 0.15) -> None:
    """Draw two wheels under a mass, which touch y from above."""
    for x in (left, right):
        ax.add_patch(Circle((x, y + radius), radius, facecolor="white", edgecolor=style.BLACK,
                            lw=0.8))  # fmt: skip


def plate(ax: Axes, x: float, y: float, colour: str, size: float = 0.32) -> None:
    """Draw the face of a stop."""
    ax.plot([x, x], [y - size, y + size], color=colour, linewidth=2.6)


def box(ax: Axes, corner: Point, width: float, height: float, face: str = BODY) -> None:
    """Draw a mass."""
    ax.add_patch(Rectangle(corner, width, height, facecolor=face, edgecolor=style.BLACK))


def belt(ax: Axes, left: float, right: float, top: float, colour: str) -> None:
    """Draw a belt over two rollers, with the direction of its upper side."""
    radius = 0.26
    ax.add_patch(
        FancyBboxPatch((left + radius, top - 2 * radius), right - left - 2 * radius, 2 * radius,
                       boxstyle=f"round,pad=0,rounding_size={radius}", facecolor="white",
                       edgecolor=colour, lw=1.4)
    )  # fmt: skip
    for x in (left + 2 * radius, right - 2 * radius):
        ax.add_patch(Circle((x, top - radius), 0.17, facecolor=style.SILVER,
                            edgecolor=style.BLACK, lw=0.6))  # fmt: skip


def arrow(
    ax: Axes, start: Point, end: Point, *, arrowstyle: str = "-|>", linewidth: float = 0.7,
    color: str = style.BLACK,
) -> None:  # fmt: skip
    """Draw an arrow."""
    look = {"arrowstyle": arrowstyle, "color": color, "linewidth": linewidth,
            "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8}  # fmt: skip
    ax.annotate("", xy=end, xytext=start, arrowprops=look)
