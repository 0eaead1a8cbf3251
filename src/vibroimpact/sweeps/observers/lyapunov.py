"""Lyapunov: the largest exponent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import EXPONENTS, Observer, Variables, reals


@dataclass(frozen=True)
class Lyapunov(Observer):
    """Largest Lyapunov exponent per unit of time, the direction of the flow (exponent 0) left out.

    NaN without two events in the window; -inf where the motion no longer depends on its start, as
    after a rest with nothing else in motion.
    """

    name: ClassVar[str] = "lyapunov"

    def variables(self, mechanism: Mechanism) -> Variables:  # noqa: ARG002
        """``lyapunov``."""
        text = "largest Lyapunov exponent per unit of time"
        return reals("exponent", {"lyapunov": text}, quantity="rate", within=EXPONENTS)
