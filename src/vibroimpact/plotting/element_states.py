"""States of elements over time, as strips below a history; motions of stops."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from vibroimpact._core.types import Floats
from vibroimpact.model.elements.element import Look
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import element_labels, needs_elements
from vibroimpact.model.system import mechanism_of
from vibroimpact.plotting import style
from vibroimpact.simulation.simulate import Run, phases_of

STRIP_OF_AXES = 0.055  # a strip is so high, relative to the axes
SPACE_OF_AXES = 0.02  # strips are so far apart, relative to the axes
TEXT_POINTS = 7.5  # labels are so high
LIGHT = "#FFFFFF"


def colour_of(look: Look) -> str:
    """The colour of a state."""
    own, by = getattr(style, look.colour.upper()), LIGHT if look.white > 0.0 else style.BLACK
    return style.mixed(own, by, abs(look.white)) if look.white else str(own)


def shown_elements(run: Run) -> list[int]:
    """Numbers of soft stops, friction and phase switches, and of the rigid stops that come to rest."""
    contacts = len(mechanism_of(run.system).rigid_stops)
    states = run.all_states
    return [i for i in range(states.shape[1]) if i >= contacts or states[:, i].any()]


def draw_states(ax: Axes, run: Run, window: tuple[float, float]) -> None:
    """Draw a strip for every element below the data, and label the states."""
    m = mechanism_of(run.system)
    numbers = shown_elements(run) if needs_elements(m) else []
    if not numbers:
        return
    low, high = ax.get_ylim()
    room = len(numbers) * (STRIP_OF_AXES + SPACE_OF_AXES) + SPACE_OF_AXES
    ax.set_ylim(low - (high - low) * room / (1.0 - room), high)
    labels = element_labels(m)
    named = set[str]()
    for row, number in enumerate(reversed(numbers)):
        y = SPACE_OF_AXES + row * (STRIP_OF_AXES + SPACE_OF_AXES)
        for begin, end, value in _pieces(run, number, *window):
            look = m.elements[number].looks.get(value)
            if look is None:
                continue
            ax.add_patch(
                Rectangle((begin, y), end - begin, STRIP_OF_AXES, facecolor=colour_of(look),
                          edgecolor="none", transform=ax.get_xaxis_transform(),
                          label="" if look.words in named else look.words)
            )  # fmt: skip
            named.add(look.words)
        ax.text(1.01, y + STRIP_OF_AXES / 2.0, labels[number], transform=ax.transAxes, va="center",
                fontsize=TEXT_POINTS)  # fmt: skip


def _pieces(run: Run, number: int, start: float, end: float) -> list[tuple[float, float, int]]:
    """Intervals over which an element keeps its state, within a window."""
    states = run.all_states[:, number]
    times = np.concatenate([[0.0], run.time, [np.inf]])
    changes = np.flatnonzero(np.diff(states)) + 1
    edges = [0, *changes.tolist(), len(states)]
    found = [(max(times[a], start), min(times[b], end), int(states[a])) for a, b in pairwise(edges)]
    return [piece for piece in found if piece[0] < piece[1]]


def motion_of(run: Run, lines: tuple[Harmonic, ...], t: Floats) -> Floats:
    """Motion of a stop at times of the run."""
    m = mechanism_of(run.system)
    place = np.zeros(len(t))
    for line in lines:
        number = [force.omega for force in m.forces].index(line.omega)
        angle = phases_of(m, run.start.phase)[number] + line.omega * t
        place += line.sine[0] * np.sin(angle) + line.cosine[0] * np.cos(angle)
    return place
