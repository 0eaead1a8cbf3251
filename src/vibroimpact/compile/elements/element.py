"""Rows of an element on the state of a mechanism, from which it is compiled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Generic, NamedTuple, TypeVar

from vibroimpact._core.linear import Matrix, Vector
from vibroimpact.model.elements.element import Element
from vibroimpact.model.harmonic import Harmonic

POSITIVE, NEGATIVE = (0.0, math.inf), (-math.inf, 0.0)
Kind = TypeVar("Kind", bound=Element, covariant=True)


def plus(a: Vector, b: Vector, factor: float = 1.0) -> Vector:
    """Row a + factor b."""
    return [x + factor * y for x, y in zip(a, b, strict=True)]


class StateRows:
    """Rows on (y, 1), y = (x_1, v_1 / scale, ..., sin theta, cos theta of every line)."""

    def __init__(self, degrees: int, omegas: Sequence[float], scale: float) -> None:
        self.degrees, self.omegas, self.scale = degrees, omegas, scale
        self.size = 2 * (degrees + len(omegas))

    def constant(self, value: float = 0.0) -> Vector:
        """Return the row of a constant."""
        return [*[0.0] * self.size, value]

    def position(self, row: Sequence[float]) -> Vector:
        """Return ``row . x``."""
        out = self.constant()
        for i, x in enumerate(row):
            out[2 * i] = x
        return out

    def velocity(self, row: Sequence[float]) -> Vector:
        """Return ``row . v``."""
        out = self.constant()
        for i, x in enumerate(row):
            out[2 * i + 1] = x * self.scale
        return out

    def waves(self, waves: Vector) -> Vector:
        """A row on (sin theta, cos theta of every line, 1)."""
        return [*[0.0] * (2 * self.degrees), *waves]

    def motion(self, lines: Sequence[Harmonic], derivative: int = 0) -> Vector:
        """Derivative of a sum of lines as a row on (sin theta, cos theta of every line, 1)."""
        out = [0.0] * (2 * len(self.omegas) + 1)
        for line in lines:
            at = next(i for i, w in enumerate(self.omegas) if w is line.omega or w == line.omega)
            sine, cosine = line.sine[0], line.cosine[0]
            for _ in range(derivative):
                sine, cosine = -line.omega * cosine, line.omega * sine
            out[2 * at] += sine
            out[2 * at + 1] += cosine
        return out


class Constraint(NamedTuple):
    """A row of R with the speed s that it prescribes, and its derivative, as rows on (w, 1)."""

    row: Vector
    speed: Vector
    acceleration: Vector


class Limits(NamedTuple):
    """A row on (y, 1) that stays within limits while a state lasts; the motion may jump where it leaves them.

    ``jump`` is the number of an impulse, or of a reset, among those of the element, -1 for none; ``target`` the
    state that follows, -1 where the forces decide.
    """

    row: Vector
    lower: float
    upper: float
    jump: int = -1
    target: int = -1


class Hold(NamedTuple):
    """The force that holds an element along its row, a row on (y, 1), and the level up to which it may."""

    force: Vector
    level: float


class ElementRows(Generic[Kind]):
    """An element in the equations of a mechanism."""

    def __init__(self, element: Kind, rows: StateRows) -> None:
        self.element, self.rows = element, rows

    @cached_property
    def gap(self) -> Vector:
        """Gap coordinate ``row . x``, relative to what moves."""
        e, rows = self.element, self.rows
        return plus(rows.position(e.row), rows.waves(rows.motion(e.motion)), -1.0)

    @cached_property
    def speed(self) -> Vector:
        """Speed ``row . v``, relative to what moves: the force works at it."""
        e, rows = self.element, self.rows
        out = plus(rows.velocity(e.row), rows.waves(rows.motion(e.motion, 1)), -1.0)
        out[-1] = out[-1] - e.grip.speed
        return out

    @cached_property
    def held_speed(self) -> Vector:
        """Speed ``row . v`` of an element that is held, as a row on (w, 1)."""
        speed = self.rows.motion(self.element.motion, 1)
        speed[-1] = self.element.grip.speed
        return speed

    def constraint(self) -> Constraint:
        """Constraint in the holding state of the element; for a rigid stop, while it is closed."""
        acceleration = self.rows.motion(self.element.motion, 2)
        return Constraint(list(self.element.row), self.held_speed, acceleration)

    def force(self, state: int) -> tuple[Vector, int] | None:
        """Force along its row with its sign in a state that does not hold; None where there is none."""
        return None

    def add_force(self, pull: Matrix, state: int) -> None:
        """Add its force in a state that does not hold to those on the coordinates."""
        if (found := self.force(state)) is not None:
            row, sign = found
            for i, x in enumerate(self.element.row):
                pull[i] = plus(pull[i], row, sign * x)

    def limits(self, state: int, hold: Hold | None, *, pinned: bool) -> list[Limits]:
        """Limits at which a state ends, held by ``hold`` or ``pinned``, where others prescribe row . v."""
        return []
