"""Coefficients at the resonances 1:2 and 1:3: published and planted."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from support.planted import Change

import vibroimpact.normal_forms as nf
from vibroimpact._core.errors import InvalidParameterError

CUBE_ROOT = cmath.exp(2j * math.pi / 3.0)


def henon_at(a: float, b: float, guess: float) -> nf.MapForms:
    """Generalised Henon map x' = y, y' = a - b x - y^2 - x y / 10 at its fixed point."""
    ghm = nf.ExplicitMap(
        lambda x, a: (x[1], a - b * x[0] - x[1] ** 2 - 0.1 * x[0] * x[1]), dimension=2
    )
    at = ghm.fixed_point([guess, guess], a)
    assert at.converged
    return ghm.forms(at.x, a)


def test_resonance_1_2_of_the_generalised_map_has_the_published_coefficients() -> None:
    form = nf.strong_resonance("R2", henon_at(2.811791383220, 0.904761904762, 0.9))
    assert isinstance(form, nf.OneToTwo)
    # 12 printed digits of a and b
    np.testing.assert_allclose(form.scaled, (-0.9, -0.0275), rtol=0.0, atol=1e-11)


def test_resonance_1_3_of_the_generalised_map_has_the_published_coefficients() -> None:
    form = nf.strong_resonance("R3", henon_at(1.179138321995, 0.952380952381, 0.5))
    assert isinstance(form, nf.OneToThree)
    assert abs(form.b) == pytest.approx(0.3894440482, abs=1e-10)
    assert abs(form.scaled - (-0.0201465201 - 0.6630011333j)) <= 1e-10


@pytest.mark.parametrize("n", [2, 3, 5])
def test_planted_resonance_1_2_is_recovered_behind_a_change_of_coordinates(n: int) -> None:
    change = Change(n, seed=n)

    def normal(x: Any, _: Any) -> Any:
        cubic = 1.3 * x[0] ** 3 - 0.7 * x[0] ** 2 * x[1]
        return np.array([x[1] - x[0], cubic - x[1], *(0.4 * x[2:])])

    form = nf.strong_resonance("R2", change.map(normal).forms(np.zeros(n), 0.0))
    assert isinstance(form, nf.OneToTwo)
    scale = float(change.linear[:, 0] @ change.linear[:, 0])  # |q0| = 1
    np.testing.assert_allclose([form.c * scale, form.d * scale], [1.3, -0.7], rtol=1e-10)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_planted_resonance_1_3_is_recovered_behind_a_change_of_coordinates(n: int) -> None:
    change, b, c = Change(n, seed=n), 0.8 - 0.3j, -0.9 + 0.4j

    def normal(x: Any, _: Any) -> Any:
        def times(w: complex, re: Any, im: Any) -> Any:
            return np.array([w.real * re - w.imag * im, w.real * im + w.imag * re])

        linear, square = times(CUBE_ROOT, x[0], x[1]), x[0] ** 2 - x[1] ** 2
        cubic = (x[0] ** 2 + x[1] ** 2) * times(c, x[0], x[1])
        plane = linear + times(b, square, -2.0 * x[0] * x[1]) + cubic
        return np.array([*plane, *(0.4 * x[2:])])

    form = nf.strong_resonance("R3", change.map(normal).forms(np.zeros(n), 0.0))
    assert isinstance(form, nf.OneToThree)
    expected = (CUBE_ROOT.conjugate() * c / abs(b) ** 2 - 1.0) / 3.0
    assert form.scaled.real == pytest.approx(expected.real, abs=1e-10)  # the invariant part
    size = float(np.linalg.norm(change.linear[:, :2] @ [1.0, -1j])) / 2.0  # z = 1 is 2 Re(q size)
    assert abs(form.b) * size == pytest.approx(abs(b), rel=1e-10)


def test_other_multipliers_and_kinds_are_refused() -> None:
    forms = henon_at(1.179138321995, 0.952380952381, 0.5)
    refused = nf.strong_resonance("R2", forms)
    assert isinstance(refused, nf.Refusal)
    assert refused.status is nf.Status.NOT_CRITICAL
    refused = nf.strong_resonance("R3", henon_at(0.95, 0.96, 0.4))
    assert isinstance(refused, nf.Refusal)
    assert refused.status is nf.Status.NOT_CRITICAL
    triple = nf.ExplicitMap(lambda x, p: (x[1] - x[0], -x[1], p - x[2]), dimension=3)
    assert isinstance(nf.strong_resonance("R2", triple.forms(np.zeros(3), 0.0)), nf.Refusal)
    with pytest.raises(InvalidParameterError, match='must be "R2" or "R3"'):
        nf.strong_resonance("R5", forms)
