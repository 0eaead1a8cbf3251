"""Period doubling, symmetry breaking and fold: coefficients and the new orbits.

Method      Flip (nu = -1), on x = x0 + q w + h2 w^2 / 2 + ...:
                w -> -w + c w^3 + ...,  h2 = (I - A)^-1 B(q, q),                             (1)
                c = <p, C(q, q, q) + 3 B(q, h2)> / 6.                                        (2)
            With a parameter nu(dp) = -1 + nu_p dp (unfolding.py), and w -> -w maps into itself the
            pair
                w^2 = -nu_p dp / c > 0,   x0 + x_p dp +- q w + h2 w^2 / 2.                   (3)
            Symmetry breaking of an orbit is the flip of its half map: the two points are two
            mirror-image orbits of the full map instead of one orbit of period two.
            Fold (nu = 1), on x = x0 + q w + ...:
                w -> w + s dp + a w^2 + ...,  a = <p, B(q, q)> / 2,  s = <p, F_p>,           (4)
                two fixed points  w = +-sqrt(-s dp / a),  multipliers 1 + 2 a w.             (5)
Assumes     nu simple, no other multiplier on the unit circle, c != 0 (a != 0), nu_p != 0 (s != 0);
            each is checked
Accuracy    coefficients: rounding times |p|. (3): w to a relative error of order dp, points to
            order dp^(3/2); (5): points to order dp
Fails       a Refusal with the hypothesis that does not hold
Invariance  the signs of c and nu_p, a s and the points are invariant under changes of coordinates;
            c scales with |q|^2, a with |q|
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 4.5 and 5.4
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.types import AnyComplexes, Floats
from vibroimpact.normal_forms.critical import (
    Critical,
    Refusal,
    Status,
    critical_multiplier,
    zero,
)
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian, with_parameter
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.terms import off, sized
from vibroimpact.normal_forms.unfolding import Unfolding, given, unfold

UNDECIDED = "the cubic term does not decide"
TOUCHES = "in this parameter the multiplier touches -1 without crossing it"
FLAT = "a cusp, or a pitchfork (kind BP)"
BRANCHES_CROSS = "two branches cross here (kind BP), this is not a fold"


@dataclass(frozen=True, eq=False)
class Flip:
    """Normal form (1) at a period doubling, or at the symmetry breaking of a half map.

    Attributes
    ----------
    kind
        Label of the kind: symmetry breaking where the map is the half map of a symmetric orbit.
    c
        Cubic coefficient (2) for |q| = 1.
    q, p, h2
        Critical eigenvectors and second-order term of the centre manifold, real, of shape
        (dimension,).
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether every multiplier but -1 lies inside the unit circle.
    unfolding
        Effect of the parameter, or None if it was left out.
    """

    kind: str
    c: float
    q: Floats = field(repr=False)
    p: Floats = field(repr=False)
    h2: Floats = field(repr=False)
    multipliers: AnyComplexes = field(repr=False)
    others_inside: bool
    unfolding: Unfolding | None = field(repr=False)

    @property
    def supercritical(self) -> bool:
        """Whether c > 0: the new orbits attract on the centre manifold, and lie where |nu| > 1."""
        return self.c > 0.0

    @property
    def attracting(self) -> bool:
        """Whether the new orbits attract in the whole space."""
        return self.supercritical and self.others_inside

    @property
    def multiplier_slope(self) -> float:
        """nu_p: derivative of the critical multiplier along the branch."""
        return self._unfolded().multiplier_slope.real

    @property
    def side(self) -> int:
        """+1 or -1: the new orbits exist for dp of this sign."""
        return int(math.copysign(1.0, -self.multiplier_slope * self.c))

    def size(self, dp: float) -> float:
        """|w| of the new points (3); nan on the side where there are none.

        Parameters
        ----------
        dp
            Parameter minus its critical value.
        """
        squared = -self.multiplier_slope * dp / self.c
        return math.sqrt(squared) if squared >= 0.0 else math.nan

    def points(self, dp: float) -> Floats:
        """The two new points (3), as displacements from the critical one, shape (2, dimension)."""
        w = np.array([1.0, -1.0]) * self.size(dp)
        bend = self._unfolded().drift * dp + self.h2 * self.size(dp) ** 2 / 2.0
        return np.asarray(np.outer(w, self.q) + bend)

    def _unfolded(self) -> Unfolding:
        return given("unfolding", self.unfolding)


@dataclass(frozen=True, eq=False)
class Fold:
    """Normal form (4) at a fold.

    Attributes
    ----------
    kind
        Label of the kind.
    a
        Quadratic coefficient for |q| = 1: its sign is that of q, whose largest entry is positive.
    q, p
        Critical eigenvectors, real, shape (dimension,).
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether every multiplier but 1 lies inside the unit circle.
    drive
        s = <p, F_p>, or None if the parameter was left out.
    """

    kind: str
    a: float
    q: Floats = field(repr=False)
    p: Floats = field(repr=False)
    multipliers: AnyComplexes = field(repr=False)
    others_inside: bool
    drive: float | None

    @property
    def side(self) -> int:
        """+1 or -1: the two fixed points exist for dp of this sign."""
        return int(math.copysign(1.0, -self._driven() * self.a))

    def size(self, dp: float) -> float:
        """|w| of the two fixed points (5); nan on the side where there are none."""
        squared = -self._driven() * dp / self.a
        return math.sqrt(squared) if squared >= 0.0 else math.nan

    def points(self, dp: float) -> Floats:
        """The two fixed points, as displacements, shape (2, dimension).

        The first is the one with multiplier below 1: the node where every other is inside.
        """
        w = -math.copysign(1.0, self.a) * np.array([1.0, -1.0]) * self.size(dp)
        return np.asarray(np.outer(w, self.q))

    def _driven(self) -> float:
        return given("drive", self.drive)


def flip(kind: PointKind, forms: Forms, *, parameter: bool = True) -> Flip | Refusal:
    """Compute (1) to (3) at a period doubling, or at the symmetry breaking of a half map: the formula is the same.

    Cost: d first, 2 second and 1 third derivative, 3 more with the parameter.
    """
    A = jacobian(forms)
    critical = critical_multiplier(kind, A)
    if isinstance(critical, Refusal):
        return critical
    at = Multilinear(forms)
    form, scale = flip_coefficient(kind, at, A, critical)
    undecided = zero("c", form.c, scale, Status.DEGENERATE, UNDECIDED, form)
    if undecided or not parameter:
        return undecided or form
    unfolding = unfold(at, A, critical)
    whole = replace(form, unfolding=unfolding)
    slope = whole.multiplier_slope
    return zero("dnu/dp", slope, unfolding.scale, Status.NOT_TRANSVERSAL, TOUCHES, form) or whole


def flip_coefficient(
    kind: PointKind, at: Multilinear, A: Floats, critical: Critical
) -> tuple[Flip, float]:
    """Normal form without the parameter, and the size of the terms of c."""
    q, p = critical.q.real, critical.p.real
    h2 = off(A, 1.0, at.real(q, q))  # (1)
    c = sized(p, 6.0, at.real(q, q, q), 3.0 * at.real(q, h2))  # (2)
    multipliers, inside = critical.multipliers, critical.others_inside
    return Flip(kind.label, c.value.real, q, p, h2, multipliers, inside, None), c.scale


def fold(kind: PointKind, forms: Forms, *, parameter: bool = True) -> Fold | Refusal:
    """Compute (4) and (5); with <p, F_p> = 0 it is a branch point, no fold.

    Cost: d first and 1 second derivative, 1 more with the parameter.
    """
    critical = critical_multiplier(kind, jacobian(forms))
    if isinstance(critical, Refusal):
        return critical
    at, q, p = Multilinear(forms), critical.q.real, critical.p.real
    a = sized(p, 2.0, at.real(q, q))  # (4)
    form = Fold(kind.label, a.value.real, q, p, critical.multipliers, critical.others_inside, None)
    flat = zero("a", form.a, a.scale, Status.DEGENERATE, FLAT, form)
    if flat or not parameter:
        return flat or form
    s = sized(p, 1.0, at.real(with_parameter(np.zeros(len(q)), 1.0)))
    drive = s.value.real
    crossing = zero("<p, F_p>", drive, s.scale, Status.NOT_TRANSVERSAL, BRANCHES_CROSS, form)
    return crossing or replace(form, drive=drive)
