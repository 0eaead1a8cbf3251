"""Frictions on the same line, which act as one friction with the sum of their levels.

Frictions whose rows are multiples of each other, r_i = c_i r, and whose belts are so too, slip at
speeds that are these multiples of each other. Along r they give

    sum of c_i f_i,    at most sum of |c_i| F_i                                              (1)

in absolute value, and they stick and slip together. While they stick only that sum is determined; each
is taken to carry the part of it that its level F_i has in the sum of levels.
"""

from __future__ import annotations

from collections.abc import Sequence

from vibroimpact.model.elements.element import Element
from vibroimpact.model.elements.friction import FrictionState

Factors = dict[int, float]  # c_i by the number of the element


def friction_lines(elements: Sequence[Element], apart: Sequence[int]) -> dict[int, Factors]:
    """Frictions of constant level that share a line, (1), by the first of each, those of two or more.

    ``apart`` are numbers of elements that are left out.
    """
    lines: dict[int, Factors] = {}
    for number, e in enumerate(elements):
        if number in apart:
            continue
        for first, factors in lines.items():
            if (factor := e.multiple_of(elements[first])) is not None:
                factors[number] = factor
                break
        else:
            lines[number] = {number: 1.0}
    return {first: factors for first, factors in lines.items() if len(factors) > 1}


def along_line(state: int, factor: float) -> int:
    """State of a friction on the line of another, by the state of that and the factor of their rows."""
    if state == FrictionState.STICK or factor > 0.0:
        return state
    return FrictionState.BACKWARD if state == FrictionState.FORWARD else FrictionState.FORWARD
