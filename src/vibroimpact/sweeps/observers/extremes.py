"""Extremes: the range of a coordinate, velocity or acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables
from vibroimpact.sweeps.observers.rows import row_variables


@dataclass(frozen=True, kw_only=True)
class Extremes(Observer):
    """Smallest and largest value of a coordinate over the observed time, flights included.

    Parameters
    ----------
    row
        What is observed: row . x, shape (n,); row . (x, v), shape (2n,); or row . (x, v, a), shape (3n,),
        with the accelerations between impacts. Without a row, each coordinate of the mechanism.
    label
        Names the variables: ``<label>_smallest``, ``<label>_largest``.
    """

    name: ClassVar[str] = "extremes"
    row: tuple[float, ...] = ()
    label: str = "x"

    def variables(self, mechanism: Mechanism) -> Variables:
        """Two variables; with dim ``coordinate`` without a row."""
        kinds = {"smallest": "smallest", "largest": "largest"}
        return row_variables("ranges", kinds, self.row, self.label, mechanism)
