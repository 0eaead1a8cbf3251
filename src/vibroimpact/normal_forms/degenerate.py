"""Points of codimension two where a coefficient of codimension one vanishes: CP, GPD, CH.

Method      Cusp, on a fold curve (flip_fold.py, a = 0):
                w -> w + c w^3 + ...,  (I - A) h2 = B(q, q) - <p, B(q, q)> q,  <p, h2> = 0,
                c = <p, C(q, q, q) + 3 B(q, h2)> / 6.                                        (1)
            Generalised flip, on a period-doubling curve: (2) of flip_fold.py vanishes,
                w -> -w + c w^3 + e w^5 + ...,  c = 0.                                       (2)
            Chenciner point, on a Neimark-Sacker curve: (3) of neimark_sacker.py has Re(d) = 0,
                z -> nu z (1 + d |z|^2 + f |z|^4) + ...,  Re(d) = 0.                         (3)
Assumes     the critical multipliers simple and alone on the unit circle; for (3) nu^q != 1,
            q <= 4; each is checked. In (2) and (3) e != 0 and Re(f) != 0, which is not checked:
            they take fifth derivatives, and forms have three
Accuracy    rounding times |p|
Fails       a Refusal where a hypothesis fails, where the coefficient of codimension one is not
            zero, or c of (1) is
Invariance  the sign of c in (1); that c in (2) and Re(d) in (3) vanish
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 9.2, 9.3 and 9.4
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.codimension_one import NS, PD, SN
from vibroimpact.normal_forms.critical import Refusal, Status, not_smooth
from vibroimpact.normal_forms.flip_fold import Flip, flip_coefficient
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.neimark_sacker import NeimarkSacker, ns_coefficient
from vibroimpact.normal_forms.special_points import (
    AT_THE_POINT,
    NO_CURVES,
    NewCurve,
    critical_multipliers,
    vanishing,
)
from vibroimpact.normal_forms.terms import along, sized

FIFTH = "the coefficient of fifth order takes fifth derivatives, which are not computed"


@dataclass(frozen=True)
class Cusp:
    """Normal form (1) at a cusp.

    Attributes
    ----------
    kind
        Label of the kind.
    c
        Cubic coefficient for |q| = 1.
    a
        Quadratic coefficient that the point is located by, about zero.
    q, p, h2
        Critical eigenvectors and second-order term, real, shape (dimension,).
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether every multiplier but 1 lies inside the unit circle.
    """

    kind: str
    c: float
    a: float
    q: Floats = field(repr=False)
    p: Floats = field(repr=False)
    h2: Floats = field(repr=False)
    multipliers: Complexes = field(repr=False)
    others_inside: bool

    switchable = NO_CURVES
    why_not = "the two fold curves that meet here are one curve, which passes through the point."

    @property
    def meaning(self) -> str:
        """What is born: three fixed points between the two fold curves."""
        node, saddle = ("attract", "repels") if self.c < 0.0 else ("repel", "attracts")
        return (
            "two fold curves meet in a cusp; between them there are three fixed points, of which, "
            f"in the critical direction, the outer two {node} and the middle one {saddle}."
        )


@dataclass(frozen=True)
class GeneralisedFlip:
    """Flip whose cubic coefficient vanishes (2).

    Attributes
    ----------
    kind
        Label of the kind.
    c, scale
        The coefficient that vanishes, and the size of the terms whose sum it is.
    q, p, h2
        Critical eigenvectors and second-order term, real, shape (dimension,).
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether every multiplier but -1 lies inside the unit circle.
    fifth
        Coefficient e of (2): None, not computed.
    """

    kind: str
    c: float
    scale: float
    q: Floats = field(repr=False)
    p: Floats = field(repr=False)
    h2: Floats = field(repr=False)
    multipliers: Complexes = field(repr=False)
    others_inside: bool
    fifth: float | None = None

    switchable = (NewCurve(SN.label, 2),)
    why_not = ""

    @property
    def meaning(self) -> str:
        """What is born: a fold curve of the doubled orbit; on which side is not known."""
        return (
            f"the cubic coefficient of the flip vanishes (c = {self.c:.3g} of {self.scale:.3g}): "
            "period doubling turns from super- to subcritical, and a fold curve of the doubled "
            f"orbit begins, tangent to the flip curve; {FIFTH}."
        )


@dataclass(frozen=True)
class Chenciner:
    """Neimark-Sacker point whose first Lyapunov coefficient vanishes (3).

    Attributes
    ----------
    kind
        Label of the kind.
    multiplier
        nu, |nu| = 1, 0 < arg(nu) < pi.
    d
        The coefficient of codimension one: its real part vanishes.
    scale
        Size of the terms whose sum d is.
    q, p
        Critical eigenvectors, shape (dimension,).
    h20, h11
        Second-order terms of the centre manifold, shape (dimension,); h11 is real.
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether every multiplier but the pair lies inside the unit circle.
    fifth
        Second Lyapunov coefficient: None, not computed.
    """

    kind: str
    multiplier: complex
    d: complex
    scale: float
    q: Complexes = field(repr=False)
    p: Complexes = field(repr=False)
    h20: Complexes = field(repr=False)
    h11: Floats = field(repr=False)
    multipliers: Complexes = field(repr=False)
    others_inside: bool
    fifth: complex | None = None

    switchable = NO_CURVES
    why_not = (
        "what begins here is a curve of folds of invariant circles, not of periodic orbits: "
        "circles must be continued."
    )

    @property
    def meaning(self) -> str:
        """What is born: folds of invariant circles; on which side is not known."""
        return (
            f"the first Lyapunov coefficient vanishes (Re d = {self.d.real:.3g} of "
            f"{self.scale:.3g}): an attracting and a repelling invariant circle exist side by side "
            f"and meet in a fold of circles; {FIFTH}."
        )


def cusp(kind: PointKind, forms: Forms) -> Cusp | Refusal:
    """Compute the normal form (1). Cost: d first, 2 second and 1 third derivative."""
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers(kind, A)
    if isinstance(found, Refusal):
        return found
    (critical,) = found
    q, p = critical.q.real, critical.p.real
    bend = at.real(q, q)
    h2 = along(A, critical.on_circle, critical.q, critical.p, bend).real
    a, c = sized(p, 2.0, bend), sized(p, 6.0, at.real(q, q, q), 3.0 * at.real(q, h2))  # (1)
    name = "the quadratic coefficient a"
    generic = _not_zero(kind.label, name, a.value.real, a.scale, critical.multipliers)
    if generic:
        return generic
    form = Cusp(
        kind=kind.label,
        c=c.value.real,
        a=a.value.real,
        q=q,
        p=p,
        h2=h2,
        multipliers=critical.multipliers,
        others_inside=critical.others_inside,
    )
    return vanishing(form, ("c", form.c, c.scale, "the cubic term does not decide")) or form


def generalised_flip(kind: PointKind, forms: Forms) -> GeneralisedFlip | Refusal:
    """Check that c of (2) vanishes. Cost: d first, 2 second and 1 third derivative."""
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers(kind, A)
    if isinstance(found, Refusal):
        return found
    form, scale = flip_coefficient(PD, at, A, found[0])
    name = "the cubic coefficient c"
    generic = _not_zero(kind.label, name, form.c, scale, form.multipliers, form)
    return generic or GeneralisedFlip(
        kind=kind.label,
        c=form.c,
        scale=scale,
        q=form.q,
        p=form.p,
        h2=form.h2,
        multipliers=form.multipliers,
        others_inside=form.others_inside,
    )


def chenciner(kind: PointKind, forms: Forms) -> Chenciner | Refusal:
    """Check that Re(d) of (3) vanishes. Cost: d first, 9 second and 4 third derivatives."""
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers(kind, A)
    if isinstance(found, Refusal):
        return found
    form, scale = ns_coefficient(NS, at, A, found[0])
    name = "the first Lyapunov coefficient Re(d)"
    generic = _not_zero(kind.label, name, form.d.real, scale, form.multipliers, form)
    return generic or Chenciner(
        kind=kind.label,
        multiplier=form.multiplier,
        d=form.d,
        scale=scale,
        q=form.q,
        p=form.p,
        h20=form.h20,
        h11=form.h11,
        multipliers=form.multipliers,
        others_inside=form.others_inside,
    )


def _not_zero(
    kind: str,
    name: str,
    value: float,
    scale: float,
    multipliers: Complexes,
    form: Flip | NeimarkSacker | None = None,
) -> Refusal | None:
    """Refuse a coefficient that does not vanish next to the size of its terms, or is not finite."""
    if abs(value) <= AT_THE_POINT * scale:
        return None
    if not math.isfinite(value):
        return not_smooth(kind, name, multipliers)
    reason = f"{kind} needs {name} to vanish; it is {value:.6g}: a point of codimension one."
    return Refusal(kind, Status.NOT_CRITICAL, reason, multipliers, form)
