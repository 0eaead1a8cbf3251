"""Coordinates of a mode: the motion that closed contacts allow, in second-order blocks or in full.

A mode holds a set of contacts closed (none: the free mode). Coordinates y are pairs (q, q') of the
reduced system (reduction.py), unused pairs, then one pair (sin theta, kappa cos theta) for each
forcing line (theory.md, sections 2 and 3).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, NamedTuple

from vibroimpact._core import linear
from vibroimpact._core.errors import ResonanceError
from vibroimpact._core.linear import Matrix, Vector, apply, dot, product, transpose
from vibroimpact._core.scalars import above, choose, greatest, rounded_down, square_root
from vibroimpact.compile.decoupling import Decoupled
from vibroimpact.compile.reduction import Closed, Reduced, mobility_of
from vibroimpact.compile.vibrations import Vibrations
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.mechanism import Mechanism, stop_sizes

STEP_ANGLE = 0.7  # one step of the kernel's march, in radians of the fastest rate
# A response that is split off is no larger than so many times what a force moves: it costs four
# digits at most.
SPLIT_RESPONSE = 2.0**14


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
    shift: Vector = dataclasses.field(default_factory=list)  # and this, where it is not empty

    def in_units(self, units: Vector) -> ModeCoordinates:
        """Return the flow without blocks on other coordinates: y is ``units`` times these, entry by entry."""
        flow: dict[str, Any] = dict(self.flow)
        if flow:
            flow["b"] = _rows_over(units, columns_by(units, flow["b"]))
            (flow["constant"],) = transpose(_rows_over(units, transpose([flow["constant"]])))
        if "norm" in flow:
            flow["norm"] = columns_by(units, flow["norm"])
        return dataclasses.replace(
            self,
            flow=flow,
            to_x=columns_by(units, self.to_x),
            to_v=columns_by(units, self.to_v),
            from_x=_rows_over(units, self.from_x),
            from_v=_rows_over(units, self.from_v),
            particular=_rows_over(units, self.particular),
            shift=[x / unit for x, unit in zip(self.shift, units, strict=False)],
        )


def columns_by(units: Vector, rows: Matrix) -> Matrix:
    """Rows on y as rows on coordinates in these units; a constant part at the end stays."""
    ends = range(len(units), len(rows[0])) if rows else ()
    factors = [*units, *(1.0 for _ in ends)]
    return [[x * unit for x, unit in zip(row, factors, strict=True)] for row in rows]


def _rows_over(units: Vector, rows: Matrix) -> Matrix:
    """Rows that give y, in these units."""
    return [[x / unit for x in row] for row, unit in zip(rows, units, strict=True)]


def units_of(m: Mechanism, flow: dict[str, Any], rate: float) -> Vector:
    """Units of the entries of y for a flow without blocks, (x_i, v_i / scale) in turn, then (sin, cos).

    The kernel takes rounding relative to the largest entry of y. Sines and cosines, and the entry 1 of a
    coordinate without mass, have no unit, so lengths are put beside them in that of what they add to
    the motion within the time of its fastest rate, or of how far stops and belts move: a power of two, which
    changes no digit. Where they add nothing, a length of the machine serves.
    """
    b, constant = flow["b"], flow["constant"]
    ones = [2 * i + 1 for i in m.massless]
    moved = [i for i in range(2 * m.degrees) if i not in ones]
    pushes = [abs(b[i][j]) / rate for i in moved for j in (*ones, *range(2 * m.degrees, len(b)))]
    for e in m.elements:
        pushes += [abs(x) for line in e.motion for x in (*line.sine, *line.cosine)]
    pushed = greatest(pushes)
    resting = greatest([*stop_sizes(m), *(abs(constant[i]) / rate for i in moved)])
    length = choose(above(pushed, 0.0), pushed, choose(above(resting, 0.0), resting, 1.0))
    unit = rounded_down(length, 1)
    return [unit if i in moved else 1.0 for i in range(len(b))]


class Blocks(NamedTuple):
    """Blocks q'' = -k q - c q' + a, and their relation to (x, v), without the forcing.

    Columns of ``x_by`` and ``v_by``, and rows of ``from_x`` and ``from_v``, belong to q_1, q_1',
    q_2, ... ``pushes`` holds (sine, cosine) of the terms that each line adds to q and to q'.
    """

    k: Vector
    c: Vector
    a: Vector
    offset: Vector
    x_by: Matrix
    v_by: Matrix
    from_x: Matrix
    from_v: Matrix
    pushes: list[Matrix]


def blocks_of_modes(r: Reduced, vibrations: Vibrations) -> Blocks:
    """Blocks of vibration modes: positions depend on q alone, and impulses change q' alone."""
    phi, k, c = vibrations
    down = transpose(phi) if phi else []
    n = len(r.inertia)
    shape = product(r.basis, phi) if phi else [[] for _ in range(n)]
    up = product(transpose(shape), r.inertia) if phi else []
    still, none = linear.zeros(n, len(k)), linear.zeros(len(k), n)
    pushes = [
        _interleaved(linear.zeros(len(k), 2), transpose([apply(down, f) for f in both]))
        for both in zip(r.sines, r.cosines, strict=True)
    ]
    return Blocks(
        k, c, apply(down, r.constant), r.offset,
        _beside(shape, still), _beside(still, shape),
        _interleaved(up, none), _interleaved(none, up), pushes,
    )  # fmt: skip


