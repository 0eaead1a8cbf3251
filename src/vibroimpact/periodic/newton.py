"""Newton's method on the equations of a periodic orbit, in unknowns and equations of size one.

Method      Newton steps on (1)-(3) of problem.py, unknowns divided by their sizes and equations by
            those of their terms, so that units do not matter; a step is halved until the largest
            equation falls and every flight time stays positive.
Accuracy    converged: the last step and the largest equation are below CONVERGED; the step is still
            taken, which leaves rounding
Fails       a sentence: the Jacobian is singular, the equations would not fall, too many steps
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vibroimpact.mechanism import stop_sizes
from vibroimpact.periodic.prescribed import compile_prescribed
from vibroimpact.periodic.problem import OrbitProblem

Floats = NDArray[np.float64]

CONVERGED = 1e-10  # relative
FAR = 1e-4  # of a position: with its rounding, 1e-12 of that remains
ITERATIONS = 40
HALVINGS = 12


def scale_of(problem: OrbitProblem, z: Floats) -> Floats:
    """The size of each unknown's changes along the motion: of positions, velocities, phase, time.

    Positions far from the origin are known to their own rounding, FAR of which is the least size.
    """
    n, q = problem.mechanism.degrees, problem.size
    states, durations = problem.unpacked(z)
    moved = compile_prescribed(problem.system).sampled(states, durations)
    place, speed, time = moved[:, :n], np.abs(moved[:, n:]).max(), durations.max()
    far = FAR * max(np.abs(place).max(), *stop_sizes(problem.mechanism))
    length = max(np.ptp(place, axis=0).max(), speed * time, far) or 1.0
    sizes = np.ones(q + 1)
    sizes[:n], sizes[n : 2 * n], sizes[q] = length, speed or length / time, time
    return np.tile(sizes, len(durations))


def rows_of(problem: OrbitProblem, sizes: Floats) -> Floats:
    """The size of each equation's terms: as the unknowns, but lengths for the gaps."""
    rows = sizes.copy()
    contacts = problem.mechanism.contacts
    weights = [sum(abs(r) for r in contacts[contact].row) for contact, _ in problem.impacts]
    rows[problem.size :: problem.size + 1] = sizes[0] * np.array(weights)
    return rows


def newton(
    problem: OrbitProblem, z: Floats, iterations: int = ITERATIONS, halvings: int = HALVINGS
) -> tuple[Floats, float, str]:
    """(unknowns, relative residual, status)."""
    sizes = scale_of(problem, z)
    rows = rows_of(problem, sizes)
    error = math.inf
    for _ in range(iterations):
        residual, matrix, _p = problem.expanded(z, 0.0)
        error = float(np.abs(residual / rows).max())
        try:
            step = np.linalg.solve(matrix / rows[:, None] * sizes, -residual / rows)
        except np.linalg.LinAlgError:
            return z, error, "the Jacobian is singular: a fold or a branch point is at the guess"
        if np.abs(step).max() <= CONVERGED and error <= CONVERGED:
            return z + step * sizes, error, "converged"
        z, shorter = _damped(problem, z, step * sizes, rows, error, halvings)
        if not shorter:
            return z, error, f"no convergence: relative residual {error:.1e} would not fall further"
    return z, error, f"no convergence in {iterations} steps: relative residual {error:.1e}"


def _damped(
    problem: OrbitProblem, z: Floats, step: Floats, rows: Floats, error: float, halvings: int
) -> tuple[Floats, bool]:
    """A step, halved until it helps; whether one did."""
    times = slice(problem.size, None, problem.size + 1)
    for _ in range(halvings):
        there = z + step
        if np.all(there[times] > 0.0):
            residual = float(np.abs(problem.residual(there, 0.0) / rows).max())
            if residual < error or residual <= CONVERGED:
                return there, True
        step = step / 2.0
    return z, False
