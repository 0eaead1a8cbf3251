"""Chebyshev expansions of functions on an interval, and all their real zeros.

The kernel separates the zeros of the polynomial (src/bindings/numeric/chebyshev.hpp), so that none between two
samples is lost. References: Boyd, Solving Transcendental Equations (2014), ch. 2-3; Trefethen, Approximation Theory and
Approximation Practice (2013).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from vibroimpact._core.types import Floats, Integers
from vibroimpact._kernel import zeros_of_series

# The last coefficients of a resolved expansion are smaller, relative to the largest.
RESOLVED_OF_LARGEST = 1e-10


@lru_cache(maxsize=8)
def nodes(count: int) -> Floats:
    """The Chebyshev points of [-1, 1], from right to left; they cannot be written."""
    points: Floats = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    points.flags.writeable = False
    return points


@lru_cache(maxsize=8)
def _to_coefficients(count: int) -> Floats:
    weights = np.full((count, 1), 2.0 / count)
    weights[0] = 1.0 / count
    return weights * chebyshev.chebvander(nodes(count), count - 1).T


def fitted(values: Floats) -> Floats:
    """Chebyshev coefficients of the polynomial with these values at :func:`nodes`, axis 0."""
    return _to_coefficients(len(values)) @ values


def real_zeros(coefficients: Floats) -> Floats:
    """Zeros in [-1, 1] (and 1e-6 beyond) of a Chebyshev series, as they come out of rounding, in order.

    A pair that has left the real line by less than 1e-5, which a double zero does, is returned twice, at its real
    part.
    """
    return np.sort(real_zeros_of(np.reshape(coefficients, (-1, 1)))[1])


def real_zeros_of(
    coefficients: Floats, rounding: float = float(np.finfo(float).eps)
) -> tuple[Integers, Floats]:
    """Zeros in [-1, 1] (and 1e-6 beyond) of many Chebyshev series at once.

    Coefficients after the last one that is above rounding of the largest are left out: zeros move
    as little as by rounding of the values.

    Parameters
    ----------
    coefficients
        One series a column, shape (k, m).
    rounding
        Size below which coefficients are left out, relative to the largest.

    Returns
    -------
    (numbers of the series, zeros), each of shape (z,)
    """
    return zeros_of_series(np.ascontiguousarray(coefficients.T), rounding)
