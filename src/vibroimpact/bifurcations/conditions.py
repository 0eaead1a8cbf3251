"""Conditions that make a solution a bifurcation, each one equation more than it has unknowns of its own.

Method      with L and E of equations.py, sizes of unknowns and equations divided out,
            SN, PD, BP  L(mu) v = 0,  v . v = 1,  mu = 1 or -1; unknown v                        (1)
            NS          tau = s^(d - 1) product over i < j of (1 - mu_i mu_j) = 0                (2)
                        d tau = -(tau without the critical pair) d det S, where S is the 2 x 2 matrix of the
                        pair's invariant subspace:  L(1) V = E V (S - I),
                        d det S = tr(adj(S) (W' E V)^-1 W' dF_z V)                               (3)
            GR          u(t) = 0, u'(t) = 0 of the gap u in the flight that grazes; unknown t    (4)
            STICK, REST a guard u, or its rate, is zero just after an event, in the mode that follows or in one
                        that would: u = 0 of the force that would hold a stop closed or friction, u' = 0 of
                        the slip                                                                  (5)
            level       g(z, a) = 0, a function of the user's
            (1) is regular at cusps, at R1, R2 and fold-flip points, (2) and (3) where the pair is real and
            where it meets at 1 or -1, so that the curve goes on as one of neutral saddles; (4) is an ordinary
            point of the orbit's equations.
Accuracy    derivatives are exact on the curve; (3) leaves out a term that is proportional to tau
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 10.3; theory.md, "Two parameters"
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from vibroimpact._core.pencils import deflating, solved
from vibroimpact._core.types import Complexes, Flags, Floats
from vibroimpact._kernel import Jet
from vibroimpact.bifurcations.equations import Equations, Pair
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.branches.family import (
    CHATTER,
    FLIGHT,
    PROGRESS,
    REST,
    SPEED,
    STICK,
    Parameters,
    pairs_of,
    products_of_pairs,
    rests_of,
)
from vibroimpact.branches.kinds import Function
from vibroimpact.branches.touch import Place
from vibroimpact.compile.modes import code_of, digit_in_code
from vibroimpact.compile.piecewise import state_in
from vibroimpact.compile.prescribed import FORCE_WATCH, End, Prescribed, compile_prescribed
from vibroimpact.continuation.newton import equilibrated
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.reversals import far_limit, held_code


class Derivatives(NamedTuple):
    """Derivatives of a condition of k + 1 equations, its k unknowns being w."""

    by_z: Floats  # (k + 1, d)
    by_w: Floats  # (k + 1, k)
    by_a: Floats  # (k + 1, 2)


class Condition(Protocol):
    """Equations G(z, w, a) = 0 that hold at a bifurcation."""

    @property
    def own(self) -> str:
        """Name of the orbit's own test function that is zero all along the curve, or ""."""
        ...

    @property
    def unknowns(self) -> int:
        """Number k of unknowns w."""
        ...

    def start(self, z: Floats, a: Pair, /) -> Floats:
        """Unknowns w at a bifurcation, shape (k,), of size one."""
        ...

    def value(self, z: Floats, w: Floats, a: Pair, /) -> Floats:
        """G, shape (k + 1,)."""
        ...

    def derivatives(self, z: Floats, w: Floats, a: Pair, /) -> Derivatives:
        """Derivatives of G; called right after ``value``."""
        ...


class _OneEquation(ABC):
    """Condition without unknowns of its own: one equation, whose gradient has d + 2 entries."""

    unknowns = 0

    @abstractmethod
    def gradient(self, z: Floats, a: Pair) -> Floats:
        """Derivatives by z and by both parameters, shape (d + 2,)."""

    def start(self, _z: Floats, _a: Pair, /) -> Floats:
        """Return no unknowns."""
        return np.empty(0)

    def derivatives(self, z: Floats, _w: Floats, a: Pair, /) -> Derivatives:
        """The gradient, by parts."""
        row = self.gradient(z, a)[None]
        return Derivatives(row[:, :-2], np.empty((1, 0)), row[:, -2:])


# ---- SN, PD, BP ----------------------------------------------------------------------------------


