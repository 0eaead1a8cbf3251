"""Newton's method on the equations of a periodic orbit, in unknowns and equations of size one.

Method      Steps of the Levenberg-Marquardt method on (1)-(3) of problem.py, F(z) = 0:
                minimise |F' s + F|^2 + nu^2 |s|^2 over s,   nu = max(DAMPING_OF_RESIDUAL |F|, LEAST_DAMPING),    (1)
            unknowns divided by their sizes and equations by those of their terms, so that units do
            not matter; s is halved until the largest equation falls and every flight time stays
            positive, but for the rounding of one between two impacts at one instant. Near an isolated
            orbit (1) is Newton's step. Where orbits come in a family F' is singular along it: (1) does
            not move along the family, and leads to the member next to the guess. Both converge
            quadratically [yamashita2001].
            A family is distinguished from a fold or a branch point, where F' is singular too, by a
            second orbit found at a distance FAMILY_STEP_IN_SIZES along each null vector of F', on either side. (2)
Accuracy    converged: the last step and the largest equation are below CONVERGED_RELATIVE; the step is still
            taken, which leaves rounding. Next to a fold F' multiplies rounding: also converged are
            equations within ROUNDING_OF_TERMS, steps below STALLED_OF_UNKNOWNS that no longer halve
Fails       a sentence: the equations would not fall, too many steps, rest
Reference   [yamashita2001]
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.compile.prescribed import CHATTER_WATCH, End, Prescribed
from vibroimpact.model.mechanism import stop_sizes
from vibroimpact.orbits.problem import OrbitProblem

CONVERGED_RELATIVE = 1e-10  # residuals are so small, relative to their terms
ROUNDING_OF_TERMS = 1e-12  # long flights are rounded by so much, relative to their terms
# A step that no longer shrinks is so small: a double root has half of the digits.
STALLED_OF_UNKNOWNS = 1e-6
DAMPING_OF_RESIDUAL = 0.1  # nu of (1) has this ratio to |F|
LEAST_DAMPING = 1e-8  # nu is so large at least: smaller singular values are noise or weak
# A coordinate has changes of this size at least, of which ROUNDING_OF_TERMS is the rounding.
LEAST_SIZE_OF_POSITION = 1e-4
REST_OF_POSITION = 1e-9  # a motion that is smaller, relative to the position, counts as rest
# A result that is so short or slow, relative to the guess, is not an orbit near it.
SHRUNK_OF_GUESS = 1e-6
FAMILY_STEP_IN_SIZES = 1e-2  # a family (2) is followed by this step, in sizes of the unknowns
# Smaller singular values, relative to the largest, are those of a family.
SINGULAR_OF_LARGEST = 1e-6
NEWTON_ITERATIONS = 40  # Newton's method takes so many iterations at most
NEWTON_HALVINGS = 12  # a Newton step is halved so often at most
FOUND = "converged"
REST = "the guess leads to rest, not to an orbit"


def scale_of(problem: OrbitProblem, z: Floats) -> Floats:
    """Size of each unknown's changes along the motion: of positions, velocities, phase, time.

    The least size is LEAST_SIZE_OF_POSITION times the position: far from the origin its rounding is larger.
    """
    compiled, (states, durations) = problem.own, problem.unpacked(z)
    n, time = compiled.degrees, durations.max()
    moved = compiled.sampled(states, durations, problem.modes)
    place, speed = moved[:, compiled.heavy], _fastest(compiled, moved)
    largest = np.abs(place).max(initial=0.0)
    far = LEAST_SIZE_OF_POSITION * max([largest, *stop_sizes(problem.mechanism)])
    length = max(np.ptp(place, axis=0).max(initial=0.0), speed * time, far) or 1.0
    sizes = np.ones(compiled.size)
    sizes[:n], sizes[n : 2 * n] = length, speed or length / time
    if compiled.massless:
        own = _sizes_of_massless(compiled, moved, time)
        sizes[compiled.massless] = np.where(own > 0.0, own, length)
    return np.tile(np.append(sizes[problem.kept], time), len(durations))


def _fastest(compiled: Prescribed, moved: Floats) -> float:
    """Largest speed of a coordinate with mass; 0 where none has."""
    return float(np.abs(moved[:, compiled.degrees :][:, compiled.heavy]).max(initial=0.0))


def _sizes_of_massless(compiled: Prescribed, moved: Floats, time: float) -> Floats:
    """Sizes of the changes of massless coordinates, which have units of their own.

    The least size is LEAST_SIZE_OF_POSITION times the position, and times what the terms of its velocity add up to.
    """
    place, most = moved[:, compiled.massless], compiled.largest(moved)
    terms = np.max([np.abs(mode.speeds) @ most for mode in compiled.modes.values()], axis=0)
    least = LEAST_SIZE_OF_POSITION * np.maximum(np.abs(place).max(axis=0), terms * time)
    return np.asarray(np.maximum(np.ptp(place, axis=0), least))


def rows_of(problem: OrbitProblem, sizes: Floats) -> Floats:
    """Size of each equation's terms: as those of the unknowns, but those of the guards at the ends."""
    rows = sizes.copy()
    rows[problem.size :: problem.size + 1] = guard_sizes(problem, sizes)
    return rows


def residual_of(problem: OrbitProblem, z: Floats) -> float:
    """Largest residual of an equation, relative to the size of its terms."""
    return float(np.abs(problem.residual(z, 0.0) / rows_of(problem, scale_of(problem, z))).max())


