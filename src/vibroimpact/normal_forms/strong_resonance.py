"""Critical coefficients at the strong resonances 1:1, 1:2, 1:3 and 1:4 (codimension two).

Method      1:1, a double multiplier 1 with one eigenvector. With A q0 = q0, A q1 = q1 + q0,
            A^T p0 = p0, A^T p1 = p1 + p0, <p0, q1> = <p1, q0> = 1, <p1, q1> = <q0, q1> = 0:
                w0 -> w0 + w1,   w1 -> w1 + a w0^2 + b w0 w1 + ...,                          (1)
                a = <p0, B(q0, q0)> / 2,   b = <p0, B(q0, q1)> + <p1, B(q0, q0)>.            (2)
            1:2, a double multiplier -1 with one eigenvector. With A q0 = -q0, A q1 = -q1 + q0,
            A^T p0 = -p0, A^T p1 = -p1 + p0, normalised in the same way:
                w0 -> -w0 + w1,   w1 -> -w1 + c w0^3 + d w0^2 w1 + ...,                      (3)
                h20 = (I - A)^-1 B(q0, q0),   h11 = (I - A)^-1 (B(q0, q1) + h20),
                c = <p0, g> / 6,  g = C(q0, q0, q0) + 3 B(q0, h20),
                d = <p0, C(q0, q0, q1) + 2 B(q0, h11) + B(q1, h20)> / 2 + <p1, g> / 2.       (4)
            1:3, nu = exp(2 pi i / 3), which conj(nu)^2 equals:
                z -> nu z + b conj(z)^2 + c z |z|^2 + ...,                                   (5)
                (conj(nu) I - A) h20 = B(q, q) - 2 conj(b) conj(q),  <conj p, h20> = 0,
                h11 = (I - A)^-1 B(q, conj q),   b = <p, B(conj q, conj q)> / 2,
                c = <p, C(q, q, conj q) + 2 B(q, h11) + B(conj q, h20)> / 2.                 (6)
            1:4, nu = i, which conj(nu)^3 equals:
                z -> i z + c z |z|^2 + d conj(z)^3 + ...,                                    (7)
                h20 = -(I + A)^-1 B(q, q),   h11 = (I - A)^-1 B(q, conj q),
                c = <p, C(q, q, conj q) + 2 B(q, h11) + B(conj q, h20)> / 2,
                d = <p, C(conj q, conj q, conj q) + 3 B(conj q, conj h20)> / 6.              (8)
            Where the multiplier is i exp(mu), the fourth iterate of (7) leaves those z in place,
            to leading order, with
                mu - i c |z|^2 - i d conj(z)^3 / z = 0.                                      (9)
            With A = -i c / |d| and s = |d| |z|^2 this is |mu + A s| = s: no or two s > 0, with four
            z each, if |A| > 1, and one if |A| < 1. Two meet, and both families of period four end
            in a fold, on the half-lines
                arg mu = arg(-A) +- arcsin(1 / |A|).                                        (10)
Assumes     no other multiplier on the unit circle, and a, b - 2 a; c, d + 3 c; b, the scaled real
            part; d, Re A, Im A and |A| - 1 not zero; each is checked
Accuracy    1:1 and 1:2: the double multiplier is known to half of the digits at best, but q0 and p0
            are singular vectors of A -+ I, accurate to rounding over the gap; 1:3 and 1:4: rounding
            times |p|. (9): z to a relative error of order |mu|
Fails       a Refusal where a hypothesis fails
Invariance  a change of coordinates scales q: a and b of (2) by the same factor, (4) by one factor
            > 0, |b|^2 of (6) and the real part of c conj(nu), and c and |d| of (8). Invariant are
            b / a, d / c, the scaled real part, A; the signs that decide; the points
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, section 9.5 and its section on
            critical normal forms of n-dimensional maps; the scaled coefficients are those that
            MatContM prints
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np

from vibroimpact._core.checks import check_choice
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms.critical import (
    ON_CIRCLE,
    Critical,
    Refusal,
    Status,
    critical_multiplier,
    listed,
    rough_jacobian,
)
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian
from vibroimpact.normal_forms.special_points import (
    AT_THE_POINT,
    CodimensionTwo,
    NewCurve,
    vanishing,
)
from vibroimpact.normal_forms.terms import (
    along,
    cubic_alone,
    off,
    pair_alone,
    sized,
)

CUBE_ROOT = cmath.exp(2j * math.pi / 3.0)
UNDECIDED = "higher terms decide (as in an area-preserving map)"


def fold_directions(form: CodimensionTwo) -> tuple[complex, ...]:
    """Directions mu / |mu| of the two half-lines (10) at 1:4; none where |A| < 1.

    Between them, on the side of -A, there are two orbits of period four, elsewhere none.
    """
    if abs(form.scaled) <= 1.0:
        return ()
    turn = cmath.exp(1j * math.asin(1.0 / abs(form.scaled)))
    middle = -form.scaled / abs(form.scaled)
    return middle / turn, middle * turn


def period_four(form: CodimensionTwo, mu: complex) -> Complexes:
    """The z != 0 that solve (9): points of period four.

    Parameters
    ----------
    form
        Normal form at 1:4.
    mu
        log(nu / i) of the multiplier nu near i, nonzero and small.

    Returns
    -------
    ndarray
        Shape (4 m,), m = 0, 1 or 2 orbits of four points each, the smaller orbit first; z to a
        relative error of order |mu|. ``on_pair_manifold`` of terms.py has the points of the map at
        these z, to an error of order |mu|^(3/2).
    """
    scaled, turned = form.scaled, -1j * form.d / abs(form.d)
    # |mu + A s| = s:  (|A|^2 - 1) s^2 + 2 Re(conj(A) mu) s + |mu|^2 = 0
    half, square = (scaled.conjugate() * mu).real, abs(scaled) ** 2 - 1.0
    inside = half**2 - square * abs(mu) ** 2
    if inside < 0.0 or mu == 0.0:
        return np.zeros(0, dtype=np.complex128)
    larger = -half - math.copysign(math.sqrt(inside), half)  # without cancellation
    sizes = sorted(s for s in (larger / square, abs(mu) ** 2 / larger) if s > 0.0)
    points = []
    for s in sizes:
        angle = -cmath.phase(-(scaled + mu / s) / turned) / 4.0  # (9): exp(-4 i angle)
        z = math.sqrt(s / abs(form.d)) * cmath.exp(1j * angle)
        points += [z * 1j**k for k in range(4)]
    return np.array(points, dtype=np.complex128)


def _verdict(attracts: bool) -> str:
    return f"{'attracts' if attracts else 'repels'} on the centre manifold"


def strong_resonance(kind: str, forms: Forms) -> CodimensionTwo | Refusal:
    """Compute the critical coefficients at a strong resonance.

    Parameters
    ----------
    kind
        "R1", "R2", "R3" or "R4".
    forms
        Forms of the map at its fixed point, at the critical parameters.

    Returns
    -------
    CodimensionTwo or Refusal
        R1: a, b, and ``sign`` of a(b - 2a), as MatContM prints it: < 0 where the circle of the
        Neimark-Sacker curve attracts on the centre manifold; q0, q1, the generalised eigenvector.
        R2: c, d, ``scaled`` (4 c, -2 d - 6 c): the doubled orbit is a saddle if the first is
        positive, the circle attracts if the second is negative; q0, q1. R3: b, c, ``scaled``, whose
        real part is (conj(nu) c / |b|^2 - 1) / 3, the one that is invariant: the circle attracts if
        it is negative; q, p, h20, h11. R4: c, d, whose argument depends on the phase of q, and
        ``scaled`` A: the circle attracts if Re A < 0; q, p, h20, h11.
        A refusal where the multipliers are not those of the resonance, or a coefficient vanishes.

    Raises
    ------
    InvalidParameterError
        Another kind.

    Notes
    -----
    Cost: d first derivatives; second and third ones R1 2 and 0, R2 5 and 2, R3 and R4 9 and 4.
    """
    check_choice("kind", kind, STRONG)
    return STRONG[kind](forms)


def _one_to_one(forms: Forms) -> CodimensionTwo | Refusal:
    A, at = jacobian(forms), Multilinear(forms)
    found = _double("R1", A, 1.0)
    if isinstance(found, Refusal):
        return found
    (q0, q1), (p0, p1), rest = found
    b00, b01 = at.real(q0, q0), at.real(q0, q1)
    a, mixed, turned = sized(p0, 2.0, b00), sized(p0, 1.0, b01), sized(p1, 1.0, b00)
    b = (mixed.value + turned.value).real  # (2)
    form = CodimensionTwo("R1", {"a": a.value.real, "b": b}, {"q0": q0, "q1": q1}, *rest)
    size = mixed.scale + turned.scale + 2.0 * a.scale
    circle = ("b - 2 a", b - 2.0 * form.a, size, UNDECIDED)
    sign = int(math.copysign(1.0, form.a * (b - 2.0 * form.a)))
    return vanishing(form, ("a", form.a, a.scale, "no simple fold"), circle) or form.born(
        "a Neimark-Sacker curve begins tangent to the fold curve and goes on beyond as a "
        f"neutral saddle; its circle {_verdict(sign < 0)} and ends at a homoclinic orbit "
        "of the saddle.",
        NewCurve("NS", 1), sign=sign,
    )  # fmt: skip


def _one_to_two(forms: Forms) -> CodimensionTwo | Refusal:
    A, at = jacobian(forms), Multilinear(forms)
    found = _double("R2", A, -1.0)
    if isinstance(found, Refusal):
        return found
    (q0, q1), (p0, p1), rest = found
    h20 = off(A, 1.0, at.real(q0, q0))
    h11 = off(A, 1.0, at.real(q0, q1) + h20)
    cubic = at.real(q0, q0, q0), 3.0 * at.real(q0, h20)
    mixed = at.real(q0, q0, q1), 2.0 * at.real(q0, h11), at.real(q1, h20)
    c, first, second = sized(p0, 6.0, *cubic), sized(p0, 2.0, *mixed), sized(p1, 2.0, *cubic)
    numbers = {"c": c.value.real, "d": (first.value + second.value).real}  # (4)
    form = CodimensionTwo("R2", numbers, {"q0": q0, "q1": q1}, *rest)
    scaled = 4.0 * form.c, -2.0 * form.d - 6.0 * form.c
    size = 2.0 * (first.scale + second.scale) + 6.0 * c.scale
    circle = ("2 d + 6 c", scaled[1], size, UNDECIDED)
    if degenerate := vanishing(form, ("c", form.c, c.scale, UNDECIDED), circle):
        return degenerate
    ends = f"a Neimark-Sacker curve ends on the flip curve; its circle {_verdict(scaled[1] < 0.0)}"
    if form.c < 0.0:
        born = f"{ends}; a Neimark-Sacker curve of the doubled orbit begins."
        return form.born(born, NewCurve("NS", 2), scaled=scaled)
    return form.born(
        f"{ends} and ends where it meets the doubled orbit, which is a saddle.",
        why_not=f"4 c = {scaled[0]:.6g} > 0: the doubled orbit is a saddle next to the point.",
        scaled=scaled,
    )


def _double(
    kind: str, A: Floats, target: float
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats], tuple[Complexes, bool]] | Refusal:
    """(q0, q1), (p0, p1), and all multipliers with whether the others are inside.

    Refused unless just two are ``target``, with one eigenvector.
    """
    rough = rough_jacobian(kind, A)
    if rough:
        return rough
    values = np.linalg.eigvals(A).astype(np.complex128)
    near = np.abs(values - target) <= AT_THE_POINT  # a double root splits by the square root
    others = values[~near]
    if np.count_nonzero(near) != 2 or np.any(np.abs(np.abs(others) - 1.0) <= ON_CIRCLE):
        reason = (
            f"{kind} needs exactly two multipliers {target:+.0f} and no other on the unit circle; "
            f"they are {listed(values)}."
        )
        return Refusal(kind, Status.NOT_CRITICAL, reason, values)
    left, sizes, right = np.linalg.svd(A - target * np.eye(len(A)))
    if sizes[-2] <= ON_CIRCLE:
        reason = (
            f"{kind} needs one eigenvector of the double multiplier {target:+.0f}; there are two: "
            "a point of higher codimension, or a symmetry."
        )
        return Refusal(kind, Status.OTHERS_CRITICAL, reason, values)
    q0, p0 = right[-1], left[:, -1]
    q0 = q0 * math.copysign(1.0, q0[np.argmax(np.abs(q0))])  # the sign of critical.py
    inverse = (right[:-1].T / sizes[:-1]) @ left[:, :-1].T  # without the null vectors
    q1, p1 = inverse @ q0, inverse.T @ p0
    p0, p1 = p0 / (p0 @ q1), p1 / (p0 @ q1)
    rest = values, bool(np.all(np.abs(others) < 1.0))
    return (q0, q1), (p0, p1 - (p1 @ q1) * p0), rest


def _pair(kind: str, A: Floats, target: complex, name: str) -> Critical | Refusal:
    """The simple critical pair at the resonance ``target``."""
    critical = critical_multiplier(kind, A, None)
    if isinstance(critical, Refusal):
        return critical
    if abs(critical.multiplier - target) > ON_CIRCLE:
        reason = f"{kind} needs nu = {name}; the nearest is {critical.multiplier:.9g}."
        return Refusal(kind, Status.NOT_CRITICAL, reason, critical.multipliers)
    return critical


def _one_to_three(forms: Forms) -> CodimensionTwo | Refusal:
    A, at = jacobian(forms), Multilinear(forms)
    critical = _pair("R3", A, CUBE_ROOT, "exp(2 pi i / 3)")
    if isinstance(critical, Refusal):
        return critical
    q, bar = critical.q, critical.q.conj()
    h20 = along(A, CUBE_ROOT.conjugate(), bar, critical.p.conj(), at(q, q))
    h11 = off(A, 1.0, at(q, bar)).real
    b, c = sized(critical.p, 2.0, at(bar, bar)), cubic_alone(at, q, critical.p, h20, h11)  # (6)
    form = _of_pair("R3", {"b": b.value, "c": c.value}, critical, h20, h11)
    size, quadratic = abs(b.value) ** 2, b.scale + sized(critical.p, 2.0, at(q, q)).scale
    no_saddle = vanishing(form, ("b", abs(form.b), quadratic, "no orbit of period three is born"))
    if no_saddle:
        return no_saddle
    scaled = (CUBE_ROOT.conjugate() * form.c / size - 1.0) / 3.0
    scale = (c.scale / size + 1.0) / 3.0
    real = ("Re(conj(nu) c / |b|^2 - 1) / 3", scaled.real, scale, UNDECIDED)
    return vanishing(form, real) or form.born(
        "a saddle orbit of period three shrinks to the fixed point on all sides; the circle of "
        f"the Neimark-Sacker curve {_verdict(scaled.real < 0.0)} and ends where it meets "
        "that orbit.",
        NewCurve("NS", 3, neutral_saddle=True), scaled=scaled,
    )  # fmt: skip


def _of_pair(
    kind: str, numbers: dict[str, complex], critical: Critical, h20: Complexes, h11: Floats
) -> CodimensionTwo:
    """Coefficients at a pair, with (3) of terms.py."""
    vectors = {"q": critical.q, "p": critical.p, "h20": h20, "h11": h11}
    return CodimensionTwo(kind, numbers, vectors, critical.multipliers, critical.others_inside)


def _one_to_four(forms: Forms) -> CodimensionTwo | Refusal:
    A, at = jacobian(forms), Multilinear(forms)
    critical = _pair("R4", A, 1j, "i")
    if isinstance(critical, Refusal):
        return critical
    q, bar = critical.q, critical.q.conj()
    h20, h11, c = pair_alone(at, A, 1j, q, critical.p)
    d = sized(critical.p, 6.0, at(bar, bar, bar), 3.0 * at(bar, h20.conj()))  # (8)
    form = _of_pair("R4", {"c": c.value, "d": d.value}, critical, h20, h11)
    cubic = c.scale + d.scale
    no_resonance = vanishing(form, ("d", abs(form.d), cubic, "no orbit of period four is born"))
    if no_resonance:
        return no_resonance
    scaled, scale = -1j * form.c / abs(form.d), c.scale / abs(form.d)
    wide = max(scale, d.scale / abs(form.d))
    degenerate = vanishing(
        form,
        ("Re A", scaled.real, scale, UNDECIDED),
        ("Im A", scaled.imag, scale, "the unfolding is not known"),
        ("|A| - 1", abs(scaled) - 1.0, wide, "whether folds exist is not decided"),
    )
    if degenerate:
        return degenerate
    circle = f"the circle of the Neimark-Sacker curve {_verdict(scaled.real < 0.0)}"
    if abs(scaled) > 1.0:
        born = f"two orbits of period four are born in a fold on each of two curves; {circle}."
        return form.born(born, NewCurve("SN", 4), NewCurve("SN", 4), scaled=scaled)
    return form.born(
        f"a saddle orbit of period four shrinks to the fixed point on all sides; {circle}.",
        why_not=f"|A| = {abs(scaled):.6g} < 1: one orbit of period four exists all around, without "
        "folds.",
        scaled=scaled,
    )


STRONG: dict[str, Callable[[Forms], CodimensionTwo | Refusal]] = {
    "R1": _one_to_one,
    "R2": _one_to_two,
    "R3": _one_to_three,
    "R4": _one_to_four,
}
