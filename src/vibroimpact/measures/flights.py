"""Flights of motions in closed form, with derivatives by a parameter.

Method      In a mode the coordinates y (compile/piecewise.py), with a last entry 1, follow
                Y' = H Y,      (dY/dp)' = H dY/dp + H_p Y                                        (1)
            at a fixed time since the flight began; both come from one exponential matrix of
            [[H, 0], [H_p, H]], at the Chebyshev nodes of windows of WINDOW_RADIANS radians of the fastest
            rate, over which series have fallen to rounding at WINDOW_NODES terms. What is measured is a row
            on Y in every mode, a *signal* u:
              - its extrema are the zeros of u', eigenvalues of the colleague matrix, and the ends
                of flights; by the envelope theorem their derivative is the partial one at a fixed
                time, at the end of a flight with u' times the derivative of the flight time;     (2)
              - integrals of products are those of polynomials of degree 2 WINDOW_NODES - 2: Gauss's rule
                with WINDOW_NODES points is exact.                                                  (3)
Accuracy    of values and derivatives, some 1e-13 of the largest value of the signal
Reference   Boyd, Solving Transcendental Equations (2014); theory.md, "Periodic orbits"
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.polynomial import chebyshev, legendre

from vibroimpact._core.chebyshev import fitted, nodes, real_zeros_of
from vibroimpact._core.exponential import exponentials
from vibroimpact._core.types import Count, Flags, Floats, Integers
from vibroimpact._core.windows import Windows, values_at
from vibroimpact._kernel import Jet
from vibroimpact.compile.along import numbers_along
from vibroimpact.compile.coordinates import units_of
from vibroimpact.compile.piecewise import Piecewise
from vibroimpact.compile.prescribed import FLAT_OF_LARGEST_RATE, WINDOW_NODES, WINDOW_RADIANS
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import expanded
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.results.result import sized

# Longer steps, relative to a window, are those of two extrema about to merge.
POLISHING_STEP_OF_WINDOW = 1e-5
WHOLE_TURNS_WITHIN = 1e-9  # a number of turns that is so near to a whole one is one
SPARE_GAUSS_POINTS = 12  # Gauss's rule has so many points beyond those that resolve an oscillation


def jet(x: float | Jet, by: float = 0.0) -> Jet:
    """A number with its derivative by the parameter; a jet as it is."""
    return x if isinstance(x, Jet) else Jet.of(x, [x, by, *[0.0] * 6])


def derivative(x: Jet) -> float:
    """Derivative of a number by the parameter."""
    return x.coefficients[1]


@dataclass(frozen=True, slots=True, eq=False)
class Dual:
    """An array with its derivative by the parameter: entries of rows, or a number of each of several motions."""

    value: Floats
    by: Floats

    __array_ufunc__: ClassVar[None] = None  # numbers of numpy leave arithmetic to it

    def __iter__(self) -> Iterator[Floats]:
        return iter((self.value, self.by))

    def __getitem__(self, at: Any) -> Dual:
        return Dual(self.value[at], self.by[at])

    def __add__(self, other: Dual | float) -> Dual:
        x = _with_zero(other)
        return Dual(self.value + x.value, self.by + x.by)

    def __sub__(self, other: Dual | float) -> Dual:
        return self + -_with_zero(other)

    def __mul__(self, other: Dual | Floats | float) -> Dual:
        x = _with_zero(other)
        return Dual(self.value * x.value, self.by * x.value + self.value * x.by)

    def __truediv__(self, other: Dual | float) -> Dual:
        x = _with_zero(other)
        with np.errstate(divide="ignore", invalid="ignore"):
            value = self.value / x.value
            return Dual(value, (self.by - value * x.by) / x.value)

    def __rtruediv__(self, other: Floats | float) -> Dual:
        return _with_zero(other) / self

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.by)

    __radd__, __rmul__ = __add__, __mul__

    def sqrt(self) -> Dual:
        """Root of each entry; of zero it has no derivative."""
        root = np.sqrt(self.value)
        with np.errstate(divide="ignore", invalid="ignore"):
            return Dual(root, self.by / (2.0 * root))

    def where(self, mask: Flags, other: Dual) -> Dual:
        """Own entries where a mask is true, those of another elsewhere."""
        return Dual(*(np.where(mask, a, b) for a, b in zip(self, other, strict=True)))


def _with_zero(x: Dual | Floats | float) -> Dual:
    """A number as one with the derivative zero."""
    return x if isinstance(x, Dual) else Dual(np.asarray(x, dtype=float), np.zeros(np.shape(x)))


def dual(entries: Any) -> Dual:
    """Value and derivative of nested lists of numbers and jets."""
    given = np.array(entries, dtype=object)
    flat = [jet(x if isinstance(x, Jet) else float(x)).coefficients[:2] for x in given.ravel()]
    both = np.array(flat, dtype=float).reshape(*given.shape, 2)
    return Dual(both[..., 0], both[..., 1])


class _Mode(NamedTuple):
    """A mode of each of k systems."""

    flow: Dual  # H of (1), shape (k, D + 1, D + 1)
    places: Dual  # rows on Y that give the coordinates, shape (k, n, D + 1), and the velocities
    speeds: Dual
    units: Floats  # shape (k, D + 1)


class Rows:
    """Rows on Y of what can be measured in each mode of systems, with their derivatives.

    Parameters
    ----------
    system, parameter
        The system, and the parameter that is differentiated by, "" for none.
    values
        Values of the parameter, one for each system; by default the one system is that given.
    """

    def __init__(self, system: System, parameter: str = "", values: Floats | None = None) -> None:
        self.system, self.parameter, self.values = system, parameter, values
        self.mechanism: Mechanism = mechanism_of(system)
        self.count = 1 if values is None else len(values)
        self.size = 2 * (self.mechanism.degrees + len(self.mechanism.forces))
        self._known: dict[Hashable, Dual] = {}
        self._modes: dict[int, _Mode] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies, in other processes too, are made again."""
        return Rows, (self.system, self.parameter, self.values)

    @cached_property
    def _pieces(self) -> Piecewise:
        """The one system, compiled."""
        parameter = self.parameter
        return Piecewise(expanded(self.system, parameter) if parameter else self.mechanism)

    def numbers(self, key: Hashable, make: Callable[[Piecewise], Any]) -> Dual:
        """Numbers that are made of every compiled system, shape (k, ...); they are kept under a key."""
        if key not in self._known:
            self._known[key] = self._made(make)
        return self._known[key]

    def _made(self, make: Callable[[Piecewise], Any]) -> Dual:
        if self.values is None:
            return dual(make(self._pieces))[None]
        shape: tuple[int, ...] = ()

        def flat(m: Mechanism) -> list[float]:
            nonlocal shape
            entries = np.array(make(Piecewise(m)), dtype=object)
            shape = entries.shape
            return cast(list[float], entries.ravel().tolist())

        value, by = numbers_along(self.system, self.parameter, self.values.tolist(), flat)
        return Dual(value.reshape(-1, *shape), by.reshape(-1, *shape))

    @cached_property
    def _base(self) -> Dual:
        """Scale, rate and frequencies of each system."""
        return self.numbers(
            "base", lambda pieces: [pieces.scale, pieces.rate, pieces.mechanism.omega, *pieces.omegas]
        )  # fmt: skip

    @property
    def rate(self) -> float:
        """Bound of the rates of all motions."""
        return float(self._base.value[:, 1].max())

    @property
    def omega(self) -> Dual:
        """Frequency of the first forcing line, shape (k,)."""
        return self._base[:, 2]

    @property
    def omegas(self) -> Dual:
        """Frequency of each forcing line, shape (k, lines)."""
        return self._base[:, 3:]

    def _mode(self, code: int) -> _Mode:
        if code not in self._modes:
            n, whole = self.mechanism.degrees, self.numbers(("mode", code), partial(_of_mode, code))
            flow, x, v = (whole[:, at] for at in np.split(np.arange(whole.value.shape[1] - 1),
                                                          [self.size + 1, self.size + 1 + n]))  # fmt: skip
            self._modes[code] = _Mode(flow, x, v, whole.value[:, -1])
        return self._modes[code]

    def flow(self, code: int) -> Dual:
        """Matrix H of (1), shape (k, D + 1, D + 1)."""
        return self._mode(code).flow

    def units(self, code: int) -> Floats:
        """Units of Y, powers of two, in which a flow is as large in all units of the user, shape (k, D + 1)."""
        return self._mode(code).units

    def moved(self, code: int, row: Floats, order: int) -> Dual:
        """Row that gives ``row . x``, ``row . v`` or ``row . a``, by its order 0, 1 or 2."""
        mode = self._mode(code)
        plain = Dual(*(row @ part for part in (mode.speeds if order else mode.places)))
        return _on_flow(plain, mode.flow) if order > 1 else plain

    def force(self, code: int, part: int) -> Dual:
        """Force of a contact or element along its row."""
        return self.numbers(("force", code, part), lambda pieces: pieces.force_rows(code)[part])

    def work_speed(self, code: int, element: int) -> Dual:
        """Speed at which an element's force works on the motion."""
        return self.numbers(
            ("work", code, element), lambda pieces: pieces.mode(code).work[element].speed
        )

    def gap(self, _: int, part: int) -> Dual:
        """Row of the gap, ``row . x`` relative to the stop, in every mode."""
        return self.numbers(("gap", part), lambda pieces: pieces.gap_row(part))

    def gap_rate(self, code: int, part: int) -> Dual:
        """Rate of the gap in a mode."""
        return _on_flow(self.gap(code, part), self.flow(code))

    def embedded(self, states: Floats, by: Floats, system: Integers) -> Dual:
        """Y of states (x, v, theta) of systems by number, shape (m, D + 1), and its derivative from theirs."""
        n, light = self.mechanism.degrees, self.mechanism.massless
        y = Dual(*(np.zeros((len(states), self.size + 1)) for _ in range(2)))
        base = self._base.value[system]
        for part, given in zip(y, (states, by), strict=True):
            part[:, 0 : 2 * n : 2] = given[:, :n]
            part[:, 1 : 2 * n : 2] = given[:, n : 2 * n] / base[:, :1]
        for i in light:
            y.value[:, 2 * i + 1], y.by[:, 2 * i + 1] = 1.0, 0.0
        for line in range(len(self.mechanism.forces)):
            ratio = base[:, 3 + line] / base[:, 3]
            sine, cosine = np.sin(ratio * states[:, -1]), np.cos(ratio * states[:, -1])
            at, turn = 2 * (n + line), ratio * by[:, -1]
            y.value[:, at], y.value[:, at + 1] = sine, cosine
            y.by[:, at], y.by[:, at + 1] = cosine * turn, -sine * turn
        y.value[:, -1] = 1.0
        return y

    def impact(self, contact: int, side: int) -> Dual:
        """Impulse of an impact per closing speed, and energy lost per square of it, shape (k, 2).

        A soft stop, which is met without an impulse, has zeros.
        """
        if contact >= len(self.mechanism.rigid_stops):
            return Dual(*(np.zeros((self.count, 2)) for _ in range(2)))

        def law(pieces: Piecewise) -> list[float]:
            of = pieces.laws()[contact]
            r = of.restitution_upper if side > 0 else of.restitution_lower
            m = of.mobilities[contact]
            return [(1.0 + r) / m, (1.0 - r * r) / (2.0 * m)]

        return self.numbers(("impact", contact, side), law)


