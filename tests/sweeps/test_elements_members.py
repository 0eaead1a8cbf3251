"""Members with soft stops, friction, moving stops: each has the bits of the same run alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.model.parameters import with_parameters
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers import (
    Dissipation,
    Final,
    Forces,
    Impacts,
    Impulse,
    Lyapunov,
    Progress,
    Shares,
    Spectrum,
    States,
    Symbol,
)
from vibroimpact.sweeps.observers.observer import Observer

SEEN: tuple[Observer, ...] = (
    Final(), Impacts(), Shares(), States(), Symbol(), Lyapunov(), Spectrum(), Dissipation(),
    Forces(), Impulse(), Progress(),
)  # fmt: skip


def soft(k: float, c: float, omega: float) -> vi.Mechanism:
    """An oscillator that a stop with a dashpot waits for behind a gap."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.06]], stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (1.0,)),),
        elements=(vi.SoftStop((1.0,), upper=0.5, stiffness=k, damping=c),),
    )  # fmt: skip


def belt(kinetic: float, speed: float, omega: float) -> vi.Mechanism:
    """A block on a belt, pulled by a spring and shaken."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.05]], stiffness=[[1.0]], forces=(vi.Harmonic(omega, (0.3,)),),
        elements=(vi.Friction((1.0,), kinetic, 1.5 * kinetic, belt_speed=speed),),
    )  # fmt: skip


def table(a: float, r: float, omega: float) -> vi.Mechanism:
    """A ball on a table that moves."""
    motion = vi.Harmonic(omega, (a,))
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        elements=(vi.RigidStop((1.0,), lower=-0.7, restitution=r, motion=motion),),
    )  # fmt: skip


def whirling(g: float, r: float, omega: float) -> vi.Mechanism:
    """A rotor with gyroscopic forces in a clearance."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.1, g], [-g, 0.1]],
        stiffness=[[1.0, 0.0], [0.0, 1.2]], forces=(vi.Harmonic(omega, (0.5, 0.0), (0.0, 0.5)),),
        elements=(vi.RigidStop((1.0, 0.0), -0.6, 0.4, restitution=r),),
    )  # fmt: skip


