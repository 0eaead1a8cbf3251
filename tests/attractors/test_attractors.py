"""Attractors: known maps, planted orbits and curves, and the impact damper itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from vibroimpact_papers.impact_damper.symmetric_bifurcations import symmetric_bifurcations

import vibroimpact as vi
from vibroimpact.attractors.classify import Attractor, classify
from vibroimpact.attractors.point_sets import Kind, classify_points, count_pieces, find_period
from vibroimpact.attractors.rotation import closed_curve, rotation_number, weighted_average
from vibroimpact.simulation.lyapunov import (
    LyapunovEstimate,
    error_of_mean,
    lyapunov_exponent,
    parts_of,
    ratio_of_means,
)
from vibroimpact.simulation.simulate import RunEnd

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)
SET_B = vi.ImpactDamper(
    mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=8.0, omega=0.975
)
SET_C = vi.ImpactDamper(
    mass_ratio=0.05092, omega_n=1.0, zeta=0.015, restitution=0.7, half_clearance=6.0, omega=0.418
)
PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))


def ellipse(turns, n=4000):
    angle = 2.0 * math.pi * turns * np.arange(n)
    return np.column_stack([np.cos(angle), 0.5 * np.sin(angle + 0.3)])


def henon(a, n=4000, settle=3000):
    """Points of the Henon map (b = 0.3) and its exponent, from its own tangent map."""
    x, y, tangent = 0.1, 0.1, np.array([1.0, 0.3])
    points, growth = [], []
    for i in range(settle + n):
        tangent = np.array([-2.0 * a * x * tangent[0] + tangent[1], 0.3 * tangent[0]])
        length = math.hypot(*tangent)
        tangent /= length
        x, y = 1.0 - a * x * x + y, 0.3 * x
        if i >= settle:
            points.append((x, y))
            growth.append(math.log(length))
    return np.array(points), estimate(growth)


def estimate(growth):
    growth = np.asarray(growth)
    ones = np.ones(len(growth))
    value, error = ratio_of_means(growth, ones)
    return LyapunovEstimate(value, error, value, growth, ones, RunEnd.IMPACTS)


def delayed_logistic(a, settle, n=4000):
    """x -> a x (1 - x of the iterate before); Neimark-Sacker at a = 2 with angle 2 pi / 6."""
    new, old, points = 0.55, 0.5, []
    for i in range(settle + n):
        new, old = a * new * (1.0 - old), new
        if i >= settle:
            points.append((new, old))
    return np.array(points)


# --- rotation numbers and weighted averages ------------------------------------------------------


@pytest.mark.parametrize("rho", [GOLDEN, math.sqrt(2.0) - 1.0, math.pi / 10.0, 0.0123456789])
def test_the_rotation_number_of_a_rigid_rotation_is_found_to_its_stated_error(rho):
    points = ellipse(rho)
    found = rotation_number(points[:, 0])
    expected = min(rho, 1.0 - rho)
    assert abs(found.value - expected) <= max(found.error, 1e-15)
    assert found.error < 1e-9


def test_a_weighted_average_converges_where_a_plain_one_does_not():
    # <cos> over a rotation is 0; the plain mean of N values is of order 1 / N, this one of order
    # exp(-c sqrt(N)), below rounding at N = 4000.
    values = np.cos(2.0 * math.pi * GOLDEN * np.arange(4000) + 0.4)
    assert abs(values.mean()) > 1e-5
    assert abs(weighted_average(values)) < 1e-15


def test_a_nonuniform_rotation_keeps_the_rotation_number_of_its_conjugate():
    angle = 2.0 * math.pi * GOLDEN * np.arange(4000)
    uneven = angle + 0.4 * np.sin(angle)
    curve = closed_curve(np.column_stack([np.cos(uneven), np.sin(uneven)]))
    assert curve is not None
    assert curve.turns == 1
    assert curve.rotation.value == pytest.approx(1.0 - GOLDEN, abs=1e-12)


def test_a_doubled_torus_is_one_curve_of_two_turns_in_disorder_on_one():
    rho = math.sqrt(2.0) / 10.0
    for n in (512, 2000, 4000):
        half = 2.0 * math.pi * rho * np.arange(n)
        radius = 1.0 + 0.2 * np.cos(half)
        points = np.column_stack(
            [radius * np.cos(2.0 * half), radius * np.sin(2.0 * half), 0.2 * np.sin(half)]
        )
        curve = closed_curve(points)
        assert curve is not None
        assert curve.turns == 2
        assert curve.rotation.value == pytest.approx(rho, abs=1e-10)


def test_random_points_lie_on_no_curve():
    points = np.random.default_rng(1).normal(size=(2000, 2))
    assert closed_curve(points) is None
    assert classify_points(points).kind is Kind.UNDECIDED


# --- classification of iterates ------------------------------------------------------------------


@pytest.mark.parametrize("period", [1, 2, 7, 64, 199, 256])
def test_planted_periods_are_found_and_are_the_smallest(period):
    cycle = np.random.default_rng(period).normal(size=(period, 3))
    points = np.tile(cycle, (1 + 3000 // period, 1))
    assert find_period(points) == (period, 0.0)


def test_a_slow_approach_to_a_point_is_not_taken_for_a_period():
    # One step moves by 1e-10, below the tolerance; the distance left is 1e-4.
    points = np.outer(1e-4 * (1.0 - 1e-6) ** np.arange(4000), [1.0, 0.5])
    assert find_period(points)[0] == 0


@pytest.mark.parametrize("of", [1, 3])
def test_a_spiral_that_comes_back_after_67_turns_is_not_taken_for_67_points(of):
    # The radius, 1e-8, changes by less than 1e-9 in the last third: lag 67 of returns to each of
    # the ``of`` points is within the tolerance, no shorter one is.
    turns = np.exp(2j * math.pi * np.arange(4000) / (67 * of)) ** of
    spiral = 1e-8 * (1.0 - 1e-5) ** np.arange(4000) * turns
    places = np.exp(2j * math.pi * np.arange(4000) / of)
    points = np.column_stack([spiral.real + places.real, spiral.imag + places.imag])
    assert find_period(points)[0] == 0
    assert not classify_points(points).settled


def test_rounding_that_repeats_after_more_points_is_the_short_orbit():
    cycle = np.array([[0.0, 1.0], [1.0, 0.0], [0.5, 0.2]])
    noise = np.random.default_rng(4).uniform(-1.5e-9, 1.5e-9, (96, 2))
    points = np.tile(np.tile(cycle, (32, 1)) + noise, (42, 1))
    assert find_period(points)[0] == 3


def test_an_orbit_with_neighbours_next_to_each_other_has_its_period():
    # the impacts of a chatter come closer and closer
    cycle = np.column_stack([0.5 ** np.arange(40), np.zeros(40)])
    assert find_period(np.tile(cycle, (100, 1)))[0] == 40


@pytest.mark.parametrize("k", [1, 2, 3, 8])
def test_k_closed_curves_are_counted(k):
    rho = GOLDEN / k
    centre = 3.0 * np.exp(2j * math.pi * np.arange(4000) / k)
    points = ellipse(rho) + (k > 1) * 3.0 * np.column_stack([centre.real, centre.imag])
    shape = classify_points(points)
    assert (shape.kind, shape.pieces) == (Kind.QUASIPERIODIC, k)
    expected = (k * rho) % 1.0
    assert shape.curve is not None
    assert shape.curve.rotation.value == pytest.approx(min(expected, 1 - expected), abs=1e-9)


def test_a_curve_of_which_only_arcs_are_seen_is_undecided():
    # rho = 1/7 + 1e-5: 1000 iterates pass 1 % of the gaps between the seven first points.
    shape = classify_points(ellipse(1.0 / 7.0 + 1e-5, n=1000))
    assert shape.kind is Kind.UNDECIDED
    assert shape.reason


def test_a_long_spiral_is_not_quasiperiodic():
    # Just below the Neimark-Sacker point the multiplier is sqrt(a - 1): 0.9995 per iterate.
    shape = classify_points(delayed_logistic(1.999, settle=200))
    assert shape.kind is Kind.UNDECIDED
    assert not shape.settled
    assert classify_points(delayed_logistic(1.99, settle=20_000)).kind is Kind.PERIODIC


@pytest.mark.parametrize("a", [2.01, 2.05, 2.1, 2.15])
def test_the_circle_of_the_delayed_logistic_map_is_one_closed_curve(a):
    shape = classify_points(delayed_logistic(a, settle=20_000))
    assert (shape.kind, shape.pieces) == (Kind.QUASIPERIODIC, 1)
    assert shape.curve is not None
    assert shape.curve.turns == 1
    assert shape.curve.rotation.value < 1.0 / 6.0  # the angle falls from 2 pi / 6 at a = 2


def test_the_rotation_number_tends_to_the_angle_of_the_multiplier():
    # rho(a) = 1/6 - c (a - 2) + O((a - 2)^2): extrapolated from two circles it is 1/6.
    near, far = (
        closed_curve(delayed_logistic(a, settle=100_000)).rotation.value for a in (2.005, 2.01)
    )
    assert 2.0 * near - far == pytest.approx(1.0 / 6.0, abs=3e-5)


@pytest.mark.parametrize(("a", "period"), [(0.2, 1), (0.9, 2), (1.0, 4), (1.03, 8), (1.3, 7)])
def test_periods_of_the_henon_map(a, period):
    shape = classify_points(*henon(a))
    assert (shape.kind, shape.period) == (Kind.PERIODIC, period)


@pytest.mark.parametrize(("a", "pieces"), [(1.4, 1), (1.08, 4), (1.07, 4), (1.06, 8)])
def test_bands_of_henon_chaos(a, pieces):
    # The bands merge in pairs as the doubling cascade is run backwards: 8, 4, ... 1.
    shape = classify_points(*henon(a))
    assert (shape.kind, shape.pieces) == (Kind.CHAOTIC, pieces)


def test_the_henon_exponent_is_the_published_one_within_its_error():
    # 0.41922 +- 0.00006 per iterate at a = 1.4, b = 0.3 (Grassberger and Procaccia 1983 and later).
    _, exponent = henon(1.4, n=20_000)
    assert abs(exponent.value - 0.4192) <= 3.0 * exponent.error
    assert exponent.error < 0.005


def test_near_neighbours_of_one_orbit_do_not_make_pieces():
    assert count_pieces(ellipse(GOLDEN)) == 1


# --- errors of means -----------------------------------------------------------------------------


def test_blocking_recovers_the_error_of_a_correlated_mean():
    # AR(1), x' = 0.9 x + e: the variance of the mean of n is 1 / ((1 - 0.9)^2 n) to O(1 / n).
    rng = np.random.default_rng(2)
    errors, means = [], []
    for _ in range(64):
        x = np.zeros(8192)
        for i, e in enumerate(rng.normal(size=8191)):
            x[i + 1] = 0.9 * x[i] + e
        means.append(x.mean())
        errors.append(error_of_mean(x))
    exact = 10.0 / math.sqrt(8192)
    assert np.std(means) == pytest.approx(exact, rel=0.35)  # 4 / sqrt(2 * 64)
    # The largest of the levels lies above the truth, by the noise of the one with 16 blocks.
    assert exact <= np.mean(errors) <= 1.6 * exact


def test_blocking_leaves_uncorrelated_means_alone_within_its_noise():
    x = np.random.default_rng(3).normal(size=4096)
    assert 1.0 / 64.0 * 0.95 <= error_of_mean(x) <= 1.0 / 64.0 * 1.8


# --- the impact damper ---------------------------------------------------------------------------


def product_of_multipliers(damper, attractor: Attractor):
    """R^2 per impact times the contraction of the main mass over the period."""
    n, p, q = attractor.type
    time = n * damper.period
    return damper.restitution ** (2 * (p + q)) * math.exp(-2 * damper.zeta * damper.omega_n * time)


def correlated(rng, n, memory):
    """Noise of mean 0, spread 1 and correlation ``memory`` between neighbours."""
    noise = rng.standard_normal(n) * math.sqrt(1.0 - memory**2)
    for i in range(1, n):
        noise[i] += memory * noise[i - 1]
    return noise


@pytest.mark.parametrize("seed", range(40))
def test_growth_is_cut_where_planted_chaos_ends_or_begins(seed):
    """The regular part has blocks that are all alike, or beat as on a torus."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(300, 1000))
    at = int(rng.integers(32, n - 32))
    memory = rng.choice([0.0, 0.5, 0.8])
    chaos = 15.0 + 4.0 * correlated(rng, at, memory)
    regular = rng.choice([-1.0, 0.0]) + 0.3 * rng.choice([0.0, 1.0]) * np.sin(
        rng.uniform(0.1, 3.0) * np.arange(n - at)
    )
    growth = np.concatenate([chaos, regular])
    duration = np.concatenate([rng.uniform(40.0, 60.0, at), np.full(n - at, 45.0)])
    assert parts_of(growth, duration) == [slice(0, at), slice(at, n)]
    backwards = parts_of(growth[::-1], duration[::-1])
    assert backwards == [slice(0, n - at), slice(n - at, n)]


