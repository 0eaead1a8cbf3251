"""Flows that stand for the half map near its strong resonances, and the sectors around these.

Equation    per iterate of H, in a frame that turns by nu_0, the root of one at the resonance, with
            mu = log(nu / nu_0), nu the multiplier of the fixed point near nu_0:
            1:4     z' = mu z - i c z |z|^2 - i d conj(z)^3                                      (1)
            1:3     z' = mu z + b' conj(z)^2 + c' z |z|^2,
                    b' = conj(nu_0) b,  c' = conj(nu_0) c - |b|^2                                (2)
            of 1:4 two fold lines of points of period four bound a sector if |A| > 1; of 1:3 a
            circle exists from Re mu = 0 to where it meets the saddle of period three,
                    Re mu = -Re c' / (2 |b|^2) (Im mu)^2                                         (3)
            Of the two real multipliers or the pair at 1:2 and 1:1, e1 = -mu_1 mu_2 and
            e2 = mu_1 + mu_2 are smooth in the parameters. The component w0 of -H at 1:2 moves by
                    w'' = e1 w + e2 w' + C w^3 + D w^2 w',       C = c,  D = -d - 3 c,           (4)
            and of H at 1:1, between its two fixed points, by
                    w'' = n1 + n2 w' + A w^2 + B w w',           A = a,  B = b - 2 a,            (5)
                    n1 = -e1^2 / (4 A),  n2 = e2 - B e1 / (2 A),
            with e1 < 0 and e2 of the one that is no saddle. In units of w and of time
                    1:2     x'' = m1 x + m2 x' - x^3 - x^2 x'       (C < 0, D < 0),              (6)
                    1:1     x'' = m1 + m2 x' + x^2 + x x'           (A B > 0);                   (7)
            to first order in m1 > 0, (6) has a circle round each doubled point up to m2 = m1, which
            grows to a figure eight of homoclinic orbits at m2 = 4/5 m1, and two circles round all
            down to a fold at m2 = 0.752 m1; (7) has one round the fixed point from the homoclinic
            orbit at m2 = 5/7 sqrt(-m1) to m2 = sqrt(-m1).
Method      (1), (2), (4) and (5): the terms of the time-one map up to third order, in (5) up to
            second order, are those of H; (3): along the triangle of the saddle, of which the mean
            of |z|^2 is a quarter of that at a corner, the mean divergence
            2 Re mu + 4 Re c' |z|^2 is zero
Assumes     mu, or m1 and m2, are small: first terms of a series
Notation    A point (x, x') of (6) or (7), in units in which the fixed points lie at x = -1 and 1, is
            written as a number z = x + i x', and mu = m1 + i m2
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, sections 8.4 and 9.5;
            Guckenheimer and Holmes, Nonlinear Oscillations, section 7.3; Carr, Applications of
            Centre Manifold Theory, chapter 4
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.normal_forms import CodimensionTwo, fold_directions, period_four
from vibroimpact.normal_forms.strong_resonance import CUBE_ROOT

STABLE_BETWEEN = "stable, between the folds"
SHARES = tuple(k / 8.0 for k in range(1, 9))  # of a line in the plane of mu
INNER = 2  # Runge-Kutta steps between points
RENEWED = 2  # Newton steps with slopes of their own
FIGURE_EIGHT, FOLD_OF_CIRCLES = 4.0 / 5.0, 0.752  # m2 / m1 of (6)
HOMOCLINIC = 5.0 / 7.0  # m2 / sqrt(-m1) of (7)


class Place(NamedTuple):
    """A sector in words, with mu in the middle of it."""

    words: str
    mu: complex


class Line(NamedTuple):
    """A line that theory predicts, in words, with mu along it."""

    words: str
    mus: Complexes


def along(size: float, direction: complex) -> Complexes:
    """Return mu along a half-line, up to twice the size."""
    return np.array([2.0 * size * share * direction for share in SHARES], dtype=np.complex128)


def both_sides(size: float) -> list[Complexes]:
    """Return mu along the imaginary axis from zero on: where the multiplier is on the unit circle."""
    return [along(size, d) for d in (1j, -1j)]


def logarithms(multipliers: Complexes, root: complex, count: int) -> Complexes:
    """Return log(nu / root) of the multipliers nearest to a root of one."""
    near = multipliers[np.argsort(np.abs(multipliers - root), kind="stable")[:count]]
    return np.log(near.astype(np.complex128) / root)


def smooth_pair(multipliers: Complexes, root: complex) -> tuple[float, float]:
    """Return e1 and e2 of the two multipliers nearest to 1 or -1."""
    first, second = map(complex, logarithms(multipliers, root, 2))
    return -(first * second).real, (first + second).real


@dataclass(frozen=True)
class FourFlow:
    """Flow (1)."""

    form: CodimensionTwo

    order = 4
    root = 1j
    size = 0.002  # |mu| of the portraits
    starts = 4  # on each radius, within a quarter of a turn
    iterates = 1.0  # of H in a unit of time

    @property
    def unit(self) -> float:
        """Typical |z|."""
        return math.sqrt(self.size / abs(self.form.c))

    @property
    def duration(self) -> float:
        """Iterates of a trajectory."""
        return 6.0 / self.size

    def mu_of(self, multipliers: Complexes) -> complex:
        """Return mu of the multiplier near i."""
        return complex(logarithms(multipliers, self.root, 1)[0])

    def rate(self, mu: complex, z: Complexes) -> Complexes:
        """Return z'."""
        turned: Complexes = (
            mu * z - 1j * self.form.c * z * np.abs(z) ** 2 - 1j * self.form.d * z.conj() ** 3
        )
        return turned

    def periodic(self, mu: complex) -> Complexes:
        """Return the points of period four."""
        return period_four(self.form, mu)

    def torus(self) -> list[Complexes]:
        """Return mu along the Neimark-Sacker curve."""
        return both_sides(self.size)

    def lines(self) -> list[Line]:
        """Return the half-lines of folds."""
        words = "folds, predicted"
        return [Line(words, along(self.size, d)) for d in fold_directions(self.form)]

    def places(self) -> list[Place]:
        """Return the sectors, from the stable side on with falling argument of mu."""
        if not fold_directions(self.form):
            named = [
                ("fixed point stable", math.pi),
                ("unstable, near the curve", 0.47 * math.pi),
                ("unstable, far from it", 0.0),
                ("unstable, near the curve", -0.47 * math.pi),
            ]
        else:
            folds = [cmath.phase(d) for d in fold_directions(self.form)]
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

    form: CodimensionTwo

    order = 3
    root = CUBE_ROOT
    size = 0.03
    starts = 4
    iterates = 1.0

    @property
    def unit(self) -> float:
        """Distance of the saddle of period three, to first order."""
        return float(self.size / abs(self.form.b))

    @property
    def duration(self) -> float:
        """Iterates of a trajectory."""
        return 60.0 / self.size

    def mu_of(self, multipliers: Complexes) -> complex:
        """Return mu of the multiplier near nu_0."""
        return complex(logarithms(multipliers, self.root, 1)[0])

    @property
    def quadratic(self) -> complex:
        """Return b'."""
        return complex(self.root.conjugate() * self.form.b)

    @property
    def cubic(self) -> complex:
        """Return c'."""
        return complex(self.root.conjugate() * self.form.c - abs(self.form.b) ** 2)

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
        return float(-self.cubic.real / (2.0 * abs(self.form.b) ** 2))

    def torus(self) -> list[Complexes]:
        """Return mu along the Neimark-Sacker curve."""
        return both_sides(self.size)

    def lines(self) -> list[Line]:
        """Return both branches of (3)."""
        up = np.array([self.end_of_circle(mu.imag) for mu in along(self.size, 1j)])
        words = "end of the circle, predicted"
        return [Line(words, up), Line(words, up.conj())]

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


