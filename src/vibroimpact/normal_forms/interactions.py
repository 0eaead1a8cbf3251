"""Points of codimension two where two critical eigenspaces meet: LPPD, LPNS, PDNS and NSNS.

Method      Fold-flip LPPD (q0 at 1, q1 at -1):
                w -> w + a w^2 / 2 + b v^2 / 2 + ...,   v -> -v + e w v + ...,               (1)
                a = <p0, B(q0, q0)>,   b = <p0, B(q1, q1)>,   e = <p1, B(q0, q1)>.           (2)
            Fold-Neimark-Sacker LPNS (q1 at 1, q2 at nu):
                w -> w + f200 w^2 + f011 |z|^2 + f300 w^3 + f111 w |z|^2 + ...,
                z -> nu z + g110 w z + g210 w^2 z + g021 z |z|^2 + ...,                      (3)
                f200 = <p1, B(q1, q1)> / 2,  f011 = <p1, B(q2, conj q2)>,  g110 = <p2, B(q1, q2)>,
                f300 = <p1, C(q1, q1, q1) + 3 B(q1, h200)> / 6,
                f111 = <p1, C(q1, q2, conj q2) + B(q1, h011) + 2 Re B(conj q2, h110)>,
                g210 = <p2, C(q1, q1, q2) + 2 B(q1, h110) + B(q2, h200)> / 2,
                g021 = <p2, C(q2, q2, conj q2) + 2 B(q2, h011) + B(conj q2, h020)> / 2,      (4)
            with h200, h011, h110, h020 for w^2, |z|^2, w z, z^2 from (1) and (2) of terms.py.
            w -> w + alpha w^2 + beta |z|^2, z -> z + gamma w z change the cubic ones, and leave
                s = sign(f200 f011),   a = g110 / f200,   c = f300 / f200^2,
                b = (f011 g210 + g110 (f111 / 2 + Re(conj(nu) g021)) - f200 g021)
                    / (f011 f200^2).                                                         (5)
            Flip-Neimark-Sacker PDNS (q1 at -1, q2 at nu):
                w -> -w + f300 w^3 + f111 w |z|^2 + ...,
                z -> nu z + g210 w^2 z + g021 z |z|^2 + ...,                                 (6)
            with (4), h110 = -(nu I + A)^-1 B(q1, q2). Double Neimark-Sacker NSNS (q1 at nu1, q2
            at nu2):
                z1 -> nu1 z1 + f2100 z1 |z1|^2 + f1011 z1 |z2|^2 + ...,
                z2 -> nu2 z2 + g1110 z2 |z1|^2 + g0021 z2 |z2|^2 + ...,                      (7)
                f2100 = <p1, C(q1, q1, conj q1) + 2 B(q1, h1100) + B(conj q1, h2000)> / 2,
                f1011 = <p1, C(q1, q2, conj q2) + B(q1, h0011) + B(q2, h1001) + B(conj q2, h1010)>
            and g0021, g1110 with the pairs exchanged. Both are, in the amplitudes,
                r_j -> r_j (1 + p_j1 r1^2 + p_j2 r2^2),                                      (8)
                PDNS:  p = (-f300, -f111; Re(conj(nu) g210), Re(conj(nu) g021)),
                NSNS:  p = (Re(conj(nu1) f2100), Re(conj(nu1) f1011); ...).
Assumes     the critical multipliers simple and alone on the unit circle, no product of up to four
            of them 1 without need; a, b, e; f200, f011, Re(conj(nu) g110); all p_ij and det p not
            zero; each is checked
Accuracy    rounding times |p|
Fails       a Refusal where a hypothesis fails
Invariance  scaling and changes of coordinates leave a / e, the sign of b e; s, a, b, c of (5); the
            signs of p_11 and p_22, p_12 / p_22 and p_21 / p_11. For |q| = 1 the others depend on
            the coordinates by factors > 0 only. The cubic coefficient that decides which way the
            circles of the doubled orbit at LPPD are stable is not computed
Corrected   a copy of MatContM of 2020 has, for LPNS, PDNS and NSNS, 2 B(conj q, h20) + B(q, h11) in
            place of B(conj q, h20) + 2 B(q, h11), for PDNS B(h110, q2) in place of
            B(h110, conj q2), for NSNS half of f1011 and of g1110; maps whose normal form is known
            show it (tests). What it prints third for LPPD is no invariant
Reference   Kuznetsov, Meijer and van Veen, The fold-flip bifurcation (2004); Kuznetsov and Meijer,
            Remarks on interacting Neimark-Sacker bifurcations (2006); letters as in MatContM
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.critical import Critical, Refusal, not_smooth
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian
from vibroimpact.normal_forms.special_points import (
    CodimensionTwo,
    NewCurve,
    critical_multipliers,
    vanishing,
)
from vibroimpact.normal_forms.terms import Sized, along, cubic_alone, off, pair_alone, sized

UNDECIDED = "terms of higher order decide"


def fold_flip(forms: Forms) -> CodimensionTwo | Refusal:
    """Compute a, b, e of (2), and ``scaled``, a / (2 e) and b e / 2; with q0, at 1, and q1, at -1.

    Cost: d first and 3 second derivatives.
    """
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers("LPPD", A, (1.0, -1.0))
    if isinstance(found, Refusal):
        return found
    (q0, p0), (q1, p1) = ((critical.q.real, critical.p.real) for critical in found)
    a, b = sized(p0, 1.0, at.real(q0, q0)), sized(p0, 1.0, at.real(q1, q1))
    e = sized(p1, 1.0, at.real(q0, q1))  # (2)
    form = CodimensionTwo(
        "LPPD", {"a": a.value.real, "b": b.value.real, "e": e.value.real}, {"q0": q0, "q1": q1},
        found[0].multipliers, found[0].others_inside,
    )  # fmt: skip
    degenerate = vanishing(
        form,
        ("a", form.a, a.scale, UNDECIDED),
        ("b", form.b, b.scale, UNDECIDED),
        ("e", form.e, e.scale, UNDECIDED),
    )
    if degenerate:
        return degenerate
    scaled, product = (form.a / (2.0 * form.e), form.b * form.e / 2.0), form.b * form.e
    born = "a flip curve touches a fold curve, and a doubled orbit is born beside two fixed points"
    if product > 0.0:
        return form.born(
            f"{born}; the doubled orbit has a Neimark-Sacker curve that begins here.",
            NewCurve("NS", 2), scaled=scaled,
        )  # fmt: skip
    why_not = f"b e = {product:.6g} < 0: the doubled orbit is a saddle."
    return form.born(f"{born}; the doubled orbit is a saddle.", why_not=why_not, scaled=scaled)


def fold_neimark_sacker(forms: Forms) -> CodimensionTwo | Refusal:
    """Compute (4), and s, a, b, c of (5); with q1, at 1, and q2, at nu, which is ``multiplier``.

    The cubic ones are those for <p1, h200> = <p1, h011> = <p2, h110> = 0; of them only (5) does not
    depend on that choice. ``torus`` is whether f011 Re(conj(nu) g110) < 0: the circle itself has a
    Neimark-Sacker curve. Cost: d first, 22 second and 10 third derivatives.
    """
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers("LPNS", A, (1.0, None))
    if isinstance(found, Refusal):
        return found
    one, pair = found
    q1, q2, bar = one.q.real, pair.q, pair.q.conj()
    square, circle, mixed = at.real(q1, q1), at(q2, bar).real, at(q1, q2)
    f200, f011 = sized(one.p, 2.0, square), sized(one.p, 1.0, circle)
    g110 = sized(pair.p, 1.0, mixed)
    h200 = along(A, one.on_circle, one.q, one.p, square).real
    h011 = along(A, one.on_circle, one.q, one.p, circle).real
    h110 = along(A, pair.on_circle, q2, pair.p, mixed)
    f300, f111, g210, g021 = _cubic(at, A, found, (h200, h011, h110))
    numbers = {
        "multiplier": pair.on_circle,
        "f200": f200.value.real, "f011": f011.value.real, "g110": g110.value,
        "f300": f300.value.real, "f111": f111.value.real, "g210": g210.value, "g021": g021.value,
    }  # fmt: skip
    form = CodimensionTwo("LPNS", numbers, {"q1": q1, "q2": q2}, one.multipliers, one.others_inside)
    nu_bar = pair.on_circle.conjugate()
    growth = (nu_bar * form.g110).real
    whole = f011.scale + sized(one.p, 1.0, at(q2, q2)).scale
    degenerate = vanishing(
        form,
        ("f200", form.f200, f200.scale, UNDECIDED),
        ("f011", form.f011, whole, UNDECIDED),
        ("Re(conj(nu) g110)", growth, g110.scale, UNDECIDED),
    )
    if degenerate:
        return degenerate
    turned = form.g110 * (form.f111 / 2.0 + (nu_bar * form.g021).real)
    top = form.f011 * form.g210 + turned - form.f200 * form.g021
    b, c = top / (form.f011 * form.f200**2), form.f300 / form.f200**2  # (5)
    if not math.isfinite(abs(b) + abs(c)):
        return not_smooth("LPNS", "a cubic coefficient", form.multipliers)
    torus = form.f011 * growth < 0.0
    end, there = (
        (
            "turns into a two-dimensional torus on a curve that begins here",
            "is a bifurcation of circles",
        )
        if torus
        else (
            "is of saddle type and has no bifurcation of its own next to the point",
            "does not exist",
        )
    )
    return form.born(
        f"a Neimark-Sacker curve touches a fold curve; the invariant circle {end}.",
        why_not=f"no other periodic orbits are born; what could begin here {there}.",
        s=1 if form.f200 * form.f011 > 0.0 else -1, a=form.g110 / form.f200, b=b, c=c, torus=torus,
    )  # fmt: skip


def flip_neimark_sacker(forms: Forms) -> CodimensionTwo | Refusal:
    """Compute (8) of (6). Cost: d first, 22 second and 10 third derivatives."""
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers("PDNS", A, (-1.0, None))
    if isinstance(found, Refusal):
        return found
    q1, q2 = found[0].q.real, found[1].q
    h200, h011 = off(A, 1.0, at(q1, q1)).real, off(A, 1.0, at(q2, q2.conj())).real
    h110 = off(A, -found[1].on_circle, at(q1, q2))
    f300, f111, g210, g021 = _cubic(at, A, found, (h200, h011, h110))
    return _amplitudes("PDNS", found, (f300, f111), (g210, g021))


def _cubic(
    at: Multilinear,
    A: Floats,
    found: tuple[Critical, ...],
    second: tuple[Floats, Floats, Complexes],
) -> tuple[Sized, Sized, Sized, Sized]:
    """(f300, f111, g210, g021) of (4)."""
    (one, pair), (h200, h011, h110) = found, second
    q1, q2, bar = one.q.real, pair.q, pair.q.conj()
    h020 = off(A, pair.on_circle**2, at(q2, q2))
    f300 = sized(one.p, 6.0, at(q1, q1, q1), 3.0 * at(q1, h200))
    turning = 2.0 * at(bar, h110).real
    f111 = sized(one.p, 1.0, at(q1, q2, bar), at(q1, h011), turning)
    g210 = sized(pair.p, 2.0, at(q1, q1, q2), 2.0 * at(q1, h110), at(q2, h200))
    return f300, f111, g210, cubic_alone(at, q2, pair.p, h020, h011)


def double_neimark_sacker(forms: Forms) -> CodimensionTwo | Refusal:
    """Compute (8) of (7). Cost: d first, 42 second and 20 third derivatives."""
    A, at = jacobian(forms), Multilinear(forms)
    found = critical_multipliers("NSNS", A, (None, None))
    if isinstance(found, Refusal):
        return found
    first, second = found
    f2100, f1011 = _pair_row(at, A, first, second)
    g0021, g1110 = _pair_row(at, A, second, first)
    return _amplitudes("NSNS", found, (f2100, f1011), (g1110, g0021))


def _pair_row(at: Multilinear, A: Floats, own: Critical, other: Critical) -> tuple[Sized, Sized]:
    """(f2100, f1011) of (7) for the pair ``own``."""
    q, r, r_bar, nu, mu = own.q, other.q, other.q.conj(), own.on_circle, other.on_circle
    _, _, alone = pair_alone(at, A, nu, q, own.p)
    both, circle = off(A, nu * mu, at(q, r)), off(A, 1.0, at(r, r_bar)).real
    turned = off(A, nu * mu.conjugate(), at(q, r_bar))
    mixed = sized(own.p, 1.0, at(q, r, r_bar), at(q, circle), at(r, turned), at(r_bar, both))
    return alone, mixed


def _amplitudes(
    kind: str, found: tuple[Critical, ...], *rows: tuple[Sized, Sized]
) -> CodimensionTwo | Refusal:
    """The amplitude map (8) from the coefficients by rows, or the hypothesis that fails.

    ``coefficients`` are p_ij, shape (2, 2): row j is the growth of amplitude j, first that of the
    flip or of the pair with the smaller angle, as q1 and q2. ``ratios``, p_12 / p_22 and
    p_21 / p_11, do not depend on scales. ``simple`` is whether p_11 p_22 > 0: the motion with both
    amplitudes has no further bifurcation.
    """
    one, two = found
    bars = one.on_circle.conjugate(), two.on_circle.conjugate()
    p = np.array(
        [[(bar * part.value).real for part in row] for bar, row in zip(bars, rows, strict=True)]
    )
    sizes = [max(part.scale for part in row) for row in rows]
    form = CodimensionTwo(
        kind, {"coefficients": p}, {"q1": one.q, "q2": two.q}, one.multipliers, one.others_inside
    )
    checks = [
        (f"p_{i + 1}{j + 1}", float(p[i, j]), sizes[i], UNDECIDED)
        for i in range(2)
        for j in range(2)
    ]
    determinant = float(p[0, 0] * p[1, 1] - p[0, 1] * p[1, 0])
    checks.append(("det p", determinant, 2.0 * sizes[0] * sizes[1], UNDECIDED))
    if degenerate := vanishing(form, *checks):
        return degenerate
    simple = bool(p[0, 0] * p[1, 1] > 0.0)
    numbers: dict[str, Any] = {
        "ratios": (float(p[0, 1] / p[1, 1]), float(p[1, 0] / p[0, 0])),
        "simple": simple,
    }
    more = "" if simple else ", which can have a further bifurcation"
    if kind == "PDNS":
        born = "the doubled orbit, the circle, and a doubled circle where both amplitudes live"
        return form.born(f"{born}{more}.", NewCurve("NS", 2), **numbers)
    return form.born(
        f"two circles, and a two-dimensional torus where both amplitudes live{more}.",
        why_not="no periodic orbits are born; the curves that begin here are bifurcations of circles.",
        **numbers,
    )
