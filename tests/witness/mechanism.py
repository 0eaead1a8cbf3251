"""Any linear mechanism with harmonic forces and rigid contacts, in high precision.

    M q'' + C q' + K q = f0 + sum over lines of (p_l s_l + r_l c_l)                   (1)
    s_l = sin(theta_l), c_l = cos(theta_l), theta_l' = omega_l
    gaps: row.q - lower and upper - row.q; impact: v+ = v - (1 + R) (n.v) M^-1 n / (n.M^-1 n)  (2)

Flight is summed as a Taylor series from centres H apart: with velocities scaled by rho, every
row of the flow matrix sums to at most rho = |M^-1 C| + sqrt(|M^-1 K|) + max omega, apart from
the forces, so N terms leave (rho H)^N / N! of the state's size. A gap is a row of the same
series: a polynomial of one variable, whose second derivative on the segment is bounded by its
coefficients, and `striding` proves its first root. Series are summed in fixed point, in
integers: several times faster than mpmath without gmpy2. No eigenvectors: critical damping, equal
frequencies and free masses are ordinary.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from .precision import Real, exact, mp
from .striding import first_root

if TYPE_CHECKING:
    from collections.abc import Sequence

Vector = list[Real]
Matrix = Any  # an mpmath matrix

REACH = 2  # rho H


def _matrix(rows: Sequence[Sequence[Real]]) -> Matrix:
    return mp.matrix([[exact(x) for x in row] for row in rows])


def _norm(matrix: Matrix) -> Real:
    """The largest row sum of moduli."""
    n = matrix.rows
    return max(sum(abs(matrix[i, j]) for j in range(n)) for i in range(n))


def _times(matrix: list[Vector], v: Vector) -> Vector:
    return [mp.fdot(row, v) for row in matrix]


@dataclass(frozen=True)
class Line:
    """One forcing line: sine * sin(theta) + cosine * cos(theta), theta' = omega."""

    omega: Real
    sine: Sequence[Real]
    cosine: Sequence[Real]


@dataclass(frozen=True)
class Contact:
    """Stops for row.q; either may be absent."""

    row: Sequence[Real]
    lower: Real | None
    upper: Real | None
    restitution: Real


@dataclass(frozen=True)
class State:
    """Positions, velocities, and (sin, cos) of the phase of each forcing line."""

    q: Vector
    v: Vector
    phasors: list[tuple[Real, Real]]


