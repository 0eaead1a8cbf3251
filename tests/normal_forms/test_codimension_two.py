"""Cusp, generalised flip, Chenciner point and interactions: planted and exact coefficients."""

from __future__ import annotations

import cmath
import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from support.planted import CHANGED, ROUNDING, TRACES, Change, Planted, driving, point_of, times

import vibroimpact.normal_forms as nf
from vibroimpact._core.errors import InvalidParameterError


def found(kind: str, forms: Any) -> Any:
    return point_of(kind, nf.codimension_two(kind, forms))


def refused(kind: str, function: Any, dimension: int) -> nf.Refusal:
    forms = nf.ExplicitMap(function, dimension=dimension).forms(np.zeros(dimension), 0.0)
    form = nf.codimension_two(kind, forms)
    assert isinstance(form, nf.Refusal)
    assert form.kind == kind
    return form


def forms_of(normal: Any, critical: int, stable: int, seed: int) -> tuple[nf.MapForms, Change]:
    """A normal form with stable directions that it drives, behind a change of coordinates."""
    n = critical + stable
    change = Change(n, seed)

    def function(x: Any, _: Any) -> Any:
        rest = [
            0.4 * (-1.0) ** k * x[critical + k] + 0.3 * x[0] ** 2 - 0.2 * x[0] * x[critical + k]
            for k in range(stable)
        ]
        return np.array([*normal(x[:critical]), *rest])

    return change.map(function).forms(np.zeros(n), 0.0), change


# A coefficient that vanishes


@pytest.mark.parametrize("stable", [0, 1, 3])
@pytest.mark.parametrize("c", [-0.7, 1.3])
def test_planted_cusp_is_recovered_behind_a_change_of_coordinates(c: float, stable: int) -> None:
    forms, change = forms_of(lambda x: [x[0] + c * x[0] ** 3], 1, stable, seed=stable)
    form = found("CP", forms)
    assert form.c * change.real_length(0) ** 2 == pytest.approx(c, rel=CHANGED)
    assert abs(form.a) <= CHANGED
    assert ("outer two attract" in form.meaning) == (c < 0.0)
    assert form.switchable == ()
    # (I - A) h2 = B(q, q) - <p, B(q, q)> q and <p, h2> = 0
    assert abs(form.p @ form.h2) <= CHANGED


def test_cusp_of_a_closed_form_has_its_cubic_coefficient() -> None:
    # x -> x - x^3 with a stable direction y -> y / 2 + x^2 that adds 3 x y: h2 = 4 x^2
    forms = nf.ExplicitMap(
        lambda u, _: [u[0] - u[0] ** 3 + 3.0 * u[0] * u[1], 0.5 * u[1] + u[0] ** 2], dimension=2
    ).forms([0.0, 0.0], 0.0)
    assert found("CP", forms).c == pytest.approx(-1.0 + 3.0 * 2.0, abs=ROUNDING)


def flat_flip(x: Any) -> list[Any]:
    return [-x[0] + x[0] ** 2 - x[0] ** 3 + x[0] ** 5]  # -x + x^2 + b x^3 has c = 1 + b


@pytest.mark.parametrize("stable", [0, 2])
def test_generalised_flip_says_what_vanishes_and_what_is_not_computed(stable: int) -> None:
    forms, _ = forms_of(flat_flip, 1, stable, seed=1)
    form = found("GPD", forms)
    assert abs(form.c) <= CHANGED * form.scale
    assert "fifth derivatives" in form.meaning
    assert form.switchable == (nf.NewCurve("SN", 2),)
    generic = refused("GPD", lambda x, _: [-x[0] + x[0] ** 2 - 0.9 * x[0] ** 3], 1)
    assert generic.status is nf.Status.NOT_CRITICAL
    assert generic.critical.c == pytest.approx(0.1, abs=ROUNDING)


@pytest.mark.parametrize("n", [2, 4])
def test_chenciner_point_says_what_vanishes_and_what_is_not_computed(n: int) -> None:
    form = found("CH", Planted(n, d=0.6j).forms())
    assert abs(form.d.real) <= CHANGED * form.scale
    assert abs(form.d.imag) > 0.01
    assert "fifth derivatives" in form.meaning
    assert "circles" in form.why_not
    generic = nf.codimension_two("CH", Planted(n).forms())
    assert isinstance(generic, nf.Refusal)
    assert generic.status is nf.Status.NOT_CRITICAL
    assert generic.critical.d.real < 0.0


