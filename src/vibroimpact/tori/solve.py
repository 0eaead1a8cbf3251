"""Collocation of an invariant circle: Newton's method, with as many nodes as the circle needs.

Method      unknowns are the curve u at N nodes phi_j = j / N and the rotation number rho:
                F(u(phi_j), p) - u(phi_j + rho) = 0,                                             (1)
                <u_0', u - u_0> = 0,  the mean over the nodes, u_0 the guess,                    (2)
            since with u(phi) every u(phi + c) solves (1). Along a family p is unknown too, and
                <du, u - u_1> + drho (rho - rho_1) + dp (p - p_1) = 0                            (3)
            with the unit tangent (du, drho, dp) and the predicted (u_1, rho_1, p_1).
            With the nodal shift R_rho (fourier.py) and A = DF(u) the Jacobian of (1) is
                [ A - R_rho,   - (R_rho u)',   F_p ].                                            (4)
            N grows by half until the residual between the nodes,
                |F(u(phi_j + 1/2N)) - u(phi_j + 1/2N + rho)| <= tolerance,                       (5)
            coordinates in units of their sizes.
Assumes     a smooth circle, with a rotation number that rationals approximate badly: a smooth
            solution then exists. In a narrow tongue the equations still hold to (5) where the
            tongue's effect is smaller
Accuracy    Newton's residual is rounding; (5) measures the rest
Fails       a sentence: no convergence, collapse onto a fixed point, more nodes than allowed
Reference   [schilder2005] for (1) to (3), there for flows; theory.md, "Invariant circles"
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.tori.fourier import (
    derivative,
    harmonics_above,
    resampled,
    shift_matrix,
    shifted,
)
from vibroimpact.tori.maps import CircleMap, Images

FOUND = "converged"
TOLERANCE = 1e-10  # this is the tolerance of (5)
FEWEST_NODES, MOST_NODES = 15, 511
NODE_GROWTH = 1.5  # a circle that is not resolved is solved with so many times as many nodes
NEWTON_STEPS = 15  # Newton's method takes so many steps at most
NEWTON_HALVINGS = 8  # a Newton step is halved so often at most
DOUBLINGS = 2  # where Newton's method fails, it is tried so often with twice the nodes
SMALL_STEP = 1e-9  # the next Newton step is the square of one that is so small
SMALL_RESIDUAL = 1e-11  # and so is the residual of one that has converged
# A curve that is smaller, relative to the radius of the guess, has collapsed.
COLLAPSED_OF_RADIUS = 1e-3
# Harmonics that are smaller, relative to the tolerance, are left out of the next guess.
MARGIN_OF_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Trial:
    """Unknowns of the equations: a curve (N, d), its rotation number, the parameter."""

    points: Floats
    rotation: float
    p: float
    times: Floats  # (N, m) flight times, a guess or the solution

    def at_nodes(self, count: int) -> Trial:
        """Return the curve at another number of nodes."""
        points, times = resampled(self.points, count), resampled(self.times, count)
        return replace(self, points=points, times=times)


class Direction(NamedTuple):
    """A direction in curve (N, d) in units of the sizes, rotation number and parameter.

    ``unit`` is the unit of the parameter.
    """

    points: Floats
    rotation: float
    parameter: float
    unit: float

    def row(self, count: int) -> Floats:
        """Row of (3) for a number of nodes."""
        points = resampled(self.points, count) / count
        return np.concatenate([points.ravel(), [self.rotation, self.parameter]])

    def norm(self) -> float:
        """Length: the mean square over the nodes, and both numbers."""
        return float(
            np.sqrt(
                (self.points**2).sum() / len(self.points) + self.rotation**2 + self.parameter**2
            )
        )

    def scaled(self, factor: float) -> Direction:
        """The direction times a factor."""
        return Direction(
            factor * self.points, factor * self.rotation, factor * self.parameter, self.unit
        )


class Solved(NamedTuple):
    """A solution, or the last iterate with the reason of the failure."""

    trial: Trial
    residual: float  # (5), or that of Newton's method where that fails
    status: str
    images: Images


def radius(points: Floats, sizes: Floats) -> float:
    """Root mean square distance of a curve from its centre, in units of the sizes."""
    scaled = points / sizes
    return float(np.sqrt(((scaled - scaled.mean(axis=0)) ** 2).sum(axis=1).mean()))


def matrix_of(images: Images, trial: Trial, guess: Trial, sizes: Floats, unit: float) -> Floats:
    """Jacobian (4) and the phase condition (2), shape (N d + 1, N d + 2); p in its unit."""
    n, d = trial.points.shape
    blocks = np.zeros((n, d, n, d))
    nodes, axes = np.arange(n), np.arange(d)
    blocks[nodes, :, nodes] = images.by_point * sizes / sizes[:, None]
    blocks[:, axes, :, axes] -= shift_matrix(n, trial.rotation)
    matrix = np.zeros((n * d + 1, n * d + 2))
    matrix[:-1, :-2] = blocks.reshape(n * d, n * d)
    matrix[:-1, -2] = -(shifted(derivative(trial.points), trial.rotation) / sizes).ravel()
    matrix[:-1, -1] = (images.by_parameter / sizes).ravel() * unit
    slope = derivative(guess.points) / sizes
    matrix[-1, :-2] = slope.ravel() / max(float((slope**2).sum()), np.finfo(float).tiny)
    return matrix


def tangent(matrix: Floats, unit: float, shape: tuple[int, int], previous: Direction) -> Direction:
    """Unit tangent of a family, continuing a direction; from (4) and (2) at a solution."""
    row = previous.row(shape[0])
    last = np.zeros(len(matrix) + 1)
    last[-1] = 1.0
    y = np.asarray(np.linalg.solve(np.vstack([matrix, row]), last), dtype=np.float64)
    along = Direction(y[:-2].reshape(shape), float(y[-2]), float(y[-1]), unit)
    return along.scaled(1.0 / along.norm())


def solve(
    circle_map: CircleMap,
    guess: Trial,
    *,
    along: Direction | None = None,
    tolerance: float = TOLERANCE,
    most_nodes: int = MOST_NODES,
) -> Solved:
    """Solve for a circle near a guess, with enough nodes; on the plane (3) if ``along`` is given."""
    start, again = guess, 0 if along else DOUBLINGS  # along a family the step is halved instead
    while True:
        found = newton(circle_map, start, along)
        n = len(start.points)
        if found.status != FOUND:  # perhaps for lack of harmonics
            if again == 0 or 2 * n + 1 > most_nodes:
                return found
            start, again = guess.at_nodes(2 * n + 1), again - 1
            continue
        residual = residual_between(circle_map, found.trial)
        if residual <= tolerance:
            return found._replace(residual=max(residual, found.residual))
        grown = 2 * int(NODE_GROWTH * n / 2) + 1
        if grown > most_nodes:
            status = f"{most_nodes} nodes are too few: the residual between {n} is {residual:.1e}"
            return found._replace(residual=residual, status=status)
        start = guess.at_nodes(grown) if along else found.trial.at_nodes(grown)


def newton(circle_map: CircleMap, guess: Trial, along: Direction | None) -> Solved:
    """Iterate on (1), (2), and (3) if a direction is given, at the nodes of the guess."""
    trial, sizes = guess, circle_map.sizes
    images = circle_map.images(trial.points, trial.p, trial.times)
    error, before = _error(images, trial, sizes), np.inf
    least = COLLAPSED_OF_RADIUS * radius(guess.points, sizes)
    for _ in range(NEWTON_STEPS):
        if not np.isfinite(error):
            return Solved(trial, np.inf, "no convergence: a flight from the guess fails", images)
        step = _newton_step(images, trial, guess, sizes, along)
        if step is None:
            return Solved(trial, error, "no convergence: the Jacobian is singular", images)
        size, last = step.norm(), trial
        trial, images, error = _damped(circle_map, trial, step, images, error)
        if trial is last:
            break
        if radius(trial.points, sizes) < least:
            return Solved(trial, error, "the iteration collapsed onto a fixed point", images)
        if error <= SMALL_RESIDUAL and (size <= SMALL_STEP or size > before / 2.0):
            return Solved(trial, error, FOUND, images)
        before = size
    status = f"no convergence with {len(trial.points)} nodes: the residual stays at {error:.1e}"
    return Solved(trial, error, status, images)


def _residual(images: Images, trial: Trial, sizes: Floats) -> Floats:
    """Left side of (1) at the nodes, (N, d)."""
    return np.asarray((images.points - shifted(trial.points, trial.rotation)) / sizes)


def _error(images: Images, trial: Trial, sizes: Floats) -> float:
    """Largest residual of (1) at the nodes."""
    return float(np.abs(_residual(images, trial, sizes)).max())


def _newton_step(
    images: Images, trial: Trial, guess: Trial, sizes: Floats, along: Direction | None
) -> Direction | None:
    from scipy.linalg import LinAlgError, lu_factor, lu_solve

    n, d = trial.points.shape
    unit = along.unit if along else 1.0
    matrix = matrix_of(images, trial, guess, sizes, unit)
    moved = ((trial.points - guess.points) / sizes).ravel()
    residual = np.append(_residual(images, trial, sizes), matrix[-1, :-2] @ moved)
    if along:
        row = along.row(n)
        others = [trial.rotation - guess.rotation, (trial.p - guess.p) / unit]
        matrix = np.vstack([matrix, row])
        residual = np.append(residual, row @ np.append(moved, others))
    else:
        matrix = matrix[:, :-1]
    try:
        factors = lu_factor(matrix, overwrite_a=True, check_finite=False)
        y = -lu_solve(factors, residual, check_finite=False)
    except LinAlgError:
        return None
    if not np.isfinite(y).all():
        return None
    return Direction(
        y[: n * d].reshape(n, d), float(y[n * d]), float(y[-1]) if along else 0.0, unit
    )


def _damped(
    circle_map: CircleMap, trial: Trial, step: Direction, images: Images, error: float
) -> tuple[Trial, Images, float]:
    """Halve a step until the residual does not grow."""
    for _ in range(NEWTON_HALVINGS):
        there = Trial(
            trial.points + step.points * circle_map.sizes,
            trial.rotation + step.rotation,
            trial.p + step.parameter * step.unit,
            images.times,
        )
        after = circle_map.images(there.points, there.p, there.times)
        now = _error(after, there, circle_map.sizes)
        if now <= max(error, SMALL_RESIDUAL):
            return replace(there, times=after.times), after, now
        step = step.scaled(0.5)
    return trial, images, error if np.isfinite(now) else np.inf


def residual_between(circle_map: CircleMap, trial: Trial) -> float:
    """Residual (5)."""
    half = 0.5 / len(trial.points)
    points, times = shifted(trial.points, half), shifted(trial.times, half)
    images = circle_map.images(points, trial.p, times)
    return _error(images, replace(trial, points=points), circle_map.sizes)


def nodes_needed(points: Floats, sizes: Floats, tolerance: float) -> int:
    """Nodes for the harmonics that exceed a margin below the tolerance."""
    top = harmonics_above(
        points / sizes, MARGIN_OF_TOLERANCE * tolerance / max(radius(points, sizes), tolerance)
    )
    return max(FEWEST_NODES, 2 * int(top * 4 / 3) + 1)