def everything(k: float, kinetic: float, omega: float) -> vi.Mechanism:
    """A chain with a rigid stop, a soft one and friction: modes of closed contacts come later."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.7]], damping=[[0.1, -0.05], [-0.05, 0.05]],
        stiffness=[[2.0, -1.0], [-1.0, 1.0]], forces=(vi.Harmonic(omega, (0.8, 0.0)),),
        constant_force=(0.0, 0.2),
        elements=(
            vi.RigidStop((0.0, 1.0), upper=0.6, restitution=0.2),
            vi.RigidStop((1.0, 0.0), lower=-0.9, restitution=0.3),
            vi.SoftStop((1.0, -1.0), -0.5, 0.5, stiffness=k, damping=0.4),
            vi.Friction((1.0, -1.0), kinetic),
        ),
    )  # fmt: skip


MACHINES: dict[str, tuple[Any, dict[str, list[float]], int]] = {
    "soft stop": (soft, {"k": [29.0, 8.0], "c": [0.5, 0.0], "omega": [0.8, 1.3]}, 1),
    "friction": (belt, {"kinetic": [0.2, 0.4], "speed": [0.1, 0.0], "omega": [0.7, 0.9]}, 1),
    "moving stop": (table, {"a": [0.3, 0.6], "r": [0.5, 0.8], "omega": [2.0, 1.7]}, 1),
    "gyroscopic": (whirling, {"g": [0.3, -0.2], "r": [0.7, 0.5], "omega": [0.9, 1.1]}, 2),
    "all": (everything, {"k": [20.0, 5.0], "kinetic": [0.1, 0.05], "omega": [0.9, 1.4]}, 2),
}


def family(build: Any, values: dict[str, list[float]]) -> vi.Family:
    return vi.Family(build, **{name: x[0] for name, x in values.items()})


def members_of(n: int, length: float) -> Members:
    """Six members of two systems, from different starts."""
    rows = np.array([1, 0, 0, 1, 1, 0], dtype=np.int32)
    position = np.outer(np.linspace(0.1, 0.3, 6), np.linspace(1.0, 0.5, n))  # within all stops
    velocity = np.outer(np.linspace(-1.0, 1.0, 6), np.linspace(1.0, -0.5, n))
    lengths = np.full(6, length)
    return Members(rows, position, velocity, np.linspace(0.0, 6.0, 6), 0.0 * lengths, lengths, 5000)


@pytest.mark.parametrize("name", MACHINES)
def test_a_member_has_the_bits_of_the_run_alone(name: str) -> None:
    build, values, n = MACHINES[name]
    system, members = family(build, values), members_of(n, 90.0)
    out = run_members(
        batch_of(system, {key: np.array(x) for key, x in values.items()}), members, SEEN
    )
    assert np.all(out["end"] == MemberStatus.OK)
    for row, k in enumerate(members.system):
        one = with_parameters(system, {key: x[k] for key, x in values.items()})
        start = vi.State(
            tuple(members.position[row]), tuple(members.velocity[row]), float(members.phase[row])
        )
        run = vi.simulate(one, start, t_max=90.0, impacts=5000)
        assert run.position[-1].tobytes() == out["final_position"][row].tobytes()
        assert run.velocity_after[-1].tobytes() == out["final_velocity"][row].tobytes()
        per = (out["impacts_a"] + out["impacts_b"])[row] * 90.0 * one.mechanism.omega
        assert round(per / (2.0 * math.pi)) == run.impacts.sum()


@pytest.mark.parametrize("name", MACHINES)
def test_a_member_has_the_same_bits_beside_others_and_alone(name: str) -> None:
    build, values, n = MACHINES[name]
    system, members = family(build, values), members_of(n, 90.0)
    columns = {key: np.array(x) for key, x in values.items()}
    out = run_members(batch_of(system, columns), members, SEEN)
    for row in range(6):
        only = members.of(np.array([row]), np.array([0]))
        k = members.system[row]
        alone = batch_of(system, {key: x[k : k + 1] for key, x in columns.items()})
        for key, one in run_members(alone, only, SEEN).items():
            assert one.tobytes() == out[key][row : row + 1].tobytes(), (key, row)


def test_shares_of_states_are_those_of_the_closed_form() -> None:
    """Free motion of a bilinear oscillator: half a period of each of its frequencies."""
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        elements=(vi.SoftStop((1.0,), upper=0.0, stiffness=8.0),),
    )  # fmt: skip
    period = math.pi + math.pi / 3.0
    found = vi.sweep(
        m, over={"constant_force[0]": [0.0]}, start=vi.State((0.0,), (1.0,)), observe=["states", "speeds"],
        settle_periods=0.0, periods=30.0 * period, progress=False,
    )  # fmt: skip
    shares = found.share_in_state.values[0, 0]
    # an event has rounding of some 2^-53 t: 64 ulp of the whole
    np.testing.assert_allclose(shares[:3], [0.75, 0.25, 0.0], atol=2.0**-46)
    assert not shares[3:].any()
    np.testing.assert_allclose(found.speed_mean, 1.0, rtol=2.0**-46)


def test_friction_on_a_steady_motion_sticks_and_slips_for_the_times_of_the_run() -> None:
    build, values, _ = MACHINES["friction"]
    system, start = family(build, values), vi.State((0.2,), (0.0,))
    periods = 20.0
    found = vi.sweep(
        system,
        over={"kinetic": [0.2]},
        start=start,
        observe="states",
        settle_periods=0.0,
        periods=periods,
        progress=False,
    )
    length = periods * 2.0 * math.pi / 0.7
    run = vi.simulate(system, start, t_max=length, impacts=5000)
    _, velocity = run.at(np.linspace(0.0, length, 20001)[1:-1])
    stuck = np.mean(np.abs(velocity[:, 0] - 0.1) < 1e-9)
    shares = found.share_in_state.values[0, 0]
    assert abs(shares[2] - stuck) < 2.0 * len(run) / 20000.0  # an interval at either end of a phase
    assert 0.05 < shares[2] < 0.95
    np.testing.assert_allclose(shares.sum(), 1.0, rtol=2.0**-46)


@pytest.mark.parametrize("law", ["linear", "unilateral", "limited"])
def test_what_elements_take_is_what_the_motion_loses(law: Any) -> None:
    """Free decay: no other dashpot, so that the energy goes into the stops and into friction."""
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 2.0]], damping=[[0.0] * 2] * 2, stiffness=[[2.0, -1.0], [-1.0, 3.0]],
        elements=(
            vi.SoftStop((1.0, -1.0), -0.3, 0.2, stiffness=(5.0, 20.0), damping=(0.3, 0.8),
                        law=law),
            vi.Friction((0.0, 1.0), 0.01),
        ),
    )  # fmt: skip
    start = vi.GridStarts({"v1": [1.0, 2.0]}, vi.State((0.0, 0.0), (0.0, 0.5)))
    length = 30.0
    found = vi.sweep(
        m, over={}, start=start, observe=["dissipation", "final"], settle_periods=0.0, periods=length,
        progress=False,
    )  # fmt: skip

    def energy(x: np.ndarray, v: np.ndarray) -> Any:
        spring = np.array([[2.0, -1.0], [-1.0, 3.0]])
        return (x @ spring @ x + v @ np.diag([1.0, 2.0]) @ v) / 2.0

    for row, v1 in enumerate([1.0, 2.0]):
        before = energy(np.zeros(2), np.array([v1, 0.5]))
        end = energy(found.final_position.values[row], found.final_velocity.values[row])
        work = found.work_on_element.values[row] * length
        assert np.all(work > 0.0)
        # some 2000 steps, each with the rounding of the energy
        np.testing.assert_allclose(work.sum(), before - end, atol=2000 * 2.0**-53 * before)


@pytest.mark.slow
def test_a_plane_names_the_motions_that_classify_finds() -> None:
    system = vi.Family(soft, k=29.0, c=0.0, omega=0.8)
    over = {"omega": np.linspace(0.7, 1.4, 4), "k": np.array([5.0, 29.0])}
    start = vi.State((0.1,), (0.3,), 0.1)
    found = vi.plane(system, over=over, start=start, settle_periods=300, periods=60, progress=False)
    words = dict(zip(found.motion.flag_values, found.motion.flag_meanings.split(), strict=True))
    for i, omega in enumerate(over["omega"]):
        for j, k in enumerate(over["k"]):
            attractor = vi.classify(vi.Family(soft, k=float(k), c=0.0, omega=float(omega)), start)
            if attractor.symbol:
                assert words[int(found.motion[i, j])] == attractor.symbol, (omega, k)
    assert any(words[int(code)] == "1-1-0" for code in found.motion.values.ravel())


def test_basins_and_diagrams_take_soft_stops_and_moving_ones() -> None:
    start = vi.State((0.1,), (0.3,), 0.1)
    axis = np.linspace(-2.0, 2.0, 6)
    basins = vi.basins(
        vi.Family(soft, k=29.0, c=0.0, omega=1.3), over={"x1": axis, "v1": axis}, start=start,
        settle_periods=200, periods=40, progress=False,
    )  # fmt: skip
    for name in basins.name.values:
        state = vi.attractor_state(basins, str(name))
        found = vi.classify(vi.Family(soft, k=29.0, c=0.0, omega=1.3), state)
        assert str(name).startswith(found.symbol)
    diagram = vi.bifurcation_sweep(
        vi.Family(table, a=0.3, r=0.5, omega=2.0),
        at=vi.AtStop("B"),
        over={"a": np.linspace(0.4, 0.6, 3)},
        start=vi.State((0.5,), (0.0,), 0.1),
        settle_periods=100,
        progress=False,
    )
    height = diagram.x1.values[np.isfinite(diagram.x1.values)]
    assert height.size
    assert np.all(np.abs(height + 0.7) <= 0.6 + 1e-12)  # points lie on the table


def test_numbers_of_elements_are_parameters() -> None:
    found = vi.sweep(
        soft(29.0, 0.5, 0.8), over={"elements[0].stiffness": [8.0, 29.0]},
        start=vi.State((0.1,), (0.3,), 0.1), observe="final", settle_periods=0, periods=20, progress=False,
    )  # fmt: skip
    for row, k in enumerate([8.0, 29.0]):
        alone = vi.simulate(
            soft(k, 0.5, 0.8), vi.State((0.1,), (0.3,), 0.1), t_max=20.0 * (2.0 * math.pi / 0.8)
        )
        assert alone.position[-1].tobytes() == found.final_position.values[row].tobytes()


@pytest.mark.parametrize("name", MACHINES)
def test_a_sweep_of_a_mechanism_can_be_repeated_from_its_attributes(name: str) -> None:
    build, values, n = MACHINES[name]
    m = family(build, values).mechanism
    found = vi.sweep(
        m, over={"mass[0][0]": [1.0, 1.1]}, start=vi.State((0.1,) * n, (0.3,) * n),
        observe=["final", "states"], settle_periods=5, periods=5, progress=False,
    )  # fmt: skip
    assert vi.rerun_sweep(found, progress=False).identical(found)
