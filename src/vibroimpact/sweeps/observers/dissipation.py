"""Dissipation: the work that each element takes from the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import ELEMENT, Observer, Variables, real


@dataclass(frozen=True)
class Dissipation(Observer):
    """Work that soft stops and friction take from the motion, per unit of time.

    Over whole periods that is what they dissipate: a soft stop gives back what its spring stores,
    but for what is left in it where it lets go. Speeds are relative to stops and belts that move. Impacts at
    rigid stops have "power".
    """

    name: ClassVar[str] = "dissipation"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``work_on_element`` (..., element)."""
        text, shape = "work that an element takes per unit of time", (len(mechanism.switching),)
        return {
            "work_on_element": real("work", text, dims=(ELEMENT,), shape=shape, quantity="power")
        }
