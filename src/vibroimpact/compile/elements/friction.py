"""Friction: force and limits of every state."""

from __future__ import annotations

from vibroimpact._core.linear import Vector
from vibroimpact.compile.elements.element import NEGATIVE, POSITIVE, ElementRows, Hold, Limits, plus
from vibroimpact.model.elements.friction import Friction, FrictionState


class FrictionRows(ElementRows[Friction]):
    """A friction."""

    def _load(self) -> Vector:
        """Row of the normal load; the constant 1 where the levels hold it."""
        load, rows = self.element.load, self.rows
        if load is None:
            return rows.constant(1.0)
        out = rows.waves(rows.motion(load.motion))
        out = plus(out, rows.position(load.position))
        out = plus(out, rows.velocity(load.velocity))
        out[-1] = load.constant
        return out

    def force(self, state: int) -> tuple[Vector, int] | None:
        """Kinetic force against the slip; none where the surfaces have lifted off."""
        if state == FrictionState.LIFTED:
            return None
        kinetic = [self.element.kinetic * x for x in self._load()]
        return kinetic, -1 if state == FrictionState.FORWARD else 1

    def limits(self, state: int, hold: Hold | None, *, pinned: bool) -> list[Limits]:
        """Limits at which it breaks away, turns back, lifts off or touches again."""
        load = self.element.load
        if hold is not None:
            if load is None:
                return [Limits(hold.force, -hold.level, hold.level)]
            most = [hold.level * x for x in self._load()]
            return [
                Limits(plus(most, hold.force, sign), *POSITIVE) for sign in (-1.0, 1.0)
            ]  # fmt: skip
        if state == FrictionState.LIFTED:
            return [Limits(self._load(), *NEGATIVE)]
        pressed = [Limits(self._load(), *POSITIVE)] if load else []
        if pinned:
            return pressed
        way = POSITIVE if state == FrictionState.FORWARD else NEGATIVE
        return [Limits(self.speed, *way), *pressed]
