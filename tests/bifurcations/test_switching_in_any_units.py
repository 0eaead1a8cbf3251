"""Curves that begin at a point are found whatever the units of unknowns and parameters, and the bounds.

Of three maps, truncated normal forms, the new curve is known in closed form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import vibroimpact as vi

Map = Callable[[Sequence[Any], Sequence[Any]], Sequence[Any]]
WINDOWS = (3e-3, 1e3)  # half widths of the bounds, where the normal form holds within about 0.3
SIZE, UNITS = 1e3, (1e-4, 1e2)  # of the unknowns; of the parameters
STEPS = vi.Steps(first=0.1, points=12)
TURN = complex(math.cos(1.0), math.sin(1.0))


def flip(x: Sequence[Any], p: Sequence[Any]) -> Sequence[Any]:
    """Doubled orbits x^2 = s where a = b s - 1.4 s^2: their fold is a = b^2 / 5.6."""
    return [-(1.0 + p[0]) * x[0] + p[1] * x[0] ** 3 - 1.4 * x[0] ** 5]


def fold_flip(x: Sequence[Any], p: Sequence[Any]) -> Sequence[Any]:
    """Doubled orbits +-v at w = 0, v^2 = -a / 0.45; det = (1 + b) + 0.72 v^2 = 1 of half their map: NS."""
    w, v = x
    return [w + p[0] + p[1] * w + 0.35 * w**2 + 0.45 * v**2, -v + 0.8 * w * v]


def flip_torus(x: Sequence[Any], p: Sequence[Any]) -> Sequence[Any]:
    """Doubled orbits w^2 = -a / 0.7; NS where |nu (1 + b) + (-0.5 + 0.3i) w^2| = 1."""
    w, z = x[0], (x[1], x[2])
    size = z[0] ** 2 + z[1] ** 2
    factor = (
        TURN.real * (1.0 + p[1]) - 0.5 * w**2 - 0.6 * size,
        TURN.imag * (1.0 + p[1]) + 0.3 * w**2 + 0.2 * size,
    )
    return [
        -(1.0 + p[0]) * w - 0.7 * w**3 + 0.4 * w * size,
        factor[0] * z[0] - factor[1] * z[1],
        factor[1] * z[0] + factor[0] * z[1],
    ]


def henon(x: Sequence[Any], p: Sequence[Any]) -> Sequence[Any]:
    return [x[1], p[0] - p[1] * x[0] - x[1] ** 2 - 0.1 * x[0] * x[1]]


def fold_of_doubles(a: float, b: float) -> float:
    return a - b**2 / 5.6


def torus_at_fold_flip(a: float, b: float) -> float:
    return b - 0.72 * a / 0.45


def torus_at_flip_torus(a: float, b: float) -> float:
    return abs(TURN * (1.0 + b) + complex(-0.5, 0.3) * -a / 0.7) - 1.0


class Case(NamedTuple):
    """A map, the kind of a curve through its point with a start, and what vanishes on the new curve."""

    map: Map
    kind: str
    x: tuple[float, ...]
    p: tuple[float, float]
    box: float  # half width of the bounds
    vanishing: Callable[[float, float], float] | None = None


ON_TORUS = (0.09544511501033215,) * 2  # x^2 + 2 x - 0.2 = 0 at alpha = 0.2, beta = 1 - 0.1 x
TORUS = Case(henon, "NS", ON_TORUS, (0.2, 1.0 - 0.1 * ON_TORUS[0]), 8.0)
CASES = {
    "GPD": Case(flip, "PD", (0.0,), (0.0, 0.37), 0.5, fold_of_doubles),
    "LPPD": Case(fold_flip, "PD", (0.0, 0.0), (0.0, 0.2), 0.5, torus_at_fold_flip),
    "PDNS": Case(flip_torus, "PD", (0.0, 0.0, 0.0), (0.0, 0.1), 0.3, torus_at_flip_torus),
    **dict.fromkeys(("R2", "R3", "R4"), TORUS),
}


@cache
def curve_of(case: Case) -> vi.BifurcationCurve:
    """The curve of a case, with unknowns in one unit and parameters in others."""
    dimension = len(case.x)

    def scaled(x: Sequence[Any], p: Sequence[Any]) -> Sequence[Any]:
        there = case.map([SIZE * u for u in x], [k * q for k, q in zip(UNITS, p, strict=True)])
        return [y / SIZE for y in there]

    sizes = (*[1.0 / SIZE] * dimension, *(1.0 / k for k in UNITS))
    measured = vi.ExplicitMap(scaled, dimension, parameters=("a", "b"), sizes=sizes)
    first, second = (q / k for q, k in zip(case.p, UNITS, strict=True))
    start = vi.map_bifurcation(case.kind, measured, [x / SIZE for x in case.x], (first, second))
    low, high = ((-case.box / k, case.box / k) for k in UNITS)
    return vi.continue_bifurcation(start, ("a", "b"), (low, high))


@pytest.mark.slow
@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("label", CASES)
def test_every_curve_that_theory_announces_begins_at_its_point(label: str, window: float) -> None:
    case = CASES[label]
    point = next(p for p in curve_of(case).special_points if p.kind == label)
    at = np.array(list(point.parameters.values()))
    low, high = ((x - window / k, x + 1.3 * window / k) for x, k in zip(at, UNITS, strict=True))
    found = vi.switch_curve(point, (low, high), steps=STEPS)
    assert isinstance(found, tuple), found
    assert len(found) == (2 if label == "R4" else 1)
    for curve in found:
        assert isinstance(curve, vi.BifurcationCurve), curve
        values = (curve.values - at) * UNITS
        away = np.abs(values).max(axis=1)
        assert away.min() < min(window, 0.02)  # found where the normal form holds
        if case.vanishing:
            off = np.abs([case.vanishing(*pair) for pair in values[np.argsort(away)[:12]]])
            assert np.all(
                off <= 1e-8
            )  # exact; the widest bounds measure parameters in units of 1e3


@pytest.mark.parametrize("window", [0.02, 1e4])
def test_a_tongue_begins_at_its_tip_whatever_the_bounds(window: float) -> None:
    point = curve_of(TORUS)["1/7_1"]
    at = np.array(list(point.parameters.values()))
    low, high = ((x - window / k, x + 1.3 * window / k) for x, k in zip(at, UNITS, strict=True))
    found = vi.tongue(point, (low, high), steps=STEPS)
    assert isinstance(found, vi.Tongue), found
    for side in found.sides:
        assert (np.abs(side.values - at) * UNITS).max(axis=1).min() < 0.02