# Fold-flip


@pytest.mark.parametrize(
    ("R", "scaled"), [(0.5, (1 / 4, 3 / 8)), (-0.1, (11 / 20, 9 / 40)), (0.0, (1 / 2, 1 / 4))]
)
def test_fold_flip_of_the_generalised_map(R: float, scaled: tuple[float, float]) -> None:
    # at alpha = 0, beta = -1 the fixed point is 0, where A exchanges x and y
    at = nf.ExplicitMap(lambda x, _: (x[1], x[0] - x[1] ** 2 + R * x[0] * x[1]), dimension=2)
    form = found("LPPD", at.forms([0.0, 0.0], 0.0))
    assert form.scaled == pytest.approx(scaled, abs=ROUNDING)
    assert form.switchable == (nf.NewCurve("NS", 2),)


def fold_pd(b: float) -> Any:
    def normal(x: Any) -> list[Any]:
        w = x[0] + 0.3 * x[0] ** 2 + b / 2.0 * x[1] ** 2 + 0.4 * x[0] ** 3 - x[0] * x[1] ** 2
        return [w, -x[1] + 1.1 * x[0] * x[1] + 0.6 * x[1] ** 3 + 0.2 * x[0] ** 2 * x[1]]

    return normal


@pytest.mark.parametrize("stable", [0, 2])
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("b", [0.8, -0.8])
def test_planted_fold_flip_is_recovered_behind_a_change_of_coordinates(
    b: float, seed: int, stable: int
) -> None:
    forms, change = forms_of(fold_pd(b), 2, stable, seed)
    form = found("LPPD", forms)
    assert form.scaled[0] == pytest.approx(0.6 / 2.2, rel=CHANGED)
    product = form.scaled[1] * change.real_length(1) ** 2
    assert product == pytest.approx(b * 1.1 / 2.0, rel=CHANGED)
    assert bool(form.switchable) == (b > 0.0)
    assert ("saddle" in form.meaning) == (b < 0.0)


@pytest.mark.parametrize("b", [0.8, -0.8])
def test_doubled_orbit_at_the_fold_flip_is_a_saddle_where_b_e_is_negative(b: float) -> None:
    v = 0.05
    push = -b / 2.0 * v**2  # (0, v) -> (0, -v)
    twice = nf.ExplicitMap(
        lambda x, _: (
            push + x[0] + 0.3 * x[0] ** 2 + b / 2.0 * x[1] ** 2,
            -x[1] + 1.1 * x[0] * x[1],
        ),
        dimension=2,
        iterate=2,
    )
    at = twice.fixed_point([0.0, v], 0.0)
    assert at.converged
    np.testing.assert_allclose(at.x, [0.0, v], atol=1e-12)
    saddle = bool(np.all(at.multipliers.imag == 0.0) and np.prod(at.multipliers.real - 1.0) < 0.0)
    assert saddle == (b < 0.0)


# Fold-Neimark-Sacker

NU = cmath.exp(2.2j)
LPNS: dict[str, Any] = {
    "f200": 0.7,
    "f011": -0.9,
    "g110": 0.5 - 0.4j,
    "f300": 0.3,
    "f111": -0.6,
    "g210": 0.2 + 0.5j,
    "g021": -0.4 + 0.3j,
}


def fold_ns(**coefficients: complex) -> Any:
    f200, f011, g110, f300, f111, g210, g021 = (coefficients[name] for name in LPNS)

    def normal(x: Any) -> list[Any]:
        w, size = x[0], x[1] ** 2 + x[2] ** 2
        fold = w + f200 * w**2 + f011 * size + f300 * w**3 + f111 * w * size
        z = times(NU, x[1], x[2]) + w * times(g110, x[1], x[2])
        z = z + w**2 * times(g210, x[1], x[2]) + size * times(g021, x[1], x[2])
        return [fold, *z]

    return normal


