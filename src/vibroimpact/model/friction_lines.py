"""Frictions on the same line, which act as one friction with the sum of their levels.

Frictions whose rows are multiples of each other, r_i = c_i r, and whose belts are so too, slip at
speeds that are these multiples of each other. Along r they give

    sum of c_i f_i,    at most sum of |c_i| F_i                                              (1)

in absolute value, and they stick and slip together. While they stick only that sum is determined; each
is taken to carry the part of it that its level F_i has in the sum of levels.
"""

from __future__ import annotations

from collections.abc import Sequence

from vibroimpact._core.scalars import ROUNDING
from vibroimpact.model.elements import Element, Friction

Factors = dict[int, float]  # c_i by the number of the element


def friction_lines(elements: Sequence[Element], apart: Sequence[int]) -> dict[int, Factors]:
    """Frictions of constant level that share a line, (1), by the first of each, those of two or more.

    ``apart`` are numbers of elements that are left out.
    """
    lines: dict[int, Factors] = {}
    for number, e in enumerate(elements):
        if not isinstance(e, Friction) or e.load is not None or number in apart:
            continue
        for first, factors in lines.items():
            if (factor := _factor(elements[first], e)) is not None:
                factors[number] = factor
                break
        else:
            lines[number] = {number: 1.0}
    return {first: factors for first, factors in lines.items() if len(factors) > 1}


def _factor(first: Element, e: Friction) -> float | None:
    """The factor of (1) between two frictions, or None where their lines or belts differ."""
    assert isinstance(first, Friction)
    at = next(i for i, x in enumerate(first.row) if x)
    factor = e.row[at] / first.row[at]
    if not factor:
        return None
    here, there = _belt(first), _belt(e)
    pairs = [*zip(first.row, e.row, strict=True), (first.belt_speed, e.belt_speed)]
    for omega in {**here, **there}:
        pairs += zip(here.get(omega, (0.0, 0.0)), there.get(omega, (0.0, 0.0)), strict=True)
    alike = all(abs(y - factor * x) <= ROUNDING * (abs(y) + abs(factor * x)) for x, y in pairs)
    return factor if alike else None


def _belt(e: Friction) -> dict[float, tuple[float, float]]:
    """Sine and cosine of the motion of a belt, by frequency."""
    out: dict[float, tuple[float, float]] = {}
    for line in e.motion:
        sine, cosine = out.get(line.omega, (0.0, 0.0))
        out[line.omega] = sine + line.sine[0], cosine + line.cosine[0]
    return out
