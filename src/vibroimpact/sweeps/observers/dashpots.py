"""Dashpots: power that the damping matrix takes from the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables, reals


@dataclass(frozen=True)
class Dashpots(Observer):
    """Power that the dashpots of the damping matrix C take: the mean of v . C v, to rounding.

    Dashpots of soft stops are not in it: see :class:`Dissipation`.
    """

    name: ClassVar[str] = "dashpots"

    def variables(self, mechanism: Mechanism) -> Variables:  # noqa: ARG002
        """``power_of_dashpots``."""
        text = "energy taken by the damping matrix per unit of time"
        return reals("work", {"power_of_dashpots": text}, quantity="power")
