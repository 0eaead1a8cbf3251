"""Structures whose cost is compared: chains of masses between stops, and random starts for them.

Chain      equal masses between equal springs, both ends held; the last `contacts` masses each move
           between two stops; a harmonic force on the last mass. Damping in proportion to the
           stiffness is classical: the structure decouples into vibration modes. A dashpot to the
           ground that grows along the chain is not: it couples them.
Structure  two masses, every entry of C and K filled, one of them between two stops: as large as the
           impact damper, and nothing of it is free or zero.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

import vibroimpact as vi
from benchmarks.case import Floats, Parameters

GAP, RESTITUTION, FREQUENCY = 0.3, 0.7, 0.9
PROPORTIONAL, GROWING = 0.05, 0.02  # dashpots beside springs; to the ground, per place


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """A system and its starts.

    Attributes
    ----------
    system
        What `vibroimpact.simulate` takes.
    position, velocity : ndarray, shape (N, n)
        Between the stops or on them.
    phase : ndarray, shape (N,)
        Of the force.
    """

    system: vi.Mechanism | vi.ImpactDamper
    position: Floats
    velocity: Floats
    phase: Floats

    def __len__(self) -> int:
        return len(self.phase)

    def first(self, count: int) -> Ensemble:
        """Return the ensemble of the first members."""
        return Ensemble(
            self.system, self.position[:count], self.velocity[:count], self.phase[:count]
        )


def damper(parameters: Parameters, starts: Floats) -> Ensemble:
    """Make an ensemble of the damper from starts with the columns `case.START_COLUMNS`."""
    system = vi.ImpactDamper(**asdict(parameters))
    return Ensemble(system, starts[:, 0:2].copy(), starts[:, 2:4].copy(), starts[:, 4].copy())


def chain(degrees: int, contacts: int, *, damping: str) -> vi.Mechanism:
    """Make a chain; `damping` is "none", "classical" or "general"."""
    stiffness = 2.0 * np.eye(degrees) - np.eye(degrees, k=1) - np.eye(degrees, k=-1)
    dashpots = 0.0 * stiffness if damping == "none" else PROPORTIONAL * stiffness
    if damping == "general":
        dashpots = dashpots + GROWING * np.diag(np.arange(1.0, degrees + 1.0))
    rows = np.eye(degrees)[degrees - contacts :]
    return vi.Mechanism(
        mass=np.eye(degrees).tolist(),
        damping=dashpots.tolist(),
        stiffness=stiffness.tolist(),
        forces=(vi.Harmonic(FREQUENCY, tuple(np.eye(degrees)[-1])),),
        elements=tuple(vi.RigidStop(tuple(row), -GAP, GAP, RESTITUTION) for row in rows),
    )


def two_masses() -> vi.Mechanism:
    """Make the structure of two masses."""
    stiffness = np.array([[2.0, -0.8], [-0.8, 1.2]])
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.6]],
        damping=(PROPORTIONAL * stiffness).tolist(),
        stiffness=stiffness.tolist(),
        forces=(vi.Harmonic(FREQUENCY, (1.0, 0.3)),),
        elements=(vi.RigidStop((0.0, 1.0), -GAP, GAP, RESTITUTION),),
    )


def random_ensemble(system: vi.Mechanism, count: int, rng: np.random.Generator) -> Ensemble:
    """Draw starts well inside the stops, with velocities and phases of all kinds."""
    shape = (count, system.degrees)
    return Ensemble(
        system,
        rng.uniform(-0.9 * GAP, 0.9 * GAP, shape),
        rng.normal(0.0, 0.5, shape),
        rng.uniform(0.0, 2 * math.pi, count),
    )
