"""Normal forms refused, and resonances warned of."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from support.planted import Planted, found, random_map

import vibroimpact.normal_forms as nf
from vibroimpact._core.errors import InvalidParameterError

EPS = 2.0**-52


def refusal(kind: str, function: Any, dimension: int, p: float = 0.0) -> nf.Refusal:
    forms = nf.ExplicitMap(function, dimension=dimension).forms(np.zeros(dimension), p)
    form = nf.normal_form(kind, forms)
    assert isinstance(form, nf.Refusal)
    assert form.kind == kind
    return form


@pytest.mark.parametrize("q", [1, 2, 3, 4])
def test_strong_resonance_is_refused(q: int) -> None:
    x = {1: -1.0, 2: 1.0, 3: 0.5, 4: 0.0}[q]  # trace -2 x, determinant 1
    a = x + x + x**2
    at = nf.ExplicitMap(lambda z, b: (z[1], a - b * z[0] - z[1] ** 2), dimension=2)
    form = nf.normal_form("NS", at.forms([x, x], 1.0))
    assert isinstance(form, nf.Refusal)
    assert form.status is nf.Status.STRONG_RESONANCE
    assert f":{q}" in form.reason


def test_area_preserving_map_has_no_deciding_coefficient() -> None:
    x = math.sqrt(3.0) - 1.0
    at = nf.ExplicitMap(lambda z, b: (z[1], 2.0 - b * z[0] - z[1] ** 2), dimension=2)
    form = nf.normal_form("NS", at.forms([x, x], 1.0))
    assert isinstance(form, nf.Refusal)
    assert form.status is nf.Status.DEGENERATE
    assert abs(form.critical.d.real) <= 100 * EPS
    assert abs(form.critical.angle - 2.39212378817231) <= 1e-14


def test_a_map_without_derivatives_is_refused() -> None:
    broken = refusal("PD", lambda x, p: [np.sqrt(x[0]) + p], 1)
    assert broken.status is nf.Status.NOT_SMOOTH
    half = refusal("PD", lambda x, p: [-x[0] + x[0] ** 2 * np.sqrt(x[0]) + p], 1)
    assert half.status is nf.Status.NOT_SMOOTH


def test_a_pair_off_the_circle_is_refused_with_its_distance() -> None:
    form = refusal("NS", lambda x, _: (0.5 * x[1], -0.5 * x[0]), 2)
    assert form.status is nf.Status.NOT_CRITICAL
    assert "off by 0.5" in form.reason
    assert refusal("NS", lambda x, _: (0.5 * x[0], 0.4 * x[1]), 2).status is form.status
    assert refusal("PD", lambda x, _: [0.5 * x[0]], 1).status is form.status
    assert refusal("SN", lambda x, _: [0.5 * x[0]], 1).status is form.status


def test_other_critical_multipliers_are_refused_and_named() -> None:
    z = cmath.exp(2.0j)
    form = refusal(
        "NS", lambda x, _: (z.real * x[0] - z.imag * x[1], z.imag * x[0] + z.real * x[1], -x[2]), 3
    )
    assert form.status is nf.Status.OTHERS_CRITICAL
    assert "-1" in form.reason
    assert refusal("PD", lambda x, p: (-x[0], x[1] + p), 2).status is form.status
    assert refusal("PD", lambda x, _: (-x[0], x[0] - x[1]), 2).status is form.status


def test_a_parameter_that_does_not_move_the_multiplier_is_refused_with_what_holds() -> None:
    form = refusal("PD", lambda x, p: [-x[0] + x[0] ** 3 + p**2 * x[0]], 1)
    assert form.status is nf.Status.NOT_TRANSVERSAL
    assert form.critical.c == 1.0
    turned = Planted(3, kappa=0.4j)
    ns = nf.normal_form("NS", turned.forms())
    assert isinstance(ns, nf.Refusal)
    assert ns.status is nf.Status.NOT_TRANSVERSAL
    assert ns.critical.twist == pytest.approx(-0.5 / 0.8, abs=1e-10)
    branch_point = refusal("SN", lambda x, p: [x[0] + p * x[0] - x[0] ** 2], 1)
    assert branch_point.status is nf.Status.NOT_TRANSVERSAL


def test_what_is_no_simple_branch_point_is_refused() -> None:
    fold = refusal("BP", lambda x, p: [x[0] + p - x[0] ** 2], 1)
    assert fold.status is nf.Status.NOT_CRITICAL
    assert "a fold" in fold.reason
    isolated = refusal("BP", lambda x, p: [x[0] + x[0] ** 2 + p**2], 1)
    assert isolated.status is nf.Status.NOT_TRANSVERSAL
    quintic = refusal("BP", lambda x, p: [x[0] + p * x[0] + x[0] ** 5], 1)
    assert quintic.status is nf.Status.DEGENERATE
    away = refusal("BP", lambda x, p: [0.7 * x[0] + p], 1)
    assert away.status is nf.Status.NOT_CRITICAL
    assert refusal("BP", lambda x, p: [-0.7 * x[0] + p], 1).status is away.status


def test_without_the_parameter_only_the_coefficient_is_there() -> None:
    forms = random_map(3, 1)
    form = found("NS", forms, unfolded=False)
    assert form.d.real != 0.0
    with pytest.raises(InvalidParameterError, match="without the parameter"):
        form.radius(0.1)
    with pytest.raises(InvalidParameterError, match="kind = 'TR'"):
        nf.normal_form("TR", forms)
    crossing = nf.ExplicitMap(lambda x, p: [x[0] + p * x[0] - x[0] ** 2], dimension=1)
    with pytest.raises(InvalidParameterError, match="parameter = False"):
        nf.normal_form("BP", crossing.forms([0.0], 0.0), unfolded=False)
    with pytest.raises(InvalidParameterError, match="order = 3"):
        found("NS", Planted(2).forms()).circle(0.1, order=3)


def test_every_fraction_in_lowest_terms_is_listed_once() -> None:
    angle = 2.0 * math.pi * 0.3701
    listed = nf.resonances(angle)
    for r in listed:
        assert math.gcd(r.p, r.q) == 1
        assert angle - r.angle == pytest.approx(math.tau * r.p / r.q, abs=4 * EPS)
        assert r.distance == pytest.approx(abs(cmath.exp(1j * angle * r.q) - 1.0), abs=1e-13)
    assert (nf.nearest_resonance(angle).p, nf.nearest_resonance(angle).q) == (3, 8)
    assert nf.nearest_resonance(math.pi / 3.0).distance <= 12 * EPS


@pytest.mark.parametrize(("q", "angle"), [(1, 0.05), (2, 3.11), (3, 2.10), (4, 1.56)])
def test_near_a_strong_resonance_a_warning_says_why(q: int, angle: float) -> None:
    form = found("NS", Planted(2, cmath.exp(1j * angle)).forms())
    (sentence,) = form.warnings
    assert f"near the strong resonance {'0' if q == 1 else '1'}:{q}" in sentence
    assert "unreliable" in sentence
    far = found("NS", Planted(2, cmath.exp(1j * (angle + (0.2 if q != 2 else -0.2)))).forms())
    assert far.warnings == ()


@pytest.mark.parametrize("m", [2, 3])
def test_resonant_radius_is_where_the_removed_power_equals_z(m: int) -> None:
    nu = cmath.exp(2.1j if m == 2 else 1.6j)

    def function(x: Any, _: Any) -> list[Any]:
        re, im = x[0], -x[1]
        for _power in range(m - 1):
            re, im = re * x[0] + im * x[1], im * x[0] - re * x[1]
        re, im = x[0] + 3.0 * re, x[1] + 3.0 * im  # z + 3 conj(z)^m
        re, im = re - x[0] * (x[0] ** 2 + x[1] ** 2), im - x[1] * (x[0] ** 2 + x[1] ** 2)
        return [nu.real * re - nu.imag * im, nu.real * im + nu.imag * re]

    form = found("NS", nf.ExplicitMap(function, dimension=2).forms([0, 0], 0.0), unfolded=False)
    # removed by z -> z + 3 nu conj(z)^m / (nu - conj(nu)^m), and z = sqrt(2) of the normal form's
    expected = (abs(nu ** (m + 1) - 1.0) / 3.0) ** (1.0 / (m - 1)) / math.sqrt(2.0)
    assert form.resonant_radius == pytest.approx(expected, rel=1e-12)
