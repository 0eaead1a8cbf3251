"""Measures of motions, and the flights of runs and orbits of which they are taken."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vibroimpact._core.words import missing_name
from vibroimpact.measures.measure import (
    Amplitude,
    ContactForce,
    DissipatedPower,
    Harmonic,
    ImpactRate,
    ImpactSpeed,
    Impulse,
    Peak,
    Rms,
    Transmissibility,
)

__all__ = [
    "Amplitude",
    "ContactForce",
    "DissipatedPower",
    "Harmonic",
    "ImpactRate",
    "ImpactSpeed",
    "Impulse",
    "Peak",
    "Rms",
    "Transmissibility",
]

if not TYPE_CHECKING:  # type checkers know the names

    def __getattr__(name: str) -> Any:
        """Say which name is meant by one that is not there."""
        raise missing_name(__name__, name, __all__)