def _of_mode(code: int, pieces: Piecewise) -> list[list[float]]:
    """H, the rows of coordinates and velocities, and the units of Y in a mode, one below the other."""
    at = pieces.prescribed_mode(code).coordinates
    flow = cast(dict[str, Any], at.flow)
    h = [[*row, c] for row, c in zip(flow["b"], flow["constant"], strict=True)]
    rows = [[*row, 0.0] for row in (*at.to_x, *at.to_v)]
    units = units_of(pieces.mechanism, flow, pieces.rate)
    return [*h, [0.0] * (pieces.size + 1), *rows, [*units, 1.0]]


def _on_flow(row: Dual, flow: Dual) -> Dual:
    """Rows (k, D + 1) times matrices (k, D + 1, D + 1)."""
    once = np.einsum("ki,kij->kj", row.value, flow.value)
    by = np.einsum("ki,kij->kj", row.by, flow.value) + np.einsum("ki,kij->kj", row.value, flow.by)
    return Dual(once, by)


@lru_cache(maxsize=64)
def _cached_rows(system: Any, parameter: str) -> Rows:
    return Rows(system, parameter)


def rows_of(system: System, parameter: str = "") -> Rows:
    """:class:`Rows` of a system; those of the latest ones are kept."""
    try:
        return _cached_rows(cast(Hashable, system), parameter)
    except TypeError:  # a system that cannot be hashed
        return Rows(system, parameter)


