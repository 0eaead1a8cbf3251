"""Curves of bifurcations of orbits of a multiple period, which end at a point of another curve.

Near such a point these orbits shrink to the orbit from which they are born, repeated: their equations become singular
there. A curve is therefore followed up to a share of the distance at which it was found, and ends there with the
reason NEAR_BEGINNING.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.augmented import Bounds
from vibroimpact.bifurcations.continue_bifurcation import Start, followed, ranges
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.equations import Equations, Pair, Solution
from vibroimpact.bifurcations.starting_orbits import Born, run_through
from vibroimpact.bifurcations.tests_along import nothing, on_multipliers
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation import Curve, LocatedPoint, Steps, continue_curve
from vibroimpact.continuation.walk import CurveProgress
from vibroimpact.normal_forms.kind import PointKind

NEAR_BEGINNING = "the point at which the curve begins is near"
SHARE_OF_DISTANCE = 0.5  # a curve ends at this share of the distance at which it was found


class Slice:
    """Orbits of equations over two parameters along one of them, the other held: a ``Problem``."""

    def __init__(self, equations: Equations, along: int, held: float, span: float) -> None:
        self.equations, self.along, self.held = equations, along, held
        self._sizes = np.append(equations.sizes, span)

    def at(self, p: float) -> Pair:
        """Values of both parameters."""
        return (p, self.held) if self.along == 0 else (self.held, p)

    def solution(self, point: LocatedPoint) -> Solution:
        """A special point of a curve on the slice."""
        return Solution(self.equations, point.z, self.at(point.parameter))

    def residual(self, z: Floats, p: float) -> Floats:
        """F."""
        return self.equations.residual(z, self.at(p))

    def jacobian(self, z: Floats, p: float) -> tuple[Floats, Floats]:
        """F_z and F_p."""
        if self.along == 0:
            return self.equations.by_first(z, self.at(p))
        by_z, by_a = self.equations.by_both(z, self.at(p))
        return by_z, by_a[:, 1]

    def scale(self) -> Floats:
        """Sizes of the unknowns and of the parameter."""
        return self._sizes

    def watch(self, _z: Floats, _p: Floats) -> dict[str, Floats]:
        """Return no test functions: the continuation finds folds itself."""
        return {}


def emanating(
    kind: PointKind, origin: Solution, born: Born, bounds: tuple[Bounds, Bounds],
    steps: Steps | None, progress: CurveProgress | None, share: float = SHARE_OF_DISTANCE,
) -> BifurcationCurve:  # fmt: skip
    """Curve of orbits of a multiple period that are born at a point, from one of them.

    A touch is given by its condition, other kinds by their record. The start is corrected across the straight line from
    the point, where all these orbits are one. On the curve of a touch the orbits of both turns change roles there: it
    is followed away from the point only.

    Raises
    ------
    InvalidParameterError
        The start does not converge.
    """
    (equations, z, a), touch = born
    touched = touch is not None
    condition, tests = (touch, nothing) if touch else on_multipliers(kind, equations)
    middle = run_through(origin, z)
    line = np.concatenate([z - middle, np.zeros(condition.unknowns), np.subtract(a, origin.a)])

    def distance(unknowns: Floats) -> float:
        return float(np.abs((unknowns - middle) / equations.sizes).max())

    first = distance(z)

    def rule(unknowns: Floats, _p: float) -> str:
        return NEAR_BEGINNING if distance(unknowns[: len(z)]) < share * first else ""

    return followed(
        Start(kind, equations, condition, tests, z, a), bounds, tangent=line, both=not touched,
        steps=steps, progress=progress, stop_when=lambda: rule,
    )  # fmt: skip


def checked_bounds(
    point: BifurcationPoint, bounds: tuple[Bounds, Bounds] | None
) -> tuple[Bounds, Bounds]:
    """Bounds with the point inside, by default those of its curve."""
    wanted = point.problem.bounds if bounds is None else bounds
    names = point.problem.equations.names
    return ranges(names, (point.parameters[names[0]], point.parameters[names[1]]), wanted)


def uninterrupted(curve: Curve) -> Curve:
    """The curve; an interruption, after which it keeps its part, is raised further: it ends a search."""
    if curve.interrupted:
        raise KeyboardInterrupt
    return curve


def on_slice(piece: Slice, start: Floats, p: float, bounds: Bounds, **options: Any) -> Curve:
    """Curve of orbits on a slice; an interruption is raised further."""
    return uninterrupted(continue_curve(piece, start, p, bounds, **options))


def width_of(pair: Bounds) -> float:
    """Length of a range."""
    return pair[1] - pair[0]
