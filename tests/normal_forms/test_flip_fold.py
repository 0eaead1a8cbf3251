"""Period doubling, symmetry breaking and folds: planted coefficients, orbits that are born."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from support.planted import Change, found

import vibroimpact.normal_forms as nf
from vibroimpact._core.errors import InvalidParameterError

EPS = 2.0**-52


def test_flip_of_another_package_is_recovered_to_rounding() -> None:
    """x' = (-1 + 0.456 p) x - 1.234 x^3."""
    at = nf.ExplicitMap(lambda x, p: [(-1.0 + 0.456 * p) * x[0] - 1.234 * x[0] ** 3], dimension=1)
    form = found("PD", at.forms([0.0], 0.0))
    assert (form.c, form.multiplier_slope, form.side) == (-1.234, 0.456, 1)
    assert not form.supercritical
    assert form.size(0.01) == pytest.approx(math.sqrt(0.00456 / 1.234), rel=4 * EPS)


def test_doubled_orbit_of_the_logistic_map_has_the_predicted_size() -> None:
    logistic = nf.ExplicitMap(lambda x, p: [p * x[0] * (1.0 - x[0])], dimension=1)
    form = found("PD", logistic.forms([2.0 / 3.0], 3.0))
    assert form.c == pytest.approx(9.0, rel=4 * EPS)
    assert form.multiplier_slope == pytest.approx(-1.0, rel=4 * EPS)  # nu = 2 - p
    assert form.attracting
    errors = []
    for dp in (1e-3, 1e-5):
        p = 3.0 + dp
        root = math.sqrt((p - 3.0) * (p + 1.0))
        exact = np.array([p + 1.0 + root, p + 1.0 - root]) / (2.0 * p)
        errors.append(np.max(np.abs(2.0 / 3.0 + form.points(dp)[:, 0] - exact)))
    assert math.log10(errors[0] / errors[1]) / 2.0 == pytest.approx(1.5, abs=0.05)


def test_doubled_orbit_of_henons_map_is_where_the_normal_form_says() -> None:
    b, x = 0.632993161855452, 0.816496580927726

    def function(z: Any, a: Any) -> Any:
        return z[1], a - b * z[0] - z[1] ** 2

    form = found("PD", nf.ExplicitMap(function, dimension=2).forms([x, x], 2.0))
    twice = nf.ExplicitMap(function, dimension=2, iterate=2)
    for dp in (1e-2, 1e-4):
        guess = form.points(dp) + x
        exact = [twice.fixed_point(y, 2.0 + dp).x for y in guess]
        assert np.linalg.norm(exact[0] - exact[1]) > form.size(dp)
        # for this quadratic map the terms left out vanish; rounding over the distance to -1
        np.testing.assert_allclose(guess, exact, rtol=0.0, atol=10 * EPS / dp)


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_planted_flip_and_fold_are_recovered_behind_a_change_of_coordinates(n: int) -> None:
    change = Change(n, seed=n)
    rest = 0.5 * np.random.default_rng(n).uniform(-1, 1, (n - 1, n - 1))

    def hidden(normal: Any) -> nf.MapForms:
        at = change.map(lambda x, p: np.array([normal(x[0], p), *(rest @ x[1:])]))
        return at.forms(np.zeros(n), 0.0)

    unit = change.real_length(0)  # x1 = 1 is w = +-unit
    flip = found("PD", hidden(lambda x, p: (-1.0 - 0.8 * p) * x + 1.7 * x**3))
    assert flip.c * unit**2 == pytest.approx(1.7, rel=1e-12)
    assert flip.multiplier_slope == pytest.approx(-0.8, rel=1e-12)
    assert flip.size(1e-4) == pytest.approx(unit * math.sqrt(0.8e-4 / 1.7), rel=1e-12)
    fold = found("SN", hidden(lambda x, p: x + 0.3 * p - 1.3 * x**2))
    assert abs(fold.a) * unit == pytest.approx(1.3, rel=1e-12)
    assert fold.side == 1
    assert fold.size(1e-4) == pytest.approx(unit * math.sqrt(0.3e-4 / 1.3), rel=1e-12)
    assert math.isnan(fold.size(-1e-4))


def test_first_point_of_a_fold_is_the_node() -> None:
    for sign in (1.0, -1.0):
        at = nf.ExplicitMap(lambda x, p, s=sign: [x[0] + p + s * x[0] ** 2], dimension=1)
        form = found("SN", at.forms([0.0], 0.0))
        dp = form.side * 1e-4
        node, saddle = (at.fixed_point(y, dp) for y in form.points(dp))
        assert node.stable
        assert saddle.converged
        assert not saddle.stable
        np.testing.assert_allclose(form.points(dp)[0], node.x, rtol=1e-12)