class Struck(NamedTuple):
    """Impacts at ends of flights, in order: numbers of the flights, and stops."""

    flights: Integers
    stops: list[Stop]


@dataclass(frozen=True, eq=False)
class Flights:
    """Flights of a motion, one after the other, in order; or those of several motions, each of its own system."""

    rows: Rows  # Rows of their systems
    # (x, v, theta) where each flight begins, shape (m, 2n + 1), and flight times (m,)
    states: Floats = field(metadata=sized("flight", "entry"))
    durations: Floats = field(metadata=sized("flight"))
    codes: tuple[Count, ...] = field(
        metadata=sized("flight")
    )  # code of the mode of each flight (compile/piecewise.py)
    struck: Struck  # the impacts, meetings with soft stops included
    # their derivatives by the parameter of `rows`; zero without one
    states_by: Floats = field(metadata=sized("flight", "entry"))
    durations_by: Floats = field(metadata=sized("flight"))
    of: Integers = field(metadata=sized("flight"))  # number of the motion of each flight, rising
    periodic: bool = True  # whether the motion repeats after them

    @cached_property
    def period(self) -> Dual:
        """Time from the first to the end of the last flight of each motion, shape (k,)."""
        return self.summed(Dual(self.durations, self.durations_by), self.of)

    @property
    def omega(self) -> Dual:
        """Frequency of the first forcing line of each motion, shape (k,)."""
        return self.rows.omega

    def summed(self, terms: Dual, of: Integers) -> Dual:
        """Sum of the terms of each motion, of these numbers; shape (k,)."""
        return Dual(*(np.bincount(of, part, self.rows.count).astype(float) for part in terms))

    def extreme(self, numbers: Dual, of: Integers, *, largest: bool = True) -> Dual:
        """The largest or the smallest number of each motion, of these numbers, 0 where there is none; shape (k,)."""
        found = Dual(*(np.zeros(self.rows.count) for _ in range(2)))
        places = _extreme_of(numbers.value, of, largest=largest)
        found.value[of[places]], found.by[of[places]] = numbers[places]
        return found

    @cached_property
    def windows(self) -> Windows:
        """Windows that cover the flights."""
        length = min(WINDOW_RADIANS / self.rows.rate, float(self.durations.max())) or 1.0
        return Windows.over(self.durations, length)

    @cached_property
    def motion_of_window(self) -> Integers:
        """Number of the motion of each window, shape (w,)."""
        found: Integers = self.of[self.windows.segment]
        return found

    @cached_property
    def y(self) -> Dual:
        """Chebyshev series of Y in the windows, shape (WINDOW_NODES, w, D + 1)."""
        w, size = self.windows, self.rows.size + 1
        values = np.empty((WINDOW_NODES, len(w.segment), 2 * size))
        begun = np.hstack([*self.rows.embedded(self.states, self.states_by, self.of)])
        modes = np.array(self.codes)
        offsets = (1.0 + nodes(WINDOW_NODES)) * (w.length / 2.0)
        for code in np.unique(modes):
            flights = np.flatnonzero(modes == code)
            values_of_mode = _propagated(
                self.rows.flow(int(code)), self.rows.units(int(code)), begun[flights], self.of[flights],
                w.counts[flights], np.append(offsets, w.length),
            )  # fmt: skip
            for nth, part in enumerate(values_of_mode):
                there = flights[w.counts[flights] > nth]
                values[:, w.first[there] + nth] = part
        series = fitted(values.reshape(WINDOW_NODES, -1)).reshape(values.shape)
        return Dual(series[..., :size], series[..., size:])

    def signal(self, row: Callable[[int], Dual]) -> Signal:
        """Signal that a row on Y of each system in each mode, by its code, gives along the motions."""
        codes, of = np.array(self.codes)[self.windows.segment], self.motion_of_window
        across = Dual(*(np.empty((len(of), self.rows.size + 1)) for _ in range(2)))
        for code in np.unique(codes):
            there = codes == code
            for part, given in zip(across, row(int(code)), strict=True):
                part[there] = given[of[there]]
        u = np.einsum("nwd,wd->nw", self.y.value, across.value)
        u_by = np.einsum("nwd,wd->nw", self.y.by, across.value)
        u_by += np.einsum("nwd,wd->nw", self.y.value, across.by)
        return Signal(self, u, u_by)

    def state_at(self, time: float) -> Floats:
        """(x, v, theta) of the one motion at a time since its start, shape (2n + 1,)."""
        ends = np.cumsum(self.durations)
        flight = min(int(np.searchsorted(ends, time)), len(ends) - 1)
        since = time - (ends[flight] - self.durations[flight])
        w, n = self.windows, self.rows.mechanism.degrees
        window = w.first[flight] + min(int(since / w.length), w.last[flight] - w.first[flight])
        y = chebyshev.chebval(w.place(window, since), self.y.value[:, window])
        moving = self.rows.moved
        v = [moving(self.codes[flight], row, 1).value[0] @ y for row in np.eye(n)]
        phase = self.states[flight, -1] + self.omega.value[0] * since
        return np.array([*y[0 : 2 * n : 2], *v, phase])

    def closing(self) -> Dual:
        """Closing speed of each impact, shape (impacts,)."""
        w, flights = self.windows, self.struck.flights
        last, at = w.last[flights], w.ends[flights]
        y = Dual(*(values_at(part, last, at[:, None]) for part in self.y))
        rate = self._at_impacts(self.rows.gap_rate, y)
        further = self._at_impacts(
            lambda code, part: _on_flow(self.rows.gap_rate(code, part), self.rows.flow(code)), y
        )
        moves = rate.by + further.value * self.durations_by[flights]
        side = np.array([float(stop.side) for stop in self.struck.stops])
        return Dual(side * rate.value, side * moves)

    def _at_impacts(self, row: Callable[[int, int], Dual], y: Dual) -> Dual:
        """Rows of the contacts in the modes before impacts, on Y there."""
        flights = self.struck.flights
        across = Dual(*(np.empty((len(flights), self.rows.size + 1)) for _ in range(2)))
        kinds = [
            (self.codes[k], stop.contact)
            for k, stop in zip(flights, self.struck.stops, strict=True)
        ]
        for kind in {*kinds}:
            there = np.array([one == kind for one in kinds])
            for part, given in zip(across, row(*kind), strict=True):
                part[there] = given[self.of[flights[there]]]
        return Dual(
            np.einsum("md,md->m", across.value, y.value),
            np.einsum("md,md->m", across.value, y.by) + np.einsum("md,md->m", across.by, y.value),
        )


