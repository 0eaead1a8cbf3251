"""First Lyapunov coefficient by the method of the paper: eigenbasis, centre-manifold graph, (39).

Method      X = H Y, H = (Re k1, -Im k1, basis of the other invariant subspace)             (33)
            Y' = F(Y), z = y1 + i y2, w = (y3, ..., yn) on the centre manifold
                w = w20 z^2 / 2 + w11 z conj(z) + w02 conj(z)^2 / 2                    (A8)-(A10)
            z' = lambda z + sum g_ij z^i conj(z)^j / (i! j!),                     (35), (A1)-(A7)
            f1 = Re((1 - 2 lambda) conj(lambda)^2 g20 g11 / (2 (1 - lambda))) + |g11|^2 / 2
                 + |g02|^2 / 4 - Re(conj(lambda) g21) / 2,   radius |lambda| r - f1 r^3      (39)
Assumes     as neimark_sacker.py, whose basis-free formula this one checks: only the eigenvectors of
            the pair and the multilinear forms are shared
Accuracy    rounding times the condition of H
Scaling     k1 = 2 q with |q| = 1, so that X = 2 Re(q z) + ...: then f1 = -Re(d)
Corrected   (39) has conj(lambda) squared; (A6), (A7) second derivatives throughout, and + in the
            imaginary part of (A7); (A10) has +2 i. The printed forms fail on maps whose normal form
            is known (tests)
Notation    B here is the block of H^-1 A H in the other coordinates, as in (A8); they may be any
            basis of that subspace, because (A4) is a sum over it: the orthonormal complement of p
            serves also where the paper's eigenvectors k3, k4 do not exist
Reference   the founding paper, section 4 and appendix (equation numbers are its own)
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.codimension_one import NS
from vibroimpact.normal_forms.critical import Critical, Refusal, critical_multiplier
from vibroimpact.normal_forms.forms import Forms, jacobian


@dataclass(frozen=True, eq=False)
class CentreManifold:
    """Reduction of a map to its centre manifold, in the notation of the paper.

    Attributes
    ----------
    multiplier
        lambda_0, in the upper half plane.
    H
        Eigenbasis (33), shape (dimension, dimension).
    g20, g11, g02, g21
        Coefficients of (35).
    w20, w11
        Second-order terms of the graph, shape (dimension - 2,).
    f1
        (39): f1 > 0 attracts. Equals -Re(d).
    """

    multiplier: complex
    H: Floats = field(repr=False)
    g20: complex
    g11: complex
    g02: complex
    g21: complex
    w20: Complexes = field(repr=False)
    w11: Floats = field(repr=False)
    f1: float


def eigenbasis(critical: Critical) -> Floats:
    """Return H of (33) with k1 = 2 q; its other columns span the complement of p."""
    from scipy.linalg import null_space

    k1 = 2.0 * critical.q
    plane = np.vstack([critical.p.real, critical.p.imag])
    return np.column_stack([k1.real, -k1.imag, null_space(plane)])


def centre_manifold(forms: Forms) -> CentreManifold | Refusal:
    """Compute f1 by the paper's method.

    Parameters
    ----------
    forms
        Forms of the map at its fixed point.

    Returns
    -------
    CentreManifold or Refusal
        Refused where no simple pair is critical or another multiplier is.

    Notes
    -----
    Cost: d first, 3 + 2 (d - 2) second and 4 third derivatives.
    """
    A = jacobian(forms)
    critical = critical_multiplier(NS, A)
    if isinstance(critical, Refusal):
        return critical
    lam, H = critical.on_circle, eigenbasis(critical)
    second, third = _partials(forms, H)
    rest = np.asarray(np.linalg.solve(H, A @ H)[2:, 2:], np.float64)
    w20, w11 = _graph(lam, rest, second)
    plane = second[0] + 1j * second[1]  # F1 + i F2
    g20, g11, g02 = _dzz(plane), _dzc(plane), _dcc(plane)
    G10 = (plane[0, 2:] - 1j * plane[1, 2:]) / 2.0  # (A6)
    G01 = (plane[0, 2:] + 1j * plane[1, 2:]) / 2.0  # (A7)
    g21 = _G21(third) + complex(2.0 * G10 @ w11 + G01 @ w20)  # (A4)
    return CentreManifold(lam, H, g20, g11, g02, g21, w20, w11, f1_of(lam, g20, g11, g02, g21))


def f1_of(lam: complex, g20: complex, g11: complex, g02: complex, g21: complex) -> float:
    """Return f1 (39) of the planar map (38)."""
    bar = lam.conjugate()
    first = (1.0 - 2.0 * lam) * bar**2 / (2.0 * (1.0 - lam)) * g20 * g11
    return first.real + abs(g11) ** 2 / 2.0 + abs(g02) ** 2 / 4.0 - (bar * g21).real / 2.0


def _partials(forms: Forms, H: Floats) -> tuple[Floats, Floats]:
    """Second partial derivatives (F_k, i, j), i <= 2, and third (F_1 or 2, number of y2)."""
    n, y = len(H), H.T
    second = np.zeros((n, 2, n))
    for i in range(2):
        for j in range(i, n):
            second[:, i, j] = np.linalg.solve(H, forms.derivative(y[i], y[j]))
    second[:, 1, 0] = second[:, 0, 1]
    triples = [(0, 0, 0), (0, 0, 1), (0, 1, 1), (1, 1, 1)]
    images = [forms.derivative(y[i], y[j], y[k]) for i, j, k in triples]
    third = np.asarray(np.linalg.solve(H, np.column_stack(images)), np.float64)
    return second, third[:2]


def _graph(lam: complex, rest: Floats, second: Floats) -> tuple[Complexes, Floats]:
    """(w20, w11) of the centre manifold."""
    H11, H02 = _dzc(second[2:]).real, _dcc(second[2:])  # (A9), (A10)
    identity = np.eye(len(rest))
    w11 = np.asarray(np.linalg.solve(identity - rest, H11), np.float64)  # (A8)
    w20 = np.linalg.solve(lam.conjugate() ** 2 * identity - rest, H02).conj()
    return np.asarray(w20, np.complex128), w11


# Derivatives by z and conj(z), with d/dz = (d/dy1 - i d/dy2) / 2, of functions given by their
# partial derivatives f[..., i, j].
def _dzz(f: Any) -> Any:
    """(A3)."""
    return (f[..., 0, 0] - f[..., 1, 1] - 2j * f[..., 0, 1]) / 4.0


def _dzc(f: Any) -> Any:
    """(A1), (A9)."""
    return (f[..., 0, 0] + f[..., 1, 1]) / 4.0


def _dcc(f: Any) -> Any:
    """(A2), (A10)."""
    return (f[..., 0, 0] - f[..., 1, 1] + 2j * f[..., 0, 1]) / 4.0


def _G21(third: Floats) -> complex:
    """(A5), from the derivatives by y1 y1 y1, y1 y1 y2, y1 y2 y2, y2 y2 y2."""
    f = third[0] + 1j * third[1]
    return complex(f[0] + f[2] - 1j * (f[1] + f[3])) / 8.0
