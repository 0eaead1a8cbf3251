"""Switching to the other branch through a simple branch point.

Method      at the point u_b the null space of J is spanned by the tangent t_1 of the known branch
            and q, orthogonal to it                                                           (1)
            u with F(u) = 0, <q, u - u_b> = e, by Newton's iteration from u_b + e q           (2)
            With x along t_1 and e along q the curve near u_b is e (a x + b e + ...) = 0. On the
            other branch (2) is linear in x to leading order: any angle between the branches is
            met in one step, and no second derivative is needed.
            u belongs to a branch through u_b, and is not a distant point of the known one, if the
            tangent at u has the slope of the chord: <q, t(u)> |u - u_b| = e (1 + O(e))         (3)
Assumes     a simple branch point with two transversal branches
Accuracy    the start is a solution to Newton's tolerance, at distance about e from u_b
Fails       ``Switch.status`` states the failure at the last e tried
Reference   [keller1977] method of branch switching onto the orthogonal complement; [allgower1990]
            sec. 8.3
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.continuation.newton import Attempt, correct
from vibroimpact.continuation.problem import Problem, Scaled, scaled

LARGEST_OFFSET = 0.02  # e of (2), in scaled unknowns, is first tried with this length
LEAST_OFFSET = 1e-5  # it is last tried with this length
OFFSET_FACTOR = 0.25  # from one try to the next it is multiplied by this factor
LARGEST_SLOPE = 0.25  # (3) is accepted within this; a distant point of a parabola gives 1
# Singular value of J, rows of length 1, that still counts as zero: the branch point may be known to
# 1e-8 only, and the slope of the singular value along the curve is at most some tens.
NULL_SINGULAR_VALUE = 1e-6


@dataclass(frozen=True, eq=False)
class Switch:
    """Start on the other branch.

    Attributes
    ----------
    found
        Whether there is one.
    status
        A sentence: the distance at which it was found, or the failure.
    z, parameter
        A solution on the other branch, near the branch point; NaN if there is none.
    tangent
        Tangent there, away from the branch point, unscaled, parameter last, shape (d + 1,).
    """

    found: bool
    status: str
    z: Floats
    parameter: float
    tangent: Floats


def switch(
    problem: Problem, z: Floats, p: float, tangent: Floats, bounds: tuple[float, float]
) -> Switch:
    """Find the other branch through a simple branch point.

    Parameters
    ----------
    problem
        The problem of the other branch. It may have solutions that the problem of the known branch
        lacks: at a period doubling give the problem of the doubled orbit and the doubled point.
    z, p, tangent
        The branch point and the tangent of the known branch, as in ``LocatedPoint``.
    bounds
        Range of the parameter.

    Returns
    -------
    Switch
        ``continue_curve(problem, s.z, s.parameter, bounds, tangent=s.tangent)`` follows the other
        branch, through the branch point and to both sides.

    Raises
    ------
    InvalidParameterError
        An empty range, shapes that do not fit, a tangent of zeros.

    Notes
    -----
    Cost: a singular value decomposition and some Newton iterations.
    """
    inside = scaled(problem, bounds)
    y = inside.scaled(np.asarray(z, dtype=float), float(p))
    across = _second_direction(inside, y, inside.unit(tangent))
    if across is None:
        return _nothing(inside, "the Jacobian has no second null direction: no branch point")
    status = ""
    for signed in _distances():
        attempt = correct(inside, y + signed * across, across, float(across @ y) + signed)
        status = _defect(attempt, y, across, signed)
        if attempt.node is not None and not status:
            return _start(inside, attempt, signed)
    return _nothing(inside, f"{status}, {LEAST_OFFSET:g} from the branch point")


def _distances() -> Iterator[float]:
    """Signed e of (2): both sides, for the other branch may leave the bounds of p on one."""
    size = LARGEST_OFFSET
    while size >= LEAST_OFFSET:
        yield from (size, -size)
        size *= OFFSET_FACTOR


def _second_direction(problem: Scaled, y: Floats, along: Floats) -> Floats | None:
    """Direction q of (1); None where the null space of J is one-dimensional.

    Its sign, which decides the side of the branch point that is tried first, is that of the first
    entry above half the largest: with entries of one size, as of doubled solutions, rounding does
    not decide.
    """
    jacobian = problem.linearised(y)[1]
    # A row may vanish at the branch point itself, so rows are measured beside it too.
    beside = [
        problem.linearised(problem.inside(y + e * along))[1]
        for e in (LARGEST_OFFSET, -LARGEST_OFFSET)
    ]
    lengths = np.linalg.norm([jacobian, *beside], axis=2).max(axis=0)
    if not np.all(np.isfinite(lengths)) or not np.all(lengths > 0.0):
        return None
    _, sizes, rows = np.linalg.svd(jacobian / lengths[:, None])
    if sizes[-1] > NULL_SINGULAR_VALUE:
        return None
    across = rows[-2:] - np.outer(rows[-2:] @ along, along)
    across = across[int(np.argmax(np.linalg.norm(across, axis=1)))]
    size = np.abs(across)
    first = across[int(np.argmax(size >= size.max() / 2.0))]
    unit: Floats = across / np.copysign(np.linalg.norm(across), first)
    return unit


def _defect(attempt: Attempt, y: Floats, across: Floats, signed: float) -> str:
    """Reason to reject a point of (2); empty if (3) holds."""
    if attempt.node is None:
        return attempt.status.value
    chord = float(np.linalg.norm(attempt.node.y - y))
    slope = abs(float(across @ attempt.node.tangent)) * chord / abs(signed)
    return (
        "" if abs(slope - 1.0) <= LARGEST_SLOPE else "the point found is not on a branch through it"
    )


def _start(problem: Scaled, attempt: Attempt, signed: float) -> Switch:
    assert attempt.node is not None
    z, p = problem.solution(attempt.node.y)
    away = np.copysign(1.0, signed) * attempt.node.tangent * problem.sizes
    return Switch(True, f"found {abs(signed):g} from the branch point", z, p, away)


def _nothing(problem: Scaled, status: str) -> Switch:
    none = np.full(len(problem.sizes), np.nan)
    return Switch(False, status, none[:-1], float("nan"), none)
