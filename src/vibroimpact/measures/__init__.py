"""Measures of motions, and the flights of runs and orbits of which they are taken."""

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
