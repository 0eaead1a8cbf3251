"""Maps whose invariant circles are computed, evaluated at all nodes of a circle at once.

Method      Impact map of a signature: from a point xi of the section of its first impact, m flights
            and impacts; the flight times t_k are the zeros of the gaps,
                gap_k(zeta_k, t_k, p) = 0,   zeta_(k+1) = F(zeta_k, t_k, p),                     (1)
            by Newton's method from given times, for all points in one call of the kernel. With
            g = gap_k and dt_k = -(g_zeta dzeta + g_p dp) / g_t the derivatives are
                dzeta_(k+1) = (F_zeta - F_t g_zeta / g_t) dzeta_k + (F_p - F_t g_p / g_t) dp.    (2)
            The end is mirrored for the half map, and the phase loses the turns of the signature,
            so that a circle that is born from a periodic orbit is a closed curve in its phase too.
            The section's own place moves with the parameter,
                x_j = (limit - sum over i != j of row_i x_i) / row_j.                            (3)
Assumes     impacts that are not grazing, g_t != 0
Accuracy    rounding of the flights
Fails       NaN where the flight times are not found
Reference   theory.md, "Periodic orbits" and "Invariant circles"
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact._kernel import Jet
from vibroimpact.compile.prescribed import Linearised, Prescribed, compile_prescribed
from vibroimpact.model.parameters import expanded, with_parameter
from vibroimpact.model.system import System
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.orbits.multipliers import section_basis
from vibroimpact.orbits.problem import OrbitProblem, Signature

TIME_NEWTON_STEPS = 20  # Newton's method for (1) takes so many steps at most
# The step after one that is so small, which is still taken, is its square.
SMALL_STEP_RELATIVE = 1e-8
LARGEST_STEP_OF_FLIGHT = 0.25  # a step changes a flight time by no larger share


class Images(NamedTuple):
    """Images of points, with first derivatives.

    ``times`` are the flight times (N, m), ``rates`` the speeds of approach at the impacts (N, m),
    both with m = 0 for a formula.
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
    """Half map of a symmetric signature, or full map of another, in the first impact's section."""

    system: System
    signature: Signature
    parameter: str
    sizes: Floats = field(repr=False)

    @cached_property
    def problem(self) -> OrbitProblem:
        """The orbit equations with the same flights."""
        return OrbitProblem(self.system, self.signature, self.parameter)

    @cached_property
    def kept(self) -> tuple[int, ...]:
        """Entries of (x, v, theta) that are the coordinates."""
        return tuple(i for i in range(self.problem.size) if i != self._left_out)

    @cached_property
    def _left_out(self) -> int:
        compiled = compile_prescribed(self.system, self.parameter)
        return compiled.solved_coordinate(self.signature.first)

    def system_at(self, p: float) -> System:
        """The system at a value of the parameter."""
        return with_parameter(self.system, self.parameter, p) if self.parameter else self.system

    def states(self, points: Floats, p: float) -> Floats:
        """States (N, 2n + 1) of section points: (3)."""
        m = self.problem.compiled(p).mechanism
        first, j = self.signature.impacts[0], self._left_out
        row, limit = np.array(m.rigid_stops[first.contact].row), first.limit(m.rigid_stops)
        states = np.zeros((len(points), 2 * m.degrees + 1))
        states[:, list(self.kept)] = points
        states[:, j] = (limit - states[:, : len(row)] @ row) / row[j]
        return states

    def coordinates(self, states: Floats) -> Floats:
        """Section points of states."""
        return states[:, list(self.kept)]

    def images(self, points: Floats, p: float, times: Floats) -> Images:
        """Images of points."""
        compiled, q = self.problem.compiled(p), self.problem.size
        states = self.states(points, p)
        slopes = compiled.slopes(self.signature.first, states[0])
        basis, kept = section_basis(slopes[:q], self._left_out)
        by_point = np.tile(basis, (len(points), 1, 1))
        by_parameter = np.zeros((len(points), q))
        by_parameter[:, self._left_out] = self._section_moves(states, p)
        spent, rates = np.array(times), np.empty_like(times)
        for k, stop in enumerate(self.problem.impacts):
            spent[:, k], parts = _landed(compiled, states, times[:, k], [stop] * len(points))
            jump, moved = _transition(parts, q)
            by_parameter = np.einsum("nij,nj->ni", jump, by_parameter) + moved
            by_point = jump @ by_point
            states, rates[:, k] = parts.after, stop.side * parts.rate
        source, mirror = self.problem.source[kept], self.problem.signs[kept]
        back = self.problem.turn.copy()  # the symmetry is its own inverse, but for the phase
        back[-1] *= -1.0 if compiled.mechanism.forces else 1.0
        ends = mirror * states[:, source] + back[kept]
        return Images(
            ends,
            mirror[:, None] * by_point[:, source],
            mirror * by_parameter[:, source],
            spent,
            rates,
        )

    def departures(self, points: Floats, p: float, times: Floats) -> Floats:
        """States at the start of all flights of all points, in rows n m + k."""
        compiled, impacts = self.problem.compiled(p), self.problem.impacts
        begun = [self.states(points, p)]
        for k, stop in enumerate(impacts[:-1]):
            begun.append(compiled.linearise(begun[k], times[:, k], [stop] * len(points)).after)
        return np.stack(begun, axis=1).reshape(-1, begun[0].shape[1])

    def _section_moves(self, states: Floats, p: float) -> Floats:
        """Derivative of (3) by the parameter, at fixed other coordinates."""
        if not self.parameter:
            return np.zeros(len(states))
        first, j = self.signature.impacts[0], self._left_out
        varied = expanded(self.system_at(p), self.parameter)
        row = varied.rigid_stops[first.contact].row
        slopes = np.array([_slope(r) for r in row])
        fixed = self.problem.compiled(p).mechanism.rigid_stops[first.contact].row[j]
        limit = _slope(first.limit(varied.rigid_stops))
        return np.asarray((limit - states[:, : len(row)] @ slopes) / fixed, dtype=np.float64)


def impact_map(system: System, signature: Signature, scale: Floats) -> SignatureMap:
    """Map of one system, from the sizes of x, v and theta."""
    unscaled = SignatureMap(system, signature, "", scale)
    return replace(unscaled, sizes=scale[list(unscaled.kept)])


def _slope(x: object) -> float:
    """Derivative of a number or a jet by the parameter."""
    return float(x.coefficients[1]) if isinstance(x, Jet) else 0.0


def _landed(
    compiled: Prescribed, states: Floats, times: Floats, ends: list[tuple[int, int]]
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


def _transition(parts: Linearised, q: int) -> tuple[Floats, Floats]:
    """Derivatives (2) of the state after the impact, by the state before and by the parameter."""
    with np.errstate(all="ignore"):
        by_time = parts.after_by[:, :q, -2] / parts.gap_by[:, -2, None]
    jump = parts.after_by[:, :q, :q] - by_time[:, :, None] * parts.gap_by[:, None, :q]
    moved = parts.after_by[:, :q, -1] - by_time * parts.gap_by[:, -1, None]
    return jump, moved
