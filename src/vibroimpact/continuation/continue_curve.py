"""Continuation of a solution curve from one of its points, in both directions."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.continuation.assemble import assemble
from vibroimpact.continuation.curve import Curve
from vibroimpact.continuation.newton import Attempt, Node, correct, equilibrated
from vibroimpact.continuation.panel import BUILT_IN
from vibroimpact.continuation.problem import Problem, Scaled, scaled
from vibroimpact.continuation.walk import (
    BeginRule,
    CurveProgress,
    Steps,
    no_progress,
    reversed_node,
    turns_back,
    walk,
)

# A start that is only found by moving p, as at a fold, may lie so far in scaled y.
START_DISTANCE = 1e-3
# A Jacobian with rows of length 1 and a larger least singular value has one tangent.
LEAST_REGULAR_SINGULAR_VALUE = 1e-7


def continue_curve(
    problem: Problem,
    z: Floats,
    p: float,
    bounds: tuple[float, float],
    *,
    tangent: Floats | None = None,
    both: bool = True,
    terminal: Collection[str] = (),
    steps: Steps | None = None,
    stop_when: BeginRule | None = None,
    progress: CurveProgress | None = None,
) -> Curve:
    """Follow the solutions of F(z, p) = 0 through a point, with all special points.

    Parameters
    ----------
    problem
        The curve, its metric and its test functions.
    z, p
        A solution or a guess from which Newton's iteration converges at this p; shape (d,).
    bounds
        Range of the parameter, both ends included; the problem is not evaluated outside.
    tangent
        Direction to start in, in unscaled unknowns with the parameter last, shape (d + 1,). The
        start is then corrected perpendicularly to it instead of at fixed p: needed at and near
        branch points. Without it the curve starts towards larger p.
    both
        Also follow the opposite direction.
    terminal
        Names of test functions at whose zeros the curve ends.
    steps
        Lengths, tolerances, number of points.
    stop_when
        Returns, for each direction, a function that is called in order at the start and at every
        point (z, p) after it. Where it returns a reason, the curve ends; its result at the start is
        ignored.
    progress
        Called after every panel with the number of points so far in this direction and the
        parameter.

    Returns
    -------
    Curve
        Points, special points, reasons of both ends. A step that fails is a status with the
        part that succeeded; so is ``KeyboardInterrupt``, which is not raised further.

    Raises
    ------
    InvalidParameterError
        Newton's iteration does not converge from (z, p), the start is a branch point and no
        tangent is given, p or a size is out of range, an unknown terminal test function.

    Notes
    -----
    Panels of 12 points (panel.py) instead of single steps: every zero of every test function on
    a panel is found from Chebyshev expansions (expansion.py), so that two of them between
    neighbouring points are both found. Cost: two to three evaluations of F and its Jacobian and
    one of ``watch`` per point, some ten of both per special point, O(d^3) each.
    """
    steps = steps or Steps()
    inside = scaled(problem, bounds)
    start = _start(inside, np.asarray(z, dtype=float), float(p), tangent)
    _check_names(inside, start, terminal)
    report = progress or no_progress
    forward = walk(inside, start, steps, terminal, report, stop_when)
    backward = None
    if both and not forward.final and not turns_back(inside, start.y, start.direction):
        backward = walk(inside, reversed_node(start), steps, terminal, report, stop_when, forward)
        if backward.closed:
            forward.end = backward.end
    return assemble(inside, forward, backward)


def _check_names(problem: Scaled, start: Node, terminal: Collection[str]) -> None:
    names = problem.watched(start.y[None]).keys()
    taken = sorted(names & set(BUILT_IN))
    if taken:
        raise InvalidParameterError(f"watch() gives {taken}: these names are built in.")
    unknown = sorted(set(terminal) - names - set(BUILT_IN))
    if unknown:
        raise InvalidParameterError(
            f"terminal = {unknown}: must be among {sorted(names | set(BUILT_IN))}."
        )


def _start(problem: Scaled, z: Floats, p: float, tangent: Floats | None) -> Node:
    """The node to start from."""
    d = len(problem.sizes) - 1
    if z.shape != (d,):
        raise InvalidParameterError(f"z has shape {z.shape}; expected ({d},) from scale().")
    if not problem.low <= p <= problem.high:
        raise InvalidParameterError(
            f"p = {p}: must be within bounds = ({problem.low}, {problem.high})."
        )
    y = problem.scaled(z, p)
    if tangent is not None:
        return _converged(_perpendicular(problem, y, tangent), p)
    along_p = np.zeros(d + 1)
    along_p[-1] = 1.0
    attempt = correct(problem, y, along_p, float(y[-1]))
    if attempt.node is None:  # a fold is regular along its own tangent
        attempt = _along_null_vector(problem, y, attempt)
    return _converged(attempt, p)


def _perpendicular(problem: Scaled, y: Floats, tangent: Floats) -> Attempt:
    row = problem.unit(tangent)
    return correct(problem, y, row, float(row @ y))


def _along_null_vector(problem: Scaled, y: Floats, failed: Attempt) -> Attempt:
    """Correct perpendicularly to the null vector of the Jacobian, oriented towards larger p."""
    residual, jacobian = problem.linearised(y)
    if not (np.all(np.isfinite(residual)) and np.all(np.isfinite(jacobian))):
        return failed
    _, sizes, rows = np.linalg.svd(equilibrated(jacobian)[0])
    if sizes[-1] < LEAST_REGULAR_SINGULAR_VALUE:
        return failed
    row = rows[-1] if rows[-1, -1] >= 0.0 else -rows[-1]
    attempt = correct(problem, y, row, float(row @ y))
    return attempt if float(np.linalg.norm(attempt.y - y)) <= START_DISTANCE else failed


def _converged(attempt: Attempt, p: float) -> Node:
    if attempt.node is None:
        raise InvalidParameterError(
            f"start at p = {p!r}: {attempt.status.value}. Give a better solution; at a branch "
            "point give the tangent of the branch to follow."
        )
    return attempt.node