@dataclass(frozen=True)
class TwoFlow:
    """Flow (6), with x = sqrt(size) Re z and x' = size Im z."""

    form: CodimensionTwo

    order = 2
    root = -1.0 + 0j
    size = 0.3  # |m1| of the portraits
    starts = 2
    unit = 1.2
    settling = 60  # iterates after which a motion is on the centre manifold

    @property
    def cubic(self) -> tuple[float, float]:
        """Return C and D of (4)."""
        return self.form.c, -self.form.d - 3.0 * self.form.c

    @property
    def amplitude(self) -> float:
        """Return w0 at z = 1."""
        c, d = self.cubic
        return math.sqrt(abs(c) * self.size) / abs(d)

    @property
    def iterates(self) -> float:
        """Iterates in a unit of time."""
        c, d = self.cubic
        return abs(d / c) / math.sqrt(self.size)

    @property
    def duration(self) -> float:
        """Iterates of a trajectory."""
        return 40.0 * self.iterates

    def mu_of(self, multipliers: Complexes) -> complex:
        """Return mu of the multipliers near -1."""
        (c, d), (e1, e2) = self.cubic, smooth_pair(multipliers, self.root)
        return complex(e1 * (d / c) ** 2, e2 * abs(d / c))

    def rate(self, mu: complex, z: Complexes) -> Complexes:
        """Return z'."""
        x, v, small = z.real, z.imag, math.sqrt(self.size)
        m1, m2 = mu.real / self.size, mu.imag / self.size
        moved: Complexes = v + 1j * (m1 * x - x**3 + small * (m2 - x**2) * v)
        return moved

    def periodic(self, mu: complex) -> Complexes:
        """Return the points of period two."""
        away = math.sqrt(max(mu.real, 0.0) / self.size)
        return np.array([away, -away][: 2 * (away > 0.0)], dtype=np.complex128)

    def torus(self) -> list[Complexes]:
        """Return mu along the Neimark-Sacker curve."""
        return [along(self.size, -1.0)]

    def lines(self) -> list[Line]:
        """Return where circles begin and end on the side of the doubled points."""
        named = {
            "of the doubled orbit, predicted": 1.0,
            "figure eight, predicted": FIGURE_EIGHT,
            "fold of circles, predicted": FOLD_OF_CIRCLES,
        }
        return [Line(words, along(self.size, 1.0 + slope * 1j)) for words, slope in named.items()]

    def places(self) -> list[Place]:
        """Return the sectors, from the stable side on with falling argument of mu."""
        named = {
            "fixed point stable": (-1.0, -0.7),
            "unstable, circle": (-1.0, 0.25),
            "circle around all": (1.0, 1.1),
            "two small circles, one large": (1.0, 0.9),
            "two large circles": (1.0, 0.78),
            "doubled orbit only": (1.0, 0.4),
        }
        return [Place(words, self.size * complex(*at)) for words, at in named.items()]


