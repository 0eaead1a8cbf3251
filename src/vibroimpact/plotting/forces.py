"""Forces of elements: over time, and over the displacement as a hysteresis loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_index, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import units_of
from vibroimpact.model.mechanism import Mechanism, element_labels
from vibroimpact.model.system import mechanism_of
from vibroimpact.plotting import style
from vibroimpact.plotting.element_states import motion_of, shown_elements
from vibroimpact.plotting.history import HISTORY_POINTS, window_of
from vibroimpact.plotting.variables import combination
from vibroimpact.simulation.simulate import Run


def plot_forces(
    run: Run, t0: float = 0.0, t1: float | None = None, *,
    elements: Sequence[int] | None = None, ax: Axes | None = None,
) -> Axes:  # fmt: skip
    """Draw the forces of elements over time.

    Parameters
    ----------
    run
        A result of :func:`vibroimpact.simulate`.
    t0, t1
        Window of time within the run; to its last event if ``t1`` is not given.
    elements
        Numbers of contacts and elements as in ``run.contact``; by default soft stops, friction, and
        the rigid stops that come to rest. A phase switch has no row along which a force could be.

    Notes
    -----
    A force f acts on the coordinates as f row (``Run.forces``). Impulses of impacts are not drawn.
    """
    start, end = window_of(run, t0, t1)
    m = mechanism_of(run.system)
    labels = element_labels(m)
    if elements is not None:
        numbers = _numbers("elements", elements, m)
    else:
        numbers = [i for i in shown_elements(run) if m.elements[i].row]
    if not numbers:
        raise InvalidParameterError(
            "run: no contact rests, and there is no soft stop or friction, so there are impulses "
            "only. For their times see run.time."
        )
    t, force = _sampled(run, start, end)
    units = units_of(run.system)
    colours = style.series(len(numbers))
    with style.drawing(ax, width=1.6 * style.WIDTH) as ax:
        ax.axhline(0.0, color=style.SILVER, linewidth=0.6, zorder=0)
        for number, colour in zip(numbers, colours, strict=True):
            ax.plot(t, force[:, number], color=colour, label=labels[number])
        ax.set(xlabel=units.label("time $t$", "time"), ylabel=units.label("force $f$", "force"))
        ax.set_xlim(start, end)
        style.legend_outside(ax, columns=6)
    return ax


def plot_hysteresis(
    run: Run, element: int, t0: float = 0.0, t1: float | None = None, *, ax: Axes | None = None
) -> Axes:
    """Draw the force of an element over its displacement.

    Parameters
    ----------
    run
        A result of :func:`vibroimpact.simulate`.
    element
        Number of the contact or element, as in ``run.contact``.
    t0, t1
        Window of time within the run; to its last event if ``t1`` is not given.

    Notes
    -----
    Over u = row . x, for a stop that moves relative to it. The force drawn is -f, that on the
    element: a loop is run clockwise, and its area is the energy that the element takes in a cycle,
    where no belt brings any.
    """
    start, end = window_of(run, t0, t1)
    m = mechanism_of(run.system)
    (number,) = _numbers("element", [element], m)
    part = m.elements[number]
    t, force = _sampled(run, start, end)
    u = run.at(t)[0] @ np.array(part.row)
    name = f"${combination(part.row)}$"
    if part.is_stop and part.motion:
        u, name = u - motion_of(run, part.motion, t), f"{name}, relative to the stop"
    units = units_of(run.system)
    with style.drawing(ax, height=style.WIDTH * 0.85) as ax:
        for level in (ax.axhline, ax.axvline):
            level(0.0, color=style.SILVER, linewidth=0.6, zorder=0)
        ax.plot(u, -force[:, number], color=style.BLUE, linewidth=0.8)
        ax.set(xlabel=units.label(name, "length"), title=element_labels(m)[number])
        ax.set_ylabel(units.label("force on the element $-f$", "force"))
    return ax


def _numbers(name: str, given: Sequence[int], m: Mechanism) -> list[int]:
    """Numbers of stops and friction that there are; the argument has this name."""
    try:
        found = list(given)
    except TypeError:
        raise refusal(name, given, "a sequence of numbers of elements") from None
    for number in found:
        check_index("element", number, len(m.elements))
        if not m.elements[number].row:
            raise refusal(
                name, number, "a stop or friction",
                "A phase switch has no row; plot_history draws its arcs.",
            )  # fmt: skip
    return [int(number) % len(m.elements) for number in found]


def _sampled(run: Run, start: float, end: float) -> tuple[Floats, Floats]:
    """Times of a window, twice at events: just before and after; and all forces."""
    inside = run.time[(run.time > start) & (run.time <= end)]
    even = np.linspace(start, end, HISTORY_POINTS)
    t = np.unique(np.concatenate([even, inside, np.nextafter(inside, -np.inf)]))
    return t, run.forces(t)