class CriticalMultiplier:
    """Condition (1): a multiplier is 1 or -1."""

    def __init__(self, equations: Equations, multiplier: float) -> None:
        self.equations, self.multiplier, self.own = equations, multiplier, ""
        self.unknowns = len(equations.sizes)

    def matrix(self, z: Floats, a: Pair, multiplier: float) -> Floats:
        """L(multiplier), scaled."""
        eq = self.equations
        shifted = eq.by_both(z, a)[0] - (multiplier - 1.0) * eq.closing
        scaled: Floats = shifted * eq.sizes / eq.rows[:, None]
        return scaled

    def start(self, z: Floats, a: Pair) -> Floats:
        """Null vector v, scaled."""
        null: Floats = np.linalg.svd(equilibrated(self.matrix(z, a, self.multiplier))[0])[2][-1]
        return null

    def value(self, z: Floats, w: Floats, a: Pair) -> Floats:
        """L v and v . v - 1."""
        return np.append(self.matrix(z, a, self.multiplier) @ w, w @ w - 1.0)

    def derivatives(self, z: Floats, w: Floats, a: Pair) -> Derivatives:
        """Derivatives of (1)."""
        eq, d = self.equations, self.unknowns
        second = eq.second(z, a, (w * eq.sizes)[None])[0] / eq.rows[:, None]
        by_w = np.vstack([self.matrix(z, a, self.multiplier), 2.0 * w])
        return Derivatives(
            np.vstack([second[:, :d], np.zeros((1, d))]), by_w,
            np.vstack([second[:, d:], np.zeros((1, 2))]),
        )  # fmt: skip


# ---- NS ------------------------------------------------------------------------------------------


def critical_pair(multipliers: Complexes) -> tuple[int, int]:
    """Two multipliers whose product is nearest to 1."""
    i, j = pairs_of(len(multipliers))
    with np.errstate(invalid="ignore"):
        off = np.abs(multipliers[i] * multipliers[j] - 1.0)
    off[np.isnan(off)] = np.inf
    nearest = int(off.argmin())
    return int(i[nearest]), int(j[nearest])


class CriticalPair(_OneEquation):
    """Condition (2): the product of two multipliers is 1."""

    own = ""

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self._scaling = equations.sizes / equations.rows[:, None]
        self._closing = equations.closing * self._scaling

    def tau(self, z: Floats, a: Pair, without: tuple[int, int] | None = None) -> float:
        """Return tau of (2), without one pair if it is named."""
        mu = self.equations.multipliers(z, a)
        return float(products_of_pairs(mu, without)) * self.equations.weight(z, a) ** (len(mu) - 1)

    def value(self, z: Floats, _w: Floats, a: Pair, /) -> Floats:
        """Return tau."""
        return np.array([self.tau(z, a)])

    def gradient(self, z: Floats, a: Pair) -> Floats:
        """Derivatives by (3)."""
        mu = self.equations.multipliers(z, a)
        i, j = critical_pair(mu)
        with np.errstate(over="ignore", invalid="ignore"):  # of iterates that run away
            return -self.tau(z, a, (i, j)) * self._of_product(z, a, mu[[i, j]])  # (3)

    def _of_product(self, z: Floats, a: Pair, pair: Complexes) -> Floats:
        """Derivative of det S of (3), shape (d + 2,)."""
        eq, closing = self.equations, self._closing
        opened = eq.by_both(z, a)[0] * self._scaling + closing
        if not np.isfinite(opened).all():
            return np.full(len(z) + 2, np.nan)
        found = deflating(opened, closing, lambda alpha, beta: _nearest(alpha, beta, pair))
        s, right, left = solved(found.t, found.s), found.right, found.left
        back = solved(left.T @ closing @ right, left.T)
        adjugate = np.array([[s[1, 1], -s[0, 1]], [-s[1, 0], s[0, 0]]]) @ back
        by_each = eq.second(z, a, right.T * eq.sizes)
        gradient: Floats = np.tensordot(adjugate / eq.rows, by_each, axes=2)
        return gradient


def _nearest(alpha: Complexes, beta: Floats, pair: Complexes) -> Flags:
    """Which two of the eigenvalues alpha / beta are nearest to a pair."""
    with np.errstate(divide="ignore", invalid="ignore"):
        values = alpha / beta
    off = np.minimum(np.abs(values - pair[0]), np.abs(values - pair[1]))
    off[~np.isfinite(off)] = np.inf
    chosen = np.zeros(len(off), dtype=bool)
    chosen[np.argsort(off, kind="stable")[:2]] = True
    return chosen


# ---- GR ------------------------------------------------------------------------------------------


