"""States: how long every element is in each of its states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.compile.piecewise import STATES_PER_ELEMENT
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import AMOUNT, ELEMENT, STATE, Observer, Variables, real


@dataclass(frozen=True)
class States(Observer):
    """Share of time that every element, a soft stop or friction, is in each of its states.

    Elements in the order of the mechanism, states by their numbers: of a soft stop open, pressed at
    the upper stop, at the lower one, waiting behind the upper, behind the lower, pressed at the upper
    with the damping force limited, at the lower; of friction slip forwards, backwards, stick. Rigid
    stops have "shares".
    """

    name: ClassVar[str] = "states"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``share_in_state`` (..., element, state)."""
        shape = len(mechanism.switching), STATES_PER_ELEMENT
        share = real(
            "shares", "share of time in state", dims=(ELEMENT, STATE), shape=shape, within=AMOUNT
        )
        return {"share_in_state": share}