def _extreme_of(values: Floats, of: Integers, *, largest: bool) -> Integers:
    """Place of the largest or the smallest value of each number in ``of``, the first of equal ones; NaN before all."""
    keys = np.where(np.isnan(values), -np.inf, -values if largest else values)
    order = np.lexsort((keys, of))
    first = np.flatnonzero(np.diff(of[order], prepend=-1))
    places: Integers = order[first]
    return places


def _propagated(
    flow: Dual, units: Floats, begun: Floats, of: Integers, counts: Integers, times: Floats
) -> list[Floats]:
    """(Y, dY/dp) at times in each window of flights in one mode, of systems by number, of those that have it.

    They are computed in these units, dY/dp with p in one that makes both parts of the flow alike.
    """
    size = units.shape[1]
    varied = bool(begun[:, size:].any() or flow.by.any())
    value, by = (part / units[:, :, None] * units[:, None, :] for part in flow)
    if not varied:
        matrices, begun = exponentials(value, times), begun[:, :size] / units[of]
    else:
        largest, change = (np.abs(part).max(axis=(1, 2)) for part in (value, by))
        change = change / np.where(largest > 0.0, largest, np.inf)
        unit = np.ldexp(1.0, np.frexp(change)[1] - 1)  # a power of two
        units = np.hstack([units, units * np.where(change > 0.0, unit, 1.0)[:, None]])
        whole = np.zeros((len(flow.value), 2 * size, 2 * size))
        whole[:, :size, :size] = whole[:, size:, size:] = flow.value
        whole[:, size:, :size] = flow.by
        matrices = exponentials(whole / units[:, :, None] * units[:, None, :], times)
        begun = begun / units[of]
    out = []
    for nth in range(int(counts.max())):
        kept = counts[counts >= nth] > nth
        begun, of = begun[kept], of[kept]
        slot = np.arange(len(of)) - np.searchsorted(of, of)
        apart = np.zeros((len(matrices), int(slot.max(initial=0)) + 1, begun.shape[1]))
        apart[of, slot] = begun  # flights of each system
        values = np.einsum("knij,kfj->nkfi", matrices[:, :-1], apart)[:, of, slot] * units[of]
        if not varied:
            values = np.concatenate([values, np.zeros_like(values)], axis=2)
        out.append(values)
        begun = np.einsum("kij,kfj->kfi", matrices[:, -1], apart)[of, slot]
    return out


