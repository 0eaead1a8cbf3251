"""Closed forms by machine, for general analyses.

A machine with closed-form orbits is one line of ``SYMMETRIC``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from vibroimpact.closed_forms.symmetric_orbits import SymmetricOrbit, symmetric_orbits
from vibroimpact.machines.impact_damper import ImpactDamper

SYMMETRIC: dict[type, Callable[[Any], tuple[SymmetricOrbit, ...]]] = {
    ImpactDamper: symmetric_orbits,
}


def has_symmetric_orbits(machine: type) -> bool:
    """Whether closed forms of symmetric orbits are known for a class of systems."""
    return any(issubclass(machine, known) for known in SYMMETRIC)


def symmetric_orbits_of(system: object) -> tuple[SymmetricOrbit, ...]:
    """Symmetric orbits in closed form; empty where none exist or none are known."""
    found = (orbits for known, orbits in SYMMETRIC.items() if isinstance(system, known))
    orbits = next(found, None)
    return orbits(system) if orbits else ()
