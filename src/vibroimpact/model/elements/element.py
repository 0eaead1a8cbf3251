"""Base class of elements: states, where they act, names, looks, and the form in which they are stored."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple, Self, cast

from vibroimpact._core.checks import real_or_infinite, refusal, vector
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact.model.harmonic import Harmonic

MOVES = "A stop that moves has motion: a Harmonic with one amplitude, or several."
NUMBER_OR_NONE = "a finite number, or left out where there is no stop"


class Look(NamedTuple):
    """Look of a state: its name, and a colour with a share of white, or of black if negative."""

    words: str
    colour: str
    white: float = 0.0


class Spring(NamedTuple):
    """Spring and dashpot of a stop: where it begins, its stiffness, infinite where it is rigid, and its damping."""

    limit: float
    stiffness: float
    damping: float


class Grip(NamedTuple):
    """Friction of an element: its levels, the constant parts of its load and of the speed of what it rubs on."""

    kinetic: float = 0.0
    static: float = 0.0
    load: float = 1.0
    speed: float = 0.0


class Element(ABC):
    """Part of a machine that acts along ``row`` and changes its law with its state.

    An element is a frozen dataclass. Its ``row`` gives the coordinate u = row . x along which it acts, and is empty
    where it acts along none; ``motion`` is the displacement of its stops, or of what it rubs on, over time.
    """

    __slots__ = ()

    kind: ClassVar[str]  #: its name in files; labels have blanks
    State: ClassVar[type[IntEnum]]  #: its states, at most seven; a stop is open in 0
    looks: ClassVar[Mapping[int, Look]]  #: of the states that are shown
    #: fields that are records, for files
    records: ClassVar[Mapping[str, type]] = {"motion": Harmonic}
    rigid: ClassVar[bool] = False  #: whether it is met with an impact
    is_stop: ClassVar[bool] = False  #: whether it has a place, and is met there
    free: ClassVar[frozenset[int]] = frozenset()  #: the states within a stop that are without force
    by_time: ClassVar[bool] = False  #: whether time alone changes its state
    whole: ClassVar[bool] = (
        False  #: whether it is all of a machine: its states say which one follows
    )
    holding: ClassVar[IntEnum | None] = None  #: the state in which it prescribes row . v
    slipping: ClassVar[frozenset[IntEnum]] = frozenset()  #: the states in which it rubs

    row: tuple[float, ...]
    motion: tuple[Harmonic, ...]

    @property
    def states(self) -> tuple[IntEnum, ...]:
        """The states that it can have."""
        return tuple(self.State)

    @property
    def lines(self) -> tuple[Harmonic, ...]:
        """Forcing lines whose phases it needs."""
        return self.motion

    def check_size(self, n: int, name: str) -> None:
        """Refuse rows that do not have n entries; the element has this name."""
        vector(f"{name}.row", self.row, n)

    def check_massless(self, light: Sequence[int], name: str) -> None:
        """Refuse coordinates without mass that it cannot act on; the element has this name."""

    def changed(self, name: str, value: Any) -> Self:
        """Copy with another value of a field."""
        return cast(Self, replace(cast(Any, self), **{name: value}))

    def widened(self) -> Self:
        """Copy on one coordinate more, on which it does not act."""
        return self.changed("row", (*self.row, 0.0))

    # ---- stops -----------------------------------------------------------------------------------

    def side_of(self, state: int) -> int:
        """+1 within its upper stop, -1 within the lower one, 0 else, by the numbers that the kernel knows."""
        return 0 if not self.is_stop or not state else 1 if state % 2 else -1

    def spring_at(self, side: int) -> Spring | None:
        """Spring that presses beyond the stop of a side; None where there is none."""
        return None

    @property
    def damping_law(self) -> str:
        """How the dashpot of a stop acts: "linear", "unilateral", "limited"; "" where it has none."""
        return ""

    def limit_at(self, side: int) -> float:
        """Limit at which the stop of a side begins; infinite where there is none."""
        spring = self.spring_at(side)
        return side * math.inf if spring is None else spring.limit

    def pressed(self, state: int) -> Spring | None:
        """Spring that presses in a state; None where nothing does."""
        side = self.side_of(state)
        return self.spring_at(side) if side and state not in self.free else None

    def is_met(self, before: int, after: int) -> bool:
        """Whether a stop is met where a state follows another one: an impact."""
        return self.pressed(after) is not None and self.side_of(before) != self.side_of(after)

    @property
    def stiffest(self) -> list[tuple[float, float]]:
        """Stiffness and damping along its row at each of its stops, the largest of all states."""
        springs = [self.spring_at(side) for side in (1, -1)]
        return [(s.stiffness, s.damping) for s in springs if s and not is_infinite(s.limit)]

    @property
    def conserves(self) -> bool:
        """Whether it leaves the energy of every motion as it is."""
        return self.is_stop and all(c == 0.0 for _, c in self.stiffest)

    # ---- forces ----------------------------------------------------------------------------------

    @property
    def positions(self) -> list[tuple[float, ...]]:
        """Rows through which positions act on it."""
        return [self.row] if self.is_stop else []

    @property
    def own_forces(self) -> tuple[tuple[float, ...], ...]:
        """Forces on the coordinates that it has without being displaced, shape (n,) each."""
        return ()

    @property
    def own_impulses(self) -> tuple[tuple[float, ...], ...]:
        """Impulses that it gives at changes of its state, shape (n,) each, by their number."""
        return ()

    @property
    def flows(self) -> Sequence[Any]:
        """Matrices of its states, shape (n, n) each, where it is all of a machine."""
        return ()

    @property
    def resets(self) -> Sequence[Any]:
        """Jumps x <- matrix x + shift of the coordinates at changes of its state, by their number."""
        return ()

    @property
    def grip(self) -> Grip:
        """Friction of the element; zeros where it has none."""
        return Grip()

    @property
    def mirrored(self) -> tuple[tuple[Any, Any], ...] | None:
        """Numbers at its lower and its upper side, which a mirror exchanges; limits and motions aside.

        None of an element of which no symmetry is known.
        """
        return None

    def multiple_of(self, other: Element) -> float | None:
        """The factor between its row and that of another one which it holds together with; None if there is none."""
        return None

    # ---- drawings --------------------------------------------------------------------------------

    @abstractmethod
    def caption(self, *sides: int) -> str:
        """Caption beside its symbol: the numbers of its law, at the stops on these sides."""


def numbered_looks(states: type[IntEnum], word: str, step: float) -> dict[int, Look]:
    """Looks of states by their number, but of state 0: ever lighter."""
    return {
        state: Look(f"{word} {state.value}", "black", step * state) for state in states if state
    }


def nonzero_row(value: Any, what: str) -> tuple[float, ...]:
    """Return the row of an element, or raise where it is zero."""
    row = vector("row", value)
    if not any(row):
        raise InvalidParameterError(
            f"row = 0: {what} must involve a coordinate. Between two of them the row has 1 and -1; "
            "between a coordinate and itself nothing acts."
        )
    return row


def set_limits(stop: Any) -> None:
    """Take ``lower`` and ``upper`` of a stop as numbers, infinite where there is no stop, or raise naming them."""
    for name in ("lower", "upper"):
        value = real_or_infinite(name, getattr(stop, name), NUMBER_OR_NONE, MOVES)
        object.__setattr__(stop, name, value)


def pair_of(name: str, value: Any, check: Any) -> tuple[float, float]:
    """Return a number for both sides, or one for each (lower, upper), as a pair."""
    both = value if isinstance(value, tuple | list) else (value, value)
    if len(both) != 2:
        raise refusal(name, value, "one number, or (lower, upper)")
    return check(name, both[0]), check(name, both[1])


def symbols_of(**values: Sequence[float]) -> str:
    """Values of symbols as formulas, each value once, as in k=1, c=0.1."""
    comma = r",\ "
    return ", ".join(
        f"${name}={comma.join(f'{x:g}' for x in dict.fromkeys(found))}$"
        for name, found in values.items()
    )
