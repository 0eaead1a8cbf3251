"""Elements with states of their own: soft stops, friction, phase switches (theory.md, "Elements").

An element has a few states. Each adds to the equations of motion, and lasts while its guards hold;
:mod:`vibroimpact.compile.piecewise` writes both as rows on the coordinates of the kernel.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Literal, get_args

from vibroimpact._core.checks import (
    check_choice,
    check_kind,
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
from vibroimpact.model.harmonic import Harmonic, as_lines, empty

StopLaw = Literal["linear", "unilateral", "limited"]
HALF_TURN = 2.0**-50  # relative: arcs that are pi long
MOST_ARCS = 5
MOVES = "A stop that moves has motion: a Harmonic with one amplitude, or several."
LINEAR = "A stop that stiffens is a sum of soft stops with other gaps."
CONSTANT = (
    "A level that varies with time or speed is not supported; two levels are: kinetic, static."
)
BELT = "A belt whose speed varies has motion: a Harmonic of its displacement, or several."
NUMBER_OR_NONE = "a finite number, or left out where there is no stop"


class RigidStopState(IntEnum):
    """States of a rigid stop."""

    OPEN = 0
    UPPER = 1  #: at rest at the upper stop
    LOWER = 2  #: at rest at the lower stop


class SoftStopState(IntEnum):
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

    @property
    def side(self) -> int:
        """+1 within the upper stop, -1 within the lower one, 0 between them."""
        return 0 if self is SoftStopState.OPEN else 1 if self % 2 else -1

    @property
    def presses(self) -> bool:
        """Whether the stop has a force."""
        without = SoftStopState.OPEN, SoftStopState.BEHIND_UPPER, SoftStopState.BEHIND_LOWER
        return self not in without

    def met_from(self, before: SoftStopState) -> bool:
        """Whether the stop is met where this state follows another one: an impact."""
        return self.presses and before.side != self.side


class FrictionState(IntEnum):
    """States of a friction joint."""

    FORWARD = 0  #: slips with positive slip speed
    BACKWARD = 1
    STICK = 2
    LIFTED = 3  #: without normal load


class PhaseSwitchState(IntEnum):
    """States of a phase switch: its arcs of phase; one longer than a half turn counts as two."""

    ARC_0 = 0
    ARC_1 = 1
    ARC_2 = 2
    ARC_3 = 3
    ARC_4 = 4


def pair_of(name: str, value: Any, check: Any) -> tuple[float, float]:
    """Return a number for both sides, or one for each (lower, upper), as a pair."""
    both = value if isinstance(value, tuple | list) else (value, value)
    if len(both) != 2:
        raise refusal(name, value, "one number, or (lower, upper)")
    return check(name, both[0]), check(name, both[1])


@names_arguments(
    gap="Give upper, lower or both; a negative upper is a preload.",
    release="Give law: 'linear' pulls until the gap opens, 'unilateral' and 'limited' never pull.",
    restitution="A soft stop has none: damping dissipates. For a coefficient take RigidStop.",
    preload="A preloaded spring is one with upper < 0.",
)
@dataclass(frozen=True, slots=True)
class SoftStop:
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

    row: tuple[float, ...]
    lower: float = -math.inf
    upper: float = math.inf
    stiffness: float | tuple[float, float] = 1.0
    damping: float | tuple[float, float] = 0.0
    law: StopLaw = "unilateral"
    motion: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", nonzero_row(self.row, "a soft stop"))
        for name in ("lower", "upper"):
            value = real_or_infinite(name, getattr(self, name), NUMBER_OR_NONE, MOVES)
            object.__setattr__(self, name, value)
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

    def at_side(self, side: int) -> tuple[float, float, float]:
        """Where the stop of a side begins, its stiffness and its damping."""
        i = 1 if side > 0 else 0
        pairs = self.stiffness, self.damping
        k, c = (pair[i] if isinstance(pair, tuple) else pair for pair in pairs)
        return (self.upper if side > 0 else self.lower), k, c

    @property
    def lines(self) -> tuple[Harmonic, ...]:
        """All lines whose phases it needs."""
        return self.motion

    def check_size(self, n: int, name: str) -> None:
        """Refuse a row that does not have n entries; the element has this name."""
        vector(f"{name}.row", self.row, n)

    @property
    def states(self) -> tuple[SoftStopState, ...]:
        """The states that it can have; behind a stop only where a dashpot holds that back."""
        found = [SoftStopState.OPEN]
        for side in (1, -1):
            limit, _, damping = self.at_side(side)
            if is_infinite(limit):
                continue
            pressed, behind, limited = (s for s in SoftStopState if s.side == side)
            found.append(pressed)
            if damping != 0.0 and self.law != "linear":
                found.append(behind)
            if damping != 0.0 and self.law == "limited":
                found.append(limited)
        return tuple(found)


@names_arguments(force="Give constant, position, velocity, motion.")
@dataclass(frozen=True, slots=True)
class NormalLoad:
    """A normal load that depends on the motion: constant + position . x + velocity . v + motion(t).

    Where it is negative the surfaces have lifted off and there is no friction.

    Parameters
    ----------
    constant
        Its constant part.
    position, velocity
        What coordinates and velocities add, shape (n,) each; nothing where left out.
    motion
        Harmonic parts: a :class:`Harmonic` with one amplitude, or several.
    """

    constant: float = 0.0
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    motion: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "constant", real("constant", self.constant))
        for name in ("position", "velocity"):
            given = getattr(self, name)
            object.__setattr__(self, name, () if empty(given) else vector(name, given))
        object.__setattr__(self, "motion", as_lines("motion", self.motion))


@names_arguments(
    mu="Give kinetic, the friction force: coefficient times normal load.",
    normal="Give kinetic, the friction force: coefficient times normal load.",
    coefficient="Give kinetic, the friction force: coefficient times normal load.",
    velocity="Give belt_speed.",
    belt_motion="Give motion, the displacement of the belt: amplitudes of its speed over omega.",
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
        On a coordinate without mass it is a slider: plastic soil, an elastoplastic spring.
    kinetic
        Friction force while it slips, >= 0; with ``load`` the coefficient of friction.
    static
        Largest friction force, or coefficient, while it sticks, >= kinetic; equal to it where left
        out.
    belt_speed
        Constant part of the speed of the belt.
    motion
        Displacement of the belt over time, as that of a stop: a :class:`Harmonic` with one
        amplitude, or several, which add up. Its derivative adds to ``belt_speed``; a speed s cos(omega t) has
        ``Harmonic(omega, (s / omega,))``.
    load
        A :class:`NormalLoad` that depends on the motion.
    """

    row: tuple[float, ...]
    kinetic: float
    static: float | None = None
    belt_speed: float = 0.0
    motion: tuple[Harmonic, ...] = ()
    load: NormalLoad | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", nonzero_row(self.row, "friction"))
        for name in ("kinetic", "static"):
            if callable(value := getattr(self, name)):
                raise refusal(name, value, "a number", CONSTANT)
        if callable(self.belt_speed):
            raise refusal("belt_speed", self.belt_speed, "a number", BELT)
        object.__setattr__(self, "kinetic", nonnegative("kinetic", self.kinetic))
        static = self.kinetic if self.static is None else nonnegative("static", self.static)
        if static < self.kinetic:
            raise refusal(
                "static", self.static, f">= kinetic = {self.kinetic}",
                "Friction that grows with sliding has static = kinetic.",
            )  # fmt: skip
        object.__setattr__(self, "static", static)
        object.__setattr__(self, "belt_speed", real("belt_speed", self.belt_speed))
        object.__setattr__(self, "motion", as_lines("motion", self.motion))
        if self.load is not None:
            check_kind("load", self.load, NormalLoad, "a NormalLoad, or left out")

    @property
    def states(self) -> tuple[FrictionState, ...]:
        """The states that it can have."""
        found = tuple(FrictionState)
        return found if self.load else found[:3]

    @property
    def lines(self) -> tuple[Harmonic, ...]:
        """All lines whose phases it needs: of the belt and of the load."""
        return (*self.motion, *(self.load.motion if self.load else ()))

    def check_size(self, n: int, name: str) -> None:
        """Refuse rows that do not have n entries; the element has this name."""
        vector(f"{name}.row", self.row, n)
        for part in ("position", "velocity"):
            if self.load and getattr(self.load, part):
                vector(f"{name}.load.{part}", getattr(self.load, part), n)


