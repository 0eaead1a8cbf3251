"""Periodic orbits of a mechanism with one forcing line, through any sequence of impacts.

    leg      fly until the gap named vanishes, by Newton from a guess of the time, impact        (1)
    orbit    unknowns: (q, v, theta) after the last impact of a period and the m flight times;
             closure of (q, v) over the m legs, one gap zero per leg, and the sum of the
             times 2 pi n / omega: as many equations                                         (2)
    M        product of saltation and flow matrices over the period, at fixed time;
             its eigenvalues are the multipliers, of any section                                 (3)
    det M    = prod R_i^2 exp(-T tr(M^-1 C))                                                     (4)

A special point has one or two unknowns more, parameters, and as many test functions more.
Equations are solved by Newton with a Jacobian of forward differences whose step is half the
digits, so that every iteration gains that many digits until rounding is reached.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

from .mechanism import (
    State,
    acceleration,
    first_contact,
    flight,
    impact,
    saltation,
    transition,
)  # fmt: skip
from .mechanism import state as make_state
from .precision import Real, exact, mp

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from .mechanism import Mechanism, Vector

    Gap = tuple[int, str]  # contact and side
    Matrix = Any


@dataclass(frozen=True)
class Orbit:
    """States after each impact, the last one at the start of the first flight."""

    mechanism: Mechanism
    signature: tuple[Gap, ...]
    cycles: int
    before: list[State]  # at each impact in turn
    after: list[State]
    times: list[Real]  # of the flights that lead to them

    @property
    def period(self) -> Real:
        return 2 * mp.pi * self.cycles / exact(self.mechanism.lines[0].omega)


def gap_of(m: Mechanism, gap: Gap, z: State) -> tuple[Real, Real]:
    """A gap and its rate."""
    row, offset = next(g[2:] for g in m.gaps if g[:2] == gap)
    return mp.fdot(row, z.q) + offset, mp.fdot(row, z.v)


def leg(m: Mechanism, z: State, gap: Gap, time: Real) -> tuple[State, Real]:
    """The state just before the impact and the flight time: (1)."""
    tolerance = mp.mpf(10) ** (8 - mp.dps)
    for _ in range(50):
        before = flight(m, z, time)
        distance, rate = gap_of(m, gap, before)
        time -= distance / rate
        if abs(distance / rate) < tolerance * time:
            return flight(m, z, time), time
    raise ArithmeticError("Newton's method does not find the impact")


def through(
    m: Mechanism, point: Sequence[Real], signature: Sequence[Gap], times: Sequence[Real]
) -> Vector:
    """The map (q, v, theta) -> the same after the impacts named, from guesses of the times."""
    n = (len(point) - 1) // 2
    z = make_state(point[:n], point[n : 2 * n], phases=[point[-1]])
    total = mp.mpf(0)
    for gap, guess in zip(signature, times, strict=True):
        before, time = leg(m, z, gap, guess)
        z, total = impact(m, before, gap[0]), total + time
    return [*z.q, *z.v, point[-1] + exact(m.lines[0].omega) * total]


def moved(m: Mechanism, parameter: str, change: Real, *place: int) -> Mechanism:
    """The mechanism with one entry of mass, damping or stiffness changed."""
    rows = [[exact(x) for x in row] for row in getattr(m, parameter)]
    rows[place[0]][place[1]] += change
    changes: dict[str, Any] = {parameter: rows}
    return replace(m, **changes)


def newton(residual: Callable[[Vector], Vector], z: Vector, limit: int = 30) -> Vector:
    """Solve residual = 0."""
    h, tolerance = mp.mpf(10) ** (-(mp.dps // 2)), mp.mpf(10) ** (12 - mp.dps)
    for _ in range(limit):
        r = residual(z)
        columns = []
        for i in range(len(z)):
            up = residual([x + h * (i == j) for j, x in enumerate(z)])
            columns.append([(a - b) / h for a, b in zip(up, r, strict=True)])
        step = mp.lu_solve(mp.matrix(columns).T, mp.matrix(r))
        z = [x - s for x, s in zip(z, step, strict=True)]
        if max(map(abs, step)) < tolerance * max(map(abs, z)):
            return z
    raise ArithmeticError("Newton's method does not converge")


def fly(
    m: Mechanism, signature: Sequence[Gap], z: Sequence[Real]
) -> tuple[list[State], list[State]]:
    """States before and after the impacts, from (q, v, theta) and the flight times in a row."""
    n = len(m.mass)
    here, before, after = make_state(z[:n], z[n : 2 * n], phases=[z[2 * n]]), [], []
    for gap, time in zip(signature, z[2 * n + 1 :], strict=True):
        before.append(flight(m, here, time))
        here = impact(m, before[-1], gap[0])
        after.append(here)
    return before, after


def unclosed(
    m: Mechanism, signature: Sequence[Gap], cycles: int, z: Vector
) -> tuple[Vector, Orbit]:
    """The equations (2) at a guess, and the motion it stands for."""
    n = len(m.mass)
    before, after = fly(m, signature, z)
    gaps = [gap_of(m, g, b)[0] for g, b in zip(signature, before, strict=True)]
    closure = [a - b for a, b in zip(after[-1].q + after[-1].v, z, strict=False)]
    times = z[2 * n + 1 :]
    o = Orbit(m, tuple(signature), cycles, before, after, times)
    return [*closure, *gaps, mp.fsum(times) - o.period], o


def solve(
    m: Mechanism, signature: Sequence[Gap], cycles: int,
    guess: Sequence[Real], times: Sequence[Real],
) -> Orbit:  # fmt: skip
    """The orbit (2) from (q, v, theta) after its last impact and the flight times."""
    start = [exact(x) for x in (*guess, *times)]
    z = newton(lambda z: unclosed(m, signature, cycles, z)[0], start)
    return unclosed(m, signature, cycles, z)[1]


def special(
    build: Callable[..., Mechanism], signature: Sequence[Gap], cycles: int,
    guess: Sequence[Real], times: Sequence[Real], parameters: Sequence[Real],
    tests: Sequence[Callable[[Orbit], Real]],
) -> tuple[list[Real], Orbit]:  # fmt: skip
    """The parameters at which as many test functions of the orbit vanish, and the orbit there."""
    count = len(parameters)

    def at(z: Vector) -> tuple[Vector, Orbit]:
        return unclosed(build(*z[-count:]), signature, cycles, z[:-count])

    def residual(z: Vector) -> Vector:
        equations, o = at(z)
        return [*equations, *(test(o) for test in tests)]

    z = newton(residual, [exact(x) for x in (*guess, *times, *parameters)])
    return list(z[-count:]), at(z)[1]


def fold_test(o: Orbit) -> Real:
    """det(M - I)."""
    M = monodromy(o)
    return mp.det(M - mp.eye(M.rows))


def doubling_test(o: Orbit) -> Real:
    """det(M + I)."""
    M = monodromy(o)
    return mp.det(M + mp.eye(M.rows))


def torus_test(o: Orbit) -> Real:
    """The product over pairs of multipliers of their product less 1."""
    pairs = combinations(mp.eig(monodromy(o), left=False, right=False), 2)
    return mp.fprod(a * b - 1 for a, b in pairs).real


def speed_test(impact_number: int) -> Callable[[Orbit], Real]:
    """The closing speed of an impact."""
    return lambda o: gap_of(
        o.mechanism, o.signature[impact_number], o.before[impact_number]
    )[1]  # fmt: skip


def grazing_test(number: int, gap: Gap, time: Real) -> Callable[[Orbit], Real]:
    """The least gap within a flight, its time near the one given."""

    def test(o: Orbit) -> Real:
        m, t = o.mechanism, exact(time)
        row, offset = next(g[2:] for g in m.gaps if g[:2] == gap)
        for _ in range(50):
            z = flight(m, o.after[number - 1], t)
            change = mp.fdot(row, z.v) / mp.fdot(row, acceleration(m, z))
            t -= change
            if abs(change) < mp.mpf(10) ** (-mp.dps // 2 - 5):
                break
        return mp.fdot(row, flight(m, o.after[number - 1], t).q) + offset

    return test


def monodromy(o: Orbit) -> Matrix:
    """(3)."""
    result = mp.eye(2 * len(o.mechanism.mass))
    for gap, before, time in zip(o.signature, o.before, o.times, strict=True):
        result = saltation(o.mechanism, before, gap[0]) * transition(o.mechanism, time) * result
    return result


def determinant(o: Orbit) -> Real:
    """(4)."""
    m = o.mechanism
    trace = sum(m.blocks["C"][i][i] for i in range(len(m.mass)))
    factors = (exact(m.contacts[contact].restitution) ** 2 for contact, _ in o.signature)
    return mp.fprod(factors) * mp.exp(-o.period * trace)


def multipliers(o: Orbit) -> list[Real]:
    """Largest modulus first, upper half plane before lower."""
    with mp.extradps(10):
        roots = mp.eig(monodromy(o), left=False, right=False)
    roots = [mp.chop(mp.mpc(x), tol=mp.mpf(10) ** (15 - mp.dps)) for x in roots]
    return sorted(map(mp.mpc, roots), key=lambda x: (-round(float(abs(x)), 12), -x.imag))


def phase(z: State) -> Real:
    """The phase theta in [0, 2 pi)."""
    return mp.atan2(*z.phasors[0]) % (2 * mp.pi)


def inadmissible(o: Orbit) -> str | None:
    """Why the orbit is no motion, or None: each flight first touches the gap named, in time."""
    starts = [o.after[-1], *o.after[:-1]]
    leaves = [o.signature[-1], *o.signature[:-1]]
    for i, (z, left) in enumerate(zip(starts, leaves, strict=True)):
        if gap_of(o.mechanism, left, z)[1] <= 0:
            return f"flight {i} does not leave its stop"
        touch = first_contact(o.mechanism, z, t_max=2 * o.times[i], leaving=left)
        reached = touch and (touch.contact, touch.side) == o.signature[i]
        if not (touch and reached and abs(touch.time - o.times[i]) < mp.mpf(10) ** -30):
            return f"flight {i} touches another stop, or earlier"
    return None
