"""Zeros of Chebyshev series against planted ones."""

from __future__ import annotations

import numpy as np
import pytest

from vibroimpact._core.chebyshev import real_zeros, real_zeros_of


def test_zeros_of_many_series_are_the_planted_ones_whatever_the_rounding_above_their_degree():
    rng = np.random.default_rng(5)
    planted = [np.sort(rng.uniform(-0.99, 0.99, degree)) for degree in (0, 1, 2, 5, 1, 8)]
    series = np.zeros((25, len(planted)))
    for column, zeros in zip(series.T, planted, strict=True):
        column[: len(zeros) + 1] = np.polynomial.chebyshev.chebfromroots(zeros)
        column += 1e-17 * rng.normal(size=25) * np.abs(column).max()
    numbers, found = real_zeros_of(series)
    for k, zeros in enumerate(planted):
        # rounding of the values over the smallest slope between eight zeros, some 1e-5
        np.testing.assert_allclose(np.sort(found[numbers == k]), zeros, atol=1e-10)


@pytest.mark.parametrize("order", [1, 2, 7, 24])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_series_that_touches_zero_at_an_end_keeps_its_zeros(order: int, sign: float) -> None:
    """T_k + sign is zero at an end of the interval; with a bit less of the sign, next to it."""
    for first in (sign, sign * (1.0 - 1e-9), sign * (1.0 + 1e-13)):
        series = np.zeros(25)
        series[0], series[order] = first, 1.0
        angles = np.arccos(np.clip(-first, -1.0, 1.0)) + 2.0 * np.pi * np.arange(order + 1)
        planted = np.cos(np.concatenate([angles, 2.0 * np.pi * (order + 1) - angles]) / order)
        found = real_zeros(series)
        # a double zero has half of the digits
        assert max(np.abs(found - x).min() for x in planted) < 1e-4
    series[0] = 1.2 * sign
    assert not real_zeros(series).size
