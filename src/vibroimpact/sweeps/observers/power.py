"""Power: energy lost in impacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import PART, Observer, Variables, real, reals


@dataclass(frozen=True)
class Power(Observer):
    """Energy lost in impacts per unit of time, in all and at each contact.

    Elements, whose numbers follow those of the contacts, have no impacts: see :class:`Dissipation`.
    """

    name: ClassVar[str] = "power"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``power``, ``power_of_part`` (..., part)."""
        text, shape = "energy lost in impacts per unit of time", (len(mechanism.elements),)
        each = f"{text} at a contact or element"
        return reals("loss", {"power": text}, quantity="power") | {
            "power_of_part": real("of_parts", each, dims=(PART,), shape=shape, quantity="power")
        }
