"""Linear systems that may be singular, and eigenvalues of matrices and of pencils A - lambda B, by the QZ algorithm.

LAPACK is called at once: of small matrices scipy's own functions take longer for their checks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes, Flags, Floats

Choice = Callable[[Complexes, Floats], Flags]  # which of the eigenvalues alpha / beta come first


def solved(matrices: Any, right: Any) -> Any:
    """Solutions of systems (..., n, n) with the right-hand sides (..., n, k); NaN where a matrix is singular.

    Iterates that run away, and folds, meet one; whether to the last bit depends on the machine's linear algebra.
    """
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        if matrices.ndim == 2:
            return np.full_like(right, math.nan)
        return np.array([solved(a, b) for a, b in zip(matrices, right, strict=True)])


def eigenvalues(a: Floats, b: Floats) -> tuple[Complexes, Floats]:
    """(alpha, beta): eigenvalues alpha / beta of finite matrices; infinite ones have beta = 0."""
    from scipy.linalg.lapack import dggev

    real, imaginary, beta, *_ = dggev(a, b, compute_vl=0, compute_vr=0)
    return real + 1j * imaginary, beta


class Deflating(NamedTuple):
    """Deflating subspaces of some eigenvalues: A Z = V S and B Z = V T with V' V = 1, and W' A, W' B, of rank k."""

    s: Floats  # shape (k, k)
    t: Floats
    right: Floats  # Z, shape (n, k)
    left: Floats  # W, shape (n, k)


def deflating(a: Floats, b: Floats, chosen: Choice) -> Deflating:
    """Right and left deflating subspaces of the eigenvalues that are chosen."""
    from scipy.linalg.lapack import dgges, dtgsen

    s, t, _, real, imaginary, beta, q, z, *_ = dgges(_unsorted, a, b)
    n = len(a)
    select = chosen(real + 1j * imaginary, beta)
    k, work = int(select.sum()), {"ijob": 0, "lwork": 4 * n + 16, "liwork": 1}
    s, t, *_, q, z, _, _, _, _, _ = dtgsen(select, s, t, q, z, **work)  # first
    last = dtgsen(np.arange(n) >= k, s, t, q, z, **work)[-7]
    return Deflating(s[:k, :k], t[:k, :k], z[:, :k], last[:, n - k :])


def vectors(a: Floats) -> tuple[Complexes, Complexes, Complexes]:
    """Eigenvalues of a finite matrix, left and right eigenvectors in columns, of length 1."""
    from scipy.linalg.lapack import dgeev

    real, imaginary, left, right, _ = dgeev(a)
    values = real + 1j * imaginary
    return values, _complex(imaginary, left), _complex(imaginary, right)


def _complex(imaginary: Floats, found: Floats) -> Complexes:
    """Vectors of LAPACK, in which two columns are those of a pair: the real and the imaginary part."""
    out = found.astype(np.complex128)
    for j in np.flatnonzero(imaginary > 0.0):
        out[:, j] += 1j * found[:, j + 1]
        out[:, j + 1] = out[:, j].conj()
    return out


def _unsorted(_value: complex) -> None:
    """Nothing: the order is made afterwards."""
