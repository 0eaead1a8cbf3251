"""Points of codimension two of an orbit without symmetry and with four impacts, at 50 digits."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from witness.periodic import Orbit, doubling_test, fold_test, monodromy, special, torus_test
from witness.periodic_cases import damper
from witness.precision import Real, mp
from witness.symmetric import characteristic

import vibroimpact as vi

PLANE = ("omega", "half_clearance")


@cache
def flips() -> vi.BifurcationCurve:
    """Period doubling of the 2-2-2 orbits of set A."""
    system = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.95
    )
    orbit = vi.find_orbit(system, vi.State((0.0, 0.0), (0.0, 1.0)))
    assert orbit.symbol == "2-2-2"
    assert not orbit.symmetric
    branch = vi.continue_orbit(orbit, "omega", (0.8, 0.955))
    start = next(point for point in branch.special_points if point.kind == "PD")
    return vi.continue_bifurcation(start, PLANE, ((0.63, 1.0), (4.9, 12.7)))


def touching_roots(o: Orbit) -> Real:
    """The slope of the characteristic polynomial at -1: zero where -1 is a double root."""
    c = characteristic(monodromy(o))
    order = len(c) - 1
    return sum((order - k) * x * (-1) ** (order - k - 1) for k, x in enumerate(c[:-1]))


def other_pair(o: Orbit) -> Real:
    """The product of the two multipliers that are not real, less 1."""
    values = mp.eig(monodromy(o), left=False, right=False)
    pair = sorted(values, key=lambda mu: -abs(mp.im(mu)))[:2]
    return (pair[0] * pair[1]).real - 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "tests"),
    [
        ("LPPD_1", (fold_test, doubling_test)),
        ("R2_1", (doubling_test, touching_roots)),
        ("PDNS_1", (doubling_test, other_pair)),
    ],
)
def test_points_on_a_curve_of_flips_are_those_at_fifty_digits(
    label: str, tests: tuple[Callable[[Orbit], Real], ...]
) -> None:
    point = flips()[label]
    orbit = point.orbit
    names = {-1: "lower", 1: "upper"}
    around = (*orbit.signature.impacts[1:], orbit.signature.impacts[0])
    signature = [(contact, names[side]) for contact, side in around]
    (omega, clearance), exact = special(
        lambda w, d: damper("A", w, d), signature, orbit.signature.cycles,
        orbit.states[0], orbit.durations, list(point.parameters.values()), tests,
    )  # fmt: skip
    assert float(omega) == pytest.approx(point.parameters["omega"], abs=1e-9)
    assert float(clearance) == pytest.approx(point.parameters["half_clearance"], abs=1e-9)
    assert abs(torus_test(exact)) < 1e-20 or label == "LPPD_1"
    mu = np.array([complex(x) for x in mp.eig(monodromy(exact), left=False, right=False)])
    double = label == "R2_1"  # known to half of the digits
    nearest = np.abs(point.multipliers[:, None] - mu).min(axis=1)
    assert nearest.max() < (1e-4 if double else 1e-6)
