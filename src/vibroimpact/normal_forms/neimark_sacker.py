"""Neimark-Sacker bifurcation: first Lyapunov coefficient, and the new invariant circle.

Method      On the centre manifold x = x0 + 2 Re(q z) + Re(h20 z^2) + h11 |z|^2 + ... the map is
                z -> nu z (1 + d |z|^2) + ...,  nu = exp(i theta),                           (1)
                h20 = (nu^2 I - A)^-1 B(q, q),  h11 = (I - A)^-1 B(q, conj q),               (2)
                d = conj(nu) <p, C(q, q, conj q) + 2 B(q, h11) + B(conj q, h20)> / 2.        (3)
            With a parameter, at distance dp from the point,
                fixed point x0 + x_p dp,  x_p = (I - A)^-1 F_p,                              (4)
                nu(dp) = nu + nu_p dp,    nu_p = <p, A_p q + B(q, x_p)>,                     (5)
            so that with kappa = conj(nu) nu_p a circle |z| = r exists where
                r^2 = -Re(kappa) dp / Re(d) > 0,                                             (6)
            with the rotation per iterate
                phi = theta + Im(kappa) dp + Im(d) r^2.                                      (7)
Assumes     nu simple, no other multiplier on the unit circle, nu^q != 1 for q = 1, 2, 3, 4,
            Re(d) != 0, Re(kappa) != 0; each is checked (critical.py)
Accuracy    d: rounding, times |p| and the divisors of resonance.py. The prediction: r and
            phi - theta to a relative error of order dp; points of the circle to order dp^(3/2),
            without the second-order terms to order dp
Fails       a Refusal with the hypothesis that does not hold
Invariance  q can be scaled, and another coordinate system scales it: d -> |c|^2 d. Invariant are
            the sign of Re(d), the twist Im(d) / Re(d), nu, kappa, phi, and the circle itself; its
            size in a coordinate, 2 |q_j| r, is in the units of that coordinate
Reference   (3): Kuznetsov, Elements of Applied Bifurcation Theory, section 5.4; |q| = 1,
            <p, q> = 1, 0 < theta < pi as in MatContM
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import AnyAmount, AnyComplexes, Complexes, Floats
from vibroimpact.normal_forms.critical import (
    ON_CIRCLE,
    Critical,
    Refusal,
    Status,
    critical_multiplier,
    zero,
)
from vibroimpact.normal_forms.forms import Forms, Multilinear, jacobian
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.resonance import (
    Resonance,
    nearest_resonance,
    strong_resonances,
    warning,
)
from vibroimpact.normal_forms.terms import on_pair_manifold, pair_alone
from vibroimpact.normal_forms.unfolding import Unfolding, given, unfold

UNDECIDED = "the cubic term does not decide (a Chenciner point, or an area-preserving map)"
TOUCHES = "in this parameter the pair touches the unit circle without crossing it"


@dataclass(frozen=True, eq=False)
class NeimarkSacker:
    """Normal form (1) at a Neimark-Sacker point, and the circle it predicts.

    Attributes
    ----------
    kind
        Label of the kind.
    multiplier
        nu, |nu| = 1, 0 < arg(nu) < pi.
    d
        First Lyapunov coefficient (3), complex, for |q| = 1.
    q, p
        Critical eigenvectors, |q| = 1, <p, q> = 1, shape (dimension,).
    h20, h11
        Second-order terms (2) of the centre manifold, shape (dimension,); h11 is real.
    multipliers
        All multipliers, shape (dimension,).
    others_inside
        Whether every multiplier but nu and conj(nu) lies inside the unit circle.
    resonant_radius
        |z| at which a removed term conj(z)^2 or conj(z)^3 is as large as z: the normal form is
        valid far below. Infinite where both vanish.
    warnings
        Warnings in words; not empty next to a strong resonance.
    unfolding
        Effect of the parameter, or None if it was left out.
    """

    kind: str
    multiplier: complex
    d: complex
    q: Complexes = field(repr=False)
    p: Complexes = field(repr=False)
    h20: Complexes = field(repr=False)
    h11: Floats = field(repr=False)
    multipliers: AnyComplexes = field(repr=False)
    others_inside: bool
    resonant_radius: AnyAmount
    warnings: tuple[str, ...]
    unfolding: Unfolding | None = field(repr=False)

    @property
    def angle(self) -> float:
        """Argument theta of nu, radians, in (0, pi)."""
        return float(np.angle(self.multiplier))

    @property
    def supercritical(self) -> bool:
        """Whether Re(d) < 0: the circle attracts on the centre manifold, where |nu| > 1."""
        return self.d.real < 0.0

    @property
    def attracting(self) -> bool:
        """Whether the circle attracts in the whole space."""
        return self.supercritical and self.others_inside

    @property
    def twist(self) -> float:
        """Im(d) / Re(d), invariant under changes of coordinates."""
        return self.d.imag / self.d.real

    @property
    def resonance(self) -> Resonance:
        """Nearest p/q with q <= 12."""
        return nearest_resonance(self.angle)

    @property
    def kappa(self) -> complex:
        """conj(nu) dnu/dp: d|nu|/dp as real, d(arg nu)/dp as imaginary part."""
        return self.multiplier.conjugate() * self._unfolded().multiplier_slope

    @property
    def side(self) -> int:
        """+1 or -1: the circle exists for dp of this sign."""
        return int(math.copysign(1.0, -self.kappa.real * self.d.real))

    def radius(self, dp: float) -> float:
        """Radius |z| = r of the circle (6); nan on the side where there is none.

        Parameters
        ----------
        dp
            Parameter minus its critical value.
        """
        squared = -self.kappa.real * dp / self.d.real
        return math.sqrt(squared) if squared >= 0.0 else math.nan

    def amplitude(self, dp: float) -> Floats:
        """Half of the circle's width in each coordinate, 2 |q_j| r, shape (dimension,)."""
        return np.asarray(2.0 * np.abs(self.q) * self.radius(dp), dtype=np.float64)

    def turn(self, dp: float) -> float:
        """Angle (7) per iterate on the circle, radians; nan where there is no circle."""
        return self.angle + self.kappa.imag * dp + self.d.imag * self.radius(dp) ** 2

    def rotation_number(self, dp: float) -> float:
        """Turns per iterate on the circle; nan where there is no circle."""
        return self.turn(dp) / (2.0 * math.pi)

    def circle(self, dp: float, points: int = 128, *, order: int = 2) -> Floats:
        """Points of the predicted circle, as displacements from the critical fixed point.

        Parameters
        ----------
        dp
            Parameter minus its critical value.
        points
            Number of points, >= 1, at equal phases of z from 0.
        order
            1: 2 Re(q z), error of order dp. 2: with x_p dp and the quadratic terms of the centre
            manifold, error of order dp^(3/2).

        Returns
        -------
        ndarray
            Shape (points, dimension), in the coordinates of the map; nan where there is no circle.

        Raises
        ------
        InvalidParameterError
            ``order`` neither 1 nor 2.
        """
        if order not in (1, 2):
            raise InvalidParameterError(f"order = {order!r}: must be 1 or 2.")
        phases = 2.0 * math.pi * np.arange(points) / points
        return self.on_manifold(self.radius(dp) * np.exp(1j * phases), dp, order=order)

    def on_manifold(self, z: Complexes, dp: float, *, order: int = 2) -> Floats:
        """Points of the centre manifold at z, shape (n,), as displacements (n, dimension)."""
        if order == 1:
            return np.asarray(2.0 * np.real(np.outer(z, self.q)))
        bent = on_pair_manifold(z, self.q, self.h20, self.h11)
        return np.asarray(bent + self._unfolded().drift * dp)

    def _unfolded(self) -> Unfolding:
        return given("unfolding", self.unfolding)

    def __repr__(self) -> str:
        near = self.resonance
        verdict = "supercritical" if self.supercritical else "subcritical"
        side = f", circle for dp {'>' if self.side > 0 else '<'} 0" if self.unfolding else ""
        lines = [
            f"NeimarkSacker: nu = {self.multiplier:.9f}, angle {math.degrees(self.angle):.6f} deg, "
            f"nearest resonance {near.p}/{near.q}",
            f"  d = {self.d:.9g}: {verdict}, {'' if self.attracting else 'not '}attracting{side}",
        ]
        return "\n".join(lines + [f"  warning: {sentence}" for sentence in self.warnings])


