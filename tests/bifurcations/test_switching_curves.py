"""Curves that begin at points of codimension two, against closed forms and asymptotic laws."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.bifurcations.starting_orbits import folds_of_four

R = -0.1
BOUNDS = ((-3.0, 6.0), (-2.5, 2.5))


def henon() -> vi.ExplicitMap:
    return vi.ExplicitMap(
        lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2 + R * x[0] * x[1]],
        dimension=2,
        parameters=("alpha", "beta"),
    )


def fixed_x(alpha: float, beta: float) -> float:
    """The fixed point: (1 - R) x^2 + (1 + beta) x - alpha = 0."""
    return (-(1 + beta) + math.sqrt((1 + beta) ** 2 + 4 * (1 - R) * alpha)) / (2 * (1 - R))


def multiplier(alpha: float, beta: float) -> complex:
    """nu in the upper half plane, from trace and determinant."""
    x = fixed_x(alpha, beta)
    trace, det = -2 * x + R * x, beta - R * x
    return trace / 2 + cmath.sqrt(trace**2 / 4 - det)


@cache
def torus() -> vi.BifurcationCurve:
    x = min(np.roots([1.0, 2.0, -0.2]), key=lambda root: abs(root - 0.1)).real
    start = vi.map_bifurcation("NS", henon(), (x, x), (0.2, 1.0 + R * x))
    return vi.continue_bifurcation(start, ("alpha", "beta"), BOUNDS)


@cache
def switched(label: str) -> tuple[vi.BifurcationCurve, ...]:
    found = vi.switch_curve(torus()[label])
    assert isinstance(found, tuple), found
    return found


def near(curve: vi.BifurcationCurve, label: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parameters, their distance from the point and that of the orbit, nearest points first."""
    point = torus()[label]
    at = np.array(list(point.parameters.values()))
    away = np.linalg.norm(curve.values - at, axis=1)
    order = np.argsort(away)
    order = order[(away[order] < 4.0 * max(away.min(), 5e-4)) & (away[order] > 1e-5)]
    x = np.array([curve.orbit(int(k)).x for k in order])
    middle = np.array([fixed_x(*curve.values[k]) for k in order])
    return curve.values[order], away[order], np.linalg.norm(x - middle[:, None], axis=1)


def exponent(away: np.ndarray, amplitude: np.ndarray) -> float:
    return float(np.polyfit(np.log(away), np.log(amplitude), 1)[0])


@pytest.mark.slow
def test_folds_of_period_four_begin_in_the_directions_of_the_normal_form() -> None:
    curves = switched("R4_1")
    directions = vi.normal_forms.fold_directions(torus()["R4_1"].normal_form)
    taken = set()
    for curve in curves:
        assert curve.kind == "SN"
        assert curve.problem.equations.map.iterate == 4  # type: ignore[attr-defined]
        values, away, amplitude = near(curve, "R4_1")
        mu = np.array([cmath.log(multiplier(*a) / 1j) for a in values])
        turns = [np.abs(np.angle(mu / d)) for d in directions]
        which = int(np.argmin([turn[0] for turn in turns]))
        taken.add(which)
        # terms of the next order turn the curve in proportion to the size of the orbit
        assert turns[which][0] < amplitude[0]
        assert exponent(away, amplitude) == pytest.approx(0.5, abs=amplitude.max())
    assert taken == {0, 1}


def test_a_fold_that_is_not_found_is_a_reason_in_its_place() -> None:
    point = torus()["R4_1"]

    def first_alone(point: Any, which: int, *rest: Any) -> Any:
        return folds_of_four(point, which, *rest) if which == 0 else iter(())

    alone = replace(point, record=replace(point.record, begins=first_alone))
    curve, missing = vi.switch_curve(alone, steps=vi.Steps(points=6))  # type: ignore[misc]
    assert isinstance(curve, vi.BifurcationCurve)
    assert isinstance(missing, vi.NotFound)
    assert "there is no start within the bounds (10 times)" in missing.reason


@pytest.mark.slow
def test_neimark_sacker_of_the_doubled_orbit_begins_at_r2_with_a_square_root() -> None:
    (curve,) = switched("R2_1")
    assert (curve.kind, curve.problem.equations.map.iterate) == ("NS", 2)  # type: ignore[attr-defined]
    _, away, amplitude = near(curve, "R2_1")
    assert not curve.neutral[int(np.argmin(np.abs(curve.values[:, 0] - 2.9)))]
    assert exponent(away, amplitude) == pytest.approx(0.5, abs=0.05)


