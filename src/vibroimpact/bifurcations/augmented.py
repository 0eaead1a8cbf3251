"""Curve of bifurcations as a ``Problem`` of continuation: Z = (z, w, a_1) along the parameter a_2.

Method      F(z, a) = 0 and a condition G(z, w, a) = 0 of conditions.py: d + k + 1 equations for as many unknowns and
            a parameter. Unknowns w are of size one already.
            Test functions, analytic along the curve, are those of the kind (tests_along.py), the orbit's touches, and
                bound   (a_1 - low) (high - a_1), which ends the curve                           (1)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.conditions import Condition
from vibroimpact.bifurcations.equations import Equations, Pair
from vibroimpact.branches.family import columns_of
from vibroimpact.normal_forms.forms import Forms

BOUND = "bound"
# A place on a bound may lie beyond it by so much, relative to half of the range.
BOUND_ROUNDED = 1e-12
Bounds = tuple[float, float]
Both = tuple[Bounds, Bounds]
Tests = Callable[[Floats, Floats, Pair], Mapping[str, float]]


class Augmented:
    """Solutions of equations over two parameters that satisfy a condition.

    Parameters
    ----------
    equations, condition
        F and G.
    tests
        Test functions of (z, w, a).
    bounds
        Ranges of the two parameters.
    """

    def __init__(
        self,
        equations: Equations,
        condition: Condition,
        tests: Tests,
        bounds: tuple[Bounds, Bounds],
    ) -> None:
        self.equations, self.condition, self.bounds = equations, condition, bounds
        self._tests = tests
        self.silent = {condition.own}  # tests of the orbit that are zero all along the curve
        d, k = len(equations.sizes), condition.unknowns
        self._parts = [d, d + k]
        spans = [high - low for low, high in bounds]
        self._sizes = np.concatenate([equations.sizes, np.ones(k), spans])

    def parts(self, Z: Floats, p: float) -> tuple[Floats, Floats, Pair]:
        """(z, w, a) of the unknowns Z and the parameter."""
        d, end = self._parts
        return Z[:d], Z[d:end], (float(Z[end]), float(p))

    def packed(self, z: Floats, w: Floats, a: Pair) -> Floats:
        """Unknowns Z."""
        return np.concatenate([z, w, a[:1]])

    def residual(self, Z: Floats, p: float) -> Floats:
        """F and G."""
        z, w, a = self.parts(Z, p)
        equations = self.equations.residual(z, a)
        if not np.all(np.isfinite(equations)):
            return np.full(len(Z), np.nan)
        return np.concatenate([equations, self.condition.value(z, w, a)])

    def jacobian(self, Z: Floats, p: float) -> tuple[Floats, Floats]:
        """Derivatives of F and G by Z, and by the parameter."""
        z, w, a = self.parts(Z, p)
        by_z, by_a = self.equations.by_both(z, a)
        if not (np.all(np.isfinite(by_z)) and np.all(np.isfinite(by_a))):
            return np.full((len(Z), len(Z)), np.nan), np.full(len(Z), np.nan)
        by_own, by_w, by_both = self.condition.derivatives(z, w, a)
        d, end = self._parts
        whole = np.zeros((end + 1, end + 2))
        whole[:d, :d], whole[:d, end:] = by_z, by_a
        whole[d:, :d], whole[d:, d:end], whole[d:, end:] = by_own, by_w, by_both
        return whole[:, :-1], whole[:, -1]

    def scale(self) -> Floats:
        """Size of each unknown and of the parameter."""
        return self._sizes

    def watch(self, Z: Floats, p: Floats) -> Mapping[str, Floats]:
        """Test functions."""
        parts = [self.parts(*at) for at in zip(Z, p.tolist(), strict=True)]
        low, high = self.bounds[0]
        first = Z[:, self._parts[1]]
        bound = (first - low) * (high - first) / (high - low) ** 2  # (1)
        touches = self.equations.touches(Z[:, : self._parts[0]], [a for *_, a in parts])
        heard = {name: values for name, values in touches.items() if name not in self.silent}
        return {BOUND: bound, **columns_of([self._tests(*at) for at in parts]), **heard}

    def orbit(self, Z: Floats, p: float) -> Any:
        """The orbit or fixed point."""
        z, _, a = self.parts(Z, p)
        return self.equations.solution(z, a)

    def forms(self, Z: Floats, p: float) -> Forms:
        """Multilinear forms of the map."""
        z, _, a = self.parts(Z, p)
        return self.equations.forms(z, a)

    def multipliers(self, Z: Floats, p: float) -> Complexes:
        """Multipliers of the map."""
        z, _, a = self.parts(Z, p)
        return self.equations.multipliers(z, a)


def is_inside(a: Pair, bounds: Both) -> bool:
    """Whether both parameters are in their ranges, to rounding: a curve that ends on a bound may end beyond it."""
    return all(
        abs(2.0 * x - low - high) <= (high - low) * (1.0 + BOUND_ROUNDED)
        for x, (low, high) in zip(a, bounds, strict=True)
    )
