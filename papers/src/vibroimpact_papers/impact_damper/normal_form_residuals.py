"""Residuals of the normal-form formulas (37), (39), (A6), (A7), (A10), on maps made by hand.

A map with planted coefficients is written out, the paper's formula is applied to it, and the answer
is compared with what was planted.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable

Poly = dict[tuple[int, int], complex]
"""Polynomial in z and conj(z): exponents to coefficient, kept to total degree 3."""

ROTATION = cmath.exp(2.1j)
"""lambda_0 of the planted maps, far from every resonance m <= 4."""
CUBIC = complex(-0.7, 0.9)
"""Coefficient of z^2 conj(z) in the planted normal form."""
CHANGE: Poly = {(2, 0): 0.3 + 0.2j, (1, 1): -0.4 + 0.5j, (0, 2): 0.25 - 0.6j}
"""Quadratic change of coordinates that hides the normal form."""
G10, G01, H20, H11 = 0.8 - 0.3j, -0.5 + 0.4j, 0.6 + 0.7j, 0.35
"""Planted coefficients: y_k z, y_k conj(z) in z', and z^2/2, z conj(z) in y_k'."""

RADIUS = 1e-4
"""Radius at which (37) is evaluated: its next term is of order RADIUS**2."""


def _add(p: Poly, q: Poly, factor: complex = 1) -> Poly:
    keys = sorted(p.keys() | q.keys())
    return {key: p.get(key, 0) + factor * q.get(key, 0) for key in keys}


def _multiply(p: Poly, q: Poly) -> Poly:
    product: Poly = {}
    for (i, j), a in p.items():
        for (k, m), b in q.items():
            if i + j + k + m <= 3:
                product[i + k, j + m] = product.get((i + k, j + m), 0) + a * b
    return product


def _conjugate(p: Poly) -> Poly:
    return {(j, i): a.conjugate() for (i, j), a in p.items()}


def _substitute(outer: Poly, inner: Poly) -> Poly:
    """outer(inner, conj(inner)), truncated."""
    result: Poly = {}
    for (i, j), a in outer.items():
        term: Poly = {(0, 0): a}
        for factor in [inner] * i + [_conjugate(inner)] * j:
            term = _multiply(term, factor)
        result = _add(result, term)
    return result


def planted_map() -> Poly:
    """Return the normal form lambda w + CUBIC w^2 conj(w), seen in z = w + CHANGE(w)."""
    identity: Poly = {(1, 0): 1}
    inverse = identity
    for _ in range(2):  # w = z - CHANGE(w); each pass gains one order
        inverse = _add(identity, _substitute(CHANGE, inverse), -1)
    image = _substitute({(1, 0): ROTATION, (2, 1): CUBIC}, inverse)
    return _substitute(_add(identity, CHANGE), image)


def first_coefficient(power: int) -> float:
    """Return f_1 by (39), with conj(lambda_0)**power in its first term, minus the planted f_1.

    The planted value is -Re(conj(lambda_0) CUBIC), the radial coefficient of (37).
    """
    p, lam, conj = planted_map(), ROTATION, ROTATION.conjugate()
    g20, g11, g02, g21 = 2 * p[2, 0], p[1, 1], 2 * p[0, 2], 2 * p[2, 1]
    first = ((1 - 2 * lam) * conj**power / (2 * (1 - lam)) * g20 * g11).real
    f1 = first + abs(g11) ** 2 / 2 + abs(g02) ** 2 / 4 - (conj * g21).real / 2
    return abs(f1 + (conj * CUBIC).real)


def angle(power: int) -> float:
    """(Turn of the normal form at RADIUS - theta - f_3 RADIUS**power) / RADIUS**2."""
    image = ROTATION * RADIUS + CUBIC * RADIUS**3
    turn = cmath.phase(image / (ROTATION * RADIUS))
    f3 = (CUBIC * ROTATION.conjugate()).imag
    return abs(turn - f3 * RADIUS**power) / RADIUS**2


def _F(y1: float, y2: float, y3: float) -> complex:
    """F_1 + i F_2 of a quadratic map with the planted G10, G01."""
    z = complex(y1, y2)
    return ROTATION * z + y3 * (G10 * z + G01 * z.conjugate())


def _F3(y1: float, y2: float, y3: float) -> complex:
    """F_3 (real) of a quadratic map with the planted H20, H11."""
    z = complex(y1, y2)
    return complex(0.5 * y3 + (H20 * z * z).real + H11 * abs(z) ** 2)


def _second(f: Callable[[float, float, float], complex], i: int, j: int) -> complex:
    """Second derivative of a quadratic map at 0, exactly, by polarisation."""
    zero = [0.0, 0.0, 0.0]

    def at(*axes: int) -> complex:
        point = zero.copy()
        for axis in axes:
            point[axis] += 1.0
        return f(point[0], point[1], point[2])

    return at(i, j) - at(i) - at(j) + at()


def g10(*, third_derivatives: bool) -> float:
    """G_10 by (A6) minus the planted one; every third derivative of a quadratic map is 0."""
    d1, d2 = _second(_F, 0, 2), _second(_F, 1, 2)
    if third_derivatives:
        d2 = 0
    return abs(0.5 * (d1.real + d2.imag + 1j * (d1.imag - d2.real)) - G10)


def g01(sign: int, *, third_derivatives: bool) -> float:
    """G_01 by (A7), with the given sign of its last term, minus the planted one."""
    d1, d2 = _second(_F, 0, 2), _second(_F, 1, 2)
    if third_derivatives:
        d2 = 0
    return abs(0.5 * (d1.real - d2.imag + 1j * (d1.imag + sign * d2.real)) - G01)


def h02(sign: int) -> float:
    """H_02 by (A10), with the given sign of its last term, minus conj(H20)."""
    difference = _second(_F3, 0, 0) - _second(_F3, 1, 1)
    value = 0.25 * (difference + sign * 2j * _second(_F3, 0, 1))
    return abs(value - H20.conjugate())