@pytest.mark.parametrize("stable", [0, 2])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_planted_fold_neimark_sacker_is_recovered_behind_a_change_of_coordinates(
    seed: int, stable: int
) -> None:
    forms, change = forms_of(fold_ns(**LPNS), 3, stable, seed)
    form = found("LPNS", forms)
    f200, f011, g110 = LPNS["f200"], LPNS["f011"], LPNS["g110"]
    size = change.complex_length(1)
    assert abs(form.f200) * change.real_length(0) == pytest.approx(f200, rel=CHANGED)
    assert form.f200 * form.f011 * size**2 == pytest.approx(f200 * f011, rel=CHANGED)
    mixed = (NU.conjugate() * LPNS["g021"]).real
    top = f011 * LPNS["g210"] + g110 * (LPNS["f111"] / 2.0 + mixed) - f200 * LPNS["g021"]
    assert form.s == -1
    assert abs(form.a - g110 / f200) <= CHANGED
    assert form.c == pytest.approx(LPNS["f300"] / f200**2, rel=CHANGED)
    assert abs(form.b - top / (f011 * f200**2)) <= 10.0 * CHANGED  # quotients of the others
    assert form.torus == (f011 * (NU.conjugate() * g110).real < 0.0)
    assert form.switchable == ()


def test_cubic_coefficient_b_is_that_of_the_form_without_the_other_ones() -> None:
    plain = LPNS | {"f200": 1.0, "f111": 0.0, "g021": 0.0}
    form = found("LPNS", forms_of(fold_ns(**plain), 3, 1, seed=3)[0])
    assert abs(form.b - plain["g210"]) <= 10.0 * CHANGED


@pytest.mark.parametrize("f011", [0.9, -0.9])
def test_circle_at_a_fold_neimark_sacker_point_turns_where_the_product_is_negative(
    f011: float,
) -> None:
    rate = (NU.conjugate() * LPNS["g110"]).real
    form = found("LPNS", forms_of(fold_ns(**(LPNS | {"f011": f011})), 3, 0, seed=1)[0])
    # amplitude flow w' = f200 w^2 + f011 (r^2 - r0^2), r' = rate w r at w = 0, r = r0
    eigenvalues = np.linalg.eigvals([[0.0, 2.0 * f011 * 0.1], [rate * 0.1, 0.0]])
    assert form.torus == bool(np.any(eigenvalues.imag != 0.0))
    assert ("torus" in form.meaning) == form.torus


# Two amplitudes

PDNS = 0.6, -0.9, 0.3 + 0.5j, -0.4 + 0.3j
NSNS = ((0.6 - 0.2j, -0.9 + 0.1j), (0.3 + 0.5j, -0.4 + 0.3j))


def flip_ns(x: Any) -> list[Any]:
    (f300, f111, g210, g021), w, size = PDNS, x[0], x[1] ** 2 + x[2] ** 2
    z = times(NU, x[1], x[2]) + w**2 * times(g210, x[1], x[2])
    return [-w + f300 * w**3 + f111 * w * size, *(z + size * times(g021, x[1], x[2]))]


def double_ns(nus: tuple[complex, complex]) -> Any:
    def normal(x: Any) -> list[Any]:
        sizes, image = (x[0] ** 2 + x[1] ** 2, x[2] ** 2 + x[3] ** 2), []
        for k, (nu, row) in enumerate(zip(nus, NSNS, strict=True)):
            z = x[2 * k], x[2 * k + 1]
            grown = sum(size * times(f, *z) for size, f in zip(sizes, row, strict=True))
            image += [*(times(nu, *z) + grown)]
        return image

    return normal


@pytest.mark.parametrize("stable", [0, 2])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_planted_flip_neimark_sacker_is_recovered_behind_a_change_of_coordinates(
    seed: int, stable: int
) -> None:
    forms, change = forms_of(flip_ns, 3, stable, seed)
    f300, f111, g210, g021 = PDNS
    form = found("PDNS", forms)
    bar = NU.conjugate()
    expected = np.array([[-f300, -f111], [(bar * g210).real, (bar * g021).real]])
    scale = np.array([change.real_length(0), change.complex_length(1)]) ** 2
    np.testing.assert_allclose(form.coefficients * scale, expected, rtol=10.0 * CHANGED)
    assert form.ratios == pytest.approx(
        (expected[0, 1] / expected[1, 1], expected[1, 0] / expected[0, 0]), rel=10.0 * CHANGED
    )
    assert form.simple == bool(expected[0, 0] * expected[1, 1] > 0.0)
    assert form.switchable == (nf.NewCurve("NS", 2),)


