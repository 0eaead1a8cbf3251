"""Curves of folds and period doublings in two parameters against those that AUTO-07p continues.

AUTO solves the flights, their variations and the condition on the multiplier by collocation; no
formula is shared (tools/auto07p).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from support.periodic import table

import vibroimpact as vi

CURVES = {curve["name"]: curve for curve in table("auto.toml")["curve"]}
HENON = {curve["kind"]: curve["points"] for curve in table("auto.toml")["henon"]}
PARAMETERS = {"w": "omega", "d": "clearance", "e": "restitution", "A": "force"}
OFFSETS = (1e-3, -1e-3)  # of the second parameter: at a fold only one side has orbits
MARGIN = 0.05  # of both parameters, beyond the outermost points of AUTO: curves turn back there
EPSS = 1e-8  # AUTO's accuracy of the place of a point
AUTO = 1e-10  # its EPSL and EPSU, and the last digit of its numbers


def points_of(curve: dict[str, Any]) -> list[dict[str, float]]:
    """The points of AUTO, each with all parameters."""
    fixed = {key: curve[key] for key in "kcAdew" if key in curve}
    return [fixed | dict(zip(curve["columns"], row, strict=True)) for row in curve["points"]]


def names_of(curve: dict[str, Any]) -> tuple[str, str]:
    first, second = (PARAMETERS[name] for name in curve["free"])
    return first, second


def oscillator_at(point: dict[str, float]) -> vi.ImpactOscillator:
    assert point["k"] == 1.0
    return vi.ImpactOscillator(
        zeta=point["c"] / 2.0, **{long: point[short] for short, long in PARAMETERS.items()}
    )


def bifurcation_near(curve: dict[str, Any], point: dict[str, float]) -> vi.BifurcationPoint:
    """The bifurcation on a branch of ours in the second parameter, past a point of AUTO."""
    flights, name, value = curve["flights"], names_of(curve)[1], point[curve["free"][1]]
    numbers = range(1, flights + 1)
    states = [[point["d"], -point["e"] * point[f"V{i}"], point[f"phase{i}"]] for i in numbers]
    times = [point[f"T{i}"] for i in (*numbers[1:], 1)]
    for offset in OFFSETS:
        beside = replace(oscillator_at(point), **{name: value + offset})
        start = vi.find_orbit(
            beside, vi.Guess(np.array(states), np.array(times)), stops="A" * flights,
            cycles=flights,
        )  # fmt: skip
        if start.converged:
            width = 2.0 * abs(offset)
            branch = vi.continue_orbit(start, name, (value - width, value + width))
            of_kind = [p for p in branch.special_points if p.kind == curve["kind"]]
            if of_kind:
                return min(of_kind, key=lambda p: abs(p.parameter - value))
    raise AssertionError(f"{curve['name']}: no bifurcation near {point}")


@cache
def curve_of(name: str) -> vi.BifurcationCurve:
    """Our curve, over the ranges of AUTO's points."""
    curve = CURVES[name]
    points = points_of(curve)
    bounds = []
    for short in curve["free"]:
        every = [point[short] for point in points]
        bounds.append((min(every) - MARGIN, max(every) + MARGIN))
    start = bifurcation_near(curve, points[len(points) // 3])
    return vi.continue_bifurcation(start, names_of(curve), (bounds[0], bounds[1]))


def corrected(found: vi.BifurcationCurve, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns of our curve at the second parameter of a point, and their rates by it."""
    low, high = np.array(found.bounds).T
    away = np.abs((found.values - at) / (high - low)).max(axis=1)
    z, value = found.curve.z[int(np.argmin(away))], float(at[1])
    for _ in range(5):  # Newton's method from the nearest point computed
        z = z - np.linalg.solve(
            found.problem.jacobian(z, value)[0], found.problem.residual(z, value)
        )
    by_z, by_value = found.problem.jacobian(z, value)
    return z, -np.linalg.solve(by_z, by_value)


@pytest.mark.slow
@pytest.mark.parametrize("name", CURVES)
def test_curves_of_bifurcations_pass_the_points_of_auto(name: str) -> None:
    curve, found = CURVES[name], curve_of(name)
    points = points_of(curve)
    assert len(points) >= 10
    for point in points:
        at = np.array([point[short] for short in curve["free"]])
        z, rates = corrected(found, at)
        orbit = found.problem.orbit(z, float(at[1]))
        # an error of AUTO's second parameter moves all unknowns here, at their rates
        allowed = AUTO * max(1.0, float(np.abs(at).max())) * (1.0 + float(np.abs(rates).max()))
        assert allowed < 1e-7
        assert z[-1] == pytest.approx(at[0], abs=allowed)
        for i in range(curve["flights"]):
            x, v, phase = orbit.states[i]
            assert x == pytest.approx(point["d"], abs=allowed)
            assert -v / orbit.system.restitution == pytest.approx(point[f"V{i + 1}"], abs=allowed)
            turns = (phase - point[f"phase{i + 1}"]) / (2.0 * np.pi)
            assert turns == pytest.approx(round(turns), abs=allowed)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["budd_dux_doubled_folds", "budd_dux_doubled_doublings_2"])
def test_a_curve_of_auto_ends_where_a_speed_is_zero_here(name: str) -> None:
    end = points_of(CURVES[name])[-1]
    assert abs(end["V1"]) < EPSS
    zeros = [p.parameters for p in curve_of(name).special_points if p.kind == "ZERO"]
    away = [max(abs(p["omega"] - end["w"]), abs(p["clearance"] - end["d"])) for p in zeros]
    # where AUTO stopped, the speed is zero to its EPSS
    assert min(away) < EPSS


@cache
def curve_of_henon(kind: str) -> vi.BifurcationCurve:
    """Our curve through the first of AUTO's points where alpha is given."""
    henon = vi.ExplicitMap(
        lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2 + 0.5 * x[0] * x[1]],
        dimension=2, parameters=("alpha", "beta"),
    )  # fmt: skip
    _, alpha, beta, x = next(point for point in HENON[kind] if point[0] == "UZ")
    start = vi.map_bifurcation(kind, henon, (x, x), (alpha, beta))
    return vi.continue_bifurcation(start, ("alpha", "beta"), ((-4.5, 5.5), (-1.2, 2.6)))


@pytest.mark.parametrize("kind", HENON)
def test_curves_of_the_henon_map_pass_the_points_of_auto(kind: str) -> None:
    found = curve_of_henon(kind)
    for _, alpha, beta, _ in HENON[kind]:
        z, rates = corrected(found, np.array([alpha, beta]))
        allowed = 10.0 * AUTO * max(1.0, abs(alpha)) * (1.0 + float(np.abs(rates).max()))
        assert allowed < 1e-7
        assert z[-1] == pytest.approx(alpha, abs=allowed)


@pytest.mark.parametrize("kind", HENON)
def test_strong_resonances_of_the_henon_map_are_where_auto_finds_them(kind: str) -> None:
    ours = curve_of_henon(kind).special_points
    for label, alpha, beta, _ in HENON[kind]:
        if label == "UZ":
            continue
        at = [tuple(p.parameters.values()) for p in ours if p.kind == label]
        assert min(max(abs(a - alpha), abs(b - beta)) for a, b in at) < EPSS
