"""Optimised machines against brute force, closed forms, finite differences and each other."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.design.objective import judge_of
from vibroimpact.model.parameters import with_parameters

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6, half_clearance=10.0, omega=1.0
)
QUICK: dict[str, Any] = {"points": 5, "starts": 2, "settle": 60, "periods": 20}
OVER = vi.worst_over("omega", (0.9, 1.1), "x1", **QUICK)
CLEARANCE = {"half_clearance": (2.0, 30.0)}
MU = 0.1


def absorber(nu: float, zeta: float, omega: float = 1.0) -> vi.Mechanism:
    """Den Hartog's linear absorber on an undamped machine of unit mass and stiffness."""
    k, c = MU * nu**2, 2.0 * MU * nu * zeta
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, MU]],
        damping=[[c, -c], [-c, c]],
        stiffness=[[1.0 + k, -k], [-k, k]],
        forces=(vi.Harmonic(omega, (1.0, 0.0)),),
    )


def two_balls(upper: float, lower: float, omega: float = 1.0) -> vi.Mechanism:
    """Two balls in slots with unequal clearances."""
    contacts = tuple(
        vi.Contact(row, -lower, upper, restitution=0.6)
        for row in ((-1.0, 1.0, 0.0), (-1.0, 0.0, 1.0))
    )
    return vi.Mechanism(
        mass=np.diag([1.0, 0.04, 0.05]),
        damping=np.diag([0.04, 0.0, 0.0]),
        stiffness=np.diag([1.0, 0.0, 0.0]),
        forces=(vi.Harmonic(omega, (1.0, 0.0, 0.0)),),
        contacts=contacts,
    )


@pytest.fixture(scope="module")
def best() -> vi.Design:
    return vi.optimise(DAMPER, CLEARANCE, OVER, budget=64, refine=1, progress=False)


# ---- objectives ----------------------------------------------------------------------------------


def test_an_objective_is_the_worst_of_a_sweep_of_each_machine_alone() -> None:
    o = replace(OVER, spread=(("restitution", (0.5, 0.7)), ("half_clearance", 0.1)))
    judge = judge_of(DAMPER, o, ("mass_ratio", "half_clearance"))
    rows = np.array([[0.05, 8.0], [0.1, 12.0]])
    for row, value in zip(rows, judge.values(rows), strict=True):
        worst = 0.0
        for r, part in ((0.6, 1.0), (0.5, 0.9), (0.5, 1.1), (0.7, 0.9), (0.7, 1.1)):
            machine = replace(
                DAMPER, mass_ratio=row[0], half_clearance=part * row[1], restitution=r
            )
            members = vi.sweep(
                machine, over={"omega": np.linspace(0.9, 1.1, 5)}, start=judge.starts, settle=60,
                periods=20, observe=[vi.observe.Extremes(row=(1.0, 0.0))], progress=False,
            )  # fmt: skip
            half = (members["x1_largest"] - members["x1_smallest"]) / 2.0
            worst = max(worst, float(half.max()))
        assert value == pytest.approx(worst, rel=1e-12)


def test_a_mean_is_the_trapezoidal_rule_of_the_closed_form() -> None:
    wide = vi.mean_over("omega", (0.8, 1.2), "x1", points=9, starts=1, settle=300, periods=5)
    judge = judge_of(DAMPER, wide, ("half_clearance",))
    w = np.linspace(0.8, 1.2, 9)
    amplitude = 1.0 / np.abs(1.0 - w**2 + 0.04j * w)
    exact = np.trapezoid(amplitude, w) / 0.4
    # the stops are out of reach; what is left of the start after 300 periods is exp(-0.02 300 2 pi)
    assert judge.values(np.array([[1e6]]))[0] == pytest.approx(exact, rel=1e-9)


