"""Neimark-Sacker: published coefficients, planted ones, both routes, circles."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from support.planted import Planted, Tensors, found, random_map

import vibroimpact.normal_forms as nf
from vibroimpact.normal_forms.centre_manifold import f1_of

EPS = 2.0**-52
DELAYED = nf.ExplicitMap(lambda x, r: (r * x[0] * (1.0 - x[1]), x[0]), dimension=2)


def ghm(a: float) -> nf.ExplicitMap:
    """x' = y, y' = a - b x - y^2 - x y / 10, in the parameter b."""
    return nf.ExplicitMap(
        lambda x, b: (x[1], a - b * x[0] - x[1] ** 2 - 0.1 * x[0] * x[1]), dimension=2
    )


# Published coefficients


def test_generalised_henon_map_has_the_published_coefficient() -> None:
    at = ghm(0.949738364007).fixed_point([0.4, 0.4], 0.960366967948)
    form = found("NS", ghm(0.949738364007).forms(at.x, at.p))
    assert form.angle == pytest.approx(2.0, abs=1e-11)  # 12 digits of a and b
    # ten digits are printed; a and b are good to 5e-13 and |dd/d(a, b)| is of the order of 10
    assert abs(form.d - (-0.0097094451 + 0.6759016792j)) <= 1e-10
    assert form.supercritical
    assert form.attracting


def test_delayed_logistic_map_has_the_published_coefficient() -> None:
    form = found("NS", DELAYED.forms([0.5, 0.5], 2.0))
    assert abs(form.d - (-1.0 - 1.7320508075688785j)) <= 20 * EPS
    assert form.twist == pytest.approx(math.sqrt(3.0), rel=20 * EPS)
    assert (form.resonance.p, form.resonance.q, form.side) == (1, 6, 1)
    np.testing.assert_allclose(form.amplitude(1e-4), [0.01, 0.01], rtol=50 * EPS)
    assert math.isnan(form.radius(-1e-4))


@pytest.mark.parametrize(
    ("distance", "ratio"), [(2e-3, 0.99933), (5e-4, 0.99983), (1.25e-4, 0.99996)]
)
def test_simulated_circle_of_the_delayed_logistic_map_approaches_the_prediction(
    distance: float, ratio: float
) -> None:
    form = found("NS", DELAYED.forms([0.5, 0.5], 2.0))
    u, v = (form.circle(distance, 1)[0] + 0.5).tolist()
    rate, record = 2.0 + distance, []
    settle, keep = int(12.0 / distance), 20000  # the circle attracts by exp(-distance) per iterate
    for n in range(settle + keep):
        u, v = rate * u * (1.0 - v), u
        if n >= settle:
            record.append((u, v))
    orbit = np.array(record)
    half_width = np.ptp(orbit[:, 0]) / 2.0
    # published to five digits; the iterates leave gaps of 6e-4 rad or less: 1e-7 of the width
    assert abs(half_width / form.amplitude(distance)[0] - ratio) <= 1e-5
    z = (orbit - orbit.mean(axis=0)) @ form.p.conj()
    turns = np.diff(np.unwrap(np.angle(z)))
    t = (np.arange(len(turns)) + 0.5) / len(turns)
    bump = np.exp(-1.0 / (t * (1.0 - t)))  # weighted Birkhoff average: converges like no power
    measured = float(bump @ turns / bump.sum())
    # (7) leaves terms of order distance^2, with coefficients of order one
    assert abs(measured - form.turn(distance)) <= 3.0 * distance**2


def test_map_of_another_package_is_recovered_to_rounding() -> None:
    """z' = z exp(0.1 i) (1 + 1.123 p + (-6.789 - 0.456 i) |z|^2), tested there to 1e-2."""
    b = -6.789 - 0.456j

    def function(x: Any, p: Any) -> list[Any]:
        z, size = cmath.exp(0.1j), x[0] ** 2 + x[1] ** 2
        re, im = 1.0 + 1.123 * p + b.real * size, b.imag * size
        re, im = z.real * re - z.imag * im, z.real * im + z.imag * re
        return [re * x[0] - im * x[1], im * x[0] + re * x[1]]

    form = found("NS", nf.ExplicitMap(function, dimension=2).forms([0.0, 0.0], 0.0))
    # |q| = 1 is sqrt(2) of the unit of z, so that d is twice what was planted
    assert abs(form.d - 2.0 * b) <= 1e-13
    assert abs(form.kappa - 1.123) <= 1e-14
    assert form.amplitude(0.01)[0] == pytest.approx(math.sqrt(0.01123 / 6.789), rel=1e-14)
    assert form.warnings[0].startswith("|nu^1 - 1| = 0.1, near the strong resonance 0:1")


