"""Maps whose invariant circles are computed, evaluated at all nodes of a circle at once.

Method      Map of a signature: from a point xi of the section of its first event, an impact or a change of state
            of an element, m flights in their modes with the events at their ends; the flight times t_k are the
            zeros of the guards that are reached,
                gap_k(zeta_k, t_k, p) = 0,   zeta_(k+1) = F(zeta_k, t_k, p),                     (1)
            by Newton's method from given times, for all points in one call of the kernel. With
            g = gap_k and dt_k = -(g_zeta dzeta + g_p dp) / g_t the derivatives are
                dzeta_(k+1) = (F_zeta - F_t g_zeta / g_t) dzeta_k + (F_p - F_t g_p / g_t) dp.    (2)
            The end is mirrored for the half map, and the phase loses the turns of the signature,
            so that a circle that is born from a periodic orbit is a closed curve in its phase too.
            The section is where the guard u of the first event has its limit; with the phase, for a stop that
            moves, and with the parameter it changes its place. The entry of zeta that it leaves out is
                zeta_j - (u - limit) / u_j,   dzeta_j = -(u_zeta dzeta + (u - limit)_p dp) / u_j, (3)
            exact for a place or speed, in which u is linear; a phase is found in a few steps. What is held all the
            time, as a stop that is rested on, gives more such entries at once; friction that sticks all the time
            stays at its place.
            Along a drift that the orbit equations leave out (orbits/problem.py) the circle need not close.
Assumes     events at which the guard changes its sign, g_t != 0
Accuracy    rounding of the flights
Fails       NaN where the flight times are not found
Reference   theory.md, "Periodic orbits" and "Invariant circles"
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from vibroimpact._core.pencils import solved
from vibroimpact._core.types import Floats
from vibroimpact.compile.prescribed import (
    CHATTER_WATCH,
    GAP_WATCH,
    NONE_LEFT_OUT,
    End,
    Linearised,
    Prescribed,
)
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.system import System
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.orbits.problem import OrbitProblem, Signature

TIME_NEWTON_STEPS = 20  # Newton's method for (1) takes so many steps at most
PHASE_NEWTON_STEPS = 8  # and for the phase of a section
# The step after one that is so small, which is still taken, is its square.
SMALL_STEP_RELATIVE = 1e-8
LARGEST_STEP_OF_FLIGHT = 0.25  # a step changes a flight time by no larger share


class Images(NamedTuple):
    """Images of points, with first derivatives.

    ``times`` are the flight times (N, m), ``rates`` the rates (N, m) at which the guards at their ends approach
    their limits, of impacts the closing speeds; both with m = 0 for a formula.
    """

    points: Floats  # (N, d)
    by_point: Floats  # (N, d, d)
    by_parameter: Floats  # (N, d)
    times: Floats
    rates: Floats


class CircleMap(Protocol):
    """A map with derivatives, evaluated at many points."""

    @property
    def sizes(self) -> Floats:
        """Size of each coordinate, shape (d,)."""

    def system_at(self, p: float) -> System | ExplicitMap:
        """The system at the parameter p, or the formula."""

    def images(self, points: Floats, p: float, times: Floats) -> Images:
        """Images of points (N, d) at the parameter p, from guesses of the flight times (N, m)."""


@dataclass(frozen=True, eq=False)
class FormulaMap:
    """A map given by a formula."""

    formula: ExplicitMap

    @property
    def sizes(self) -> Floats:
        """Sizes of the formula's coordinates."""
        return np.array(self.formula.sizes[:-1])

    def system_at(self, p: float) -> ExplicitMap:  # noqa: ARG002 - it is no part of it
        """The formula, at any p."""
        return self.formula

    def images(self, points: Floats, p: float, times: Floats) -> Images:
        """Images of points, one after the other."""
        values = np.array([self.formula(x, p) for x in points])
        parts = [self.formula.linearised(x, p) for x in points]
        by_point, by_parameter = (np.array(part) for part in zip(*parts, strict=True))
        return Images(values, by_point, by_parameter, times, np.empty((len(points), 0)))


