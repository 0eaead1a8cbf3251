"""Drawings of systems: the impact damper (Fig. 1 of the paper), and any mechanism."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from vibroimpact._core.checks import check_flag
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.machines.units import units_of
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.plotting import style, symbols
from vibroimpact.plotting.chain import draw_chain

# Places on the drawing board, in its own units.
WALL, MASS, SLOT = 0.0, (3.2, 0.0, 5.0, 2.6), (3.9, 0.85, 3.6, 0.9)  # x, y, width, height
WIDTH, HEIGHT = 4.2, 2.4  # inches
FREE_RADIUS, SPRING_Y, DASHPOT_Y = 0.42, 1.95, 0.65
MIDDLE = SLOT[0] + SLOT[2] / 2.0
FREE_AT = MIDDLE + 0.7  # the free mass is off the middle, so that x2 - x1 is visible


def plot_mechanism(system: System, *, ax: Axes | None = None, caption: bool = True) -> Axes:
    """Draw a system from its description, with its parameters; not to scale.

    Parameters
    ----------
    system
        The impact damper, or any mechanism.
    caption
        Whether to write the parameters of the impact damper below it.

    Notes
    -----
    Coordinates of a mechanism are drawn as masses in a row, x to the right; entries of M, C and K as
    masses, springs and dashpots between them and to the ground; stops and friction with the numbers
    that events have. A coordinate may be anything, and the ball above a table is drawn on its side.
    What is no spring, dashpot or stop between two masses or to the ground is listed below the
    drawing: coupling of masses, gyroscopic and circulatory terms, rows of three coordinates.
    """
    check_flag("caption", caption)
    if not isinstance(system, ImpactDamper):
        return draw_chain(mechanism_of(system), units_of(system), ax)
    with style.drawing(ax, width=WIDTH, height=HEIGHT) as ax:
        _wall(ax)
        _spring(ax)
        _dashpot(ax)
        _masses(ax)
        _force(ax)
        _coordinates(ax)
        if caption:
            ax.text(4.9, -1.0, _parameters(system), ha="center", va="top", fontsize=9)
        ax.set(xlim=(-0.6, 10.4), ylim=(-1.7 if caption else -0.6, 3.9), aspect="equal")
        ax.axis("off")
        style.shrink_texts(ax, WIDTH, HEIGHT)
    return ax


def has_numbers(system: System) -> bool:
    """Whether a drawing without the parameters below it has numbers."""
    return not isinstance(system, ImpactDamper)


def _wall(ax: Axes) -> None:
    ax.plot([WALL, WALL], [-0.3, 2.9], **symbols.LINE)
    ax.plot([WALL, 10.0], [-0.3, -0.3], **symbols.LINE)
    for y in np.arange(-0.1, 2.9, 0.3):
        ax.plot([WALL - 0.28, WALL], [y - 0.22, y], color=style.BLACK, linewidth=0.6)
    symbols.wheels(ax, MASS[0] + 0.8, MASS[0] + MASS[2] - 0.8, -0.3)


def _spring(ax: Axes) -> None:
    symbols.spring(ax, WALL, MASS[0], SPRING_Y)
    ax.text(1.6, SPRING_Y + 0.45, r"$K\ (\omega_n)$", ha="center")


def _dashpot(ax: Axes) -> None:
    symbols.dashpot(ax, WALL, MASS[0], DASHPOT_Y)
    ax.text(1.6, DASHPOT_Y + 0.42, r"$C\ (\zeta)$", ha="center")


def _masses(ax: Axes) -> None:
    x, y, width, height = MASS
    ax.add_patch(Rectangle((x, y), width, height, facecolor=symbols.BODY, edgecolor=style.BLACK))
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
    symbols.arrow(ax, (end, 1.3), (end + 1.2, 1.3), linewidth=1.4)
    ax.text(end + 0.15, 1.55, r"$F_0\,\sin\,\theta$")


def _coordinates(ax: Axes) -> None:
    for x, low, name in ((MIDDLE, MASS[3] - 0.9, "x_1"), (FREE_AT, SLOT[1] + 0.9, "x_2")):
        top = 2.9 if name == "x_1" else 3.5
        ax.plot([x, x], [low, top], color=style.GREY, linewidth=0.6, linestyle=(0, (4, 3)))
        symbols.arrow(ax, (x, top), (x + 0.8, top))
        ax.text(x + 0.9, top, f"${name}$", va="center")
    y = SLOT[1] - 0.3
    for first, last in ((SLOT[0], MIDDLE), (MIDDLE, SLOT[0] + SLOT[2])):
        symbols.arrow(ax, (first, y), (last, y), arrowstyle="<|-|>")
        ax.text((first + last) / 2, y - 0.1, r"$\delta$", ha="center", va="top")


def _parameters(d: ImpactDamper) -> str:
    units = units_of(d)

    def labelled(symbol: str, value: float, quantity: str = "") -> str:
        return f"${symbol}={units.formula(value, quantity)}$"

    parts = [
        labelled(r"\mu", d.mass_ratio), labelled(r"\omega_n", d.omega_n, "frequency"),
        labelled(r"\zeta", d.zeta), labelled("R", d.restitution),
        labelled(r"\delta", d.half_clearance, "length"), labelled(r"\omega", d.omega, "frequency"),
    ]  # fmt: skip
    return ",  ".join(parts)
