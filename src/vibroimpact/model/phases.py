"""Phases of forcing lines as the kernel takes them: any finite ones.

The kernel's sine and cosine are for |theta| <= 2^20. A State takes any phase; runs whose lines have no common
period go on counting it, and that of a line is the frequency's ratio to the first times as large. Larger ones
are taken back by whole turns, in whole numbers: theta is one of 2^-n, and 2 pi is taken so exactly that the largest
multiple that a double can hold is off by less than 2^-60.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import numpy as np

from vibroimpact._core.types import Floats

LARGEST_ANGLE = 2.0**20  # sincos of numeric/math.hpp takes angles in radians up to this one
BITS_OF_TWO_PI = 1024 + 64  # 2 pi has so many bits: the largest double has not 2^1024 turns


def phases_at(first: Floats | float, ratios: Floats) -> Floats:
    """Phases of lines when the first has this one, by the ratios of their frequencies to that of the first."""
    phases = np.asarray(first * ratios, dtype=float)
    if np.abs(phases).max(initial=0.0) <= LARGEST_ANGLE:
        return phases
    large = (np.abs(phases) > LARGEST_ANGLE) & np.isfinite(phases)
    phases[large] = [_taken_back(x) for x in phases[large].tolist()]
    return phases


def _taken_back(phase: float) -> float:
    """The phase less the nearest whole number of turns, rounded once."""
    turn = _turn()
    return float(Fraction(phase) - round(Fraction(phase) / turn) * turn)


@cache
def _turn() -> Fraction:
    """2 pi to BITS_OF_TWO_PI: Machin's pi / 4 = 4 arctan(1/5) - arctan(1/239)."""
    one = 1 << (BITS_OF_TWO_PI + 16)

    def arctan_of_inverse(n: int) -> int:
        power = total = one // n
        for k in range(3, BITS_OF_TWO_PI + 18, 2):
            power = -power // (n * n)
            total += power // k
        return total

    quarter = 4 * arctan_of_inverse(5) - arctan_of_inverse(239)
    return Fraction(8 * quarter, one)
