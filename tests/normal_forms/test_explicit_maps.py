"""Explicit maps: derivatives in 50 digits, fixed points, compositions, errors, published points."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp

import vibroimpact.normal_forms as nf
from vibroimpact._core.errors import InvalidParameterError

EPS = 2.0**-52
LOGISTIC = nf.ExplicitMap(lambda x, p: [p * x[0] * (1.0 - x[0])], dimension=1)
DELAYED = nf.ExplicitMap(lambda x, r: (r * x[0] * (1.0 - x[1]), x[0]), dimension=2)


def henon(b: float) -> nf.ExplicitMap:
    """x' = y, y' = a - b x - y^2, in the parameter a."""
    return nf.ExplicitMap(lambda x, a: (x[1], a - b * x[0] - x[1] ** 2), dimension=2)


def rich(m: Any) -> Any:
    """A map with every function and operation a jet knows, over a module of functions."""

    def function(x: Any, p: Any) -> list[Any]:
        u, v, w = x
        return [
            m.sin(u * v) + p / (2 + w) - 0.3,
            m.exp(-u) * m.cos(v) ** 3 + m.sqrt(1 + w**2) * p,
            (1 - u) / m.log(3 + v) + abs(-2 - v) * w**-2 + 2 ** (-1) * p**2,
        ]

    return function


RICH = nf.ExplicitMap(rich(np), dimension=3)
POINT, PARAMETER = [0.3, -0.4, 0.7], 1.1


def differences(directions: list[np.ndarray]) -> list[float]:
    """D^k of the rich map by central differences: error h^2 = 1e-20 and 1e-50 / h^3 = 1e-20."""
    with mp.workdps(50):
        h = mp.mpf(10) ** -10
        at = [mp.mpf(x) for x in [*POINT, PARAMETER]]
        total = [mp.mpf(0)] * 3
        for signs in itertools.product((1, -1), repeat=len(directions)):
            moved = list(at)
            for sign, u in zip(signs, directions, strict=True):
                moved = [x + sign * h * mp.mpf(float(du)) for x, du in zip(moved, u, strict=True)]
            image = rich(mp)(moved[:3], moved[3])
            total = [t + math.prod(signs) * y for t, y in zip(total, image, strict=True)]
        return [float(t / (2 * h) ** len(directions)) for t in total]


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_equal_differences_in_50_digits(order: int) -> None:
    rng = np.random.default_rng(order)
    for _ in range(5):
        us = list(rng.uniform(-1.0, 1.0, (order, 4)))
        exact = differences(us)
        found = RICH.derivative(POINT, PARAMETER, *us)
        # some 50 operations on numbers up to 100
        np.testing.assert_allclose(found, exact, rtol=0.0, atol=50 * EPS * 100.0)


def test_all_columns_at_once_equal_single_derivatives() -> None:
    A, F_p = RICH.linearised(POINT, PARAMETER)
    single = [RICH.derivative(POINT, PARAMETER, u) for u in np.eye(4)]
    np.testing.assert_array_equal(np.column_stack([A, F_p]), np.column_stack(single))


def test_forms_are_symmetric_in_their_arguments() -> None:
    forms, us = RICH.forms(POINT, PARAMETER), np.random.default_rng(1).uniform(-1, 1, (3, 4))
    first = forms.derivative(*us)
    for order in itertools.permutations(us):
        np.testing.assert_allclose(forms.derivative(*order), first, rtol=0.0, atol=50 * EPS * 100)


def test_linear_map_has_no_second_and_third_form() -> None:
    A = np.array([[0.2, -1.0], [0.7, 0.4]])
    linear = nf.ExplicitMap(lambda x, p: A @ x + p, dimension=2)
    u = np.array([0.3, -0.9])
    np.testing.assert_array_equal(linear([1.0, 2.0], 0.5), A @ [1.0, 2.0] + 0.5)
    np.testing.assert_allclose(linear.derivative([1.0, 2.0], 0.5, u), A @ u, rtol=2 * EPS)
    assert not linear.derivative([1.0, 2.0], 0.5, u, u).any()
    assert not linear.derivative([1.0, 2.0], 0.5, u, u, u).any()


def test_complex_arguments_are_linear_in_each_place() -> None:
    at = nf.Multilinear(RICH.forms(POINT, PARAMETER))
    rng = np.random.default_rng(2)
    u, v, w = rng.uniform(-1, 1, (3, 3)) + 1j * rng.uniform(-1, 1, (3, 3))
    c = 0.6 - 1.7j
    np.testing.assert_allclose(at(u, c * v, w), c * at(u, v, w), rtol=0, atol=100 * EPS * 100)
    np.testing.assert_allclose(at(u, v.conj()), at(u.conj(), v).conj(), rtol=0, atol=EPS * 100)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_composition_law_gives_the_forms_of_the_iterate(order: int) -> None:
    twice = nf.ExplicitMap(RICH.function, dimension=3, iterate=2)
    composed = nf.Composition(
        RICH.forms(POINT, PARAMETER), RICH.forms(RICH(POINT, PARAMETER), PARAMETER)
    )
    us = np.random.default_rng(order).uniform(-1, 1, (order, 4))
    exact = twice.derivative(POINT, PARAMETER, *us)
    size = float(np.max(np.abs(exact)))
    # the sums of the law cancel where those of the jets do: some 100 operations
    np.testing.assert_allclose(composed.derivative(*us), exact, rtol=0, atol=100 * EPS * 10 * size)


def test_composition_of_different_spaces_is_refused() -> None:
    with pytest.raises(InvalidParameterError, match="must be equal"):
        nf.Composition(LOGISTIC.forms([0.5], 2.0), RICH.forms(POINT, PARAMETER))


def test_fixed_points_of_the_second_iterate_are_the_closed_form() -> None:
    p = 3.3
    root = math.sqrt((p - 3.0) * (p + 1.0))
    twice = nf.ExplicitMap(LOGISTIC.function, dimension=1, iterate=2)
    for sign in (1.0, -1.0):
        exact = (p + 1.0 + sign * root) / (2.0 * p)
        found = twice.fixed_point([exact + 0.01], p)
        assert found.converged
        assert found.stable
        assert abs(found.x[0] - exact) <= 4 * EPS
        assert abs(found.multipliers[0] - (4.0 + 2.0 * p - p * p)) <= 100 * EPS


def test_where_no_fixed_point_is_newton_says_so() -> None:
    none = nf.ExplicitMap(lambda x, p: [x[0] + 1.0 + (x[0] - p) ** 2], dimension=1)
    found = none.fixed_point([0.9], 0.0)
    assert found.status is nf.FixedPointStatus.NOT_CONVERGED
    assert "50 Newton steps" in found.reason
    assert found.residual >= 1.0
    assert not found.stable
    assert np.isnan(found.multipliers).all()


def test_a_singular_jacobian_is_a_status() -> None:
    shift = nf.ExplicitMap(lambda x, p: [x[0] + p], dimension=1)
    assert shift.fixed_point([0.0], 1.0).status is nf.FixedPointStatus.SINGULAR


def test_leaving_the_domain_is_a_status() -> None:
    steep = nf.ExplicitMap(lambda x, p: [np.log(x[0]) + p], dimension=1)
    assert steep.fixed_point([-1.0], 0.0).status is nf.FixedPointStatus.LEFT_DOMAIN


@pytest.mark.parametrize(
    ("function", "sentence"),
    [
        (lambda x, _: [x[0]], "returned 1 numbers; expected dimension = 2"),
        (lambda x, p: x[0] * p, "must return a sequence"),
        (lambda x, _: (x[0], "one"), "must be a real number"),
        (lambda x, _: (x[0], 1j), "must be a real number"),
        (lambda x, _: (x[0], None), "must be a real number"),
        (lambda x, _: (x[0], math.sin(x[1])), "not those of math"),
        (lambda x, _: (x[0], np.arctan(x[1])), "not those of math"),
    ],
)
def test_a_function_that_returns_something_else_is_named(function: Any, sentence: str) -> None:
    with pytest.raises(InvalidParameterError, match=sentence):
        nf.ExplicitMap(function, dimension=2).linearised([0.1, 0.2], 0.3)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"dimension": 0}, "dimension = 0: must be an integer >= 1"),
        ({"iterate": 1.5}, "iterate = 1.5: must be an integer >= 1"),
        ({"sizes": (1.0,)}, "sizes has shape"),
        ({"sizes": (1.0, 0.0)}, "every size must be > 0"),
    ],
)
def test_a_bad_description_of_a_map_is_refused(changes: Any, sentence: str) -> None:
    with pytest.raises(InvalidParameterError, match=sentence):
        nf.ExplicitMap(**{"function": LOGISTIC.function, "dimension": 1, **changes})


def test_directions_of_a_wrong_shape_or_number_are_refused() -> None:
    forms = RICH.forms(POINT, PARAMETER)
    with pytest.raises(InvalidParameterError, match="shape"):
        forms.derivative(np.ones(5))
    with pytest.raises(InvalidParameterError, match="give 1, 2 or 3"):
        forms.derivative(*np.ones((4, 3)))
    with pytest.raises(InvalidParameterError, match="x has shape"):
        RICH.forms([1.0, 2.0], PARAMETER)


def test_jacobian_of_the_problem_is_that_of_its_residual() -> None:
    z, h = np.array(POINT), 1e-6
    by_z, by_p = RICH.jacobian(z, PARAMETER)
    for j, u in enumerate(np.eye(3)):
        change = (RICH.residual(z + h * u, PARAMETER) - RICH.residual(z - h * u, PARAMETER)) / 2 / h
        np.testing.assert_allclose(by_z[:, j], change, atol=1e-8)  # h^2 and EPS / h, times 100
    change = (RICH.residual(z, PARAMETER + h) - RICH.residual(z, PARAMETER - h)) / 2 / h
    np.testing.assert_allclose(by_p, change, atol=1e-8)
    np.testing.assert_array_equal(RICH.scale(), np.ones(4))


def test_test_functions_vanish_at_the_published_points_of_henons_map() -> None:
    b, x = 0.632993161855452, 0.816496580927726  # 15 digits, a = 2
    assert abs(henon(b).watch(np.array([[x, x]]), np.array([2.0]))["PD"][0]) <= 1e-14
    x = math.sqrt(3.0) - 1.0
    assert abs(henon(1.0).watch(np.array([[x, x]]), np.array([2.0]))["NS"][0]) <= 10 * EPS
    assert henon(0.99).watch(np.array([[x, x]]), np.array([2.0]))["NS"][0] > 0.0


def test_second_doubling_of_the_logistic_map_is_where_it_should_be() -> None:
    p = 1.0 + math.sqrt(6.0)
    twice = nf.ExplicitMap(LOGISTIC.function, dimension=1, iterate=2)
    found = twice.fixed_point([0.85], p)
    assert abs(twice.watch(found.x[None], np.array([p]))["PD"][0]) <= 100 * EPS
    assert "NS" not in twice.watch(found.x[None], np.array([p]))


@pytest.mark.parametrize(
    ("a", "trace"),
    [(-1.0, 2.0), (3.0, -2.0), (1.25, -1.0), (0.0, 0.0)],
    ids=["R1", "R2", "R3", "R4"],
)
def test_strong_resonances_of_henons_map_are_where_published(a: float, trace: float) -> None:
    x = -trace / 2.0
    np.testing.assert_allclose(henon(1.0)([x, x], a), [x, x], rtol=0, atol=4 * EPS)
    A, _ = henon(1.0).linearised([x, x], a)
    assert np.trace(A) == trace
    assert np.linalg.det(A) == 1.0


@pytest.mark.parametrize(
    ("a", "b", "trace"),
    [(2.811791383220, 0.904761904762, -2.0), (1.179138321995, 0.952380952381, -1.0)],
    ids=["R2", "R3"],
)
def test_strong_resonances_of_the_generalised_map_are_where_published(
    a: float, b: float, trace: float
) -> None:
    ghm = nf.ExplicitMap(
        lambda x, a: (x[1], a - b * x[0] - x[1] ** 2 - 0.1 * x[0] * x[1]), dimension=2
    )
    found = ghm.fixed_point([0.9, 0.9] if trace == -2.0 else [0.5, 0.5], a)
    assert found.converged
    A, _ = ghm.linearised(found.x, a)
    # 12 printed digits of a and b, amplified by dx/da < 1
    assert abs(np.trace(A) - trace) <= 4e-12
    assert abs(np.linalg.det(A) - 1.0) <= 2e-12


def test_rotation_of_the_delayed_logistic_map_is_the_sixth_of_a_turn() -> None:
    found = DELAYED.fixed_point([0.4, 0.6], 2.0)
    np.testing.assert_allclose(found.x, [0.5, 0.5], rtol=2 * EPS)
    assert abs(np.angle(found.multipliers[0])) == pytest.approx(math.pi / 3.0, rel=4 * EPS)
    assert not found.stable
