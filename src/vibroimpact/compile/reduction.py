"""Reduction of a mechanism to the motions that a set of closed contacts allows.

The motion is x = offset + N xi, with N a basis of the motions that the closed contacts allow, and
reduced matrices N^T M N, N^T C N, N^T K N (theory.md, section 2).
"""

from __future__ import annotations

from dataclasses import dataclass

from vibroimpact._core import linear
from vibroimpact._core.linear import Matrix, Vector, apply, product, transpose
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import Stop

Closed = tuple[Stop, ...]  # stops at which contacts are closed


def mobility_of(closed: Closed) -> str:
    """Name of the matrix rows M^-1 rows^T of closed contacts, for errors."""
    return f"mobility of contacts {', '.join(str(i) for i, _ in closed)}, closed together"


@dataclass(frozen=True)
class Reduced:
    """Motion allowed by a closed set: x = offset + basis xi."""

    offset: Vector
    basis: Matrix
    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    constant: Vector
    external: Vector  # the part of it that does not come from stops
    terms: Vector  # sizes of the terms of that part
    sines: Matrix  # one row per line
    cosines: Matrix


def reduce(m: Mechanism, closed: Closed) -> Reduced | None:
    """Project onto the motions that the closed contacts allow; None where these are dependent."""
    n = m.degrees
    offset, basis = [0.0] * n, linear.identity(n)
    if closed:
        rows = [list(m.contacts[i].row) for i, _ in closed]
        found = _allowed(m, rows)
        if found is None:
            return None
        basis = found
        lift = linear.solve_definite(m.mass, transpose(rows))
        limits = [[stop.limit(m.contacts)] for stop in closed]
        offset = [
            row[0]
            for row in product(
                lift, linear.solve_definite(product(rows, lift), limits, mobility_of(closed))
            )
        ]
    down = transpose(basis) if basis[0] else []
    pull = apply(m.stiffness, offset)
    return Reduced(
        offset,
        basis,
        product(down, product(m.mass, basis)),
        product(down, product(m.damping, basis)),
        product(down, product(m.stiffness, basis)),
        apply(down, [f - k for f, k in zip(m.constant_force, pull, strict=True)]),
        apply(down, list(m.constant_force)),
        apply(linear.absolute(down), [abs(f) for f in m.constant_force]),
        [apply(down, list(force.sine)) for force in m.forces],
        [apply(down, list(force.cosine)) for force in m.forces],
    )


def _allowed(m: Mechanism, rows: Matrix) -> Matrix | None:
    """Basis of the motions that these rows leave; None where the rows are dependent.

    Where masses of very different sizes hide the motions of the light coordinates behind that of a
    heavy one, it is chosen in balanced units: those in which the coordinates' own masses are about 1.
    """
    basis = linear.null_space(rows)
    if not basis or not basis[0]:
        return basis
    mass = product(transpose(basis), product(m.mass, basis))
    if linear.dependent(mass, linear.cholesky(mass)) is None:
        return basis
    return linear.null_space(rows, linear.balancing(m.mass))
