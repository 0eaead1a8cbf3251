"""Smooth closed curves as trigonometric polynomials through an odd number of nodes.

Method      u(phi) = sum over |k| <= K of c_k exp(2 pi i k phi),   phi in turns,  N = 2 K + 1     (1)
            shift:       (R_rho u)(phi) = u(phi + rho):  c_k -> c_k exp(2 pi i k rho)            (2)
            derivative:  u'(phi):                        c_k -> 2 pi i k c_k                     (3)
            tail:        the largest |c_k| with |k| > 3 K / 4, relative to the largest of all    (4)
            decay:       least squares line through ln |c_k|, k >= 1, as long as |c_k| is
                         above rounding                                                          (5)
            roughness:   |u''| / (2 pi |u'|) in the mean square: 1 for an ellipse passed evenly  (6)
Assumes     real curves; N odd, so that no harmonic is without its partner
Accuracy    rounding of the fast Fourier transform
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibroimpact._core.types import Complexes, Floats

ROUNDING_OF_LARGEST = 1e-14  # smaller coefficients, relative to the largest, are rounding
TAIL_FROM = 0.75  # (4)


def phases(count: int) -> Floats:
    """Nodes j / N, in turns, shape (N,)."""
    return np.arange(count) / count


def coefficients(values: Floats) -> Complexes:
    """Coefficients c_0 .. c_K of (1) along the first axis."""
    count = len(values)
    return np.asarray(np.fft.rfft(values, axis=0) / count, dtype=np.complex128)


def values_of(coefficients: Complexes, count: int) -> Floats:
    """Values at ``count`` nodes; harmonics that they do not carry are dropped."""
    kept = (count + 1) // 2
    return np.asarray(np.fft.irfft(coefficients[:kept] * count, count, axis=0), dtype=np.float64)


def _along(factors: Complexes, dims: int) -> Any:
    return factors.reshape((-1,) + (1,) * (dims - 1))


def shifted(values: Floats, rho: float) -> Floats:
    """Values (2) of the curve at phi + rho."""
    c = coefficients(values)
    turn = np.asarray(np.exp(2j * np.pi * rho * np.arange(len(c))), dtype=np.complex128)
    return values_of(np.asarray(c * _along(turn, c.ndim)), len(values))


def derivative(values: Floats) -> Floats:
    """Derivative (3) by phi in turns."""
    c = coefficients(values)
    factors = np.asarray(2j * np.pi * np.arange(len(c)), dtype=np.complex128)
    return values_of(np.asarray(c * _along(factors, c.ndim)), len(values))


def resampled(values: Floats, count: int) -> Floats:
    """Values of the curve at another number of nodes."""
    return values.copy() if count == len(values) else values_of(coefficients(values), count)


def at_phases(values: Floats, phi: Floats) -> Floats:
    """Values of the curve at any phases, shape (m, ...)."""
    c = coefficients(values)
    waves = np.exp(2j * np.pi * np.outer(phi, np.arange(len(c))))
    waves[:, 1:] *= 2.0
    return np.asarray(np.tensordot(waves, c, axes=1).real, dtype=np.float64)


def shift_matrix(count: int, rho: float) -> Floats:
    """Matrix of (2) on the nodes, shape (N, N)."""
    first = shifted(np.eye(1, count)[0], rho)  # u = 1 at node 0: its values are the first column
    nodes = np.arange(count)
    return np.asarray(first[(nodes[:, None] - nodes[None, :]) % count], dtype=np.float64)


def sizes_of_harmonics(values: Floats) -> Floats:
    """Largest |c_k| over the coordinates for k = 0 .. K."""
    return np.asarray(np.abs(coefficients(values)).reshape((len(values) + 1) // 2, -1).max(axis=1))


def tail(values: Floats) -> float:
    """Size (4) of the last quarter of the harmonics, relative to the largest with k >= 1."""
    c = sizes_of_harmonics(values)
    first = int(np.ceil(TAIL_FROM * (len(c) - 1)))
    largest = float(c[1:].max(initial=0.0))
    return float(c[max(first, 1) :].max(initial=0.0)) / largest if largest else 0.0


def harmonics_above(values: Floats, share: float) -> int:
    """Largest k with |c_k| above a share of the largest with k >= 1; 0 where there is none."""
    c = sizes_of_harmonics(values)
    c[0] = 0.0
    above = np.flatnonzero(c > share * c.max())
    return int(above[-1]) if above.size else 0


def decay(values: Floats) -> float:
    """Fall of ln |c_k| per harmonic (5); infinite for an ellipse."""
    c = sizes_of_harmonics(values)[1:]
    hull = np.maximum.accumulate(c[::-1])[::-1]  # symmetric curves lack every second harmonic
    seen = np.flatnonzero(hull > ROUNDING_OF_LARGEST * hull.max(initial=0.0)) if c.size else c
    if len(seen) < 3:
        return np.inf
    return -float(np.polyfit(seen, np.log(hull[seen]), 1)[0])


def roughness(values: Floats) -> float:
    """Ratio (6)."""
    c = coefficients(values).reshape((len(values) + 1) // 2, -1)
    k = np.arange(len(c))[:, None]
    first, second = (float(np.sum((k**power * np.abs(c)) ** 2)) for power in (1, 2))
    return float(np.sqrt(second / first)) if first else np.inf
