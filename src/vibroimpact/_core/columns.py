"""Columns: one number for every system of an ensemble, computed with as if it were one float.

A mechanism that is built and compiled with columns is built and compiled for all systems at once
(:mod:`vibroimpact.sweeps.execution.batch`). Every operation gives each system the bits that Python
floats would give: + - * / and sqrt are rounded once wherever they are computed, and powers and
elementary functions are taken system by system, because array versions of them round differently.

A comparison has a value where all systems agree. Otherwise it raises :class:`Split`, and the caller
repeats the computation for the systems on either side: code with branches needs no other form.
Operations that are errors for floats (division by 0, roots of negative numbers) are errors for a
column too, for exactly the systems concerned.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from vibroimpact._core.types import Flags, Floats

# Functions that are taken number by number, with the bits that a float gives.
POWER = np.frompyfunc(operator.pow, 2, 1)
EXP, LOG, SINE, COSINE = (np.frompyfunc(f, 1, 1) for f in (np.exp, np.log, np.sin, np.cos))


class Split(BaseException):
    """Disagreement of systems on a comparison: true where ``mask`` is.

    It is not an ``Exception``, so that error handling in a function of the user does not catch it.
    """

    def __init__(self, mask: Flags) -> None:
        super().__init__("systems disagree on a comparison")
        self.mask = mask


def agreed(mask: Flags) -> bool:
    """Return the truth value that all systems share, or raise :class:`Split`."""
    if mask.all():
        return True
    if mask.any():
        raise Split(mask)
    return False


def _values(x: Any) -> Any:
    """Operand for arrays: the values of a column, a number as it is, else None."""
    if isinstance(x, Column):
        return x.values
    return float(x) if isinstance(x, float | int | np.number) else None


def _arithmetic(operation: Callable[[Any, Any], Any]) -> Any:
    def forward(self: Column, other: Any) -> Any:
        y = _values(other)
        return NotImplemented if y is None else Column(operation(self.values, y))

    def reflected(self: Column, other: Any) -> Any:
        x = _values(other)
        return NotImplemented if x is None else Column(operation(x, self.values))

    return forward, reflected


def _comparison(operation: Callable[[Any, Any], Any]) -> Any:
    def compare(self: Column, other: Any) -> Any:
        y = _values(other)
        return NotImplemented if y is None else agreed(operation(self.values, y))

    return compare


def _quotient(x: Any, y: Any) -> Any:
    if not agreed(np.asanyarray(y != 0.0)):
        raise ZeroDivisionError("float division by zero")
    return x / y


def _power(x: Any, y: Any) -> Floats:
    return cast(Floats, POWER(x, y).astype(float))


class Column:
    """A number of every system: shape (S,), or one that spreads over the grid of the systems."""

    __slots__ = ("values",)
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, values: Floats) -> None:
        self.values = values

    __add__, __radd__ = _arithmetic(operator.add)
    __sub__, __rsub__ = _arithmetic(operator.sub)
    __mul__, __rmul__ = _arithmetic(operator.mul)
    __truediv__, __rtruediv__ = _arithmetic(_quotient)
    __pow__, __rpow__ = _arithmetic(_power)
    __lt__, __le__ = _comparison(operator.lt), _comparison(operator.le)
    __gt__, __ge__ = _comparison(operator.gt), _comparison(operator.ge)
    __eq__ = _comparison(operator.eq)

    def __bool__(self) -> bool:
        return agreed(self.values != 0.0)

    def __neg__(self) -> Column:
        return Column(-self.values)

    def __pos__(self) -> Column:
        return self

    def __abs__(self) -> Column:
        return Column(np.abs(self.values))

    def __repr__(self) -> str:
        return f"Column({np.array2string(self.values, threshold=6)})"

    @property
    def finite(self) -> bool:
        """Whether every number is finite."""
        return agreed(np.isfinite(self.values))

    @property
    def infinite(self) -> bool:
        """Whether every number is infinite."""
        return agreed(np.isinf(self.values))

    def sqrt(self) -> Column:
        """Square roots."""
        if agreed(self.values < 0.0):
            raise ValueError("math domain error")
        return Column(np.sqrt(self.values))

    def exp(self) -> Column:
        """Exponentials, with the bits of ``np.exp(float)``."""
        return self._each(EXP)

    def log(self) -> Column:
        """Natural logarithms, with the bits of ``np.log(float)``."""
        return self._each(LOG)

    def sin(self) -> Column:
        """Sines, with the bits of ``np.sin(float)``."""
        return self._each(SINE)

    def cos(self) -> Column:
        """Cosines, with the bits of ``np.cos(float)``."""
        return self._each(COSINE)

    def _each(self, function: np.ufunc) -> Column:
        return Column(function(self.values).astype(float))
