"""Soft stops: force and limits of every state."""

from __future__ import annotations

import math

from vibroimpact._core.linear import Vector
from vibroimpact.compile.elements.element import NEGATIVE, POSITIVE, ElementRows, Hold, Limits
from vibroimpact.model.elements.soft_stop import SoftStop, SoftStopState

LIMITED = (SoftStopState.LIMITED_UPPER, SoftStopState.LIMITED_LOWER)


class SoftStopRows(ElementRows[SoftStop]):
    """A soft stop."""

    def _press(self, side: int, share: int = 1) -> Vector:
        """Row of the force of the spring and a share 1, 0, -1 of the dashpot, > 0 where it presses."""
        limit, k, c = self.element.spring_at(side)
        c = share * c
        out = [side * (k * x + c * y) for x, y in zip(self.gap, self.speed, strict=True)]
        out[-1] = out[-1] - side * (k * limit)
        return out

    def force(self, state: int) -> tuple[Vector, int] | None:
        """Force of spring and dashpot; twice that of the spring where the dashpot is limited."""
        side = self.element.side_of(state)
        if self.element.pressed(state) is None:
            return None
        if state in LIMITED:
            return [2.0 * x for x in self._press(side, 0)], -side
        return self._press(side), -side

    def limits(self, state: int, hold: Hold | None, *, pinned: bool) -> list[Limits]:
        """Limits at which the gap opens or closes, or the law asks for another force."""
        e, gap, side = self.element, self.gap, self.element.side_of(state)
        if not side:
            return [Limits(gap, e.lower, e.upper)]
        within = Limits(gap, *((e.upper, math.inf) if side > 0 else (-math.inf, e.lower)))
        if e.pressed(state) is None:
            return [within, Limits(self._press(side), *NEGATIVE)]
        if state in LIMITED:
            return [within, Limits(self._press(side, -1), *NEGATIVE)]
        if e.law == "linear" or not e.spring_at(side).damping:
            return [within]
        pressed = Limits(self._press(side), *POSITIVE)
        if e.law == "limited":  # |c s'| <= k s, which has s >= 0 in it
            return [pressed, Limits(self._press(side, -1), *POSITIVE)]
        # it has come beyond the stop: from the other one, too, its law may ask for pressure
        return [within, pressed]
