"""Coefficients at the resonances 1:1 to 1:4: exact, published, planted, and in the dynamics."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from support.planted import (
    CHANGED,
    ROUNDING,
    TRACES,
    Change,
    driving,
    forms_at,
    henon,
    point_of,
    times,
)

import vibroimpact.normal_forms as nf

CUBE_ROOT = cmath.exp(2j * math.pi / 3.0)


def found(kind: str, forms: Any) -> Any:
    return point_of(kind, nf.codimension_two(kind, forms))


# Exact coefficients


@pytest.mark.parametrize(
    ("R", "alpha", "beta", "a", "b"),
    [(0.5, -8 / 9, 1 / 3, -0.5, -1.5), (-0.1, -440 / 441, 23 / 21, -1.1, -2.1)],
)
def test_resonance_1_1_of_the_generalised_map(
    R: float, alpha: float, beta: float, a: float, b: float
) -> None:
    assert henon(R, 2.0)[1:] == pytest.approx((alpha, beta), abs=ROUNDING)
    form = found("R1", forms_at("R1", R))
    # a and b are those of the eigenvector (1, 1), which is sqrt(2) long
    assert form.a * math.sqrt(2.0) == pytest.approx(a, abs=ROUNDING)
    assert form.b * math.sqrt(2.0) == pytest.approx(b, abs=ROUNDING)
    assert form.sign == (1 if R > 0.0 else -1)
    assert form.switchable == (nf.NewCurve("NS", 1),)


def test_resonance_1_1_of_the_delayed_logistic_map() -> None:
    # r x (1 - x) + q = x with trace r (1 - x) = 2 and determinant r x = 1: r = 3, x = 1/3, q = -1/3
    def function(u: Any, _: Any) -> list[Any]:
        return [3.0 * (u[0] + 1 / 3) * (2 / 3 - u[1]) - 2 / 3, u[0]]

    form = found("R1", nf.ExplicitMap(function, dimension=2).forms([0.0, 0.0], 0.0))
    assert form.a * math.sqrt(2.0) == pytest.approx(-3.0, abs=ROUNDING)
    assert form.b * math.sqrt(2.0) == pytest.approx(-3.0, abs=ROUNDING)
    assert (form.sign, form.others_inside) == (-1, True)


@pytest.mark.parametrize(
    ("R", "alpha", "beta", "scaled"),
    [(0.5, 40 / 9, 5 / 3, (-1.5, 1 / 16)), (-0.1, 1240 / 441, 19 / 21, (-0.9, -11 / 400))],
)
def test_resonance_1_2_of_the_generalised_map(
    R: float, alpha: float, beta: float, scaled: tuple[float, float]
) -> None:
    assert henon(R, -2.0)[1:] == pytest.approx((alpha, beta), abs=ROUNDING)
    form = found("R2", forms_at("R2", R))
    assert form.scaled == pytest.approx(scaled, abs=ROUNDING)
    assert form.switchable == (nf.NewCurve("NS", 2),)


@pytest.mark.parametrize(
    ("R", "alpha", "beta", "square", "real"),
    [
        (0.5, 16 / 9, 4 / 3, 7 / 24, 1 / 42),
        (-0.1, 520 / 441, 20 / 21, 91 / 600, -11 / 546),
    ],
)
def test_resonance_1_3_of_the_generalised_map(
    R: float, alpha: float, beta: float, square: float, real: float
) -> None:
    assert henon(R, -1.0)[1:] == pytest.approx((alpha, beta), abs=ROUNDING)
    form = found("R3", forms_at("R3", R))
    assert abs(form.b) ** 2 == pytest.approx(square, abs=ROUNDING)
    assert form.scaled.real == pytest.approx(real, abs=ROUNDING)
    assert str(form.switchable[0]) == "neutral saddle of period 3"


def test_resonance_1_3_has_the_published_digits() -> None:
    form = found("R3", forms_at("R3", -0.1))
    assert abs(form.b) == pytest.approx(0.3894440482, abs=1e-10)
    assert abs(form.scaled - (-0.0201465201 - 0.6630011333j)) <= 1e-10


@pytest.mark.parametrize(
    ("R", "c", "d", "A"),
    [
        (0.5, (1 + 1j) / 32, (-9 + 7j) / 32, (1 - 1j) / math.sqrt(130.0)),
        (-0.1, (229 - 11j) / 800, (-189 - 29j) / 800, -0.0575277930 - 1.1976240542j),
    ],
)
def test_resonance_1_4_of_the_generalised_map(R: float, c: complex, d: complex, A: complex) -> None:
    assert henon(R, 0.0)[1:] == (0.0, 1.0)
    form = found("R4", forms_at("R4", R))
    assert abs(form.c - c) <= ROUNDING
    assert abs(form.d - d) <= ROUNDING
    assert abs(form.scaled - A) <= 1e-10  # ten printed digits
    assert (abs(form.scaled) > 1.0) == (R < 0.0)
    assert form.switchable == ((nf.NewCurve("SN", 4),) * 2 if R < 0.0 else ())
    assert ("born in a fold" in form.meaning) == (R < 0.0)


@pytest.mark.parametrize("kind", ["R1", "R2", "R3", "R4"])
def test_an_area_preserving_map_is_degenerate(kind: str) -> None:
    refused = nf.codimension_two(kind, forms_at(kind, 0.0))
    assert isinstance(refused, nf.Refusal)
    assert refused.status is nf.Status.DEGENERATE
    assert "zero to half of the digits" in refused.reason
    assert refused.critical.kind == kind


# What does not depend on the coordinates


def length(change: Change, q: Any) -> float:
    """Length of an eigenvector of the plane, of length one there, in the new coordinates.

    The driven directions have no linear part, so that it is continued by zeros.
    """
    return float(np.linalg.norm(change.linear[:, :2] @ q))


@pytest.mark.parametrize("n", [2, 4])
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("R", [0.5, -0.1])
def test_coefficients_are_the_same_behind_a_change_of_coordinates(
    R: float, seed: int, n: int
) -> None:
    for kind, lead in (("R1", "a"), ("R2", "c"), ("R3", "b"), ("R4", "d")):
        change = Change(n, seed)
        forms = driving(kind, R, change)
        form, plain = found(kind, forms), found(kind, forms_at(kind, R))
        q = plain.q0 if kind in ("R1", "R2") else plain.q
        k = length(change, q) ** (1.0 if kind in ("R1", "R3") else 2.0)
        size = abs(getattr(plain, lead))
        assert abs(getattr(form, lead)) * k == pytest.approx(size, rel=CHANGED)
        if kind == "R1":
            assert form.b / form.a == pytest.approx(plain.b / plain.a, rel=CHANGED)
            assert form.sign == plain.sign
        elif kind == "R2":
            assert form.d / form.c == pytest.approx(plain.d / plain.c, rel=CHANGED)
            assert form.c < 0.0
        elif kind == "R3":
            assert form.scaled.real == pytest.approx(plain.scaled.real, abs=CHANGED)
        else:
            assert abs(form.scaled - plain.scaled) <= CHANGED
        assert form.others_inside


@pytest.mark.parametrize("n", [2, 3, 5])
def test_planted_resonance_1_2_is_recovered_behind_a_change_of_coordinates(n: int) -> None:
    change = Change(n, seed=n)

    def normal(x: Any, _: Any) -> Any:
        cubic = 1.3 * x[0] ** 3 - 0.7 * x[0] ** 2 * x[1]
        return np.array([x[1] - x[0], cubic - x[1], *(0.4 * x[2:])])

    form = found("R2", change.map(normal).forms(np.zeros(n), 0.0))
    scale = change.real_length(0) ** 2  # |q0| = 1
    np.testing.assert_allclose([form.c * scale, form.d * scale], [1.3, -0.7], rtol=1e-10)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_planted_resonance_1_1_is_recovered_behind_a_change_of_coordinates(n: int) -> None:
    change = Change(n, seed=n)

    def normal(x: Any, _: Any) -> Any:
        square = 1.3 * x[0] ** 2 - 0.7 * x[0] * x[1]
        return np.array([x[1] + x[0], square + x[1], *(0.4 * x[2:])])

    form = found("R1", change.map(normal).forms(np.zeros(n), 0.0))
    scale = change.real_length(0)  # |q0| = 1
    assert abs(form.a) * scale == pytest.approx(1.3, rel=CHANGED)
    assert form.b / form.a == pytest.approx(-0.7 / 1.3, rel=CHANGED)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_planted_resonance_1_3_is_recovered_behind_a_change_of_coordinates(n: int) -> None:
    change, b, c = Change(n, seed=n), 0.8 - 0.3j, -0.9 + 0.4j

    def normal(x: Any, _: Any) -> Any:
        linear, square = times(CUBE_ROOT, x[0], x[1]), x[0] ** 2 - x[1] ** 2
        cubic = (x[0] ** 2 + x[1] ** 2) * times(c, x[0], x[1])
        plane = linear + times(b, square, -2.0 * x[0] * x[1]) + cubic
        return np.array([*plane, *(0.4 * x[2:])])

    form = found("R3", change.map(normal).forms(np.zeros(n), 0.0))
    expected = (CUBE_ROOT.conjugate() * c / abs(b) ** 2 - 1.0) / 3.0
    assert form.scaled.real == pytest.approx(expected.real, abs=1e-10)  # the invariant part
    assert abs(form.b) * change.complex_length(0) == pytest.approx(abs(b), rel=1e-10)


def fourth(nu: complex, c: complex, d: complex) -> Any:
    """z -> nu z + c z |z|^2 + d conj(z)^3 in real coordinates."""

    def function(x: Any, _: Any) -> Any:
        size = x[0] ** 2 + x[1] ** 2
        re, im = x[0] ** 3 - 3.0 * x[0] * x[1] ** 2, x[1] ** 3 - 3.0 * x[0] ** 2 * x[1]
        plane = times(nu, x[0], x[1]) + size * times(c, x[0], x[1]) + times(d, re, im)
        return np.array([*plane, *(0.4 * x[2:])])

    return function


@pytest.mark.parametrize("n", [2, 3, 5])
def test_planted_resonance_1_4_is_recovered_behind_a_change_of_coordinates(n: int) -> None:
    change, c, d = Change(n, seed=n), 0.8 - 0.3j, 0.2 + 0.4j
    form = found("R4", change.map(fourth(1j, c, d)).forms(np.zeros(n), 0.0))
    assert abs(form.scaled + 1j * c / abs(d)) <= CHANGED
    assert abs(form.d) * change.complex_length(0) ** 2 == pytest.approx(abs(d), rel=CHANGED)


# The dynamics that the coefficients stand for


@pytest.mark.parametrize("kind", ["R1", "R2", "R3", "R4"])
@pytest.mark.parametrize("R", [0.5, -0.1])
def test_circle_next_to_the_resonance_attracts_where_the_coefficient_says(
    kind: str, R: float
) -> None:
    # the Neimark-Sacker point whose angle is off by 0.02, on the side where it is one
    angle = math.acos(TRACES[kind] / 2.0) + (0.02 if kind != "R2" else -0.02)
    forms = nf.ExplicitMap(henon(R, 2.0 * math.cos(angle))[0], dimension=2).forms([0, 0], 0.0)
    circle = nf.normal_form("NS", forms, unfolded=False)
    assert isinstance(circle, nf.NeimarkSacker)
    form = found(kind, forms_at(kind, R))
    deciding = {
        "R1": lambda: form.sign,
        "R2": lambda: form.scaled[1],
        "R3": lambda: form.scaled.real,
        "R4": lambda: form.scaled.real,
    }[kind]()
    assert circle.supercritical == (deciding < 0.0)
    assert ("attracts" in form.meaning) == circle.supercritical


@pytest.mark.parametrize("c", [-1.3, 1.3])
def test_doubled_orbit_at_resonance_1_2_is_a_saddle_where_c_is_positive(c: float) -> None:
    # with the linear term -c w^2 w0 the normal form takes (w, 0) to (-w, 0) and back
    w = 0.05

    def function(x: Any, _: Any) -> list[Any]:
        return [x[1] - x[0], -x[1] + c * x[0] ** 3 - c * w**2 * x[0] - 0.7 * x[0] ** 2 * x[1]]

    twice = nf.ExplicitMap(function, dimension=2, iterate=2)
    at = twice.fixed_point([w, 0.0], 0.0)
    assert at.converged
    assert abs(at.x[0]) == pytest.approx(w, rel=1e-12)
    saddle = bool(np.all(at.multipliers.imag == 0.0) and np.prod(at.multipliers.real - 1.0) < 0.0)
    assert saddle == (c > 0.0)
    flat = nf.ExplicitMap(
        lambda x, _: [x[1] - x[0], -x[1] + c * x[0] ** 3 - 0.7 * x[0] ** 2 * x[1]], dimension=2
    )
    form = found("R2", flat.forms([0.0, 0.0], 0.0))
    assert bool(form.switchable) == (not saddle)
    assert ("saddle" in form.meaning) == saddle


@pytest.mark.parametrize(("c", "d"), [(0.8 - 0.9j, 0.3 + 0.4j), (-0.1 + 0.2j, 0.5 - 0.4j)])
def test_number_of_orbits_of_period_four_changes_on_the_half_lines_of_folds(
    c: complex, d: complex
) -> None:
    form = found("R4", nf.ExplicitMap(fourth(1j, c, d), dimension=2).forms([0.0, 0.0], 0.0))
    if not form.switchable:
        directions = np.exp(2j * math.pi * np.arange(24) / 24)
        assert {len(nf.period_four(form, 1e-3 * u)) for u in directions.tolist()} == {4}
        assert nf.fold_directions(form) == ()
        return
    for edge, inwards in zip(nf.fold_directions(form), (1.0, -1.0), strict=True):
        inner = nf.period_four(form, 1e-3 * edge * cmath.exp(1e-6j * inwards))
        assert len(inner) == 8
        # next to the fold, sizes differ by the square root of the distance
        assert abs(inner[0]) == pytest.approx(abs(inner[4]), rel=1e-2)
        assert len(nf.period_four(form, 1e-3 * edge * cmath.exp(-1e-6j * inwards))) == 0


@pytest.mark.parametrize("R", [0.5, -0.1])
def test_predicted_points_of_period_four_approach_those_of_the_map(R: float) -> None:
    form, errors = found("R4", forms_at("R4", R)), []
    middle = -form.scaled / abs(form.scaled)
    for distance in (1e-4, 1e-6):
        nu = 1j * cmath.exp(distance * middle)
        # trace and determinant of the fixed point x give x and beta
        x = 2.0 * nu.real / (R - 2.0)
        beta = abs(nu) ** 2 + R * x
        alpha = x + beta * x + (1.0 - R) * x**2
        at = nf.ExplicitMap(
            lambda u, _, a=alpha, b=beta: (u[1], a - b * u[0] - u[1] ** 2 + R * u[0] * u[1]),
            dimension=2,
            iterate=4,
        )
        off = []
        z = nf.period_four(form, distance * middle)
        assert len(z) == (8 if R < 0.0 else 4)
        for guess in nf.on_pair_manifold(z, form.q, form.h20, form.h11) + x:
            true = at.fixed_point(guess, 0.0)
            assert true.converged
            assert np.max(np.abs(true.x - x)) > 0.1 * math.sqrt(distance)  # not the fixed point
            off.append(float(np.max(np.abs(true.x - guess))))
        errors.append(max(off))
    assert math.log10(errors[0] / errors[1]) / 2.0 == pytest.approx(1.5, abs=0.1)


# Points that are known to some digits, and refusals


@pytest.mark.parametrize("kind", ["R1", "R2"])
@pytest.mark.parametrize("beta", [-1e-9, 1e-9])
def test_point_known_to_nine_digits_has_its_coefficients_to_eight(kind: str, beta: float) -> None:
    plane = henon(-0.1, TRACES[kind])[0]

    def function(u: Any, p: Any) -> list[Any]:
        image = plane(u, p)
        return [image[0], image[1] - beta * u[0]]

    at = nf.ExplicitMap(function, dimension=2)
    split = np.abs(at.fixed_point([0.0, 0.0], 0.0).multipliers - TRACES[kind] / 2.0)
    assert 1e-5 < np.max(split) < 1e-4  # the square root of 1e-9
    form = found(kind, at.forms([0.0, 0.0], 0.0))
    plain = found(kind, forms_at(kind, -0.1))
    lead = "a" if kind == "R1" else "c"
    assert getattr(form, lead) == pytest.approx(getattr(plain, lead), abs=1e-8)


def test_other_multipliers_and_kinds_are_refused() -> None:
    for kind in TRACES:
        for other in TRACES:
            refused = nf.codimension_two(other, forms_at(kind, -0.1))
            assert isinstance(refused, nf.Refusal) == (kind != other)
            assert kind == other or refused.kind == other
    refused = nf.codimension_two("R2", forms_at("R3", -0.1))
    assert isinstance(refused, nf.Refusal)
    assert refused.status is nf.Status.NOT_CRITICAL
    triple = nf.ExplicitMap(lambda x, p: (x[1] - x[0], -x[1], p - x[2]), dimension=3)
    assert isinstance(nf.codimension_two("R2", triple.forms(np.zeros(3), 0.0)), nf.Refusal)


@pytest.mark.parametrize(("kind", "nu"), [("R1", 1.0), ("R2", -1.0)])
def test_double_multiplier_with_two_eigenvectors_is_refused(kind: str, nu: float) -> None:
    two = nf.ExplicitMap(lambda x, _: (nu * x[0] + x[1] ** 2, nu * x[1] + x[0] ** 2), dimension=2)
    refused = nf.codimension_two(kind, two.forms(np.zeros(2), 0.0))
    assert isinstance(refused, nf.Refusal)
    assert refused.status is nf.Status.OTHERS_CRITICAL
    assert "one eigenvector" in refused.reason
    broken = nf.ExplicitMap(lambda x, _: (np.sqrt(x[0]), x[1]), dimension=2)
    assert nf.codimension_two(kind, broken.forms(np.zeros(2), 0.0)).status is nf.Status.NOT_SMOOTH


def test_resonances_without_their_leading_term_are_refused() -> None:
    spin = math.cos(2.0 * math.pi / 3.0), math.sin(2.0 * math.pi / 3.0)
    third = nf.ExplicitMap(
        lambda x, _: (spin[0] * x[0] - spin[1] * x[1], spin[1] * x[0] + spin[0] * x[1]), dimension=2
    )
    for kind, at in (("R3", third), ("R4", nf.ExplicitMap(fourth(1j, 1.0, 0.0), dimension=2))):
        refused = nf.codimension_two(kind, at.forms(np.zeros(2), 0.0))
        assert isinstance(refused, nf.Refusal)
        assert refused.status is nf.Status.DEGENERATE
        assert "is born" in refused.reason


@pytest.mark.parametrize(
    ("c", "d", "name"),
    [(0.7, 0.3, "Re A"), (0.7j, 0.3j, "Im A"), (0.3 + 0.4j, -0.5, "|A| - 1")],
)
def test_borders_between_the_cases_of_resonance_1_4_are_refused(
    c: complex, d: complex, name: str
) -> None:
    refused = nf.codimension_two(
        "R4", nf.ExplicitMap(fourth(1j, c, d), dimension=2).forms(np.zeros(2), 0.0)
    )
    assert isinstance(refused, nf.Refusal)
    assert refused.status is nf.Status.DEGENERATE
    assert refused.reason.startswith(name)
