"""Equations of a fixed point or a periodic orbit over two parameters, as curves of bifurcations need them.

Unknowns z and parameters a = (a_1, a_2) satisfy F(z, a) = 0. A change v of the unknowns that returns multiplied by
mu satisfies

    L(mu) v = 0,    L(mu) = F_z - (mu - 1) E,                                                        (1)

where E marks the places at which the end of a period is compared with its start: F(x) - x of a map has E = I, and
the segments of an orbit are compared there, and only there, with the first one. So the multipliers of the map are
the finite eigenvalues of a pencil, also where the map itself is not smooth because an impact grazes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.forms import Forms

Pair = tuple[float, float]  # values of the two parameters


class Equations(Protocol):
    """Equations F(z, a) = 0 of d unknowns over two parameters, with exact derivatives."""

    names: tuple[str, str]

    @property
    def sizes(self) -> Floats:
        """Size of the changes of each unknown, shape (d,)."""
        ...

    @property
    def rows(self) -> Floats:
        """Size of the terms of each equation, shape (d,)."""
        ...

    @property
    def closing(self) -> Floats:
        """E of (1), shape (d, d)."""
        ...

    def residual(self, z: Floats, a: Pair) -> Floats:
        """F, shape (d,)."""
        ...

    def by_both(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        """F_z of shape (d, d) and F_a of shape (d, 2)."""
        ...

    def by_first(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        """F_z of shape (d, d), and the derivative by the first parameter, shape (d,)."""
        ...

    def second(self, z: Floats, a: Pair, v: Floats) -> Floats:
        """Derivatives of F_z v by z and by both parameters, shape (r, d, d + 2), for r directions v in rows."""
        ...

    def multipliers(self, z: Floats, a: Pair) -> Complexes:
        """Multipliers of the map, largest modulus first."""
        ...

    def weight(self, z: Floats, a: Pair, /) -> float:
        """Function that vanishes where a multiplier is infinite: removes poles of test functions."""
        ...

    def forms(self, z: Floats, a: Pair) -> Forms:
        """Multilinear forms of the map at the solution, without parameters."""
        ...

    def on_section(self, v: Complexes) -> Complexes:
        """A change of the unknowns in the map's own coordinates."""
        ...

    def repeated(self, times: int) -> Equations:
        """Equations of the orbits that close after so many iterates of the map."""
        ...

    def unrolled(self, z: Floats, changes: Floats) -> Floats:
        """Unknowns of :meth:`repeated` from z and the change of each iterate, shape (times, d)."""
        ...

    def touches(self, z: Floats, a: Sequence[Pair], /) -> Mapping[str, Floats]:
        """Test functions for touches of orbits, shape (k, d), whatever the kind of the curve."""
        ...

    def solution(self, z: Floats, a: Pair) -> Any:
        """The orbit or the fixed point."""
        ...


class Solution(NamedTuple):
    """Solution of equations over two parameters."""

    equations: Equations
    z: Floats
    a: Pair
