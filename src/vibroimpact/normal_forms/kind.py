"""Kind of special point: one record holds what the package knows of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from vibroimpact._core.types import Count


@dataclass(frozen=True)
class PointKind:
    """Kind of special point; two are equal where label and name are."""

    label: str  # short name, of points and in files: "SN"
    name: str  # name in two or three words, for legends
    meaning: str = field(compare=False)  # what happens there, for printed points
    # number of parameters that are needed to meet it
    codimension: Count = field(default=1, compare=False)
    # Multipliers of modulus one that the map has there: 1.0, -1.0, or None for a pair that is not real. Empty where
    # the kind is not one of multipliers.
    critical: tuple[float | None, ...] = field(default=(), compare=False)
    # first word of the test functions of a branch that vanish there
    test: str = field(default="", compare=False)
    # test function g(states, durations, parameters) of orbits, for kinds that are given by one
    function: Callable[[Any, Any, Any], Any] | None = field(default=None, compare=False)
    # whether a gap, a speed or a time is zero there, so that its sign is rounding
    touch: bool = field(default=False, compare=False)
    # Coefficients: a function of the record, and of the forms of the map for a smooth kind, else of the point. None
    # where there are none.
    normal_form: Callable[..., Any] | None = field(default=None, compare=False)
    # whether it is where a coefficient of codimension one vanishes: ``normal_form`` then takes ``located``
    of_coefficient: bool = field(default=False, compare=False)
    # (p, q) of a critical pair exp(+-2 pi i p / q)
    resonance: tuple[int, int] | None = field(default=None, compare=False)
    # kinds of the curves of the same orbits that pass through it
    curves: tuple[PointKind, ...] = field(default=(), compare=False)
    # what gives the start of the other orbits that begin there; None where none do
    begins: Callable[..., Any] | None = field(default=None, compare=False)
    # the kind that it is of the half map of a symmetric orbit, where that is another one
    in_half_map: PointKind | None = field(default=None, compare=False)
    # leading power of the change of the map beyond it, in the distance by which it is passed; 0 where none is known
    power: Count = field(default=0, compare=False)
    # meaning where an element, no rigid stop, is touched
    of_element: str = field(default="", compare=False)

    def __str__(self) -> str:
        return self.label

    def __repr__(self) -> str:
        """Label and name; of its functions a text would hold addresses, which change from run to run."""
        return f"PointKind({self.label!r}, {self.name!r})"

    def of_map(self, *, symmetric: bool) -> PointKind:
        """The kind for the map that an orbit is solved by: the half map of a symmetric one."""
        return self.in_half_map if symmetric and self.in_half_map else self


PointKinds = dict[str, PointKind]
"""Kinds by their labels."""


def by_label(kinds: Iterable[PointKind]) -> PointKinds:
    """Table of kinds."""
    return {kind.label: kind for kind in kinds}
