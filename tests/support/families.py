"""Systems that depend on parameters, for tests of ensembles, and equality of bits."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import vibroimpact as vi
from vibroimpact.compile.many_systems import compile_together
from vibroimpact.compile.tables import Stack, Stacks


class Tables(NamedTuple):
    """Systems of one structure, every number of every system: as ``Stacks``, with arrays."""

    dense: bool
    mixed: bool
    degrees: int
    systems: dict[str, Any]
    modes: list[dict[str, Any]]


def tables_of(stacks: Stacks) -> Tables:
    """Every number of every system."""

    def whole(x: Any) -> Any:
        if isinstance(x, dict):
            return {name: whole(part) for name, part in x.items()}
        return x.of(stacks.columns) if isinstance(x, Stack) else x

    modes = [whole(mode) for mode in stacks.modes]
    return Tables(stacks.dense, stacks.mixed, stacks.degrees, whole(stacks.systems), modes)


def compiled(
    system: Any, values: dict[str, Any], codes: tuple[int, ...] = ()
) -> list[tuple[list[int], Tables]]:
    """All systems, in parts of one structure."""
    found = compile_together(system, values, codes)
    parts = [part for part, _ in found.inside(slice(0, found.count))]
    return [(part.systems.tolist(), tables_of(part.stacks)) for part in parts]


def bits(x: Any) -> bytes:
    """What two numbers must share: signs of zeros, and NaN is NaN."""
    array = np.asarray(x, dtype=float)
    return np.where(np.isnan(array), np.nan, array).tobytes()


def swinging(k: float, A: float, phi: float) -> vi.Mechanism:
    """A family whose entries are not polynomials of its parameters, with integers among them."""
    return vi.Mechanism(
        mass=[[np.exp(0.1 * k), 0], [0, 2]],
        damping=[[0.1 * np.sqrt(k), 0], [0, 0]],
        stiffness=[[k**1.5 / (1.0 + k), 0], [0, 0]],
        forces=(vi.Harmonic(np.log(1.0 + k), (A * np.sin(phi), 0), (A * np.cos(phi), 0)),),
        elements=(vi.RigidStop((-1, 1), -1, 1.0 - phi / 7, restitution=abs(0.8 * k / k)),),
        constant_force=(0, A),
    )


FAMILY = vi.Family(swinging, k=1.3, A=2.0, phi=0.4)


def pair_of_masses(k: float, c: float, d: float, m: float) -> vi.Mechanism:
    """Two masses on springs; classically damped or not, frequencies equal or not."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, m]],
        damping=[[c, -c], [-c, c + d]],
        stiffness=[[1.0 + k, -k], [-k, 1.0 + k]],
        forces=(vi.Harmonic(0.61, (1.0, 0.0)),),
        elements=(vi.RigidStop((-1.0, 1.0), upper=0.5, restitution=0.8),),
    )


PAIR = vi.Family(pair_of_masses, k=1.0, c=0.1, d=0.0, m=1.0)

CHAIN = vi.Mechanism(
    mass=[[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.2]],
    damping=[[0.0] * 3] * 3,
    stiffness=[[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]],
    forces=(vi.Harmonic(1.8, (1.0, 0.0, 0.5)), vi.Harmonic(2.7, (0.2, 0.0, 0.0), (0.0, 0.3, 0.0))),
    elements=(vi.RigidStop((0.0, -1.0, 1.0), -0.3, 0.2, (0.5, 0.6)),),
)  # fmt: skip
