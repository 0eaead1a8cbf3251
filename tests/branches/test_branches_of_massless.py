"""Branches of machines with massless coordinates: touches by the impedance of the linear machine."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from support.massless import DASH, LEVEL, OWN, RIGID, SOFT, SPRING, C, K, jenkins, maxwell

import vibroimpact as vi
from vibroimpact.bifurcations.grazing_contact import free_gap_rate
from vibroimpact.bifurcations.of_orbits import OrbitPlane

REST = vi.State((0.0, 0.0), (0.0, 0.0))


def amplitude(omega: float, own: float = OWN) -> float:
    """Of the mass with the Maxwell element, without its stop."""
    w = 1j * omega
    impedance = [[K + w * w + w * (C + DASH), -w * DASH], [-w * DASH, own + w * DASH]]
    return float(abs(np.linalg.solve(np.array(impedance), [0.5, 0.0])[0]))


@pytest.fixture(scope="module")
def rigid() -> vi.Branch:
    return vi.continue_orbit(vi.find_orbit(maxwell(RIGID, 1.6), REST), "omega", (1.55, 1.8))


@pytest.mark.slow
def test_impacts_begin_where_the_linear_motion_touches_the_stop(rigid: vi.Branch) -> None:
    """A rigid stop and a soft one: the same frequency, where the amplitude is the gap."""
    touch = brentq(lambda w: amplitude(w) - 0.4, 1.4, 1.7, xtol=1e-14)
    assert abs(rigid["ZERO1"].parameter - touch) < 1e-12
    soft = vi.continue_orbit(vi.find_orbit(maxwell(SOFT, 1.59), REST), "omega", (1.555, 1.63))
    at = min(soft.special_points, key=lambda p: abs(p.parameter - touch))
    assert at.kind == "GR"
    assert (
        abs(at.parameter - touch) < 1e-8
    )  # a soft stop is left with a rate of zero: a root of two
    assert soft["SN1"].parameter > touch  # the motions with contact begin unstable, and fold


@pytest.mark.slow
def test_the_curve_of_touches_is_that_of_the_impedance_in_two_parameters(rigid: vi.Branch) -> None:
    names = "omega", "stiffness[1][1]"
    curve = vi.continue_bifurcation(rigid["ZERO1"], names, ((1.5, 1.6), (0.24, 0.26)))
    values = np.array(curve.values)
    assert np.ptp(values[:, 1]) > 0.0199
    np.testing.assert_allclose([amplitude(*a) for a in values], 0.4, rtol=0.0, atol=1e-10)
    orbit, h = rigid["ZERO1"].orbit, 1e-5
    plane, a = (
        OrbitPlane.around_orbit(orbit, names, (1.0, 1.0), {}),
        np.array([orbit.mechanism.omega, OWN]),
    )
    z = plane.packed(orbit.states, orbit.durations)
    for across in (0, 1):
        move = h * np.eye(2)[across]
        wanted = (amplitude(*(a - move)) - amplitude(*(a + move))) / (2.0 * h)
        got = free_gap_rate(plane, z, (float(a[0]), float(a[1])), across)
        assert abs(got - wanted) < 1e-8


def test_a_fold_has_a_multiplier_one_and_two_more(rigid: vi.Branch) -> None:
    multipliers = rigid["SN1"].orbit.multipliers
    assert len(multipliers) == 3
    assert abs(multipliers[0] - 1.0) < 1e-9
    assert np.abs(multipliers[1:]).max() < 0.5


@pytest.mark.slow
def test_a_slider_begins_to_slip_where_the_force_of_its_spring_reaches_the_level() -> None:
    """Of the linear machine with the spring on the ground; there the slips take no time."""
    m = jenkins(vi.SoftStop((1.0, 0.0), upper=9.0), force=0.45)
    branch = vi.continue_orbit(vi.find_orbit(m, REST), "forces[0].sine[0]", (0.37, 0.46))
    stuck = abs(1.0 / (0.3 + SPRING - 1.1**2 + 1.1j * C))
    (point,) = branch.special_points
    assert point.kind == "GR"
    assert abs(point.parameter - LEVEL / (SPRING * stuck)) < 1e-8
