"""Impacts of x'' + x = cos(omega t) at a stop, by bisection: a witness that shares no code with the library."""

from __future__ import annotations

import math
from typing import Any

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
