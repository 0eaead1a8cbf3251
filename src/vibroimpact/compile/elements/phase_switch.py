"""Phase switches: force and limits of every arc."""

from __future__ import annotations

from vibroimpact._core.linear import Matrix, Vector
from vibroimpact._kernel import sincos
from vibroimpact.compile.elements.element import NEGATIVE, POSITIVE, ElementRows, Hold, Limits
from vibroimpact.model.elements.phase_switch import PhaseSwitch
from vibroimpact.model.harmonic import Harmonic


class PhaseSwitchRows(ElementRows[PhaseSwitch]):
    """A phase switch."""

    def _from_phase(self, phase: float) -> Vector:
        """Row of sin(theta - phase)."""
        sine, cosine = sincos(phase)
        line = Harmonic(self.element.omega, (cosine,), (-sine,))
        return self.rows.waves(self.rows.motion((line,)))

    def add_force(self, pull: Matrix, state: int) -> None:
        """The constant force of its arc."""
        for i, x in enumerate(self.element.forces[self.element.arcs[state][2]]):
            pull[i][-1] = pull[i][-1] + x

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
