"""Quick flights of larger machines with elements, whose coordinates and guards stand side by side in registers."""

from __future__ import annotations

import hashlib
import math

import numpy as np
from scipy.integrate import solve_ivp

import vibroimpact as vi
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.observers import Final, Lyapunov

MASSES, STIFFNESS, DASHPOT, LIMIT, OMEGA = 6, 20.0, 0.3, 0.4, 0.6
# of a run of some three hundred events, from x86-64 with AVX-512; any instruction set has it
HASH = "09a4c0ad5303e5fdca0e438c7e413a84221e64f8314458aa9aeb45ab60dbd8ef"

K = 2.0 * np.eye(MASSES) - np.eye(MASSES, k=1) - np.eye(MASSES, k=-1)
FORCE = np.eye(MASSES)[0]
START = vi.State(
    (0.25, 0.0, -0.125, 0.25, -0.25, 0.125),
    (0.75, -0.375, -0.5, 0.75, -0.125, -0.625),
)


def chain(*elements: vi.RigidStop | vi.SoftStop | vi.Friction) -> vi.Mechanism:
    """A chain of masses between two walls, shaken at the first."""
    return vi.Mechanism(
        mass=np.eye(MASSES), damping=0.05 * K, stiffness=K,
        forces=(vi.Harmonic(OMEGA, tuple(FORCE)),), elements=elements,
    )  # fmt: skip


def row(i: int) -> tuple[float, ...]:
    """Row of mass i alone."""
    return tuple(np.eye(MASSES)[i])


MIXED = chain(
    vi.RigidStop(row(5), upper=0.5, restitution=0.7),
    vi.SoftStop(row(0), -LIMIT, LIMIT, stiffness=STIFFNESS, damping=DASHPOT),
    vi.SoftStop((0.0, 0.0, 1.0, -1.0, 0.0, 0.0), -LIMIT, LIMIT, stiffness=STIFFNESS),
    vi.Friction(row(4), 0.05),
)


def test_soft_stops_of_six_masses_agree_with_an_integration() -> None:
    """Linear soft stops are a force on (x, v), which SciPy integrates from crossing to crossing to 1e-12."""
    stops = [(i, side) for i in (0, 2, 4) for side in (-1.0, 1.0)]
    soft = [
        vi.SoftStop(row(i), -LIMIT, LIMIT, stiffness=STIFFNESS, damping=DASHPOT, law="linear")
        for i in (0, 2, 4)
    ]
    t_max = 40.0
    run = vi.simulate(chain(*soft), START, t_max=t_max)

    def passed(y: np.ndarray, stop: tuple[int, float]) -> float:
        return float(stop[1] * y[stop[0]] - LIMIT)

    y, t = np.concatenate([START.position, START.velocity]), 0.0
    pressed, times = {stop: passed(y, stop) > 0.0 for stop in stops}, []
    while t < t_max:

        def rate(t: float, y: np.ndarray) -> np.ndarray:
            x, v = y[:MASSES], y[MASSES:]
            force = FORCE * math.sin(OMEGA * t) - K @ x - 0.05 * K @ v
            for stop, within in pressed.items():
                if within:
                    i, side = stop
                    force[i] -= side * STIFFNESS * passed(y, stop) + DASHPOT * v[i]
            return np.concatenate([v, force])

        crossings = []
        for stop, within in pressed.items():
            crossing = lambda _, y, stop=stop: passed(y, stop)  # noqa: E731
            crossing.terminal, crossing.direction = True, -1.0 if within else 1.0
            crossings.append(crossing)
        part = solve_ivp(
            rate, (t, t_max), y, method="DOP853", events=crossings, rtol=1e-12, atol=1e-13
        )
        t, y = float(part.t[-1]), part.y[:, -1]
        for stop, found in zip(stops, part.t_events, strict=True):
            if found.size:
                pressed[stop] = not pressed[stop]
                times.append(float(found[0]))
    assert len(times) > 20
    np.testing.assert_allclose(run.time[: len(times)], times, atol=1e-9)
    np.testing.assert_allclose(run.position[-1], y[:MASSES], atol=1e-9)


def test_members_with_tangents_have_the_bits_of_runs_alone() -> None:
    """Jets take sums of entries of y one after the other, numbers take them in registers."""
    n, length = 3, 80.0
    scale = np.array([1.0, 0.7, -0.9])[:, None]
    position, velocity = scale * START.position, scale * START.velocity
    members = Members(np.zeros(n, np.int32), position, velocity, np.zeros(n), np.full(n, 20.0),
                      np.full(n, length - 20.0), 10**6)  # fmt: skip
    out = run_members(batch_of(MIXED, {}), members, (Final(), Lyapunov()))
    for i in range(n):
        start = vi.State(tuple(position[i]), tuple(velocity[i]))
        run = vi.simulate(MIXED, start, t_max=length, impacts=10**6)
        assert run.position[-1].tobytes() == out["final_position"][i].tobytes()


def test_a_run_has_the_same_bits_in_registers_of_any_size() -> None:
    run = vi.simulate(MIXED, START, t_max=200.0, impacts=10**6)
    assert len(run) > 200
    bits = run.time.tobytes() + run.position.tobytes() + run.velocity_after.tobytes()
    assert hashlib.sha256(bits).hexdigest() == HASH
