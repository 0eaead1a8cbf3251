"""A system compiled for motions with prescribed events, with derivatives by one parameter.

States are zeta = (x, v, theta), theta the phase of the first forcing line. Where the order of
impacts and of changes of state is known, each flight and the event at its end is an analytic function
of zeta, the flight time and the parameters (theory.md, "Periodic orbits"); the kernel evaluates it and
its derivatives. Modes and guards are those of piecewise.py: physical coordinates, whose entries are
smooth in every parameter, serve for all systems.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact import _kernel
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
from vibroimpact.compile.piecewise import Piecewise, states_from_code
from vibroimpact.model.dashpots import along, forces_by_speeds, loose_groups, vanishes
from vibroimpact.model.mechanism import Mechanism, held_last, needs_elements, with_mass
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
# Guards of rigid stops have these numbers in place of that of a watch.
GAP_WATCH = -1  # the gap of an open one
FORCE_WATCH = -2  # the force on a closed one
CHATTER_WATCH = -3  # the end of chatter
PHASE_WATCH = -4  # a phase of the forcing, at which a motion without events is cut
PHASE = -1  # in place of a contact or element, where a flight ends at a phase


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
        where nothing happens: the sine of the first line vanishes, rising on the side +1.
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

    def fastest(self, mechanical: int) -> float:
        """Bound of the rates of so many first entries of y, and of the forcing.

        Massless coordinates have units of their own: the bound is that in the units that make it least.
        """
        own, waves = self.b[:mechanical, :mechanical], self.b[mechanical:]
        if self.light:
            from scipy.linalg import matrix_balance

            own = matrix_balance(own, permute=False)[0]
        return float(max(np.abs(part).sum(axis=1).max(initial=0.0) for part in (own, waves)))

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


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Compiled system for segments with prescribed ends, and their derivatives.

    Copies and pickles are compiled again.
    """

    # the system; the parameter by which it is differentiated, "" for none
    system: System
    parameter: str
    # n; frequency of the first line, 0 where the system is autonomous
    degrees: int
    omega: float
    omega_orders: Floats  # omega and its derivatives by the parameter, shape (4,)
    rate: float  # bounds every rate of the flight to a factor of two
    scale: float  # velocities among the coordinates y of the modes are v / scale
    modes: dict[int, Numbers]  # modes by their code
    # every limit at which a flight can end; `stops` are those of a machine in mode 0
    ends: dict[End, int]
    kernel: _kernel.Prescribed
    _latest: dict[Any, tuple[Windows, Floats]] = field(default_factory=dict, init=False, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return compile_prescribed, (self.system, self.parameter, tuple(self.modes))

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism of the system, in plain numbers."""
        return mechanism_of(self.system)

    @cached_property
    def massless(self) -> list[int]:
        """Coordinates without mass, whose velocities among zeta are no states and are not read."""
        return self.mechanism.massless

    @cached_property
    def heavy(self) -> list[int]:
        """Coordinates with mass."""
        return with_mass(self.mechanism)

    @property
    def size(self) -> int:
        """Entries of zeta, 2n + 1."""
        return 2 * self.degrees + 1

    def stop_numbers(self, ends: Iterable[tuple[int, ...]]) -> list[int]:
        """Numbers of ends of flights, or of stops of a machine in mode 0, in the kernel."""
        return [self.ends[End(*end)] for end in ends]

    def linearise(
        self, states: ArrayLike, durations: ArrayLike, ends: Iterable[tuple[int, ...]]
    ) -> Linearised:
        """Each flight and the event that ends it, with first derivatives."""
        out = self.kernel.linearise(
            _contiguous(states), _contiguous(durations), self.stop_numbers(ends)
        )
        return Linearised(**out)

    def second(
        self,
        states: ArrayLike,
        durations: ArrayLike,
        ends: Iterable[tuple[int, ...]],
        along: Floats,
    ) -> tuple[Floats, Floats]:
        """Second derivatives of each segment, once along a direction and once by every number.

        Parameters
        ----------
        states, durations, ends
            As for :meth:`linearise`.
        along
            Directions in the state and the flight time of each segment, shape (m, 2n + 2).

        Returns
        -------
        (after_by, gap_by)
            Derivatives of those of :class:`Linearised` along the direction, of the same shapes.
        """
        numbers = self.stop_numbers(ends)
        return self.kernel.second(
            _contiguous(states), _contiguous(durations), numbers, _contiguous(along)
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
            row = np.zeros(2 * (self.degrees + len(self.ratios)))
            row[2 * self.degrees] = 1.0
            return GuardRow(PHASE, PHASE_WATCH, row, 0.0, 0.0, 0.0)
        watch = GAP_WATCH if watch == CHATTER_WATCH else watch
        guards = self.modes[code].guards
        return next(g for g in guards if (g.contact, g.watch) == (contact, watch))

    def slopes(self, end: tuple[int, ...], state: Floats) -> Floats:
        """Derivatives of a guard by zeta at a state, shape (2n + 1,)."""
        row, n = self.guard(end).row, self.degrees
        out = np.zeros(self.size)
        out[:n], out[n : 2 * n] = row[0 : 2 * n : 2], row[1 : 2 * n : 2] / self.scale
        turns, waves = self.ratios, row[2 * n :].reshape(-1, 2)
        theta = turns * state[-1]
        out[-1] = turns @ (waves[:, 0] * np.cos(theta) - waves[:, 1] * np.sin(theta))
        return out

    def solved_coordinate(self, end: tuple[int, ...]) -> int:
        """Position, or velocity, that the section of a guard leaves out: its row's last largest.

        The phase, where the guard depends on nothing else.
        """
        row, n = np.abs(self.guard(end).row), self.degrees
        both = np.concatenate([row[0 : 2 * n : 2], row[1 : 2 * n : 2]])
        if not both.any():
            return 2 * n
        return int(len(both) - 1 - np.argmax(both[::-1]))

    @property
    def ratios(self) -> Floats:
        """Frequencies of the lines relative to the first, shape (L,)."""
        return np.array([force.omega / self.omega for force in self.mechanism.forces])

    def embedded(self, x_and_v: Floats, theta: Floats) -> Floats:
        """Coordinates y, shape (..., D), of (x, v) (..., 2n) at phases (...).

        A massless coordinate has 1 in place of its velocity, which is not read.
        """
        n, lines = self.degrees, len(self.mechanism.forces)
        y = np.empty((*x_and_v.shape[:-1], 2 * (n + lines)))
        y[..., 0 : 2 * n : 2] = x_and_v[..., :n]
        y[..., 1 : 2 * n : 2] = x_and_v[..., n:] / self.scale
        for line, ratio in enumerate(self.ratios):
            y[..., 2 * (n + line)] = np.sin(ratio * theta)
            y[..., 2 * (n + line) + 1] = np.cos(ratio * theta)
        y[..., [2 * i + 1 for i in self.massless]] = 1.0
        return y

    def largest(self, moved: Floats) -> Floats:
        """Bounds of the coordinates y, shape (D,), where (x, v) take the values (..., 2n) in rows."""
        n, most = self.degrees, np.ones(2 * (self.degrees + len(self.ratios)))
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
        return STEP_ANGLE / self.modes[mode].fastest(2 * self.degrees)

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

    def _fly(
        self, states: Floats, modes: Sequence[int], windows: list[int], at: Floats, window: float
    ) -> Floats:
        numbers = [self.mode_number(mode) for mode in modes]
        return np.asarray(self.kernel.fly(states, numbers, windows, at, window))

    def mode_number(self, mode: int) -> int:
        """Number of a mode in the kernel."""
        return list(self.modes).index(mode)

    def sampled(self, states: Floats, durations: Floats, modes: Sequence[int] = ()) -> Floats:
        """(x, v) at the start of each segment and at the nodes within its flight, (k, 2n)."""
        w, values = self.flights(states, durations, modes)
        since = w.start[:, None] + (1.0 + nodes(WINDOW_NODES)) * (w.length / 2.0)
        within = values[since <= durations[w.segment][:, None]]
        return np.vstack([states[:, : 2 * self.degrees], within])


def _contiguous(a: ArrayLike) -> Floats:
    return np.ascontiguousarray(a, dtype=float)


def _array(values: Vector | list[Vector]) -> Floats:
    """Array of numbers or jets: f, f', f'', f''' along the first axis."""
    shape, flat = [len(values)], cast(list[Any], values)
    if isinstance(flat[0], list):
        shape, flat = [len(flat), len(flat[0])], [x for row in flat for x in row]
    orders = np.zeros((len(PARAMETER_ORDERS), len(flat)))
    orders[0] = [x.value if isinstance(x, Jet) else x for x in flat]
    for i, x in enumerate(flat):
        if isinstance(x, Jet):
            coefficients = x.coefficients
            orders[:, i] = [coefficients[k] for k in PARAMETER_ORDERS]
    return orders.reshape(-1, *shape)


Push = tuple[Floats, Sequence[float], Floats]  # impulse, restitutions at both limits, kick


class _Ends:
    """Limits of the guards of all modes, as the kernel takes them."""

    def __init__(self, pieces: Piecewise) -> None:
        self.pieces = pieces
        self.known: dict[End, int] = {}
        self.laws: list[tuple[Floats, Floats, Floats, Floats, Floats, int, bool]] = []
        self.still = _array([0.0] * pieces.size)
        self.no_push: Push = self.still, (0.0, 0.0), self.still
        self.pushes: list[Push] = [
            (
                _array([x / law.mobilities[i] for x in law.impulse]),
                (law.restitution_lower, law.restitution_upper),
                self.still,
            )
            for i, law in enumerate(pieces.laws())
        ]

    def of(self, mode: Mode, number: int) -> Iterator[GuardRow]:
        """Guards of a mode with this number in the kernel, whose limits are kept."""
        for i, guard in enumerate(mode.guards):
            kind, push = (FORCE_WATCH, self.no_push) if guard.side else (GAP_WATCH, self.pushes[i])
            yield self._keep(End(i, 0, mode.code, kind), guard, push, number)
        contacts = len(mode.guards)
        for j, watch in enumerate(mode.watches):
            if not watch.held:
                name, reset = End(contacts + watch.element, 0, mode.code, j), watch.reset
                kick = _array(self.pieces.resets[reset][1]) if reset >= 0 else self.still
                yield self._keep(name, watch, (self.still, (0.0, 0.0), kick), number)

    def add_phase(self, mode: Mode, number: int) -> None:
        """Ends of flights in a mode at which nothing happens."""
        m = self.pieces.mechanism
        if not m.forces:
            return
        sine = [0.0] * self.pieces.size
        sine[2 * m.degrees] = 1.0
        law = _array(sine), _array([0.0]), self.still, _array([0.0]), self.still, number, False
        for side in (-1, 1):
            self.known[End(PHASE, side, mode.code, PHASE_WATCH)] = len(self.laws)
            self.laws.append(law)

    def add_chatter(self, mode: Mode, resting: set[Stop]) -> None:
        """Ends of chatter in a mode, at stops that are rested on in others."""
        for contact, side in resting:
            end = End(contact, side, mode.code)
            if end in self.known:
                self.known[end._replace(watch=CHATTER_WATCH)] = len(self.laws)
                self.laws.append((*self.laws[self.known[end]][:-1], True))

    def forgotten(self, mode: Mode) -> int:
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

    def _keep(self, name: End, of: Guard | Watch, push: Push, number: int) -> GuardRow:
        (impulse, restitutions, kick), rows = push, _array(of.row)
        limits = of.lower, of.upper
        for side, limit, restitution in zip((-1, 1), limits, restitutions, strict=True):
            if not is_infinite(limit):
                self.known[name._replace(side=side)] = len(self.laws)
                place = _array([limit - of.gain])
                law = rows, place, impulse, _array([restitution]), kick, number, False
                self.laws.append(law)
        return GuardRow(name.contact, name.watch, rows[0], _value(of.gain), *map(_value, limits))


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
        first, other = _array([varied.omega, line.omega]).T
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


def check_rigid(system: System) -> Mechanism:
    """The mechanism of a system, refused where it has more than rigid stops that stand still."""
    m = mechanism_of(system)
    if needs_elements(m):
        raise InvalidParameterError(
            f"system = {shown(system)}: circles are found for rigid stops that stand still, with "
            "symmetric matrices. Take find_orbits, find_orbit, continue_orbit, simulate, classify."
        )
    return m


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
    pieces = Piecewise(m)
    ends, modes, flows = _Ends(pieces), {}, []
    contacts = len(m.rigid_stops)
    resting = {stop for code in codes for stop in closed_from_code(code, contacts)}
    for number, code in enumerate(codes):
        mode = pieces.prescribed_mode(code)
        flow = cast(Any, mode.coordinates.flow)
        b, constant = _array(flow["b"]), _array(flow["constant"])
        guards, speeds = tuple(ends.of(mode, number)), _speeds(pieces, mode)
        ends.add_chatter(mode, resting)
        ends.add_phase(mode, number)
        modes[code] = Numbers(
            b[0], constant[0], guards, ends.forgotten(mode), speeds, tuple(pieces.light)
        )
        step = STEP_ANGLE / modes[code].fastest(2 * m.degrees)
        flows.append((b, constant, step))
    rate = _value(pieces.rate)
    if pieces.light:  # their rates are not among those of the masses
        rate = max(rate, *(mode.fastest(2 * m.degrees) for mode in modes.values()))
    omega = _array([m.omega])[:, 0]
    kernel = _kernel.Prescribed(
        degrees=m.degrees, ratios=[_value(force.omega) / omega[0] for force in m.forces],
        rate=pieces.scale, omega=omega, modes=flows, stops=ends.laws,
    )  # fmt: skip
    return Prescribed(
        system, parameter, m.degrees, float(omega[0]), omega, rate, pieces.scale,
        modes, ends.known, kernel,
    )  # fmt: skip


def _speeds(pieces: Piecewise, mode: Mode) -> Floats:
    """Velocities of the massless coordinates in a mode, shape (light, D)."""
    rows = [mode.coordinates.to_v[i] for i in pieces.light]
    return _array(rows)[0] if rows else np.zeros((0, pieces.size))


_cached = lru_cache(maxsize=4096)(_compile)  # a few kilobytes each
