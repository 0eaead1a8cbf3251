"""Settling: when a motion reaches its orbit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import AMOUNT, Observer, Variables, reals


@dataclass(frozen=True, kw_only=True)
class Settling(Observer):
    """Time from which on a motion stays within a tolerance of its periodic orbit.

    The motion is run twice. NaN where it is not periodic, as :class:`Symbol` says with these
    options.

    Parameters
    ----------
    tolerance, returns
        As in :class:`Symbol`.
    longest
        Most impacts of the orbit, 1 to 10^6.
    """

    name: ClassVar[str] = "settling"
    tolerance: float = 1e-6
    returns: int = 2
    longest: int = 64

    def variables(self, mechanism: Mechanism) -> Variables:  # noqa: ARG002
        """``settling``."""
        text = "time until the motion stays on its orbit"
        return reals("time", {"settling": text}, quantity="time", within=AMOUNT)