def test_the_machine_without_impacts_is_worst_at_its_resonance() -> None:
    judge = judge_of(DAMPER, OVER, ("half_clearance",))
    exact = 1.0 / (2.0 * 0.02 * math.sqrt(1.0 - 0.02**2))
    assert judge.without_impacts == pytest.approx(exact, rel=1e-9)


# ---- the optimum ---------------------------------------------------------------------------------


def test_the_best_machine_is_not_beaten_by_brute_force(best: vi.Design) -> None:
    values = best.judge.values(np.linspace(2.0, 30.0, 113)[:, None])
    assert best.own_value <= values.min() * 1.005
    at = np.linspace(2.0, 30.0, 113)[np.argmin(values)]
    assert best.values["half_clearance"] == pytest.approx(at, abs=0.5)
    exact = 20.0 * math.log10(25.0 / math.sqrt(1.0 - 0.02**2) / best.own_value)
    assert best.reduction_db == pytest.approx(exact, abs=1e-8)


def test_den_hartogs_absorber_is_found() -> None:
    tuned = vi.tuned_damper(MU)
    machine = vi.Family(absorber, nu=1.1, zeta=0.3, omega=1.0)
    over = vi.worst_over("omega", (0.75, 1.2), "x1", points=61, starts=1, settle=60, periods=2)
    found = vi.optimise(
        machine, {"nu": (0.7, 1.2), "zeta": (0.05, 0.5)}, over, budget=700, refine=1,
        progress=False,
    )  # fmt: skip
    # between two of 61 points a peak is higher than at the nearest by (0.00375 / 0.1)^2 / 2 or less
    assert found.own_value == pytest.approx(tuned.peak, rel=2e-3)
    assert found.values["nu"] == pytest.approx(tuned.frequency_ratio, rel=5e-3)
    assert found.values["zeta"] == pytest.approx(tuned.damping_ratio, rel=5e-2)
    given = judge_of(machine, over, ("nu", "zeta")).values(np.array([[1.1, 0.3]]))[0]
    assert found.reduction_db == pytest.approx(20.0 * math.log10(given / found.own_value))


def test_two_balls_with_unequal_clearances_are_designed_by_the_same_call() -> None:
    machine = vi.Family(two_balls, upper=10.0, lower=10.0, omega=1.0)
    vary = {"upper": (3.0, 20.0), "lower": (3.0, 20.0)}
    found = vi.optimise(machine, vary, OVER, budget=64, refine=1, progress=False)
    table = np.array([[u, v] for u in (4.0, 9.0, 14.0, 19.0) for v in (4.0, 9.0, 14.0, 19.0)])
    assert found.own_value < found.judge.values(table).min() * 1.05
    assert found.reduction_db > 6.0


# ---- about the optimum ---------------------------------------------------------------------------


def test_the_exact_sensitivity_is_that_of_the_worst_orbit() -> None:
    over = replace(OVER, band=(1.05, 1.1), settle=200.0)
    judge = judge_of(DAMPER, over, ("mass_ratio", "half_clearance", "restitution"))
    design = vi.optimise(
        DAMPER, {"half_clearance": (9.0, 9.5), "restitution": (0.5, 0.55)}, over, budget=32,
        refine=1, progress=False,
    )  # fmt: skip
    assert design.sensitivity_exact
    assert design.sensitivity_error == {"half_clearance": 0.0, "restitution": 0.0}
    orbit = design.worst_motion
    assert isinstance(orbit, vi.Orbit)
    for name, slope in design.sensitivity.items():
        h, value = 1e-4, getattr(orbit.system, name)
        ends = [
            judge.measure.of_orbit(
                vi.find_orbit(with_parameters(orbit.system, {name: value + k * h}), orbit.states[0])
                if False
                else vi.find_orbit(
                    with_parameters(orbit.system, {name: value + k * h}), design.worst.state
                )
            )
            for k in (-1, 1)
        ]
        assert slope == pytest.approx((ends[1] - ends[0]) / (2.0 * h), rel=1e-5)
