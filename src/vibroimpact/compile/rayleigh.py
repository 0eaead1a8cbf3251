"""Rayleigh damping: C as a linear combination of M and K.

It is classical for any closed contacts: with N a basis of the motions that they allow, N^T C N is
the same combination of N^T M N and N^T K N. c of a vibration mode follows from its k.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from vibroimpact._core.linear import dot
from vibroimpact._core.scalars import ROUNDING_PER_TERM, above, choose, cleared, greatest
from vibroimpact.model.mechanism import Mechanism

Entry = tuple[float, float, float]  # of M, K and C


class Proportion(NamedTuple):
    """C = of_mass M + of_stiffness K."""

    of_mass: float
    of_stiffness: float

    def damping_of(self, k: float) -> float:
        """Damping c of a vibration mode; zero where it is rounding of the two parts."""
        parts = self.of_mass, self.of_stiffness * k
        c = parts[0] + parts[1]
        return cleared(c, ROUNDING_PER_TERM * greatest(map(abs, parts)))

    def terms(self, m: float, k: float) -> float:
        """Size of the parts of an entry."""
        return abs(self.of_mass * m) + abs(self.of_stiffness * k)

    def remainder(self, entry: Entry) -> float:
        """Remainder of an entry of C."""
        m, k, c = entry
        return c - self.of_mass * m - self.of_stiffness * k


def proportion(of: Mechanism) -> Proportion | None:
    """Rayleigh coefficients of a mechanism; None if an entry of C differs by more than rounding.

    Least squares of relative errors: first of C, then twice of the remainder, relative to the sizes
    of the terms of each entry.
    """
    rows = zip(of.mass, of.stiffness, of.damping, strict=True)
    entries = [entry for row in rows for entry in zip(*row, strict=True)]
    found = _fitted(entries, [abs(c) for _, _, c in entries])
    for _ in range(2):
        rest = [(m, k, found.remainder((m, k, c))) for m, k, c in entries]
        more = _fitted(rest, [found.terms(m, k) for m, k, _ in entries])
        found = Proportion(*(x + dx for x, dx in zip(found, more, strict=True)))
    found = _without_rounding(found, entries)
    for m, k, c in entries:
        if abs(found.remainder((m, k, c))) > ROUNDING_PER_TERM * of.degrees * found.terms(m, k):
            return None
    return found


def _fitted(entries: Sequence[Entry], sizes: Sequence[float]) -> Proportion:
    """Least-squares fit, weighted by these sizes; M alone where K is nearly a multiple of it."""
    both = zip(entries, sizes, strict=True)
    weighed = [(m / size, k / size, c / size) for (m, k, c), size in both if size > 0.0]
    ms, ks, cs = zip(*weighed, strict=True) if weighed else ((), (), ())
    mm, mk, kk, mc, kc = dot(ms, ms), dot(ms, ks), dot(ks, ks), dot(ms, cs), dot(ks, cs)
    determinant = mm * kk - mk * mk
    if determinant > 2.0**-40 * mm * kk:
        return Proportion((mc * kk - kc * mk) / determinant, (mm * kc - mk * mc) / determinant)
    if mm > 0.0:
        return Proportion(mc / mm, 0.0)
    return Proportion(0.0, kc / kk if kk > 0.0 else 0.0)


def _without_rounding(p: Proportion, entries: Sequence[Entry]) -> Proportion:
    """Set a coefficient to zero if it adds no more than rounding to any entry."""
    damped = [(m, k, ROUNDING_PER_TERM * abs(c)) for m, k, c in entries if abs(c) > 0.0]
    of_mass = greatest(abs(p.of_mass * m) - least for m, _, least in damped)
    of_stiffness = greatest(abs(p.of_stiffness * k) - least for _, k, least in damped)
    return Proportion(
        choose(above(of_mass, 0.0), p.of_mass, 0.0),
        choose(above(of_stiffness, 0.0), p.of_stiffness, 0.0),
    )
