"""An oscillator with a Maxwell element, and one with a Jenkins element: massless coordinates."""

from __future__ import annotations

from typing import Any

import vibroimpact as vi

M, C, K, OWN, DASH, SPRING, LEVEL = 1.0, 0.1, 1.0, 0.25, 0.4, 4.0, 0.5
SOFT = vi.SoftStop((1.0, 0.0), upper=0.4, stiffness=20.0, damping=0.3, law="linear")
RIGID = vi.RigidStop((1.0, 0.0), upper=0.4, restitution=0.7)


def maxwell(stop: Any, omega: float = 1.3, light: float = 0.0, own: float = OWN) -> vi.Mechanism:
    """A mass on a spring and, beside it, a dashpot in series with another spring, z between them."""
    return vi.Mechanism(
        mass=[[M, 0.0], [0.0, light]], damping=[[C + DASH, -DASH], [-DASH, DASH]],
        stiffness=[[K, 0.0], [0.0, own]], elements=(stop,), forces=(vi.Harmonic(omega, (0.5, 0.0)),),
    )  # fmt: skip


def jenkins(
    stop: Any, spring: float = SPRING, level: float = LEVEL, force: float = 0.9
) -> vi.Mechanism:
    """A mass on a spring and, beside it, a spring in series with a slider z."""
    return vi.Mechanism(
        mass=[[M, 0.0], [0.0, 0.0]], damping=[[C, 0.0], [0.0, 0.0]],
        stiffness=[[0.3 + spring, -spring], [-spring, spring]],
        elements=(stop, vi.Friction((0.0, 1.0), level)), forces=(vi.Harmonic(1.1, (force, 0.0)),),
    )  # fmt: skip
