"""Floquet multipliers of an orbit from the pencil of its segments.

Method      With dzeta_0 = E dxi in the section of the first impact and dt_k the changes of the
            flight times, the linearised segments give the end of the period and the gaps
                dzeta_m = L_m (dxi, dt),    dgap_k = r_k L_k (dxi, dt) + u'_k dt_k = 0.        (1)
            Multipliers are the finite eigenvalues of the pencil
                [K dzeta_m; dgap] - lambda [dxi; 0],                                           (2)
            K selecting the section's coordinates ((x, v) except one, theta). Eliminating dt_k would
            divide by the closing rate u'_k, as the saltation matrix does; (2) does not, so that at
            grazing one multiplier goes to infinity and the others are as exact as elsewhere.
            det (2) = +-(product of u'_k) det(DP - lambda): pole-free test functions.          (3)
            While friction sticks its slip speed cannot change, and while a slider slips its place
            follows from the others: so many multipliers are zero as do so at once, and are set
            to zero. The velocity of a massless coordinate is no state, and has none. Where the first event
            resets the state, K is the unit matrix, and a displacement along the flow has the multiplier zero. (4)
            What all modes hold is not among dxi: its multipliers are known ((5) of problem.py).
Accuracy    that of the QZ algorithm, relative to the largest multiplier
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibroimpact._core import pencils
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.compile.prescribed import NONE_LEFT_OUT, Linearised, Prescribed
from vibroimpact.orbits.newton import guard_sizes
from vibroimpact.orbits.problem import Held, OrbitProblem


def section_basis(slopes: Floats, j: int) -> tuple[Floats, list[int]]:
    """(E, kept): tangents of the section of a guard, and the unknowns that are its coordinates.

    ``slopes`` are the derivatives of the guard by the unknowns of a state, ``j`` is the one left out; with
    NONE_LEFT_OUT it is all of space.
    """
    if j == NONE_LEFT_OUT:
        return np.eye(len(slopes)), [*range(len(slopes))]
    kept = [i for i in range(len(slopes)) if i != j]
    basis = np.eye(len(slopes))[:, kept]
    basis[j] = -slopes[kept] / slopes[j]
    return basis, kept


class Pencil(NamedTuple):
    """Pencil (2) as matrix A - lambda B, and the numbers of finite and of zero eigenvalues (4)."""

    a: Floats
    b: Floats
    finite: int
    zeros: int = 0

    def eigenvalues(self) -> Complexes:
        """Multipliers, largest modulus first; complex infinity for those that are infinite.

        NaN where entries have overflowed.
        """
        if not np.all(np.isfinite(self.a)):
            return np.full(self.finite, complex(np.nan, np.nan))
        alpha, beta = pencils.eigenvalues(self.a, self.b)
        with np.errstate(divide="ignore", invalid="ignore"):  # infinite; NaN of a singular pencil
            nearness = np.abs(beta) / np.hypot(np.abs(alpha), np.abs(beta))
            order = np.argsort(nearness)[len(self.a) - self.finite :]
            values: Complexes = np.asarray(alpha[order] / beta[order], np.complex128)
        values = sorted_multipliers(values)
        values[len(values) - self.zeros :] = 0.0
        return values

    def determinant(self, at: float) -> float:
        """Determinant (3) for lambda = at."""
        return float(np.linalg.det(self.a - at * self.b))


def sorted_multipliers(values: Complexes) -> Complexes:
    """Sort by modulus, largest first; of a pair, the one in the upper half plane is first."""
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 9)))
    return values[order]


def with_structural(found: Complexes, held: Held) -> Complexes:
    """Multipliers of a pencil and those of what all modes hold: 0 of limits, 1 of places that are anywhere."""
    known = [1.0] * len(held.places) + [0.0] * len(held.ends)
    return sorted_multipliers(np.append(found, known)) if known else found


class PencilOf:
    """Pencils of the map of orbits that solve the same equations; the half map if their signature is symmetric.

    Parameters
    ----------
    problem
        The equations.
    sizes
        Sizes of the unknowns of one segment: rows and columns are scaled by them, so that QZ does
        not depend on units. Fixed along a branch, where the determinant is followed.
    """

    def __init__(self, problem: OrbitProblem, sizes: Floats) -> None:
        self.problem, self.sizes = problem, sizes
        self._guards = guard_sizes(problem, sizes)
        self._times = np.full(len(self._guards), sizes[problem.size])
        self._jumps = problem.left_out(problem.own) == NONE_LEFT_OUT
        section = (not self._jumps) + len(problem.pivots) + len(problem.held.entries)
        self._free = problem.size - section
        width = self._free + len(self._guards)
        self._marks = np.diag(np.arange(width) < self._free).astype(float)

    def at(self, compiled: Prescribed, parts: Linearised) -> Pencil:
        """Pencil of an orbit, from the system compiled at its parameter and its solved segments."""
        problem, count = self.problem, len(self._guards)
        q, states, time = problem.size, problem.kept, 2 * compiled.degrees + 1
        section = parts.before[
            -1
        ].copy()  # of its guard's slopes only the phase matters, here that of the start
        section[-1] -= problem.turn[-1] if problem.mechanism.forces else 0.0
        slopes = compiled.slopes(problem.signature.first, section)[states]
        basis, kept = section_basis(slopes, problem.left_out(compiled))
        chosen = [k for k, i in enumerate(kept) if i not in problem.pivots]
        if problem.held.entries:
            basis, chosen = self._beside_held(compiled, parts, basis, kept, chosen)
        basis, kept = basis[:, chosen], [kept[k] for k in chosen]
        after_by, gap_by = parts.after_by[:, states], parts.gap_by[:, states]
        free = self._free
        width = free + count
        tangent, gaps = np.zeros((q, width)), np.zeros((count, width))
        tangent[:, :free] = basis
        for k in range(count):
            gaps[k] = gap_by[k] @ tangent
            gaps[k, free + k] += parts.gap_by[k, time]
            tangent = after_by[k][:, states] @ tangent
            tangent[:, free + k] += after_by[k, :, time]
        ends = problem.reflected(problem.relative @ tangent)[kept]
        rows = np.concatenate([self.sizes[kept], self._guards])
        columns = np.concatenate([self.sizes[kept], self._times])
        scaled = np.vstack([ends, gaps]) / rows[:, None] * columns
        zeros = max(compiled.layout.forgotten) - len(problem.held.ends) + self._jumps
        return Pencil(scaled, self._marks, free, zeros)

    def _beside_held(
        self,
        compiled: Prescribed,
        parts: Linearised,
        basis: Floats,
        kept: list[int],
        chosen: list[int],
    ) -> tuple[Floats, list[int]]:
        """Tangents along which (5) of problem.py stays, and the numbers of those that are left."""
        ends, places, entries = self.problem.held
        states = np.repeat(parts.after[-1:], len(ends), axis=0)
        rows = compiled.linearise(states, np.zeros(len(ends)), ends).gap_by[:, self.problem.kept]
        across = np.vstack([rows, places]) @ basis
        held = [kept.index(j) for j in entries]
        left = [k for k in chosen if k not in held]
        basis = basis.copy()
        basis[:, left] -= basis[:, held] @ np.linalg.solve(across[:, held], across[:, left])
        return basis, left