@dataclass(frozen=True)
class OneFlow:
    """Flow (7), with x = sqrt(size) Re z and x' = size^(3/4) Im z."""

    form: CodimensionTwo

    order = 1
    root = 1.0 + 0j
    size = 0.0025
    starts = 4
    unit = 1.0
    settling = 2

    @property
    def quadratic(self) -> tuple[float, float]:
        """Return A and B of (5)."""
        return self.form.a, self.form.b - 2.0 * self.form.a

    @property
    def amplitude(self) -> float:
        """Return w0 at z = 1."""
        a, b = self.quadratic
        return a / b**2 * math.sqrt(self.size)

    @property
    def iterates(self) -> float:
        """Iterates in a unit of time."""
        a, b = self.quadratic
        return float(b / a / self.size**0.25)

    @property
    def duration(self) -> float:
        """Iterates of a trajectory."""
        return 60.0 * self.iterates

    def mu_of(self, multipliers: Complexes) -> complex:
        """Return mu of the multipliers near 1 of the fixed point that is no saddle."""
        (a, b), (e1, e2) = self.quadratic, smooth_pair(multipliers, self.root)
        n1, n2 = -(e1**2) / (4.0 * a), e2 - b * e1 / (2.0 * a)
        return complex(n1 * b**4 / a**3, n2 * b / a)

    def rate(self, mu: complex, z: Complexes) -> Complexes:
        """Return z'."""
        x, v, small = z.real, z.imag, self.size**0.25
        m1, m2 = mu.real / self.size, mu.imag / math.sqrt(self.size)
        moved: Complexes = v + 1j * (m1 + x**2 + small * (m2 + x) * v)
        return moved

    def periodic(self, mu: complex) -> Complexes:
        """Return the fixed points, the saddle last."""
        away = math.sqrt(max(-mu.real, 0.0) / self.size)
        return np.array([-away, away][: 2 * (away > 0.0)], dtype=np.complex128)

    def torus(self) -> list[Complexes]:
        """Return mu along the Neimark-Sacker curve."""
        return [self.branch(1.0)]

    def lines(self) -> list[Line]:
        """Return where the circle ends."""
        return [Line("homoclinic orbit, predicted", self.branch(HOMOCLINIC))]

    def branch(self, slope: float) -> Complexes:
        """Return mu with m2 = slope sqrt(-m1), up to twice the size."""
        r = math.sqrt(2.0 * self.size) * np.array(SHARES)
        return np.asarray(-(r**2) + 1j * slope * r, dtype=np.complex128)

    def places(self) -> list[Place]:
        """Return the sectors, from that without fixed points on with rising argument of mu."""
        named = {
            "no fixed point": (1.0, 0.8),
            "focus unstable": (-1.0, 1.3),
            "focus stable, circle": (-1.0, 0.86),
            "focus stable, no circle": (-1.0, 0.3),
        }
        return [
            Place(words, complex(m1 * self.size, m2 * math.sqrt(self.size)))
            for words, (m1, m2) in named.items()
        ]


