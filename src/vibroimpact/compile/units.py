"""Units of a hybrid system given as data: powers of two, so that a change of the user's units changes no bit.

Let G be what the start and the levels say of the sizes of the states, p what constants and waves push in a mode
y' = B y + p, and rho the rate of that mode. The unit of a state is the size s of its motion,

    s_i = max(G_i, p_i / rho, |B_ij| s_j / rho, ...)                                         (1)

rounded down to a power of two, in the mode of the start; it is finite, as rho is at least the largest geometric
mean of |B| along a cycle, the least that the largest entry of D^-1 B D can be for any units D. That of time is
1 / rho. A mode in which nothing turns or decays, as a free fall, has the rate at which what pushes it moves it by
its size,

    max_j (p_i / G_i, sqrt(|B_ij| p_j / G_i), |B_ij| G_j / G_i)                              (2)

the least of these of states that are coupled, the largest of groups that are not. Every number above is a
product, quotient or root that scales as its unit does, to the bit.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from vibroimpact._core.scalars import rounded_down
from vibroimpact._core.types import Amount, Flags, Floats, Positive
from vibroimpact.model.hybrid_system import HybridSystem

# t_max has so many steps of (2) at most: a start next to zero by rounding makes no step shorter.
MOST_STEPS = 2.0**20
# A size is so large at least, relative to what is pushed in any mode: motions diverge at 2^256.
LEAST_SIZE = 2.0**-100
# Where there is no t_max, a rate of the matrices is so large at least, relative to (2).
LEAST_RATE = 2.0**-40
ACROSS_DIVISOR = 16.0
FREE_LEVELS = 3


class Units(NamedTuple):
    """Units of the states and of time, and the least rate of each mode, in the user's."""

    states: Floats
    time: Positive
    floors: list[Amount]


def units_of(system: HybridSystem, mode: str, y: Floats, t_max: float) -> Units:
    """Choose the units of a run from the data alone."""
    matrices = [np.abs(m.matrix) for m in system.modes.values()]
    pushes = [
        np.abs(m.constant) + np.abs(m.waves).sum(axis=1)  # type: ignore[arg-type]
        for m in system.modes.values()
    ]
    given = _given(system, y)
    waves = max(system.omegas, default=0.0)
    turning = [_cycle_rate(b) for b in matrices]
    own = [max(rate, waves) for rate in turning]
    groups = _groups(np.sum(matrices, axis=0))
    limit = MOST_STEPS / t_max if t_max < math.inf else max(turning) / LEAST_RATE or math.inf
    floors = [
        min(_pushed_rate(b, p, given, groups), limit) for b, p in zip(matrices, pushes, strict=True)
    ]
    rates = [max(pair) for pair in zip(own, floors, strict=True)]
    least = min((r for r in rates if r), default=1.0 / t_max if t_max < math.inf else 1.0)
    floors = [f if r else least for f, r in zip(floors, rates, strict=True)]
    rates = [r or least for r in rates]
    order = sorted(range(len(rates)), key=lambda k: list(system.modes)[k] != mode)
    sizes = _closed(
        np.maximum(given, pushes[order[0]] / rates[order[0]]), matrices[order[0]], rates[order[0]]
    )
    most = np.max([given, *(p / r for p, r in zip(pushes, rates, strict=True))], axis=0)
    sizes = np.where(sizes > 0.0, np.maximum(sizes, LEAST_SIZE * most), 0.0)
    for k in order[1:]:
        sizes = np.where(sizes > 0.0, sizes, _closed(sizes, matrices[k], rates[k]))
    sizes = _filled(system, sizes)
    return Units(
        np.array([rounded_down(s, 1) for s in sizes.tolist()]),
        1.0 / rounded_down(rates[order[0]], 1),
        floors,
    )


def _given(system: HybridSystem, y: Floats) -> Floats:
    """Sizes by the start, and by the levels of single states."""
    sizes = np.abs(y)
    for guard in system.guards.values():
        at = np.flatnonzero(guard.row)
        if at.size == 1 and not np.any(guard.waves):
            sizes[at] = np.maximum(sizes[at], abs(guard.level) / np.abs(guard.row[at]))
    return sizes


def _cycle_rate(b: Floats) -> float:
    """A power of two that no geometric mean of |B| along a cycle exceeds: by Karp's theorem on exponents."""
    n = len(b)
    bits = np.where(b > 0.0, np.frexp(b)[1].astype(float), -math.inf)
    walks = [np.zeros(n)]
    for _ in range(n):
        walks.append((bits + walks[-1][None, :]).max(axis=1))
    means = [
        min(
            Fraction(int(walks[n][v] - w[v]), n - k)
            for k, w in enumerate(walks[:n])
            if w[v] > -math.inf
        )
        for v in range(n)
        if walks[n][v] > -math.inf
    ]
    return math.ldexp(1.0, math.ceil(max(means))) if means else 0.0


