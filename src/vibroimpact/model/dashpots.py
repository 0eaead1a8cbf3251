"""Groups of coordinates without mass on which no dashpot acts from outside.

Dashpots give the speeds of coordinates without mass from the forces on them, but for the speed of a
group that no dashpot holds: a slider with all that hangs on it by dashpots alone. With D the block of the
damping, symmetric and positive semidefinite in its symmetric part, it moves along a null vector d of D, and

    d . (forces on the coordinates) contains none of their speeds                           (1)

as D d = 0 implies D^T d = 0. The vectors d are rows of L in the elimination L D = U, for pivots that vanish.
"""

from __future__ import annotations

from collections.abc import Sequence

from vibroimpact._core import linear
from vibroimpact._core.linear import Matrix, Vector

Weights = dict[int, float]  # d by coordinate


def loose_groups(damping: Matrix, coordinates: Sequence[int]) -> dict[int, Weights]:
    """Null vectors d of the damping between these coordinates, (1), by the last coordinate of each.

    Coordinates whose block is definite come first among those given. The decision is one of rounding,
    relative to the terms of each pivot: it is the same in all units.
    """
    block = [[damping[i][j] for j in coordinates] for i in coordinates]
    sizes = [abs(row[i]) for i, row in enumerate(block)]
    factors, lost = linear.eliminated(block, sizes)
    return {
        coordinates[i]: {j: x for j, x in zip(coordinates, factors[i], strict=True) if x}
        for i in lost
    }


def vanishes(terms: Vector) -> bool:
    """Whether terms add up to zero but for rounding."""
    return bool(abs(sum(terms)) <= linear.ROUNDED * sum(map(abs, terms)))


def forces_by_speeds(damping: Matrix, weights: Weights) -> list[Vector]:
    """Terms of d . C and of C d at every coordinate: each sum is zero where nothing holds the group."""
    columns = [[x * damping[j][k] for j, x in weights.items()] for k in range(len(damping))]
    rows = [[x * row[j] for j, x in weights.items()] for row in damping]
    return [*columns, *rows]


def linked(damping: Matrix, weights: Weights) -> list[int]:
    """Coordinates that damping links with the motion of a group, though no dashpot holds it."""
    sums = forces_by_speeds(damping, weights)
    n = len(damping)
    return sorted({k % n for k, terms in enumerate(sums) if not vanishes(terms)})


def along(row: Sequence[float], weights: Weights) -> bool:
    """Whether the motion of a group changes row . x."""
    terms = [x * row[j] for j, x in weights.items()]
    return not vanishes(terms)