@dataclass(frozen=True)
class Mechanism:
    """Equation (1) with its contacts; numbers are converted exactly."""

    mass: Sequence[Sequence[Real]]
    damping: Sequence[Sequence[Real]]
    stiffness: Sequence[Sequence[Real]]
    lines: Sequence[Line] = ()
    contacts: Sequence[Contact] = ()
    constant_force: Sequence[Real] | None = None
    inverse_mass: Matrix = field(init=False, repr=False)
    blocks: dict[str, list[Vector]] = field(init=False, repr=False)
    forces: list[tuple[Real, Vector, Vector]] = field(init=False, repr=False)
    constant: Vector = field(init=False, repr=False)
    rho: Real = field(init=False, repr=False)

    def __post_init__(self) -> None:
        inverse = _matrix(self.mass) ** -1
        C, K = inverse * _matrix(self.damping), inverse * _matrix(self.stiffness)
        apply = inverse.tolist()
        forces = [
            (exact(f.omega), *(_times(apply, [exact(x) for x in p]) for p in (f.sine, f.cosine)))
            for f in self.lines
        ]
        constant = [exact(x) for x in self.constant_force or [0] * inverse.rows]
        fastest = max((abs(f[0]) for f in forces), default=mp.mpf(0))
        rho = _norm(C) + mp.sqrt(_norm(K)) + fastest
        values = {
            "inverse_mass": inverse,
            "blocks": {"C": C.tolist(), "K": K.tolist()},
            "forces": forces,
            "constant": _times(apply, constant),
            "rho": rho if rho > 0 else mp.mpf(1),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def reach(self) -> Real:
        """H, the length of a segment."""
        return REACH / self.rho

    @property
    def gaps(self) -> list[tuple[int, str, Vector, Real]]:
        """(contact, side, row, offset) of every gap: row.q + offset."""
        result = []
        for i, c in enumerate(self.contacts):
            row = [exact(x) for x in c.row]
            if c.lower is not None:
                result.append((i, "lower", row, -exact(c.lower)))
            if c.upper is not None:
                result.append((i, "upper", [-x for x in row], exact(c.upper)))
        return result


def state(
    q: Sequence[Real],
    v: Sequence[Real],
    *,
    phases: Sequence[Real] = (),
    phasors: Sequence[tuple[Real, Real]] | None = None,
) -> State:
    """Make a state from phases, or from phasors (sin, cos) as they stand."""
    if phasors is None:
        pairs = [(mp.sin(exact(p)), mp.cos(exact(p))) for p in phases]
    else:
        pairs = [(exact(s), exact(c)) for s, c in phasors]
    return State([exact(x) for x in q], [exact(x) for x in v], pairs)


def _fixed(x: Real) -> int:
    """A number as an integer multiple of 2^-shift."""
    return int(mp.ldexp(x, _shift()))


def _shift() -> int:
    return int(mp.prec) + 40


def _real(n: int) -> Real:
    return mp.ldexp(mp.mpf(n), -_shift())


def series(m: Mechanism, z: State) -> list[list[int]]:
    """Taylor coefficients of q in t / H about the present, in fixed point."""
    shift, H = _shift(), m.reach
    terms, size = 0, mp.mpf(1)
    while size > mp.ldexp(1, -shift):
        terms += 1
        size *= mp.mpf(REACH) / terms
    C = [[_fixed(x * H) for x in row] for row in m.blocks["C"]]
    K = [[_fixed(x * H * H) for x in row] for row in m.blocks["K"]]
    forces = _force_series(m, z, terms)
    q = [[_fixed(x) for x in z.q], [_fixed(x * H) for x in z.v]]
    for k in range(terms):
        slow, place = q[k + 1], q[k]
        rates = [
            (k + 1) * sum(map(int.__mul__, c, slow)) + sum(map(int.__mul__, b, place))
            for c, b in zip(C, K, strict=True)
        ]
        below = (k + 1) * (k + 2)
        q.append([(f - (r >> shift)) // below for f, r in zip(forces[k], rates, strict=True)])
    return q


def _force_series(m: Mechanism, z: State, terms: int) -> list[list[int]]:
    """Taylor coefficients of H^2 M^-1 f in t / H, in fixed point."""
    shift, H2, n = _shift(), m.reach**2, len(z.q)
    result = [[_fixed(x * H2) for x in m.constant]] + [[0] * n for _ in range(terms)]
    for (omega, p, r), (s, c) in zip(m.forces, z.phasors, strict=True):
        turn, s, c = _fixed(omega * m.reach), _fixed(s), _fixed(c)
        P, R = [_fixed(x * H2) for x in p], [_fixed(x * H2) for x in r]
        for k in range(terms):
            terms_k = [(a * s + b * c) >> shift for a, b in zip(P, R, strict=True)]
            result[k] = list(map(int.__add__, result[k], terms_k))
            s, c = (turn * c >> shift) // (k + 1), (-turn * s >> shift) // (k + 1)
    return result


def _evaluate(coefficients: list[int], t: int, shift: int) -> tuple[int, int]:
    """A polynomial and its derivative, by Horner, in fixed point."""
    value = slope = 0
    for c in reversed(coefficients):
        slope = (slope * t >> shift) + value
        value = (value * t >> shift) + c
    return value, slope


def _inside(m: Mechanism, z: State, q: list[list[int]], t: Real) -> State:
    """The state at a time `t` within the segment of a series."""
    at = _fixed(t / m.reach)
    pairs = [_evaluate([c[i] for c in q], at, _shift()) for i in range(len(z.q))]
    phasors = []
    for (omega, _, _), (s, c) in zip(m.forces, z.phasors, strict=True):
        cos, sin = mp.cos_sin(omega * t)
        phasors.append((s * cos + c * sin, c * cos - s * sin))
    return State([_real(x) for x, _ in pairs], [_real(v) / m.reach for _, v in pairs], phasors)


def flight(m: Mechanism, z: State, t: Real) -> State:
    """The state a time `t` later without contact."""
    left = exact(t)
    while left > 0:
        step = min(left, m.reach)
        z, left = _inside(m, z, series(m, z), step), left - step
    return z


@dataclass(frozen=True)
class Touch:
    """The end of a flight: when, which contact and side, and the state just before."""

    time: Real
    contact: int
    side: str
    before: State
    grazing: bool
    closed: list[tuple[int, str]]  # every gap closed at that time


def first_contact(
    m: Mechanism, z: State, *, t_max: Real, leaving: tuple[int, str] | None = None
) -> Touch | None:
    """Find the first contact, or None up to `t_max`.

    `leaving` names the gap an impact has just closed: it starts at exactly zero, with a
    positive rate, and the rest of the gaps must be positive.
    """
    passed, t_max = mp.mpf(0), exact(t_max)
    while passed < t_max:
        q = series(m, z)
        found = _segment_contact(m, q, min(m.reach, t_max - passed), leaving)
        if found:
            t, which, grazing, closed = found
            contact, side = m.gaps[which][:2]
            return Touch(passed + t, contact, side, _inside(m, z, q, t), grazing, closed)
        z, passed, leaving = _inside(m, z, q, m.reach), passed + m.reach, None
    return None


def _segment_contact(
    m: Mechanism, q: list[list[int]], length: Real, leaving: tuple[int, str] | None
) -> tuple[Real, int, bool, list[tuple[int, str]]] | None:
    """The first contact within a segment. Time runs in units of H here."""
    shift, H = _shift(), m.reach
    polynomials, bounds, first, sizes = [], [], mp.mpf(1), mp.mpf(1)
    for contact, side, row, offset in m.gaps:
        left = (contact, side) == leaving
        fixed = [_fixed(x) for x in row]
        g = [sum(map(int.__mul__, fixed, c)) >> shift for c in q]
        g[0] = 0 if left else g[0] + _fixed(offset)
        sizes = max(
            sizes, abs(offset), *(abs(a * _real(b)) for a, b in zip(row, q[0], strict=True))
        )
        second = _real(sum(k * (k - 1) * abs(c) for k, c in enumerate(g)) + 1)
        if left or g[0] <= sum(map(abs, g[1:])):
            first = min(first, _clear_start(_real(g[0]), _real(g[1]), second, left=left))
        polynomials.append(g)
        bounds.append(second)
    if first == 1:  # every gap exceeds all that its series could take from it
        return None

    def samples(t: Real) -> list[tuple[Real, Real, Real]]:
        at = _fixed(t)
        pairs = (_evaluate(g, at, shift) for g in polynomials)
        return [(_real(g), _real(r), M) for (g, r), M in zip(pairs, bounds, strict=True)]

    noise = mp.mpf(10) ** (5 - mp.dps) * sizes
    found = first_root(samples, first if leaving else mp.mpf(0), length / H, noise)
    if found is None:
        return None
    t, which = found
    at = samples(t)
    closed = [gap[:2] for gap, (g, _, _) in zip(m.gaps, at, strict=True) if abs(g) <= 100 * noise]
    _, slope, bound = at[which]
    return t * H, which, slope**2 <= 16 * bound * noise, closed


def _clear_start(g: Real, slope: Real, second: Real, *, left: bool) -> Real:
    """A stretch at the start free of roots: (2) of `striding`, or half a stride elsewhere."""
    if left:
        if slope <= 0:
            raise ValueError("the start does not leave its stop")
        return slope / (2 * second)
    if g <= 0:
        raise ValueError("the start is on or beyond a stop it was not said to leave")
    return g / (2 * (abs(slope) + mp.sqrt(second * g)))


def impact(m: Mechanism, before: State, contact: int) -> State:
    """The state after an impact, by (2)."""
    c = m.contacts[contact]
    row = [exact(x) for x in c.row]
    push = _times(m.inverse_mass.tolist(), row)
    factor = (1 + exact(c.restitution)) * mp.fdot(row, before.v) / mp.fdot(row, push)
    v = [x - factor * p for x, p in zip(before.v, push, strict=True)]
    return State(before.q, v, before.phasors)


def simulate(m: Mechanism, z: State, impacts: int, *, t_max: Real = 10**6) -> list[Touch]:
    """Follow a motion from impact to impact (no chatter completion)."""
    touches: list[Touch] = []
    leaving, now = None, mp.mpf(0)
    while len(touches) < impacts:
        touch = first_contact(m, z, t_max=t_max - now, leaving=leaving)
        if touch is None:
            break
        now += touch.time
        z, leaving = impact(m, touch.before, touch.contact), (touch.contact, touch.side)
        touches.append(Touch(now, *leaving, touch.before, touch.grazing, touch.closed))
    return touches


def transition(m: Mechanism, t: Real) -> Matrix:
    """The flow matrix of (q, v) over `t`, forces aside: the matrix exponential."""
    n = m.inverse_mass.rows
    B = mp.zeros(2 * n)
    for i in range(n):
        B[i, n + i] = 1
        for j in range(n):
            B[n + i, j], B[n + i, n + j] = -m.blocks["K"][i][j], -m.blocks["C"][i][j]
    return mp.expm(B * t)


def acceleration(m: Mechanism, z: State) -> Vector:
    """q'' of free flight, from (1)."""
    return [2 * _real(x) / m.reach**2 for x in series(m, z)[2]]


def saltation(m: Mechanism, before: State, contact: int) -> Matrix:
    """How a deviation (q, v) at fixed time passes an impact.

    S = J + (f(z+) - J f(z-)) n / (n.v-), with J the impact and f the flow; n acts on q.
    """
    n = len(before.q)
    row = [exact(x) for x in m.contacts[contact].row]
    push = _times(m.inverse_mass.tolist(), row)
    factor = (1 + exact(m.contacts[contact].restitution)) / mp.fdot(row, push)
    J = mp.eye(2 * n)
    for i in range(n):
        for j in range(n):
            J[n + i, n + j] -= factor * push[i] * row[j]
    after = impact(m, before, contact)
    flow_before = mp.matrix(before.v + acceleration(m, before))
    flow_after = mp.matrix(after.v + acceleration(m, after))
    normal = mp.matrix([row + [mp.mpf(0)] * n]) / mp.fdot(row, before.v)
    return J + (flow_after - J * flow_before) * normal
