"""Floquet multipliers of an orbit from the pencil of its segments.

Method      With dzeta_0 = E dxi in the section of the first impact and dt_k the changes of the
            flight times, the linearised segments give the end of the period and the gaps
                dzeta_m = L_m (dxi, dt),    dgap_k = r_k L_k (dxi, dt) + u'_k dt_k = 0.        (1)
            Multipliers are the finite eigenvalues of the pencil
                [K dzeta_m; dgap] - lambda [dxi; 0],                                           (2)
            K selecting the section's coordinates (x except one, v, theta). Eliminating dt_k would
            divide by the closing rate u'_k, as the saltation matrix does; (2) does not, so that at
            grazing one multiplier goes to infinity and the others are as exact as elsewhere.
            det (2) = +-(product of u'_k) det(DP - lambda): pole-free test functions.          (3)
Accuracy    that of the QZ algorithm, relative to the largest multiplier
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import eigvals

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.compile.prescribed import Linearised
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import Stop
from vibroimpact.orbits.problem import OrbitProblem


def solved_coordinate(m: Mechanism, impact: Stop) -> int:
    """Position that a section leaves out: the last with the row's largest entry."""
    row = np.abs(m.contacts[impact[0]].row)
    return int(len(row) - 1 - np.argmax(row[::-1]))


def section_basis(m: Mechanism, impact: Stop, j: int, size: int) -> tuple[Floats, list[int]]:
    """(E, kept): tangents of an impact's section, and the entries of zeta that are its coordinates.

    ``j`` is the position left out; ``size`` is 2n + 1, or 2n without forcing.
    """
    row = np.array(m.contacts[impact[0]].row)
    kept = [i for i in range(size) if i != j]
    basis = np.eye(size)[:, kept]
    basis[j, : m.degrees - 1] = -np.delete(row, j) / row[j]
    return basis, kept


class Pencil(NamedTuple):
    """Pencil (2) as matrix A - lambda B, and the number of finite eigenvalues."""

    a: Floats
    b: Floats
    finite: int

    def eigenvalues(self) -> Complexes:
        """Multipliers, largest modulus first; complex infinity for those that are infinite.

        NaN where entries have overflowed.
        """
        if not np.all(np.isfinite(self.a)):
            return np.full(self.finite, complex(np.nan, np.nan))
        alpha, beta = eigvals(self.a, self.b, homogeneous_eigvals=True)
        with np.errstate(divide="ignore", invalid="ignore"):  # infinite; NaN of a singular pencil
            nearness = np.abs(beta) / np.hypot(np.abs(alpha), np.abs(beta))
            order = np.argsort(nearness)[len(self.a) - self.finite :]
            values: Complexes = np.asarray(alpha[order] / beta[order], np.complex128)
        return sorted_multipliers(values)

    def determinant(self, at: float) -> float:
        """Determinant (3) for lambda = at."""
        return float(np.linalg.det(self.a - at * self.b))


def sorted_multipliers(values: Complexes) -> Complexes:
    """Sort by modulus, largest first; of a pair, the one in the upper half plane is first."""
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 9)))
    return values[order]


def pencil_of(problem: OrbitProblem, m: Mechanism, parts: Linearised, sizes: Floats) -> Pencil:
    """Pencil of an orbit's map, which is the half map if the signature is symmetric.

    Parameters
    ----------
    problem, m
        The equations, and the mechanism at the value of the parameter.
    parts
        The solved segments there.
    sizes
        Sizes of the unknowns of one segment: rows and columns are scaled by them, so that QZ does
        not depend on units. Fixed along a branch, where the determinant is followed.
    """
    count, q = len(problem.impacts), problem.size
    time = 2 * problem.mechanism.degrees + 1
    first = problem.signature.impacts[0]
    j = solved_coordinate(problem.mechanism, first)
    basis, kept = section_basis(m, first, j, q)
    width = q - 1 + count
    tangent = np.zeros((q, width))
    tangent[:, : q - 1] = basis
    gaps = np.zeros((count, width))
    for k in range(count):
        gaps[k] = parts.gap_by[k, :q] @ tangent
        gaps[k, q - 1 + k] += parts.gap_by[k, time]
        tangent = parts.after_by[k, :q, :q] @ tangent
        tangent[:, q - 1 + k] += parts.after_by[k, :q, time]
    ends = (problem.mirror[:, None] * tangent)[kept]
    marks = np.zeros((width, width))
    marks[: q - 1, : q - 1] = np.eye(q - 1)
    rows = np.concatenate([sizes[kept], np.full(count, sizes[0])])
    columns = np.concatenate([sizes[kept], np.full(count, sizes[q])])
    return Pencil(np.vstack([ends, gaps]) / rows[:, None] * columns, marks, q - 1)
