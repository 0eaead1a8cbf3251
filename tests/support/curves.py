"""Curves of solutions given by formulas."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibroimpact.continuation import Curve

Floats = NDArray[np.float64]
# Locations are polished to rounding of a test function of size one and slope of order one.
LOCATED = 1e-12


def nothing(_z: Floats, _p: float) -> Mapping[str, float]:
    return {}


@dataclass
class Given:
    """A problem from formulas."""

    equations: Callable[[Floats, float], object]
    derivatives: Callable[[Floats, float], tuple[object, object]]
    sizes: tuple[float, ...] = (1.0, 1.0)
    tests: Callable[[Floats, float], Mapping[str, float]] = nothing

    def residual(self, z: Floats, p: float) -> Floats:
        return np.atleast_1d(np.asarray(self.equations(z, p), dtype=float))

    def jacobian(self, z: Floats, p: float) -> tuple[Floats, Floats]:
        by_z, by_p = self.derivatives(z, p)
        return np.atleast_2d(np.asarray(by_z, float)), np.atleast_1d(np.asarray(by_p, float))

    def scale(self) -> Floats:
        return np.array(self.sizes)

    def watch(self, z: Floats, p: Floats) -> Mapping[str, Floats]:
        found = [self.tests(*at) for at in zip(z, p.tolist(), strict=True)]
        return {name: np.array([values[name] for values in found]) for name in found[0]}


def circle(tests=nothing) -> Given:
    return Given(
        lambda z, p: z[0] ** 2 + p * p - 1.0, lambda z, p: (2.0 * z[0], 2.0 * p), tests=tests
    )


def line(tests, sizes=(1.0, 1.0)) -> Given:
    """The curve z = p."""
    return Given(lambda z, p: z[0] - p, lambda _z, _p: (1.0, -1.0), sizes, tests)


def pitchfork() -> Given:
    return Given(lambda z, p: p * z[0] - z[0] ** 3, lambda z, p: (p - 3.0 * z[0] ** 2, z[0]))


def located(curve: Curve, name: str) -> list[float]:
    return [point.parameter for point in curve.named(name)]