def test_stationary_growth_is_left_whole():
    """Of 160 series none: a share below one in fifty at 95 per cent."""
    rng = np.random.default_rng(5)
    for memory in (0.0, 0.5, 0.8, -0.5):
        for _ in range(40):
            n = int(rng.integers(200, 1000))
            growth = rng.uniform(-2.0, 10.0) + 5.0 * correlated(rng, n, memory)
            assert parts_of(growth, rng.uniform(40.0, 60.0, n)) == [slice(0, n)]


def test_growth_that_still_settles_by_a_few_e_folds_is_left_whole():
    growth = -1.0 + np.exp(-np.arange(900) / 8.0)
    assert parts_of(growth, np.ones(900)) == [slice(0, 900)]


SHORT_LIVED = vi.ImpactDamper(
    mass_ratio=0.074, omega_n=1.44, zeta=0.026, restitution=0.92, half_clearance=5.25, omega=0.705
)


def test_chaos_that_ends_while_its_exponent_is_measured_is_a_transient():
    """Chaos of exponent 0.09, then 1-1-1, whose multipliers say what its exponent is.

    How long the chaos lasts depends on the last bits of a start: the first of those from which it
    ends while it is measured.
    """
    starts = (vi.State((0.0, 0.0), (0.01 * k, 1.0)) for k in range(20))
    found, start = next(
        (found, start)
        for start in starts
        if (found := classify(SHORT_LIVED, start)).transient_name == "chaotic"
    )
    assert found.label.startswith("1-1-1 periodic, symmetric")
    assert found.label.endswith("after transient chaos")
    contracting = math.log(abs(found.multipliers[0])) / SHORT_LIVED.period
    assert found.exponent.value == pytest.approx(contracting, abs=5.0 * found.exponent.error)
    estimate = lyapunov_exponent(SHORT_LIVED, start, impacts=120_000)
    assert estimate.value == pytest.approx(contracting, abs=5.0 * estimate.error)
    (chaos,) = estimate.earlier
    assert chaos.is_positive
    assert "before, " in estimate.statement