@lru_cache(maxsize=32)
def _gauss(count: int) -> tuple[Floats, Floats]:
    return legendre.leggauss(count)


@dataclass(frozen=True, eq=False)
class Signal:
    """A function of time along a motion: Chebyshev series in every window, (WINDOW_NODES, w) each."""

    flights: Flights
    series: Floats = field(metadata=sized("node", "window"))
    series_by: Floats = field(metadata=sized("node", "window"))

    def extremes(self) -> tuple[Dual, Dual]:
        """Smallest and largest value of each motion, with their derivatives, by (2); shape (k,) each."""
        u, of, _ = self._extrema()
        low, high = (self.flights.extreme(u, of, largest=largest) for largest in (False, True))
        return low, high

    def place(self, *, largest: bool) -> float:
        """Time since the start of the one motion at which it is largest, or smallest."""
        u, of, times = self._extrema()
        return float(times[_extreme_of(u.value, of, largest=largest)[0]])

    def _extrema(self) -> tuple[Dual, Integers, Floats]:
        """Values at extrema and at ends of flights, numbers of their motions, and times."""
        w = self.flights.windows
        slope: Floats = np.asarray(chebyshev.chebder(self.series, axis=0) * (2.0 / w.length), float)
        at, x = real_zeros_of(slope, FLAT_OF_LARGEST_RATE)
        at, x = w.inside(at, _polished(slope, at, x))
        at = np.concatenate([at, w.first, w.last])
        x = np.concatenate([x, np.full(len(w.first), -1.0), w.ends])
        moved = np.zeros(len(at))
        late = values_at(slope, w.last, w.ends)
        moved[len(at) - len(late) :] = late * self.flights.durations_by
        u = Dual(values_at(self.series, at, x), values_at(self.series_by, at, x) + moved)
        return u, self.flights.motion_of_window[at], w.times(at, x)

    def at(self, times: Floats) -> Floats:
        """Values at times since the start of the motion."""
        return values_at(self.series, *self.flights.windows.at(times))

    def mean_product(self, other: Signal) -> Dual:
        """Mean of the product of two signals over each motion, by (3); shape (k,)."""
        points = self._points(WINDOW_NODES)
        f, g = self._at(points.x), other._at(points.x)
        return self._integral(points, f * g, self._ends() * other._ends()) / self.flights.period

    def _integral(self, points: _Points, values: Dual, ends: Floats) -> Dual:
        """Integral over each motion of a function by its values at points, and at ends of flights."""
        flights = self.flights
        parts = (np.sum(points.weights * part, axis=1) for part in values)
        whole = flights.summed(Dual(*parts), flights.motion_of_window)
        late = ends * flights.durations_by
        return whole + flights.summed(Dual(np.zeros_like(late), late), flights.of)

    def harmonic(self, order: float) -> Dual:
        """Amplitude of the part of a frequency, in units of the first line's, of each motion; shape (k,).

        A periodic motion has none of a frequency that is no multiple of its own.
        """
        flights, w, of = self.flights, self.flights.windows, self.flights.motion_of_window
        omega = flights.omega
        turns = order * omega.value * flights.period.value / (2.0 * math.pi)
        turn = order * float(omega.value.max()) * w.length / 2.0
        points = self._points(WINDOW_NODES + math.ceil(turn) + SPARE_GAUSS_POINTS)
        f = self._at(points.x)
        since = w.start[:, None] + w.length * (1.0 + points.x) / 2.0
        phase = order * Dual(
            *(states[w.segment, -1:] + rate[of, None] * since
              for states, rate in ((flights.states, omega.value), (flights.states_by, omega.by)))
        )  # fmt: skip
        at_end = order * (flights.states[:, -1] + omega.value[flights.of] * flights.durations)
        cosine, sine = np.cos(phase.value), np.sin(phase.value)
        real, imaginary = (
            self._integral(points, f * Dual(wave, slope * phase.by), self._ends() * last)
            for wave, slope, last in (
                (cosine, -sine, np.cos(at_end)), (sine, cosine, np.sin(at_end))
            )
        )  # fmt: skip
        found = 2.0 * (real * real + imaginary * imaginary).sqrt() / flights.period
        whole = np.abs(turns - np.round(turns)) <= WHOLE_TURNS_WITHIN * turns
        none = Dual(np.zeros_like(turns), np.zeros_like(turns))
        return found.where(whole, none) if flights.periodic else found

    def _points(self, count: int) -> _Points:
        w = self.flights.windows
        x, weights = _gauss(count)
        until = np.ones(len(w.segment))
        until[w.last] = w.ends
        half = (until[:, None] + 1.0) / 2.0
        return _Points(-1.0 + half * (1.0 + x), half * weights * (w.length / 2.0))

    def _at(self, x: Floats) -> Dual:
        """Values at points (w, k) of the windows."""
        terms = chebyshev.chebvander(x, WINDOW_NODES - 1)
        parts = (np.einsum("wkn,nw->wk", terms, part) for part in (self.series, self.series_by))
        return Dual(*parts)

    def _ends(self) -> Floats:
        """Values at the ends of the flights."""
        return values_at(self.series, self.flights.windows.last, self.flights.windows.ends)


class _Points(NamedTuple):
    """Points of Gauss's rule in every window (w, k), in [-1, 1], and their weights in time."""

    x: Floats
    weights: Floats


def _polished(series: Floats, windows: Integers, x: Floats) -> Floats:
    """Zeros of series after a step of Newton's method, where it is as small as FLAT_OF_LARGEST_RATE makes it."""
    curved = values_at(np.asarray(chebyshev.chebder(series, axis=0), float), windows, x)
    with np.errstate(divide="ignore", invalid="ignore"):
        step = values_at(series, windows, x) / curved
    return x - np.where(np.abs(step) <= POLISHING_STEP_OF_WINDOW, step, 0.0)
