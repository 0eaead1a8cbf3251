"""Pictures of periodic orbits, and of all that a search has found."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice, check_kind
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import units_of
from vibroimpact.measures.flights import Flights
from vibroimpact.measures.measure import Peak, Row
from vibroimpact.measures.motions import flights_of
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.search_result import OrbitSearch
from vibroimpact.plotting import style
from vibroimpact.plotting.motion_colours import colours_of
from vibroimpact.plotting.sections import coordinate_label, coordinate_names
from vibroimpact.plotting.variables import combination

POINTS_PER_FLIGHT = 200
INSIDE_FLIGHT = 1e-9  # share of a flight: its ends belong to the flights beside it, too


def plot_orbit(orbit: Orbit, row: Row = "x1", *, ax: Axes | None = None) -> Axes:
    """Draw velocity over position of one coordinate over a period, whether the orbit is stable or not.

    Parameters
    ----------
    orbit
        A converged :class:`Orbit`.
    row
        "x1", "x2", a sum such as "x2 - x1", or coefficients of the coordinates.

    Returns
    -------
    Axes
        The Axes drawn on. Dashes are jumps of the velocity; an orbit that is not stable is grey.
    """
    check_kind("orbit", orbit, Orbit, "an Orbit, as vi.find_orbit gives")
    flights = flights_of(orbit)
    chosen = Peak(row).coefficients(orbit.mechanism)
    units = units_of(orbit.system)
    x, v = (_sampled(flights, chosen, order) for order in (0, 1))
    colour = style.BLUE if orbit.stable else style.GREY
    with style.drawing(ax, height=style.WIDTH * 0.85) as ax:
        ax.plot(_with_gaps(x), _with_gaps(v), color=colour)
        jumps = np.stack([x[:, -1], np.roll(x[:, 0], -1)], axis=1)
        speeds = np.stack([v[:, -1], np.roll(v[:, 0], -1)], axis=1)
        looks: dict[str, Any] = {
            "color": style.VERMILION,
            "linestyle": (0, (2, 1.5)),
            "linewidth": 0.8,
        }
        ax.plot(_with_gaps(jumps), _with_gaps(speeds), **looks)
        place, speed = combination(chosen), combination(chosen, r"\dot x")
        ax.set(
            xlabel=units.label(f"${place}$", "length"), ylabel=units.label(f"${speed}$", "velocity")
        )
    return ax


def plot_orbits(
    search: OrbitSearch, *, x: str = "x1", y: str = "v1", ax: Axes | None = None
) -> Axes:
    """Draw the states of all orbits after their impacts: a colour for each orbit, filled where it is stable.

    Parameters
    ----------
    search
        A result of :func:`vibroimpact.find_orbits`.
    x, y
        Coordinates to draw: "x1", "x2", ... places, "v1", "v2", ... velocities after the impact, "phase".
    """
    check_kind("search", search, OrbitSearch, "an OrbitSearch, as vi.find_orbits gives")
    names = coordinate_names(mechanism_of(search.system).degrees)
    for axis, name in (("x", x), ("y", y)):
        check_choice(axis, name, names)
    units = units_of(search.system)
    with style.drawing(ax, height=style.WIDTH * 0.8) as ax:
        colours = colours_of([orbit.symbol for orbit in search.orbits])
        for orbit, colour in zip(search.orbits, colours, strict=True):
            states = flights_of(orbit).states.copy()
            states[:, -1] %= 2.0 * np.pi
            across, up = (states[:, names.index(n)] for n in (x, y))
            face = colour if orbit.stable else "none"
            ax.plot(across, up, "o", color=colour, markerfacecolor=face, label=orbit.symbol)
        ax.set(xlabel=coordinate_label(x, units), ylabel=coordinate_label(y, units))
        if len(search):
            style.legend_outside(ax, columns=4)
    return ax


def _sampled(flights: Flights, row: Floats, order: int) -> Floats:
    """A row of positions or velocities during each flight, shape (flights, points)."""
    signal = flights.signal(lambda code: flights.rows.moved(code, row, order))
    durations = flights.durations[:, None]
    begin = np.cumsum(durations, axis=0) - durations
    share = np.linspace(INSIDE_FLIGHT, 1.0 - INSIDE_FLIGHT, POINTS_PER_FLIGHT)
    return signal.at((begin + share * durations).ravel()).reshape(len(durations), -1)


def _with_gaps(rows: Floats) -> Floats:
    """Rows one after the other, with a NaN after each."""
    return np.column_stack([rows, np.full(len(rows), np.nan)]).ravel()
