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
            A point that is located on a curve, where the coefficient of codimension one changes its
            sign, is one whatever is left of the coefficient: all of its terms may vanish with it
Accuracy    rounding times |p|
Fails       a Refusal where a hypothesis fails, where the coefficient of codimension one is not
            zero, or c of (1) is
Invariance  the sign of c in (1); that c in (2) and Re(d) in (3) vanish
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 9.2, 9.3 and 9.4
"""

from __future__ import annotations

import math

from vibroimpact._core.types import Complexes
from vibroimpact.normal_forms.codimension_one import NS, PD, SN
from vibroimpact.normal_forms.critical import Refusal, Status, not_smooth
from vibroimpact.normal_forms.flip_fold import Flip, flip_coefficient
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.neimark_sacker import NeimarkSacker, ns_coefficient
from vibroimpact.normal_forms.special_points import (
    AT_THE_POINT,
    CodimensionTwo,
    NewCurve,
    critical_multipliers,
    vanishing,
)
from vibroimpact.normal_forms.terms import along, sized

FIFTH = "the coefficient of fifth order takes fifth derivatives, which are not computed"


def cusp(kind: PointKind, forms: Forms, *, located: bool = False) -> CodimensionTwo | Refusal:
    """Compute c of (1), and a, about zero, that locates the point; with q, p and h2.

    Cost: d first, 2 second and 1 third derivative.
    """
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
    generic = _not_zero(
        kind.label, name, a.value.real, a.scale, critical.multipliers, located=located
    )
    if generic:
        return generic
    form = CodimensionTwo(
        kind.label, {"c": c.value.real, "a": a.value.real}, {"q": q, "p": p, "h2": h2},
        critical.multipliers, critical.others_inside,
    )  # fmt: skip
    node, saddle = ("attract", "repels") if form.c < 0.0 else ("repel", "attracts")
    return vanishing(form, ("c", form.c, c.scale, "the cubic term does not decide")) or form.born(
        "two fold curves meet in a cusp; between them there are three fixed points, of which, "
        f"in the critical direction, the outer two {node} and the middle one {saddle}.",
        why_not="the two fold curves that meet here are one curve, which passes through the point.",
    )


def generalised_flip(
    kind: PointKind, forms: Forms, *, located: bool = False
) -> CodimensionTwo | Refusal:
    """Check that c of (2) vanishes next to ``scale``, the size of its terms; with q, p and h2.

    On which side the fold curve begins is not known. Cost: d first, 2 second and 1 third derivative.
    """
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers(kind, A)
    if isinstance(found, Refusal):
        return found
    form, scale = flip_coefficient(PD, at, A, found[0])
    name = "the cubic coefficient c"
    generic = _not_zero(kind.label, name, form.c, scale, form.multipliers, form, located=located)
    return generic or CodimensionTwo(
        kind.label, {"c": form.c, "scale": scale}, {"q": form.q, "p": form.p, "h2": form.h2},
        form.multipliers, form.others_inside,
        f"the cubic coefficient of the flip vanishes (c = {form.c:.3g} of {scale:.3g}): "
        "period doubling turns from super- to subcritical, and a fold curve of the doubled "
        f"orbit begins, tangent to the flip curve; {FIFTH}.",
        (NewCurve(SN.label, 2),),
    )  # fmt: skip


def chenciner(kind: PointKind, forms: Forms, *, located: bool = False) -> CodimensionTwo | Refusal:
    """Check that Re(d) of (3) vanishes next to ``scale``; with nu as ``multiplier``, q, p, h20, h11.

    On which side the circles exist is not known. Cost: d first, 9 second and 4 third derivatives.
    """
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers(kind, A)
    if isinstance(found, Refusal):
        return found
    form, scale = ns_coefficient(NS, at, A, found[0])
    name = "the first Lyapunov coefficient Re(d)"
    generic = _not_zero(
        kind.label, name, form.d.real, scale, form.multipliers, form, located=located
    )
    return generic or CodimensionTwo(
        kind.label, {"multiplier": form.multiplier, "d": form.d, "scale": scale},
        {"q": form.q, "p": form.p, "h20": form.h20, "h11": form.h11},
        form.multipliers, form.others_inside,
        f"the first Lyapunov coefficient vanishes (Re d = {form.d.real:.3g} of "
        f"{scale:.3g}): an attracting and a repelling invariant circle exist side by side "
        f"and meet in a fold of circles; {FIFTH}.",
        why_not="what begins here is a curve of folds of invariant circles, not of periodic orbits: "
        "circles must be continued.",
    )  # fmt: skip


def _not_zero(
    kind: str,
    name: str,
    value: float,
    scale: float,
    multipliers: Complexes,
    form: Flip | NeimarkSacker | None = None,
    *,
    located: bool,
) -> Refusal | None:
    """Refuse a coefficient that is not finite, or neither located nor nothing next to the size of its terms."""
    if not math.isfinite(value):
        return not_smooth(kind, name, multipliers)
    if located or abs(value) <= AT_THE_POINT * scale:
        return None
    reason = f"{kind} needs {name} to vanish; it is {value:.6g}: a point of codimension one."
    return Refusal(kind, Status.NOT_CRITICAL, reason, multipliers, form)