@dataclass(frozen=True, eq=False)
class SignatureMap:
    """Half map of a symmetric signature, or full map of another, in the section of its first event.

    ``base`` is a state (x, v, theta) of the section, next to which what the coordinates leave out is sought.
    """

    system: System
    signature: Signature
    parameter: str
    sizes: Floats = field(repr=False)
    base: tuple[float, ...] = ()

    @cached_property
    def problem(self) -> OrbitProblem:
        """The orbit equations with the same flights."""
        return OrbitProblem(self.system, self.signature, self.parameter)

    @cached_property
    def numbers(self) -> list[int]:
        """Numbers of the coordinates among the unknowns of a state of the orbit equations."""
        problem = self.problem
        left_out = problem.left_out(problem.own), *problem.pivots, *problem.held.entries
        return [i for i in range(problem.size) if i not in left_out]

    @cached_property
    def kept(self) -> tuple[int, ...]:
        """Entries of (x, v, theta) that are the coordinates."""
        return tuple(self.problem.kept[i] for i in self.numbers)

    @cached_property
    def _given(self) -> tuple[list[End], list[int]]:
        """Limits at which all points of the section are, and the entries of (x, v, theta) that follow from them."""
        problem, first = self.problem, self.signature.first
        limits, numbers = [*problem.held.ends], problem.held.entries[: len(problem.held.ends)]
        if (left_out := problem.left_out(problem.own)) != NONE_LEFT_OUT:
            chatters = first.watch == CHATTER_WATCH
            limits = [*limits, first._replace(watch=GAP_WATCH) if chatters else first]
            numbers = [*numbers, left_out]
        return limits, [problem.kept[i] for i in numbers]

    @property
    def forgotten(self) -> int:
        """Number of directions that are lost within an iterate: friction sticks, a stop is rested on, a reset."""
        problem = self.problem
        most = max(problem.own.modes[mode].forgotten for mode in problem.modes)
        jumps = problem.left_out(problem.own) == NONE_LEFT_OUT
        return most - len(problem.held.ends) + jumps

    def system_at(self, p: float) -> System:
        """The system at a value of the parameter."""
        return with_parameter(self.system, self.parameter, p) if self.parameter else self.system

    def states(self, points: Floats, p: float) -> Floats:
        """States (N, 2n + 1) of section points: (3)."""
        compiled, problem = self.problem.compiled(p), self.problem
        states = np.zeros((len(points), compiled.size))
        states[:] = self.base or 0.0
        states[:, [problem.kept[i] for i in problem.pivots]] = 0.0
        states[:, list(self.kept)] = points
        limits, entries = self._given
        steps = PHASE_NEWTON_STEPS if compiled.size - 1 in entries else 1
        for _ in range(steps if limits else 0):
            gaps, slopes = self._at_limits(compiled, states)
            states[:, entries] -= solved(slopes[:, :, entries], gaps[:, :, None])[:, :, 0]
        if self.problem.massless:
            return compiled.with_speeds(states, self.problem.modes[:1] * len(states))
        return states

    def coordinates(self, states: Floats) -> Floats:
        """Section points of states."""
        unknowns = states[:, self.problem.kept]
        if self.problem.pivots:
            unknowns = unknowns @ self.problem.relative.T
        return unknowns[:, self.numbers]

    def images(self, points: Floats, p: float, times: Floats) -> Images:
        """Images of points."""
        compiled, problem = self.problem.compiled(p), self.problem
        states = self.states(points, p)
        by_point, by_parameter = self._tangents(compiled, states)
        spent, rates = np.array(times), np.empty_like(times)
        for k, end in enumerate(problem.ends):
            spent[:, k], parts = _landed(compiled, states, times[:, k], [end] * len(points))
            jump, moved = _transition(parts)
            by_parameter = np.einsum("nij,nj->ni", jump, by_parameter) + moved
            by_point = jump @ by_point
            states, rates[:, k] = parts.after, end.side * parts.rate
        unknowns = states[:, problem.kept]
        by_point, by_parameter = by_point[:, problem.kept], by_parameter[:, problem.kept]
        if problem.pivots:
            unknowns, by_parameter = (
                unknowns @ problem.relative.T,
                by_parameter @ problem.relative.T,
            )
            by_point = problem.relative @ by_point
        source, mirror = problem.source[self.numbers], problem.signs[self.numbers]
        back = problem.turn.copy()  # the symmetry is its own inverse, but for the phase
        back[-1] *= -1.0 if problem.mechanism.forces else 1.0
        return Images(
            mirror * unknowns[:, source] + back[self.numbers],
            mirror[:, None] * by_point[:, source],
            mirror * by_parameter[:, source],
            spent,
            rates,
        )

    def departures(self, points: Floats, p: float, times: Floats) -> Floats:
        """States at the start of all flights of all points, in rows n m + k."""
        compiled, ends = self.problem.compiled(p), self.problem.ends
        begun = [self.states(points, p)]
        for k, end in enumerate(ends[:-1]):
            begun.append(compiled.linearise(begun[k], times[:, k], [end] * len(points)).after)
        return np.stack(begun, axis=1).reshape(-1, begun[0].shape[1])

    def _at_limits(self, compiled: Prescribed, states: Floats) -> tuple[Floats, Floats]:
        """Distances (N, s) from the limits of the section, and their derivatives by the state and, last, by p."""
        limits, _ = self._given
        here = np.repeat(states, len(limits), axis=0)
        parts = compiled.linearise(here, np.zeros(len(here)), limits * len(states))
        columns = [*range(compiled.size), -1]
        shape = len(states), len(limits)
        return parts.gap.reshape(shape), parts.gap_by[:, columns].reshape(*shape, -1)

    def _tangents(self, compiled: Prescribed, states: Floats) -> tuple[Floats, Floats]:
        """Derivatives (3) of states of the section by its coordinates and by the parameter."""
        (limits, entries), kept, count = self._given, list(self.kept), len(states)
        by_point = np.tile(np.eye(compiled.size)[:, kept], (count, 1, 1))
        by_parameter = np.zeros((count, compiled.size))
        if limits:
            slopes = self._at_limits(compiled, states)[1]
            moves = -solved(slopes[:, :, entries], slopes[:, :, [*kept, -1]])
            by_point[:, entries], by_parameter[:, entries] = moves[:, :, :-1], moves[:, :, -1]
        return by_point, by_parameter


