"""Plots of invariant circles, and of their rotation numbers along a family."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice, check_kind, shown
from vibroimpact.machines.units import units_of
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import parameter_label
from vibroimpact.plotting.labels import Labels
from vibroimpact.plotting.sections import coordinate_label, coordinate_names
from vibroimpact.tori.branch import CircleBranch
from vibroimpact.tori.circle import Circle

POINTS_PER_NODE = 8  # a circle is drawn through so many points per node


def plot_invariant_circle(
    circle: Circle, *, x: str = "x1", y: str = "v1", ax: Axes | None = None, **looks: Any
) -> Axes:
    """Draw an invariant circle in the section of its first impact, or in the plane of a formula.

    Parameters
    ----------
    circle
        A result of :func:`vibroimpact.find_circle`.
    x, y
        Coordinates to draw: "x1", "x2", ... places, "v1", "v2", ... velocities after the impact,
        "phase" the phase of the force; of a formula "x1", "x2", ...
    **looks
        Passed to matplotlib's ``plot``.

    Returns
    -------
    Axes
        The Axes drawn on: solid for a stable circle, dashed for another, dotted if it is not
        admissible.
    """
    check_kind("circle", circle, Circle, "a Circle, as vi.find_circle gives")
    phi = np.linspace(0.0, 1.0, POINTS_PER_NODE * circle.nodes)
    machine = circle.signature is not None
    rows = circle.states(phi) if machine else circle.at(phi)
    size = rows.shape[1]
    names = coordinate_names(size // 2) if machine else [f"x{i + 1}" for i in range(size)]
    if not machine and shown(y) == "'v1'":  # the default
        y = names[-1]
    columns = {}
    for argument, name in (("x", x), ("y", y)):
        check_choice(argument, name, names)
        columns[argument] = rows[:, names.index(name)]
    line = "-" if circle.stable else "--" if circle.admissible else ":"
    units = units_of(circle.system)
    with style.drawing(ax, height=style.WIDTH * 0.8) as ax:
        given: dict[str, Any] = {"color": style.BLUE, "linestyle": line, "linewidth": 0.9} | looks
        ax.plot(columns["x"], columns["y"], **given)
        labels = (
            coordinate_label(n, units) if machine else f"${n[0]}_{{{n[1:]}}}$" for n in (x, y)
        )
        ax.set(**dict(zip(("xlabel", "ylabel"), labels, strict=True)))
    return ax


def plot_circle_branch(branch: CircleBranch, *, ax: Axes | None = None) -> Axes:
    """Draw rotation numbers along a family of circles: stable solid, other circles dashed.

    Parameters
    ----------
    branch
        A result of :func:`vibroimpact.continue_circle`.

    Returns
    -------
    Axes
        The Axes drawn on, with the events along the family by their labels.
    """
    check_kind("branch", branch, CircleBranch, "a CircleBranch, as vi.continue_circle gives")
    values, rhos, stable = branch.values, branch.rotation_numbers, branch.stable
    with style.drawing(ax) as ax:
        labels = Labels(ax)
        for i in range(len(branch) - 1):
            line = "-" if stable[i : i + 2].all() else "--"
            ax.plot(values[i : i + 2], rhos[i : i + 2], color=style.BLUE, linestyle=line)
        for point in branch.special_points:
            rho = point.orbit.rotation_number
            ax.plot(point.parameter, rho, "o", color=style.VERMILION, markersize=4)
            labels.add(point.label, point.parameter, rho, style.VERMILION)
        units = units_of(branch.circles[0].system)
        ax.set(xlabel=parameter_label(branch.parameter, units), ylabel=r"rotation number $\rho$")
        labels.place()
    return ax
