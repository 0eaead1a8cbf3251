"""Rigid stops: a gap while they are open, a force while they are closed."""

from __future__ import annotations

import math

from vibroimpact._core.linear import Vector
from vibroimpact.compile.elements.element import ElementRows
from vibroimpact.compile.modes import Guard
from vibroimpact.model.elements.rigid_stop import RigidStop


class RigidStopRows(ElementRows[RigidStop]):
    """A rigid stop."""

    def open(self, *, pinned: bool) -> Guard:
        """Guard of the gap, which is constant where others prescribe row . v."""
        gap, e = self.gap, self.element
        limits = (-math.inf, math.inf) if pinned else (e.lower, e.upper)
        return Guard(gap[:-1], gap[-1], *limits)

    def closed(self, side: int, multiplier: Vector) -> Guard:
        """The force that keeps it closed on a side."""
        force = [-side * x for x in multiplier]
        return Guard(force[:-1], force[-1], 0.0, math.inf, side)
