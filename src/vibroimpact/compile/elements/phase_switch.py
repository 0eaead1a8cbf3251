"""Phase switches: forces and limits of every arc."""

from __future__ import annotations

from typing import Any

from vibroimpact._core.linear import Matrix, Vector
from vibroimpact._kernel import sincos
from vibroimpact.compile.elements.element import (
    NEGATIVE,
    POSITIVE,
    ElementRows,
    Hold,
    Limits,
    plus,
)
from vibroimpact.model.elements.phase_switch import PhaseSwitch
from vibroimpact.model.harmonic import Harmonic


class PhaseSwitchRows(ElementRows[PhaseSwitch]):
    """A phase switch."""

    def _from_phase(self, phase: Any) -> Vector:
        """Row of sin(theta - phase)."""
        sine, cosine = sincos(phase) if isinstance(phase, float) else (phase.sin(), phase.cos())
        line = Harmonic(self.element.omega, (cosine,), (-sine,))
        return self.rows.waves(self.rows.motion((line,)))

    def force(self, state: int) -> tuple[Vector, int] | None:
        """The force of the spring and the dashpot of its arc."""
        if not self.element.row:
            return None
        k, c = self.element.spring_of(state)
        return plus([k * x for x in self.gap], self.speed, c), -1

    def add_force(self, pull: Matrix, state: int) -> None:
        """The constant force of its arc, and that of its spring."""
        e = self.element
        for i, x in enumerate(e.forces[e.arcs[state][2]] if e.forces else ()):
            pull[i][-1] = pull[i][-1] + x
        super().add_force(pull, state)

    def limits(self, state: int, hold: Hold | None, *, pinned: bool) -> list[Limits]:
        """The phases at which an arc begins and ends; the next one may begin with an impulse."""
        e = self.element
        begin, end, _ = e.arcs[state]
        late = Limits(self._from_phase(begin), *POSITIVE)
        early = Limits(self._from_phase(end), *NEGATIVE, self._impulse_after(state))
        return [early] if e.is_half_turn(state) else [late, early]  # there both say the same

    def _impulse_after(self, state: int) -> int:
        e = self.element
        begin, _, number = e.arcs[(state + 1) % len(e.arcs)]
        return number if e.impulses and begin == e.phases[number] else -1
