"""Power: energy lost in impacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables, reals


@dataclass(frozen=True)
class Power(Observer):
    """Energy lost in impacts per unit of time."""

    name: ClassVar[str] = "power"

    def variables(self, mechanism: Mechanism) -> Variables:  # noqa: ARG002
        """``power``."""
        text = "energy lost in impacts per unit of time"
        return reals("loss", {"power": text}, quantity="power")
