"""Periodic orbits along a parameter, with test functions whose zeros are bifurcations.

Method      The equations are those of problem.py, in z (states and flight times) and p. With rho_k
            the closing rates, saturated so that far from grazing they have equal weights,
                s = product of rho_k / sqrt(rho_k^2 + rho_ref^2)                                (1)
            rho_k in changes of its guard per flight, whatever units guards have;
            the test functions are
                flip     s / (product of rho_k) det of the pencil at -1  =  +-s det(DF + I)      (2)
                torus    s^(d - 1) product over i < j of (1 - mu_i mu_j)                        (3)
                speed k  rho_k          flight k  t_k, zero where two impacts coincide
                event    the functions of kinds that are given by one, analytic along the branch
                stick k (R = 0)  acceleration of the gap after impact k at a rigid stop; of the slip
                     after friction has reversed; where it rests or sticks then, how far the force is from the
                     limit beyond which it would not
                rest k   t_k of a flight in which a stop is rested on, or friction sticks; after a reversal the
                     force that would hold the slip less the static level, where that is above the kinetic one
                chatter k  t_k of a rest that begins with chatter                          (4)
                progress i the progress of (4) of problem.py
                extremum i det [F_z F_p; g_z g_p], g the progress: zero where it has an extremum along the branch  (5)
            F being the half map of a symmetric orbit, the full map of others, mu its multipliers.
            (1) removes their poles at grazing; folds and branch points are found by continuation/.
            Without any loss multipliers come in pairs mu, 1 / mu and (3) is zero: it is left out.
Accuracy    rounding; (2) and (3) relative to their largest terms
Reference   theory.md, "Branches"; Kuznetsov, Elements of Applied Bifurcation Theory, section 10.2
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from typing import Any

import numpy as np

from vibroimpact._core import linear
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Complexes, Floats, Integers
from vibroimpact.compile.along import Along
from vibroimpact.compile.coordinates import STEP_ANGLE
from vibroimpact.compile.piecewise import state_in
from vibroimpact.compile.prescribed import (
    CHATTER_WATCH,
    FORCE_WATCH,
    GAP_WATCH,
    End,
    Linearised,
    Prescribed,
)
from vibroimpact.continuation.problem import Image
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.system import System
from vibroimpact.normal_forms.kind import PointKinds
from vibroimpact.orbits.find import Guess, later, rolled, with_image
from vibroimpact.orbits.maps import SegmentMap, map_of
from vibroimpact.orbits.multipliers import Pencil, PencilOf, eigenvalues_of, with_structural
from vibroimpact.orbits.newton import CONVERGED_RELATIVE, FOUND, guard_sizes, rows_of, scale_of
from vibroimpact.orbits.orbit import Orbit, know
from vibroimpact.orbits.problem import (
    KEPT_EVALUATIONS,
    OrbitProblem,
    Signature,
    Value,
    images_of,
    latest,
    least_cycles,
)
from vibroimpact.orbits.reversals import beyond_static, far_limit, one_level
from vibroimpact.orbits.simultaneous import staying_at_once
from vibroimpact.results.tree import Missing

ROUNDING_OF_PAIRS = 1e-3  # (3) of a motion without loss is smaller: rounding, whose square root a double one moves by
SATURATION_OF_FASTEST = 0.05  # rho_ref has this ratio to the fastest event at the start
KEPT_NUMBERS = 1_000_000  # Jacobians of so many numbers in all are kept, for the orbits at the points of a branch
FLIP, TORUS, SPEED, FLIGHT, STICK = "flip", "torus", "speed", "flight", "stick"
REST, CHATTER = "rest", "chatter"
PROGRESS, EXTREMUM = "progress", "extremum"
EVENT = "event"


class Parameters(dict[str, Any]):
    """Parameters by name: those that are followed, and the others of the system."""

    def __init__(self, system: System, followed: Mapping[str, Any]) -> None:
        super().__init__(followed)
        self._system = system

    def __missing__(self, name: str) -> float:
        """Value of a parameter that is not followed."""
        return parameter_value(self._system, name)


class _Evaluation:
    """What is known of a point of the curve, each once it was asked for."""

    def __init__(self, family: OrbitFamily, z: Floats, p: Value) -> None:
        self.family, self.z, self.p = family, z, p

    @cached_property
    def segments(self) -> Linearised:
        return OrbitProblem.linearised(self.family, self.z, self.p)

    @cached_property
    def equations(self) -> tuple[Floats, Floats]:
        return OrbitProblem.expanded(self.family, self.z, self.p)

    @cached_property
    def pencil(self) -> Pencil:
        return self.family.pencils.at(self.family.compiled(self.p), self.segments)

    @cached_property
    def multipliers(self) -> Complexes:
        (found,) = self.family.multipliers_of([self.pencil])
        return np.asarray(found)


class OrbitFamily(OrbitProblem):
    """Orbits with one signature along one parameter, as a ``Problem`` of continuation.

    Parameters
    ----------
    system, signature, parameter
        As for :class:`OrbitProblem`.
    sizes
        Sizes of the changes of each unknown and of the parameter: weights of the arclength.
    events
        Kinds with test functions of their own, by their labels (kinds.py).
    """

    def __init__(
        self,
        system: System,
        signature: Signature,
        parameter: str,
        sizes: Floats,
        events: PointKinds,
    ) -> None:
        super().__init__(system, signature, parameter)
        self.events = {  # a file does not hold functions of the user's
            label: kind for label, kind in events.items() if not isinstance(kind.function, Missing)
        }
        self._sizes = sizes
        self.common_sizes = sizes[:-1]
        self.rows = rows_of(self, sizes[:-1])
        self._kept: dict[tuple[bytes, Value], _Evaluation] = {}
        self._others: dict[int, Along] = {}
        self._most = max(KEPT_EVALUATIONS, KEPT_NUMBERS // len(sizes) ** 2)
        self._orbits: dict[tuple[bytes, Value], Orbit] = {}
        self.refused = ""  # reason if the system could not be built
        self._reference = 0.0
        self._rate = 2.0 * self.own.rate
        self.pencils = PencilOf(self, sizes)
        self._cycles = least_cycles(self.mechanism)
        self._rates = guard_sizes(self, sizes) / sizes[self.size]

    @classmethod
    def around(
        cls,
        system: System,
        signature: Signature,
        parameter: str,
        start: Floats,
        span: float,
        events: PointKinds,
    ) -> OrbitFamily:
        """Family through an orbit z, which gives the sizes, over a range of length ``span``."""
        problem = OrbitProblem(system, signature, parameter)
        family = cls(
            system, signature, parameter, np.append(scale_of(problem, start), span), events
        )
        value = parameter_value(system, parameter)

        def derivatives() -> tuple[Floats, Floats]:
            by_z, by_parameter = problem.jacobian(start, value)
            return by_z, by_parameter[:, None]

        family.at_once = staying_at_once(problem, start, derivatives, (span,))
        return family

    def scale(self) -> Floats:
        """Size of each unknown and of the parameter."""
        return self._sizes

    def linearised(self, z: Floats, p: Value) -> Linearised:
        """Every segment with its derivatives; the latest ones are kept."""
        return self._at(z, p).segments

    def in_mode(self, code: int, p: Value, by: int = 0) -> Prescribed:
        """System at the value p of the parameter, compiled in one mode, which its orbits need not pass."""
        names, values = self.along.names, self._values(p)
        along = self._others.setdefault(code, Along(self.system, names, (code,)))
        return along.at(values, by)

    def _at(self, z: Floats, p: Value) -> _Evaluation:
        """What is known at a point; the latest ones are kept."""
        return latest(self._kept, (z.tobytes(), p), lambda _: _Evaluation(self, z, p), self._most)

    def expanded(self, z: Floats, p: Value) -> tuple[Floats, Floats]:
        """Residual and derivatives of :class:`OrbitProblem`; the latest ones are kept."""
        return self._at(z, p).equations

    def residual(self, z: Floats, p: Value) -> Floats:
        """Residual of :class:`OrbitProblem`; NaN beyond the range of the parameter or of time."""
        backwards = float(z[self.size :: self.size + 1].min()) * self._rate
        if backwards < -STEP_ANGLE:
            self.refused = "a flight takes negative time: two impacts have changed order"
            return np.full(len(z), np.nan)
        try:
            return super().residual(z, p)
        except InvalidParameterError as error:
            self.refused = str(error)
            return np.full(len(z), np.nan)

    def jacobian(self, z: Floats, p: Value) -> tuple[Floats, Floats]:
        """Jacobian of :class:`OrbitProblem`; NaN where the parameter is out of its own range."""
        try:
            return super().jacobian(z, p)
        except InvalidParameterError:
            return np.full((len(z), len(z)), np.nan), np.full(len(z), np.nan)

    def images(self, z: Floats, p: Value, along: Floats, near: Floats) -> list[Image]:
        """Images of an orbit: begun at another impact, under symmetries of the machine, whole forcing periods later."""
        impacts, cycles = self.signature.impacts, self.signature.cycles
        here, moved = self._around(z, math.pi * cycles), self._changes_around(along)
        pairs = [(impacts, here.states, moved.states)]
        advance: Floats | float = 0.0
        if self.pivots:
            advance = self.drifts[: self.degrees] @ self.progress(z, p)
        for symmetry in images_of(self.compiled(p).mechanism):
            states, changes = (
                symmetry.image(here.states, symmetry.turn),
                symmetry.change(moved.states),
            )
            pairs.append((self.signature.image(symmetry).impacts, states, changes))
        return [
            self._begun(
                k, Guess(states, here.durations), Guess(changes, moved.durations), near, advance
            )
            for sequence, states, changes in pairs
            for k in range(len(impacts))
            if (*sequence[k:], *sequence[:k]) == impacts
        ]

    def _around(self, z: Floats, turn: float) -> Guess:
        """All segments in z, including the second half of a symmetric orbit."""
        once = Guess(*self.unpacked(z))
        return with_image(once, self.symmetry.image(once.states, turn)) if self.symmetry else once

    def _changes_around(self, along: Floats) -> Guess:
        """The same of a direction."""
        once = Guess(*self.unpacked(along))
        return with_image(once, self.symmetry.change(once.states)) if self.symmetry else once

    def _begun(
        self, k: int, orbit: Guess, along: Guess, near: Floats, advance: Floats | float
    ) -> Image:
        """Orbit begun at segment k, with its phase near another one, and a direction there."""
        count, turn = len(self.impacts), 2.0 * math.pi * self._cycles
        states, durations = rolled(orbit, self.signature.cycles, k, advance)
        changes, delays = rolled(along, 0, k)
        states, changes = self.centred(states), self.centred(changes)
        if turn:
            apart = self.unpacked(near)[0][0, -1] - states[0, -1]
            states = later(states, turn * round(apart / turn))
        return (
            self.packed(states[:count], durations[:count]),
            self.packed(changes[:count], delays[:count]),
        )

    def kept_orbit(self, z: Floats, p: Value) -> Orbit:
        """Orbit at a point of the curve, kept for the next call."""
        orbit = self._orbits[z.tobytes(), p] = self.orbit(z, p)
        return orbit

    def forget(self) -> None:
        """Release the evaluations that are kept: with the exponentials of their flights up to a megabyte each."""
        for kept in (
            self._systems,
            self._compiled,
            self._kept,
            self._orbits,
        ):
            kept.clear()

    def orbit(self, z: Floats, p: Value) -> Orbit:
        """Orbit at a point of the curve; not converged where the equations do not hold."""
        if kept := self._orbits.pop((z.tobytes(), p), None):
            return kept
        states, durations = self.unpacked(z)
        left = np.abs(self.residual(z, p)) / self.rows
        error, status = float(left.max()), FOUND
        if not error <= CONVERGED_RELATIVE and not np.all(
            left <= CONVERGED_RELATIVE * self._growth(z, p)
        ):
            status = f"the equations do not hold: relative residual {error:.1e}"
        problem = self.at(p)
        orbit = Orbit(
            problem.system,
            self.signature,
            states,
            durations,
            error,
            status,
            self.parameter,
            problem,
        )
        if orbit.converged:
            know(orbit, self.linearised(z, p), self.multipliers(z, p))
        return orbit

    def _growth(self, z: Floats, p: Value) -> Floats:
        """Factor by which each equation amplifies a change of the unknowns, both relative."""
        growth: Floats = np.abs(self.jacobian(z, p)[0] * self._sizes[:-1]).max(axis=1) / self.rows
        return growth

    def multipliers(self, z: Floats, p: Value) -> Complexes:
        """Multipliers of the solved map, largest modulus first; the latest ones are kept."""
        return self._at(z, p).multipliers

    def watch(self, z: Floats, p: Floats) -> dict[str, Floats]:
        """Test functions (2)-(4)."""
        at = [self._at(*point) for point in zip(z, p.tolist(), strict=True)]
        pencils, rates = [one.pencil for one in at], self._closing_rates(at)
        saturated = self._saturated(rates)
        for one, multipliers in zip(at, self.multipliers_of(pencils), strict=True):
            vars(one)["multipliers"] = multipliers
        flips = np.linalg.det(np.array([one.a + one.b for one in pencils]))
        pairs = products_of_pairs(np.array([one.multipliers for one in at]))
        for k in np.flatnonzero(np.abs(pairs) <= ROUNDING_OF_PAIRS):
            if lossless(self.compiled(at[k].p).mechanism, self.signature):
                pairs[k] = math.nan
        weights = (rates / saturated).prod(axis=1)
        watched = {
            FLIP: flips / saturated.prod(axis=1),
            TORUS: weights ** (pencils[0].finite - 1) * pairs,
        }
        return watched | self.touches(z, p.tolist())

    def multipliers_of(self, pencils: Sequence[Pencil]) -> Complexes:
        """Multipliers of the solved map from its pencils, in rows."""
        return with_structural(eigenvalues_of(pencils), self.held)

    def pencil(self, z: Floats, p: Value) -> Pencil:
        """Pencil of the multipliers of the solved map."""
        return self._at(z, p).pencil

    def weight(self, z: Floats, p: Value) -> float:
        """Product (1): zero where a multiplier is infinite."""
        rates = self._closing_rates([self._at(z, p)])
        return float((rates / self._saturated(rates)).prod())

    def _closing_rates(self, at: Sequence[_Evaluation]) -> Floats:
        """Rates rho_k of (1), in rows."""
        rates: Floats = np.array([one.segments.rate for one in at]) / self._rates
        return rates

    def _saturated(self, rates: Floats) -> Floats:
        """Denominators of (1)."""
        self._reference = (
            self._reference
            or SATURATION_OF_FASTEST * float(np.abs(rates[0]).max())
            or SATURATION_OF_FASTEST
        )
        denominators: Floats = np.sqrt(rates**2 + self._reference**2)
        return denominators

    def touches(self, z: Floats, p: Sequence[Value]) -> dict[str, Floats]:
        """Test functions (4): closing rates, flight times, accelerations."""
        at = [self._at(*point) for point in zip(z, p, strict=True)]
        rates = np.array([one.segments.rate for one in at])
        durations = z[:, self.size :: self.size + 1].T
        watched = {f"{SPEED} {k}": rate for k, rate in enumerate(rates.T)}
        watched |= {
            f"{self._rests.get(k, FLIGHT)} {k}": t
            for k, t in enumerate(durations)
            if k not in self.at_once
        }
        return watched | columns_of([self._more(one.z, one.p) for one in at])

    @cached_property
    def _rests(self) -> dict[int, str]:
        """Flights of rest, by their numbers."""
        return rests_of(self.mechanism, self.signature)

    def _more(self, z: Floats, p: Value) -> dict[str, float]:
        """Test functions (4) that not every orbit has, and (5)."""
        found = self._sticking(z, p) | self._reversing(z, p) | self._events(z, p)
        return found | self._advancing(z, p) if self.pivots else found

    def _advancing(self, z: Floats, p: Value) -> dict[str, float]:
        """Progress, and (5)."""
        if isinstance(p, tuple):
            return {}
        found = {f"{PROGRESS} {i}": float(x) for i, x in enumerate(self.progress(z, p))}
        upper = np.column_stack(self.jacobian(z, p)) / self.rows[:, None]
        for i, row in enumerate(self.progress_by(z, p)):
            scaled = np.vstack([upper, row / self._sizes[self.pivots[i]]]) * self._sizes
            found[f"{EXTREMUM} {i}"] = float(np.linalg.det(scaled))
        return found

    def followed(self, p: Value) -> dict[str, Any]:
        """Values of the parameters that are followed, by name."""
        return {self.parameter: p}

    def _events(self, z: Floats, p: Value) -> dict[str, float]:
        """Values of the test functions that users gave."""
        arguments = self.arguments(z, p)
        return {
            f"{EVENT} {label}": float(kind.function(*arguments))
            for label, kind in self.events.items()
            if kind.function
        }

    def arguments(self, z: Floats, p: Value) -> tuple[Floats, Floats, Parameters]:
        """Arguments (states, durations, parameters) of a test function of the orbit."""
        return *self.unpacked(z), Parameters(self.system, self.followed(p))

    def forms(self, z: Floats, p: Value) -> SegmentMap:
        """Half map of a symmetric orbit, full map of others, with the (first) parameter."""
        return map_of(self, self.compiled(p), self.states_at(z, p), self.unpacked(z)[1])

    @cached_property
    def _struck_before(self) -> list[tuple[int, End]]:
        """Numbers of the segments that an impact at a rigid stop begins, and the ends of the flights before them."""
        rigid, ends = len(self.mechanism.rigid_stops), self.ends
        before = (self.signature.first, *ends[:-1])
        return [
            (k, end)
            for k, end in enumerate(before)
            if end.watch == GAP_WATCH and 0 <= end.contact < rigid
        ]

    def _sticking(self, z: Floats, p: Value) -> dict[str, float]:
        """Accelerations (4) of the gaps that open from rest: plastic impacts only."""
        compiled = self.compiled(p)
        plastic = [k for k, end in self._struck_before if compiled.restitution(end) == 0.0]
        if not plastic:
            return {}
        states, _ = self.unpacked(z)
        found = {}
        for k in plastic:
            contact, side = self.signature.impacts[k]
            mode = compiled.modes[self.modes[k]]
            y = compiled.embedded(states[k, :-1], states[k, -1])
            guard = next(guard for guard in mode.guards if guard.contact == contact)
            if guard.watch == FORCE_WATCH:
                found[f"{STICK} {k}"] = float(guard.row @ y + guard.gain - guard.lower)
            else:
                slope = guard.row @ mode.b @ (mode.b @ y + mode.constant)
                found[f"{STICK} {k}"] = -side * float(slope)
        return found

    def _reversing(self, z: Floats, p: Value) -> dict[str, float]:
        """Accelerations (4) of the slip after it has changed its sign, by the element's guard, or the margin to it."""
        compiled, (states, _) = self.compiled(p), self.unpacked(z)
        m, rigid, flights = self.mechanism, len(self.mechanism.rigid_stops), self.signature.flights
        found = {}
        for k, (number, side) in enumerate(self.signature.impacts if flights else ()):
            if number < rigid:
                continue
            modes = flights[k - 1].mode, flights[k].mode
            before, after = (state_in(m, code, number) for code in modes)
            element = m.elements[number]
            y = compiled.embedded(states[k, :-1], states[k, -1])
            if before in element.slipping and after == element.holding and one_level(m, number):
                _, row, constant = far_limit(compiled, modes[1], number, before)
                found[f"{STICK} {k}"] = float(row @ y + constant)
            if {before, after} == element.slipping:
                mode = compiled.modes[flights[k].mode]
                slip = next(guard for guard in mode.guards if guard.contact == number)
                found[f"{STICK} {k}"] = side * float(slip.row @ (mode.b @ y + mode.constant))
                if (
                    beyond := beyond_static(
                        compiled.mechanism,
                        lambda code: self.in_mode(code, p),
                        modes[1],
                        number,
                        states[k],
                    )
                ) is not None:
                    found[f"{REST} {k}"] = beyond
        return found