@names_arguments(
    period="Give omega, the angular frequency of the line whose phase switches.",
    force="Give forces, one vector for each arc.",
)
@dataclass(frozen=True, slots=True)
class PhaseSwitch:
    """Forces and impulses that change at given phases of a forcing line: square waves, kicks.

    From phase ``phases[k]`` on, to the next one, the constant force ``forces[k]`` acts; at
    ``phases[k]`` itself the impulse ``impulses[k]``.

    Parameters
    ----------
    omega
        Angular frequency of the line.
    phases
        Rising, in [0, 2 pi), 1 to 5 of them. An arc longer than pi counts as two.
    forces
        One vector of shape (n,) for each arc.
    impulses
        Likewise, for the beginning of each arc; none where left out.
    """

    omega: float
    phases: tuple[float, ...]
    forces: tuple[tuple[float, ...], ...]
    impulses: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "omega", positive("omega", self.omega))
        phases = vector("phases", self.phases)
        rising = all(a < b for a, b in itertools.pairwise(phases))
        if not phases or not rising or phases[0] < 0.0 or phases[-1] >= 2.0 * math.pi:
            raise refusal("phases", self.phases, "rising, in [0, 2 pi), one at least")
        object.__setattr__(self, "phases", phases)
        for name in ("forces", "impulses"):
            given = getattr(self, name)
            if not isinstance(given, tuple | list):
                raise refusal(name, given, "a tuple of vectors, one for each phase")
            rows = tuple(vector(name, row) for row in given)
            if len(rows) != len(phases) and (rows or name == "forces"):
                raise InvalidParameterError(
                    f"{name}: {len(rows)} are given; must be one for each of {len(phases)} phases."
                )
            object.__setattr__(self, name, rows)
        if len(self.arcs) > MOST_ARCS:
            raise InvalidParameterError(
                f"phases: {len(self.arcs)} arcs up to pi long; must be at most {MOST_ARCS}."
            )

    @property
    def arcs(self) -> tuple[tuple[float, float, int], ...]:
        """Begin, end and number of every arc; one longer than pi comes in two pieces."""
        out = []
        ends = (*self.phases[1:], self.phases[0] + 2.0 * math.pi)
        for k, (begin, end) in enumerate(zip(self.phases, ends, strict=True)):
            pieces = max(1, math.ceil((end - begin) / math.pi - HALF_TURN))
            cuts = [begin + (end - begin) * i / pieces for i in range(pieces)]
            out += [(a, b, k) for a, b in zip(cuts, [*cuts[1:], end], strict=True)]
        return tuple(out)

    def is_half_turn(self, state: int) -> bool:
        """Whether the arc of a state is pi long: it ends where the sine of its begin vanishes, too."""
        begin, end, _ = self.arcs[state]
        return abs((end - begin) / math.pi - 1.0) <= HALF_TURN

    @property
    def states(self) -> tuple[PhaseSwitchState, ...]:
        """The states that it can have: pieces of its arcs."""
        return tuple(PhaseSwitchState(i) for i in range(len(self.arcs)))

    @property
    def lines(self) -> tuple[Harmonic, ...]:
        """The line whose phase switches, without amplitude."""
        return (Harmonic(self.omega, (0.0,)),)

    def check_size(self, n: int, name: str) -> None:
        """Refuse vectors that do not have n entries; the element has this name."""
        for part in ("forces", "impulses"):
            for row in getattr(self, part):
                vector(f"{name}.{part}", row, n)


Element = SoftStop | Friction | PhaseSwitch


def nonzero_row(value: Any, what: str) -> tuple[float, ...]:
    """Return the row of an element, or raise where it is zero."""
    row = vector("row", value)
    if not any(row):
        raise InvalidParameterError(
            f"row = 0: {what} must involve a coordinate. Between two of them the row has 1 and -1; "
            "between a coordinate and itself nothing acts."
        )
    return row