def test_set_a_at_the_first_panel_is_the_symmetric_orbit():
    found = classify(SET_A, PLAIN)
    assert found.label == "1-1-1 periodic, symmetric"
    assert found.transient == 0
    exact = math.log(abs(found.multipliers[0])) / SET_A.period
    assert abs(found.exponent.value - exact) <= 3.0 * found.exponent.error


@pytest.mark.parametrize(
    ("damper", "omega", "label"),
    [
        (SET_A, 0.9817, "2-2-2 periodic, not symmetric"),
        (SET_B, 0.9526, "79-79-79 periodic, symmetric"),
        (SET_B, 0.9454, "8-8-8 periodic, not symmetric"),
        (SET_B, 0.94, "1-1-1 periodic, symmetric"),
    ],
)
def test_multipliers_of_periodic_motions_obey_the_determinant_identity(damper, omega, label):
    damper = replace(damper, omega=omega)
    found = classify(damper, PLAIN)
    assert found.label == label
    assert abs(found.multipliers[0]) < 1.0
    # 79 periods have a determinant below rounding of the largest multiplier: seen absolutely there.
    product = np.prod(found.multipliers)
    expected = product_of_multipliers(damper, found)
    assert abs(product - expected) <= 1e-9 * max(expected, np.abs(found.multipliers[0]) * 1e-4)


