"""Arrays of states: starts or final states of the members of an ensemble."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.model.state import State, names_of_state


class States(NamedTuple):
    """Array of states: position and velocity (k, n), phase (k,)."""

    position: Floats
    velocity: Floats
    phase: Floats

    def of(self, rows: Any) -> States:
        """Selected states, by rows, flags or a slice."""
        return States(*(part[rows] for part in self))

    def state(self, row: int) -> State:
        """State in one row."""
        position, velocity, phase = (part[row] for part in self)
        return State(tuple(position), tuple(velocity), float(phase))


def varied(base: State, drawn: Mapping[str, Floats], count: int) -> States:
    """``count`` copies of a state with some coordinates replaced."""
    row = np.array([*base.position, *base.velocity, base.phase])
    rows = np.tile(row, (count, 1))
    n = len(base.position)
    places = {name: i for i, name in enumerate(names_of_state(n))}
    for name, values in drawn.items():
        rows[:, places[name]] = values
    parts = rows[:, :n], rows[:, n : 2 * n], rows[:, -1]
    return States(*(np.ascontiguousarray(part) for part in parts))
