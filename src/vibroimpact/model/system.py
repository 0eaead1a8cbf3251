"""Systems: mechanisms, and anything that says which mechanism it is."""

from __future__ import annotations

from typing import Protocol

from vibroimpact._core.checks import refusal
from vibroimpact.model.mechanism import Mechanism


class HasMechanism(Protocol):
    """Anything that says which mechanism it is."""

    @property
    def mechanism(self) -> Mechanism:
        """Masses, springs, forces and stops."""


System = HasMechanism | Mechanism


def mechanism_of(system: System) -> Mechanism:
    """The mechanism behind a system."""
    if isinstance(system, Mechanism):
        return system
    mechanism = getattr(system, "mechanism", None)
    if isinstance(mechanism, Mechanism):
        return mechanism
    raise refusal("system", system, "a Mechanism or have one, as ImpactDamper does")
