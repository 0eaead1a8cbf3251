"""A system compiled for motions with prescribed events, with derivatives by one parameter.

States are zeta = (x, v, theta), theta the phase of the first forcing line. Where the order of
impacts and of changes of state is known, each flight and the event at its end is an analytic function
of zeta, the flight time and the parameters (theory.md, "Periodic orbits"); the kernel evaluates it and
its derivatives. Modes and guards are those of piecewise.py: physical coordinates, whose entries are
smooth in every parameter, serve for all systems.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact import _kernel
from vibroimpact._core import linear
from vibroimpact._core.chebyshev import nodes
from vibroimpact._core.checks import shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.linear import Vector
from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Flags, Floats, Integers
from vibroimpact._core.windows import Windows
from vibroimpact._kernel import Jet
from vibroimpact.compile.coordinates import STEP_ANGLE
from vibroimpact.compile.modes import Guard, Mode, Watch, closed_from_code
from vibroimpact.compile.piecewise import Piecewise, held_in, states_from_code
from vibroimpact.model.dashpots import along, forces_by_speeds, loose_groups, vanishes
from vibroimpact.model.mechanism import Mechanism, held_last
from vibroimpact.model.parameters import expanded
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of

COASTING_STOP = -1  # a segment that ends without an impact has it as the number of its stop
PARAMETER_ORDERS = (0, 1, 3, 7)  # f, f', f'', f''' among the coefficients of a jet
# Derivatives of frequencies that have a constant ratio are rounded by so much.
PROPORTIONAL_RELATIVE = 1e-12
WINDOW_RADIANS = 6.0  # a window is so many radians of the fastest rate long
# With so many Chebyshev nodes the series of a flight over a window has fallen below 2^-53.
WINDOW_NODES = 25
# Relative to the largest u' in a window. It moves an extremum of the gap by as much, and its value
# by the square of that; where two extrema are about to merge by the power 3/2, 3e-14.
FLAT_OF_LARGEST_RATE = 1e-9
# Guards of rigid stops have these numbers in place of that of a watch.
GAP_WATCH = -1  # the gap of an open one
FORCE_WATCH = -2  # the force on a closed one
CHATTER_WATCH = -3  # the end of chatter
PHASE_WATCH = -4  # a phase of the forcing, at which a motion without events is cut
NONE_LEFT_OUT = -1  # in place of a coordinate
# Limits of what is held in every mode, at which it is all the time: the place, and the speed.
PLACE_WATCH, SPEED_WATCH = -5, -6
PHASE = -1  # in place of a contact or element, where a flight ends at a phase
# A contact that its impulse moves less, relative to its mobility alone, is held by those that are closed.
HELD_OF_MOBILITY = 2.0**-40
WHOLE_END = 4  # fields of an End, of which the last may be left out


class End(NamedTuple):
    """End of a flight: the limit of a guard of its mode that is reached.

    Attributes
    ----------
    contact, side
        Number of the contact or element, +1 for the upper and -1 for the lower limit of the guard.
    mode
        Code of the mode (compile/piecewise.py); 0: no contact closed, every element in its state 0.
    watch
        Number of the guard among the watches of the mode. Of rigid stops, GAP_WATCH for the gap;
        FORCE_WATCH for the force of a closed one, whose lower limit is 0, so that ``side`` is -1; and
        CHATTER_WATCH for the end of chatter, with which rest begins. PHASE_WATCH, with PHASE as the contact,
        where nothing happens: the sine of the first line vanishes, rising on the side +1. No flight ends at a
        PLACE_WATCH or SPEED_WATCH: the contact, or element, is there all the time.
    """

    contact: int
    side: int
    mode: int = 0
    watch: int = GAP_WATCH


class GuardRow(NamedTuple):
    """A guard of a mode, u = row . y + gain within its limits; contact and watch as in :class:`End`."""

    contact: int
    watch: int
    row: Floats
    gain: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Numbers:
    """A mode in numbers: y' = b y + constant, with its guards."""

    b: Floats
    constant: Floats
    guards: tuple[GuardRow, ...]
    # number of directions in which states of the mode are no longer free: joints that stick, sliders that slip, and
    # of rigid stops that are closed the place and the speed
    forgotten: int
    # velocities of the massless coordinates, rows on y with 1 in place of them, shape (light, D)
    speeds: Floats
    light: tuple[int, ...]  # numbers of the massless coordinates

    @property
    def growth(self) -> float:
        """Rate at which the mode makes volumes of (x, v) grow, v of the coordinates with mass."""
        unused = [2 * i + 1 for i in self.light]
        return float(np.trace(self.b) - np.diag(self.b)[unused].sum())


