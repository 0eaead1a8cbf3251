"""Numbers that a mechanism is computed with: floats, jets, columns and recorded ones.

A jet carries derivatives, a column one number for every system of an ensemble; with recorded numbers the
computation can be repeated (compile/along.py). The formulas of
mechanism.py, linear.py, coordinates.py and hybrid.py use + - * /, comparisons and the functions
below, and so are written once for all three. Floats come out with the bits of Python's own
functions; ``above``, ``choose``, ``greatest`` and ``least`` work system by system, where a
comparison of columns would split the systems.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import Any, cast

import numpy as np

from vibroimpact._core.columns import Column
from vibroimpact._core.types import Flags
from vibroimpact._kernel import Jet, Recorded

Truth = bool | Flags
DIFFERENTIABLE = Jet, Recorded
NUMBERS = *DIFFERENTIABLE, Column

ROUNDING_PER_TERM = 64.0 * 2.0**-53  # sums of products are rounded by less, relative to their terms


def as_python(value: Any) -> Any:
    """Convert a number of numpy to one of Python, for texts; return anything else as it is."""
    return value.item() if isinstance(value, np.generic) else value


def is_number(x: Any) -> bool:
    """Whether x stands for a float without being one: a jet or a column."""
    return isinstance(x, NUMBERS)


def is_finite(x: Any) -> bool:
    """Whether x is neither infinite nor NaN, in any part."""
    return cast(bool, x.finite) if is_number(x) else math.isfinite(x)


def is_infinite(x: Any) -> bool:
    """Whether x is infinite; jets never are."""
    return x.infinite if isinstance(x, Column) else not is_number(x) and math.isinf(x)


def square_root(x: Any) -> float:
    """The root of x >= 0."""
    return cast(float, x.sqrt()) if is_number(x) else math.sqrt(x)


def sign_of(x: Any) -> float:
    """1 with the sign of x; zeros have a sign too."""
    if isinstance(x, Column):
        return cast(float, Column(np.copysign(1.0, x.values)))
    return math.copysign(1.0, x)


def rounded_down(x: Any, bits: int) -> float:
    """Round x > 0 down to its first binary digits; of a jet its value."""
    if isinstance(x, Column):
        digits, exponents = np.frexp(x.values)
        return cast(float, Column(np.ldexp(np.floor(digits * 2**bits) / 2**bits, exponents)))
    if isinstance(x, DIFFERENTIABLE):
        return x.rounded_down(bits)
    mantissa, exponent = math.frexp(x)
    return math.ldexp(math.floor(mantissa * 2**bits), exponent - bits)


def above(x: Any, y: Any) -> Truth:
    """Whether x > y, system by system for columns."""
    if isinstance(x, Column) or isinstance(y, Column):
        return cast(Flags, _values(x) > _values(y))
    return cast(bool, x > y)


def choose(truth: Truth, x: Any, y: Any) -> float:
    """Return x where true, else y."""
    if isinstance(truth, np.ndarray):
        return cast(float, Column(np.where(truth, _values(x), _values(y))))
    return cast(float, x if truth else y)


def cleared(x: Any, bound: Any) -> float:
    """Return x, or zero where it is no larger than the bound."""
    return choose(above(abs(x), bound), x, 0.0)


def anywhere(truth: Truth) -> bool:
    """Whether the truth value holds for any system."""
    return bool(truth.any()) if isinstance(truth, np.ndarray) else truth


def greatest(numbers: Iterable[Any], default: float = 0.0) -> float:
    """The greatest of some numbers."""
    return _extreme(numbers, default, max, lambda x, y: choose(above(y, x), y, x))


def least(numbers: Iterable[Any], default: float = 0.0) -> float:
    """The least of some numbers."""
    return _extreme(numbers, default, min, lambda x, y: choose(above(x, y), y, x))


def _extreme(numbers: Iterable[Any], default: float, of_one: Any, of_each: Any) -> float:
    """The extreme number; of columns that of each system."""
    found = list(numbers)
    if Column not in map(type, found):
        return cast(float, of_one(found, default=default))
    return cast(float, functools.reduce(of_each, found))


def numeric_value(x: Any) -> float:
    """Value of a number; of a column that of the first system."""
    return float(np.ravel(_values(x))[0])


def _values(x: Any) -> Any:
    if isinstance(x, DIFFERENTIABLE):
        return x.value
    return x.values if isinstance(x, Column) else x
