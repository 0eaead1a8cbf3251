"""Flows that stand for the half map near its resonances 1:4 and 1:3, and the sectors around these.

Equation    per iterate of H, in a frame that turns by nu_0, the root of one at the resonance, with
            mu = log(nu / nu_0), nu the multiplier of the fixed point near nu_0:
            1:4     z' = mu z - i c z |z|^2 - i d conj(z)^3                                      (1)
            1:3     z' = mu z + b' conj(z)^2 + c' z |z|^2,
                    b' = conj(nu_0) b,  c' = conj(nu_0) c - |b|^2                                (2)
            of 1:4 two fold lines of points of period four bound a sector if |A| > 1; of 1:3 a
            circle exists from Re mu = 0 to where it meets the saddle of period three,
                    Re mu = -Re c' / (2 |b|^2) (Im mu)^2                                         (3)
Method      (1) and (2): the terms of the time-one map up to third order are those of H; (3): along
            the triangle of the saddle, of which the mean of |z|^2 is a quarter of that at a corner,
            the mean divergence 2 Re mu + 4 Re c' |z|^2 is zero
Assumes     mu is small: first terms of a series
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 9.5.3 and 9.5.4
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes
from vibroimpact.normal_forms.strong_resonance import CUBE_ROOT, OneToFour, OneToThree

STABLE_BETWEEN = "stable, between the folds"
SHARES = tuple(k / 8.0 for k in range(1, 9))  # of a line in the plane of mu
INNER = 4  # Runge-Kutta steps between points


class Place(NamedTuple):
    """A sector in words, with mu in the middle of it."""

    words: str
    mu: complex


def along(size: float, direction: complex) -> Complexes:
    """Return mu along a half-line, up to twice the size."""
    return np.array([2.0 * size * share * direction for share in SHARES], dtype=np.complex128)


@dataclass(frozen=True)
class FourFlow:
    """Flow (1)."""

    form: OneToFour

    order = 4
    root = 1j
    size = 0.002  # |mu| of the portraits
    length = 6.0  # of a trajectory, in units of 1 / |mu|

    @property
    def unit(self) -> float:
        """Typical |z|."""
        return math.sqrt(self.size / abs(self.form.c))

    def rate(self, mu: complex, z: Complexes) -> Complexes:
        """Return z'."""
        turned: Complexes = (
            mu * z - 1j * self.form.c * z * np.abs(z) ** 2 - 1j * self.form.d * z.conj() ** 3
        )
        return turned

    def periodic(self, mu: complex) -> Complexes:
        """Return the points of period four."""
        return self.form.period_four(mu)

    def lines(self) -> list[Complexes]:
        """Return mu along each half-line of folds."""
        return [along(self.size, d) for d in self.form.fold_directions]

    def places(self) -> list[Place]:
        """Return the sectors, from the stable side on with falling argument of mu."""
        if not self.form.folds_exist:
            named = [
                ("fixed point stable", math.pi),
                ("unstable, near the curve", 0.47 * math.pi),
                ("unstable, far from it", 0.0),
                ("unstable, near the curve", -0.47 * math.pi),
            ]
        else:
            folds = [cmath.phase(d) for d in self.form.fold_directions]
            cuts = sorted([-math.pi / 2.0, math.pi / 2.0, *folds], reverse=True)
            ends = [cuts[-1] + 2.0 * math.pi, *cuts]
            middles = [(a + b) / 2.0 for a, b in pairwise(ends)]
            named = [(self._words(middle), middle) for middle in middles]
        return [Place(words, self.size * cmath.exp(1j * angle)) for words, angle in named]

    def _words(self, angle: float) -> str:
        """Return what is left and right of the Neimark-Sacker curve, and of the folds."""
        stable = math.cos(angle) < 0.0
        off = cmath.phase(cmath.exp(1j * angle) / -self.form.scaled)
        between = abs(off) < math.asin(1.0 / abs(self.form.scaled))
        if stable and not between:
            return "fixed point stable"
        if stable:
            return STABLE_BETWEEN
        return f"unstable, {'between' if between else 'outside'} the folds"


@dataclass(frozen=True)
class ThreeFlow:
    """Flow (2)."""

    form: OneToThree

    order = 3
    root = CUBE_ROOT
    size = 0.03
    length = 60.0

    @property
    def unit(self) -> float:
        """Distance of the saddle of period three, to first order."""
        return self.size / abs(self.form.b)

    @property
    def quadratic(self) -> complex:
        """Return b'."""
        return self.root.conjugate() * self.form.b

    @property
    def cubic(self) -> complex:
        """Return c'."""
        return self.root.conjugate() * self.form.c - abs(self.form.b) ** 2

    def rate(self, mu: complex, z: Complexes) -> Complexes:
        """Return z'."""
        turned: Complexes = (
            mu * z + self.quadratic * z.conj() ** 2 + self.cubic * z * np.abs(z) ** 2
        )
        return turned

    def periodic(self, mu: complex) -> Complexes:
        """Return the points of the saddle of period three: mu + c' r^2 = -b' r exp(-3 i angle)."""
        r = abs(mu) / abs(self.quadratic)
        for _ in range(50):  # contracts by the ratio of the cubic term to the linear one
            r = abs(mu + self.cubic * r * r) / abs(self.quadratic)
        angle = -cmath.phase(-(mu + self.cubic * r * r) / self.quadratic) / 3.0
        z = r * cmath.exp(1j * angle)
        return np.array([z * self.root**k for k in range(3)], dtype=np.complex128)

    def end_of_circle(self, imaginary: float) -> complex:
        """Return mu where the circle meets the saddle (3)."""
        return complex(self._parabola * imaginary**2, imaginary)

    @property
    def _parabola(self) -> float:
        return -self.cubic.real / (2.0 * abs(self.form.b) ** 2)

    def lines(self) -> list[Complexes]:
        """Return mu along both branches of (3)."""
        up = [self.end_of_circle(mu.imag) for mu in along(self.size, 1j)]
        return [np.array(up), np.conj(up)]

    def places(self) -> list[Place]:
        """Return the sectors, from the stable side on with falling argument of mu."""
        half = self.end_of_circle(self.size) / 2.0
        attracting = self.cubic.real < 0.0
        with_circle = "unstable, circle" if attracting else "stable, circle"
        up = complex(half.real, self.size)
        stable, unstable = (
            Place("fixed point stable", -self.size + 0j),
            Place("unstable", self.size + 0j),
        )
        beside = [Place(with_circle, up), Place(with_circle, up.conjugate())]
        return [stable, beside[0], unstable, beside[1]]


Flow = FourFlow | ThreeFlow


def flow_at(form: OneToFour | OneToThree) -> Flow:
    """Return the flow of a normal form."""
    return FourFlow(form) if isinstance(form, OneToFour) else ThreeFlow(form)


def solutions(
    flow: Flow, mu: complex, z: Complexes, step: float, count: int, limit: float
) -> Complexes:
    """Return solutions at multiples of a step, shape (starts, count); they end beyond a limit of |z|."""
    h = step / INNER
    rows = [z]
    for _ in range(count - 1):
        w = rows[-1]
        for _ in range(INNER):
            k1 = flow.rate(mu, w)
            k2 = flow.rate(mu, w + h / 2.0 * k1)
            k3 = flow.rate(mu, w + h / 2.0 * k2)
            k4 = flow.rate(mu, w + h * k3)
            w = w + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        rows.append(np.where(np.abs(w) < limit, w, np.nan))
    return np.array(rows).T
