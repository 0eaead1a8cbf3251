"""Derivatives of maps as multilinear forms, by central differences in high precision.

    D^k f [u_1, .., u_k] = (2 h)^-k  sum over signs  s_1 .. s_k f(z + h sum_j s_j u_j) + O(h^2)  (1)

With d digits carried, h = 10^(-d/5) leaves an error near 10^(-2d/5) in every order up to three:
truncation h^2, rounding 10^-d / h^3. Parameters are further coordinates of z.

Normal form of a Neimark-Sacker bifurcation, in the convention of MatContM: with A = Df,
A q = nu q, A^H p = conj(nu) p, |nu| = 1, 0 < arg nu < pi, |q| = 1, <p, q> = conj(p).q = 1,

    d = conj(nu)/2 <p, C(q, q, q*) + 2 B(q, (I - A)^-1 B(q, q*)) + B(q*, (nu^2 I - A)^-1 B(q, q))>
    z -> nu z (1 + d |z|^2) + O(|z|^4),  x = x_0 + z q + conj(z q) + O(|z|^2)                    (2)

so that |nu| = 1 + growth (omega - omega_c) gives |z|^2 = -growth (omega - omega_c) / Re d.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement, product
from typing import TYPE_CHECKING, Any

from .precision import Real, mp

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    Vector = list[Real]
    Map = Callable[[Vector], Vector]
    Index = tuple[int, ...]

Matrix = Any  # an mpmath matrix


def step() -> Real:
    """h of (1) at the present precision."""
    return mp.mpf(10) ** (-(mp.dps // 5))


@dataclass(frozen=True)
class Stencil:
    """The values of a map about a point, each computed once; shifts count steps h."""

    f: Map
    z: Vector
    h: Real
    values: dict[Index, Vector]

    def value(self, shift: Index) -> Vector:
        if shift not in self.values:
            self.values[shift] = self.f(
                [x + n * self.h for x, n in zip(self.z, shift, strict=True)]
            )
        return self.values[shift]

    def derivative(self, index: Index) -> Vector:
        """The partial derivative by the coordinates named in `index`: (1) along unit vectors."""
        total = [mp.mpf(0)] * len(self.value((0,) * len(self.z)))
        for signs in product((1, -1), repeat=len(index)):
            shift, weight = [0] * len(self.z), 1
            for i, s in zip(index, signs, strict=True):
                shift[i] += s
                weight *= s
            total = [a + weight * b for a, b in zip(total, self.value(tuple(shift)), strict=True)]
        return [a / (2 * self.h) ** len(index) for a in total]


def stencil(f: Map, z: Sequence[Real], h: Real | None = None) -> Stencil:
    return Stencil(f, list(z), step() if h is None else h, {})


def form(
    s: Stencil, order: int, coordinates: Sequence[int], fixed: Index = ()
) -> dict[Index, Vector]:
    """Every partial derivative of an order, by sorted index; `fixed` is differentiated by too."""
    return {
        index: s.derivative(index + fixed)
        for index in combinations_with_replacement(coordinates, order)
    }


def apply(tensor: dict[Index, Vector], *u: Matrix) -> Matrix:
    """A symmetric form on (complex) vectors."""
    n, size = len(u[0]), len(next(iter(tensor.values())))
    result = mp.matrix(size, 1)
    for index in product(range(n), repeat=len(u)):
        weight = mp.fprod(v[i] for v, i in zip(u, index, strict=True))
        for row, value in enumerate(tensor[tuple(sorted(index))]):
            result[row] += weight * value
    return result


def jacobian(first: dict[Index, Vector]) -> Matrix:
    """The matrix of a first derivative."""
    columns = [first[(j,)] for j in range(len(first))]
    return mp.matrix([[column[i] for column in columns] for i in range(len(columns[0]))])


@dataclass(frozen=True)
class NeimarkSacker:
    """The quantities of (2)."""

    nu: Real
    q: Matrix
    p: Matrix
    d: Real


def inner(p: Matrix, q: Matrix) -> Real:
    """<p, q> = conj(p).q."""
    return mp.fsum(mp.conj(a) * b for a, b in zip(p, q, strict=True))


def null_vector(matrix: Matrix, guess: Matrix) -> Matrix:
    """Solve matrix x = 0 by inverse iteration from a nearby matrix, |x| = 1."""
    size = mp.mpf(10) ** (10 - mp.dps)
    shifted = matrix + size * mp.eye(matrix.rows)
    for _ in range(4):
        guess = mp.lu_solve(shifted, guess)
        guess /= mp.sqrt(inner(guess, guess).real)
    return guess


def neimark_sacker(
    A: Matrix, B: dict[Index, Vector], C: dict[Index, Vector], near: Real
) -> NeimarkSacker:
    """Evaluate (2) at the multiplier nearest to `near`."""
    values, vectors = mp.eig(A)
    k = min(range(A.rows), key=lambda i: abs(values[i] - near))
    nu, one = values[k], mp.eye(A.rows)
    q = null_vector(A - nu * one, vectors[:, k])
    p = null_vector(A.H - mp.conj(nu) * one, q)
    p /= mp.conj(inner(p, q))
    bar = q.conjugate()
    inside = apply(C, q, q, bar)
    inside += 2 * apply(B, q, mp.lu_solve(one - A, apply(B, q, bar)))
    inside += apply(B, bar, mp.lu_solve(nu**2 * one - A, apply(B, q, q)))
    return NeimarkSacker(nu, q, p, mp.conj(nu) * inner(p, inside) / 2)
