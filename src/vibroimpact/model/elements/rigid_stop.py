"""Rigid stops: an impact with a coefficient of restitution."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from vibroimpact._core.checks import (
    check_flag,
    fraction,
    names_arguments,
    nonnegative,
)
from vibroimpact._core.codes import NamedCode
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import AnyFloat
from vibroimpact.model.elements.element import (
    MOVES,
    Element,
    Look,
    Spring,
    nonzero_row,
    pair_of,
    set_limits,
    symbols_of,
)
from vibroimpact.model.harmonic import Harmonic, as_lines

ONE_MOTION = "Give motion, that of both stops; stops that move differently are two."
FRICTIONLESS = "Friction is an element of its own: Friction(row, kinetic, static)."
RIGID = "A rigid stop has a coefficient of restitution. A spring or dashpot is a SoftStop."


class RigidStopState(NamedCode):
    """States of a rigid stop."""

    OPEN = 0
    UPPER = 1  #: at rest at the upper stop
    LOWER = 2  #: at rest at the lower stop


@names_arguments(
    friction=FRICTIONLESS, mu=FRICTIONLESS, stiffness=RIGID, damping=RIGID, velocity=MOVES,
    amplitude=MOVES, omega=MOVES, upper_motion=ONE_MOTION, lower_motion=ONE_MOTION,
)  # fmt: skip
@dataclass(frozen=True, slots=True)
class RigidStop(Element):
    """A two-sided or one-sided clearance: ``lower <= row . x <= upper``.

    Parameters
    ----------
    row
        Contact coordinate u = row . x, shape (n,), not all zero.
    lower, upper
        Stops; at least one finite, lower < upper.
    restitution
        Coefficient of restitution in [0, 1], or a pair (at lower, at upper).
    motion
        Displacement of both stops from their places over time: a :class:`Harmonic` with one
        amplitude, or several, which add up. Impacts are relative to the stop. Stops that move
        differently are two.
    active
        Allow restitution above 1: a stop that kicks, as a pinball bumper does.
    """

    kind: ClassVar[str] = "rigid_stop"
    State = RigidStopState
    looks: ClassVar[Mapping[int, Look]] = {
        RigidStopState.UPPER: Look("rests at A", "blue"),
        RigidStopState.LOWER: Look("rests at B", "vermilion"),
    }
    rigid = True
    is_stop = True

    row: tuple[float, ...]
    lower: AnyFloat = -math.inf
    upper: AnyFloat = math.inf
    restitution: float | tuple[float, float] = 1.0
    motion: tuple[Harmonic, ...] = ()
    active: bool = False

    def __post_init__(self) -> None:
        check_flag("active", self.active)
        object.__setattr__(self, "row", nonzero_row(self.row, "a rigid stop"))
        set_limits(self)
        if not self.lower < self.upper or (is_infinite(self.lower) and is_infinite(self.upper)):
            raise InvalidParameterError(
                f"lower = {self.lower}, upper = {self.upper}: need lower < upper, one finite. "
                "For two stops without a gap between them fix the coordinate instead."
            )
        check = nonnegative if self.active else fraction
        object.__setattr__(self, "restitution", pair_of("restitution", self.restitution, check))
        object.__setattr__(self, "motion", as_lines("motion", self.motion))

    @property
    def restitutions(self) -> tuple[float, float]:
        """Restitution at the lower and at the upper stop."""
        r = self.restitution
        return r if isinstance(r, tuple) else (r, r)

    @property
    def mirrored(self) -> tuple[tuple[float, float], ...]:
        """Coefficients of restitution."""
        return (self.restitutions,)

    def check_massless(self, light: Sequence[int], name: str) -> None:
        """Refuse a coordinate without mass, which would need an infinite acceleration."""
        for i in light:
            if self.row[i]:
                raise InvalidParameterError(
                    f"{name}: a rigid stop on coordinate {i}, which has no mass, would need an "
                    "infinite acceleration. Give it a mass, or take a SoftStop."
                )

    def spring_at(self, side: int) -> Spring:
        """Infinitely stiff spring at the stop of a side."""
        return Spring(self.upper if side > 0 else self.lower, math.inf, 0.0)

    @property
    def conserves(self) -> bool:
        """Whether its impacts are elastic."""
        return self.restitutions == (1.0, 1.0)

    def caption(self, *sides: int) -> str:
        """Caption: the coefficient of restitution."""
        return symbols_of(R=[self.restitutions[side > 0] for side in sides])
