"""Impulse: what every contact and element gives the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import PART, Observer, Variables, real


@dataclass(frozen=True)
class Impulse(Observer):
    """Impulse of every contact and element over the observed time, and the largest of an impact.

    The integral of its force, with the signs of ``Run.forces``, and of a rigid stop the impulses of
    its impacts, chatter included. Divided by the observed time it is the mean force. The largest impulse
    of one impact has no sign; it is 0 where there was none, as at elements.
    """

    name: ClassVar[str] = "impulse"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``impulse``, ``impulse_largest`` (..., part)."""
        texts = {
            "impulse": ("sums", "impulse of a contact or element"),
            "impulse_largest": ("largest", "largest impulse of an impact at a contact or element"),
        }
        shape = (len(mechanism.elements),)
        return {
            name: real(table, text, dims=(PART,), shape=shape, quantity="impulse")
            for name, (table, text) in texts.items()
        }
