"""Systems under test, and the same systems for the references."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st
from witness import damper as damper_witness_module

import vibroimpact as vi

if TYPE_CHECKING:
    from numpy.random import Generator

PAPER_SETS: dict[str, dict[str, float]] = {
    "A": {
        "mass_ratio": 0.1, "omega_n": 0.5, "zeta": 0.045, "restitution": 0.8, "half_clearance": 5.0,
    },
    "B": {
        "mass_ratio": 0.04, "omega_n": 0.6, "zeta": 0.025, "restitution": 0.7,
        "half_clearance": 8.0,
    },
    "C": {
        "mass_ratio": 0.05092, "omega_n": 1.0, "zeta": 0.015, "restitution": 0.7,
        "half_clearance": 6.0,
    },
}  # fmt: skip


# Parameters of impact dampers of all kinds, for hypothesis.
DAMPER_PARAMETERS = st.fixed_dictionaries({
    "mass_ratio": st.floats(0.01, 3.0),
    "omega_n": st.floats(0.0, 2.0),
    "zeta": st.floats(0.01, 1.5),
    "restitution": st.floats(0.05, 1.0),
    "half_clearance": st.floats(0.05, 10.0),
    "omega": st.floats(0.2, 3.0),
})  # fmt: skip


def paper_damper(name: str, omega: float, **changes: float) -> vi.ImpactDamper:
    """A damper of the paper, with some parameters changed."""
    return replace(vi.ImpactDamper(**PAPER_SETS[name], omega=omega), **changes)


def damper_witness(d: vi.ImpactDamper) -> damper_witness_module.Damper:
    """The reference for the same doubles."""
    return damper_witness_module.Damper(
        mass_ratio=d.mass_ratio, omega_n=d.omega_n, zeta=d.zeta, restitution=d.restitution,
        half_clearance=d.half_clearance, omega=d.omega, force=d.force,
    )  # fmt: skip


def oscillator(
    *,
    stiffness: float,
    damping: float,
    forces: tuple[vi.Harmonic, ...] = (),
    constant_force: float = 0.0,
    lower: float = -1e6,
    upper: float = 1e6,
    restitution: float = 1.0,
) -> vi.Mechanism:
    """One coordinate of unit mass between two stops, far away unless given."""
    return vi.Mechanism(
        mass=[[1.0]],
        damping=[[damping]],
        stiffness=[[stiffness]],
        forces=forces,
        constant_force=(constant_force,),
        elements=(vi.RigidStop((1.0,), lower, upper, restitution),),
    )


def ball(restitution: float, gravity: float = 9.8) -> vi.Mechanism:
    """A ball above the floor x = 0."""
    return oscillator(
        stiffness=0.0, damping=0.0, constant_force=-gravity, lower=0.0, upper=np.inf,
        restitution=restitution,
    )  # fmt: skip


def random_symmetric(rng: Generator, n: int, rank: int) -> Any:
    """A random symmetric matrix of this rank, no negative eigenvalue, entries of order one."""
    factor = rng.normal(size=(n, rank))
    return factor @ factor.T / max(rank, 1)


def random_mechanism(
    rng: Generator, n: int, *, contacts: int = 1, lines: int = 1, stiff_rank: int | None = None
) -> vi.Mechanism:
    """Full mass, non-proportional damping, a stiffness that may leave free masses."""
    rank = n if stiff_rank is None else stiff_rank
    forces = tuple(
        vi.Harmonic(rng.uniform(0.5, 2.0), tuple(rng.normal(size=n)), tuple(rng.normal(size=n)))
        for _ in range(lines)
    )
    stops = tuple(
        vi.RigidStop(tuple(rng.normal(size=n)), -rng.uniform(0.2, 1.0), rng.uniform(0.2, 1.0),
                   rng.uniform(0.3, 1.0))
        for _ in range(contacts)
    )  # fmt: skip
    return vi.Mechanism(
        mass=np.eye(n) + random_symmetric(rng, n, n),
        damping=0.1 * random_symmetric(rng, n, n),
        stiffness=random_symmetric(rng, n, rank),
        forces=forces,
        elements=stops,
    )


def heavy(seed: int, damping: str = "Rayleigh") -> tuple[vi.Mechanism, vi.State]:
    """Two to four bodies of shared inertia that gravity brings to rest on two to four stops.

    Modes are those of vibration with no damping or Rayleigh's, and coupled by a dashpot elsewhere.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    half, spring = rng.normal(size=(2, n, n))
    stiffness = 0.3 * (spring @ spring.T) + 0.5 * np.eye(n)
    mass = half @ half.T + 0.5 * np.eye(n)
    dashpots = (damping != "none") * (0.02 * mass + 0.05 * stiffness)
    dashpots[0, 0] += 0.1 * (damping == "general")
    mechanism = vi.Mechanism(
        mass=mass.tolist(),
        damping=dashpots.tolist(),
        stiffness=stiffness.tolist(),
        forces=(vi.Harmonic(rng.uniform(0.5, 2.0), tuple(rng.normal(size=n) * 1.5)),),
        constant_force=tuple(-rng.uniform(1.0, 4.0, n)),
        elements=tuple(
            vi.RigidStop(tuple(row), 0.0, np.inf, rng.uniform(0.2, 0.8))
            for row in np.eye(n)[: rng.integers(2, n + 1)]
        ),
    )
    x, v = np.abs(rng.normal(size=n)) + 0.1, rng.normal(size=n)
    return mechanism, vi.State(tuple(x), tuple(v), phase=rng.uniform(0.0, 6.0))