def test_symmetry_breaking_is_the_flip_of_the_half_map() -> None:
    def half(x: Any, p: Any) -> list[Any]:
        return [-(1.0 + p) * x[0] + 0.5 * x[0] ** 3]

    broken = found("BP", nf.ExplicitMap(half, dimension=1).forms([0.0], 0.0))
    assert (broken.kind, broken.c, broken.side) == ("BP", 0.5, 1)
    full = nf.ExplicitMap(half, dimension=1, iterate=2)
    for point in broken.points(1e-6):  # the mirror images are fixed points of the full map
        image = full.fixed_point(point, 1e-6)
        assert image.stable
        np.testing.assert_allclose(image.x, point, rtol=1e-5)
    refused = nf.normal_form("SN", full.forms([0.0], 0.0))
    assert isinstance(refused, nf.Refusal)
    assert refused.status is nf.Status.DEGENERATE


# Branch points with multiplier +1

PREY = nf.ExplicitMap(
    lambda u, p: (p * u[0] * (1.0 - u[0]) - 2.0 * u[0] * u[1], 2.0 * u[0] * u[1]), dimension=2
)  # published demo: branch points at p = 1 and 2


@pytest.mark.parametrize(
    ("p", "u", "curves"),
    [(1.0, 0.0, [[1.0, 0.0], [0.0, 0.0]]), (2.0, 0.5, [[0.25, 0.0], [0.0, 0.25]])],
)
def test_transcritical_point_has_the_tangents_of_both_branches(
    p: float, u: float, curves: list[list[float]]
) -> None:
    form = found("BP", PREY.forms([u, 0.0], p))
    assert not form.pitchfork
    tangents = np.array(sorted(form.tangents.tolist(), reverse=True))
    np.testing.assert_allclose(tangents, curves, rtol=0.0, atol=10 * EPS)
    # stability is exchanged: the multipliers move apart at equal rates
    assert sum(form.multiplier_slopes) == pytest.approx(0.0, abs=10 * EPS)
    for tangent, slope in zip(form.tangents, form.multiplier_slopes, strict=True):
        h = 1e-6
        near = PREY.fixed_point(np.array([u, 0.0]) + h * tangent, p + h)
        moved = min(near.multipliers, key=lambda nu: abs(nu - 1.0))
        assert moved.real == pytest.approx(1.0 + slope * h, abs=100 * h**2)
    with pytest.raises(InvalidParameterError, match="only a pitchfork"):
        form.size(0.1)


@pytest.mark.parametrize("n", [2, 4])
def test_pitchfork_of_the_full_map_is_the_flip_of_the_half_map(n: int) -> None:
    change = Change(n, seed=n)
    half = change.map(
        lambda x, p: np.array([(-1.0 - 0.8 * p) * x[0] + 1.7 * x[0] ** 3, *(0.3 * x[1:])])
    )
    at = half.forms(np.zeros(n), 0.0)
    flip, fork = found("BP", at), found("BP", nf.Composition(at, at))
    assert fork.pitchfork
    assert fork.size(1e-4) == pytest.approx(flip.size(1e-4), rel=1e-11)
    assert (fork.side, fork.supercritical) == (flip.side, flip.supercritical)
    assert fork.multiplier_slopes[0] == pytest.approx(-2.0 * flip.multiplier_slope, rel=1e-11)
    np.testing.assert_allclose(fork.tangents[0], change.shift, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(fork.points(1e-4)[0], fork.size(1e-4) * fork.q)
    assert fork.supercritical


def test_slopes_of_a_transcritical_point_are_those_of_its_factors() -> None:
    for first, second in ((3.0, -2.0), (-3.0, 2.0), (3.0, 2.0)):
        at = nf.ExplicitMap(
            lambda x, p, a=first, b=second: [x[0] + (x[0] - a * p) * (x[0] - b * p)], dimension=1
        )
        form = found("BP", at.forms([0.0], 0.0))
        assert sorted(form.slopes) == pytest.approx(sorted((first, second)), rel=10 * EPS)


def test_pitchfork_between_curves_that_both_move_has_the_tangent_of_the_first() -> None:
    at = nf.ExplicitMap(
        lambda x, p: [x[0] + (x[0] - 3.0 * p) * (2.0 * p - 5.0 * x[0] ** 2)], dimension=1
    )
    fork = found("BP", at.forms([0.0], 0.0))
    assert fork.tangents[0, 0] == pytest.approx(3.0, rel=10 * EPS)
    assert (fork.b, fork.e, fork.side) == (2.0, -5.0, 1)
    for point in fork.points(1e-6):
        assert at.fixed_point(point, 1e-6).x[0] == pytest.approx(point[0], rel=1e-9)