@pytest.mark.parametrize(("damper", "omega"), [(SET_A, 1.00314), (SET_B, 0.975), (SET_C, 0.4268)])
def test_circles_are_one_symmetric_closed_curve_with_exponent_zero(damper, omega):
    found = classify(replace(damper, omega=omega), PLAIN)
    assert found.label == "quasiperiodic, 1 closed curve, symmetric"
    assert abs(found.exponent.value) <= 3.0 * found.exponent.error
    assert found.rotation.error < 1e-9
    assert found.periods_per_point == pytest.approx(1.0, abs=1e-9)


def test_the_circle_of_set_a_is_born_supercritically_at_the_point_found_in_closed_form():
    # Squares of amplitudes are linear in the distance to the Neimark-Sacker point, and rotation
    # numbers run into the angle of the multiplier there, 2 pi rho, both up to O(distance^2).
    (birth,) = [p for p in symmetric_bifurcations(SET_A, omega=(1.0, 1.02)) if p.kind == "NS"]
    steps = np.array([2e-4, 4e-4])
    circles = [
        classify(replace(SET_A, omega=birth.omega - d), PLAIN, most_settle_events=512_000)
        for d in steps
    ]
    squares = np.array([circle.section.x1.std() ** 2 for circle in circles])
    assert squares[1] / squares[0] == pytest.approx(2.0, rel=0.05)
    near, far = (circle.rotation.value for circle in circles)
    angle = abs(np.angle(birth.half_multiplier**2)) / (2.0 * math.pi)
    assert 2.0 * near - far == pytest.approx(angle, abs=0.05 * abs(near - angle))
    above = classify(replace(SET_A, omega=birth.omega + 2e-4), PLAIN, most_settle_events=512_000)
    assert above.label == "1-1-1 periodic, symmetric"