# Planted coefficients and both routes


@pytest.mark.parametrize("n", [2, 3, 4, 6])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_planted_normal_form_is_recovered_behind_a_nonlinear_change(n: int, seed: int) -> None:
    planted = Planted(n, seed=seed)
    form = found("NS", planted.forms())
    # rounding of a few hundred operations on numbers up to 10, divided by divisors above 0.3
    assert abs(form.multiplier - planted.nu) <= 1e-13
    assert abs(form.kappa - planted.kappa) <= 1e-11
    assert form.twist == pytest.approx(planted.d.imag / planted.d.real, abs=1e-10)
    radius = math.sqrt(0.7 * 1e-4 / 0.8)
    widths = radius * np.hypot(planted.change.linear[:, 0], planted.change.linear[:, 1])
    np.testing.assert_allclose(form.amplitude(1e-4), widths, rtol=1e-10)
    np.testing.assert_allclose(form.unfolding.drift, planted.change.shift, rtol=0, atol=1e-12)
    assert (form.side, form.supercritical, form.attracting) == (1, True, True)


@pytest.mark.parametrize(
    ("kappa", "d", "side"),
    [(0.7, -0.8 + 1j, 1), (-0.7, -0.8, -1), (0.7, 0.8, -1), (-0.7, 0.8 + 1j, 1)],
)
def test_circle_lies_on_the_side_where_its_equation_has_a_root(
    kappa: complex, d: complex, side: int
) -> None:
    form = found("NS", Planted(3, kappa=kappa, d=d).forms())
    assert (form.side, form.supercritical) == (side, d.real < 0.0)
    assert form.radius(side * 1e-4) > 0.0
    assert math.isnan(form.radius(-side * 1e-4))
    assert np.isnan(form.circle(-side * 1e-4)).all()


@pytest.mark.parametrize(("order", "power"), [(1, 1.0), (2, 1.5)])
@pytest.mark.parametrize("n", [2, 4])
def test_predicted_circle_approaches_the_true_one_with_its_order(
    n: int, order: int, power: float
) -> None:
    planted = Planted(n)
    form, errors = found("NS", planted.forms()), []
    for dp in (1e-6, 1e-8):
        back = [planted.change.hidden(y, dp) for y in form.circle(dp, 32, order=order)]
        radius = math.sqrt(0.7 * dp / 0.8)
        off = [max(abs(math.hypot(*x[:2]) - radius), *map(abs, x[2:]), 0.0) for x in back]
        errors.append(max(off))
    assert math.log10(errors[0] / errors[1]) / 2.0 == pytest.approx(power, abs=0.05)


def test_a_normal_form_costs_what_its_docstring_says() -> None:
    orders: list[int] = []

    class Counting(nf.MapForms):
        def derivative(self, *directions: np.ndarray) -> np.ndarray:
            orders.append(len(directions))
            return super().derivative(*directions)

    planted = Planted(5)
    form = found("NS", Counting(planted.map, np.zeros(5), 0.0))
    assert [orders.count(k) for k in (1, 2, 3)] == [5 + 1, 9 + 4, 4]
    assert form.d == found("NS", planted.forms()).d