class Linearised(NamedTuple):
    """Segments and their derivatives by the state (2n + 1), the flight time and the parameter."""

    before: Floats  # (m, 2n + 1)
    after: Floats
    gap: Floats  # (m,) row . x - limit at the end
    rate: Floats  # (m,) of row . x, before and after the impact
    rate_after: Floats
    after_by: Floats  # (m, 2n + 1, 2n + 3)
    gap_by: Floats  # (m, 2n + 3)


class Passage(NamedTuple):
    """A guard u along one flight."""

    extrema: list[tuple[float, float]]  # times since the start, and values
    # at the start and at the end
    values: tuple[float, float]
    rates: tuple[float, float]


class GuardAlong(NamedTuple):
    """A guard within its limits along flights; contact and watch as in :class:`End`."""

    contact: int
    watch: int
    lower: float
    upper: float
    size: float  # largest sum of the moduli of its terms
    fastest: float  # its largest rate
    flights: dict[int, Passage]  # by their numbers, those in its mode


class Approach(NamedTuple):
    """All guards along flights."""

    guards: list[GuardAlong]
    most: Floats  # largest moduli of the coordinates y, at least 1 for waves, shape (D,)


class Explicit(NamedTuple):
    """Segments with those of chatter replaced by the flights between their impacts."""

    # as those of segments; the last flight of chatter has its end
    states: Floats
    durations: Floats
    ends: list[End]
    # derivatives along a direction of the segments and the parameter
    states_by: Floats
    durations_by: Floats
    # segment of each flight, and the time since its start
    segment: Integers
    since: Floats
    chatters: Flags  # whether a flight is within chatter, of the contact at its end


