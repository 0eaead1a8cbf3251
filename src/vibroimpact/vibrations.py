"""Vibration modes of a reduced system: second-order blocks that move alone."""

from __future__ import annotations

from typing import NamedTuple

from vibroimpact import linear
from vibroimpact.linear import Matrix, Vector, product, transpose
from vibroimpact.rayleigh import Proportion
from vibroimpact.reduction import Reduced
from vibroimpact.scalars import ROUNDING, above, choose, greatest


class Vibrations(NamedTuple):
    """Vibration modes: Phi^T M Phi = 1, Phi^T K Phi = diag(k), Phi^T C Phi = diag(c)."""

    phi: Matrix
    k: Vector
    c: Vector


class NormalForm(NamedTuple):
    """A reduced system in xi = shape eta: unit masses, and no more coupled than it must be.

    ``lost`` are the couplings in stiffness and damping that are rounding.
    """

    shape: Matrix
    stiffness: Matrix
    damping: Matrix
    lost: tuple[float, float]

    def coupling(self, i: int) -> float:
        """Of coordinate i with others; not above zero where it moves alone."""
        matrices = zip((self.stiffness, self.damping), self.lost, strict=True)
        others = [j for j in range(len(self.shape)) if j != i]
        return greatest(abs(a[i][j]) - lost for a, lost in matrices for j in others)


def normal_form(r: Reduced) -> NormalForm:
    """By vectors that are those of the stiffness and of the damping, where these share them."""
    low = _lower(r)
    stiffness, damping = _normal(low, r.stiffness), _normal(low, r.damping)
    stiff, damp = linear.largest(stiffness), linear.largest(damping)
    mix = 0.7548776662466927 * stiff / damp if stiff and damp else 1.0  # any generic number
    vectors = linear.symmetric_eigenvectors(linear.plus(stiffness, damping, mix))
    terms = ROUNDING * len(vectors)
    return NormalForm(
        linear.solve_upper(low, vectors),
        product(transpose(vectors), product(stiffness, vectors)),
        product(transpose(vectors), product(damping, vectors)),
        (terms * stiff, terms * damp),
    )


def vibration_modes(r: Reduced, form: NormalForm) -> Vibrations | None:
    """The modes of a classically damped system; None if there are none."""
    if greatest(form.coupling(i) for i in range(len(form.shape))) > 0.0:
        return None
    return Vibrations(form.shape, *(diagonal(form.shape, a) for a in (r.stiffness, r.damping)))


def rayleigh_modes(r: Reduced, damping: Proportion) -> Vibrations:
    """The modes of a system with Rayleigh's damping."""
    low = _lower(r)
    phi = linear.solve_upper(low, linear.symmetric_eigenvectors(_normal(low, r.stiffness)))
    k = diagonal(phi, r.stiffness)
    return Vibrations(phi, k, [damping.damping_of(x) for x in k])


def _lower(r: Reduced) -> Matrix:
    low = linear.cholesky(r.mass)
    if low is None:
        raise ArithmeticError("reduced mass matrix is not positive definite")
    return low


def _normal(low: Matrix, a: Matrix) -> Matrix:
    """L^-1 A L^-T."""
    return transpose(linear.solve_lower(low, transpose(linear.solve_lower(low, a))))


def diagonal(phi: Matrix, a: Matrix) -> Vector:
    """Diagonal of Phi^T A Phi, entries below rounding set to zero."""
    inside = product(transpose(phi), product(a, phi))
    size = linear.largest(inside)
    values = [row[i] for i, row in enumerate(inside)]
    return [choose(above(abs(x), ROUNDING * size), x, 0.0) for x in values]
