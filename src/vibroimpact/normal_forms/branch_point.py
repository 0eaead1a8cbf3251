"""Branch point of a map with multiplier +1: where two curves of fixed points cross.

Method      With x = x0 + q w + x_p dp + ..., (I - A) x_p = F_p, <p, x_p> = 0, X = (x_p, 1), the map
            on the centre manifold is
                w -> w + a w^2 + b w dp + c dp^2 + e w^3 + ...,                              (1)
                a = <p, B(q, q)> / 2,  b = <p, D^2 F[q, X]>,  c = <p, D^2 F[X, X]> / 2,      (2)
                e = <p, C(q, q, q) + 3 B(q, h2)> / 6,                                        (3)
                (I - A) h2 = B(q, q) - 2 a q,  <p, h2> = 0.
            Transcritical (a != 0): two curves  w = s dp,  a s^2 + b s + c = 0, on which the
            multiplier is 1 + (2 a s + b) dp.                                                (4)
            Pitchfork (a = 0): one curve w = -c dp / b with multiplier 1 + b dp, and
                w^2 = -b dp / e > 0                                                          (5)
            on the other, with multiplier 1 - 2 b dp.
Assumes     multiplier 1 simple, no other on the unit circle, <p, F_p> = 0, b^2 > 4 a c,
            for a pitchfork e != 0; each is checked
Accuracy    coefficients: rounding times |p|. Tangents are exact to that; (5) to a relative error of
            order sqrt(dp), of order dp where a symmetry makes it a pitchfork
Fails       a Refusal with the hypothesis that does not hold
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 4.2, 7.4 and 10.2
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import AnyComplexes, Floats
from vibroimpact.normal_forms.critical import (
    HALF_OF_THE_DIGITS,
    Critical,
    Refusal,
    Status,
    critical_multiplier,
    zero,
)
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian, with_parameter
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.terms import along, sized

FOLD = "the parameter acts along q (<p, F_p> is not zero): a fold, not a branch point."
NO_CROSSING = "no two curves cross with different tangents"
UNDECIDED = "the cubic term does not decide"


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """Normal form (1) at a transcritical point or a pitchfork.

    Attributes
    ----------
    kind
        Label of the kind.
    a, b, c, e
        Its coefficients for |q| = 1; a = 0 for a pitchfork.
    q, p
        Critical eigenvectors, real, shape (dimension,).
    drift
        x_p, shape (dimension,).
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether every multiplier but 1 lies inside the unit circle.
    """

    kind: str
    a: float
    b: float
    c: float
    e: float
    q: Floats = field(repr=False)
    p: Floats = field(repr=False)
    drift: Floats = field(repr=False)
    multipliers: AnyComplexes = field(repr=False)
    others_inside: bool

    @property
    def pitchfork(self) -> bool:
        """Whether a = 0: the second curve is vertical and bends to one side."""
        return self.a == 0.0

    @property
    def slopes(self) -> tuple[float, ...]:
        """dw/dp of the curves through the point: two (4), or one for a pitchfork."""
        if self.pitchfork:
            return (-self.c / self.b,)
        root = math.copysign(math.sqrt(self.b**2 - 4.0 * self.a * self.c), self.b)
        first = -(self.b + root) / (2.0 * self.a)  # without cancellation
        second = -2.0 * self.c / (self.b + root)
        return (first, second)

    @property
    def tangents(self) -> Floats:
        """dx/dp of the same curves, shape (2 or 1, dimension)."""
        return np.outer(self.slopes, self.q) + self.drift

    @property
    def multiplier_slopes(self) -> tuple[float, ...]:
        """Derivative of the critical multiplier by the parameter along the same curves."""
        return tuple(2.0 * self.a * s + self.b for s in self.slopes)

    @property
    def supercritical(self) -> bool:
        """Whether e < 0: the pitchfork's new fixed points attract on the centre manifold."""
        return self._forked() < 0.0

    @property
    def side(self) -> int:
        """+1 or -1: the pitchfork's new fixed points exist for dp of this sign."""
        return int(math.copysign(1.0, -self.b * self._forked()))

    def size(self, dp: float) -> float:
        """|w| of the pitchfork's new fixed points (5); nan on the side where there are none."""
        squared = -self.b * dp / self._forked()
        return math.sqrt(squared) if squared >= 0.0 else math.nan

    def points(self, dp: float) -> Floats:
        """The pitchfork's new fixed points to leading order, as displacements (2, dimension)."""
        return np.asarray(np.outer([self.size(dp), -self.size(dp)], self.q))

    def _forked(self) -> float:
        if not self.pitchfork:
            raise InvalidParameterError(
                f"a = {self.a}: only a pitchfork (a = 0) has a side and a size. Of a transcritical "
                "point take slopes or tangents."
            )
        return self.e


def branch_point(kind: PointKind, forms: Forms) -> BranchPoint | Refusal:
    """Compute the normal form at a branch point with multiplier +1, from forms with the parameter.

    Cost: d + 1 first, 4 second and 1 third derivative.
    """
    A = jacobian(forms)
    critical = critical_multiplier(kind, A)
    if isinstance(critical, Refusal):
        return critical
    at, q, p = Multilinear(forms), critical.q.real, critical.p.real
    push = at.real(with_parameter(np.zeros(len(q)), 1.0))
    drive = sized(p, 1.0, push)
    if abs(drive.value) > HALF_OF_THE_DIGITS * drive.scale:
        return Refusal(kind.label, Status.NOT_CRITICAL, FOLD, critical.multipliers)
    form, a_scale, scales = _coefficients(kind, at, A, critical, push)
    fork = abs(form.a) <= HALF_OF_THE_DIGITS * a_scale
    form = replace(form, a=0.0) if fork else form
    spread = form.b**2 - 4.0 * form.a * form.c
    name, crossing = "b^2 - 4 a c", max(spread, 0.0)
    tangent = zero(name, crossing, scales[0], Status.NOT_TRANSVERSAL, NO_CROSSING, form)
    undecided = zero("e", form.e, scales[1], Status.DEGENERATE, UNDECIDED, form) if fork else None
    return tangent or undecided or form


def _coefficients(
    kind: PointKind, at: Multilinear, A: Floats, critical: Critical, push: Floats
) -> tuple[BranchPoint, float, tuple[float, float]]:
    """Normal form, and the sizes of the terms of a, and of b^2 - 4 a c and e."""
    q, p = critical.q.real, critical.p.real
    drift = along(A, 1.0, q, p, push)
    X, bend = with_parameter(drift, 1.0), at.real(q, q)
    a, b, c = sized(p, 2.0, bend), sized(p, 1.0, at.real(q, X)), sized(p, 2.0, at.real(X, X))  # (2)
    e = sized(p, 6.0, at.real(q, q, q), 3.0 * at.real(q, along(A, 1.0, q, p, bend)))  # (3)
    form = BranchPoint(
        kind=kind.label,
        a=a.value.real,
        b=b.value.real,
        c=c.value.real,
        e=e.value.real,
        q=q,
        p=p,
        drift=drift,
        multipliers=critical.multipliers,
        others_inside=critical.others_inside,
    )
    return form, a.scale, (b.scale**2 + 4.0 * a.scale * c.scale, e.scale)
