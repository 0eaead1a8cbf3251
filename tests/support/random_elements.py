"""Random machines with elements, one for every seed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import vibroimpact as vi

KINDS = {
    "soft": ["soft"],
    "two-sided soft": ["two-sided soft"],
    "limited": ["limited"],
    "two-sided limited": ["two-sided limited"],
    "friction": ["friction"],
    "moving rigid": ["moving rigid"],
    "plastic": ["plastic"],
    "nonsymmetric": ["nonsymmetric", "soft", "friction"],
    "two frictions": ["two frictions", "friction", "friction"],
    "soft and friction": ["soft", "two-sided soft", "friction"],
    "limited and friction": ["limited", "two-sided limited", "friction"],
    "rigid and all": ["rigid", "moving rigid", "soft", "friction"],
}


def machine(rng: np.random.Generator, kinds: Sequence[str]) -> vi.Mechanism:
    n = int(rng.integers(2 if "two frictions" in kinds else 1, 4))  # not both on one coordinate
    a, b, c = (rng.normal(size=(n, n)) for _ in range(3))
    mass, stiffness = a @ a.T + n * np.eye(n), b @ b.T + 0.3 * np.eye(n)
    damping = 0.05 * stiffness
    if "nonsymmetric" in kinds:
        damping, stiffness = damping + 0.2 * (c - c.T), stiffness + 0.1 * rng.normal(size=(n, n))
    w = float(rng.uniform(0.5, 2.0))

    def line(size: float) -> tuple[vi.Harmonic, ...]:
        one = w if rng.random() < 0.5 else w * math.sqrt(2.0)
        a, b = size * rng.normal(size=2)
        return (vi.Harmonic(one, (float(a),), (float(b),)),)

    def stop(kind: str, row: tuple[float, ...]) -> vi.RigidStop | vi.SoftStop | vi.Friction:
        flat = lambda low, high: float(rng.uniform(low, high))  # noqa: E731
        law = ("linear", "unilateral")[int(rng.integers(2))]
        if "limited" in kind:
            law = "limited"
        if kind in ("soft", "limited"):
            return vi.SoftStop(row, upper=flat(-0.2, 1.0), stiffness=flat(5.0, 50.0),
                               damping=flat(0.0, 2.0), law=law)  # fmt: skip
        if kind in ("two-sided soft", "two-sided limited"):
            return vi.SoftStop(
                row, lower=-flat(0.0, 1.0), upper=flat(0.0, 1.0), law=law,
                stiffness=(flat(5.0, 50.0), flat(5.0, 50.0)), damping=(0.0, flat(0.0, 2.0)),
                motion=line(0.1) if rng.random() < 0.5 else (),
            )  # fmt: skip
        if kind == "friction":
            kinetic = flat(0.1, 1.0)
            return vi.Friction(
                row, kinetic=kinetic, static=kinetic * float(rng.choice([1.0, 1.3])),
                belt_speed=float(rng.choice([0.0, 0.3])),
                motion=line(0.2) if rng.random() < 0.5 else (),
            )  # fmt: skip
        restitution = 0.0 if kind == "plastic" else flat(0.3, 0.9)
        if kind == "rigid":
            return vi.RigidStop(row, lower=-flat(0.3, 1.0), upper=flat(0.3, 1.0),
                                restitution=restitution)  # fmt: skip
        return vi.RigidStop(row, upper=flat(0.3, 1.0), restitution=restitution,
                            motion=line(0.2))  # fmt: skip

    elements = tuple(
        stop(k, tuple(float(x) for x in rng.normal(size=n)))
        for k in kinds
        if k not in ("nonsymmetric", "two frictions")
    )
    force = vi.Harmonic(w, tuple(map(float, 2.0 * rng.normal(size=n))),
                        tuple(map(float, rng.normal(size=n))))  # fmt: skip
    return vi.Mechanism(
        mass=mass, damping=damping, stiffness=stiffness, forces=(force,), elements=elements
    )


def start(rng: np.random.Generator, m: vi.Mechanism) -> vi.State:
    """A state near the middle, which may be behind a soft stop, but not behind a rigid one."""
    while True:
        x, v = 0.02 * rng.normal(size=m.degrees), rng.normal(size=m.degrees)
        state = vi.State(tuple(map(float, x)), tuple(map(float, v)), float(rng.uniform(0.0, 6.0)))
        try:
            vi.simulate(m, state, t_max=1e-9)
        except vi.InvalidParameterError:
            continue
        return state
