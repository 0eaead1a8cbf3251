"""Vibration modes of a reduced system: uncoupled second-order blocks."""

from __future__ import annotations

from typing import NamedTuple

from vibroimpact._core import linear
from vibroimpact._core.linear import Matrix, Vector, dot, product, transpose
from vibroimpact._core.scalars import ROUNDING_PER_TERM, cleared, greatest, square_root
from vibroimpact.compile.rayleigh import Proportion
from vibroimpact.compile.reduction import Reduced


class Vibrations(NamedTuple):
    """Vibration modes: Phi^T M Phi = 1, Phi^T K Phi = diag(k), Phi^T C Phi = diag(c)."""

    phi: Matrix
    k: Vector
    c: Vector


class NormalForm(NamedTuple):
    """Reduced system in xi = shape eta: unit masses, with as little coupling as possible.

    ``lost_stiffness`` and ``lost_damping`` are the rounding errors of the diagonals of the two
    matrices.
    """

    shape: Matrix
    stiffness: Matrix
    damping: Matrix
    lost_stiffness: Vector
    lost_damping: Vector

    def coupling(self, i: int, j: int) -> float:
        """Coupling of two coordinates; not above zero where it is rounding."""
        n = len(self.shape)
        both = (self.stiffness, self.lost_stiffness), (self.damping, self.lost_damping)
        return greatest(
            abs(a[i][j]) - square_root((n * lost[i]) * (n * lost[j])) for a, lost in both
        )

    def groups(self) -> list[list[int]]:
        """Groups of coupled coordinates."""
        out = list[list[int]]()
        for i in range(len(self.shape)):
            beside = [group for group in out if any(self.coupling(i, j) > 0.0 for j in group)]
            out = [group for group in out if group not in beside]
            out.append(sorted([*(j for group in beside for j in group), i]))
        return out


def unit_form(r: Reduced) -> NormalForm:
    """Unit masses in the coordinates given."""
    low = _lower(r)
    return _form(
        r, linear.solve_upper(low, linear.identity(len(low))),
        _normal(low, r.stiffness), _normal(low, r.damping),
    )  # fmt: skip


def normal_form(r: Reduced) -> NormalForm:
    """Normal form by common eigenvectors of stiffness and damping, where these exist."""
    low = _lower(r)
    stiffness, damping = _normal(low, r.stiffness), _normal(low, r.damping)
    stiff, damp = linear.largest(stiffness), linear.largest(damping)
    mix = 0.7548776662466927 * stiff / damp if stiff and damp else 1.0  # any generic number
    vectors = linear.symmetric_eigenvectors(linear.plus(stiffness, damping, mix))
    inside = (product(transpose(vectors), product(a, vectors)) for a in (stiffness, damping))
    return _form(r, linear.solve_upper(low, vectors), *inside)


def _form(r: Reduced, shape: Matrix, stiffness: Matrix, damping: Matrix) -> NormalForm:
    lost = (_lost(shape, a) for a in (r.stiffness, r.damping))
    return NormalForm(shape, stiffness, damping, *lost)


def alone(r: Reduced, form: NormalForm) -> tuple[Vector, Vector]:
    """Stiffness k and damping c of every coordinate, for those that are uncoupled."""
    return (
        _diagonal(form.shape, r.stiffness, form.lost_stiffness),
        _diagonal(form.shape, r.damping, form.lost_damping),
    )


def vibration_modes(r: Reduced, form: NormalForm) -> Vibrations | None:
    """Modes of a classically damped system; None where the damping is not classical."""
    n = len(form.shape)
    if greatest(form.coupling(i, j) for i in range(n) for j in range(i)) > 0.0:
        return None
    return Vibrations(form.shape, *alone(r, form))


def rayleigh_modes(r: Reduced, damping: Proportion) -> Vibrations:
    """Modes of a system with Rayleigh damping."""
    low = _lower(r)
    phi = linear.solve_upper(low, linear.symmetric_eigenvectors(_normal(low, r.stiffness)))
    k = _diagonal(phi, r.stiffness, _lost(phi, r.stiffness))
    return Vibrations(phi, k, [damping.damping_of(x) for x in k])


def _lower(r: Reduced) -> Matrix:
    return linear.lower_triangle(r.mass, "mass of the motions that closed contacts allow")


def _normal(low: Matrix, a: Matrix) -> Matrix:
    """L^-1 A L^-T."""
    return transpose(linear.solve_lower(low, transpose(linear.solve_lower(low, a))))


def _diagonal(phi: Matrix, a: Matrix, lost: Vector) -> Vector:
    """Diagonal of Phi^T A Phi, with entries below rounding set to zero."""
    inside = product(transpose(phi), product(a, phi))
    values = zip((row[i] for i, row in enumerate(inside)), lost, strict=True)
    return [cleared(x, least) for x, least in values]


def _lost(phi: Matrix, a: Matrix) -> Vector:
    """Rounding error of that diagonal, from the sizes of its terms."""
    sizes = linear.absolute(phi)
    terms = zip(transpose(sizes), transpose(product(linear.absolute(a), sizes)), strict=True)
    return [ROUNDING_PER_TERM * dot(x, y) for x, y in terms]
