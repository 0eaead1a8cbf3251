"""Exponentials of matrices at many times.

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
    """Exponentials of matrices (..., n, n) at times >= 0 (k,), shape (..., k, n, n); NaN where one has overflowed."""
    size = np.abs(matrix).sum(axis=-2).max(axis=-1)
    finite = np.isfinite(size)
    size = np.where(finite, size, 0.0)
    once = (
        np.where(finite[..., None, None], matrix, 0.0)
        / np.where(size > 0.0, size, 1.0)[..., None, None]
    )
    powers = np.empty((*size.shape, TERMS, *matrix.shape[-2:]))
    powers[..., 0, :, :] = np.eye(matrix.shape[-1])
    for j in range(1, TERMS):
        powers[..., j, :, :] = powers[..., j - 1, :, :] @ once / j
    norms = size[..., None] * times
    halvings = np.maximum(np.frexp(norms)[1], 0)
    # A row of weights at a time: products so small start no threads of a BLAS.
    weights = np.ldexp(norms, -halvings)[..., None, None] ** np.arange(float(TERMS))
    terms = powers.reshape(*size.shape, 1, TERMS, -1)
    out: Floats = (weights @ terms).reshape(*norms.shape, *matrix.shape[-2:])
    for doubled in range(int(halvings.max(initial=0))):
        some = halvings > doubled
        out[some] = out[some] @ out[some]
    out[~finite] = np.nan
    return out