def blocks_of_pairs(r: Reduced, d: Decoupled) -> Blocks:
    """Blocks for any damping: positions depend on q', too, and impulses change q, too."""
    shown, also = product(r.basis, d.positions), product(r.basis, d.velocities)
    q_of_x, q_of_v, v_of_x, v_of_v = d.back
    by_q = [[-k * s for k, s in zip(d.k, row, strict=True)] for row in also]
    by_rate = [
        [x - c * s for x, c, s in zip(row, d.c, more, strict=True)]
        for row, more in zip(shown, also, strict=True)
    ]
    back = [
        product(transpose(product(r.basis, a)), r.inertia) for a in (q_of_x, v_of_x, q_of_v, v_of_v)
    ]
    pushes = [
        _interleaved(*(transpose([apply(transpose(a), f) for f in both]) for a in (q_of_v, v_of_v)))
        for both in zip(r.sines, r.cosines, strict=True)
    ]
    offset = [x + y for x, y in zip(r.offset, apply(r.basis, d.rest), strict=True)]
    return Blocks(
        d.k, d.c, d.a, offset, _beside(shown, also), _beside(by_q, by_rate),
        _interleaved(*back[:2]), _interleaved(*back[2:]), pushes,
    )  # fmt: skip


def _interleaved(first: Matrix, second: Matrix) -> Matrix:
    """Rows of two matrices, alternating."""
    return [row for both in zip(first, second, strict=True) for row in both]


def _beside(first: Matrix, second: Matrix) -> Matrix:
    """Columns of two matrices, alternating."""
    both = zip(first, second, strict=True)
    return [[x for pair in zip(a, b, strict=True) for x in pair] for a, b in both]


def _response(k: float, c: float, omega: float, sine: float, cosine: float) -> tuple[float, float]:
    """(alpha, beta): alpha sin + beta cos, the response of a vibration mode to sine and cosine."""
    if sine == 0.0 and cosine == 0.0:
        return 0.0, 0.0
    spring, dash = k - omega * omega, c * omega
    size, static = spring * spring + dash * dash, k + omega * omega
    if size * SPLIT_RESPONSE * SPLIT_RESPONSE < static * static:
        natural = square_root(greatest([k, 0.0]))
        raise ResonanceError(
            f"omega = {omega}: forcing at or too near resonance with a vibration mode of "
            f"frequency {natural!r} whose damping rate is {c!r}: its response "
            f"exceeds {SPLIT_RESPONSE:.0f} times the static one and would lose more than four "
            "digits. Add damping or change omega."
        )
    return (spring * sine + dash * cosine) / size, (spring * cosine - dash * sine) / size


def _answers(b: Blocks, omega: float, push: Matrix) -> Matrix:
    """Response of q_1, q_1', ... to terms p added to q and f to q', as rows on (sin, kappa cos).

    q solves q'' = -k q - c q' + f + c p + p', and the second coordinate is q' - p.
    """
    rows: Matrix = []
    for j, (k, c) in enumerate(zip(b.k, b.c, strict=True)):
        (p_sine, p_cosine), (sine, cosine) = push[2 * j], push[2 * j + 1]
        sine = sine + c * p_sine - omega * p_cosine
        cosine = cosine + c * p_cosine + omega * p_sine
        alpha, beta = _response(k, c, omega, sine, cosine)
        rows.append([alpha, beta / omega])
        rows.append([-beta * omega - p_sine, alpha - p_cosine / omega])
    return rows


