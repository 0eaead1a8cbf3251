"""Newton's iteration in a hyperplane, for points of a curve.

Method      [ J ]           [ -F          ]
            [ c ] (step)  = [ s - <c, y>  ],   J = dF/dy, c a row, s a number                   (1)
            direction:  J x = 0,  <c, x> = 1    (dy/ds along the curve, from the same matrix)   (2)
            the rows of J are divided by their lengths to solve (1): units of F do not matter
Assumes     a guess in Newton's ball: a step longer than the last one is a failure
Accuracy    a step shorter than the tolerance ends the iteration and is not taken: it is the error of the point,
            to which the Jacobian, the direction and the residual belong, so that what is computed there next
            finds everything at hand. With tolerance 0 the iteration continues until rounding stops it
Fails       the statuses of ``NewtonStatus``
Reference   [keller1977] for (1); [allgower1990] ch. 2 for (2)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.continuation.problem import Scaled

MOST_STEPS = 8  # a guess that needs more is a bad one: quadratic convergence takes 2 to 5
POINT_TOLERANCE = 1e-13  # a single point, in unknowns of size one, has this tolerance
# Where the matrix is ill conditioned, rounding keeps the steps from falling further: below the
# first number a step that has not halved means that, above it Newton's iteration has failed.
STALLED_STEP = 1e-8
EPS = float(np.finfo(float).eps)
# A Newton step that is so small, relative to the unknowns, is rounding.
ROUNDING_OF_STEP = 4.0 * EPS


class NewtonStatus(StrEnum):
    """Status of a Newton iteration."""

    CONVERGED = "Newton's iteration converged"
    NO_CONVERGENCE = "Newton's iteration did not converge"
    NOT_FINITE = "the residual or its Jacobian is not finite"
    SINGULAR = "the bordered Jacobian is singular"
    OUTSIDE = "the solution lies outside the range of the parameter"


@dataclass(frozen=True)
class Node:
    """A point on the curve, in scaled unknowns."""

    y: Floats  # the point, shape (d + 1,)
    jacobian: Floats  # dF/dy, shape (d, d + 1)
    direction: Floats  # direction of the curve (2) with <row, direction> = 1, shape (d + 1,)
    residual: float  # largest |F_i|, relative to the length of its row of dF/dy
    steps: int  # evaluations of F that it took
    step: float  # length of the Newton step from the point: its error
    ahead: Floats  # the point after that step, which is better: for guesses at others

    @property
    def tangent(self) -> Floats:
        """Unit tangent of the curve."""
        unit: Floats = self.direction / np.linalg.norm(self.direction)
        return unit


@dataclass(frozen=True)
class Attempt:
    """Result of Newton's iteration: the last iterate, and a node if it converged."""

    status: NewtonStatus
    y: Floats
    node: Node | None = None


def correct(
    problem: Scaled, guess: Floats, row: Floats, target: float, tolerance: float = POINT_TOLERANCE
) -> Attempt:
    """Solve F(y) = 0, <row, y> = target from a guess, within the bounds of p (1)."""
    with np.errstate(over="ignore", invalid="ignore"):  # of iterates that run away
        return _iterated(problem, guess, row, target, tolerance)


def _iterated(
    problem: Scaled, guess: Floats, row: Floats, target: float, tolerance: float
) -> Attempt:
    y = problem.inside(guess)
    previous, outside = np.inf, 0
    for count in range(MOST_STEPS):
        residual, jacobian = problem.linearised(y)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return Attempt(NewtonStatus.NOT_FINITE, y)
        solved = _solve(jacobian, residual, row, target - float(row @ y))
        if solved is None:
            return Attempt(NewtonStatus.SINGULAR, y)
        step, direction = solved
        size, length = math.sqrt(step @ step), math.sqrt(y @ y)
        done = _finished(size, previous, tolerance, length)
        if not done and count == MOST_STEPS - 1:
            done = size <= STALLED_STEP and relative(residual, jacobian) <= EPS * length
        if done:
            left = relative(residual, jacobian)
            node = Node(y, jacobian, direction, left, count + 1, size, problem.inside(y + step))
            return Attempt(NewtonStatus.CONVERGED, y, node)
        if size > previous:
            break
        moved = problem.inside(y + step)
        outside = outside + 1 if moved[-1] != y[-1] + step[-1] else 0
        if outside == 2:
            return Attempt(NewtonStatus.OUTSIDE, moved)
        y, previous = moved, size
    return Attempt(NewtonStatus.OUTSIDE if outside else NewtonStatus.NO_CONVERGENCE, y)


def equilibrated(jacobian: Floats) -> tuple[Floats, Floats]:
    """The Jacobian with rows of length 1, and their lengths; rows of zeros are left."""
    lengths = np.linalg.norm(jacobian, axis=1)
    lengths[lengths == 0.0] = 1.0
    return jacobian / lengths[:, None], lengths


def relative(residual: Floats, jacobian: Floats) -> float:
    """Largest |F_i| relative to the length of its row of the Jacobian."""
    return float(np.abs(residual / equilibrated(jacobian)[1]).max())


def _solve(
    jacobian: Floats, residual: Floats, row: Floats, missing: float
) -> tuple[Floats, Floats] | None:
    """Step (1) and direction (2); None where the matrix is singular."""
    from scipy.linalg.lapack import dgesv  # numpy's function takes longer for its checks

    rows, lengths = equilibrated(jacobian)
    matrix, right = np.empty((len(row), len(row))), np.zeros((len(row), 2))
    matrix[:-1], matrix[-1] = rows, row
    right[:-1, 0] = -residual / lengths
    right[-1] = missing, 1.0
    _, _, both, info = dgesv(matrix, right)
    return (both[:, 0], both[:, 1]) if info == 0 and np.isfinite(both).all() else None


def _finished(size: float, previous: float, tolerance: float, length: float) -> bool:
    stalled = size <= STALLED_STEP and size > previous / 2.0
    return stalled or size <= max(tolerance, ROUNDING_OF_STEP * length)


class Determinant(NamedTuple):
    """A number sign exp(log) 2^exponent."""

    sign: float
    log: float
    exponent: int

    def over(self, other: Determinant, root: int = 1) -> float:
        """The quotient by another one; of its modulus, the root."""
        return self.sign * math.exp(self.log_over(other) / root) if self.sign else 0.0

    def log_over(self, other: Determinant) -> float:
        """Logarithm of the modulus, relative to another one."""
        return self.log - other.log + (self.exponent - other.exponent) * math.log(2.0)


def determinants(nodes: Sequence[Node], rows: Sequence[Floats]) -> list[Determinant]:
    """Determinants of [J; row] of nodes, each of which changes its sign at a simple branch point.

    The units of F are in the exponent alone: rows of J are divided by powers of two near their sizes.
    """
    jacobians = np.array([node.jacobian for node in nodes])
    exponents = np.frexp(np.abs(jacobians).max(axis=2))[1]
    scaled = np.ldexp(jacobians, -exponents[:, :, None])
    signs, logs = np.linalg.slogdet(np.concatenate([scaled, np.array(rows)[:, None]], axis=1))
    sums = exponents.sum(axis=1).tolist()
    return [Determinant(*at) for at in zip(signs.tolist(), logs.tolist(), sums, strict=True)]


def largest_of(found: Sequence[Determinant]) -> Determinant:
    """The largest of some determinants; the first one where all vanish."""
    regular = [at for at in found if at.sign]
    return max(regular, key=lambda at: at.log_over(regular[0])) if regular else found[0]
