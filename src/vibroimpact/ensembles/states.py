"""Many states: where the members of an ensemble start, or where they ended."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact.state import State

Floats = NDArray[np.float64]


class States(NamedTuple):
    """Many states: position and velocity (k, n), phase (k,)."""

    position: Floats
    velocity: Floats
    phase: Floats


def names_of_state(degrees: int) -> list[str]:
    """x1, ..., v1, ..., phase."""
    return [f"{kind}{i + 1}" for kind in "xv" for i in range(degrees)] + ["phase"]


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
