"""Mode switches: the flow of every mode of a hybrid system, and the levels at which it ends."""

from __future__ import annotations

import math

from vibroimpact._core.linear import Matrix
from vibroimpact.compile.elements.element import ElementRows, Hold, Limits, plus
from vibroimpact.model.elements.mode_switch import ModeSwitch


class ModeSwitchRows(ElementRows[ModeSwitch]):
    """A mode switch."""

    def add_force(self, pull: Matrix, state: int) -> None:
        """The right side of its mode."""
        e, rows = self.element, self.rows
        both = zip(e.matrices[state], e.waves[state], e.constants[state], strict=True)
        for i, (row, waves, constant) in enumerate(both):
            pull[i] = plus(pull[i], plus(rows.position(row), rows.waves([*waves, constant])))

    def limits(self, state: int, hold: Hold | None, *, pinned: bool) -> list[Limits]:
        """The level of every way out of a mode."""
        e, rows, found = self.element, self.rows, list[Limits]()
        for way in e.ways_from(state):
            row = plus(rows.position(way.row), rows.waves([*way.waves, 0.0]))
            ends = (-math.inf, way.level) if way.rising else (way.level, math.inf)
            reset = 1 + e.resets.index(way) if way.shift else 0  # the state is kept
            found.append(Limits(row, *ends, reset, way.to))
        return found