class Graze:
    """Condition (4): a stop is touched, without impact, in one of the flights."""

    unknowns, own = 1, ""

    def __init__(self, plane: OrbitPlane, touch: Nearest) -> None:
        self.plane, self.touch = plane, touch
        self._size = plane.sizes[plane.size]  # of a time

    def _segment(self, z: Floats, w: Floats) -> tuple[Floats, Floats, list[End]]:
        k, time, end = self.place(w)
        states, _ = self.plane.unpacked(z)
        return states[k : k + 1], np.array([time]), [end]

    def place(self, w: Floats) -> Place:
        """Flight, time and guard of the touch."""
        k, touch = self.touch.segment, self.touch
        end = End(touch.contact, touch.side, self.plane.modes[k], touch.watch)
        return Place(k, float(w[0]) * self._size, end)

    def start(self, _z: Floats, _a: Pair, /) -> Floats:
        """Time of the touch since the start of the flight."""
        return np.array([self.touch.time / self._size])

    def value(self, z: Floats, w: Floats, a: Pair, /) -> Floats:
        """Gap and its rate."""
        parts = self.plane.compiled(a).linearise(*self._segment(z, w))
        gap: Floats = np.array([parts.gap[0], parts.rate[0] * self._size]) / self.plane.sizes[0]
        return gap

    def derivatives(self, z: Floats, w: Floats, a: Pair, /) -> Derivatives:
        """Derivatives of gap and rate."""
        plane, k, q = self.plane, self.touch.segment, self.plane.size
        segment, n = self._segment(z, w), 2 * self.plane.mechanism.degrees
        along = np.zeros((1, n + 2))
        along[0, n + 1] = 1.0
        rows = []
        for compiled in (plane.compiled(a), plane.by_second(a)):
            gap = compiled.linearise(*segment).gap_by[0]
            rate = compiled.second(*segment, along)[1][0] * self._size
            rows.append(np.array([gap, rate]) / plane.sizes[0])
        by_z = np.zeros((2, len(z)))
        by_z[:, k * (q + 1) : k * (q + 1) + q] = rows[0][:, plane.kept]
        by_w = rows[0][:, n + 1 : n + 2] * self._size
        return Derivatives(by_z, by_w, np.column_stack([rows[0][:, -1], rows[1][:, -1]]))


class ClosingRate(_OneEquation):
    """Condition u' = 0 at the end of a flight: the impact there becomes a touch."""

    def __init__(self, plane: OrbitPlane, segment: int) -> None:
        self.plane, self.segment, self.own = plane, segment, f"{SPEED} {segment}"

    def value(self, z: Floats, _w: Floats, a: Pair, /) -> Floats:
        """The closing rate."""
        return np.array([self.plane.linearised(z, a).rate[self.segment]])

    def gradient(self, z: Floats, a: Pair) -> Floats:
        """Second derivatives of the gap by time."""
        plane = self.plane
        along = np.zeros((len(plane.impacts), plane.size + 1))
        along[:, -1] = 1.0
        row = self.segment * (plane.size + 1) + plane.size  # of this segment's gap
        gradient: Floats = plane.second(z, a, along.reshape(1, -1))[0, row]
        return gradient


class JustAfter(_OneEquation):
    """Condition (5): a guard, or its rate, is zero at the start of a flight."""

    def __init__(
        self, plane: OrbitPlane, segment: int, ends: Sequence[End], own: str, *, rate: bool
    ) -> None:
        self.plane, self.segment, self.own, self.rate = plane, segment, own, rate
        self.ends = [*ends]  # limits of one guard, of which the nearest at the first point counts

    def _at(self, z: Floats, a: Pair, by: int = 0) -> tuple[Prescribed, Floats, Floats]:
        compiled = self.plane.in_mode(self.ends[0].mode, a, by)
        state = self.plane.states_at(z, a)[self.segment][None]
        if len(self.ends) > 1:
            many = np.repeat(state, len(self.ends), axis=0)
            gaps = compiled.linearise(many, np.zeros(len(many)), self.ends).gap
            self.ends = [self.ends[int(np.argmin(np.abs(gaps)))]]
        return compiled, state, np.zeros(1)

    def value(self, z: Floats, _w: Floats, a: Pair, /) -> Floats:
        """The guard, or its rate."""
        compiled, states, durations = self._at(z, a)
        parts = compiled.linearise(states, durations, self.ends)
        return parts.rate if self.rate else parts.gap

    def gradient(self, z: Floats, a: Pair) -> Floats:
        """Derivatives of the value."""
        plane, n = self.plane, 2 * self.plane.mechanism.degrees
        in_time = np.zeros((1, n + 2))
        in_time[0, -1] = 1.0
        rows = []
        for by in range(len(plane.names)):
            compiled, states, durations = self._at(z, a, by)
            if self.rate:
                found = compiled.second(states, durations, self.ends, in_time)[1]
            else:
                found = compiled.linearise(states, durations, self.ends).gap_by
            rows.append(found[0])
        gradient = np.zeros(len(z) + 2)
        first = self.segment * (plane.size + 1)
        gradient[first : first + plane.size] = rows[0][plane.kept]
        gradient[-2:] = [row[-1] for row in rows]
        return gradient


