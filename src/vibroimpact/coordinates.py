"""Coordinates of a mode: what closed contacts still allow, in vibration modes or in full.

A mode holds a set of contacts closed (none: the free mode). Its motion is x = offset + N xi, with
N a basis of what the closed contacts allow, and reduced matrices N^T M N, N^T C N, N^T K N.
Coordinates y are pairs (q, q') of the reduced system, unused pairs, then one pair
(sin theta, kappa cos theta) for each forcing line (theory.md, sections 2 and 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from vibroimpact import linear
from vibroimpact.errors import ResonanceError
from vibroimpact.linear import Matrix, Vector, apply, dot, product, transpose
from vibroimpact.mechanism import Contact, Mechanism
from vibroimpact.rayleigh import Proportion
from vibroimpact.scalars import ROUNDING, above, choose, greatest, square_root

STEP_ANGLE = 0.7  # one step of the kernel's march, in radians of the fastest rate
RESONANCE_LOSS = 2.0**20  # a response larger than this times its static part loses six digits

Closed = tuple[tuple[int, int], ...]  # (contact, side) of the contacts held closed


@dataclass(frozen=True)
class Reduced:
    """Motion allowed by a closed set: x = offset + basis xi."""

    offset: Vector
    basis: Matrix
    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    constant: Vector
    sines: Matrix  # one row per line
    cosines: Matrix


class Vibrations(NamedTuple):
    """Vibration modes: Phi^T M Phi = 1, Phi^T K Phi = diag(k), Phi^T C Phi = diag(c)."""

    phi: Matrix
    k: Vector
    c: Vector


@dataclass(frozen=True)
class ModeCoordinates:
    """Flow of one mode, and the affine map from its y to (x, v)."""

    flow: dict[str, object]
    to_x: Matrix
    to_v: Matrix
    offset: Vector
    from_x: Matrix  # y = from_x (x - offset) + from_v v + forcing part
    from_v: Matrix
    particular: Matrix  # forcing part: y gains particular . (forcing coordinates)


def limit_of(contact: Contact, side: int) -> float:
    """The stop of a contact on one side, infinite where there is none."""
    return contact.upper if side > 0 else contact.lower


def reduce(m: Mechanism, closed: Closed) -> Reduced | None:
    """Project onto what the closed contacts allow; None where they are dependent."""
    n = m.degrees
    offset, basis = [0.0] * n, linear.identity(n)
    if closed:
        rows = [list(m.contacts[i].row) for i, _ in closed]
        found = linear.null_space(rows)
        if found is None:
            return None
        basis = found
        lift = linear.solve_definite(m.mass, transpose(rows))
        limits = [[limit_of(m.contacts[i], side)] for i, side in closed]
        offset = [
            row[0] for row in product(lift, linear.solve_definite(product(rows, lift), limits))
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
        [apply(down, list(force.sine)) for force in m.forces],
        [apply(down, list(force.cosine)) for force in m.forces],
    )


def vibration_modes(r: Reduced, damping: Proportion | None = None) -> Vibrations | None:
    """The modes of a classically damped system; None if there are none.

    Where its damping is Rayleigh's, there are.
    """
    if not r.mass:
        return Vibrations([], [], [])
    low = linear.cholesky(r.mass)
    if low is None:
        raise ArithmeticError("reduced mass matrix is not positive definite")
    stiffness = _normal(low, r.stiffness)
    if damping:
        phi = linear.solve_upper(low, linear.symmetric_eigenvectors(stiffness))
        k = _diagonal(phi, r.stiffness)
        return Vibrations(phi, k, [damping.damping_of(x) for x in k])
    normal = [stiffness, _normal(low, r.damping)]
    stiff, damp = (linear.largest(a) for a in normal)
    mix = 0.7548776662466927 * stiff / damp if stiff and damp else 1.0  # any generic number
    vectors = linear.symmetric_eigenvectors(linear.plus(normal[0], normal[1], mix))
    for a, size in zip(normal, (stiff, damp), strict=True):
        inside = product(transpose(vectors), product(a, vectors))
        off = [abs(inside[i][j]) for i in range(len(a)) for j in range(len(a)) if i != j]
        if greatest(off) > ROUNDING * len(a) * size:
            return None
    phi = linear.solve_upper(low, vectors)
    return Vibrations(phi, _diagonal(phi, r.stiffness), _diagonal(phi, r.damping))


def _normal(low: Matrix, a: Matrix) -> Matrix:
    """L^-1 A L^-T."""
    return transpose(linear.solve_lower(low, transpose(linear.solve_lower(low, a))))


def _diagonal(phi: Matrix, a: Matrix) -> Vector:
    """Diagonal of Phi^T A Phi, entries below rounding set to zero."""
    inside = product(transpose(phi), product(a, phi))
    size = linear.largest(inside)
    values = [row[i] for i, row in enumerate(inside)]
    return [choose(above(abs(x), ROUNDING * size), x, 0.0) for x in values]


def _response(k: float, c: float, omega: float, sine: float, cosine: float) -> tuple[float, float]:
    """(alpha, beta): alpha sin + beta cos answers sine sin + cosine cos in one vibration mode."""
    if sine == 0.0 and cosine == 0.0:
        return 0.0, 0.0
    spring, dash = k - omega * omega, c * omega
    size, static = spring * spring + dash * dash, k + omega * omega
    if size * RESONANCE_LOSS * RESONANCE_LOSS < static * static:
        natural = square_root(greatest([k, 0.0]))
        raise ResonanceError(
            f"omega = {omega}: forcing at or too near resonance with a vibration mode of "
            f"frequency {natural!r} whose damping rate is {c!r}: its response "
            f"exceeds {RESONANCE_LOSS:.0f} times the static one and would cost more than six "
            "digits. Add damping or move omega."
        )
    return (spring * sine + dash * cosine) / size, (spring * cosine - dash * sine) / size


def modal(m: Mechanism, r: Reduced, vibrations: Vibrations, size: int) -> ModeCoordinates:
    """Coordinates of independent second-order blocks."""
    n, free, lines = m.degrees, len(r.mass), len(m.forces)
    phi, k, c = vibrations
    down = transpose(phi) if phi else []
    a = apply(down, r.constant)
    shape = product(r.basis, phi) if free else [[] for _ in range(n)]
    to_x, to_v = linear.zeros(n, size), linear.zeros(n, size)
    particular = linear.zeros(size, 2 * lines)
    for line, force in enumerate(m.forces):
        w = force.omega
        sines, cosines = apply(down, r.sines[line]), apply(down, r.cosines[line])
        for j in range(free):
            alpha, beta = _response(k[j], c[j], w, sines[j], cosines[j])
            particular[2 * j][2 * line], particular[2 * j][2 * line + 1] = alpha, beta / w
            particular[2 * j + 1][2 * line], particular[2 * j + 1][2 * line + 1] = -beta * w, alpha
    for i in range(n):
        for j in range(free):
            to_x[i][2 * j], to_v[i][2 * j + 1] = shape[i][j], shape[i][j]
        for column in range(2 * lines):
            at = size - 2 * lines + column
            to_x[i][at] = dot(shape[i], [particular[2 * j][column] for j in range(free)])
            to_v[i][at] = dot(shape[i], [particular[2 * j + 1][column] for j in range(free)])
    up = product(transpose(shape), m.mass) if free else []
    from_x, from_v = linear.zeros(size, n), linear.zeros(size, n)
    for j in range(free):
        from_x[2 * j], from_v[2 * j + 1] = list(up[j]), list(up[j])
    unused = [0.0] * (size // 2 - free - lines)
    squares = [force.omega * force.omega for force in m.forces]
    flow: dict[str, object] = {
        "k": [*k, *unused, *squares],
        "c": [*c, *unused, *[0.0] * lines],
        "a": [*a, *unused, *[0.0] * lines],
    }
    negative = [[-x for x in row] for row in particular]
    return ModeCoordinates(flow, to_x, to_v, r.offset, from_x, from_v, negative)


def dense_rate(m: Mechanism) -> float:
    """Scale of velocities in :func:`dense`; twice it bounds the row sums but for forcing."""
    stiff, damp = (
        linear.row_sum_norm(linear.solve_definite(m.mass, a)) for a in (m.stiffness, m.damping)
    )
    return greatest([square_root(stiff), damp, *(f.omega for f in m.forces), 2.0**-500])


def dense(m: Mechanism, r: Reduced, size: int, rate: float) -> ModeCoordinates:
    """Physical coordinates (xi, xi' / rate), forcing pairs (sin, cos)."""
    n, free, lines = m.degrees, len(r.mass), len(m.forces)
    b, constant = linear.zeros(size, size), [0.0] * size
    columns = [r.stiffness, r.damping, transpose(r.sines), transpose(r.cosines)]
    inverse = [linear.solve_definite(r.mass, a) if free and a else [] for a in columns]
    drift = linear.solve_definite(r.mass, [[f] for f in r.constant]) if free else []
    for i in range(free):
        b[2 * i][2 * i + 1] = rate
        constant[2 * i + 1] = drift[i][0] / rate
        for j in range(free):
            b[2 * i + 1][2 * j] = -inverse[0][i][j] / rate
            b[2 * i + 1][2 * j + 1] = -inverse[1][i][j]
        for line in range(lines):
            at = size - 2 * lines + 2 * line
            b[2 * i + 1][at] = inverse[2][i][line] / rate
            b[2 * i + 1][at + 1] = inverse[3][i][line] / rate
    for line, force in enumerate(m.forces):
        at = size - 2 * lines + 2 * line
        b[at][at + 1], b[at + 1][at] = force.omega, -force.omega
    to_x, to_v = linear.zeros(n, size), linear.zeros(n, size)
    from_x, from_v = linear.zeros(size, n), linear.zeros(size, n)
    if free:
        up = linear.solve_definite(r.mass, product(transpose(r.basis), m.mass))
        for j in range(free):
            from_x[2 * j], from_v[2 * j + 1] = list(up[j]), [x / rate for x in up[j]]
            for i in range(n):
                to_x[i][2 * j], to_v[i][2 * j + 1] = r.basis[i][j], r.basis[i][j] * rate
    nothing = linear.zeros(size, 2 * lines)
    flow: dict[str, object] = {"b": b, "constant": constant}
    return ModeCoordinates(flow, to_x, to_v, r.offset, from_x, from_v, nothing)


def guard_row(c: ModeCoordinates, contact: Contact) -> tuple[Vector, float]:
    """U = row . x as a row on y."""
    row = list(contact.row)
    return apply(transpose(c.to_x), row), dot(row, c.offset)


def force_rows(m: Mechanism, c: ModeCoordinates, closed: Closed, kappas: Vector) -> Matrix:
    """Contact forces of a closed set as rows on (y, 1): A force = -(free gap accelerations)."""
    size, lines = len(c.to_x[0]), len(m.forces)
    pull = linear.zeros(m.degrees, size + 1)  # f - C v - K x on (y, 1)
    for i in range(m.degrees):
        for j in range(size):
            for k in range(m.degrees):
                pull[i][j] -= m.damping[i][k] * c.to_v[k][j] + m.stiffness[i][k] * c.to_x[k][j]
        pull[i][size] = m.constant_force[i] - dot(m.stiffness[i], c.offset)
        for line, force in enumerate(m.forces):
            at = size - 2 * lines + 2 * line
            pull[i][at] += force.sine[i]
            pull[i][at + 1] += force.cosine[i] / kappas[line]
    rows = [[-side * x for x in m.contacts[i].row] for i, side in closed]  # gap directions
    lift = linear.solve_definite(m.mass, transpose(rows))
    accelerations = product(transpose(lift), pull)
    forces = linear.solve_definite(product(rows, lift), accelerations)
    return [[-x for x in row] for row in forces]
