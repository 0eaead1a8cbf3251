"""Polynomial coefficients and split constants of ``include/vibroimpact/numeric/math.hpp``.

    python tools/math_coefficients.py

prints one block per polynomial: its largest relative effect on the function value (a bound on the
truncation error, as a power of two) and its coefficients, lowest degree first, to 17 digits, which
is enough to give back the same double. Needs mpmath.

Each polynomial interpolates its function at the Chebyshev nodes of the interval, which is within a
small factor of the best uniform approximation and needs no iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mpmath as mp

DIGITS = 60
Function = Callable[[mp.mpf], mp.mpf]


@dataclass(frozen=True)
class Approximation:
    """A polynomial `degree` for `function` on `interval`.

    An error e of the polynomial at z changes the elementary function by e * `weight(z)`, relative
    to its value.
    """

    name: str
    function: Function
    weight: Function
    interval: tuple[mp.mpf, mp.mpf]
    degree: int


def chebyshev_nodes(lower: mp.mpf, upper: mp.mpf, count: int) -> list[mp.mpf]:
    """Zeros of the Chebyshev polynomial of degree `count`, moved to an interval."""
    middle, half = (lower + upper) / 2, (upper - lower) / 2
    return [middle + half * mp.cos(mp.pi * (2 * i + 1) / (2 * count)) for i in range(count)]


def nodes_for(a: Approximation) -> list[mp.mpf]:
    """Where to interpolate.

    On [0, upper] the weight vanishes at 0, so 0 is as good as a node already: stretch the interval
    until one node of a larger set falls on it, and leave that one out.
    """
    lower, upper = a.interval
    count = a.degree + 1
    if lower != 0:
        return chebyshev_nodes(lower, upper, count)
    c = mp.cos(mp.pi / (2 * (count + 1)))
    return chebyshev_nodes(-upper * (1 - c) / (1 + c), upper, count + 1)[:-1]


def interpolate(a: Approximation) -> list[mp.mpf]:
    """Coefficients, lowest degree first, of the polynomial through the nodes."""
    nodes = nodes_for(a)
    powers = mp.matrix([[z**k for k in range(a.degree + 1)] for z in nodes])
    return list(mp.lu_solve(powers, mp.matrix([a.function(z) for z in nodes])))


def truncation_error(a: Approximation, coefficients: list[float], samples: int = 2000) -> mp.mpf:
    """Largest relative effect on the function value, coefficients already rounded to double."""
    lower, upper = a.interval
    points = [lower + (upper - lower) * i / samples for i in range(1, samples + 1)]

    def effect(z: mp.mpf) -> mp.mpf:
        return abs(a.weight(z) * (mp.polyval(coefficients, z, asc=True) - a.function(z)))

    return max(effect(z) for z in points)


def approximations() -> list[Approximation]:
    """The five polynomials of math.hpp; z is the squared argument but for exp."""
    quarter = (mp.pi / 4) ** 2
    log_end = ((mp.sqrt(2) - 1) / (mp.sqrt(2) + 1)) ** 2
    half_log2 = mp.log(2) / 2
    root = mp.sqrt
    return [
        Approximation(
            "sin(x) = x + x z S(z)",
            lambda z: (mp.sin(root(z)) / root(z) - 1) / z,
            lambda z: z * root(z) / mp.sin(root(z)),
            (mp.mpf(0), quarter),
            5,
        ),
        Approximation(
            "cos(x) = 1 - z/2 + z^2 C(z)",
            lambda z: (mp.cos(root(z)) - 1 + z / 2) / z**2,
            lambda z: z**2 / mp.cos(root(z)),
            (mp.mpf(0), quarter),
            5,
        ),
        Approximation(
            "exp(r) = 1 + r + r^2 E(r)",
            lambda r: (mp.exp(r) - 1 - r) / r**2 if r else mp.mpf(1) / 2,
            lambda r: r**2 / mp.exp(r),
            (-half_log2, half_log2),
            9,
        ),
        Approximation(
            "log((1+s)/(1-s)) = 2 s + s z L(z)",
            lambda z: (2 * mp.atanh(root(z)) / root(z) - 2) / z,
            lambda z: z * root(z) / (2 * mp.atanh(root(z))),
            (mp.mpf(0), log_end),
            6,
        ),
        Approximation(
            "atan(u) = u + u z A(z)",
            lambda z: (mp.atan(root(z)) / root(z) - 1) / z,
            lambda z: z * root(z) / mp.atan(root(z)),
            (mp.mpf(0), mp.mpf(1) / 4),
            12,
        ),
    ]


def split(x: mp.mpf, widths: list[int]) -> list[float]:
    """Parts of `x` that add up to it: cut after each number of bits, then the rest, rounded."""
    parts = []
    for width in widths:
        scale = mp.mpf(2) ** (width - 1 - int(mp.floor(mp.log(x, 2))))
        parts.append(float(mp.floor(x * scale) / scale))
        x -= parts[-1]
    return [*parts, float(x)]


def main() -> None:
    """Print everything."""
    mp.mp.dps = DIGITS
    for a in approximations():
        coefficients = [float(c) for c in interpolate(a)]
        error = truncation_error(a, coefficients)
        print(f"\n{a.name}: truncation 2^{float(mp.log(error, 2)):.1f}")
        for c in coefficients:
            print(f"    {c:.16e}")
    constants = {
        "pi/2": (mp.pi / 2, [33, 33, 33]),
        "ln 2": (mp.log(2), [32]),
        "pi/4": (mp.pi / 4, [50]),
        "2/pi": (2 / mp.pi, []),
        "1/ln 2": (1 / mp.log(2), []),
    }
    for name, (x, widths) in constants.items():
        print(f"\n{name}, cut after {widths} bits")
        for part in split(x, widths):
            print(f"    {part:.16e}")


if __name__ == "__main__":
    main()
