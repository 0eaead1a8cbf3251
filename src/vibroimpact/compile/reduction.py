"""Reduction of a mechanism to the motions that a set of closed contacts allows.

The motion is x = offset + N xi, with N a basis of the motions that the closed contacts allow, and
reduced matrices N^T M N, N^T C N, N^T K N (theory.md, section 2). They and the forces are in a unit of mass
of the mechanism's own, a power of two: coordinates with unit masses take roots of masses, which have
the same bits in every unit then.
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
    """Motion allowed by a closed set: x = offset + basis xi; ``inertia`` is all of M."""

    offset: Vector
    basis: Matrix
    inertia: Matrix
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
        rows = [list(m.rigid_stops[i].row) for i, _ in closed]
        found = _allowed(m, rows)
        if found is None:
            return None
        basis = found
        lift = linear.solve_definite(m.mass, transpose(rows))
        limits = [[stop.limit(m.rigid_stops)] for stop in closed]
        offset = [
            row[0]
            for row in product(
                lift, linear.solve_definite(product(rows, lift), limits, mobility_of(closed))
            )
        ]
    unit = linear.unit_of(m.mass)
    mass, damping, stiffness = (linear.over(a, unit) for a in (m.mass, m.damping, m.stiffness))
    constant, *lines = linear.over(
        [list(m.constant_force), *(list(x) for f in m.forces for x in (f.sine, f.cosine))], unit
    )
    down = transpose(basis) if basis[0] else []
    pull = apply(stiffness, offset)
    return Reduced(
        offset,
        basis,
        mass,
        product(down, product(mass, basis)),
        product(down, product(damping, basis)),
        product(down, product(stiffness, basis)),
        apply(down, [f - k for f, k in zip(constant, pull, strict=True)]),
        apply(down, constant),
        apply(linear.absolute(down), [abs(f) for f in constant]),
        [apply(down, sine) for sine in lines[::2]],
        [apply(down, cosine) for cosine in lines[1::2]],
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
