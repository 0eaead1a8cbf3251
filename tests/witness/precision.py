"""The arithmetic of the references: one private mpmath context, 50 digits and a guard."""

from __future__ import annotations

from contextlib import contextmanager
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import mpmath

if TYPE_CHECKING:
    from collections.abc import Iterator

Real = Any  # an mpmath number, or anything `exact` converts

DIGITS = 50  # what results are good for
GUARD = 15  # carried beyond that

mp = mpmath.MPContext()
mp.dps = DIGITS + GUARD


@contextmanager
def digits(count: int) -> Iterator[None]:
    """Work with results good for `count` digits inside the block."""
    before = mp.dps
    mp.dps = count + GUARD
    try:
        yield
    finally:
        mp.dps = before


def exact(value: Real) -> Real:
    """Convert without rounding: doubles bit by bit, strings as decimals, fractions."""
    if isinstance(value, Fraction):
        return mp.mpf(value.numerator) / value.denominator
    return mp.mpf(value)


def decimal(value: Real, count: int = DIGITS) -> str:
    """Write a number with `count` significant digits."""
    return str(mp.nstr(value, count, strip_zeros=False))