@pytest.mark.parametrize("stable", [0, 1])
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("exchanged", [False, True])
def test_planted_double_neimark_sacker_is_recovered_behind_a_change_of_coordinates(
    exchanged: bool, seed: int, stable: int
) -> None:
    nus = (NU, cmath.exp(0.9j)) if exchanged else (cmath.exp(0.9j), NU)
    forms, change = forms_of(double_ns(nus), 4, stable, seed)
    form = found("NSNS", forms)
    expected = np.real(np.conj(nus)[:, None] * np.array(NSNS))
    scale = np.array([change.complex_length(0), change.complex_length(2)]) ** 2
    if exchanged:  # the pair of smaller angle comes first
        expected, scale = expected[::-1, ::-1], scale[::-1]
    # the gap of nu1 conj(nu2) to the other multipliers is 0.2, and enters squared
    np.testing.assert_allclose(form.coefficients * scale, expected, rtol=100.0 * CHANGED)
    assert form.switchable == ()
    assert "torus" in form.meaning


# Refusals and the entry

EXAMPLES = {
    "CP": lambda: forms_of(lambda x: [x[0] - x[0] ** 3], 1, 2, seed=1)[0],
    "GPD": lambda: forms_of(flat_flip, 1, 2, seed=1)[0],
    "CH": lambda: Planted(4, d=0.6j).forms(),
    "LPPD": lambda: forms_of(fold_pd(0.8), 2, 2, seed=1)[0],
    "LPNS": lambda: forms_of(fold_ns(**LPNS), 3, 2, seed=1)[0],
    "PDNS": lambda: forms_of(flip_ns, 3, 2, seed=1)[0],
    "NSNS": lambda: forms_of(double_ns((NU, cmath.exp(0.9j))), 4, 2, seed=1)[0],
    **{kind: partial(driving, kind, -0.1) for kind in TRACES},
}


def turned(angle: float, x: Any) -> Any:
    return times(cmath.exp(1j * angle), x[0], x[1])


def test_points_of_lower_and_higher_codimension_are_refused() -> None:
    fold = refused("CP", lambda x, _: [x[0] + x[0] ** 2 + x[0] ** 3], 1)
    assert fold.status is nf.Status.NOT_CRITICAL
    assert "quadratic" in fold.reason
    quartic = refused("CP", lambda x, _: [x[0] + x[0] ** 4], 1)
    assert quartic.status is nf.Status.DEGENERATE
    both = refused("CP", lambda x, _: [x[0] + x[0] ** 3, x[1] + x[1] ** 3], 2)
    assert both.status is nf.Status.OTHERS_CRITICAL
    assert refused("LPPD", lambda x, _: (x[0], 0.5 * x[1]), 2).status is fold.status
    linear = refused("LPPD", lambda x, _: (x[0], -x[1]), 2)
    assert linear.status is nf.Status.DEGENERATE
    assert refused("PDNS", lambda x, _: (-x[0], 0.5 * x[1], 0.4 * x[2]), 3).status is fold.status
    twice = refused("LPPD", lambda x, _: (x[0] + x[0] ** 2, -x[1] + x[0] * x[1], 1.0001 * x[2]), 3)
    assert twice.status is nf.Status.OTHERS_CRITICAL
    broken = refused("LPPD", lambda x, _: (np.sqrt(x[0]), -x[1]), 2)
    assert broken.status is nf.Status.NOT_SMOOTH


@pytest.mark.parametrize("kind", ["LPNS", "PDNS"])
def test_degenerate_interactions_are_refused(kind: str) -> None:
    sign = 1.0 if kind == "LPNS" else -1.0

    def uncoupled(x: Any, _: Any) -> list[Any]:
        square = x[0] ** 2 if kind == "LPNS" else 0.0
        growth = 1.0 - x[1] ** 2 - x[2] ** 2
        return [sign * x[0] * (1.0 - x[0] ** 2) + square, *(growth * turned(2.2, x[1:]))]

    assert refused(kind, uncoupled, 3).status is nf.Status.DEGENERATE


def sharp(x: Any) -> Any:
    return x[0] ** 2 * np.sqrt(x[0])


@pytest.mark.parametrize(
    ("kind", "dimension", "function"),
    [
        ("CP", 1, lambda x, _: [x[0] + sharp(x)]),
        ("GPD", 1, lambda x, _: [-x[0] + sharp(x)]),
        ("CH", 3, lambda x, _: [*turned(2.2, x), 0.5 * x[2] + sharp(x)]),
        ("R2", 2, lambda x, _: [x[1] - x[0], -x[1] + sharp(x)]),
        (
            "LPNS",
            3,
            lambda x, _: [
                x[0] + x[0] ** 2 + x[1] ** 2 + sharp(x),
                *((1.0 + x[0]) * turned(2.2, x[1:])),
            ],
        ),
        ("PDNS", 3, lambda x, _: [-x[0] + sharp(x), *turned(2.2, x[1:])]),
    ],
)
def test_map_without_third_derivatives_is_refused(kind: str, dimension: int, function: Any) -> None:
    assert refused(kind, function, dimension).status is nf.Status.NOT_SMOOTH