def modal(m: Mechanism, b: Blocks, size: int) -> ModeCoordinates:
    """Coordinates of independent second-order blocks."""
    n, free, lines = m.degrees, len(b.k), len(m.forces)
    to_x, to_v = linear.zeros(n, size), linear.zeros(n, size)
    particular = linear.zeros(size, 2 * lines)
    for line, force in enumerate(m.forces):
        for row, answer in zip(particular, _answers(b, force.omega, b.pushes[line]), strict=False):
            row[2 * line : 2 * line + 2] = answer
    forced = size - 2 * lines
    answers = transpose(particular[: 2 * free])
    for to, by in ((to_x, b.x_by), (to_v, b.v_by)):
        for i in range(n):
            to[i][: 2 * free] = by[i]
            to[i][forced:] = [dot(by[i], answer) for answer in answers] if free else to[i][forced:]
    unused = [0.0] * (forced // 2 - free)
    from_x, from_v = ([*rows, *linear.zeros(size - 2 * free, n)] for rows in (b.from_x, b.from_v))
    flow: dict[str, object] = {
        "k": [*b.k, *unused, *(force.omega * force.omega for force in m.forces)],
        "c": [*b.c, *unused, *[0.0] * lines],
        "a": [*b.a, *unused, *[0.0] * lines],
    }
    negative = [[-x for x in row] for row in particular]
    return ModeCoordinates(flow, to_x, to_v, b.offset, from_x, from_v, negative)


def dense_rate(m: Mechanism) -> float:
    """Scale of velocities in :func:`dense`; twice it bounds the row sums without forcing."""
    solve = linear.solver_of_definite(m.mass)
    stiff, damp = (linear.row_sum_norm(solve(a)) for a in (m.stiffness, m.damping))
    return greatest([square_root(stiff), damp, *(f.omega for f in m.forces)])


def dense(m: Mechanism, r: Reduced, size: int, rate: float) -> ModeCoordinates:
    """Physical coordinates (xi, xi' / rate), forcing pairs (sin, cos)."""
    n, free, lines = m.degrees, len(r.mass), len(m.forces)
    b, constant = linear.zeros(size, size), [0.0] * size
    columns = [r.stiffness, r.damping, transpose(r.sines), transpose(r.cosines)]
    solve = linear.solver_of_definite(r.mass, "mass of the motions that closed contacts allow")
    inverse = [solve(a) if free and a else [] for a in columns]
    drift = solve([[f] for f in r.constant]) if free else []
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
        up = solve(product(transpose(r.basis), r.inertia))
        for j in range(free):
            from_x[2 * j], from_v[2 * j + 1] = list(up[j]), [x / rate for x in up[j]]
            for i in range(n):
                to_x[i][2 * j], to_v[i][2 * j + 1] = r.basis[i][j], r.basis[i][j] * rate
    nothing = linear.zeros(size, 2 * lines)
    flow: dict[str, object] = {"b": b, "constant": constant}
    return ModeCoordinates(flow, to_x, to_v, r.offset, from_x, from_v, nothing)


def with_energy(c: ModeCoordinates, r: Reduced, rate: float) -> ModeCoordinates:
    """Dense coordinates with the norm of :func:`energy_norm`."""
    norm, growth = energy_norm(len(c.to_x[0]), r.mass, r.stiffness, r.damping, rate)
    return dataclasses.replace(c, flow={**c.flow, "norm": norm, "growth": [growth]})


def energy_norm(
    size: int, mass: Matrix, stiffness: Matrix, damping: Matrix, rate: float
) -> tuple[Matrix, float]:
    """Norm of z = (xi, xi' / rate), among ``size`` coordinates y, and a bound of its growth rate.

    Its square is z^T P z = xi^T (K + 4 s M) xi + xi'^T M xi', with K + s M >= 0 and C + g M >= 0.
    As K + 4 s M >= 3 s M, motion without forcing has

        d/dt |z| <= (2 s / sqrt(3 s) + g) |z|,

    and s and g are the least of 4^n times 2^-40 |M^-1 K| and 2^-40 |M^-1 C| that satisfy this: small
    against K and C, large against rounding, n^2 2^-53 of these. Where K is zero any s > 0 will do. The norm is
    |N z|, N upper triangular, P = N^T N.
    """
    norm, free = linear.zeros(size, size), len(mass)
    solve = linear.solver_of_definite(mass)
    stiff, damp = (linear.row_sum_norm(solve(a)) if free else 0.0 for a in (stiffness, damping))
    tiny = rate * 2.0**-60
    s = _least_shift(stiffness, mass, greatest([stiff * 2.0**-40, tiny * tiny]))
    g = _least_shift(damping, mass, greatest([damp * 2.0**-40, tiny]))
    spring = linear.cholesky(linear.plus(stiffness, mass, 4.0 * s)) or []
    inertia = linear.cholesky(mass) or []
    for i in range(free):
        for j in range(i + 1):
            norm[2 * j][2 * i] = spring[i][j]
            norm[2 * j + 1][2 * i + 1] = rate * inertia[i][j]
    return norm, 2.0 * s / square_root(3.0 * s) + g


def _least_shift(a: Matrix, mass: Matrix, least: float) -> float:
    """Least s among 4^n times ``least`` that makes A + s M positive definite."""
    while linear.cholesky(linear.plus(a, mass, least)) is None:
        least = 4.0 * least
    return least


def guard_row(c: ModeCoordinates, contact: RigidStop) -> tuple[Vector, float]:
    """Contact coordinate u = row . x as a row on y."""
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
    rows = [[-side * x for x in m.rigid_stops[i].row] for i, side in closed]  # gap directions
    lift = linear.solve_definite(m.mass, transpose(rows))
    accelerations = product(transpose(lift), pull)
    forces = linear.solve_definite(product(rows, lift), accelerations, mobility_of(closed))
    return [[-x for x in row] for row in forces]