def impact_map(system: System, signature: Signature, scale: Floats, state: Floats) -> SignatureMap:
    """Map of one system, from the sizes of x, v and theta and a state of its section."""
    unscaled = SignatureMap(system, signature, "", scale, tuple(state.tolist()))
    return replace(unscaled, sizes=scale[list(unscaled.kept)])


def _landed(
    compiled: Prescribed, states: Floats, times: Floats, ends: list[End]
) -> tuple[Floats, Linearised]:
    """Flight times (1), and the flights with their derivatives."""
    times, size = times.copy(), np.maximum(np.abs(times), np.finfo(float).tiny)
    near = False
    for _ in range(TIME_NEWTON_STEPS):
        parts = compiled.linearise(states, times, ends)
        if near:
            return times, parts
        with np.errstate(all="ignore"):
            step = -parts.gap / parts.gap_by[:, -2]
        if not np.isfinite(step).all():
            break
        near = bool((np.abs(step) <= SMALL_STEP_RELATIVE * size).all())
        times = times + np.clip(step, -LARGEST_STEP_OF_FLIGHT * size, LARGEST_STEP_OF_FLIGHT * size)
    nothing = np.full_like(parts.after, np.nan)
    return np.full_like(times, np.nan), parts._replace(after=nothing)


def _transition(parts: Linearised) -> tuple[Floats, Floats]:
    """Derivatives (2) of the state after the event, by the state before and by the parameter."""
    q = parts.after.shape[1]
    with np.errstate(all="ignore"):
        by_time = parts.after_by[:, :, -2] / parts.gap_by[:, -2, None]
    jump = parts.after_by[:, :, :q] - by_time[:, :, None] * parts.gap_by[:, None, :q]
    moved = parts.after_by[:, :, -1] - by_time * parts.gap_by[:, -1, None]
    return jump, moved
