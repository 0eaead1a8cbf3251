"""Terms of a map on its centre manifold: second-order terms, and coefficients with their sizes.

Method      second-order terms h of the centre manifold, of a monomial with the factor mu:
                (mu I - A) h = r              where mu is no multiplier,                     (1)
                (mu I - A) h = r - <p, r> q,  <p, h> = 0   where mu is the one of q and p    (2)
            a pair q, p at nu, with h20 for z^2 (mu = nu^2) and h11 for |z|^2 (mu = 1):
                x = x0 + 2 Re(q z) + Re(h20 z^2) + h11 |z|^2 + ...,                          (3)
                <p, C(q, q, conj q) + 2 B(q, h11) + B(conj q, h20)> / 2   of z |z|^2         (4)
Assumes     what stands next to (1) and (2)
Accuracy    rounding times |p|, and the conditions of (1) and of (2) bordered by q and p
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 5.4 and 9.5
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.forms import Multilinear


@dataclass(frozen=True)
class Sized:
    """A coefficient and the size of the terms whose sum it is."""

    value: complex
    scale: float


def sized(p: Complexes | Floats, divisor: float, *terms: Complexes | Floats) -> Sized:
    """Return <p, sum of the terms> / divisor with its scale."""
    scale = float(np.linalg.norm(p)) * sum(float(np.linalg.norm(term)) for term in terms)
    return Sized(complex(np.vdot(p, sum(terms))) / divisor, scale / divisor)


def off(A: Floats, mu: complex, right: Complexes | Floats) -> NDArray[Any]:
    """The solution of (1), real where all of its parts are."""
    return np.asarray(np.linalg.solve(mu * np.eye(len(A)) - A, right))


def along(
    A: Floats,
    mu: complex,
    q: Complexes | Floats,
    p: Complexes | Floats,
    right: Complexes | Floats,
) -> NDArray[Any]:
    """The solution of (2), real where all of its parts are."""
    shifted, row = mu * np.eye(len(A)) - A, p.conj()[None, :]
    bordered = np.block([[shifted, q[:, None]], [row, np.zeros((1, 1))]])
    return np.asarray(np.linalg.solve(bordered, np.append(right, 0.0))[:-1])


def pair_alone(
    at: Multilinear, A: Floats, nu: complex, q: Complexes, p: Complexes
) -> tuple[Complexes, Floats, Sized]:
    """Return h20, h11 and (4) where neither nu^2 nor 1 is a multiplier."""
    h20, h11 = off(A, nu**2, at(q, q)), off(A, 1.0, at(q, q.conj()).real)
    return h20, h11, cubic_alone(at, q, p, h20, h11)


def cubic_alone(
    at: Multilinear, q: Complexes, p: Complexes, h20: Complexes, h11: Complexes | Floats
) -> Sized:
    """Return (4)."""
    bar = q.conj()
    return sized(p, 2.0, at(q, q, bar), 2.0 * at(q, h11), at(bar, h20))


def on_pair_manifold(z: Complexes, q: Complexes, h20: Complexes, h11: Floats) -> Floats:
    """Points (3) at z, shape (n,), as displacements from x0, shape (n, dimension)."""
    quadratic = np.real(np.outer(z**2, h20)) + np.outer(np.abs(z) ** 2, h11)
    return np.asarray(2.0 * np.real(np.outer(z, q)) + quadratic, np.float64)
