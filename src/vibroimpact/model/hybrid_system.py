"""Piecewise-linear hybrid systems as data: modes, guards, transitions (theory.md, "Elements").

The layer below :class:`~vibroimpact.Mechanism`, for what is no mechanism: a converter, a relay loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.checks import (
    check_choice,
    check_kind,
    names_arguments,
    numbers,
    positive,
    real,
    refusal,
    shown,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact._kernel import MAX_DEGREES, MAX_LINES
from vibroimpact.model.described import Described
from vibroimpact.model.elements.mode_switch import MOST_MODES, ModeSwitch, Way
from vibroimpact.model.mechanism import Mechanism

Direction = Literal["rising", "falling"]
MOST_STATES = 2 * MAX_DEGREES
MOST_GUARDS = 24  # a mode has so many guards at most


@names_arguments()
@dataclass(frozen=True, slots=True, eq=False)
class LinearMode:
    """A mode: y' = matrix y + constant + waves w, with w = (sin theta_1, cos theta_1, ...).

    Parameters
    ----------
    matrix
        Shape (n, n).
    constant
        Shape (n,); zero where left out.
    waves
        Shape (n, 2 L) for L forcing lines; zero where left out.
    """

    matrix: Floats
    constant: Floats | None = None
    waves: Floats | None = None


@names_arguments()
@dataclass(frozen=True, slots=True, eq=False)
class LinearGuard:
    """A guard: the value row . y + waves . w, which is compared with a level.

    Parameters
    ----------
    row
        Shape (n,).
    level
        Value at which transitions happen.
    waves
        Shape (2 L,); zero where left out.
    """

    row: Floats
    level: float = 0.0
    waves: Floats | None = None


@names_arguments()
@dataclass(frozen=True, slots=True, eq=False)
class Transition:
    """Change of mode where a guard reaches its level: y becomes matrix y + shift.

    Parameters
    ----------
    mode, guard
        Names of the mode that is left and of the guard.
    direction
        ``"rising"``: the value comes from below the level; ``"falling"``: from above.
    to
        Name of the mode that follows; it may be the same.
    matrix, shift
        Reset, shapes (n, n) and (n,); the unit matrix and zero where left out.
    """

    mode: str
    guard: str
    direction: Direction
    to: str
    matrix: Floats | None = None
    shift: Floats | None = None


@names_arguments(
    resets="A transition has matrix and shift.", forces="A mode has constant and waves.",
)  # fmt: skip
@dataclass(frozen=True, eq=False)
class HybridSystem(Described):
    """A piecewise-linear hybrid system: linear modes, and transitions where guards reach levels.

    With up to seven modes it is a system like any other: its states are the positions x of a
    :class:`State`, their rates the velocities, and a motion begins in the first mode. Runs, sections, sweeps,
    exponents, orbits, branches and curves take it. Its numbers are parameters by path,
    ``"modes.on.matrix[0][0]"``, ``"guards.upper.level"``, ``"transitions[0].shift[1]"``; a dataclass or a
    :class:`Family` may have it as ``mechanism``, or return it.

    Parameters
    ----------
    modes
        :class:`LinearMode` by name; states y of shape (n,), n <= 40.
    guards
        :class:`LinearGuard` by name.
    transitions
        :class:`Transition` of every mode, at most 24 each. While a mode lasts, a guard with a
        rising transition is at or below its level, one with a falling transition at or above;
        one that lies beyond it where the mode begins is crossed at once. Where several of a mode
        are due at one instant, the one given first happens. Two that would undo each other at
        once, without resets, make the motion slide on their guard (:class:`~vibroimpact.HybridRun`).
    omegas
        Angular frequencies of the forcing lines, at most 12. Phases run in proportion to these.

    Raises
    ------
    InvalidParameterError
        Shapes that do not fit, names that do not exist, numbers that are not finite.

    Examples
    --------
    A relay that holds a first-order plant between 1 and 2:

    >>> import vibroimpact as vi
    >>> relay = vi.HybridSystem(
    ...     modes={"on": vi.LinearMode([[-1.0]], [3.0]), "off": vi.LinearMode([[-1.0]])},
    ...     guards={"upper": vi.LinearGuard([1.0], 2.0), "lower": vi.LinearGuard([1.0], 1.0)},
    ...     transitions=(vi.Transition("on", "upper", "rising", "off"),
    ...                  vi.Transition("off", "lower", "falling", "on")))
    >>> vi.simulate_hybrid(relay, "on", [1.0], t_max=4.0).modes
    ('on', 'off', 'on', 'off', 'on', 'off', 'off')
    """

    modes: Mapping[str, LinearMode]
    guards: Mapping[str, LinearGuard]
    transitions: tuple[Transition, ...] = ()
    omegas: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_kind("modes", self.modes, Mapping, "LinearMode by name, {'on': LinearMode(...)}")
        check_kind("guards", self.guards, Mapping, "LinearGuard by name")
        if not self.modes:
            raise refusal("modes", self.modes, "one LinearMode at least, by name")
        lines = np.atleast_1d(numbers("omegas", self.omegas, "angular frequencies"))
        if lines.ndim != 1 or lines.size > MAX_LINES:
            raise refusal("omegas", self.omegas, f"at most {MAX_LINES} angular frequencies")
        omegas = tuple(positive("omegas", w) for w in lines.tolist())
        object.__setattr__(self, "omegas", omegas)
        n, waves = self._states(), 2 * len(omegas)
        modes = {
            name: LinearMode(
                _array(
                    f"modes[{name!r}].matrix", check_kind_of(name, mode, LinearMode).matrix, (n, n)
                ),
                _array(f"modes[{name!r}].constant", mode.constant, (n,)),
                _array(f"modes[{name!r}].waves", mode.waves, (n, waves)),
            )
            for name, mode in self.modes.items()
        }
        guards = {
            name: LinearGuard(
                _array(f"guards[{name!r}].row", check_kind_of(name, guard, LinearGuard).row, (n,)),
                real(f"guards[{name!r}].level", guard.level),
                _array(f"guards[{name!r}].waves", guard.waves, (waves,)),
            )
            for name, guard in self.guards.items()
        }
        object.__setattr__(self, "modes", modes)
        object.__setattr__(self, "guards", guards)
        object.__setattr__(
            self, "transitions", tuple(self._transition(t, n) for t in self._given())
        )
        self._check_once()
        for name in modes:
            count = sum(t.mode == name for t in self.transitions)
            if count > MOST_GUARDS:
                raise InvalidParameterError(
                    f"transitions: {count} leave mode {name!r}; must be at most {MOST_GUARDS}."
                )

    def _check_once(self) -> None:
        """Refuse a transition that never happens, as another one has the same guard and way."""
        known = set[tuple[str, str, str]]()
        for k, t in enumerate(self.transitions):
            if (t.mode, t.guard, t.direction) in known:
                raise InvalidParameterError(
                    f"transitions[{k}]: mode {t.mode!r} is left before where {t.guard!r} is "
                    f"{t.direction}, by another transition. Remove one of them."
                )
            known.add((t.mode, t.guard, t.direction))

    def _states(self) -> int:
        first = next(iter(self.modes.values()))
        check_kind("modes", first, LinearMode, "LinearMode by name")
        matrix = numbers("matrix", first.matrix, "a square matrix of numbers")
        if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
            raise InvalidParameterError(f"matrix has shape {matrix.shape}; expected (n, n).")
        if not 1 <= len(matrix) <= MOST_STATES:
            raise InvalidParameterError(
                f"matrix has {len(matrix)} rows: there must be 1 to {MOST_STATES} states."
            )
        return len(matrix)

    def _given(self) -> tuple[Transition, ...]:
        if not isinstance(self.transitions, tuple | list):
            raise refusal("transitions", self.transitions, "several Transition in a tuple or list")
        return tuple(self.transitions)

    def _transition(self, t: Transition, n: int) -> Transition:
        check_kind("transitions", t, Transition, "several Transition")
        for name, value in (("mode", t.mode), ("to", t.to)):
            check_choice(name, value, list(self.modes))
        check_choice("guard", t.guard, list(self.guards))
        check_choice("direction", t.direction, ["rising", "falling"])
        matrix = np.eye(n) if t.matrix is None else _array("matrix", t.matrix, (n, n))
        return Transition(
            t.mode, t.guard, t.direction, t.to, matrix, _array("shift", t.shift, (n,))
        )

    @property
    def states(self) -> int:
        """Number of states n."""
        return len(next(iter(self.modes.values())).matrix)

    def beginning_in(self, mode: str) -> HybridSystem:
        """Return the same system with another mode as its first, in which motions begin."""
        check_choice("mode", mode, list(self.modes))
        others = {name: x for name, x in self.modes.items() if name != mode}
        return replace(self, modes={mode: self.modes[mode], **others})

    @cached_property
    def mechanism(self) -> Mechanism:
        """The system as a mechanism: states without mass, on dashpots of 1, and a switch between its modes.

        Raises
        ------
        InvalidParameterError
            More than seven modes, or than 20 states, which :func:`simulate_hybrid` alone takes.
        """
        n, names = self.states, [*self.modes]
        if len(names) > MOST_MODES or n > MAX_DEGREES:
            raise InvalidParameterError(
                f"system: a HybridSystem with {len(names)} modes and {n} states. Systems have at most {MOST_MODES} "
                f"modes and {MAX_DEGREES} states; simulate_hybrid takes it."
            )
        nothing = [[0.0] * n for _ in range(n)]
        unit = [[float(i == j) for j in range(n)] for i in range(n)]
        switch = ModeSwitch(
            names=tuple(names),
            matrices=tuple(_rows(mode.matrix) for mode in self.modes.values()),
            constants=tuple(_rows(mode.constant) for mode in self.modes.values()),
            waves=tuple(_rows(mode.waves) for mode in self.modes.values()),
            ways=tuple(self._way(t, names) for t in self.transitions),
            omegas=self.omegas,
        )
        return Mechanism(mass=nothing, damping=unit, stiffness=nothing, elements=(switch,))

    def _way(self, t: Transition, names: list[str]) -> Way:
        guard, reset = self.guards[t.guard], ((), ())
        if not is_identity(t.matrix, t.shift):
            reset = _rows(t.matrix), _rows(t.shift)
        return Way(
            names.index(t.mode), names.index(t.to), _rows(guard.row), _rows(guard.waves), guard.level,
            t.direction == "rising", *reset,
        )  # fmt: skip

    def __repr__(self) -> str:
        return (
            f"HybridSystem: {self.states} states, modes {', '.join(self.modes)}; "
            f"{len(self.guards)} guards, {len(self.transitions)} transitions"
        )


def check_kind_of(name: str, value: Any, kind: type) -> Any:
    """Return an object of a class, or raise naming it."""
    check_kind(name, value, kind, f"a {kind.__name__}")
    return value


def is_identity(matrix: Any, shift: Any) -> bool:
    """Whether a reset leaves states as they are."""
    if matrix.dtype != float or shift.dtype != float:
        return False
    return bool(np.array_equal(matrix, np.eye(len(matrix))) and not np.any(shift))


def _rows(array: Any) -> Any:
    """An array as tuples of its rows."""
    return tuple(map(_rows, array)) if array.ndim > 1 else tuple(array.tolist())


def _array(name: str, value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return an array of a shape, zeros for None, read-only, or raise naming it."""
    array = np.zeros(shape) if value is None else numbers(name, value)
    if array.shape != shape:
        raise InvalidParameterError(f"{name} = {shown(value)}: must be of shape {shape}.")
    array.flags.writeable = False
    return array
