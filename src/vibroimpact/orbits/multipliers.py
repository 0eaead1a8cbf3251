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

from collections.abc import Sequence
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
    basis, kept = np.eye(len(slopes)), [i for i in range(len(slopes)) if i != j]
    basis[j] = -slopes / slopes[j]
    return basis[:, kept], kept


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
        (found,) = eigenvalues_of([self])
        return np.asarray(found)

    def determinant(self, at: float) -> float:
        """Determinant (3) for lambda = at."""
        return float(np.linalg.det(self.a - at * self.b))


def eigenvalues_of(every: Sequence[Pencil]) -> Complexes:
    """Multipliers of pencils of the same equations, shape (k, finite)."""
    width, finite = len(every[0].a), every[0].finite
    alpha, beta = np.empty((len(every), width), np.complex128), np.empty((len(every), width))
    for k, one in enumerate(every):
        known = np.isfinite(one.a).all()
        alpha[k], beta[k] = pencils.eigenvalues(one.a, one.b) if known else (np.nan, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):  # infinite; NaN of a singular pencil
        sizes = np.abs(beta)
        nearness = sizes / np.hypot(np.abs(alpha), sizes)
        order = np.argsort(nearness, axis=1)[:, width - finite :]
        values = np.take_along_axis(alpha, order, 1) / np.take_along_axis(beta, order, 1)
    values = sorted_multipliers(values)
    for row, one in zip(values, every, strict=True):
        row[finite - one.zeros :] = 0.0
    values[np.isnan(beta).all(axis=1)] = complex(np.nan, np.nan)
    return values


def sorted_multipliers(values: Complexes) -> Complexes:
    """Sort the last axis by modulus, largest first; of a pair, the one in the upper half plane is first."""
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 9)), axis=-1)
    return np.take_along_axis(values, order, -1)


def with_structural(found: Complexes, held: Held) -> Complexes:
    """Multipliers of a pencil and those of what all modes hold: 0 of limits, 1 of places that are anywhere."""
    known = np.array([1.0] * len(held.places) + [0.0] * len(held.ends))
    if not known.size:
        return found
    return sorted_multipliers(
        np.append(found, np.broadcast_to(known, (*found.shape[:-1], known.size)), -1)
    )


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
        problem = self.problem
        section = parts.before[-1].copy()
        # of its guard's slopes only the phase matters, here that of the start
        section[-1] -= problem.turn[-1] if problem.mechanism.forces else 0.0
        slopes = compiled.slopes(problem.signature.first, section)[problem.kept]
        basis, kept = section_basis(slopes, problem.left_out(compiled))
        chosen = [k for k, i in enumerate(kept) if i not in problem.pivots]
        if problem.held.entries:
            basis, chosen = self._beside_held(compiled, parts, basis, kept, chosen)
        basis, kept = basis[:, chosen], [kept[k] for k in chosen]
        sizes = self.sizes[kept]
        rows, columns = np.append(sizes, self._guards), np.append(sizes, self._times)
        matrix = problem.closing_equations.pencil(
            parts.after_by, parts.gap_by, basis, kept, rows, columns
        )
        zeros = max(compiled.layout.forgotten) - len(problem.held.ends) + self._jumps
        return Pencil(matrix, self._marks, self._free, zeros)

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
