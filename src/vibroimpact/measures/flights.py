"""Flights of a motion in closed form, with derivatives by a parameter.

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
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.polynomial import chebyshev, legendre

from vibroimpact._core.chebyshev import fitted, nodes, real_zeros_of
from vibroimpact._core.exponential import exponentials
from vibroimpact._core.scalars import numeric_value, rounded_down
from vibroimpact._core.types import Count, Floats, Integers
from vibroimpact._core.windows import Windows, values_at
from vibroimpact._kernel import Jet
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


class Dual(NamedTuple):
    """An array with its derivative by the parameter; numbers are jets."""

    value: Floats
    by: Floats

    def __matmul__(self, other: Dual) -> Dual:
        return Dual(self.value @ other.value, self.by @ other.value + self.value @ other.by)


def dual(entries: Any) -> Dual:
    """Value and derivative of nested lists of numbers and jets."""
    given = np.array(entries, dtype=object)
    flat = [jet(x if isinstance(x, Jet) else float(x)).coefficients[:2] for x in given.ravel()]
    both = np.array(flat, dtype=float).reshape(*given.shape, 2)
    return Dual(both[..., 0], both[..., 1])


class Rows:
    """Rows on Y of what can be measured in each mode of a system, with their derivatives.

    Parameters
    ----------
    system, parameter
        The system, and the parameter that is differentiated by, "" for none.
    """

    def __init__(self, system: System, parameter: str = "") -> None:
        self.system, self.parameter = system, parameter
        self.mechanism: Mechanism = mechanism_of(system)
        varied = expanded(system, parameter) if parameter else self.mechanism
        self.varied, self.pieces = varied, Piecewise(varied)
        self.rate = numeric_value(self.pieces.rate)
        self._modes: dict[int, Any] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies, in other processes too, are made again."""
        return Rows, (self.system, self.parameter)

    def _mode(self, code: int) -> Any:
        if code not in self._modes:
            self._modes[code] = self.pieces.mode(code)
        return self._modes[code]

    def flow(self, code: int) -> Dual:
        """Matrix H of (1), shape (D + 1, D + 1)."""
        flow: Any = self._mode(code).coordinates.flow
        size = self.pieces.size
        out = Dual(np.zeros((size + 1, size + 1)), np.zeros((size + 1, size + 1)))
        for part, b, c in zip(out, dual(flow["b"]), dual(flow["constant"]), strict=True):
            part[:size, :size], part[:size, size] = b, c
        return out

    def units(self, code: int) -> Floats:
        """Units of Y, powers of two, in which a flow is as large in all units of the user, shape (D + 1,)."""
        whole = self.flow(code).value
        flow = {"b": whole[:-1, :-1].tolist(), "constant": whole[:-1, -1].tolist()}
        return np.array([*units_of(self.mechanism, flow, self.rate), 1.0])

    def moved(self, code: int, row: Floats, order: int) -> Dual:
        """Row that gives ``row . x``, ``row . v`` or ``row . a``, by its order 0, 1 or 2."""
        coordinates = self._mode(code).coordinates
        across = dual(coordinates.to_v if order else coordinates.to_x)
        plain = Dual(*(np.append(row @ part, 0.0) for part in across))
        return plain @ self.flow(code) if order > 1 else plain

    def force(self, code: int, part: int) -> Dual:
        """Force of a contact or element along its row."""
        return dual(self.pieces.force_rows(code)[part])

    def work_speed(self, code: int, element: int) -> Dual:
        """Speed at which an element's force works on the motion."""
        return dual(self._mode(code).work[element].speed)

    def gap(self, _: int, part: int) -> Dual:
        """Row of the gap, ``row . x`` relative to the stop, in every mode."""
        return dual(self.pieces.gap_row(part))

    def gap_rate(self, code: int, part: int) -> Dual:
        """Rate of the gap in a mode."""
        return self.gap(code, part) @ self.flow(code)

    def embedded(self, states: Floats, by: Floats) -> Dual:
        """Y of states (x, v, theta), shape (m, D + 1), and its derivative from theirs."""
        n, light = self.mechanism.degrees, self.mechanism.massless
        y = Dual(*(np.zeros((len(states), self.pieces.size + 1)) for _ in range(2)))
        for part, given in zip(y, (states, by), strict=True):
            part[:, 0 : 2 * n : 2] = given[:, :n]
            part[:, 1 : 2 * n : 2] = given[:, n : 2 * n] / self.pieces.scale
        for i in light:
            y.value[:, 2 * i + 1], y.by[:, 2 * i + 1] = 1.0, 0.0
        lines = self.mechanism.forces
        for line, force in enumerate(lines):
            ratio = force.omega / lines[0].omega
            sine, cosine = np.sin(ratio * states[:, -1]), np.cos(ratio * states[:, -1])
            at, turn = 2 * (n + line), ratio * by[:, -1]
            y.value[:, at], y.value[:, at + 1] = sine, cosine
            y.by[:, at], y.by[:, at + 1] = cosine * turn, -sine * turn
        y.value[:, -1] = 1.0
        return y

    def impact(self, contact: int, side: int) -> tuple[Jet, Jet]:
        """Impulse of an impact per closing speed, and energy lost per square of it.

        A soft stop, which is met without an impulse, has zeros.
        """
        if contact >= len(self.mechanism.rigid_stops):
            return jet(0.0), jet(0.0)
        law = self.pieces.laws()[contact]
        r = law.restitution_upper if side > 0 else law.restitution_lower
        m = law.mobilities[contact]
        return jet((1.0 + r) / m), jet((1.0 - r * r) / (2.0 * m))


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
    """Impacts at ends of flights: numbers of the flights, and stops."""

    flights: Integers
    stops: list[Stop]


