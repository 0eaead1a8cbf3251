"""Eigenvalues of pencils A - lambda B, by the QZ algorithm.

LAPACK is called at once: of small matrices scipy's own functions take longer for their checks.
"""

from __future__ import annotations

from collections.abc import Callable

from vibroimpact._core.types import Complexes, Flags, Floats

Choice = Callable[[Complexes, Floats], Flags]  # which of the eigenvalues alpha / beta come first


def eigenvalues(a: Floats, b: Floats) -> tuple[Complexes, Floats]:
    """(alpha, beta): eigenvalues alpha / beta of finite matrices; infinite ones have beta = 0."""
    from scipy.linalg.lapack import dggev

    real, imaginary, beta, *_ = dggev(a, b, compute_vl=0, compute_vr=0)
    return real + 1j * imaginary, beta


def ordered(a: Floats, b: Floats, chosen: Choice) -> tuple[Floats, Floats, Floats]:
    """(S, T, Z): Q' A Z = S and Q' B Z = T triangular, but for pairs in S, with those chosen first."""
    from scipy.linalg.lapack import dgges, dtgsen

    s, t, _, real, imaginary, beta, q, z, *_ = dgges(_unsorted, a, b)
    n = len(a)
    select = chosen(real + 1j * imaginary, beta)
    s, t, *_, q, z, _, _, _, _, _ = dtgsen(select, s, t, q, z, ijob=0, lwork=4 * n + 16, liwork=1)
    return s, t, z


def _unsorted(_value: complex) -> None:
    """Nothing: the order is made afterwards."""