def guard_sizes(problem: OrbitProblem, sizes: Floats, ends: Sequence[End] | None = None) -> Floats:
    """Size of the changes of the guard at each end, by default those of the segments, shape (m,)."""
    compiled, n = problem.own, problem.mechanism.degrees
    ends = ends or problem.ends
    rows = np.abs([compiled.guard(end).row for end in ends])
    of_y, of_zeta = np.ones(rows.shape[1]), np.zeros(compiled.size)
    of_zeta[problem.kept] = sizes[: problem.size]
    of_y[0 : 2 * n : 2], of_y[1 : 2 * n : 2] = of_zeta[:n], of_zeta[n : 2 * n] / compiled.scale
    lasts = [end.watch == CHATTER_WATCH for end in ends]  # its equation is that of a time
    return np.where(lasts, sizes[problem.size], rows @ of_y)


def newton(
    problem: OrbitProblem,
    z: Floats,
    iterations: int = NEWTON_ITERATIONS,
    halvings: int = NEWTON_HALVINGS,
) -> tuple[Floats, float, str]:
    """Iterate from a guess; return (unknowns, relative residual, status)."""
    sizes = scale_of(problem, z)
    rows = rows_of(problem, sizes)
    times = slice(problem.size, None, problem.size + 1)
    error, previous, shortest = math.inf, math.inf, SHRUNK_OF_GUESS * float(z[times].sum())
    for _ in range(iterations):
        residual, matrix = _scaled(problem, z, sizes, rows)
        error = float(np.abs(residual).max())
        if not (math.isfinite(error) and np.isfinite(matrix).all()):
            return z, math.inf, "no convergence: the flights from the guess overflow"
        step = _step(matrix, residual)
        size = float(np.abs(step).max())
        last = error <= CONVERGED_RELATIVE and size <= CONVERGED_RELATIVE
        if last or (error <= ROUNDING_OF_TERMS and previous / 2.0 < size <= STALLED_OF_UNKNOWNS):
            z = z + step * sizes if last else z
            return z, error, REST if _rests(problem, z, sizes) else FOUND
        z, shorter = _damped(problem, z, step * sizes, rows, error, halvings)
        if not shorter:
            return z, error, f"no convergence: relative residual {error:.1e} would not fall further"
        if float(z[times].sum()) < shortest:
            return z, error, REST
        previous = size
    return z, error, f"no convergence in {iterations} steps: relative residual {error:.1e}"


def _scaled(problem: OrbitProblem, z: Floats, sizes: Floats, rows: Floats) -> tuple[Floats, Floats]:
    """Scaled F and F', of size one."""
    residual, by = problem.expanded(z, 0.0)
    with np.errstate(over="ignore", invalid="ignore"):
        return residual / rows, by[:, :-1] / rows[:, None] * sizes


def _step(matrix: Floats, residual: Floats) -> Floats:
    """Step (1), by a QR decomposition of F' over nu I."""
    size = len(residual)
    nu = max(DAMPING_OF_RESIDUAL * float(np.abs(residual).max()), LEAST_DAMPING)
    q, r = np.linalg.qr(np.vstack([matrix, nu * np.eye(size)]))
    return np.asarray(np.linalg.solve(r, -q[:size].T @ residual), dtype=float)


def _rests(problem: OrbitProblem, z: Floats, sizes: Floats) -> bool:
    """Whether the motion is at rest; a forced motion never is, nor one of states that have no mass."""
    compiled, (states, durations) = problem.own, problem.unpacked(z)
    if problem.mechanism.forces or not compiled.heavy:
        return False
    n, moved = compiled.degrees, compiled.sampled(states, durations, problem.modes)
    speed, place = _fastest(compiled, moved), np.abs(moved[:, compiled.heavy]).max()
    return bool(
        speed <= SHRUNK_OF_GUESS * sizes[n] or speed * durations.max() <= REST_OF_POSITION * place
    )


def _damped(
    problem: OrbitProblem, z: Floats, step: Floats, rows: Floats, error: float, halvings: int
) -> tuple[Floats, bool]:
    """Halve a step until the residual falls; return the step and whether it did."""
    times = slice(problem.size, None, problem.size + 1)
    least = -ROUNDING_OF_TERMS * float(z[times].sum())
    for _ in range(halvings):
        there = z + step
        if np.all(there[times] > least):
            residual = float(np.abs(problem.residual(there, 0.0) / rows).max())
            if residual < error or residual <= CONVERGED_RELATIVE:
                return there, True
        step = step / 2.0
    return z, False


def family_dimension(problem: OrbitProblem, z: Floats) -> int:
    """Dimension of the family to which an orbit belongs, by (2); 0 where it is isolated."""
    sizes = scale_of(problem, z)
    matrix = _scaled(problem, z, sizes, rows_of(problem, sizes))[1]
    _, values, directions = np.linalg.svd(matrix)
    null = directions[values <= SINGULAR_OF_LARGEST * values[0]]
    moved = []
    for direction in null:
        # on one side impacts may change order
        for step in (FAMILY_STEP_IN_SIZES, -FAMILY_STEP_IN_SIZES):
            there, _, status = newton(problem, z + step * direction * sizes)
            if status == FOUND:
                moved.append(null @ ((there - z) / sizes))
                break
    return (
        int(np.linalg.matrix_rank(np.array(moved), tol=FAMILY_STEP_IN_SIZES / 2.0)) if moved else 0
    )