@dataclass(frozen=True)
class Layout:
    """What a compiled system is apart from its numbers: the same along a branch.

    Its numbers are those that the kernel takes (src/bindings/orbit/prescribed.hpp), the bound of all rates, the
    frequencies of the lines, of every guard the row, gain and limits, and of every mode the speeds of massless
    coordinates.
    """

    degrees: int
    lines: int
    light: tuple[int, ...]  # numbers of the massless coordinates
    scale: float  # velocities among the coordinates y of the modes are v / scale
    codes: tuple[int, ...]  # of the modes
    guards: tuple[tuple[tuple[int, int], ...], ...]  # contact and watch of the guards of each mode
    forgotten: tuple[int, ...]  # as in :class:`Numbers`
    ends: dict[End, int]  # number of every limit at which a flight can end
    # of each the number of its mode, whether it ends chatter, and the number of its map, -1 for none
    stops: tuple[tuple[int, bool, int], ...]
    maps: int  # how many there are

    @property
    def width(self) -> int:
        """Number D of the coordinates y."""
        return 2 * (self.degrees + self.lines)

    @cached_property
    def rows(self) -> list[list[int]]:
        """Places among the numbers of the rows of the guards of each mode and, last, of its speeds."""
        place, found = self.of_kernel + 1 + self.lines, list[list[int]]()
        for guards in self.guards:
            found.append([place + j * (self.width + 3) for j in range(len(guards) + 1)])
            place = found[-1][-1] + len(self.light) * self.width
        return found

    def restitution_of(self, stop: int) -> int:
        """Place among the numbers of the restitution of a stop."""
        d = self.width
        return 1 + len(self.codes) * d * (d + 1) + stop * (3 * d + 2) + 2 * d + 1

    @property
    def of_kernel(self) -> int:
        """How many of the numbers the kernel takes."""
        d = self.width
        return 1 + len(self.codes) * d * (d + 1) + len(self.stops) * (3 * d + 2) + self.maps * d * d


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Compiled system for segments with prescribed ends, and their derivatives.

    Copies and pickles are compiled again.
    """

    make: Callable[[], System]  # makes the system
    parameter: str  # by which it is differentiated, "" for none
    layout: Layout
    values: Floats  # its numbers, with three derivatives by the parameter: shape (4, N)
    _latest: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return compile_prescribed, (self.system, self.parameter, self.layout.codes)

    @cached_property
    def system(self) -> System:
        """The system."""
        return self.make()

    @property
    def degrees(self) -> int:
        """Number n of coordinates."""
        return self.layout.degrees

    @property
    def scale(self) -> float:
        """Velocities among the coordinates y of the modes are v / scale."""
        return self.layout.scale

    @property
    def ends(self) -> dict[End, int]:
        """Number of every limit at which a flight can end."""
        return self.layout.ends

    @property
    def omega(self) -> float:
        """Frequency of the first line, 0 where the system is autonomous."""
        return float(self.values[0, 0])

    @property
    def omega_orders(self) -> Floats:
        """The frequency and its derivatives by the parameter, shape (4,)."""
        return self.values[:, 0]

    @cached_property
    def rate(self) -> float:
        """Bound of every rate of the flight, to a factor of two."""
        rate = float(self.values[0, self.layout.of_kernel])
        # the rates of massless coordinates are not among those of the masses
        return max(rate, self._fastest.max()) if self.layout.light else rate

    @cached_property
    def ratios(self) -> Floats:
        """Frequencies of the lines relative to the first, shape (L,)."""
        first = self.layout.of_kernel + 1
        omegas = self.values[0, first : first + self.layout.lines]
        return omegas / omegas[0] if omegas.size else omegas

    @cached_property
    def kernel(self) -> _kernel.Prescribed:
        """The system in the kernel."""
        return _kernel.Prescribed(
            degrees=self.degrees, ratios=self.ratios.tolist(), rate=self.scale,
            steps=(STEP_ANGLE / self._fastest).tolist(), stops=[*self.layout.stops],
            values=self.values,
        )  # fmt: skip

    @cached_property
    def _fields(self) -> Floats:
        """B and the constant of each mode, shape (modes, D + 1, D)."""
        at, d = self.layout, self.layout.width
        return self.values[0, 1 : 1 + len(at.codes) * d * (d + 1)].reshape(-1, d + 1, d)

    @cached_property
    def _fastest(self) -> Floats:
        """Bound of the rates of each mode and of the forcing, shape (modes,).

        Massless coordinates have units of their own: the bound is that in the units that make it least.
        """
        n = 2 * self.degrees
        own, waves = self._fields[:, :n, :n], self._fields[:, n:-1]
        if self.layout.light:
            from scipy.linalg import matrix_balance

            own = np.array([matrix_balance(b, permute=False)[0] for b in own])
        norms = [np.abs(part).sum(axis=2).max(axis=1, initial=0.0) for part in (own, waves)]
        fastest: Floats = np.maximum(*norms)
        return fastest

    @cached_property
    def modes(self) -> dict[int, Numbers]:
        """Modes by their code."""
        at, d = self.layout, self.layout.width
        found = {}
        for k, code in enumerate(at.codes):
            guards = [self._guard(k, j) for j in range(len(at.guards[k]))]
            after = at.rows[k][-1]
            speeds = self.values[0, after : after + len(at.light) * d].reshape(-1, d)
            b, constant = self._fields[k, :-1], self._fields[k, -1]
            found[code] = Numbers(b, constant, tuple(guards), at.forgotten[k], speeds, at.light)
        return found

    def _guard(self, k: int, j: int) -> GuardRow:
        """Guard j of mode k."""
        numbers, place, d = self.values[0], self.layout.rows[k][j], self.layout.width
        row, rest = numbers[place : place + d], numbers[place + d : place + d + 3]
        return GuardRow(*self.layout.guards[k][j], row, *rest.tolist())

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism of the system, in plain numbers."""
        return mechanism_of(self.system)

    @property
    def massless(self) -> list[int]:
        """Coordinates without mass, whose velocities among zeta are no states and are not read."""
        return [*self.layout.light]

    @property
    def heavy(self) -> list[int]:
        """Coordinates with mass."""
        return [i for i in range(self.degrees) if i not in self.layout.light]

    @property
    def size(self) -> int:
        """Entries of zeta, 2n + 1."""
        return 2 * self.degrees + 1

    def stop_numbers(self, ends: Iterable[tuple[int, ...]]) -> list[int]:
        """Numbers of ends of flights, or of stops of a machine in mode 0, in the kernel."""
        known, asked = self.ends, [end if len(end) == WHOLE_END else End(*end) for end in ends]
        if lost := next((end for end in asked if end not in known), None):
            raise InvalidParameterError(
                f"elements[{lost[0]}]: no flight ends so in this machine, which has other stops or arcs of phase."
            )
        return [known[end] for end in asked]  # type: ignore[index]

    def linearise(
        self, states: ArrayLike, durations: ArrayLike, ends: Iterable[tuple[int, ...]]
    ) -> Linearised:
        """Each flight and the event that ends it, with first derivatives."""
        out = self.kernel.linearise(
            _contiguous(states), _contiguous(durations), self.stop_numbers(ends)
        )
        return Linearised(*out)

    def second(
        self,
        states: ArrayLike,
        durations: ArrayLike,
        ends: Iterable[tuple[int, ...]],
        along: Floats,
        *,
        by_parameter: bool = False,
    ) -> tuple[Floats, Floats]:
        """Second derivatives of each segment, once along a direction and once by every number.

        Parameters
        ----------
        states, durations, ends
            As for :meth:`linearise`.
        along
            Directions in the state and the flight time of each segment, shape (m, 2n + 2).
        by_parameter
            By the parameter alone, not by every number.

        Returns
        -------
        (after_by, gap_by)
            Derivatives of those of :class:`Linearised` along the direction, of the same shapes; by
            the parameter alone the last axis has one entry.
        """
        numbers = self.stop_numbers(ends)
        return self.kernel.second(
            _contiguous(states), _contiguous(durations), numbers, _contiguous(along), by_parameter
        )

    def explicit(
        self,
        states: Floats,
        durations: Floats,
        ends: Sequence[End],
        by: tuple[Floats, Floats, float] | None = None,
    ) -> Explicit:
        """Segments with the impacts of chatter.

        Parameters
        ----------
        states, durations, ends
            As for :meth:`linearise`.
        by
            Direction of the states, the flight times and the parameter; none by default.
        """
        states_by, durations_by, p_by = by or (np.zeros_like(states), np.zeros_like(durations), 0.0)
        chatters = np.array([end.watch == CHATTER_WATCH for end in ends])
        numbers = np.arange(len(ends))
        if not chatters.any():
            since = np.zeros(len(ends))
            return Explicit(
                states, durations, [*ends], states_by, durations_by, numbers, since, chatters
            )
        parts, named, lengths = [], [], []
        for k, end in enumerate(ends):
            if chatters[k]:
                direction = np.append(states_by[k], p_by)
                part = self.kernel.chatter(_contiguous(states[k]), direction, self.ends[end])
            else:
                part = (
                    states[k : k + 1],
                    durations[k : k + 1],
                    states_by[k : k + 1],
                    durations_by[k : k + 1],
                )
            parts.append(part)
            lengths.append(len(part[1]))
            named += [end._replace(watch=GAP_WATCH)] * (lengths[-1] - 1) + [end]
        every, times, every_by, times_by = (np.concatenate(x) for x in zip(*parts, strict=True))
        since = np.concatenate([np.append(0.0, np.cumsum(part[1][:-1])) for part in parts])
        segment = np.repeat(numbers, lengths)
        return Explicit(every, times, named, every_by, times_by, segment, since, chatters[segment])

    def guard(self, end: tuple[int, ...]) -> GuardRow:
        """The guard at whose limit a flight ends; of chatter, the gap."""
        contact, _, code, watch = End(*end)
        if watch == PHASE_WATCH:
            row = np.zeros(self.layout.width)
            row[2 * self.degrees] = 1.0
            return GuardRow(PHASE, PHASE_WATCH, row, 0.0, 0.0, 0.0)
        watch = GAP_WATCH if watch == CHATTER_WATCH else watch
        k = self.mode_number(code)
        return self._guard(k, self.layout.guards[k].index((contact, watch)))

    def impulse(self, end: tuple[int, ...]) -> Floats:
        """Change of y by the impact at the end of a flight that changes the rate of its gap by one; zero for others."""
        restitution = self.layout.restitution_of(self.ends[End(*end)])
        return self.values[0, restitution - self.layout.width : restitution]

    def restitution(self, end: tuple[int, ...]) -> float:
        """Restitution of the impact that ends a flight; 0 where nothing is struck."""
        return float(self.values[0, self.layout.restitution_of(self.ends[End(*end)])])

    def slopes(self, end: tuple[int, ...], state: Floats) -> Floats:
        """Derivatives of a guard by zeta at a state, shape (2n + 1,)."""
        return self.kernel.slopes(self.ends[End(*end)], float(state[-1]))

    def solved_coordinate(self, end: tuple[int, ...]) -> int:
        """Position, or velocity, that the section of a guard leaves out: its row's last largest.

        The phase, where the guard depends on nothing else. NONE_LEFT_OUT where a reset follows, after which the
        guard is left: the section is then all of space, and the map has a multiplier 0 more, along the flow.
        """
        return self.kernel.solved_coordinate(self.ends[End(*end)])

    def embedded(self, x_and_v: Floats, theta: Floats) -> Floats:
        """Coordinates y, shape (..., D), of (x, v) (..., 2n) at phases (...).

        A massless coordinate has 1 in place of its velocity, which is not read.
        """
        n = self.degrees
        y = np.empty((*x_and_v.shape[:-1], self.layout.width))
        y[..., 0 : 2 * n : 2] = x_and_v[..., :n]
        y[..., 1 : 2 * n : 2] = x_and_v[..., n:] / self.scale
        for line, ratio in enumerate(self.ratios):
            y[..., 2 * (n + line)] = np.sin(ratio * theta)
            y[..., 2 * (n + line) + 1] = np.cos(ratio * theta)
        y[..., [2 * i + 1 for i in self.massless]] = 1.0
        return y

    def largest(self, moved: Floats) -> Floats:
        """Bounds of the coordinates y, shape (D,), where (x, v) take the values (..., 2n) in rows."""
        n, most = self.degrees, np.ones(self.layout.width)
        sizes = np.abs(moved).max(axis=0)
        most[0 : 2 * n : 2], most[1 : 2 * n : 2] = sizes[:n], sizes[n:] / self.scale
        most[[2 * i + 1 for i in self.massless]] = 1.0
        return most

    def with_speeds(self, states: Floats, modes: Sequence[int]) -> Floats:
        """States (x, v, theta) in rows with the velocities that their modes give to massless coordinates."""
        out = states.copy()
        places = [self.degrees + i for i in self.massless]
        for row, mode in zip(out, modes, strict=True):
            row[places] = self.modes[mode].speeds @ self.embedded(row[:-1], row[-1])
        return out

    def after(self, state: Floats, time: float, mode: int = 0) -> Floats:
        """(x, v, theta) after a time of flight in a mode, shape (2n + 1,)."""
        inside = self._fly(_contiguous(state)[None, :], [mode], [1], np.array([time]), 1.0)[0, 0]
        return np.append(inside, state[-1] + self.omega * time)

    def step(self, mode: int) -> float:
        """Time over which Taylor series of the flights in a mode converge at once."""
        return STEP_ANGLE / float(self._fastest[self.mode_number(mode)])

    def window(self, durations: Floats) -> float:
        """Length of the windows on which flights are expanded; free masses have no fastest rate."""
        return min(WINDOW_RADIANS / self.rate, float(durations.max()))

    def flights(
        self, states: ArrayLike, durations: Floats, modes: Sequence[int] = ()
    ) -> tuple[Windows, Floats]:
        """Flight at Chebyshev nodes of windows that cover each segment, in mode 0 or those given.

        Returns
        -------
        windows, (w, WINDOW_NODES, 2n) of x and v
            The latest ones are kept: gaps, amplitudes and sizes of an orbit are asked in turn.
        """
        key = _contiguous(states).tobytes(), durations.tobytes(), tuple(modes)
        found = self._latest.get(key)
        if found is None:
            w = Windows.over(durations, self.window(durations))
            offsets = (1.0 + nodes(WINDOW_NODES)) * (w.length / 2.0)
            numbers = modes or [0] * len(w.counts)
            values = self._fly(_contiguous(states), numbers, w.counts.tolist(), offsets, w.length)
            found = w, values
            self._latest.clear()
            self._latest[key] = found
        return found

    def approach(self, states: Floats, durations: Floats, modes: Sequence[int]) -> Approach:
        """How all guards go along flights in these modes; the latest is kept, for gaps and amplitudes in turn."""
        key = "approach", states.tobytes(), durations.tobytes(), tuple(modes)
        if key not in self._latest:
            self._latest.clear()
            self._latest[key] = self._approach(_contiguous(states), durations, modes)
        found: Approach = self._latest[key]
        return found

    def _approach(self, states: Floats, durations: Floats, modes: Sequence[int]) -> Approach:
        at, n = self.layout, self.degrees
        places = [(k, j) for k, guards in enumerate(at.guards) for j in range(len(guards))]
        of_mode, rows = [k for k, _ in places], [at.rows[k][j] for k, j in places]
        numbers = [self.mode_number(mode) for mode in modes]
        extrema, edges, sizes, most = self.kernel.approach(
            states, _contiguous(durations), numbers, of_mode, rows, nodes(WINDOW_NODES),
            self.window(durations), FLAT_OF_LARGEST_RATE,
        )  # fmt: skip
        guards = []
        for i, (mode, number) in enumerate(places):
            contact, watch, *_, lower, upper = self._guard(mode, number)
            size, fastest = sizes[i].tolist()
            flights = {
                j: Passage([], (first, last), (rising, closing))
                for j, (first, rising, last, closing) in enumerate(edges[i].tolist())
                if numbers[j] == mode
            }
            guards.append(GuardAlong(contact, watch, lower, upper, size, fastest, flights))
        for i, j, time, value in extrema.tolist():
            guards[int(i)].flights[int(j)].extrema.append((time, value))
        most[2 * n :] = 1.0
        most[[2 * i + 1 for i in self.massless]] = 1.0
        return Approach(guards, most)

    def _fly(
        self, states: Floats, modes: Sequence[int], windows: list[int], at: Floats, window: float
    ) -> Floats:
        numbers = [self.mode_number(mode) for mode in modes]
        return np.asarray(self.kernel.fly(states, numbers, windows, at, window))

    def mode_number(self, mode: int) -> int:
        """Number of a mode in the kernel."""
        return self.layout.codes.index(mode)

    def sampled(self, states: Floats, durations: Floats, modes: Sequence[int] = ()) -> Floats:
        """(x, v) at the start of each segment and at the nodes within its flight, (k, 2n)."""
        w, values = self.flights(states, durations, modes)
        since = w.start[:, None] + (1.0 + nodes(WINDOW_NODES)) * (w.length / 2.0)
        within = values[since <= durations[w.segment][:, None]]
        return np.vstack([states[:, : 2 * self.degrees], within])


