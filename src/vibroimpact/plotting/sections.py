"""Poincare sections: states after impacts or changes of state, or once per forcing period."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice, check_flag, refusal
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import Units, of_coordinate, units_of
from vibroimpact.model.system import mechanism_of
from vibroimpact.plotting import style
from vibroimpact.simulation.places import AtStop
from vibroimpact.simulation.sections import Section


def plot_section(
    section: Section, *, x: str = "x1", y: str = "v1", drift: bool = True,
    ax: Axes | None = None, **looks: Any,
) -> Axes:  # fmt: skip
    """Draw a section in the paper's projection, or in another.

    Parameters
    ----------
    section
        A result of :func:`vibroimpact.section`.
    x, y
        Coordinates to draw: "x1", "x2", ... places, "v1", "v2", ... velocities, those after the
        impact on an impact section, "phase" the phase of the force.
    drift
        False: places relative to the last body that nothing holds, ``section.relative``, so that a
        machine that advances is drawn in one place.
    **looks
        Passed to matplotlib's ``plot``: ``color``, ``marker``, ``label`` (which adds a legend).
    """
    arrays = [getattr(section, name, None) for name in ("position", "velocity", "phase")]
    if not all(isinstance(array, np.ndarray) for array in arrays):
        raise refusal("section", section, "a Section, as vi.section gives")
    check_flag("drift", drift)
    place = section.position if drift else section.relative
    across, up = (component(section, name, c, place) for name, c in (("x", x), ("y", y)))
    with style.drawing(ax, height=style.WIDTH * 0.8) as ax:
        units = units_of(getattr(section, "system", None))
        style.points(ax, across, up, **({"color": style.BLUE} | looks))
        after = isinstance(section.at, AtStop)
        less = "" if place is section.position else ", less the drift"
        xlabel, ylabel = (
            coordinate_label(name, units, after) + (less if name.startswith("x") else "")
            for name in (x, y)
        )
        ax.set(xlabel=xlabel, ylabel=ylabel)
        sizes = _sizes(section)
        narrow = [style.widen_constant(ax, axis, sizes[c[0]]) for axis, c in (("x", x), ("y", y))]
        if all(narrow) and len(across):
            ax.annotate(
                "one point",
                (across[0], up[0]),
                (6.0, 6.0),
                textcoords="offset points",
                fontsize=9.0,
            )
        if "label" in looks:
            style.legend_outside(ax, columns=2)
    return ax


def _sizes(section: Section) -> dict[str, float]:
    """Size of the motion in places, velocities and phases: a speed is a place times the forcing frequency."""
    place, speed = (
        float(np.abs(part).max(initial=0.0)) for part in (section.position, section.velocity)
    )
    omega = float(getattr(mechanism_of(section.system), "omega", 0.0)) or 1.0
    length = max(place, speed / omega)
    return {"x": length, "v": length * omega, "p": 2.0 * np.pi}


def coordinate_label(name: str, units: Units, after_impact: bool = True) -> str:
    """Coordinate as a formula, with its unit."""
    return units.label(symbol(name, after_impact), of_coordinate(name))


def component(section: Section, argument: str, name: str, place: Floats | None = None) -> Floats:
    """Coordinate of a section by its name, the value of an argument; other places if given."""
    names = coordinate_names(section.position.shape[1])
    check_choice(argument, name, names)
    if name == "phase":
        return section.phase
    positions = section.position if place is None else place
    return (positions if name[0] == "x" else section.velocity)[:, int(name[1:]) - 1]


def coordinate_names(degrees: int) -> list[str]:
    """Names of the entries of a state (x, v, theta)."""
    return [*(f"{kind}{i + 1}" for kind in "xv" for i in range(degrees)), "phase"]


def symbol(name: str, after_impact: bool = True) -> str:
    """Formula for a coordinate's name: x1, v1 (after the impact: with a plus), phase."""
    if name == "phase":
        return r"$\theta$ [rad]"
    plus = "+" * after_impact
    return f"$x_{{{name[1:]}}}$" if name[0] == "x" else rf"$\dot x_{{{name[1:]}{plus}}}$"
