"""Columns: one number of every system, with the bits of floats."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.families import FAMILY, bits

import vibroimpact as vi
from vibroimpact._core.columns import Column, Split
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.system import mechanism_of

if TYPE_CHECKING:
    from collections.abc import Callable


NUMBERS = st.floats(allow_subnormal=True) | st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.0, 0.5])
OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
    "**": operator.pow, "sqrt": lambda x, _: np.sqrt(x), "exp": lambda x, _: np.exp(x),
    "log": lambda x, _: np.log(x), "sin": lambda x, _: np.sin(x), "cos": lambda x, _: np.cos(x),
    "abs": lambda x, _: abs(x), "neg": lambda x, _: -x,
}  # fmt: skip


def outcome(operation: Callable[[Any, Any], Any], x: Any, y: Any) -> Any:
    """The bits of a result, or None where floats (or the column) refuse it."""
    try:
        with np.errstate(all="ignore"):
            result = operation(x, y)
        return bits(result.values if isinstance(result, Column) else float(result))
    except (ArithmeticError, ValueError, TypeError):
        return None


@pytest.mark.parametrize("name", OPERATIONS)
@given(x=NUMBERS, y=NUMBERS)
def test_a_column_has_the_bits_of_floats_in_every_operation(name: str, x: float, y: float) -> None:
    plain, f = outcome(OPERATIONS[name], x, y), OPERATIONS[name]
    if name == "sqrt" and x < 0.0:
        plain = None  # np.sqrt gives NaN, which no mechanism takes; a column refuses at once
    pair = [Column(np.array([x, x])), Column(np.array([y, y]))]
    wanted = None if plain is None else plain + plain
    assert outcome(f, pair[0], pair[1]) == wanted
    assert outcome(f, pair[0], y) == wanted
    if name in ("+", "-", "*", "/", "**"):
        assert outcome(f, x, pair[1]) == wanted


@given(x=NUMBERS, y=NUMBERS, z=NUMBERS)
def test_a_comparison_of_columns_is_that_of_floats_or_splits(x: float, y: float, z: float) -> None:
    left, right = Column(np.array([x, y])), Column(np.array([z, z]))
    for compare in (operator.lt, operator.le, operator.gt, operator.ge, operator.eq):
        wanted = [compare(x, z), compare(y, z)]
        if wanted[0] == wanted[1]:
            assert compare(left, right) is compare(left, z) is wanted[0]
        else:
            with pytest.raises(Split) as split:
                compare(left, right)
            assert split.value.mask.tolist() == wanted


def test_what_floats_refuse_splits_off_the_systems_concerned() -> None:
    column = Column(np.array([1.0, 0.0, -4.0]))
    with pytest.raises(Split) as split:
        _ = 1.0 / column
    assert split.value.mask.tolist() == [True, False, True]
    with pytest.raises(Split) as split:
        np.sqrt(column)  # type: ignore[call-overload]
    assert split.value.mask.tolist() == [False, False, True]


def test_whole_numbers_beside_columns_become_floats() -> None:
    varied = with_parameters(FAMILY, {"k": Column(np.array([1.0, 2.0]))})
    m = mechanism_of(varied)
    entries = [*np.ravel(np.array([m.mass, m.damping, m.stiffness], dtype=object)),
               *m.forces[0].sine, *m.rigid_stops[0].row, m.rigid_stops[0].lower]  # fmt: skip
    assert all(isinstance(x, float | Column) for x in entries)
    with pytest.raises(vi.InvalidParameterError, match="must be numbers"):
        vi.Harmonic(1.0, (Column(np.ones(2)), "much"))  # type: ignore[arg-type]
