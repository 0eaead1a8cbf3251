"""Section: the last impacts at one stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import StopName
from vibroimpact.simulation.places import AtStop, check_stop
from vibroimpact.sweeps.observers.observer import Observer, Variables
from vibroimpact.sweeps.observers.section_points import POINT, points_of


@dataclass(frozen=True, kw_only=True)
class Section(Observer):
    """The last impacts at one stop: states just after them.

    Parameters
    ----------
    points
        Number of points that are kept, 1 to 10^6; NaN stands for those that did not come.
    stride
        Every stride-th impact is a point, 1 to 10^6, from the first in the window on.
    contact, stop
        As in :class:`~vibroimpact.AtStop`.
    label
        Name of another section, and part of its variables, ``section_<label>_position`` and so on. Members
        are run as often as there are sections.
    """

    name: ClassVar[str] = "section"
    points: int = 100
    stride: int = 1
    contact: int = 0
    stop: StopName = "A"
    label: str = ""

    def variables(self, mechanism: Mechanism) -> Variables:
        """States (..., point, coordinate), phases and times (..., point)."""
        check_stop(mechanism, AtStop(self.stop, self.contact))
        where = f"after impact at stop {self.stop} of contact {self.contact}"
        return points_of(self, self.points, POINT, where, mechanism)
