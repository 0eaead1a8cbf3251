"""Exponentials of one matrix at many times.

Method      exp(A t) = exp(A t / 2^s)^(2^s), with s such that A t / 2^s has a norm of at most one: there the
            Taylor series of degree TERMS - 1 is exact to rounding. All times share the powers of A.
Accuracy    some roundings of the largest entry, times the norm of A t
Reference   Moler, Van Loan, Nineteen dubious ways (2003), method 3
"""

from __future__ import annotations

import numpy as np

from vibroimpact._core.types import Floats

TERMS = 19  # 1 / 19! is below rounding


def exponentials(matrix: Floats, times: Floats) -> Floats:
    """Exponentials of a matrix (n, n) at times >= 0 (k,), shape (k, n, n); NaN where entries have overflowed."""
    size = float(np.abs(matrix).sum(axis=0).max())
    if not np.isfinite(size):
        return np.full((len(times), *matrix.shape), np.nan)
    once = matrix / (size or 1.0)
    powers = np.empty((TERMS, *matrix.shape))
    powers[0] = np.eye(len(matrix))
    for j in range(1, TERMS):
        powers[j] = powers[j - 1] @ once / j
    halvings = np.maximum(np.frexp(size * times)[1], 0)
    part: Floats = np.ldexp(size * times, -halvings)
    # A row of weights at a time: products so small start no threads of a BLAS.
    weights = part[:, None, None] ** np.arange(float(TERMS))
    out: Floats = (weights @ powers.reshape(TERMS, -1)).reshape(-1, *matrix.shape)
    for doubled in range(int(halvings.max(initial=0))):
        some = halvings > doubled
        out[some] = out[some] @ out[some]
    return out
