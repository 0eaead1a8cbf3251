"""What is said of a motion: flights of runs and orbits, and the measures that are taken of them."""

from __future__ import annotations

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
