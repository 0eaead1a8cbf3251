"""Impulse: what every contact and element gives the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import PART, Observer, Variables, real


@dataclass(frozen=True)
class Impulse(Observer):
    """Impulse of every contact and element over the observed time.

    The integral of its force, with the signs of ``Run.forces``, and of a rigid stop the impulses of
    its impacts, chatter included. Divided by the observed time it is the mean force.
    """

    name: ClassVar[str] = "impulse"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``impulse`` (..., part)."""
        text, shape = "impulse of a contact or element", (len(mechanism.elements),)
        return {"impulse": real("sums", text, dims=(PART,), shape=shape, quantity="impulse")}
