"""Periodic orbits with their multipliers, stability and admissibility."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import InitVar, dataclass, field
from functools import cached_property

import numpy as np

from vibroimpact._core.checks import nonnegative
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import AnyAmount, Complexes, Durations, Floats
from vibroimpact.attractors.orbit_type import symbol_word
from vibroimpact.compile.modes import closed_from_code
from vibroimpact.compile.prescribed import CHATTER_WATCH, GAP_WATCH, Linearised
from vibroimpact.machines.units import units_of
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.stand_ins import stand_ins
from vibroimpact.model.state import State, names_of_state
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System
from vibroimpact.orbits.admissibility import (
    Nearest,
    Place,
    amplitudes,
    least_gaps,
    relative_gap,
    why_inadmissible,
)
from vibroimpact.orbits.multipliers import PencilOf, with_structural
from vibroimpact.orbits.newton import (
    FOUND,
    ROUNDING_OF_TERMS,
    family_dimension,
    guard_sizes,
    scale_of,
)
from vibroimpact.orbits.problem import OrbitProblem, Signature, impacting
from vibroimpact.orbits.reversals import held_reversal
from vibroimpact.orbits.stability import (
    SPLIT_DISTANCE,
    Stability,
    attracts,
    in_words,
    stability_of,
)
from vibroimpact.results.result import Result, along, complex_columns

# A guard whose rate is smaller, relative to its changes in a flight time, is only touched.
TOUCHING_RATE_OF_CHANGE = 1e-7
LARGEST_RESIDUAL = 1e-8  # with larger relative residuals Newton's method has not converged


@dataclass(frozen=True, eq=False)
class Orbit(Result):
    """Periodic orbit with prescribed impacts, of any stability, admissible or not.

    One that is not ``converged`` is neither admissible nor stable, and its multipliers are NaN.

    Attributes
    ----------
    system
        The system.
    signature
        :class:`Signature`: impacts, cycles, symmetric.
    states
        (x, v, theta) just after each impact of the signature that begins a solved segment (all of
        them, or the first half of a symmetric orbit), shape (m, 2n + 1). The velocities of massless
        coordinates are those in the flight that begins.
    durations
        Flight times of these segments, shape (m,).
    residual
        Largest residual of an equation, relative to the size of its terms; above 1e-8 the orbit is
        not converged.
    status
        "converged", or a sentence with the reason of the failure.
    parameter
        The parameter along which it was found, "" for none; it does not affect the orbit.
    """

    system: System
    signature: Signature
    states: Floats = field(metadata=along("segment", "entry"), repr=False)
    durations: Durations = field(metadata=along("segment", quantity="time"), repr=False)
    residual: AnyAmount
    status: str = FOUND
    parameter: str = field(default="", repr=False)
    solved: InitVar[OrbitProblem | None] = None  # the equations, where they are at hand

    def __post_init__(self, solved: OrbitProblem | None) -> None:
        if solved is not None:
            vars(self)["problem"] = solved
        if self.status == FOUND and not self.residual <= LARGEST_RESIDUAL:
            status = f"no convergence: relative residual {self.residual:.1e}"
            object.__setattr__(self, "status", status)
        if self.problem.massless:
            compiled = self.problem.own
            states = compiled.with_speeds(self.states, self.problem.modes)
            object.__setattr__(self, "states", states)

    @property
    def converged(self) -> bool:
        """Whether the equations hold."""
        return self.status == FOUND

    @property
    def symmetric(self) -> bool:
        """Whether it was solved as its own mirror image."""
        return self.signature.symmetric

    @cached_property
    def problem(self) -> OrbitProblem:
        """Equations that the orbit solves."""
        return OrbitProblem(self.system, self.signature, self.parameter)

    @property
    def parameter_value(self) -> float:
        """Value of the parameter along which the orbit was found."""
        return parameter_value(self.system, self.parameter) if self.parameter else 0.0

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the system."""
        return self.problem.mechanism

    @property
    def _sizes(self) -> Floats:
        """Sizes of the changes of the unknowns."""
        known = self.problem.common_sizes
        if known is not None:
            return known
        return scale_of(self.problem, self.problem.packed(self.states, self.durations))

    @cached_property
    def linearised(self) -> Linearised:
        """The solved segments with their derivatives."""
        return self.problem.own.linearise(self.states, self.durations, self.problem.ends)

    @property
    def symbol(self) -> str:
        """Symbol n-p-q: cycles, impacts at stops A and B, with a pair p-q per impacting contact.

        Contacts are named unless they are the first ones: "1-2-1 (contact 1)". Meeting a soft stop
        counts as an impact; where it chatters there are infinitely many, "inf".
        """
        signature = self.signature
        struck = impacting(self.mechanism, signature)
        counts: dict[Stop, float] = {**Counter(itertools.compress(signature.impacts, struck))}
        for stop, watch in zip(signature.impacts, signature.begun, strict=True):
            if watch == CHATTER_WATCH:
                counts[stop] = math.inf
        contacts = range(len(self.mechanism.elements) if counts else 1)
        if not counts:
            return f"{signature.cycles}-0-0"
        return symbol_word(
            self.signature.cycles,
            [[counts.get(Stop(c, side), 0) for side in (1, -1)] for c in contacts],
        )

    @property
    def state(self) -> State:
        """State just after the first impact, for simulation."""
        n = self.problem.degrees
        first = self.states[0].copy()
        if self.converged and self._rests_at_first:  # nothing is left but rounding of the motion
            sizes = self._sizes
            size = np.zeros(len(first))
            size[self.problem.kept] = sizes[: self.problem.size]
            first[np.abs(first) <= ROUNDING_OF_TERMS * size] = 0.0
        theta = float(first[2 * n]) % (2.0 * math.pi * max(self.signature.cycles, 1))
        return State(tuple(first[:n]), tuple(first[n : 2 * n]), theta)

    @property
    def _rests_at_first(self) -> bool:
        """Whether its first flight rests on a rigid stop."""
        return bool(closed_from_code(self.problem.modes[0], len(self.mechanism.rigid_stops)))

    @property
    def period(self) -> float:
        """Time until the orbit closes."""
        return float(self.durations.sum()) * (2.0 if self.symmetric else 1.0)

    @cached_property
    def progress(self) -> Floats:
        """How far each coordinate advances in a period, shape (n,); zero where nothing drifts."""
        n = self.problem.degrees
        if not self.converged or not self.problem.pivots:
            return np.zeros(n) if self.converged else np.full(n, math.nan)
        z = self.problem.packed(self.states, self.durations)
        along: Floats = self.problem.drifts[:n] @ self.problem.progress(z, self.parameter_value)
        return along

    @cached_property
    def half_multipliers(self) -> Complexes | None:
        """Multipliers nu of the half map H of a symmetric orbit, largest first; else None."""
        return self._of_solved_map if self.symmetric else None

    @cached_property
    def multipliers(self) -> Complexes:
        """Floquet multipliers of the full map, largest modulus first, shape (2n,).

        One less for every massless coordinate, whose velocity is no state, and without forcing.
        NaN where the guard of an element is only touched: these orbits have no map of their own.
        """
        return self._of_solved_map**2 if self.symmetric else self._of_solved_map

    @cached_property
    def rateless(self) -> list[int]:
        """Numbers of the solved segments at whose end an element's guard is only touched."""
        return [
            k
            for k, speed in enumerate(self._speeds_of_changes)
            if abs(speed) <= TOUCHING_RATE_OF_CHANGE
        ]

    @property
    def from_behind(self) -> list[int]:
        """Numbers of the solved segments at whose end an element's guard is reached from beyond."""
        return [
            k for k, speed in enumerate(self._speeds_of_changes) if speed < -TOUCHING_RATE_OF_CHANGE
        ]

    @cached_property
    def _speeds_of_changes(self) -> list[float]:
        """Rates at which guards of elements are reached, in changes per flight.

        1 of rigid stops, and of chatter.
        """
        ends = self.problem.ends
        if not self.signature.flights:
            return [1.0] * len(ends)
        sizes = self._sizes
        units = guard_sizes(self.problem, sizes) / sizes[self.problem.size]
        speeds = self.linearised.rate / units
        return [
            1.0 if e.watch in (GAP_WATCH, CHATTER_WATCH) else e.side * float(v)
            for e, v in zip(ends, speeds, strict=True)
        ]

    @cached_property
    def _of_solved_map(self) -> Complexes:
        if not self.converged or self.rateless:
            free = self.problem.size - 1 - len(self.problem.pivots)
            return np.full(free, complex(math.nan, math.nan))
        pencils = PencilOf(self.problem, self._sizes)
        found = pencils.at(self.problem.own, self.linearised).eigenvalues()
        return with_structural(found, self.problem.held)

    @property
    def zero_multipliers(self) -> int:
        """Number of multipliers that are zero by construction: friction sticks, a slider slips, a stop is rested on.

        All forget where the motion came from; a stop that is rested on gives two.
        """
        compiled = self.problem.own
        return max(compiled.modes[mode].forgotten for mode in self.problem.modes)

    @cached_property
    def determinant_error(self) -> float:
        """Error of the product of the multipliers, relative to its exact value if that is not 0.

        The product is that of R^2 over all impacts, times exp(-sum of t_k tr(M^-1 C)) over all
        flights, C that of their modes, times the ratio of the rates of the guard after and before
        every change of state; with friction that sticks, a slider that slips, or a rest, it is zero. Large
        where a multiplier is below the rounding of the others.
        """
        contacts, turns = self.mechanism.rigid_stops, 2.0 if self.symmetric else 1.0
        modes = self.problem.own.modes
        growth = [modes[mode].growth for mode in self.problem.modes]
        rigid = [stop for stop in self.signature.impacts if 0 <= stop.contact < len(contacts)]
        loss = math.prod(stop.restitution(contacts) ** 2 for stop in rigid) * self._turned
        expected = math.exp(turns * float(self.durations @ growth)) * loss
        if self.zero_multipliers:
            expected = 0.0
        error = abs(complex(np.prod(self.multipliers)) - expected)
        return error / expected if expected > 0.0 else error

    @property
    def _turned(self) -> float:
        """Product of the ratios of the rates of guards after and before changes of state."""
        compiled, ends = self.problem.own, self.problem.ends
        ratios = [1.0]
        for k, end in enumerate(ends if self.signature.flights else ()):
            following = (k + 1) % len(ends)
            if end.watch not in (GAP_WATCH, CHATTER_WATCH):
                mode, state = compiled.modes[ends[following].mode], self.states[following]
                y = compiled.embedded(state[:-1], state[-1])
                after = compiled.guard(end).row @ (mode.b @ y + mode.constant)
                ratios.append(float(after / self.linearised.rate[k]))
        return math.prod(ratios)

    @cached_property
    def family_dimension(self) -> int:
        """Dimension of the family to which this orbit belongs; 0 where it is isolated.

        Without forcing and loss there is an orbit for every energy, and for a mechanism that can be
        shifted as a whole, one for every place; and one for every place at which friction may stick all the time.
        Each dimension gives a multiplier 1.
        """
        if not self.converged or np.all(np.abs(self._of_solved_map - 1.0) > SPLIT_DISTANCE):
            return 0
        problem = OrbitProblem(self.system, self.signature, "")
        z = problem.packed(self.states, self.durations)
        return len(problem.held.places) + family_dimension(problem, z)

    @cached_property
    def stability(self) -> Stability:
        """Whether it is stable, neutral, unstable, or not admissible, by its multipliers."""
        if not self.admissible:
            return Stability.INADMISSIBLE
        return stability_of(self.multipliers, self.family_dimension)

    @property
    def stable(self) -> bool:
        """Whether it is admissible, with all multipliers inside the unit circle."""
        return self.stability is Stability.STABLE

    @property
    def attracting(self) -> bool:
        """Whether it, or the family that it is one of, attracts starts of positive measure."""
        return attracts(self.multipliers, self.family_dimension, self.stability)

    @property
    def admissible(self) -> bool:
        """Whether the orbit is a motion of the machine."""
        return not self.inadmissible_reason

    @cached_property
    def inadmissible_reason(self) -> str:
        """Violated gap with flight, time and amount; "" for an admissible orbit."""
        if not self.converged:
            return self.status
        return self.why_inadmissible()

    def why_inadmissible(self, slack: float = 0.0) -> str:
        """Violated gap, with a tolerance beyond rounding, relative to amplitude and period."""
        slack = nonnegative("slack", slack)
        ends, durations = self.problem.ends, self.durations
        why = why_inadmissible(self.linearised, ends, durations, self.gaps, self.amplitudes, slack)
        held = (
            ""
            if why or not self.signature.flights
            else held_reversal(self.system, self.states, ends)
        )
        return why or held

    @cached_property
    def amplitudes(self) -> dict[tuple[int, int], float]:
        """Sizes of the gaps, by contact and watch."""
        compiled = self.problem.own
        return amplitudes(compiled, self.states, self.durations, self.problem.ends)

    @cached_property
    def gaps(self) -> dict[Place, Nearest]:
        """Nearest approach to each stop in each flight, by (contact, side, flight)."""
        compiled, ends = self.problem.own, self.problem.ends
        begun = self.signature.impacts[: len(ends)]
        hidden = stand_ins(self.mechanism)
        return least_gaps(compiled, self.states, self.durations, ends, begun, hidden)

    @property
    def nearest(self) -> Nearest | None:
        """Nearest approach to a stop between the impacts; None where no gap has an extremum.

        With elements the margins of all their guards count, each relative to its amplitude; gaps of rigid stops
        relative to the largest of them.
        """
        if not self.signature.flights:
            return min(self.gaps.values(), default=None)
        sizes = self.amplitudes
        return min(
            self.gaps.values(), key=lambda near: (relative_gap(near, sizes), near), default=None
        )

    @property
    def clearance_to_grazing(self) -> float:
        """Gap, or margin of an element's guard, at the nearest approach; infinite where none has an extremum."""
        if not self.converged:
            return math.nan
        return self.nearest.gap if self.nearest else math.inf

    @property
    def least_impact_speed(self) -> float:
        """The smallest closing speed of an impact; infinite where there is none."""
        if not self.converged:
            return math.nan
        rates = np.abs(self.linearised.rate[self.problem.struck])
        return float(np.min(rates, initial=math.inf))

    def to_dataset(self) -> xr.Dataset:
        """Convert the orbit to an xarray dataset, with its multipliers and verdicts."""
        data = super().to_dataset()
        names = names_of_state(self.mechanism.degrees)
        data["states"].attrs |= units_of(self.system).of_entries(names)
        multipliers = complex_columns("multipliers", ("multiplier",), self.multipliers)
        return data.assign(multipliers).assign_attrs(
            symbol=self.symbol,
            period=self.period,
            stability=self.stability.words,
            inadmissible_reason=self.inadmissible_reason,
        )

    def __repr__(self) -> str:
        if not self.converged:
            return f"Orbit({self.symbol}: {self.status})"
        kind = "symmetric, " if self.symmetric else ""
        verdict = in_words(self.stability, self.family_dimension)
        why = f"; {self.inadmissible_reason}" if self.inadmissible_reason else ""
        values = ", ".join(f"{x:.6g}" for x in self.multipliers)
        period = units_of(self.system).text(self.period, quantity="time")
        return (
            f"Orbit({self.symbol}, {kind}{verdict}, period {period}{why})\n  multipliers {values}"
        )


def know(orbit: Orbit, linearised: Linearised, multipliers: Complexes) -> None:
    """Hand an orbit what was computed with its equations: the segments, and multipliers of the solved map."""
    vars(orbit)["linearised"] = linearised
    if not orbit.rateless:
        vars(orbit)["_of_solved_map"] = multipliers
