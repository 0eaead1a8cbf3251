"""Curves of bifurcations of orbits of a multiple period, which end at a point of another curve.

Near such a point these orbits shrink to the orbit from which they are born, repeated: their equations become singular
there. A curve is therefore followed up to a share of the distance at which it was found, and ends there with the
reason NEAR.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.augmented import BOUND, Augmented, Bounds
from vibroimpact.bifurcations.continue_bifurcation import STEPS, curve_of, on_multipliers, ranges
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint
from vibroimpact.bifurcations.equations import Equations, Pair
from vibroimpact.continuation import Curve, Steps, Stopped, continue_curve
from vibroimpact.continuation.walk import CurveProgress

NEAR = "the point at which the curve begins is near"
SHARE = 0.5  # of the distance at which it was found


class Origin(NamedTuple):
    """Orbit from which others are born: equations, solution and parameters."""

    equations: Equations
    z: Floats
    a: Pair


def origin_of(point: CodimensionTwoPoint) -> Origin:
    """The orbit at a point of codimension two."""
    equations = point.problem.equations
    z, _, a = point.problem.parts(point.z, point.parameters[equations.names[1]])
    return Origin(equations, z, a)


class Slice:
    """Orbits of equations over two parameters along one of them, the other held: a ``Problem``."""

    def __init__(self, equations: Equations, along: int, held: float, span: float) -> None:
        self.equations, self.along, self.held = equations, along, held
        self._sizes = np.append(equations.sizes, span)

    def at(self, p: float) -> Pair:
        """Both parameters."""
        return (p, self.held) if self.along == 0 else (self.held, p)

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

    def watch(self, _z: Floats, _p: float) -> dict[str, float]:
        """No test functions: folds are found by the continuation."""
        return {}


def emanating(
    kind: str, origin: Origin, equations: Equations, z: Floats, a: Pair,
    bounds: tuple[Bounds, Bounds], steps: Steps | None, progress: CurveProgress | None,
    share: float = SHARE,
) -> BifurcationCurve:  # fmt: skip
    """Curve of orbits of a multiple period, from a solution z at parameters a.

    The start is corrected across the straight line from the point, where all these orbits are one.

    Raises
    ------
    InvalidParameterError
        The start does not converge.
    """
    condition, tests = on_multipliers(kind, equations)
    problem = Augmented(equations, condition, tests, bounds)
    guess = problem.packed(z, condition.start(z, a), a)
    changes = np.zeros((len(z) // len(origin.z), len(origin.z)))
    middle = origin.equations.unrolled(origin.z, changes)
    line = np.concatenate([z - middle, np.zeros(condition.unknowns), np.subtract(a, origin.a)])

    def distance(unknowns: Floats) -> float:
        return float(np.abs((unknowns - middle) / equations.sizes).max())

    first = distance(z)

    def rule(unknowns: Floats, p: float) -> str:
        here = problem.parts(unknowns, p)[0]
        return NEAR if distance(here) < share * first else ""

    curve = continue_curve(
        problem, guess, a[1], bounds[1], tangent=line, terminal=(BOUND,),
        steps=steps or STEPS, progress=progress, stop_when=lambda: rule,
    )  # fmt: skip
    return curve_of(kind, problem, curve)


def checked_bounds(
    point: CodimensionTwoPoint, bounds: tuple[Bounds, Bounds] | None
) -> tuple[Bounds, Bounds]:
    """Bounds with the point inside, by default those of its curve."""
    wanted = point.problem.bounds if bounds is None else bounds
    names = point.problem.equations.names
    return ranges(names, (point.parameters[names[0]], point.parameters[names[1]]), wanted)


def interrupted(curve: Curve) -> bool:
    """Whether an interruption ended a curve, which keeps its part: a search has to end, too."""
    return any(end.reason is Stopped.INTERRUPTED for end in curve.ends)


def on_slice(piece: Slice, start: Floats, p: float, bounds: Bounds, **options: Any) -> Curve:
    """Curve of orbits on a slice; an interruption is raised further."""
    curve = continue_curve(piece, start, p, bounds, **options)
    if interrupted(curve):
        raise KeyboardInterrupt
    return curve


def width_of(pair: Bounds) -> float:
    """Length of a range."""
    return pair[1] - pair[0]
