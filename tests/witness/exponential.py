"""Flights of any linear mechanism as exponentials of the whole matrix, in fixed point.

With y = (x, v, sin theta_1, cos theta_1, ..., 1) a flight of

    M x'' + C x' + K x = f0 + sum over lines of (p sin theta + r cos theta),   theta' = omega

is y' = A y. A is made of the numbers of the mechanism as fractions; exp(A t) is summed as a Taylor series for
|A t| < 1/16 and squared, in integers of 2^-640: no eigenvectors, no particular motion, no units, and what powers
of the matrix lose by their size, up to 2^200 here, leaves more than 100 digits.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from .precision import Real, exact, mp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from vibroimpact import Mechanism

BITS = 640
Fixed = Any  # arrays of integers, times 2^-BITS


def fixed(x: Real) -> int:
    """A number as an integer times 2^-BITS."""
    return int(mp.ldexp(x, BITS)) if isinstance(x, mp.mpf) else int(Fraction(x) * 2**BITS)


def real(x: int) -> float:
    """The nearest double to a number in fixed point."""
    return float(Fraction(int(x), 2**BITS))


class Flow:
    """The flow of a mechanism."""

    def __init__(self, m: Mechanism) -> None:
        n, self.omegas = m.degrees, [Fraction(f.omega) for f in m.forces]
        self.n, self.size = n, 2 * n + 2 * len(m.forces) + 1
        inverse = _inverse(m.mass)

        def accelerations(forces: Sequence[float]) -> list[Fraction]:
            return [
                sum(a * Fraction(f) for a, f in zip(row, forces, strict=True)) for row in inverse
            ]

        a = [[Fraction(0)] * self.size for _ in range(self.size)]
        springs, dashpots = (
            [accelerations(column) for column in zip(*matrix, strict=True)]
            for matrix in (m.stiffness, m.damping)
        )
        columns = [*([-x for x in part] for parts in (springs, dashpots) for part in parts)]
        for f in m.forces:
            columns += [accelerations(f.sine), accelerations(f.cosine)]
        columns.append(accelerations(m.constant_force))
        for i in range(n):
            a[i][n + i] = Fraction(1)
            a[n + i] = [column[i] for column in columns]
        for line, omega in enumerate(self.omegas):
            at = 2 * n + 2 * line
            a[at][at + 1], a[at + 1][at] = omega, -omega
        self.a = a

    def state(self, x: Sequence[float], v: Sequence[float], phases: Sequence[Real]) -> Fixed:
        """The vector y."""
        waves = [wave(exact(p)) for p in phases for wave in (mp.sin, mp.cos)]
        return np.array([*map(fixed, (*x, *v, *waves)), 2**BITS], dtype=object)

    def over(self, t: Fraction) -> Fixed:
        """exp(A t)."""
        norm = max(sum(map(abs, row)) for row in self.a) * t
        halvings = max(0, int(norm * 16).bit_length())
        step = [[fixed(x * t / 2**halvings) for x in row] for row in self.a]
        b = np.array(step, dtype=object)
        sum_ = term = np.array(
            [[2**BITS * (i == j) for j in range(self.size)] for i in range(self.size)], dtype=object
        )
        k = 0
        while max(map(abs, term.flat)) > 2:
            k += 1
            term = (term.dot(b) >> BITS) // k
            sum_ = sum_ + term
        for _ in range(halvings):
            sum_ = sum_.dot(sum_) >> BITS
        return sum_

    def along(
        self,
        x: Sequence[float],
        v: Sequence[float],
        phases: Sequence[Real],
        t: Fraction,
        parts: int,
    ) -> Fixed:
        """States at so many equal parts of a time, the first one included, shape (parts + 1, size)."""
        once, states = self.over(t / parts), [self.state(x, v, phases)]
        for _ in range(parts):
            states.append(once.dot(states[-1]) >> BITS)
        return np.array(states)


def _inverse(matrix: Sequence[Sequence[float]]) -> list[list[Fraction]]:
    """By Gauss and Jordan, without pivoting: for positive definite matrices."""
    n = len(matrix)
    rows = [
        [*map(Fraction, row), *(Fraction(i == j) for j in range(n))] for i, row in enumerate(matrix)
    ]
    for i in range(n):
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(n):
            if k != i:
                factor = rows[k][i]
                rows[k] = [x - factor * y for x, y in zip(rows[k], rows[i], strict=True)]
    return [row[n:] for row in rows]
