"""Impacts: how many at either stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import AMOUNT, Observer, Variables, reals


@dataclass(frozen=True)
class Impacts(Observer):
    """Impacts at stops A and B of all contacts per forcing period, without forcing per time."""

    name: ClassVar[str] = "impacts"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``impacts_a``, ``impacts_b``."""
        texts = {f"impacts_{stop.lower()}": f"impacts at stops {stop}" for stop in "AB"}
        per = "forcing period" if mechanism.forces else "unit of time"
        return reals("per_period", texts, f"per {per}", within=AMOUNT)
