"""Stroboscopic: the last states at one phase of the force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables, need_forcing
from vibroimpact.sweeps.observers.section_points import STROBE, points_of


@dataclass(frozen=True, kw_only=True)
class Stroboscopic(Observer):
    """The last states at one phase of the force, with impacts or without.

    Parameters
    ----------
    points
        Number of states that are kept, one per forcing period, 1 to 10^6; NaN stands for those that
        did not come.
    phase
        Phase of the first forcing line, radians.
    label
        Name of another one, as in :class:`Section`: ``stroboscopic_<label>_position`` and so on.
    """

    name: ClassVar[str] = "stroboscopic"
    points: int = 100
    phase: float = 0.0
    label: str = ""

    def variables(self, mechanism: Mechanism) -> Variables:
        """States (..., strobe, coordinate), phases and times (..., strobe)."""
        need_forcing(self, mechanism, "no phase repeats. Take Section.")
        where = f"at phase {self.phase:g} of the force"
        return points_of(self, self.points, STROBE, where, mechanism)