def _contiguous(a: ArrayLike) -> Floats:
    return np.ascontiguousarray(a, dtype=float)


class Push(NamedTuple):
    """Impulses and restitutions at both limits, and by which y jumps besides: the number of a map, and a kick."""

    impulses: Sequence[Vector]  # they change the rate of the guard by one
    restitutions: Sequence[float]
    kick: Vector
    map: int = -1


class Compilation:
    """A mechanism compiled in numbers of any kind: a :class:`Layout`, and a list of the numbers."""

    def __init__(self, m: Mechanism, codes: tuple[int, ...]) -> None:
        self.pieces = pieces = Piecewise(m)
        self.known: dict[End, int] = {}
        self.laws: list[Vector] = []  # row, limit, impulse, restitution, kick of each limit
        self.stops: list[tuple[int, bool, int]] = []
        self.maps: list[Vector] = []  # rows of their matrices
        self.rows: list[Vector] = []  # of guards with gain and limits, and of speeds
        self.still: Vector = [0.0] * pieces.size
        self.no_push = Push((self.still, self.still), (0.0, 0.0), self.still)
        self.contacts = pieces.laws()
        contacts = len(m.rigid_stops)
        resting = {stop for code in codes for stop in closed_from_code(code, contacts)}
        held = held_in(m, codes)
        fields: list[Vector] = []
        guards, forgotten = [], []
        for number, code in enumerate(codes):
            mode = pieces.prescribed_mode(code)
            flow = cast(Any, mode.coordinates.flow)
            fields += [*flow["b"], flow["constant"]]
            guards.append(tuple(self._guards(mode, number)))
            self._add_chatter(mode, resting)
            self._add_phase(mode, number)
            self._add_held(mode.code, number, held)
            forgotten.append(self._forgotten(mode))
            self.rows += [mode.coordinates.to_v[i] for i in pieces.light]
        self.layout = Layout(
            m.degrees, len(m.forces), tuple(pieces.light), pieces.scale, codes, tuple(guards),
            tuple(forgotten), self.known, tuple(self.stops), len(self.maps) // pieces.size,
        )  # fmt: skip
        omegas = [force.omega for force in m.forces]
        parts = [[m.omega], *fields, *self.laws, *self.maps, [pieces.rate], omegas, *self.rows]
        self.numbers: Vector = [x for part in parts for x in part]

    def _guards(self, mode: Mode, number: int) -> Iterator[tuple[int, int]]:
        """Contact and watch of each guard of a mode with this number in the kernel; their limits are kept."""
        for i, guard in enumerate(mode.guards):
            push = self.no_push if guard.side else self._push(i, mode.code)
            kind = FORCE_WATCH if guard.side else GAP_WATCH
            yield self._keep(End(i, 0, mode.code, kind), guard, push, number)
        contacts = len(mode.guards)
        for j, watch in enumerate(mode.watches):
            if not watch.held:
                name = End(contacts + watch.element, 0, mode.code, j)
                push = self._jump(watch.reset) if watch.reset >= 0 else self.no_push
                yield self._keep(name, watch, push, number)

    def _push(self, i: int, code: int) -> Push:
        """The impact of a contact in a mode: closed contacts that it presses on their stops stay, others open."""
        law, closed = self.contacts[i], closed_from_code(code, len(self.contacts))
        impulses = [self._impulse(i, self._pressed(Stop(i, side), closed)) for side in (-1, 1)]
        return Push(impulses, (law.restitution_lower, law.restitution_upper), self.still)

    def _impulse(self, i: int, pressed: Sequence[int]) -> Vector:
        """Impulse of a contact, and of closed ones that stay, which changes the rate of its gap by one."""
        laws = self.contacts
        impulse, mobility = [*laws[i].impulse], laws[i].mobilities[i]
        if pressed:
            across = [[laws[k].mobilities[j] for k in pressed] for j in pressed]
            moved = [[laws[i].mobilities[j]] for j in pressed]
            for j, (share,) in zip(pressed, linear.solve_definite(across, moved), strict=True):
                impulse = [x - share * y for x, y in zip(impulse, laws[j].impulse, strict=True)]
                mobility = mobility - share * laws[j].mobilities[i]
        if _value(mobility) <= HELD_OF_MOBILITY * _value(laws[i].mobilities[i]):
            return self.still
        return [x / mobility for x in impulse]

    def _pressed(self, struck: Stop, closed: Sequence[Stop]) -> list[int]:
        """Closed contacts that an impact presses on their stops: (T19), whose solution grows with the speed."""
        if not closed or self.pieces.mechanism.impact_law != "moreau":
            return []
        w = np.array([[_value(x) for x in law.mobilities] for law in self.contacts]).T
        for count in range(len(closed) + 1):
            for some in itertools.combinations(closed, count):
                pressed = [stop.contact for stop in some]
                impulse = np.eye(len(w))[struck.contact]
                impulse[pressed] -= np.linalg.solve(
                    w[np.ix_(pressed, pressed)], w[pressed] @ impulse
                )
                rates = w @ impulse
                if all(
                    stop.side * struck.side * (impulse if stop in some else rates)[stop.contact]
                    >= 0.0
                    for stop in closed
                ):
                    return pressed
        return []

    def _jump(self, reset: int) -> Push:
        """The jump of y by a map of a watch; its matrix is kept but for impulses."""
        jump, push = self.pieces.resets[reset], self.no_push
        if jump.kind == "kept":
            return push
        if jump.kind == "reset":
            push = push._replace(map=len(self.maps) // self.pieces.size)
            self.maps += jump.matrix
        return push._replace(kick=jump.shift)

    def _add_phase(self, mode: Mode, number: int) -> None:
        """Ends of flights in a mode at which nothing happens."""
        m = self.pieces.mechanism
        if not m.forces:
            return
        sine = [0.0] * self.pieces.size
        sine[2 * m.degrees] = 1.0
        for side in (-1, 1):
            self.known[End(PHASE, side, mode.code, PHASE_WATCH)] = len(self.laws)
            self.laws.append([*sine, 0.0, *self.still, 0.0, *self.still])
            self.stops.append((number, False, -1))

    def _add_held(self, code: int, number: int, held: Sequence[Stop]) -> None:
        """Places and speeds, in a mode, of what all modes hold."""
        for stop in held:
            for watch, row, limit in self.pieces.held_rows(code, stop):
                name = End(*stop, code, SPEED_WATCH if watch else PLACE_WATCH)
                self.known[name] = len(self.laws)
                self.laws.append([*row[:-1], limit - row[-1], *self.still, 0.0, *self.still])
                self.stops.append((number, False, -1))

    def _keep(self, name: End, of: Guard | Watch, push: Push, number: int) -> tuple[int, int]:
        impulses, restitutions, kick, jump = push
        limits = of.lower, of.upper
        for side, limit, restitution, impulse in zip(
            (-1, 1), limits, restitutions, impulses, strict=True
        ):
            if not is_infinite(limit):
                self.known[name._replace(side=side)] = len(self.laws)
                self.laws.append([*of.row, limit - of.gain, *impulse, restitution, *kick])
                self.stops.append((number, False, jump))
        self.rows.append([*of.row, of.gain, *limits])
        return name.contact, name.watch

    def _add_chatter(self, mode: Mode, resting: set[Stop]) -> None:
        """Ends of chatter in a mode, at stops that are rested on in others."""
        for contact, side in resting:
            number = self.known.get(End(contact, side, mode.code))
            if number is not None:
                self.known[End(contact, side, mode.code, CHATTER_WATCH)] = len(self.laws)
                self.laws.append(self.laws[number])
                self.stops.append((self.stops[number][0], True, -1))

    def _forgotten(self, mode: Mode) -> int:
        """Number of joints that stick in a mode, and of sliders whose place a balance of forces gives.

        Left out are joints that others hold already. A stop that is closed gives two, place and speed; one
        on coordinates without mass, whose speeds are no states, one.
        """
        elements, sliders = self.pieces.mechanism.switching, self.pieces.sliders
        states = states_from_code(mode.code, len(mode.guards), len(elements))
        closed = sum(
            2 if any(stop.row[i] for i in self.pieces.heavy) else 1
            for stop, guard in zip(self.pieces.mechanism.rigid_stops, mode.guards, strict=True)
            if guard.side
        )
        return closed + sum(
            watch.held and (i in sliders or states[i] == elements[i].holding)
            for watch in mode.watches
            for i in [watch.element]
        )


def with_derivatives(numbers: Vector) -> Floats:
    """Numbers or jets as an array: their values, first, second and third derivatives in rows."""
    flat = cast(list[Any], numbers)
    orders = np.zeros((len(PARAMETER_ORDERS), len(flat)))
    orders[0] = [_value(x) for x in flat]
    for i, x in enumerate(flat):
        if isinstance(x, Jet):
            coefficients = x.coefficients
            orders[:, i] = [coefficients[k] for k in PARAMETER_ORDERS]
    return orders


def _value(x: Any) -> float:
    return float(x.value) if isinstance(x, Jet) else float(x)


def compile_prescribed(
    system: System, parameter: str = "", modes: tuple[int, ...] = (0,)
) -> Prescribed:
    """Compile a system; ``parameter`` names the number by which it is differentiated.

    ``modes`` are the codes of the modes that its motions pass.

    Raises
    ------
    InvalidParameterError
        No such parameter, a system that cannot be differentiated with respect to it, or a
        parameter that changes the ratios of the forcing frequencies; a system that orbits are not
        found for.
    """
    try:
        return _cached(cast(Hashable, system), parameter, modes)
    except TypeError:  # a system that cannot be hashed
        return _compile(system, parameter, modes)


def _check_ratios(varied: Mechanism, parameter: str) -> None:
    """Refuse a parameter that changes the ratios of the forcing frequencies."""
    for line in varied.forces[1:]:
        first, other = with_derivatives([varied.omega, line.omega]).T
        scaled = first * (other[0] / first[0])
        if np.any(
            np.abs(other - scaled) > PROPORTIONAL_RELATIVE * (np.abs(other) + np.abs(scaled))
        ):
            raise InvalidParameterError(
                f"parameter = {parameter!r}: changes the ratios of the forcing frequencies, so "
                "there is no common period. Take one that keeps them, as omega of a Mechanism does."
            )


def _check_order(varied: Mechanism, parameter: str) -> None:
    """Refuse a parameter that gives a massless coordinate a mass, or a slider without one a dashpot."""
    laws = [(e.row, c) for e in varied.switching for _, c in e.stiffest]
    groups = loose_groups(varied.damping, held_last(varied))
    for i in varied.massless:
        given: dict[str, list[list[Any]]] = {
            "mass": [[x] for x in (*varied.mass[i], *(row[i] for row in varied.mass))]
        }
        if weights := groups.get(i):
            given["dashpot"] = [*forces_by_speeds(varied.damping, weights)]
            given["dashpot"] += [[c] for row, c in laws if along(row, weights)]
        for what, sums in given.items():
            if any(_appears(terms) for terms in sums):
                raise InvalidParameterError(
                    f"parameter = {parameter!r}: would give coordinate {i} a {what}, which changes the "
                    f"order of its equation: it has no derivative there. Give it a small {what} first."
                )


def _appears(terms: list[Any]) -> bool:
    """Whether a sum that is zero has derivatives that are not, but for rounding."""
    orders = [x.coefficients for x in terms if isinstance(x, Jet)]
    if not vanishes([_value(x) for x in terms]):
        return False
    return not all(vanishes(list(order)) for order in [*zip(*orders, strict=True)][1:])


def check_prescribed(system: System, m: Mechanism) -> None:
    """Refuse a system whose mechanism motions with prescribed events do not cover."""
    why = ""
    if m.degrees > _kernel.BLOCK_DEGREES or len(m.forces) > _kernel.BLOCK_LINES:
        why = (
            f"at most {_kernel.BLOCK_DEGREES} coordinates and {_kernel.BLOCK_LINES} frequencies, "
            f"and it has {m.degrees} and {len(m.forces)}"
        )
    if why:
        raise InvalidParameterError(
            f"system = {shown(system)}: orbits are found for {why}. "
            "Take simulate, classify, sweeps, Lyapunov exponents."
        )


def _compile(system: Any, parameter: str, codes: tuple[int, ...]) -> Prescribed:
    m = expanded(system, parameter) if parameter else mechanism_of(system)
    check_prescribed(system, m)
    _check_ratios(m, parameter)
    _check_order(m, parameter)
    made = Compilation(m, codes)
    return Prescribed(lambda: system, parameter, made.layout, with_derivatives(made.numbers))


_cached = lru_cache(maxsize=256)(_compile)  # with the exponentials of its flights up to 1.4 MB each
