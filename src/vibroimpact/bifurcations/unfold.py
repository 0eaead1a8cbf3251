"""Centre manifold of a critical pair over the plane of two parameters, in the unknowns of the equations.

Method      L(nu) v = 0,  w* L(nu) = 0,  z_a = -F_z^-1 F_a
            dnu/da = w* (d F_z v / da) / (w* E v),  d along the solutions                        (1)
            v is scaled so that its part in the map's own coordinates is the eigenvector q of the normal form,
            |q| = 1. With F_zz by jets, the motion of complex coordinate zeta is
                z + z_a da + 2 Re(v zeta) + Re(h20 zeta^2) + h11 |zeta|^2 + O(3),                (2)
                L(nu^2) h20 = -F_zz v v,   L(1) h11 = -F_zz v conj(v)                            (3)
            and after j iterates zeta is multiplied by nu^j, to leading order.
Assumes     nu simple, 1 no multiplier. Where nu^2 is one, at R3, that part of h20 is left out, which the term
            conj(zeta)^2 of the normal form takes instead
Accuracy    rounding times the conditions of these
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4, for the equations instead of the map
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.equations import Equations, Pair

SINGULAR_RELATIVE = 1e-6  # a smaller singular value of (3) belongs to a multiplier nu^2


@dataclass(frozen=True)
class Centre:
    """Centre manifold (2) at a point of the plane."""

    # the solution
    equations: Equations
    z: Floats
    a: Pair
    nu: complex  # the critical multiplier, in the upper half plane
    # changes of the unknowns, shape (d,)
    v: Complexes
    h20: Complexes
    h11: Floats
    drift: Floats  # z_a, shape (d, 2)
    slopes: Complexes  # dnu/da, shape (2,)

    def offset(self, change: complex) -> Floats:
        """Change da of both parameters that changes log nu by so much, to first order."""
        rates = self.slopes / self.nu
        matrix = np.array([rates.real, rates.imag])
        da: Floats = np.linalg.solve(matrix, np.array([change.real, change.imag]))
        return da

    def at(self, da: Floats) -> Pair:
        """Values of both parameters after a change."""
        return self.a[0] + float(da[0]), self.a[1] + float(da[1])

    def moved(self, zeta: Complexes, da: Floats) -> Floats:
        """Changes (2) of the unknowns for each of some coordinates zeta, shape (len(zeta), d)."""
        linear = 2.0 * np.outer(zeta, self.v).real
        square = np.outer(zeta**2, self.h20).real + np.outer(np.abs(zeta) ** 2, self.h11)
        changes: Floats = linear + square + self.drift @ da
        return changes


def centre(equations: Equations, z: Floats, a: Pair, near: complex) -> Centre:
    """Centre manifold of the multiplier nearest to a number."""
    by_z, by_a = equations.by_both(z, a)
    mu = equations.multipliers(z, a)
    nu = complex(mu[np.argmin(np.abs(mu - near))])
    scaling = equations.sizes / equations.rows[:, None]
    closing = equations.closing * scaling

    def shifted(multiplier: complex) -> Complexes:
        matrix: Complexes = by_z * scaling - (multiplier - 1.0) * closing
        return matrix

    left, _, right = np.linalg.svd(shifted(nu))
    v, w = right[-1].conj() * equations.sizes, left[:, -1] / equations.rows
    q = equations.on_section(v)
    largest = q[np.argmax(np.abs(q))]
    v = v * (abs(largest) / largest / np.linalg.norm(q))
    moves = np.linalg.solve(by_z * scaling, -by_a / equations.rows[:, None])
    drift = np.asarray(moves, dtype=float) * equations.sizes[:, None]
    real, imaginary = equations.second(z, a, np.array([v.real, v.imag]))
    second = real + 1j * imaginary
    by_v, d = second[:, : len(z)], len(z)
    slopes = w.conj() @ (by_v @ drift + second[:, d:]) / (w.conj() @ equations.closing @ v)  # (1)

    def solved(multiplier: complex, square: Complexes) -> Complexes:
        unknown = np.linalg.lstsq(shifted(multiplier), -square / equations.rows, SINGULAR_RELATIVE)[
            0
        ]
        return np.asarray(unknown, dtype=np.complex128) * equations.sizes

    h20 = solved(nu**2, by_v @ v)
    h11 = solved(1.0, by_v @ v.conj()).real  # (3)
    return Centre(equations, z, a, nu, v, h20, h11, drift, slopes)