@dataclass(frozen=True, eq=False)
class Flights:
    """Flights of a motion, one after the other, in order."""

    rows: Rows  # Rows of its system
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
    periodic: bool = True  # whether the motion repeats after them

    @property
    def period(self) -> Jet:
        """Time from the first to the end of the last flight."""
        return jet(float(self.durations.sum()), float(self.durations_by.sum()))

    @property
    def omega(self) -> Jet:
        """Frequency of the first forcing line."""
        return jet(self.rows.varied.omega)

    @cached_property
    def windows(self) -> Windows:
        """Windows that cover the flights."""
        length = min(WINDOW_RADIANS / self.rows.rate, float(self.durations.max())) or 1.0
        return Windows.over(self.durations, length)

    @cached_property
    def y(self) -> Dual:
        """Chebyshev series of Y in the windows, shape (WINDOW_NODES, w, D + 1)."""
        w, size = self.windows, self.rows.pieces.size + 1
        values = np.empty((WINDOW_NODES, len(w.segment), 2 * size))
        begun = self.rows.embedded(self.states, self.states_by)
        modes = np.array(self.codes)
        offsets = (1.0 + nodes(WINDOW_NODES)) * (w.length / 2.0)
        for code in np.unique(modes):
            flights = np.flatnonzero(modes == code)
            values_of_mode = _propagated(
                self.rows.flow(int(code)), self.rows.units(int(code)),
                np.hstack([part[flights] for part in begun]), w.counts[flights], np.append(offsets, w.length),
            )  # fmt: skip
            for nth, part in enumerate(values_of_mode):
                there = flights[w.counts[flights] > nth]
                values[:, w.first[there] + nth] = part
        series = fitted(values.reshape(WINDOW_NODES, -1)).reshape(values.shape)
        return Dual(series[..., :size], series[..., size:])

    def signal(self, row: Callable[[int], Dual]) -> Signal:
        """Signal that a row on Y in each mode, by its code, gives along the motion."""
        table = {code: row(code) for code in {*self.codes}}
        by_window = [table[self.codes[k]] for k in self.windows.segment]
        value, by = (np.array(part) for part in zip(*by_window, strict=True))
        u = np.einsum("nwd,wd->nw", self.y.value, value)
        u_by = np.einsum("nwd,wd->nw", self.y.by, value) + np.einsum("nwd,wd->nw", self.y.value, by)
        return Signal(self, u, u_by)

    def state_at(self, time: float) -> Floats:
        """(x, v, theta) at a time since the start of the motion, shape (2n + 1,)."""
        ends = np.cumsum(self.durations)
        flight = min(int(np.searchsorted(ends, time)), len(ends) - 1)
        since = time - (ends[flight] - self.durations[flight])
        w, n = self.windows, self.rows.mechanism.degrees
        window = w.first[flight] + min(int(since / w.length), w.last[flight] - w.first[flight])
        y = chebyshev.chebval(w.place(window, since), self.y.value[:, window])
        moving = self.rows.moved
        v = [moving(self.codes[flight], row, 1).value @ y for row in np.eye(n)]
        phase = self.states[flight, -1] + self.omega.value * since
        return np.array([*y[0 : 2 * n : 2], *v, phase])

    def closing(self) -> list[Jet]:
        """Closing speed of each impact."""
        w, found = self.windows, []
        for flight, stop in zip(self.struck.flights, self.struck.stops, strict=True):
            rate = self.rows.gap_rate(self.codes[flight], stop.contact)
            further = rate @ self.rows.flow(self.codes[flight])
            y = Dual(
                *(chebyshev.chebval(w.ends[flight], part[:, w.last[flight]]) for part in self.y)
            )
            moves = rate.value @ y.by + rate.by @ y.value
            moves += (further.value @ y.value) * self.durations_by[flight]
            found.append(stop.side * jet(float(rate.value @ y.value), float(moves)))
        return found


