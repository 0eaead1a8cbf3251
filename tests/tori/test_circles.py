"""Invariant circles against planted ones, independent simulation and identities."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.attractors.rotation import weights
from vibroimpact.orbits.stability import Stability
from vibroimpact.tori.continue_circle import STEPS
from vibroimpact.tori.fourier import at_phases, derivative, shifted, tail
from vibroimpact.tori.maps import SignatureMap
from vibroimpact.tori.normal import Bundle, normal_stability

REST = vi.State((0.0, 0.0), (0.0, 1.0))
RHO = (math.sqrt(5.0) - 1.0) / 2.0 - 0.3  # as irrational as the golden mean
BEND, PULL, SHEAR = 0.15, 0.2, 0.3


def planted(x: Any, p: Any) -> list[Any]:
    """A rotation of the unit circle that attracts with 1 - 2 PULL, and a direction z -> -p z.

    All seen through the smooth change of coordinates (x, y, z) = (X + BEND sin 2Y, Y, Z + X / 10);
    the last direction is modulated along the circle by 1 + SHEAR X.
    """
    X, Y = x[0] - BEND * np.sin(2.0 * x[1]), x[1]
    Z = x[2] - 0.1 * X
    grow = 1.0 + PULL * (1.0 - X**2 - Y**2)
    c, s = math.cos(2.0 * math.pi * RHO), math.sin(2.0 * math.pi * RHO)
    U, V = grow * (c * X - s * Y), grow * (s * X + c * Y)
    W = -p * Z * (1.0 + SHEAR * X)
    return [U + BEND * np.sin(2.0 * V), V, W + 0.1 * U]


PLANTED = vi.ExplicitMap(planted, dimension=3)
MEAN_LOG = math.log((1.0 + math.sqrt(1.0 - SHEAR**2)) / 2.0)  # of 1 + SHEAR cos, over a turn


def winding(points: np.ndarray) -> float:
    """Turns per iterate around the centre, by a weighted Birkhoff average; in [0, 1/2]."""
    z = (points[:, 0] - points[:, 0].mean()) + 1j * (points[:, 1] - points[:, 1].mean())
    steps = np.angle(z[1:] / z[:-1]) / (2.0 * math.pi) % 1.0
    rho = float(weights(len(steps)) @ steps) % 1.0
    return min(rho, 1.0 - rho)


def folded(rho: float) -> float:
    return min(rho % 1.0, 1.0 - rho % 1.0)


# ---- planted circles -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def known() -> vi.Circle:
    return vi.find_circle(PLANTED, (1.0, 0.0, 0.1), p=0.5)


def test_a_planted_circle_is_found_to_rounding(known: vi.Circle) -> None:
    assert known.converged, known.status
    # Rounding of some ten operations on numbers of size one.
    assert known.residual < 1e-12
    assert abs(known.rotation_number - RHO) < 1e-12
    X = known.points[:, 0] - BEND * np.sin(2.0 * known.points[:, 1])
    assert np.abs(X**2 + known.points[:, 1] ** 2 - 1.0).max() < 1e-12


def test_normal_multipliers_of_a_planted_circle_are_the_planted_ones(known: vi.Circle) -> None:
    along, across = math.log(1.0 - 2.0 * PULL), math.log(0.5) + MEAN_LOG
    assert np.allclose(known.normal_exponents, sorted([along, across])[::-1], atol=1e-11)
    assert set(known.bundles) == {Bundle.POSITIVE, Bundle.NEGATIVE}
    signs = {Bundle.POSITIVE: along, Bundle.NEGATIVE: across}
    for kind, value in zip(known.bundles, known.normal_exponents, strict=True):
        assert abs(value - signs[kind]) < 1e-11


def test_the_circle_between_the_nodes_is_invariant(known: vi.Circle) -> None:
    phi = np.random.default_rng(1).random(20)
    images = np.array([PLANTED(x, 0.5) for x in known.at(phi)])
    assert np.abs(images - known.at(phi + known.rotation_number)).max() < 1e-12


def test_a_guess_at_equal_phases_is_enough_for_a_repelling_circle() -> None:
    phi = np.arange(41) / 41
    ring = np.column_stack([np.cos(2 * np.pi * phi), np.sin(2 * np.pi * phi), 0.0 * phi])
    circle = vi.find_circle(PLANTED, vi.CircleGuess(ring, RHO + 0.003), p=1.7)
    assert circle.converged, circle.status
    assert abs(circle.rotation_number - RHO) < 1e-12
    assert circle.stability is Stability.UNSTABLE
    assert abs(circle.normal_exponents[0] - math.log(1.7) - MEAN_LOG) < 1e-11


def test_the_rotation_number_is_at_most_one_half() -> None:
    phi = np.arange(41) / 41
    ring = np.column_stack([np.cos(2 * np.pi * phi), -np.sin(2 * np.pi * phi), 0.0 * phi])
    circle = vi.find_circle(PLANTED, vi.CircleGuess(ring, 1.0 - RHO), p=0.5)
    assert abs(circle.rotation_number - RHO) < 1e-12


def test_a_planted_doubling_is_located() -> None:
    """The multiplier -p exp(mean of ln(1 + SHEAR X)) passes -1."""
    start = vi.find_circle(PLANTED, (1.0, 0.0, 0.1), p=0.9)
    family = vi.continue_circle(start, "p", (0.8, 1.2))
    assert [point.label for point in family.special_points] == ["PD1"], family
    # Located to 1e-9 of the range.
    assert abs(family["PD1"].parameter - math.exp(-MEAN_LOG)) < 1e-9
    assert [end.reason.name for end in family.ends] == ["RANGE", "RANGE"]
    assert np.abs(family.rotation_numbers - RHO).max() < 1e-11


@pytest.mark.slow
def test_a_doubled_circle_of_the_second_iterate_is_the_planted_one() -> None:
    """Beside z -> -p z + z^3 the circles z^2 = p - 1 are exchanged, with multipliers 3 - 2 p."""

    def spin(x: Any, p: Any) -> list[Any]:
        return [*planted(x, p)[:2], -p * x[2] + x[2] ** 3]

    start = vi.find_circle(vi.ExplicitMap(spin, dimension=3), (1.0, 0.0, 0.0), p=0.9)
    family = vi.continue_circle(start, "p", (0.8, 1.2))
    assert abs(family["PD1"].parameter - 1.0) < 1e-9
    doubled = vi.switch_circle(family["PD1"])
    assert doubled.converged, doubled.status
    assert np.abs(doubled.points[:, 2] ** 2 - (doubled.value - 1.0)).max() < 1e-12
    assert abs(doubled.rotation_number - folded(2.0 * RHO)) < 1e-11
    further = vi.continue_circle(doubled, "p", (doubled.value, 1.1), both=True)
    last = further.circles[-1]
    assert np.abs(last.points[:, 2] ** 2 - 0.1).max() < 1e-12
    expected = [2.0 * math.log(3.0 - 2.0 * 1.1), 2.0 * math.log(1.0 - 2.0 * PULL)]
    assert np.allclose(last.normal_exponents, expected, atol=1e-11)


def moebius(x: Any, p: Any) -> list[Any]:
    """A unit circle in whose normal planes a direction n turns by half a turn per turn.

    Along n the distance w is mapped to (p - w^2) w, across it by 0.3.
    """
    alpha = 2.0 * math.pi * RHO
    r = np.sqrt(x[0] ** 2 + x[1] ** 2)
    c, s = x[0] / r, x[1] / r
    a, b, ch, sh = r - 1.0, x[2], math.cos(alpha / 2.0), math.sin(alpha / 2.0)
    C, S = c * ch - s * sh, s * ch + c * sh  # of phi + alpha / 2
    squared = (a**2 * (1.0 + c) + 2.0 * a * b * s + b**2 * (1.0 - c)) / 2.0
    along = ((ch + C) * a + (S - sh) * b, (S + sh) * a + (ch - C) * b)
    across = ((ch - C) * a - (S + sh) * b, -(S - sh) * a + (ch + C) * b)
    A, B = (((p - squared) * u + 0.3 * v) / 2.0 for u, v in zip(along, across, strict=True))
    ca, sa = math.cos(alpha), math.sin(alpha)
    return [(1.0 + A) * (ca * c - sa * s), (1.0 + A) * (sa * c + ca * s), B]


def test_a_moebius_band_doubles_into_one_circle_of_twice_the_length() -> None:
    """w^2 = p - 1 along the direction that comes back reversed."""
    start = vi.find_circle(vi.ExplicitMap(moebius, dimension=3), (1.0, 0.0, 0.0), p=0.8)
    assert start.bundles == (Bundle.ONE_SIDED, Bundle.ONE_SIDED)
    family = vi.continue_circle(start, "p", (0.7, 1.2))
    assert [point.label for point in family.special_points] == ["PD1"], family
    assert abs(family["PD1"].parameter - 1.0) < 1e-9
    doubled = vi.switch_circle(family["PD1"])
    assert doubled.converged, doubled.status
    x, y, z = doubled.points.T
    w_squared = (np.hypot(x, y) - 1.0) ** 2 + z**2
    assert np.abs(w_squared - (doubled.value - 1.0)).max() < 1e-12
    half = [folded(RHO / 2.0), folded((RHO + 1.0) / 2.0)]
    assert min(abs(doubled.rotation_number - rho) for rho in half) < 1e-11


def test_two_circles_meet_in_a_fold_around_which_the_family_goes() -> None:
    """Radii with r^2 = 1 +- sqrt(p)."""

    def folding(x: Any, p: Any) -> list[Any]:
        X, Y = x[0] - BEND * np.sin(2.0 * x[1]), x[1]
        grow = 1.0 + PULL * (p - (X**2 + Y**2 - 1.0) ** 2)
        c, s = math.cos(2.0 * math.pi * RHO), math.sin(2.0 * math.pi * RHO)
        U, V = grow * (c * X - s * Y), grow * (s * X + c * Y)
        return [U + BEND * np.sin(2.0 * V), V]

    start = vi.find_circle(vi.ExplicitMap(folding, dimension=2), (1.1, 0.0), p=0.05)
    family = vi.continue_circle(start, "p", (-0.1, 0.1))
    assert [point.label for point in family.special_points] == ["SN1"], family
    assert abs(family["SN1"].parameter) < 1e-9
    assert [end.reason.name for end in family.ends] == ["RANGE", "RANGE"]
    for circle, side in ((family.circles[-1], 1.0), (family.circles[0], -1.0)):
        r = 1.0 + side * math.sqrt(0.1)
        assert circle.value == 0.1
        x, y = circle.points.T
        assert np.allclose((x - BEND * np.sin(2.0 * y)) ** 2 + y**2, r, atol=1e-11)
        assert circle.normal_exponents[0] == pytest.approx(
            math.log(abs(1.0 - side * 4.0 * PULL * math.sqrt(0.1) * r)), abs=1e-10
        )


@pytest.mark.slow
def test_a_pair_that_leaves_the_unit_circle_is_a_second_neimark_sacker_point() -> None:
    def twofold(x: Any, p: Any) -> list[Any]:
        c, s = p * math.cos(1.0), p * math.sin(1.0)
        u = x[2] + x[3]  # sheared, so that growth in this plane oscillates
        u, v = c * u - s * x[3], s * u + c * x[3]
        return [*planted([x[0], x[1], 0.0], 0.5)[:2], u - v, v]

    start = vi.find_circle(vi.ExplicitMap(twofold, dimension=4), (1.0, 0.0, 0.1, 0.0), p=0.8)
    family = vi.continue_circle(start, "p", (0.7, 1.1))
    assert [point.label for point in family.special_points] == ["NS1"], family
    assert abs(family["NS1"].parameter - 1.0) < 1e-9


@pytest.mark.parametrize("twist", [0.5, 3.0])
def test_the_least_angle_is_that_of_the_isochrons(twist: float) -> None:
    """phi -> phi + alpha + twist (r - 1), r - 1 -> 0.6 (r - 1): tan of it (1 - 0.6) / twist."""

    def twisted(x: Any, p: Any) -> list[Any]:
        r = np.sqrt(x[0] ** 2 + x[1] ** 2)
        a = 2.0 * math.pi * RHO + p * (r - 1.0)
        c, s, grow = np.cos(a), np.sin(a), (0.4 + 0.6 * r) / r
        return [grow * (c * x[0] - s * x[1]), grow * (s * x[0] + c * x[1])]

    circle = vi.find_circle(vi.ExplicitMap(twisted, dimension=2), (1.0, 0.0), p=twist)
    assert circle.least_angle == pytest.approx(math.atan(0.4 / twist), abs=1e-10)
    assert circle.roughness == pytest.approx(1.0, abs=1e-10)


def cocycle(count: int, turns: float, mode: str) -> tuple[np.ndarray, np.ndarray]:
    """A circle and derivatives along it with known normal directions, by their half or whole turns.

    "moebius": the directions turn by half a turn along the circle, multipliers 0.5 and 0.2;
    "pair": they are turned by an angle in every iterate, modulus 0.6.
    """
    phi = 2.0 * math.pi * np.arange(count) / count
    psi = phi + 2.0 * math.pi * turns

    def frame(a: np.ndarray, share: float) -> np.ndarray:
        t = np.stack([-np.sin(a), np.cos(a), 0 * a], axis=1)
        r = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
        z = np.stack([0 * a, 0 * a, 1 + 0 * a], axis=1)
        n = np.cos(share * a)[:, None] * r + np.sin(share * a)[:, None] * z
        m = -np.sin(share * a)[:, None] * r + np.cos(share * a)[:, None] * z
        return np.stack([t, n, m], axis=2)

    middle = np.diag([1.0, 0.5, 0.2])
    if mode == "pair":
        c, s = 0.6 * math.cos(1.0), 0.6 * math.sin(1.0)
        middle = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    share = 0.5 if mode == "moebius" else 1.0
    circle = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)
    return circle, frame(psi, share) @ middle @ frame(phi, share).transpose(0, 2, 1)


def test_a_direction_that_comes_back_reversed_has_no_sign() -> None:
    found = normal_stability(*cocycle(41, RHO, "moebius"), RHO)
    assert np.allclose(found.exponents, np.log([0.5, 0.2]), atol=1e-11)
    assert found.bundles == (Bundle.ONE_SIDED, Bundle.ONE_SIDED)


def test_two_directions_that_turn_are_a_pair() -> None:
    points, by_point = cocycle(41, RHO, "pair")
    # Sheared, so that the growth of single vectors oscillates as they turn.
    shear = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.5, 1.0]])
    points, by_point = points @ shear.T, shear @ by_point @ np.linalg.inv(shear)
    found = normal_stability(points, by_point, RHO)
    assert np.allclose(found.exponents, math.log(0.6), atol=1e-9)
    assert found.bundles == (Bundle.PAIR, Bundle.PAIR)


# ---- the delayed logistic map --------------------------------------------------------------------


LOGISTIC = vi.ExplicitMap(lambda x, p: [p * x[0] * (1.0 - x[1]), x[0]], dimension=2)


def test_the_rotation_number_is_that_of_a_long_motion() -> None:
    circle = vi.find_circle(LOGISTIC, (0.5, 0.4), p=2.05)
    x, orbit = circle.points[0], []
    for _ in range(20000):
        x = LOGISTIC(x, 2.05)
        orbit.append(x)
    assert circle.residual < 1e-10
    # The average's own error, from 20 000 iterates.
    assert abs(circle.rotation_number - winding(np.array(orbit))) < 1e-9


def test_the_radius_near_a_neimark_sacker_point_follows_the_normal_form() -> None:
    """Squared, its relative error is of order dp: halved with it."""
    form = vi.normal_form("NS", _with_parameter(2.0))
    errors = []
    for dp in (2e-3, 1e-3):
        circle = vi.find_circle(LOGISTIC, (0.51, 0.5), p=2.0 + dp)
        first = 2.0 * np.abs(circle.coefficients[1])
        errors.append(float((first / form.amplitude(dp))[0] - 1.0))
    assert abs(errors[1]) < 2e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.1)


def _with_parameter(p: float) -> Any:
    return LOGISTIC.forms(LOGISTIC.fixed_point((0.5, 0.5), p).x, p)


def test_a_family_shrinks_to_the_neimark_sacker_point() -> None:
    circle = vi.find_circle(LOGISTIC, (0.5, 0.4), p=2.02)
    family = vi.continue_circle(circle, "p", (1.99, 2.03), both=True)
    end = family.ends[0]
    assert end.reason.name == "BORN"
    assert end.parameter == pytest.approx(2.0, abs=1e-5)  # radius^2 is linear to first order
    assert family.rotation_numbers[0] == pytest.approx(1.0 / 6.0, abs=2e-3)


# ---- the impact damper of the paper --------------------------------------------------------------


def full_map_points(circle: vi.Circle, points: int) -> np.ndarray:
    """Iterates of the full map by simulation from a point of the circle."""
    section = vi.section(circle.system, circle.state(), points=points, settle_events=0)
    return np.column_stack([section.x1, section.v1])


@pytest.mark.parametrize(
    ("name", "omega", "rho"),
    [
        ("A", 1.00734, 0.258872793916),
        ("A", 1.00314, 0.257905847275),
        ("A", 0.99, 0.253877229698),
        ("C", 0.4268, 0.287925934321),
    ],
)
def test_circles_of_the_paper_have_the_rotation_number_of_a_simulation(
    name: str, omega: float, rho: float
) -> None:
    circle = vi.find_circle(paper_damper(name, omega), REST)
    assert circle.converged, circle.status
    assert circle.residual < 1e-10
    assert circle.stable
    assert circle.symmetric
    counted = winding(full_map_points(circle, 40000))
    assert abs(folded(circle.full_rotation_number) - counted) < 1e-9
    assert abs(circle.rotation_number - rho) < 1e-11


def test_a_circle_is_found_from_the_normal_form_on_either_side() -> None:
    """Set B: a stable circle below the upper Neimark-Sacker point, an unstable one at the lower."""
    orbit = vi.symmetric_orbits(paper_damper("B", 0.97))[0]
    branch = vi.continue_orbit(orbit, "omega", (0.94, 1.05))
    upper = vi.find_circle(paper_damper("B", 1.014), branch["NS2"])
    assert upper.stable
    assert upper.residual < 1e-10
    counted = winding(full_map_points(upper, 40000))
    assert abs(folded(upper.full_rotation_number) - counted) < 1e-9
    lower = vi.find_circle(paper_damper("B", 0.951), branch["NS1"])
    assert lower.residual < 1e-10
    assert lower.stability is Stability.UNSTABLE
    assert lower.admissible
    none = vi.find_circle(paper_damper("B", 1.02), branch["NS2"])
    assert not none.converged
    assert "circles below" in none.status


def test_the_exponents_add_up_to_the_logarithm_of_the_determinant() -> None:
    """det DH = R^2 exp(-T tr C) for the time T of a half period, on average over the circle."""
    damper = paper_damper("A", 1.00314)
    circle = vi.find_circle(damper, REST)
    decay = 2.0 * damper.zeta * damper.omega_n * math.pi / damper.omega
    expected = 2.0 * math.log(damper.restitution) - decay
    assert circle.normal_exponents.sum() == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "omega"), [("A", 1.00734), ("A", 1.00314), ("A", 0.9958), ("C", 0.4268)]
)
def test_half_map_and_full_map_have_the_same_circle(name: str, omega: float) -> None:
    """With pairs of exponents, and with single ones that take hundreds of steps to settle."""
    damper = paper_damper(name, omega)
    half = vi.find_circle(damper, REST)
    full = vi.find_circle(damper, REST, symmetric=False)
    assert full.rotation_number == pytest.approx(folded(half.full_rotation_number), abs=1e-11)
    assert np.allclose(full.normal_exponents, 2.0 * half.normal_exponents, atol=1e-9)
    again = vi.find_circle(damper, half, symmetric=False)
    assert again.rotation_number == pytest.approx(full.rotation_number, abs=1e-11)


def test_a_given_signature_decides_the_map() -> None:
    damper = paper_damper("A", 1.00734)
    once = vi.find_circle(damper, REST, stops="AB", cycles=1)
    twice = vi.find_circle(damper, REST, stops="ABAB", cycles=2)
    other = vi.find_circle(damper, REST, stops="BA", cycles=1)
    listed = vi.find_circle(damper, REST, stops=np.array([(0, -1), (0, 1)]), cycles=1)
    assert once.rotation_number == pytest.approx(1.0 - 2.0 * 0.258872793916, abs=1e-11)
    assert twice.rotation_number == pytest.approx(folded(2.0 * once.rotation_number), abs=1e-11)
    assert other.rotation_number == pytest.approx(once.rotation_number, abs=1e-11)
    assert listed.rotation_number == other.rotation_number
    # The section of the lower stop sees the mirror image half a period later.
    assert other.radius == pytest.approx(once.radius, abs=1e-9)
    none = vi.find_circle(damper, REST, stops="AAB", cycles=1)
    assert "do not follow" in none.status


@pytest.mark.slow
def test_a_family_that_approaches_a_resonance_ends_by_breaking() -> None:
    """Set B: down from the upper Neimark-Sacker point, towards 1/5 of the half map."""
    orbit = vi.symmetric_orbits(paper_damper("B", 0.97))[0]
    branch = vi.continue_orbit(orbit, "omega", (0.97, 1.05))
    start = vi.find_circle(paper_damper("B", 1.014), branch["NS1"])
    family = vi.continue_circle(start, "omega", (0.97, 1.05), most_nodes=121,
                                steps=replace(STEPS, least=1e-3))  # fmt: skip
    before, after = family.ends
    assert before.reason.name == "BREAKING"
    assert "next to 1/5" in before.detail
    assert after.reason.name == "BORN"
    assert after.parameter == pytest.approx(branch["NS1"].parameter, abs=1e-6)
    assert (np.diff(family.rotation_numbers) > 0.0).all()
    assert family.circles[0].least_angle < family.circles[-1].least_angle


@pytest.mark.parametrize("parameter", ["omega", "half_clearance", "restitution"])
@pytest.mark.parametrize("symmetric", [True, False])
def test_derivatives_of_the_impact_map_are_those_of_its_differences(
    parameter: str, symmetric: bool
) -> None:
    damper = paper_damper("A", 1.00314)
    impacts = vi.find_circle(damper, REST).signature
    circle = vi.find_circle(damper, REST, symmetric=None if symmetric else False)
    sizes = circle.map.sizes
    circle_map = SignatureMap(
        damper, replace(impacts, symmetric=circle.symmetric), parameter, sizes
    )
    p, points = getattr(damper, parameter), circle.points[:7]
    times = circle.times[:7]
    here = circle_map.images(points, p, times)
    h = 1e-6

    def difference(d_points: np.ndarray, dp: float) -> np.ndarray:
        ends = [circle_map.images(points + s * d_points, p + s * dp, times) for s in (h, -h)]
        return (ends[0].points - ends[1].points) / (2.0 * h)

    # Third derivatives times h^2, and rounding over h.
    assert np.allclose(here.by_parameter, difference(np.zeros(4), 1.0), rtol=1e-6, atol=1e-7)
    for j, e in enumerate(np.eye(4)):
        assert np.allclose(here.by_point[:, :, j], difference(e, 0.0), rtol=1e-6, atol=1e-7)


def test_a_family_in_the_clearance_has_the_circles_that_motions_settle_on() -> None:
    """The section moves with this parameter."""
    circle = vi.find_circle(paper_damper("A", 1.00314), REST)
    family = vi.continue_circle(
        circle, "half_clearance", (4.98, 5.02), steps=replace(STEPS, points=4)
    )
    direct = vi.find_circle(paper_damper("A", 1.00314, half_clearance=family.values[-1]), REST)
    assert [c.system.half_clearance for c in family.circles] == family.values.tolist()
    assert abs(family.rotation_numbers[-1] - direct.rotation_number) < 1e-11


@pytest.mark.slow
def test_the_damper_of_set_a_has_a_fold_of_circles_next_to_its_lower_birth() -> None:
    """Near the resonance 1/4 of the half map, beyond the reach of the normal form."""
    orbit = vi.symmetric_orbits(paper_damper("A", 1.0))[0]
    point = vi.continue_orbit(orbit, "omega", (0.92, 1.0))["NS1"]
    assert point.parameter == pytest.approx(0.931845377, abs=1e-9)
    start = vi.find_circle(paper_damper("A", point.parameter + 1e-4), point)
    family = vi.continue_circle(
        start, "omega", (0.93, 0.94), both=False, most_nodes=121,
        steps=replace(STEPS, first=0.005, least=5e-4, points=8),
    )  # fmt: skip
    fold = family["SN1"]
    assert fold.parameter == pytest.approx(0.932061757, abs=1e-9)
    assert abs(fold.orbit.normal_exponents[0]) < 1e-6
    assert family.values.max() <= fold.parameter
    stable, unstable = family.stable, family.normal_exponents[:, 0] > 0.0
    assert stable[0]
    assert unstable[-1]
    other = family.circles[-1]
    near = family.circles[int(np.flatnonzero(stable)[-1])]
    again = vi.find_circle(other.system, near)
    assert again.converged, again.status
    assert again.stable
    assert abs(again.rotation_number - other.rotation_number) > 1e-5
    # Motions stay on the circle below the fold, and lock to the orbit 2-2-2 above it.
    for side, symbol in ((-1.0, None), (1.0, "2-2-2")):
        damper = paper_damper("A", fold.parameter + side * 5e-6)
        section = vi.section(damper, fold.orbit.state(), points=150_000, settle_events=0)
        width = float(np.std(section.x1[-4000:]) / np.std(fold.orbit.points[:, 0]))
        assert (width < 1.1) == (symbol is None), (side, width)
        assert symbol in (None, vi.classify(damper, section.last).symbol)


# ---- admissibility -------------------------------------------------------------------------------


def limited(upper: float) -> vi.Mechanism:
    """The damper of set A with a further stop above the primary mass."""
    m = paper_damper("A", 1.00314).mechanism
    stop = vi.RigidStop(row=(1.0, 0.0), upper=upper, restitution=0.8)
    return replace(m, elements=(*m.elements, stop))


def highest(circle: vi.Circle) -> float:
    """Largest x1 along the circle, from samples of a long simulation of the damper alone."""
    run = vi.simulate(paper_damper("A", 1.00314), circle.state(), impacts=3000)
    times = np.linspace(0.0, run.time[-1], 300_000)
    return float(run.at(times)[0][:, 0].max())


def test_a_circle_that_crosses_a_stop_is_inadmissible() -> None:
    free = vi.find_circle(limited(50.0), REST, symmetric=False)
    assert free.admissible
    top = 50.0 - free.clearance_to_grazing
    # 3000 impacts pass each part of the circle, and 200 samples each maximum, to this.
    assert top == pytest.approx(highest(free), abs=2e-4)
    crossed = vi.find_circle(limited(top - 0.01), free)
    assert crossed.converged
    assert not crossed.admissible
    assert "upper stop of contact 1" in crossed.inadmissible_reason
    assert crossed.clearance_to_grazing == pytest.approx(-0.01, abs=1e-9)


def test_the_clearance_does_not_depend_on_where_the_nodes_are() -> None:
    circle = vi.find_circle(limited(50.0), REST, symmetric=False)
    half = 0.5 / 129.0
    moved = replace(circle, points=shifted(circle.points, half), times=shifted(circle.times, half))
    # The least gap is quadratic in the phase, which is known to 1e-7.
    assert moved.clearance_to_grazing == pytest.approx(circle.clearance_to_grazing, abs=1e-11)


@pytest.mark.slow
def test_grazing_along_a_family_is_located_where_the_stop_meets_the_circle() -> None:
    free = vi.find_circle(limited(6.0), REST, symmetric=False)
    top = 6.0 - free.clearance_to_grazing
    family = vi.continue_circle(
        free, "elements[1].upper", (top - 0.3, 6.5), steps=replace(STEPS, largest=0.5)
    )
    assert [point.label for point in family.special_points] == ["GR1"], family
    assert family["GR1"].parameter == pytest.approx(top, abs=1e-8)
    assert family.stable[-1]
    assert not family.stable[0]


# ---- datasets and pictures -----------------------------------------------------------------------


def test_datasets_hold_the_numbers_and_pictures_the_curve() -> None:
    circle = vi.find_circle(paper_damper("A", 1.00734), REST)
    data = circle.to_dataset()
    assert data.attrs["rotation_number"] == circle.rotation_number
    assert data["points"].shape == (circle.nodes, 4)
    line = circle.plot().lines[0]
    assert np.allclose(line.get_ydata()[[0, -1]], circle.states([0.0])[0, 2])
    family = vi.continue_circle(circle, "omega", (1.0073, 1.0074), steps=replace(STEPS, points=3))
    assert np.array_equal(family.to_dataset()["values"], family.values)
    assert len(family.plot().lines) == len(family) - 1


# ---- outcomes and misuse -------------------------------------------------------------------------


def test_a_locked_motion_is_a_status() -> None:
    circle = vi.find_circle(paper_damper("A", 0.9817), REST)
    assert not circle.converged
    assert "periodic after 4 iterates" in circle.status
    assert not circle.admissible
    assert not circle.stable


def test_too_few_nodes_are_a_status() -> None:
    circle = vi.find_circle(paper_damper("A", 0.99), REST, most_nodes=31)
    assert "31 nodes are too few" in circle.status


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"points": 10}, "points"),
        ({"p": 1.0}, "p = 1.0"),
        ({"stops": "AB"}, "cycles"),
        ({"cycles": 1}, "stops"),
    ],
)
def test_misuse_is_refused_with_the_argument(arguments: dict[str, Any], word: str) -> None:
    with pytest.raises(vi.InvalidParameterError, match=word):
        vi.find_circle(paper_damper("A", 1.0), REST, **arguments)


def test_continuation_refuses_what_it_cannot_follow(known: vi.Circle) -> None:
    with pytest.raises(vi.InvalidParameterError, match="parameter"):
        vi.continue_circle(known, "q", (0.0, 1.0))
    with pytest.raises(vi.InvalidParameterError, match="bounds"):
        vi.continue_circle(known, "p", (0.6, 1.0))
    lost = vi.find_circle(paper_damper("A", 0.9817), REST)
    with pytest.raises(vi.InvalidParameterError, match="circle"):
        vi.continue_circle(lost, "omega", (0.9, 1.0))


def test_an_interruption_keeps_the_circles_so_far(known: vi.Circle) -> None:
    def stop(report: vi.ProgressReport) -> None:
        if report.done == 3:
            raise KeyboardInterrupt

    family = vi.continue_circle(known, "p", (0.4, 0.8), progress=stop)
    assert family.ends[1].reason.name == "INTERRUPTED"
    assert len(family) == 3


# ---- trigonometric polynomials -------------------------------------------------------------------


def test_shift_derivative_and_interpolation_are_exact() -> None:
    phi = np.arange(11) / 11

    def curve(a: np.ndarray) -> np.ndarray:
        return np.cos(2 * np.pi * a) + 0.2 * np.sin(6 * np.pi * a)

    values = curve(phi)
    assert np.allclose(shifted(values, 0.123), curve(phi + 0.123), atol=1e-15)
    slope = -2 * np.pi * np.sin(2 * np.pi * phi) + 1.2 * np.pi * np.cos(6 * np.pi * phi)
    assert np.allclose(derivative(values), slope, atol=1e-14)
    assert np.allclose(at_phases(values, np.array([0.3, 0.77])), curve(np.array([0.3, 0.77])))
    assert tail(values) < 1e-15