@pytest.mark.slow
def test_a_neutral_saddle_of_period_three_begins_at_r3_in_proportion() -> None:
    (curve,) = switched("R3_1")
    assert curve.problem.equations.map.iterate == 3  # type: ignore[attr-defined]
    assert curve.neutral.all()
    _, away, amplitude = near(curve, "R3_1")
    assert exponent(away, amplitude) == pytest.approx(1.0, abs=0.05)


def test_at_r1_the_curve_of_folds_is_followed() -> None:
    (curve,) = switched("R1_1")
    x = np.array([curve.orbit(k).x[0] for k in range(len(curve))])
    a, b = curve.values.T
    discriminant = (1 + b) ** 2 + 4 * (1 - R) * a
    assert np.abs(discriminant).max() < 1e-9
    np.testing.assert_allclose(x, -(1 + b) / (2 * (1 - R)), atol=1e-7)


def test_fold_of_the_doubled_orbit_at_a_generalised_flip_is_the_parabola_of_algebra() -> None:
    # x -> -(1 + a) x + b x^3 - x^5: period two where a - b x^2 + x^4 = 0, its fold at b^2 = 4 a, b > 0
    quintic = vi.ExplicitMap(
        lambda x, p: [-(1.0 + p[0]) * x[0] + p[1] * x[0] ** 3 - x[0] ** 5],
        dimension=1,
        parameters=("a", "b"),
    )
    start = vi.map_bifurcation("PD", quintic, (0.0,), (0.0, 0.37))
    flips = vi.continue_bifurcation(start, ("a", "b"), ((-0.5, 0.5), (-1.0, 1.0)))
    found = vi.switch_curve(flips["GPD_1"])
    assert isinstance(found, tuple), found
    a, b = found[0].values.T
    np.testing.assert_allclose(a, b**2 / 4, atol=1e-9)
    assert b.max() == pytest.approx(1.0)
    assert b.min() > 0.0


@pytest.mark.slow
def test_the_fold_flip_gives_the_doubled_torus_where_theory_has_one() -> None:
    b = 0.5  # on PD: x = (1 + beta) / 2
    x = (1 + b) / 2
    start = vi.map_bifurcation("PD", henon(), (x, x), ((1 - R) * x * x + (1 + b) * x, b))
    point = vi.continue_bifurcation(start, ("alpha", "beta"), BOUNDS)["LPPD_1"]
    found = vi.switch_curve(point)
    if point.normal_form.scaled[1] > 0.0:
        assert isinstance(found, tuple), found
        assert not found[0].neutral.all()
    else:
        assert isinstance(found, vi.NotFound)


@pytest.mark.slow
def test_where_theory_has_no_curve_the_reason_is_given() -> None:
    half = vi.ExplicitMap(
        lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2 + 0.5 * x[0] * x[1]],
        dimension=2,
        parameters=("alpha", "beta"),
    )
    x = math.sqrt(1.2) - 1.0
    start = vi.map_bifurcation("NS", half, (x, x), (0.2, 1.0 + 0.5 * x))
    curve = vi.continue_bifurcation(start, ("alpha", "beta"), BOUNDS)
    refused: Any = vi.switch_curve(curve["R4_1"])  # |A| = sqrt(2 / 130) < 1
    assert isinstance(refused, vi.NotFound)
    assert "< 1" in refused.reason
    weak = vi.switch_curve(curve["1/5_1"])
    assert isinstance(weak, vi.NotFound)


@pytest.mark.slow
def test_the_damper_has_both_folds_of_period_four_at_its_first_resonance() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.8, omega=0.98
    )
    branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (0.95, 1.05))
    start = next(p for p in branch.special_points if p.kind == "NS" and p.parameter > 0.96)
    curve = vi.continue_bifurcation(start, ("omega", "half_clearance"), ((0.93, 1.05), (5.5, 6.3)))
    point = curve["R4_1"]
    found = vi.switch_curve(point)
    assert isinstance(found, tuple)
    assert len(found) == 2
    for side in found:
        assert side.orbit(0).symbol == "2-2-2"  # four half maps
        assert np.abs(side.multipliers - 1.0).min(axis=1).max() < 1e-6
