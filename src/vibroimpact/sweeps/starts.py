"""Starts of the members of a sweep: one state, random states, a grid of states, or a list.

Coordinates of a state have names: x1, x2, ... are positions, v1, v2, ... velocities, and phase is
that of the first forcing line. Coordinates that are not varied have the value of the base state.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import (
    LARGEST_SEED,
    check_count,
    check_kind,
    check_memory,
    ends_of,
    names_arguments,
    numbers,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.model.state import State, names_of_state
from vibroimpact.model.system import System
from vibroimpact.sweeps.axes import axis_of, is_coordinate

# Random numbers in [0, 1) are the upper 53 of 64 random bits, so far apart.
RANDOM_SPACING = 2.0**-53


class States(NamedTuple):
    """Array of states: position and velocity (k, n), phase (k,)."""

    position: Floats
    velocity: Floats
    phase: Floats

    def of(self, rows: Any) -> States:
        """Selected states, by rows, flags or a slice."""
        return States(*(part[rows] for part in self))

    def state(self, row: int) -> State:
        """State in one row."""
        position, velocity, phase = (part[row] for part in self)
        return State(tuple(position), tuple(velocity), float(phase))


def varied(base: State, drawn: Mapping[str, Floats], count: int) -> States:
    """``count`` copies of a state with some coordinates replaced."""
    row = np.array([*base.position, *base.velocity, base.phase])
    rows = np.tile(row, (count, 1))
    n = len(base.position)
    places = {name: i for i, name in enumerate(names_of_state(n))}
    for name, values in drawn.items():
        rows[:, places[name]] = values
    parts = rows[:, :n], rows[:, n : 2 * n], rows[:, -1]
    return States(*(np.ascontiguousarray(part) for part in parts))


class Starts(Protocol):
    """Starts of the members of a sweep, the same at every value of the parameters."""

    @property
    def base(self) -> State:
        """State from which the others are varied."""

    @property
    def dims(self) -> dict[str, int]:
        """Dimensions that the starts add to the grid, with their sizes."""

    @property
    def coords(self) -> dict[str, tuple[str, Floats]]:
        """Coordinates along these dimensions: name -> (dimension, values)."""

    def block(self, place: tuple[slice, ...]) -> Starts:
        """Starts of a block of the grid, one slice per dimension."""

    def states(self) -> States:
        """States of all starts, the last dimension fastest."""

    def describe(self) -> dict[str, Any]:
        """Description from which they can be repeated, without the values of the coordinates."""


def starts_of(start: Start, degrees: int) -> Starts:
    """Starts from an argument of the user.

    Raises
    ------
    InvalidParameterError
        Another type; a base state with another number of coordinates.
    """
    if isinstance(start, State):
        start_of: Starts = OneStart(start)
    elif isinstance(start, RandomStarts | GridStarts | ListedStarts):
        start_of = start
    else:
        raise refusal("start", start, "a State, RandomStarts, GridStarts or ListedStarts")
    have = len(start_of.base.position)
    if have != degrees:
        raise InvalidParameterError(
            f"start: its position has shape ({have},); expected ({degrees},)."
        )
    return start_of


@dataclass(frozen=True)
class OneStart:
    """One state at which every member starts."""

    base: State

    @property
    def dims(self) -> dict[str, int]:
        """Empty: one start adds no dimension."""
        return {}

    @property
    def coords(self) -> dict[str, tuple[str, Floats]]:
        """Empty: one start adds no dimension."""
        return {}

    def block(self, place: tuple[slice, ...]) -> OneStart:  # noqa: ARG002 - there are none
        """Starts of a block, which is the one start."""
        return self

    def states(self) -> States:
        """States with the single start."""
        return varied(self.base, {}, 1)

    def describe(self) -> dict[str, Any]:
        """Numbers of the state."""
        return {"kind": "one", "base": asdict(self.base)}


@names_arguments()
@dataclass(frozen=True, eq=False)
class RandomStarts:
    """Random starts, drawn uniformly; the same ones at every value of the parameters.

    Parameters
    ----------
    starts
        Number of starts, >= 1.
    seed
        An integer in [0, 2^64): the same seed gives the same starts on every machine.
    bounds
        (low, high), low < high, by name of a coordinate: x1, x2, ..., v1, v2, ..., phase [rad].
    base
        The state that gives the other coordinates.
    skip
        Starts of the list that are left out before, >= 0: ``skip=1000`` continues ``starts=1000``.

    Raises
    ------
    InvalidParameterError
        An unknown name, an empty range, counts or seeds out of range.

    Notes
    -----
    Start i takes the i-th group of 64-bit outputs of the generator PCG64, one per coordinate in
    the order x1, ..., v1, ..., phase. A start behind a stop is not replaced: the member ends with
    the status INITIAL_PENETRATION.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> starts = vi.RandomStarts(3, 1, {"v1": (-1.0, 1.0)}, vi.State((0.0, 0.0), (0.0, 1.0)))
    >>> starts.states().velocity.shape
    (3, 2)
    """

    starts: int
    seed: int
    bounds: Mapping[str, tuple[float, float]] = field(hash=False)
    base: State
    skip: int = 0

    def __post_init__(self) -> None:
        check_count("starts", self.starts, 1)
        check_count("seed", self.seed, 0, LARGEST_SEED)
        check_count("skip", self.skip, 0)
        ranges = {
            name: ends_of(f"bounds[{name!r}]", self.bounds[name])
            for name in _in_order("bounds", self.bounds, self.base)
        }
        object.__setattr__(self, "bounds", ranges)
        size = 8 * (2 * len(self.base.position) + 1)
        check_memory("starts", self.starts, 2 * size, "Take fewer, then continue with skip=...")

    @property
    def dims(self) -> dict[str, int]:
        """One dimension: start."""
        return {"start": self.starts}

    @property
    def coords(self) -> dict[str, tuple[str, Floats]]:
        """Drawn coordinates, by name."""
        return {name: ("start", values) for name, values in self._drawn().items()}

    def block(self, place: tuple[slice, ...]) -> RandomStarts:
        """Starts of a range of numbers."""
        low, high, _ = place[0].indices(self.starts)
        return RandomStarts(high - low, self.seed, self.bounds, self.base, self.skip + low)

    def states(self) -> States:
        """States of all starts."""
        return varied(self.base, self._drawn(), self.starts)

    def describe(self) -> dict[str, Any]:
        """Seed, numbers, ranges and base."""
        ranges = {name: list(ends) for name, ends in self.bounds.items()}
        return {
            "kind": "random",
            "seed": int(self.seed),
            "skip": int(self.skip),
            "starts": int(self.starts),
            "bounds": ranges,
            "base": asdict(self.base),
        }

    def _drawn(self) -> dict[str, Floats]:
        """Drawn coordinates, each (starts,)."""
        bits = np.random.PCG64(self.seed).advance(self.skip * len(self.bounds))
        raw = bits.random_raw(self.starts * len(self.bounds)).reshape(self.starts, len(self.bounds))
        unit = (raw >> np.uint64(11)).astype(np.float64) * RANDOM_SPACING
        ends = self.bounds.values()
        return {
            name: low + (high - low) * unit[:, i]
            for i, (name, (low, high)) in enumerate(zip(self.bounds, ends, strict=True))
        }


@names_arguments()
@dataclass(frozen=True, eq=False)
class GridStarts:
    """Starts on a grid of some coordinates, for basins of attraction.

    Parameters
    ----------
    over
        Values by name of a coordinate: x1, x2, ..., v1, v2, ..., phase [rad]. Each becomes a
        dimension, in this order.
    base
        The state that gives the other coordinates.

    Raises
    ------
    InvalidParameterError
        An unknown name; no, repeated or non-finite values.

    Notes
    -----
    A start behind a stop is not moved: the member ends with the status INITIAL_PENETRATION.

    Examples
    --------
    >>> import numpy as np
    >>> import vibroimpact as vi
    >>> starts = vi.GridStarts({"x1": np.linspace(-1, 1, 3), "v1": [0.0, 0.5]},
    ...                        vi.State((0.0, 0.0), (0.0, 1.0)))
    >>> starts.dims
    {'x1': 3, 'v1': 2}
    """

    over: Mapping[str, ArrayLike] = field(hash=False)
    base: State

    def __post_init__(self) -> None:
        _in_order("over", self.over, self.base)
        axes = {name: axis_of("over", name, values) for name, values in self.over.items()}
        object.__setattr__(self, "over", {name: tuple(a.tolist()) for name, a in axes.items()})

    def _axes(self) -> dict[str, Floats]:
        return {name: np.array(values, dtype=np.float64) for name, values in self.over.items()}

    @property
    def dims(self) -> dict[str, int]:
        """One dimension per coordinate."""
        return {name: axis.size for name, axis in self._axes().items()}

    @property
    def coords(self) -> dict[str, tuple[str, Floats]]:
        """Axes of the grid, by name."""
        return {name: (name, axis) for name, axis in self._axes().items()}

    def block(self, place: tuple[slice, ...]) -> GridStarts:
        """Starts of a block."""
        axes = zip(self._axes().items(), place, strict=True)
        return GridStarts({name: axis[part] for (name, axis), part in axes}, self.base)

    def states(self) -> States:
        """States of all starts, the last coordinate fastest."""
        axes = self._axes()
        mesh = np.meshgrid(*axes.values(), indexing="ij")
        drawn = {name: part.ravel() for name, part in zip(axes, mesh, strict=True)}
        return varied(self.base, drawn, math.prod(self.dims.values()))

    def describe(self) -> dict[str, Any]:
        """Names and base."""
        return {"kind": "grid", "over": list(self.over), "base": asdict(self.base)}


@dataclass(frozen=True, eq=False)
class ListedStarts:
    """List of starts, such as the final states of the members of another sweep.

    Parameters
    ----------
    position, velocity
        Coordinates and their rates, shape (k, n).
    phase
        Phase of the first forcing line [rad], shape (k,); 0 if not given. With several lines whole
        turns count, as for :class:`~vibroimpact.State`: 2 pi need not be a period of the others.

    Raises
    ------
    InvalidParameterError
        Other shapes, no starts, values that are not finite.

    Notes
    -----
    One dimension, start. A start behind a stop is not moved: the member ends with the status
    INITIAL_PENETRATION.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> starts = vi.ListedStarts([[0.0, 0.0], [0.1, 0.2]], [[0.0, 1.0], [0.0, 0.5]])
    >>> starts.dims
    {'start': 2}
    """

    position: ArrayLike
    velocity: ArrayLike
    phase: ArrayLike | None = None

    def __post_init__(self) -> None:
        position = _finite("position", self.position)
        if position.ndim != 2 or not position.size:
            raise InvalidParameterError(
                f"position has shape {position.shape}; expected (k, n), k starts of n coordinates."
            )
        phase = np.zeros(len(position)) if self.phase is None else self.phase
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "velocity", _finite("velocity", self.velocity, position.shape))
        object.__setattr__(self, "phase", _finite("phase", phase, position.shape[:1]))

    @property
    def base(self) -> State:
        """The first start."""
        return self.states().state(0)

    @property
    def dims(self) -> dict[str, int]:
        """One dimension: start."""
        return {"start": len(self.states().phase)}

    @property
    def coords(self) -> dict[str, tuple[str, Floats]]:
        """All coordinates, by name."""
        position, velocity, phase = self.states()
        names = names_of_state(position.shape[1])
        columns = (*position.T, *velocity.T, phase)
        return {name: ("start", values) for name, values in zip(names, columns, strict=True)}

    def block(self, place: tuple[slice, ...]) -> ListedStarts:
        """Starts of a range of numbers."""
        return ListedStarts(*self.states().of(place[0]))

    def states(self) -> States:
        """States of all starts."""
        return States(*map(np.asarray, (self.position, self.velocity, self.phase)))

    def describe(self) -> dict[str, Any]:
        """Number of starts and a digest of their values."""
        digest = hashlib.sha256(b"".join(part.tobytes() for part in self.states()))
        return {"kind": "listed", "count": self.dims["start"], "sha256": digest.hexdigest()}


Many = RandomStarts | GridStarts | ListedStarts
Start = State | Many


Over = Mapping[str, ArrayLike]


def grid_of(system: System, over: Over, start: Start) -> tuple[Over, Start]:
    """Parameters of a grid, and its starts: a state varied along the axes that are coordinates of it.

    Raises
    ------
    InvalidParameterError
        Coordinates that no state has; coordinates beside several starts.
    """
    if not isinstance(over, Mapping):
        raise refusal("over", over, "a dictionary from names of parameters to values")
    varied_by = {name: values for name, values in over.items() if is_coordinate(system, name)}
    if not varied_by:
        return over, start
    if not isinstance(start, State):
        raise InvalidParameterError(
            f"over = {', '.join(varied_by)}: a coordinate of the start varies one state. Give one start instead of "
            "several, or leave it out of over."
        )
    rest = {name: values for name, values in over.items() if name not in varied_by}
    return rest, GridStarts(varied_by, start)


def _in_order(argument: str, by_name: Any, base: Any) -> list[str]:
    """Names of coordinates, in the order x1, ..., v1, ..., phase; others are refused."""
    check_kind("base", base, State, "a State")
    known = names_of_state(len(base.position))
    if not isinstance(by_name, Mapping) or not by_name:
        raise refusal(argument, by_name, f"a dictionary with at least one of {', '.join(known)}")
    unknown = [name for name in by_name if name not in known]
    if unknown:
        raise refusal(argument, unknown[0], f"one of {', '.join(known)}")
    return [name for name in known if name in by_name]


def _finite(name: str, values: ArrayLike, shape: tuple[int, ...] | None = None) -> Floats:
    """Copy of an array of finite numbers."""
    copy = np.ascontiguousarray(numbers(name, values, "an array of numbers"))
    if shape not in (None, copy.shape):
        raise InvalidParameterError(f"{name} has shape {copy.shape}; expected {shape}.")
    return copy
