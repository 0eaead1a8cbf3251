"""Chebyshev expansions of functions on an interval, and all their real zeros.

The zeros of the polynomial are the eigenvalues of its colleague matrix, so none between two samples
is lost. References: Boyd, Solving Transcendental Equations (2014), ch. 2-3; Trefethen, Approximation
Theory and Approximation Practice (2013), ch. 18.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from vibroimpact._core.types import Floats, Integers

# The last coefficients of a resolved expansion are smaller, relative to the largest.
RESOLVED_OF_LARGEST = 1e-10
# Zeros that are so far outside the interval, relative to its length, are kept and polished.
EDGE_OF_INTERVAL = 1e-6
# It bounds |T_k|, k < 100, at such zeros, which may have left the real line by 1e-5.
CHEBYSHEV_BOUND = 1.1


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
    """Zeros in [-1, 1] (and EDGE_OF_INTERVAL beyond) of a Chebyshev series, as they come out of rounding.

    A pair that has left the real line by less than the square root of RESOLVED_OF_LARGEST, which a double
    zero does, is returned twice, at its real part.
    """
    return np.sort(real_zeros_of(np.reshape(coefficients, (-1, 1)))[1])


def real_zeros_of(
    coefficients: Floats, rounding: float = float(np.finfo(float).eps)
) -> tuple[Integers, Floats]:
    """Zeros in [-1, 1] (and EDGE_OF_INTERVAL beyond) of many Chebyshev series at once.

    Coefficients after the last one that is above rounding of the largest are left out: zeros move
    as little as by rounding of the values, and the eigenvalue problems are small. A series whose
    first coefficient outweighs the others has no zeros.

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
    size = np.abs(coefficients)
    kept = size > rounding * size.max(axis=0, initial=0.0)
    some = kept.any(axis=0) & (size[0] <= CHEBYSHEV_BOUND * size[1:].sum(axis=0))
    degrees = np.where(some, len(kept) - 1 - np.argmax(kept[::-1], axis=0), 0)
    numbers, zeros = [np.empty(0, dtype=np.int64)], [np.empty(0)]
    for degree in np.unique(degrees[degrees > 0]):
        these = np.flatnonzero(degrees == degree)
        found = np.linalg.eigvals(_colleagues(coefficients[: degree + 1, these]))
        near = (np.abs(found.imag) <= RESOLVED_OF_LARGEST**0.5) & (
            np.abs(found.real) <= 1.0 + EDGE_OF_INTERVAL
        )
        numbers.append(np.repeat(these, near.sum(axis=1)))
        zeros.append(found.real[near])
    return np.concatenate(numbers), np.concatenate(zeros)


def _colleagues(coefficients: Floats) -> Floats:
    """The colleague matrices of series of one degree k >= 1, shape (m, k, k).

    x T_0 = T_1 and x T_j = (T_(j-1) + T_(j+1)) / 2, T_k from the series; with T_0 scaled by
    sqrt(1/2) they are symmetric but for the last column. Upside down, as QR likes it.
    """
    degree, count = len(coefficients) - 1, coefficients.shape[1]
    beside, last = np.full(degree - 1, 0.5), np.full(degree, 0.5)
    beside[:1] = 0.5**0.5
    last[0] = 0.5**0.5 if degree > 1 else 1.0
    matrices = np.tile(np.diag(beside, 1) + np.diag(beside, -1), (count, 1, 1))
    matrices[:, :, -1] -= (coefficients[:-1] / coefficients[-1]).T * last
    return matrices[:, ::-1, ::-1]
