"""Drawing of the impact damper (Fig. 1 of the paper)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from vibroimpact._core.checks import check_kind
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.plotting import style
from vibroimpact.plotting.units import units_of

# Places on the drawing board, in its own units.
WALL, MASS, SLOT = 0.0, (3.2, 0.0, 5.0, 2.6), (3.9, 0.85, 3.6, 0.9)  # x, y, width, height
FREE_RADIUS, SPRING_Y, DASHPOT_Y = 0.42, 1.95, 0.65
MIDDLE = SLOT[0] + SLOT[2] / 2.0
FREE_AT = MIDDLE + 0.7  # the free mass is off the middle, so that x2 - x1 is visible
LINE: dict[str, Any] = {"color": style.BLACK, "linewidth": 1.0}


def plot_mechanism(damper: ImpactDamper, *, ax: Axes | None = None) -> Axes:
    """Draw the impact damper with its parameters; not to scale.

    Parameters
    ----------
    damper
        The system; its parameters are written below the drawing.
    ax
        Axes to draw on; a new figure if not given.

    Returns
    -------
    Axes
        The Axes drawn on.
    """
    check_kind("damper", damper, ImpactDamper, "an ImpactDamper")
    with style.drawing(ax, width=4.2, height=2.4) as ax:
        _wall(ax)
        _spring(ax)
        _dashpot(ax)
        _masses(ax)
        _force(ax)
        _coordinates(ax)
        ax.text(4.9, -1.0, _parameters(damper), ha="center", va="top", fontsize=9)
        ax.set(xlim=(-0.6, 10.4), ylim=(-1.7, 3.9), aspect="equal")
        ax.axis("off")
    return ax


def _wall(ax: Axes) -> None:
    ax.plot([WALL, WALL], [-0.3, 2.9], **LINE)
    ax.plot([WALL, 10.0], [-0.3, -0.3], **LINE)
    for y in np.arange(-0.1, 2.9, 0.3):
        ax.plot([WALL - 0.28, WALL], [y - 0.22, y], color=style.BLACK, linewidth=0.6)
    for x in (MASS[0] + 0.8, MASS[0] + MASS[2] - 0.8):
        ax.add_patch(Circle((x, -0.15), 0.15, facecolor="white", edgecolor=style.BLACK, lw=0.8))


def _spring(ax: Axes) -> None:
    x = np.concatenate([[WALL, 0.6], np.linspace(0.7, 2.5, 12), [2.6, MASS[0]]])
    y = np.concatenate([[0, 0], 0.25 * (-1.0) ** np.arange(12), [0, 0]]) + SPRING_Y
    ax.plot(x, y, **LINE)
    ax.text(1.6, SPRING_Y + 0.45, r"$K\ (\omega_n)$", ha="center")


def _dashpot(ax: Axes) -> None:
    ax.plot([WALL, 1.2], [DASHPOT_Y, DASHPOT_Y], **LINE)
    ax.plot([2.0, 1.2, 1.2, 2.0], DASHPOT_Y + np.array([0.28, 0.28, -0.28, -0.28]), **LINE)
    ax.plot([1.7, 1.7], [DASHPOT_Y - 0.2, DASHPOT_Y + 0.2], **(LINE | {"linewidth": 1.8}))
    ax.plot([1.7, MASS[0]], [DASHPOT_Y, DASHPOT_Y], **LINE)
    ax.text(1.6, DASHPOT_Y + 0.42, r"$C\ (\zeta)$", ha="center")


def _masses(ax: Axes) -> None:
    x, y, width, height = MASS
    ax.add_patch(Rectangle((x, y), width, height, facecolor="#DCE6EE", edgecolor=style.BLACK))
    x, y, width, height = SLOT
    ax.add_patch(Rectangle((x, y), width, height, facecolor="white", edgecolor=style.BLACK))
    for place, name, colour in ((x, "B", style.VERMILION), (x + width, "A", style.BLUE)):
        ax.plot([place, place], [y, y + height], color=colour, linewidth=2.6)
        side = 1 if name == "A" else -1
        ax.text(place + 0.34 * side, y + 0.45, f"${name}$", ha="center", va="center", color=colour)
    centre = (FREE_AT, y + FREE_RADIUS + 0.02)
    ax.add_patch(Circle(centre, FREE_RADIUS, facecolor=style.ORANGE, edgecolor=style.BLACK, lw=0.8))
    ax.text(*centre, "$M_2$", ha="center", va="center", fontsize=9)
    ax.text(MASS[0] + 0.25, 0.38, "$M_1$", va="center")


def _force(ax: Axes) -> None:
    end = MASS[0] + MASS[2]
    _arrow(ax, (end, 1.3), (end + 1.2, 1.3), linewidth=1.4)
    ax.text(end + 0.15, 1.55, r"$F_0\,\sin\,\theta$")


def _coordinates(ax: Axes) -> None:
    for x, low, name in ((MIDDLE, MASS[3] - 0.9, "x_1"), (FREE_AT, SLOT[1] + 0.9, "x_2")):
        top = 2.9 if name == "x_1" else 3.5
        ax.plot([x, x], [low, top], color=style.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
        _arrow(ax, (x, top), (x + 0.8, top))
        ax.text(x + 0.9, top, f"${name}$", va="center")
    y = SLOT[1] - 0.3
    for first, last in ((SLOT[0], MIDDLE), (MIDDLE, SLOT[0] + SLOT[2])):
        _arrow(ax, (first, y), (last, y), arrowstyle="<|-|>")
        ax.text((first + last) / 2, y - 0.1, r"$\delta$", ha="center", va="top")


def _arrow(
    ax: Axes, start: tuple[float, float], end: tuple[float, float], *,
    arrowstyle: str = "-|>", linewidth: float = 0.7,
) -> None:  # fmt: skip
    look = {"arrowstyle": arrowstyle, "color": style.BLACK, "linewidth": linewidth,
            "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8}  # fmt: skip
    ax.annotate("", xy=end, xytext=start, arrowprops=look)


def _parameters(d: ImpactDamper) -> str:
    units = units_of(d)

    def labelled(symbol: str, value: float, quantity: str = "") -> str:
        return rf"${symbol}={value * units.factor(quantity):g}$ {units.unit(quantity)}".rstrip()

    parts = [
        labelled(r"\mu", d.mass_ratio), labelled(r"\omega_n", d.omega_n, "frequency"),
        labelled(r"\zeta", d.zeta), labelled("R", d.restitution),
        labelled(r"\delta", d.half_clearance, "length"), labelled(r"\omega", d.omega, "frequency"),
    ]  # fmt: skip
    return ",  ".join(parts)