def _groups(b: Floats) -> list[list[int]]:
    """States that are coupled with one another."""
    near = _reach((b + b.T) > 0.0)
    return [
        np.flatnonzero(row).tolist() for i, row in enumerate(near) if np.flatnonzero(row)[0] == i
    ]


def _reach(near: Flags) -> Flags:
    """Return which states are reached from which."""
    reach = near | np.eye(len(near), dtype=bool)
    for _ in range(len(near).bit_length()):
        reach = np.asarray((reach.astype(float) @ reach) > 0.0)
    return reach


def _pushed_rate(b: Floats, push: Floats, given: Floats, groups: list[list[int]]) -> float:
    """Rate (2) of a mode in which nothing turns or decays."""
    rates = []
    for i, size in enumerate(given.tolist()):
        others = [j for j in range(len(given)) if j != i]
        moves = [push[i] / size] if size else [0.0]
        for j in others if size else []:
            moves += [math.sqrt(b[i, j] * push[j] / size), b[i, j] * given[j] / size]
        rates.append(max(moves))
    return max(min((rates[i] for i in group if rates[i]), default=0.0) for group in groups)


def _closed(sizes: Floats, b: Floats, rate: float) -> Floats:
    """Solve (1) for the sizes at a rate."""
    for _ in range(len(sizes)):
        sizes = np.maximum(sizes, (b / rate * sizes[None, :]).max(axis=1))
    return sizes


def _filled(system: HybridSystem, sizes: Floats) -> Floats:
    """Sizes of states that only resets move, or that guards alone compare with others."""
    for _ in range(2 * len(sizes)):
        if np.all(sizes > 0.0):
            break
        found = np.zeros_like(sizes)
        for t in system.transitions:
            assert t.matrix is not None
            assert t.shift is not None
            found = np.max(
                [found, np.abs(t.shift), (np.abs(t.matrix) * sizes[None, :]).max(axis=1)], axis=0
            )
        for guard in system.guards.values() if not np.any(found[sizes == 0.0]) else []:
            row = np.abs(guard.row)
            others = np.max(row * sizes, initial=abs(guard.level))
            found = np.maximum(
                found, np.divide(others, row, out=np.zeros_like(row), where=row > 0.0)
            )
        sizes = np.where(sizes > 0.0, sizes, found)
    return np.where(sizes > 0.0, sizes, 1.0)


def _levels(across: Floats) -> int:
    """Couplings of the longest chain through states that drive one another in turn, at most."""
    power, levels = across > 0.0, 0
    while np.any(power) and levels <= FREE_LEVELS:
        levels += 1
        power = (power.astype(float) @ (across > 0.0)) > 0.0
    return levels


def balanced_norm(b: Floats) -> float:
    """Row sum norm of B in units of the states that make it small, a bound of its spectral radius.

    States that drive each other have units, powers of two, that make rows and columns alike. With |B| step = 7/10
    a step leaves out 0.7^19 / 19! < 2^-66 of the Taylor series of a flight, of the largest state in these units.
    Those that are only driven by others may have units as large as one likes. Across k couplings of this kind

        sum_m C(m, k) (b step)^k 0.7^(m-k) / m!,  m >= 19,   is   0.7^(19-k) / (19-k)! (b step)^k / k!     (3)

    or little more, beside the (b step)^k / k! that they add: below 2^-52 up to k = 3. Where there are more, each
    has a unit 16 times as large as what drives it.
    """
    size = np.abs(b)
    reach = _reach(size > 0.0)
    inner = np.where(reach & reach.T, size, 0.0)
    across = (
        (size - inner) / ACROSS_DIVISOR
        if _levels(size - inner) > FREE_LEVELS
        else np.zeros_like(size)
    )
    n = len(size)
    for _ in range(4 * n):
        settled = True
        for i in range(n):
            row, column = inner[i].sum() - inner[i, i], inner[:, i].sum() - inner[i, i]
            if not row or not column:
                continue
            change = math.ldexp(1.0, round(0.5 * math.log2(row / column)))
            if change == 1.0:
                continue
            settled = False
            own = inner[i, i]
            for part in (inner, across):
                part[i] /= change
                part[:, i] *= change
            inner[i, i] = own
        if settled:
            break
    return float((inner + across).sum(axis=1).max())