def rests_of(m: Mechanism, signature: Signature) -> dict[int, str]:
    """Flights in which a stop is rested on or friction sticks, from the event of a contact to its next.

    REST by their numbers, and CHATTER where they begin with chatter.
    """
    rigid, found = len(m.rigid_stops), {}
    for k, (end, begun) in enumerate(zip(signature.ends, signature.begun, strict=False)):
        if end.contact != signature.impacts[k].contact:
            continue
        if end.contact < rigid:
            rests = end.watch == FORCE_WATCH
        else:
            rests = state_in(m, end.mode, end.contact) == m.elements[end.contact].holding
        if rests:
            found[k] = CHATTER if begun == CHATTER_WATCH else REST
    return found


def lossless(m: Mechanism, signature: Signature) -> bool:
    """Whether every product of multipliers mu, 1 / mu is one: (3) vanishes identically."""
    unmet = signature.eventless and not m.switching
    return (unmet or all(e.conserves for e in m.elements)) and linear.largest(m.damping) == 0.0


@cache
def pairs_of(count: int) -> tuple[Integers, Integers]:
    """First and second numbers of all pairs among so many."""
    return np.triu_indices(count, 1)


def products_of_pairs(values: Complexes, without: tuple[int, int] | None = None) -> Floats:
    """Products of (3) of multipliers in rows, without one pair if it is named; NaN where one is infinite."""
    i, j = pairs_of(values.shape[-1])
    factors = 1.0 - values[..., i] * values[..., j]
    if without:
        factors = factors[..., (i != min(without)) | (j != max(without))]
    products = factors.prod(axis=-1).real
    return np.where(np.isfinite(products), products, math.nan)


def columns_of(rows: Sequence[Mapping[str, float]]) -> dict[str, Floats]:
    """Values by name of some points as arrays; NaN where a point has no such value."""
    return {name: np.array([row.get(name, math.nan) for row in rows]) for name in rows[0]}
