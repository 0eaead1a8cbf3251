"""Time histories of the coordinates, with the impacts."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from vibroimpact._core.checks import check_kind, real
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.units import units_of
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.plotting import style
from vibroimpact.plotting.element_states import draw_states, motion_of
from vibroimpact.simulation.simulate import Run, latest

HISTORY_POINTS = 4000  # a curve has more points than a printed column has pixels
STOPS = ((1, "A", style.BLUE, "^"), (-1, "B", style.VERMILION, "v"))
COLOURS = (style.BLACK, style.ORANGE, style.GREEN, style.PURPLE, style.SKY)


def plot_history(
    run: Run, t0: float = 0.0, t1: float | None = None, *, ax: Axes | None = None
) -> Axes:
    """Draw the coordinates over time and mark every impact.

    Parameters
    ----------
    run
        A result of :func:`vibroimpact.simulate`.
    t0, t1
        Window of time within the run; to its last event if ``t1`` is not given.

    Notes
    -----
    For a mass in a slot of another one, as in :class:`ImpactDamper`, both moving stops are drawn,
    x1 + delta (A) and x1 - delta (B), and the free mass between them. For other systems the
    impacts are marked on the coordinates that take part, stops of one coordinate are grey lines
    where they are (soft ones dashed), and below, a strip for every soft stop, friction joint and
    phase switch, and for every rigid stop that comes to rest, shows its state.
    """
    t, places = sampled(run, t0, t1)
    inside = run.impacts & (run.time >= t[0]) & (run.time <= t[-1])
    units = units_of(run.system)
    with style.drawing(ax, width=1.6 * style.WIDTH) as ax:
        if delta := _half_slot(run.system):
            _mass_in_slot(ax, run, delta, t, places, inside)
            ax.set_ylabel(units.label("$x_1,\\ x_2$", "length"))
        else:
            _any_system(ax, run, t, places, inside)
            _stops(ax, run, t)
            draw_states(ax, run, (t[0], t[-1]))
            ax.set_ylabel(units.label("$x_i$" if places.shape[1] > 1 else "$x_1$", "length"))
        ax.set(xlabel=units.label("time $t$", "time"), xlim=(t[0], t[-1]))
        style.legend_outside(ax, columns=4 if mechanism_of(run.system).switching else 6)
    return ax


def sampled(
    run: Run, t0: float, t1: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times of a window, including those of events so that corners stay sharp, and positions."""
    start, end = window_of(run, t0, t1)
    events = run.time[(run.time > start) & (run.time < end)]
    t = np.union1d(np.linspace(start, end, HISTORY_POINTS), events)
    return t, run.at(t)[0]


def window_of(run: Run, t0: float, t1: float | None) -> tuple[float, float]:
    """Window of time of a run, to its last event by default."""
    check_kind("run", run, Run, "a Run, as vi.simulate gives")
    last = float(run.time[-1]) if len(run) else 0.0
    start, end = real("t0", t0), last if t1 is None else real("t1", t1)
    if not 0.0 <= start < end <= latest(last):
        raise InvalidParameterError(
            f"t0 = {start}, t1 = {end}: need 0 <= t0 < t1 <= {last}, the span of the run."
        )
    return start, min(end, last)


def _half_slot(system: System) -> float:
    """Half of the play |x2 - x1| <= delta of two masses; 0 for any other system."""
    mechanism = mechanism_of(system)
    if mechanism.degrees != 2 or len(mechanism.rigid_stops) != 1:
        return 0.0
    (contact,) = mechanism.rigid_stops
    slot = contact.row == (-1.0, 1.0) and contact.lower == -contact.upper
    return contact.upper if slot else 0.0


def _mass_in_slot(
    ax: Axes, run: Run, delta: float, t: NDArray[np.float64], places: NDArray[np.float64],
    inside: NDArray[np.bool_],
) -> None:  # fmt: skip
    x1, x2 = places.T
    ax.fill_between(t, x1 - delta, x1 + delta, color="#EEF2F6", linewidth=0.0)
    for shift, (_, name, colour, _) in zip((delta, -delta), STOPS, strict=True):
        sign = "+" if shift > 0 else "-"
        ax.plot(t, x1 + shift, color=colour, label=rf"stop {name}: $x_1{sign}\delta$")
    ax.plot(t, x1, color=style.GREY, linewidth=0.8, label="$x_1$")
    ax.plot(t, x2, color=style.BLACK, label="$x_2$")
    for side, _, colour, marker in STOPS:
        chosen = inside & (run.side == side)
        ax.plot(run.time[chosen], run.position[chosen, 1], marker, color=colour, markersize=4.0,
                zorder=3)  # fmt: skip


def _any_system(
    ax: Axes, run: Run, t: NDArray[np.float64], places: NDArray[np.float64],
    inside: NDArray[np.bool_],
) -> None:  # fmt: skip
    for i, place in enumerate(places.T):
        ax.plot(t, place, color=COLOURS[i % len(COLOURS)], label=f"$x_{{{i + 1}}}$")
    for side, _, colour, marker in STOPS:
        for i in range(run.position.shape[1]):
            moved = run.velocity_after[:, i] != run.velocity_before[:, i]
            chosen = inside & (run.side == side) & moved
            ax.plot(run.time[chosen], run.position[chosen, i], marker, color=colour,
                    markersize=4.0, zorder=3)  # fmt: skip


def _stops(ax: Axes, run: Run, t: NDArray[np.float64]) -> None:
    """Draw the stops of contacts and soft stops that involve one coordinate only."""
    m = mechanism_of(run.system)
    for part in m.elements:
        entries = [r for r in part.row if r]
        if len(entries) != 1:
            continue
        look: dict[str, Any] = {"color": style.GREY, "linewidth": 2.0, "zorder": 0}
        if not part.rigid:
            look |= {"linewidth": 1.0, "linestyle": (0, (4, 2))}
        for stop in (part.limit_at(-1), part.limit_at(1)):
            if not np.isfinite(stop):
                continue
            if not part.motion:
                ax.axhline(stop / entries[0], **look)
                continue
            place = (stop + motion_of(run, part.motion, t)) / entries[0]
            ax.plot(t, place, **(look | {"linewidth": 1.2}))
