"""Rms: averages of a coordinate, velocity or acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables
from vibroimpact.sweeps.observers.rows import row_variables


@dataclass(frozen=True, kw_only=True)
class Rms(Observer):
    """Mean and root mean square of a coordinate over the observed time, flights included.

    Parameters
    ----------
    row, label
        As in :class:`Extremes`; the variables are ``<label>_mean``, ``<label>_rms``.
    """

    name: ClassVar[str] = "rms"
    row: tuple[float, ...] = ()
    label: str = "x"

    def variables(self, mechanism: Mechanism) -> Variables:
        """Two variables; with dim ``coordinate`` without a row."""
        kinds = {"mean": "mean", "rms": "root mean square"}
        return row_variables("averages", kinds, self.row, self.label, mechanism)
