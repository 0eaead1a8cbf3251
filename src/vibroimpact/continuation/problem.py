"""Definition of a curve of solutions, and its scaled form with unknowns of size one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats

Image = tuple[Floats, Floats]  # of a solution and of a direction there


class Problem(Protocol):
    """A curve of solutions F(z, p) = 0: d equations for d unknowns z and one parameter p.

    F is analytic along the curve. Where it cannot be evaluated it returns NaN: the curve stops
    there with a status.
    """

    def residual(self, z: Floats, p: float) -> Floats:
        """F, shape (d,)."""
        ...

    def jacobian(self, z: Floats, p: float) -> tuple[Floats, Floats]:
        """F_z of shape (d, d) and F_p of shape (d,), exact; called right after residual."""
        ...

    def scale(self) -> Floats:
        """Size of each unknown and, last, of p; shape (d + 1,), positive: weighs the arclength."""
        ...

    def watch(self, z: Floats, p: Floats) -> Mapping[str, Floats]:
        """Test functions by name, at solutions in rows, shape (k, d), and their parameters, shape (k,): shape (k,).

        They are smooth along the curve and zero at special points. The names do not change along the curve; NaN
        stands for a value that cannot be computed.
        """
        ...


@runtime_checkable
class WithImages(Protocol):
    """Problem in which several solutions, images under its symmetries, represent one object.

    Every symmetry z -> A z + a, the same for all p, maps solutions to solutions at the same p.
    """

    def images(self, z: Floats, p: float, along: Floats, near: Floats) -> list[Image]:
        """Every image of a solution and of a direction there, the identity's included.

        Parameters
        ----------
        z, p
            The solution, shape (d,).
        along
            A direction in z, shape (d,): its image is A along.
        near
            Where a symmetry has infinitely many powers, as a shift of a phase has, the image
            nearest to this point is taken; shape (d,).
        """
        ...


@dataclass(frozen=True)
class Scaled:
    """A problem in the unknowns y = (z, p) / sizes, within bounds of p.

    The sizes are those of ``problem.scale()`` rounded to powers of two, so that scaling is exact:
    bounds of p keep all their bits.
    """

    problem: Problem
    sizes: Floats
    low: float
    high: float

    def scaled(self, z: Floats, p: float) -> Floats:
        """Scaled unknowns y of a solution."""
        y: Floats = np.append(z, p) / self.sizes
        return y

    def solution(self, y: Floats) -> tuple[Floats, float]:
        """Solution (z, p) of scaled unknowns y."""
        unscaled = y * self.sizes
        return unscaled[:-1], float(unscaled[-1])

    def unit(self, tangent: Floats) -> Floats:
        """A direction in unscaled unknowns as a unit vector in y.

        Raises
        ------
        InvalidParameterError
            Not d + 1 finite numbers, or all zero.
        """
        given = np.asarray(tangent, dtype=float)
        if given.shape != self.sizes.shape or not (np.all(np.isfinite(given)) and np.any(given)):
            raise InvalidParameterError(
                f"tangent = {tangent}: need {len(self.sizes)} finite numbers, not all zero."
            )
        direction = given / self.sizes
        unit: Floats = direction / np.linalg.norm(direction)
        return unit

    def images(self, y: Floats, direction: Floats, near: Floats) -> list[Image]:
        """A solution and a direction in y, and all their images near another one."""
        if not isinstance(self.problem, WithImages):
            return [(y, direction)]
        z, p = self.solution(y)
        sizes = self.sizes[:-1]
        found = self.problem.images(z, p, direction[:-1] * sizes, self.solution(near)[0])
        return [
            (np.append(image / sizes, y[-1]), np.append(along / sizes, direction[-1]))
            for image, along in found
        ]

    def linearised(self, y: Floats) -> tuple[Floats, Floats]:
        """F and its derivative by y, shapes (d,) and (d, d + 1)."""
        z, p = self.solution(y)
        residual = np.asarray(self.problem.residual(z, p), dtype=float)
        by_z, by_p = self.problem.jacobian(z, p)
        whole = np.empty((len(residual), len(y)))
        whole[:, :-1], whole[:, -1] = by_z, by_p
        return residual, whole * self.sizes

    def inside(self, y: Floats) -> Floats:
        """The point y with p moved to the nearest value within the bounds."""
        moved = y.copy()
        p = y[-1] * self.sizes[-1]
        moved[-1] = min(max(p, self.low), self.high) / self.sizes[-1]
        return moved

    def bound(self, y: Floats) -> float | None:
        """Bound of p, scaled, on which y lies; None for other points."""
        p = y[-1] * self.sizes[-1]
        return float(y[-1]) if p in (self.low, self.high) else None

    def watched(self, y: Floats) -> dict[str, Floats]:
        """The problem's own test functions at points in rows, shape (k, d + 1)."""
        unscaled = y * self.sizes
        return {**self.problem.watch(unscaled[:, :-1], unscaled[:, -1])}


def scaled(problem: Problem, bounds: tuple[float, float]) -> Scaled:
    """Check a problem's scale and the bounds of p, both inclusive.

    Raises
    ------
    InvalidParameterError
        An empty or infinite range; a size that is not positive and finite.
    """
    low, high = map(float, bounds)
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise InvalidParameterError(f"bounds = ({low}, {high}): need finite low < high.")
    sizes = np.asarray(problem.scale(), dtype=float)
    if sizes.ndim != 1 or not (np.all(sizes > 0.0) and np.all(np.isfinite(sizes))):
        raise InvalidParameterError(f"scale() = {sizes}: need one positive size per unknown.")
    mantissa, exponent = np.frexp(sizes)
    return Scaled(problem, np.ldexp(1.0, exponent - (mantissa < math.sqrt(0.5))), low, high)
