"""Rayleigh's damping: C in proportion to M and K.

It is classical whatever contacts are closed: with N a basis of what they allow, N^T C N is in the
same proportion to N^T M N and N^T K N. c of a vibration mode follows from its k.
"""

from __future__ import annotations

from typing import NamedTuple

from vibroimpact import linear
from vibroimpact.linear import Matrix, dot
from vibroimpact.mechanism import Mechanism
from vibroimpact.scalars import ROUNDING, above, choose, greatest


class Proportion(NamedTuple):
    """C = of_mass M + of_stiffness K."""

    of_mass: float
    of_stiffness: float

    def rate(self, k: float) -> float:
        """C of a vibration mode; none where it is rounding of the two parts."""
        parts = self.of_mass, self.of_stiffness * k
        c = parts[0] + parts[1]
        return choose(above(abs(c), ROUNDING * greatest(map(abs, parts))), c, 0.0)

    def residual(self, m: Mechanism) -> Matrix:
        """What is left of C."""
        rest = linear.plus(m.damping, m.mass, -self.of_mass)
        return linear.plus(rest, m.stiffness, -self.of_stiffness)


def proportion(m: Mechanism) -> Proportion | None:
    """Of the damping of a mechanism; None if some entry of C differs by more than rounding.

    By least squares, whose residual is fitted once more.
    """
    first = _fitted(m, m.damping)
    more = _fitted(m, first.residual(m))
    both = [x + dx for x, dx in zip(first, more, strict=True)]
    sizes = [abs(x) * linear.largest(a) for x, a in zip(both, (m.mass, m.stiffness), strict=True)]
    least = ROUNDING * greatest(sizes)
    found = Proportion(
        *(choose(above(size, least), x, 0.0) for x, size in zip(both, sizes, strict=True))
    )
    for row in zip(found.residual(m), m.mass, m.stiffness, strict=True):
        for left, a, b in zip(*row, strict=True):
            terms = abs(found.of_mass * a) + abs(found.of_stiffness * b)
            if abs(left) > ROUNDING * m.degrees * terms:
                return None
    return found


def _fitted(m: Mechanism, c: Matrix) -> Proportion:
    """Nearest to C in the least squares; of the mass alone where K is a multiple of it."""
    mm, mk, kk = (
        _inner(m.mass, m.mass),
        _inner(m.mass, m.stiffness),
        _inner(m.stiffness, m.stiffness),
    )
    mc, kc = _inner(m.mass, c), _inner(m.stiffness, c)
    determinant = mm * kk - mk * mk
    if determinant <= 2.0**-20 * mm * kk:
        return Proportion(mc / mm, 0.0)
    return Proportion((mc * kk - kc * mk) / determinant, (mm * kc - mk * mc) / determinant)


def _inner(a: Matrix, b: Matrix) -> float:
    return dot([x for row in a for x in row], [x for row in b for x in row])
