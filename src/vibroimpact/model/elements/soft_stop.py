"""Soft stops: a spring and a dashpot behind a gap."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

from vibroimpact._core.checks import (
    check_choice,
    names_arguments,
    nonnegative,
    positive,
    refusal,
)
from vibroimpact._core.codes import NamedCode
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import AnyFloat
from vibroimpact.model.elements.element import (
    Element,
    Look,
    Spring,
    nonzero_row,
    pair_of,
    set_limits,
    symbols_of,
)
from vibroimpact.model.harmonic import Harmonic, as_lines

StopLaw = Literal["linear", "unilateral", "limited"]
LINEAR = "A stop that stiffens is a sum of soft stops with other gaps."


class SoftStopState(NamedCode):
    """States of a soft stop."""

    OPEN = 0
    UPPER = 1  #: pressed at the upper stop
    LOWER = 2  #: pressed at the lower stop
    BEHIND_UPPER = 3  #: within the upper stop, which has not recovered: without force
    BEHIND_LOWER = 4
    LIMITED_UPPER = (
        5  #: pressed at the upper stop, its damping force being as large as that of its spring
    )
    LIMITED_LOWER = 6


@names_arguments(
    gap="Give upper, lower or both; a negative upper is a preload.",
    release="Give law: 'linear' pulls until the gap opens, 'unilateral' and 'limited' never pull.",
    restitution="A soft stop has none: damping dissipates. For a coefficient take RigidStop.",
    preload="A preloaded spring is one with upper < 0.",
)
@dataclass(frozen=True, slots=True)
class SoftStop(Element):
    """A spring and a dashpot behind a gap, on one or both sides of row . x.

    Where u = row . x is beyond ``upper`` by s = u - upper, it presses with the force f >= 0 that its
    law gives, and -f acts along ``row``; below ``lower`` likewise. A one-sided stop with
    ``upper < 0`` is preloaded at rest; with ``lower = upper`` it is a bilinear spring.

    Parameters
    ----------
    row
        Contact coordinate u = row . x, shape (n,), not all zero.
    lower, upper
        Where the stops begin, at least one finite, lower <= upper.
    stiffness, damping
        k > 0 and c >= 0: one number, or (at lower, at upper).
    law
        The force f on a mass that is beyond the stop by s, at the speed s'. ``"unilateral"``: k s + c s'
        where that presses, else 0: no adhesion. ``"linear"``: k s + c s', which may pull before the
        gap opens. ``"limited"``: k s + d, where the damping force d is c s' cut off at +-k s, the
        spring force: f is continuous where the stop is met, and never pulls.
    motion
        Displacement of both stops from their places over time: a :class:`Harmonic` with one
        amplitude, or several, which add up. Stops that move differently are two.
    """

    kind: ClassVar[str] = "soft_stop"
    State = SoftStopState
    looks: ClassVar[Mapping[int, Look]] = {
        SoftStopState.UPPER: Look("pressed at A", "blue"),
        SoftStopState.LOWER: Look("pressed at B", "vermilion"),
        SoftStopState.BEHIND_UPPER: Look("within A, free", "blue", 0.6),
        SoftStopState.BEHIND_LOWER: Look("within B, free", "vermilion", 0.6),
        SoftStopState.LIMITED_UPPER: Look("pressed at A, limited", "blue", -0.4),
        SoftStopState.LIMITED_LOWER: Look("pressed at B, limited", "vermilion", -0.4),
    }
    is_stop = True
    free = frozenset({SoftStopState.BEHIND_UPPER, SoftStopState.BEHIND_LOWER})

    row: tuple[float, ...]
    lower: AnyFloat = -math.inf
    upper: AnyFloat = math.inf
    stiffness: float | tuple[float, float] = 1.0
    damping: float | tuple[float, float] = 0.0
    law: StopLaw = "unilateral"
    motion: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", nonzero_row(self.row, "a soft stop"))
        set_limits(self)
        if self.lower > self.upper or (is_infinite(self.lower) and is_infinite(self.upper)):
            raise InvalidParameterError(
                f"lower = {self.lower}, upper = {self.upper}: need lower <= upper, one finite. "
                "Where both stops press at once, take two one-sided ones."
            )
        for name, check in (("stiffness", positive), ("damping", nonnegative)):
            value = getattr(self, name)
            if callable(value):
                raise refusal(name, value, "a number", LINEAR)
            object.__setattr__(self, name, pair_of(name, value, check))
        check_choice("law", self.law, list(get_args(StopLaw)))
        object.__setattr__(self, "motion", as_lines("motion", self.motion))

    @property
    def damping_law(self) -> str:
        """The law of its dashpot."""
        return self.law

    def spring_at(self, side: int) -> Spring:
        """Spring and dashpot at the stop of a side."""
        i = 1 if side > 0 else 0
        pairs = self.stiffness, self.damping
        k, c = (pair[i] if isinstance(pair, tuple) else pair for pair in pairs)
        return Spring(self.upper if side > 0 else self.lower, k, c)

    @property
    def mirrored(self) -> tuple[tuple[Any, Any], ...]:
        """Stiffness and damping."""
        springs = self.spring_at(-1), self.spring_at(1)
        return tuple(zip(*(spring[1:] for spring in springs), strict=True))

    @property
    def states(self) -> tuple[SoftStopState, ...]:
        """The states that it can have: those behind a stop need a dashpot that holds it back."""
        found = [SoftStopState.OPEN]
        for side in (1, -1):
            limit, _, damping = self.spring_at(side)
            if is_infinite(limit):
                continue
            pressed, behind, limited = (s for s in SoftStopState if self.side_of(s) == side)
            found.append(pressed)
            if damping != 0.0 and self.law != "linear":
                found.append(behind)
            if damping != 0.0 and self.law == "limited":
                found.append(limited)
        return tuple(found)

    @property
    def stiffest(self) -> list[tuple[float, float]]:
        """Stiffness and damping; a limited dashpot counts as the spring once more."""
        limited = self.law == "limited"
        return [(2.0 * k if limited and c else k, c) for k, c in super(SoftStop, self).stiffest]

    def caption(self, *sides: int) -> str:
        """Caption: stiffness and damping, and the law where it is not the usual one."""
        springs = [self.spring_at(side) for side in sides]
        text = symbols_of(k=[spring.stiffness for spring in springs])
        if not any(spring.damping for spring in springs):
            return text
        law = "" if self.law == "unilateral" else f", {self.law}"
        return f"{text}, {symbols_of(c=[spring.damping for spring in springs])}{law}"