Flow = FourFlow | ThreeFlow | TwoFlow | OneFlow
DoubleFlow = TwoFlow | OneFlow


def flow_at(form: CodimensionTwo) -> Flow:
    """Return the flow of a normal form.

    Raises
    ------
    InvalidParameterError
        Coefficients at 1:2 or 1:1 of other signs than (6) and (7) have.
    """
    if form.kind == "R4":
        return FourFlow(form)
    if form.kind == "R3":
        return ThreeFlow(form)
    if form.kind == "R2":
        flow = TwoFlow(form)
        if max(flow.cubic) < 0.0:
            return flow
        raise InvalidParameterError("C, D = {:.6g}, {:.6g}: must be negative.".format(*flow.cubic))
    one = OneFlow(form)
    if math.prod(one.quadratic) > 0.0:
        return one
    raise InvalidParameterError("A, B = {:.6g}, {:.6g}: must agree in sign.".format(*one.quadratic))


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


def solved(
    function: Callable[[Floats], complex], value: complex, start: Floats, steps: Floats,
    tolerance: Floats,
) -> Floats:  # fmt: skip
    """Return where a function of two numbers has a value, by Newton's method with differences."""
    a, matrix = start, np.eye(2)
    for i in range(20):
        here = function(a)
        if i < RENEWED:
            slopes = [(function(a + step) - here) / step.sum() for step in np.diag(steps)]
            matrix = np.array([[s.real for s in slopes], [s.imag for s in slopes]])
        missed = value - here
        change = np.linalg.solve(matrix, [missed.real, missed.imag])
        a = a + change
        if not np.any(np.abs(change) >= tolerance):  # NaN ends it, too
            break
    return a
