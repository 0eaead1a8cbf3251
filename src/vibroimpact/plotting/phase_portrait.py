"""Phase portraits: velocity over position, with the jumps of impacts."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_kind, vector
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import units_of
from vibroimpact.measures.measure import Peak, Row
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.plotting import style
from vibroimpact.plotting.history import HISTORY_POINTS, window_of
from vibroimpact.plotting.orbits import plot_orbit
from vibroimpact.plotting.variables import combination
from vibroimpact.simulation.simulate import Run


def plot_phase_portrait(
    run: Run | Orbit, t0: float = 0.0, t1: float | None = None, *,
    row: Row = (1.0,), ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """Draw velocity over position of one coordinate, or of a combination of coordinates.

    Parameters
    ----------
    run
        A result of :func:`vibroimpact.simulate`, or an orbit, which is drawn over its period.
    t0, t1
        Window of time within a run; to its last event if ``t1`` is not given.
    row
        "x1", "x2", a sum such as "x2 - x1", or coefficients of the coordinates, missing ones zero: ``(-1, 1)``.
    """
    check_kind("run", run, (Run, Orbit), "a Run or an Orbit")
    full = _row(row, mechanism_of(run.system))
    if isinstance(run, Orbit):
        return plot_orbit(run, full.tolist(), ax=ax)
    start, end = window_of(run, t0, t1)
    with style.drawing(ax, height=style.WIDTH * 0.85) as ax:
        units = units_of(run.system)
        for (x, v), looks in (
            (_flights(run, full, start, end), {"color": style.BLUE}),
            (_jumps(run, full, start, end), {"color": style.VERMILION, "linestyle": (0, (2, 1.5))}),
        ):
            ax.plot(x, v, linewidth=0.8, **looks)
        place, speed = _names(full)
        across, up = units.label(f"${place}$", "length"), units.label(f"${speed}$", "velocity")
        ax.set(xlabel=across, ylabel=up)
    return ax


def _row(row: Row, m: Mechanism) -> Floats:
    """Coefficients of the coordinates, those that are left out zero."""
    if isinstance(row, str):
        return Peak(row).coefficients(m)
    entries = vector("row", row)
    if not 1 <= len(entries) <= m.degrees:
        raise InvalidParameterError(f"row has {len(entries)} entries; expected 1 to {m.degrees}.")
    return np.array([*entries, *[0.0] * (m.degrees - len(entries))])


def _flights(run: Run, row: Floats, t0: float, t1: float) -> tuple[Floats, Floats]:
    """Lines of the flights; a NaN at each event breaks the line there."""
    inside = (run.time > t0) & (run.time <= t1)
    t = np.linspace(t0, t1, HISTORY_POINTS)
    place, speed = (part @ row for part in run.at(t))
    at, events = np.searchsorted(t, run.time[inside]), run.position[inside] @ row
    gap = np.full(events.size, np.nan)
    before, after = (v[inside] @ row for v in (run.velocity_before, run.velocity_after))
    where = np.repeat(at, 3)
    return (
        np.insert(place, where, np.stack([events, gap, events], axis=1).ravel()),
        np.insert(speed, where, np.stack([before, gap, after], axis=1).ravel()),
    )


def _jumps(run: Run, row: Floats, t0: float, t1: float) -> tuple[Floats, Floats]:
    """One vertical stroke per impact, from the velocity before to the one after."""
    inside = run.impacts & (run.time > t0) & (run.time <= t1)
    place = run.position[inside] @ row
    before, after = (v[inside] @ row for v in (run.velocity_before, run.velocity_after))
    gap = np.full(place.size, np.nan)
    return (
        np.stack([place, place, gap], axis=1).ravel(),
        np.stack([before, after, gap], axis=1).ravel(),
    )


def _names(row: Floats) -> tuple[str, str]:
    """Labels of u = row . x and its rate, the positive terms first."""
    return combination(row), combination(row, r"\dot x")
