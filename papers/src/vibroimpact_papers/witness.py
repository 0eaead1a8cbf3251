"""Witnesses that share no code with the library: a forced oscillator at a stop.

Impacts of x'' + x = cos(omega t), by bisection; and the motions of x'' + 2 zeta x' + x = cos(omega t) that have one
impact in a period, in closed form.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq


def next_impact(
    t: float, v: float, omega: float, sigma: float, least: float = 1e-6
) -> tuple[float, float]:
    """Time and speed before the next impact after one at t with the velocity -v after it, at the stop sigma.

    Flights shorter than `least` are not seen.
    """
    a = 1.0 / (1.0 - omega * omega)

    def free(s: Any) -> tuple[Any, Any]:
        p, q = sigma - a * math.cos(omega * t), -v + a * omega * math.sin(omega * t)
        c, n = np.cos(s), np.sin(s)
        return (
            p * c + q * n + a * np.cos(omega * (t + s)),
            q * c - p * n - a * omega * np.sin(omega * (t + s)),
        )

    first = min(least, 1e-3)
    grid = np.concatenate(
        [np.geomspace(first, 1e-3, 200, endpoint=False), np.linspace(1e-3, 4.0 * math.pi, 8001)]
    )
    over = int(np.argmax(free(grid)[0] > sigma))
    end = brentq(lambda s: free(s)[0] - sigma, grid[over - 1], grid[over], xtol=1e-14)
    return t + end, float(free(end)[1])


def speeds_of_impacts(
    omega: float, sigma: float, r: float, t: float, v: float, settle: int, kept: int
) -> list[float]:
    """Speeds before so many impacts, after others, from an impact at t with the velocity -v after it."""
    found = []
    for _ in range(settle + kept):
        t, before = next_impact(t, v, omega, sigma)
        v = r * before
        found.append(before)
    return found[settle:]


class OnceAPeriod(NamedTuple):
    """Coefficients of motions with one impact in a period T = 2 pi / omega, and the clearances g of their ends.

    With S = q / (1 - q), q = exp((-zeta + i w) T), an impact of speed V before shifts the place by a V below the
    forced motion and its rate by (b - 1) V, so that (g + a V)^2 + (b V / omega)^2 = A^2 with
    a = (1 + r) Im S / w, b = 1 + (1 + r)(Re S - zeta Im S / w). The fold is the largest g. On the period doubling
    the trace of the map is -(1 + r^2 exp(-2 zeta T)), which is linear in V / g: V = kappa g.
    """

    a: Any
    b: Any
    amplitude: Any
    kappa: Any
    fold: Any
    flip: Any


def once_a_period(omega: Any, zeta: float, r: float) -> OnceAPeriod:
    """Closed forms at some frequencies [Shaw and Holmes, J. Sound Vib. 90 (1983) 129]; amplitude is grazing."""
    w, t = math.sqrt(1.0 - zeta**2), 2.0 * math.pi / omega
    decay = np.exp(-zeta * t)
    q = decay * np.exp(1j * w * t)
    s = q / (1.0 - q)
    a = (1.0 + r) * s.imag / w
    b = 1.0 + (1.0 + r) * (s.real - zeta * s.imag / w)
    amplitude = 1.0 / np.hypot(1.0 - omega**2, 2.0 * zeta * omega)
    # saltation [-r, 0; (1 + r)(f - g) / V, -r] with the force f = (1 - omega^2)(g + a V) + 2 zeta b V
    kick = (1.0 + r) * decay * np.sin(w * t) / w
    rest = 1.0 + (r * decay) ** 2 - 2.0 * r * decay * np.cos(w * t)
    kappa = omega**2 * kick / (rest + kick * ((1.0 - omega**2) * a + 2.0 * zeta * b))
    fold = amplitude * np.hypot(1.0, a * omega / b)
    flip = amplitude / np.hypot(1.0 + a * kappa, b * kappa / omega)
    return OnceAPeriod(a, b, amplitude, kappa, fold, flip)