def _propagated(
    flow: Dual, units: Floats, begun: Floats, counts: Integers, times: Floats
) -> list[Floats]:
    """(Y, dY/dp) at times in each window of flights in one mode, of those that have it.

    They are computed in these units, dY/dp with p in one that makes both parts of the flow alike.
    """
    size = len(flow.value)
    varied = bool(begun[:, size:].any() or flow.by.any())
    value, by = (part / units[:, None] * units for part in flow)
    if not varied:
        matrices = exponentials(value, times)
        begun, still = begun[:, :size] / units, np.zeros((len(times) - 1, len(begun), size))
    else:
        largest = float(np.abs(value).max())
        change = np.abs(by).max() / largest if largest else 0.0
        units = np.concatenate([units, units * (rounded_down(float(change), 1) or 1.0)])
        whole = np.block([[flow.value, np.zeros((size, size))], [flow.by, flow.value]])
        matrices = exponentials(whole / units[:, None] * units, times)
        begun = begun / units
    out = []
    for nth in range(int(counts.max())):
        begun = begun[counts[counts >= nth] > nth]
        values = np.einsum("nij,fj->nfi", matrices[:-1], begun) * units
        if not varied:
            values = np.concatenate([values, still[:, : len(begun)]], axis=2)
        out.append(values)
        begun = begun @ matrices[-1].T
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

    def extremes(self) -> tuple[Jet, Jet]:
        """Smallest and largest value, with their derivatives, by (2)."""
        u, u_by, _ = self._extrema()
        low, high = int(np.argmin(u)), int(np.argmax(u))
        return jet(float(u[low]), float(u_by[low])), jet(float(u[high]), float(u_by[high]))

    def place(self, *, largest: bool) -> float:
        """Time since the start of the motion at which it is largest, or smallest."""
        u, _, times = self._extrema()
        return float(times[np.argmax(u) if largest else np.argmin(u)])

    def _extrema(self) -> tuple[Floats, Floats, Floats]:
        """Values at extrema and at ends of flights, their derivatives and times."""
        w = self.flights.windows
        slope: Floats = np.asarray(chebyshev.chebder(self.series, axis=0) * (2.0 / w.length), float)
        at, x = real_zeros_of(slope, FLAT_OF_LARGEST_RATE)
        at, x = w.inside(at, _polished(slope, at, x))
        at = np.concatenate([at, w.first, w.last])
        x = np.concatenate([x, np.full(len(w.first), -1.0), w.ends])
        moved = np.zeros(len(at))
        late = values_at(slope, w.last, w.ends)
        moved[len(at) - len(late) :] = late * self.flights.durations_by
        u_by = values_at(self.series_by, at, x) + moved
        return values_at(self.series, at, x), u_by, w.times(at, x)

    def at(self, times: Floats) -> Floats:
        """Values at times since the start of the motion."""
        return values_at(self.series, *self.flights.windows.at(times))

    def mean_product(self, other: Signal) -> Jet:
        """Mean of the product of two signals over the motion, by (3)."""
        points = self._points(WINDOW_NODES)
        f, g = self._at(points.x), other._at(points.x)
        whole = np.sum(points.weights * f.value * g.value)
        by = np.sum(points.weights * (f.by * g.value + f.value * g.by))
        by += np.sum(self._ends() * other._ends() * self.flights.durations_by)
        return jet(float(whole), float(by)) / self.flights.period

    def harmonic(self, order: float) -> Jet:
        """Amplitude of the part of a frequency, in units of the first line's.

        A periodic motion has none of a frequency that is no multiple of its own.
        """
        flights, w = self.flights, self.flights.windows
        omega = flights.omega
        turns = order * omega.value * flights.period.value / (2.0 * math.pi)
        if flights.periodic and abs(turns - round(turns)) > WHOLE_TURNS_WITHIN * turns:
            return jet(0.0)
        turn = order * omega.value * w.length / 2.0
        points = self._points(WINDOW_NODES + math.ceil(turn) + SPARE_GAUSS_POINTS)
        f = self._at(points.x)
        since = w.start[:, None] + w.length * (1.0 + points.x) / 2.0
        theta = order * (flights.states[w.segment, -1:] + omega.value * since)
        theta_by = order * (flights.states_by[w.segment, -1:] + derivative(omega) * since)
        wave = np.exp(-1j * theta)
        whole = np.sum(points.weights * f.value * wave)
        by = np.sum(points.weights * (f.by - 1j * theta_by * f.value) * wave)
        at_end = order * (flights.states[:, -1] + omega.value * flights.durations)
        by += np.sum(self._ends() * np.exp(-1j * at_end) * flights.durations_by)
        real, imaginary = jet(whole.real, by.real), jet(whole.imag, by.imag)
        return 2.0 * (real * real + imaginary * imaginary).sqrt() / flights.period

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