def sticking(plane: OrbitPlane, segment: int) -> Condition:
    """A plastic impact, or a reversal of slip, after which the motion no longer goes on at once."""
    m, mode, own = plane.mechanism, plane.modes[segment], f"{STICK} {segment}"
    stop = plane.signature.impacts[segment]
    if stop.contact < len(m.rigid_stops):
        closed = mode if digit_in_code(mode, stop.contact) else mode + code_of((stop,))
        force = End(stop.contact, -1, closed, FORCE_WATCH)
        return JustAfter(plane, segment, [force], own, rate=False)
    compiled = compile_prescribed(plane.system, "", (mode,))
    flights = plane.signature.flights
    before, after = (state_in(m, flights[k].mode, stop.contact) for k in (segment - 1, segment))
    if after == m.elements[stop.contact].holding:
        limit, *_ = far_limit(compiled, mode, stop.contact, before)
        return JustAfter(plane, segment, [limit], own, rate=False)
    slip = next(end for end in compiled.ends if end.contact == stop.contact)
    return JustAfter(plane, segment, [slip], own, rate=True)


def resting(plane: OrbitPlane, segment: int) -> Condition:
    """A stop is rested on, or friction sticks, for no time; a reversal at which friction is about to stick."""
    what = rests_of(plane.mechanism, plane.signature).get(segment)
    if what:
        return FlightTime(plane, segment, what)
    contact, mode = plane.signature.impacts[segment].contact, plane.modes[segment]
    stuck = held_code(plane.mechanism, mode, contact)
    ends = compile_prescribed(plane.system, "", (stuck,)).ends
    levels = [end for end in ends if end.contact == contact and end.watch >= 0]
    return JustAfter(plane, segment, levels, f"{REST} {segment}", rate=False)


class Standstill(_OneEquation):
    """A machine does not advance: progress 0, by (4) of problem.py."""

    def __init__(self, plane: OrbitPlane, number: int) -> None:
        self.plane, self.number, self.own = plane, number, f"{PROGRESS} {number}"

    def value(self, z: Floats, _w: Floats, a: Pair, /) -> Floats:
        """The progress."""
        return self.plane.progress(z, a)[self.number : self.number + 1]

    def gradient(self, z: Floats, a: Pair) -> Floats:
        """Derivatives of the progress."""
        plane = self.plane
        by_second = plane.by_second(a).linearise(*plane.unpacked(z), plane.ends).after_by[-1, :, -1]
        entry = plane.kept[plane.pivots[self.number]]
        return np.append(plane.progress_by(z, a)[self.number], by_second[entry])


# ---- a level of a function -----------------------------------------------------------------------


class Level(_OneEquation):
    """A function of the orbit keeps a value: g(states, durations, parameters) = value."""

    def __init__(self, plane: OrbitPlane, function: Function, level: float, own: str = "") -> None:
        self.plane, self.function, self.level, self.own = plane, function, level, own

    def value(self, z: Floats, _w: Floats, a: Pair, /) -> Floats:
        """G minus its level."""
        return np.array([float(self.function(*self.arguments(z, a))) - self.level])

    def gradient(self, z: Floats, a: Pair) -> Floats:
        """Derivatives of g, which is evaluated on jets."""
        numbers, d = [*z, *a], len(z)
        gradient = np.zeros(d + 2)
        for first in range(0, d + 2, 3):
            jets = [_seeded(x, i - first) for i, x in enumerate(numbers)]
            moved = self.function(*self.arguments(np.array(jets[:d], dtype=object), jets[d:]))
            if isinstance(moved, Jet):
                count = min(3, d + 2 - first)
                gradient[first : first + count] = [moved.coefficients[1 << k] for k in range(count)]
        return gradient

    def arguments(self, z: Any, a: Sequence[Any]) -> tuple[Any, Any, Any]:
        """Arguments of the function, of floats or of jets."""
        rows = np.reshape(z, (len(self.plane.impacts), self.plane.size + 1))
        states = np.zeros((len(rows), 2 * self.plane.mechanism.degrees + 1), dtype=rows.dtype)
        states[:, self.plane.kept] = rows[:, : self.plane.size]
        parameters = Parameters(self.plane.system, dict(zip(self.plane.names, a, strict=True)))
        return states, rows[:, self.plane.size], parameters


class FlightTime(Level):
    """A flight takes no time: the two impacts at its ends coincide."""

    def __init__(self, plane: OrbitPlane, segment: int, what: str = FLIGHT) -> None:
        super().__init__(plane, self._time, 0.0, f"{what} {segment}")
        self.segment, self.what = segment, what

    def _time(self, _states: Any, durations: Any, _parameters: Any) -> Any:
        return durations[self.segment]


def _seeded(x: float, direction: int) -> Jet:
    """A number as a jet that is moved in one of three directions, or in none."""
    seed = [0.0] * 8
    if 0 <= direction < 3:
        seed[1 << direction] = 1.0
    return Jet.of(float(x), seed)


OF_TESTS: dict[str, Callable[[OrbitPlane, int], Condition]] = {
    SPEED: ClosingRate,
    FLIGHT: FlightTime,
    STICK: sticking,
    REST: resting,
    CHATTER: resting,
    PROGRESS: Standstill,
}
"""Conditions that a test function of a segment, or of a drift, is zero."""
