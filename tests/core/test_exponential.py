"""Exponentials of matrices against closed forms."""

from __future__ import annotations

import numpy as np

from vibroimpact._core.exponential import exponentials

TIMES = np.array([0.0, 1e-9, 0.3, 1.0, 2.0, 7.5, 40.0])
EPS = float(np.finfo(float).eps)


def test_an_oscillation_and_its_derivative_are_those_of_the_closed_form() -> None:
    """exp([[A, 0], [1, A]] t) has exp(A t) twice and t exp(A t) below, for A = -d + turning at w."""
    d, w = 0.05, 1.3
    turning = np.array([[-d, w], [-w, -d]])
    found = exponentials(np.block([[turning, np.zeros((2, 2))], [np.eye(2), turning]]), TIMES)
    for t, matrix in zip(TIMES, found, strict=True):
        c, s = np.exp(-d * t) * np.cos(w * t), np.exp(-d * t) * np.sin(w * t)
        known = np.array([[c, s], [-s, c]])
        # every squaring doubles the roundings of some entries
        allowed = 10.0 * EPS * (1.0 + t) ** 2
        np.testing.assert_allclose(matrix[:2, :2], known, rtol=0.0, atol=allowed)
        np.testing.assert_allclose(matrix[2:, 2:], known, rtol=0.0, atol=allowed)
        np.testing.assert_allclose(matrix[2:, :2], t * known, rtol=0.0, atol=allowed)
        assert not matrix[:2, 2:].any()


def test_a_decay_of_any_rate_keeps_its_digits() -> None:
    for rate in (1e-300, 1e-8, 1.0, 30.0):
        found = exponentials(np.array([[-rate]]), TIMES)[:, 0, 0]
        np.testing.assert_allclose(found, np.exp(-rate * TIMES), rtol=0.0, atol=4.0 * EPS)


def test_at_rest_nothing_changes_and_an_overflow_is_no_number() -> None:
    np.testing.assert_array_equal(
        exponentials(np.zeros((2, 2)), TIMES), np.tile(np.eye(2), (7, 1, 1))
    )
    assert np.isnan(exponentials(np.array([[np.inf]]), TIMES)).all()
