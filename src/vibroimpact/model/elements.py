"""Elements with states of their own: soft stops and Coulomb friction (theory.md, "Elements").

An element has a few states. Each adds to the equations of motion, and lasts while its guards hold;
:mod:`vibroimpact.compile.piecewise` writes both as rows on the coordinates of the kernel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Literal

from vibroimpact._core.checks import (
    check_choice,
    names_arguments,
    nonnegative,
    positive,
    real,
    real_or_infinite,
    refusal,
    vector,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact.model.harmonic import Harmonic, as_lines

Release = Literal["force", "gap"]
NUMBER_OR_NONE = "a finite number, or left out where there is no stop"


class SoftStopState(IntEnum):
    """States of a soft stop."""

    OPEN = 0
    UPPER = 1  #: pressed at the upper stop
    LOWER = 2  #: pressed at the lower stop
    BEHIND_UPPER = 3  #: within the upper stop, which has not recovered and does not touch
    BEHIND_LOWER = 4


class FrictionState(IntEnum):
    """States of a friction joint."""

    FORWARD = 0  #: slips with positive slip speed
    BACKWARD = 1
    STICK = 2


def pair_of(name: str, value: Any, check: Any) -> tuple[float, float]:
    """Return a number for both sides, or one for each (lower, upper), as a pair."""
    both = value if isinstance(value, tuple | list) else (value, value)
    if len(both) != 2:
        raise refusal(name, value, "one number, or (lower, upper)")
    return check(name, both[0]), check(name, both[1])


@names_arguments(
    gap="Give upper, lower or both; a negative upper is a preload.",
    restitution="A soft stop has none: damping dissipates. For a coefficient take RigidStop.",
    preload="A preloaded spring is one with upper < 0.",
)
@dataclass(frozen=True, slots=True)
class SoftStop:
    """A spring and a dashpot behind a gap, on one or both sides of row . x.

    Where u = row . x is beyond ``upper``, the force -(k (u - upper) + c u') acts along ``row``;
    below ``lower`` likewise. A one-sided stop with ``upper < 0`` is preloaded at rest; with
    ``lower = upper`` it is a bilinear spring.

    Parameters
    ----------
    row
        Contact coordinate u = row . x, shape (n,), not all zero.
    lower, upper
        Where the stops begin, at least one finite, lower <= upper.
    stiffness, damping
        k > 0 and c >= 0: one number, or (at lower, at upper).
    release
        ``"force"``: the stop lets go when its force would pull, and touches again when its force
        would press: no adhesion. ``"gap"``: it lets go when u is back at the stop, pulling before.
    motion
        Motion of both stops, a :class:`Harmonic` with one amplitude, or several.
    """

    row: tuple[float, ...]
    lower: float = -math.inf
    upper: float = math.inf
    stiffness: float | tuple[float, float] = 1.0
    damping: float | tuple[float, float] = 0.0
    release: Release = "force"
    motion: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", _nonzero(self.row))
        for name in ("lower", "upper"):
            value = real_or_infinite(name, getattr(self, name), NUMBER_OR_NONE)
            object.__setattr__(self, name, value)
        if self.lower > self.upper or (is_infinite(self.lower) and is_infinite(self.upper)):
            raise InvalidParameterError(
                f"lower = {self.lower}, upper = {self.upper}: need lower <= upper, one finite. "
                "Where both stops press at once, take two one-sided ones."
            )
        object.__setattr__(self, "stiffness", pair_of("stiffness", self.stiffness, positive))
        object.__setattr__(self, "damping", pair_of("damping", self.damping, nonnegative))
        check_choice("release", self.release, ["force", "gap"])
        object.__setattr__(self, "motion", as_lines("motion", self.motion))

    def law(self, side: int) -> tuple[float, float, float]:
        """Where the stop of a side begins, its stiffness and its damping."""
        i = 1 if side > 0 else 0
        pairs = self.stiffness, self.damping
        k, c = (pair[i] if isinstance(pair, tuple) else pair for pair in pairs)
        return (self.upper if side > 0 else self.lower), k, c

    @property
    def states(self) -> tuple[SoftStopState, ...]:
        """The states that it can have; behind a stop only where a dashpot holds that back."""
        found = [SoftStopState.OPEN]
        for side, pressed, behind in (
            (1, SoftStopState.UPPER, SoftStopState.BEHIND_UPPER),
            (-1, SoftStopState.LOWER, SoftStopState.BEHIND_LOWER),
        ):
            limit, _, damping = self.law(side)
            if is_infinite(limit):
                continue
            waits = self.release == "force" and damping != 0.0
            found += [pressed, behind] if waits else [pressed]
        return tuple(found)


@names_arguments(
    mu="Give kinetic, the friction force: coefficient times normal load.",
    normal="Give kinetic, the friction force: coefficient times normal load.",
    coefficient="Give kinetic, the friction force: coefficient times normal load.",
    velocity="Give belt_speed.",
)
@dataclass(frozen=True, slots=True)
class Friction:
    """Coulomb friction between row . x and a belt.

    While it slips, the force -kinetic sign(row . v - belt speed) acts along ``row``. While it
    sticks, the force is what holds it, up to ``static``; it breaks away where more is needed.

    Parameters
    ----------
    row
        Slipping coordinate row . x, shape (n,), not all zero; (1, -1) for two masses on each other.
    kinetic
        Friction force while it slips, >= 0.
    static
        Largest friction force while it sticks, >= kinetic; equal to it where left out.
    belt_speed
        Constant part of the speed of the belt.
    belt_motion
        Harmonic parts of it: a :class:`Harmonic` with one amplitude (of the speed), or several.
    """

    row: tuple[float, ...]
    kinetic: float
    static: float | None = None
    belt_speed: float = 0.0
    belt_motion: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", _nonzero(self.row))
        object.__setattr__(self, "kinetic", nonnegative("kinetic", self.kinetic))
        static = self.kinetic if self.static is None else nonnegative("static", self.static)
        if static < self.kinetic:
            raise refusal(
                "static", self.static, f">= kinetic = {self.kinetic}",
                "Friction that grows with sliding has static = kinetic.",
            )  # fmt: skip
        object.__setattr__(self, "static", static)
        object.__setattr__(self, "belt_speed", real("belt_speed", self.belt_speed))
        object.__setattr__(self, "belt_motion", as_lines("belt_motion", self.belt_motion))

    @property
    def states(self) -> tuple[FrictionState, ...]:
        """The states that it can have."""
        return tuple(FrictionState)

    @property
    def motion(self) -> tuple[Harmonic, ...]:
        """Harmonic parts of the speed of the belt."""
        return self.belt_motion


Element = SoftStop | Friction


def _nonzero(value: Any) -> tuple[float, ...]:
    row = vector("row", value)
    if not any(row):
        raise InvalidParameterError("row = 0: an element must involve a coordinate.")
    return row