def neimark_sacker(
    kind: PointKind, forms: Forms, *, parameter: bool = True
) -> NeimarkSacker | Refusal:
    """Compute (1) to (7) at a Neimark-Sacker point; without the parameter (1) to (3).

    Cost: d first, 9 second and 4 third derivatives; with the parameter 1 first and 4 second more.
    """
    A = jacobian(forms)
    critical = critical_multiplier(kind, A)
    if isinstance(critical, Refusal):
        return critical
    exact = strong_resonances(float(np.angle(critical.multiplier)), ON_CIRCLE)
    if exact:
        return _resonant(kind, critical, exact[0])
    at = Multilinear(forms)
    form, scale = ns_coefficient(kind, at, A, critical)
    undecided = zero("Re(d)", form.d.real, scale, Status.DEGENERATE, UNDECIDED, form)
    if undecided or not parameter:
        return undecided or form
    unfolding = unfold(at, A, critical)
    whole = replace(form, unfolding=unfolding)
    growth = whole.kappa.real
    return zero("d|nu|/dp", growth, unfolding.scale, Status.NOT_TRANSVERSAL, TOUCHES, form) or whole


def ns_coefficient(
    kind: PointKind, at: Multilinear, A: Floats, critical: Critical
) -> tuple[NeimarkSacker, float]:
    """Normal form without the parameter, and the size of the terms of d."""
    nu = critical.on_circle
    h20, h11, cubic = pair_alone(at, A, nu, critical.q, critical.p)  # (2)
    radii = _resonant_radii(at, h20, critical)
    near = strong_resonances(float(np.angle(nu)))
    form = NeimarkSacker(
        kind=kind.label,
        multiplier=nu,
        d=nu.conjugate() * cubic.value,  # (3)
        q=critical.q,
        p=critical.p,
        h20=h20,
        h11=h11,
        multipliers=critical.multipliers,
        others_inside=critical.others_inside,
        resonant_radius=min(radii.values()),
        warnings=tuple(warning(r, radii.get(r.q, math.inf)) for r in near),
        unfolding=None,
    )
    return form, cubic.scale


def _resonant_radii(at: Multilinear, h20: Complexes, critical: Critical) -> dict[int, float]:
    """|z| at which the removed conj(z)^2 (3) and conj(z)^3 (4) are as large as z."""
    nu, bar = critical.multiplier, critical.q.conj()
    cubic = critical.project(at(bar, bar, bar) + 3.0 * at(bar, h20.conj()))
    second = abs(critical.project(at(bar, bar))) / abs(nu**3 - 1.0) / 2.0
    third = abs(cubic) / abs(nu**4 - 1.0) / 6.0
    return {
        3: 1.0 / second if second > 0.0 else math.inf,
        4: 1.0 / math.sqrt(third) if third > 0.0 else math.inf,
    }


def _resonant(kind: PointKind, critical: Critical, resonance: Resonance) -> Refusal:
    reason = (
        f"nu = {critical.multiplier:.9g} is the strong resonance {resonance.p}:{resonance.q} "
        f"(|nu^{resonance.q} - 1| = {resonance.distance:.2g}): the normal form divides by zero. "
        "For a symmetric orbit take the half map, where the resonance may be weak."
    )
    return Refusal(kind.label, Status.STRONG_RESONANCE, reason, critical.multipliers)