def test_a_transient_is_reported_with_what_it_was():
    found = classify(replace(SET_A, omega=1.00857), PLAIN)
    assert found.label == "1-1-1 periodic, symmetric"
    assert found.transient > 0
    assert found.transient_name == "undecided"  # a spiral


def test_chaos_of_set_c_has_a_positive_exponent_and_chatter():
    found = classify(replace(SET_C, omega=0.41719), PLAIN)
    assert found.kind is Kind.CHAOTIC
    assert found.exponent.is_positive
    assert found.chatters > 0
    assert "with chatter" in found.label


def test_a_motion_without_impacts_is_silent():
    damper = replace(SET_A, half_clearance=1000.0)
    still = classify(damper, vi.State((0.0, 0.0), (0.0, 0.0)))
    assert still.kind is Kind.SILENT
    assert still.reason


def test_the_exponent_of_a_periodic_motion_is_that_of_its_multiplier():
    found = lyapunov_exponent(SET_A, PLAIN, impacts=40_000)
    multiplier = classify(SET_A, PLAIN).multipliers[0]
    assert abs(found.value - math.log(abs(multiplier)) / SET_A.period) <= 3.0 * found.error
    assert found.is_negative


def test_two_halves_of_a_chaotic_run_agree_within_their_errors():
    damper = replace(SET_C, omega=0.41719)
    estimates = [
        lyapunov_exponent(damper, PLAIN, impacts=50_000, settle_impacts=s) for s in (1000, 60_000)
    ]
    difference = estimates[0].value - estimates[1].value
    assert abs(difference) <= 4.0 * math.hypot(*(e.error for e in estimates))


def test_a_motion_that_forgets_its_start_has_the_exponent_minus_infinity():
    # Restitution 0: each impact ends on the stop, sticks, and leaves at a fixed phase of the force.
    ball = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        forces=(vi.Harmonic(1.0, (2.0,)),),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.0),),
        constant_force=(-1.0,),
    )  # fmt: skip
    found = lyapunov_exponent(ball, vi.State((1.0,), (0.0,)), impacts=1024)
    assert found.value == -math.inf
    assert found.run_end is RunEnd.OBSERVER