def test_turn_on_the_circle_is_exact_for_a_planted_map() -> None:
    planted, dp = Planted(3), 1e-4
    form = found("NS", planted.forms())
    z = complex(math.sqrt(0.7 * dp / 0.8), 0.0)
    image = planted.nu * (1.0 + planted.kappa * dp + planted.d * abs(z) ** 2)
    assert form.turn(dp) == pytest.approx(cmath.phase(image), abs=dp**2)
    assert form.rotation_number(dp) == form.turn(dp) / (2.0 * math.pi)


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("seed", range(4))
def test_both_routes_agree_on_random_maps(n: int, seed: int) -> None:
    forms = random_map(n, 10 * n + seed)
    form, paper = found("NS", forms, unfolded=False), nf.centre_manifold(forms)
    assert isinstance(paper, nf.CentreManifold)
    # rounding of n^3 terms, through the conditions of the eigenvector, of H and of the two solves
    divisors = (
        np.linalg.inv(np.eye(n) - forms.A),
        np.linalg.inv(form.multiplier**2 * np.eye(n) - forms.A),
    )
    worst = max(float(np.linalg.norm(m)) for m in divisors) * float(np.linalg.cond(paper.H))
    size = float(np.linalg.norm(form.p)) * (n**1.5 + 3.0 * worst * n**2)
    assert abs(paper.f1 + form.d.real) <= EPS * size


def test_papers_route_has_no_need_of_a_complete_eigenbasis() -> None:
    forms = random_map(5, 7)
    T = np.random.default_rng(3).normal(size=(5, 5))
    core = np.zeros((5, 5))
    core[:2, :2] = [[math.cos(1.9), -math.sin(1.9)], [math.sin(1.9), math.cos(1.9)]]
    core[2:, 2:] = 0.4 * np.eye(3) + np.diag([1.0, 1.0], 1)  # one eigenvector, three multipliers
    defective = Tensors(T @ core @ np.linalg.inv(T), forms.B, forms.C)
    paper = nf.centre_manifold(defective)
    assert isinstance(paper, nf.CentreManifold)
    form = found("NS", defective, unfolded=False)
    assert paper.f1 == pytest.approx(-form.d.real, rel=1e-9)


def test_coefficient_of_the_founding_paper_as_printed_misses_a_planted_one() -> None:
    paper = nf.centre_manifold(Planted(2).forms())
    assert isinstance(paper, nf.CentreManifold)
    g20, g11, g02, g21 = paper.g20, paper.g11, paper.g02, paper.g21
    d = found("NS", Planted(2).forms()).d
    holds = f1_of(paper.multiplier, g20, g11, g02, g21)
    printed = holds + (
        (1.0 - 2.0 * paper.multiplier)
        * (paper.multiplier.conjugate() - paper.multiplier.conjugate() ** 2)
        / (2.0 * (1.0 - paper.multiplier))
        * g20
        * g11
    ).real  # fmt: skip
    assert abs(holds + d.real) <= 1e-12
    assert abs(printed + d.real) > 1e-2


def test_coefficient_of_the_full_map_is_twice_that_of_the_half_map() -> None:
    for nu in (cmath.exp(0.8j), cmath.exp(2.4j)):  # the second leaves the upper half plane
        half = Planted(4, nu).forms()
        d_half = found("NS", half).d
        full = found("NS", nf.Composition(half, half))
        turned = nu**2 if nu.real > 0.0 else (nu**2).conjugate()
        d_full = full.d if nu.real > 0.0 else full.d.conjugate()
        assert abs(full.multiplier - turned) <= 1e-13
        assert abs(d_full - 2.0 * d_half) <= 1e-10
        other = nf.ExplicitMap(Planted(4, nu).map.function, dimension=4, iterate=2)
        direct = found("NS", other.forms(np.zeros(4), 0.0))
        assert abs(direct.d - full.d) <= 1e-10
        assert full.side == direct.side == 1
