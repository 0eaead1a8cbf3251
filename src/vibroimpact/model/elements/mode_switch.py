"""Mode switches: the modes, guards and transitions of a hybrid system as an element."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NoReturn

from vibroimpact._core.checks import check_count, positive, real, refusal, vector
from vibroimpact._core.codes import NamedCode
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.elements.element import Element, Look, numbered_looks
from vibroimpact.model.harmonic import Harmonic

Rows = tuple[tuple[float, ...], ...]


class ModeSwitchState(NamedCode):
    """States of a mode switch: the modes of its hybrid system, in their order."""

    MODE_0 = 0
    MODE_1 = 1
    MODE_2 = 2
    MODE_3 = 3
    MODE_4 = 4
    MODE_5 = 5
    MODE_6 = 6


MOST_MODES = len(ModeSwitchState)


@dataclass(frozen=True, slots=True)
class Way:
    """Way from one mode to another: where ``row . x + waves . w`` reaches a level, x becomes matrix x + shift.

    Without reset, ``matrix`` and ``shift`` are empty.
    """

    mode: int
    to: int
    row: tuple[float, ...]
    waves: tuple[float, ...]
    level: float
    rising: bool
    matrix: Rows = ()
    shift: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class ModeSwitch(Element):
    """All of a hybrid system (:class:`~vibroimpact.HybridSystem`), as the element of its mechanism.

    Its coordinates x have no mass and dashpots of 1 to the ground. In its mode the element adds the force
    matrix x + constant + waves w, so that x' is that.

    Parameters
    ----------
    names
        Names of the modes; a motion begins in the first.
    matrices, constants, waves
        Of each mode, shapes (n, n), (n,) and (n, 2 L).
    ways
        :class:`Way` from each mode.
    omegas
        Angular frequencies of the L lines.
    """

    kind: ClassVar[str] = "mode_switch"
    State = ModeSwitchState
    looks: ClassVar[Mapping[int, Look]] = numbered_looks(ModeSwitchState, "mode", 0.14)
    records: ClassVar[Mapping[str, type]] = {"ways": Way}
    whole = True
    row = ()
    motion = ()

    names: tuple[str, ...]
    matrices: tuple[Rows, ...]
    constants: Rows
    waves: tuple[Rows, ...]
    ways: tuple[Way, ...] = ()
    omegas: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "omegas", tuple(positive("omegas", w) for w in self.omegas))
        if not 1 <= len(self.names) <= MOST_MODES:
            raise refusal("modes", self.names, f"1 to {MOST_MODES} modes")
        if len(self.constants) != len(self.names):
            raise refusal("constants", self.constants, f"one for each of {len(self.names)} modes")
        n, count = len(self.constants[0]), 2 * len(self.omegas)
        self._set_modes(n, count)
        ways = tuple(self._way(f"ways[{k}]", way, n, count) for k, way in enumerate(self.ways))
        object.__setattr__(self, "ways", ways)

    def _way(self, name: str, way: Way, n: int, count: int) -> Way:
        """A way with its numbers as tuples, or raise naming those that do not fit."""
        for end in ("mode", "to"):
            check_count(f"{name}.{end}", getattr(way, end), 0, len(self.names) - 1)
        reset = bool(way.matrix or way.shift)
        if reset and len(way.matrix) != n:
            raise refusal(f"{name}.matrix", way.matrix, f"of shape ({n}, {n})")
        return replace(
            way,
            row=vector(f"{name}.row", way.row, n),
            waves=vector(f"{name}.waves", way.waves, count),
            level=real(f"{name}.level", way.level),
            matrix=tuple(vector(f"{name}.matrix", row, n) for row in way.matrix),
            shift=vector(f"{name}.shift", way.shift, n) if reset else (),
        )

    def _set_modes(self, n: int, count: int) -> None:
        """Take the numbers of all modes as tuples, or raise naming those that do not fit."""
        for name, width in (("matrices", n), ("waves", count)):
            given = getattr(self, name)
            made = tuple(
                tuple(vector(f"{name}[{k}]", row, width) for row in rows)
                for k, rows in enumerate(given)
            )
            if len(made) != len(self.names) or any(len(rows) != n for rows in made):
                raise InvalidParameterError(
                    f"{name}: must be one with {n} rows for each of {len(self.names)} modes."
                )
            object.__setattr__(self, name, made)
        constants = tuple(vector("constants", row, n) for row in self.constants)
        object.__setattr__(self, "constants", constants)

    @property
    def states(self) -> tuple[ModeSwitchState, ...]:
        """Its modes."""
        return tuple(ModeSwitchState(i) for i in range(len(self.names)))

    @property
    def lines(self) -> tuple[Harmonic, ...]:
        """The lines of its waves, without amplitude."""
        return tuple(Harmonic(w, (0.0,)) for w in self.omegas)

    def check_size(self, n: int, name: str) -> None:
        """Refuse another number of coordinates; the element has this name."""
        if n != len(self.constants[0]):
            raise InvalidParameterError(
                f"{name}: is of {len(self.constants[0])} states; the mechanism has {n} coordinates."
            )

    def widened(self) -> NoReturn:
        """Refuse a coordinate more: its states are all that the machine has."""
        raise InvalidParameterError(
            "system: of a hybrid system no other number of states can be taken. Add the state to its modes."
        )

    @property
    def positions(self) -> list[tuple[float, ...]]:
        """Every state acts on it."""
        n = len(self.constants[0])
        return [tuple(float(i == j) for j in range(n)) for i in range(n)]

    @property
    def own_forces(self) -> tuple[tuple[float, ...], ...]:
        """Constants of the modes."""
        return self.constants

    @property
    def flows(self) -> tuple[Rows, ...]:
        """Matrices of the modes."""
        return self.matrices

    @property
    def resets(self) -> tuple[Way, ...]:
        """Ways on which the states jump."""
        return tuple(way for way in self.ways if way.shift)

    def ways_from(self, state: int) -> Sequence[Way]:
        """Ways from a mode, in their order."""
        return [way for way in self.ways if way.mode == state]

    def caption(self, *sides: int) -> str:
        """Caption of the element in the picture of a machine."""
        return "modes " + ", ".join(self.names)
