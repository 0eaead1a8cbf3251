"""Event times and derivatives of machines with elements against 50 digits (exact_chain.py)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray
from support.event_reference import Reference
from support.exact_chain import DIGITS, NO_TRANSITION, flights, follow, start_of

import vibroimpact as vi

UNIT = 2.0**-53
Array = NDArray[np.float64]


@pytest.fixture(autouse=True)
def fifty_digits() -> Iterator[None]:
    with mp.workdps(DIGITS + 15):
        yield


def one(*elements: Any, damping: float = 0.125, stiffness: float = 1.0, push: float = 0.0,
        force: float = 1.5) -> vi.Mechanism:  # fmt: skip
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], constant_force=(push,),
        forces=(vi.Harmonic(0.75, (force,), (0.25,)),), elements=elements,
    )  # fmt: skip


STOP, WAVE = vi.SoftStop, vi.Harmonic(1.25, (0.25,))
MACHINES = {
    "soft, by gap": one(STOP((1.0,), upper=0.25, stiffness=8.0, damping=0.5, law="linear")),
    "soft, by force": one(STOP((1.0,), upper=0.25, stiffness=8.0, damping=2.0)),
    "soft on both sides": one(
        STOP((1.0,), lower=-0.5, upper=0.25, stiffness=(4.0, 8.0), damping=(2.0, 0.5))),
    "soft, limited": one(
        STOP((1.0,), upper=0.25, stiffness=8.0, damping=2.0, law="limited")),
    "limited on both sides, moving": one(
        STOP((1.0,), lower=-0.5, upper=0.25, stiffness=(4.0, 8.0), damping=(2.0, 0.5),
        law="limited", motion=WAVE)),
    "preloaded": one(STOP((1.0,), upper=-0.25, stiffness=3.0, damping=1.0)),
    "soft, moving": one(STOP((1.0,), upper=0.25, stiffness=8.0, damping=1.0, motion=WAVE)),
    "friction": one(vi.Friction((1.0,), kinetic=0.5)),
    "friction with a static level": one(vi.Friction((1.0,), kinetic=0.5, static=0.75), force=2.0),
    "friction on a belt": one(vi.Friction((1.0,), kinetic=0.25, static=0.5, belt_speed=0.5)),
    "friction on a belt that swings": one(
        vi.Friction((1.0,), kinetic=0.25, static=0.5, motion=vi.Harmonic(1.25, (0.5,)))),
    "rigid, moving": one(vi.RigidStop((1.0,), upper=0.25, restitution=0.75, motion=WAVE)),
    "soft and friction": one(
        STOP((1.0,), upper=0.25, stiffness=8.0, damping=2.0), vi.Friction((1.0,), kinetic=0.25,
        static=0.375), force=2.0),
}  # fmt: skip
T_MAX = 40.0
START = vi.State((0.0,), (0.4375,), 0.375)


def derivative(m: vi.Mechanism, run: vi.Run, step: Any) -> tuple[list[Any], Array, Array]:
    """Times, their derivatives, and those of the state at the end of the run, at 50 digits."""
    r, first = Reference(m, START), mpf(m.forces[0].omega)
    chain = flights(run, r)
    base = follow(r, start_of(r, START), chain, T_MAX)
    times, columns = [], []
    for k in range(3):
        moved = [
            mpf(y) + step * (k == i) for i, y in enumerate((0.0, *START.velocity, START.phase))
        ]
        waves = [f(moved[2] * mpf(w) / first) for w in r.omegas for f in (mp.sin, mp.cos)]
        t, z = follow(r, [*moved[:2], *waves, mpf(1)], chain, T_MAX)
        times.append([float((a - b) / step) for a, b in zip(t, base[0], strict=True)])
        columns.append([float((a - b) / step) for a, b in zip(z[:2], base[1][:2], strict=True)])
    return base[0], np.array(times), np.array(columns).T


@pytest.mark.slow
@pytest.mark.parametrize("what", MACHINES)
def test_times_of_events_and_derivatives_are_those_at_fifty_digits(what: str) -> None:
    m = MACHINES[what]
    run = vi.simulate(m, START, t_max=T_MAX)
    times, growth, matrix = derivative(m, run, mpf(10) ** -25)
    counted = [i for i in range(len(run)) if run.status[i] not in NO_TRANSITION]
    assert len(times) == len(counted) >= 8
    # rounding of a step is 4 u of coordinates below 4; steps are of 0.7 / 10 or more; the largest
    # growth so far carries it on
    for j, i in enumerate(counted):
        steps = 16.0 + run.time[i] / 0.07
        carried = max(1.0, float(np.abs(growth[:, : j + 1]).max()))
        assert abs(float(mpf(run.time[i]) - times[j])) < 16.0 * UNIT * steps * carried
    both = np.array([f.omega / m.omega for f in m.forces])  # phases move together
    directions = np.eye(2 + len(both), 3)
    directions[2:, 2] = both
    got = vi.map_derivative(m, START, t_max=T_MAX, impacts=100_000, directions=directions)
    # the states of the run differ by 1e-13 or so, and the derivatives by as much times second ones
    size = 1e-9 * max(1.0, float(np.abs(matrix).max()), float(np.abs(growth).max()))
    assert not got.duration.any()  # it ends at a given time
    np.testing.assert_allclose(got.matrix[:2], matrix, atol=size)
