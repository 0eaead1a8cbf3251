"""Machines with elements in lanes: many beside each other, in different modes, with the bits of each alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.model.parameters import with_parameters
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers import Final, Impacts, States

MEMBERS = 45  # more than the lanes of all packs
LENGTH = 60.0


def oscillator(*elements: Any, omega: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.05]], stiffness=[[1.0]], forces=(vi.Harmonic(omega, (1.2,)),),
        elements=elements,
    )  # fmt: skip


def two_masses(*elements: Any, omega: float) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.6]], damping=[[0.1, -0.05], [-0.05, 0.07]],
        stiffness=[[2.0, -1.0], [-1.0, 1.0]], forces=(vi.Harmonic(omega, (0.9, 0.0)),),
        elements=elements,
    )  # fmt: skip


MACHINES = {
    "stops that never pull": lambda x, omega: oscillator(
        vi.SoftStop((1.0,), -0.8, 0.7, stiffness=25.0 * x, damping=0.6), omega=omega
    ),
    "stops that pull": lambda x, omega: oscillator(
        vi.SoftStop((1.0,), -0.8, 0.7, stiffness=8.0 * x, damping=0.3, law="linear"), omega=omega
    ),
    "stops of limited damping": lambda x, omega: oscillator(
        vi.SoftStop((1.0,), -0.8, 0.7, stiffness=25.0 * x, damping=0.6, law="limited"), omega=omega
    ),
    "friction that holds": lambda x, omega: oscillator(
        vi.Friction((1.0,), 0.5 * x, 0.8 * x), omega=omega
    ),
    "friction in a soft stop": lambda x, omega: oscillator(
        vi.Friction((1.0,), 0.2 * x), vi.SoftStop((1.0,), upper=0.6, stiffness=12.0), omega=omega
    ),
    "a belt before a rigid stop": lambda x, omega: oscillator(
        vi.RigidStop((1.0,), upper=0.5, restitution=0.6),
        vi.Friction((1.0,), 0.3 * x, 0.4 * x, belt_speed=0.3), omega=omega,
    ),
    "a square wave on a soft stop": lambda x, omega: oscillator(
        vi.PhaseSwitch(omega, (0.0, 2.0), ((0.4 * x,), (-0.4 * x,))),
        vi.SoftStop((1.0,), upper=0.6, stiffness=12.0, damping=0.2), omega=omega,
    ),
    "a pile in soil that yields": lambda x, omega: vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.1, 0.0], [0.0, 0.0]],
        stiffness=[[0.2, 0.0], [0.0, 0.0]], forces=(vi.Harmonic(omega, (1.5, 0.0)),),
        elements=(vi.SoftStop((1.0, -1.0), upper=0.8, stiffness=30.0),
                  vi.Friction((0.0, 1.0), 0.8 * x)),
    ),
    "two masses that meet": lambda x, omega: two_masses(
        vi.SoftStop((1.0, -1.0), -0.4, 0.4, stiffness=20.0 * x, damping=0.2),
        vi.Friction((0.0, 1.0), 0.1 * x), omega=omega,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Sweep:
    """Members of several systems, with what is known of them."""

    family: vi.Family
    values: dict[str, np.ndarray]
    members: Members
    out: dict[str, np.ndarray]


def swept(name: str) -> Sweep:
    rng = np.random.default_rng(len(name))
    values = {"x": np.array([1.0, 0.6, 1.4, 1.1]), "omega": np.array([0.8, 1.1, 0.7, 0.95])}
    family = vi.Family(MACHINES[name], x=1.0, omega=0.8)
    n = family.mechanism.degrees
    rows = np.sort(rng.integers(0, 4, MEMBERS)).astype(np.int32)
    position, velocity = rng.uniform(-0.4, 0.4, (MEMBERS, n)), rng.uniform(-1.0, 1.0, (MEMBERS, n))
    lengths = np.full(MEMBERS, LENGTH)
    settle = np.where(np.arange(MEMBERS) % 3 == 0, 0.0, 0.5 * LENGTH)  # some are shown all events
    members = Members(rows, position, velocity, rng.uniform(0.0, 6.0, MEMBERS), settle,
                      lengths - settle, 5000)  # fmt: skip
    out = run_members(batch_of(family, values), members, (Final(), Impacts(), States()))
    return Sweep(family, values, members, out)


@pytest.mark.parametrize("name", MACHINES)
def test_lanes_in_different_modes_have_the_bits_of_each_motion_alone(name: str) -> None:
    s = swept(name)
    assert np.all(s.out["end"] == MemberStatus.OK)
    np.testing.assert_allclose(s.out["share_in_state"].sum(axis=-1), 1.0, rtol=2.0**-44)
    events = 0
    for i, k in enumerate(s.members.system):
        one = with_parameters(s.family, {key: float(x[k]) for key, x in s.values.items()})
        start = vi.State(tuple(s.members.position[i]), tuple(s.members.velocity[i]),
                         float(s.members.phase[i]))  # fmt: skip
        run = vi.simulate(one, start, t_max=LENGTH, impacts=5000)
        events += len(run)
        assert run.position[-1].tobytes() == s.out["final_position"][i].tobytes()
        assert run.velocity_after[-1].tobytes() == s.out["final_velocity"][i].tobytes()
        seen = np.count_nonzero(run.impacts & (run.time >= s.members.settle[i]))
        counted = (s.out["impacts_a"] + s.out["impacts_b"])[i].sum() * s.members.observe[i]
        assert round(counted * one.mechanism.omega / (2.0 * np.pi)) == seen
    assert events > 5 * MEMBERS