def test_amplitudes_that_grow_in_proportion_are_refused() -> None:
    def function(x: Any, _: Any) -> list[Any]:
        growth = 1.0 - x[0] ** 2 - 0.5 * (x[1] ** 2 + x[2] ** 2)
        return [-x[0] * growth, *(growth * turned(2.2, x[1:]))]

    proportional = refused("PDNS", function, 3)
    assert proportional.status is nf.Status.DEGENERATE
    assert proportional.reason.startswith("det p")


@pytest.mark.parametrize(
    ("kind", "angle"),
    [("LPNS", 2.0 / 3.0), ("LPNS", 0.5), ("PDNS", 2.0 / 3.0), ("PDNS", 0.5), ("PDNS", 1.0 / 3.0)],
)
def test_further_resonances_are_refused(kind: str, angle: float) -> None:
    sign = 1.0 if kind == "LPNS" else -1.0

    def function(x: Any, _: Any) -> list[Any]:
        return [sign * x[0] + x[1] ** 2, *turned(math.pi * angle, x[1:])]

    resonant = refused(kind, function, 3)
    assert resonant.status is nf.Status.STRONG_RESONANCE
    assert "order four or less" in resonant.reason


def test_flip_counts_as_a_factor_of_a_resonance() -> None:
    # nu^4 = -1 takes five factors, and leaves no term of order three
    fifth = refused("PDNS", lambda x, _: [-x[0], *turned(math.pi / 4.0, x[1:])], 3)
    assert fifth.status is nf.Status.DEGENERATE


@pytest.mark.parametrize("second", [2.0, 3.0, 0.5, -3.0])
def test_resonances_between_two_pairs_are_refused(second: float) -> None:
    angle = 2.0 * math.pi / 7.3  # nu2 = nu1^second, or the square of nu2 is nu1
    function = lambda x, _: [*turned(angle, x[:2]), *turned(second * angle, x[2:])]  # noqa: E731
    assert refused("NSNS", function, 4).status is nf.Status.STRONG_RESONANCE


@pytest.mark.parametrize("off", [-3e-5, 3e-5])
def test_fold_flip_known_to_the_square_root_of_nine_digits_is_accepted(off: float) -> None:
    at = nf.ExplicitMap(lambda x, _: (x[1], x[0] - x[1] ** 2 - 0.1 * x[0] * x[1]), dimension=2)
    form = found("LPPD", at.forms([off, off], 0.0))
    assert form.scaled == pytest.approx((0.55, 0.225), abs=10.0 * abs(off))


def test_every_kind_has_an_entry_and_only_these() -> None:
    for kind in EXAMPLES:
        unsuited = nf.codimension_two(kind, Planted(2, cmath.exp(1.0j)).forms())
        assert isinstance(unsuited, nf.Refusal)
        assert unsuited.kind == kind
        assert found(kind, EXAMPLES[kind]()).kind == kind
    with pytest.raises(InvalidParameterError, match="must be one of CP, GPD, CH"):
        nf.codimension_two("BT", Planted(2).forms())
    with pytest.raises(InvalidParameterError, match="the forms of a map"):
        nf.codimension_two("CP", Planted(2).map)


@pytest.mark.parametrize(
    ("kind", "second", "third"),
    [
        *(("CP", 2, 1), ("GPD", 2, 1), ("CH", 9, 4)),
        *(("R1", 2, 0), ("R2", 5, 2), ("R3", 9, 4), ("R4", 9, 4)),
        *(("LPPD", 3, 0), ("LPNS", 22, 10), ("PDNS", 22, 10), ("NSNS", 42, 20)),
    ],
)
def test_every_kind_costs_what_its_docstring_says(kind: str, second: int, third: int) -> None:
    orders: list[int] = []

    class Counting(nf.MapForms):
        def derivative(self, *directions: np.ndarray) -> np.ndarray:
            orders.append(len(directions))
            return super().derivative(*directions)

    plain = EXAMPLES[kind]()
    form = found(kind, Counting(plain.map, plain.x, plain.p))
    assert [orders.count(k) for k in (1, 2, 3)] == [plain.dimension, second, third]
    assert form.others_inside
    assert len(form.multipliers) == plain.dimension
