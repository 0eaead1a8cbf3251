"""Flights that repeat an earlier one: those of runs that become periodic."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.builds import output
from support.members import alone_like
from support.members import run as run_members
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.sweeps.execution.batch import batch_of
from vibroimpact.sweeps.observers import Final, Lyapunov, Symbol

if TYPE_CHECKING:
    from pathlib import Path

DAMPER = paper_damper("A", 1.2)


@pytest.mark.parametrize("program", ["repetition_test", "repetition_test_mixed"])
@pytest.mark.slow
def test_flights_that_are_proved_clear_are_clear(tmp_path: Path, program: str) -> None:
    output(tmp_path, program, "clang")


def state_after(run: vi.Run, i: int) -> vi.State:
    return vi.State(tuple(run.position[i]), tuple(run.velocity_after[i]), float(run.phase[i]))


def walled() -> vi.Mechanism:
    """The impact damper, its main mass before a wall that it does not reach."""
    wall = vi.RigidStop((1.0, 0.0), -np.inf, 1.5, 0.5)
    return replace(DAMPER.mechanism, elements=(*DAMPER.mechanism.elements, wall))


def two_stops() -> vi.Mechanism:
    """Two coupled masses that strike a stop each in turn, once in a period."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.8]],
        damping=[[0.1, 0.0], [0.0, 0.1]],
        stiffness=[[1.1, -0.1], [-0.1, 2.1]],
        forces=(vi.Harmonic(1.7, (2.0, 1.5)),),
        elements=(
            vi.RigidStop((1.0, 0.0), lower=-0.3, upper=np.inf, restitution=0.6),
            vi.RigidStop((0.0, 1.0), lower=-0.4, upper=np.inf, restitution=0.7),
        ),
    )


def pushed_ball() -> vi.Mechanism:
    """A heavy damped oscillator on a stop, one impact in a period."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.15]], stiffness=[[1.0]], constant_force=(-0.3,),
        forces=(vi.Harmonic(2.1, (2.0,)),),
        elements=(vi.RigidStop((1.0,), lower=-0.1, upper=np.inf, restitution=0.6),),
    )  # fmt: skip


STEADY = {
    "damper": (DAMPER.mechanism, vi.State((0.3, 0.1), (0.2, -1.5), 0.4)),
    "before a wall": (walled(), vi.State((0.3, 0.1), (0.2, -1.5), 0.4)),
    "two stops": (two_stops(), vi.State((0.5, 0.4), (0.1, 0.2))),
    "a push": (pushed_ball(), vi.State((0.5,), (0.1,))),
}


@pytest.mark.parametrize("name", STEADY)
def test_repeated_flights_are_those_that_would_have_been_found(name: str) -> None:
    mechanism, start = STEADY[name]
    run = vi.simulate(mechanism, start, impacts=700)
    assert np.all(run.status[-12:] == vi.Status.IMPACT)
    for i in range(len(run) - 12, len(run) - 1):
        alone = vi.simulate(mechanism, state_after(run, i), impacts=1)
        assert alone.contact[0] == run.contact[i + 1]
        # a state is rounded when it is recorded, and when it becomes a start
        assert alone.time[0] == pytest.approx(run.time[i + 1] - run.time[i], abs=1e-12)
        assert alone.position[0] == pytest.approx(run.position[i + 1], abs=1e-13)
        assert alone.velocity_before[0] == pytest.approx(run.velocity_before[i + 1], abs=1e-13)


@pytest.mark.parametrize("name", STEADY)
def test_lanes_repeat_the_flights_that_the_scalar_engine_repeats(name: str) -> None:
    mechanism, start = STEADY[name]
    starts = [replace(start, phase=phase) for phase in np.linspace(0.0, 5.0, 37)]
    end = 1000.0
    found = run_members(batch_of(mechanism, {}), starts, 0.0, end, [Final()])
    for i, state in enumerate(starts):
        alone_like(found, i, mechanism, state, end)


def test_runs_of_any_length_end_as_alone_though_lanes_wait_for_those_that_repeat() -> None:
    """Some start on the orbit, some between stops that they never reach."""
    run = vi.simulate(DAMPER, STEADY["damper"][1], impacts=700)
    lively, idle = state_after(run, -1), vi.State((0.0, 0.0), (0.0, 0.0))
    count = 150
    lengths = np.where(np.arange(count) % 7 == 0, 2000.0, np.geomspace(20.0, 600.0, count))
    system = (np.arange(count) % 5 == 0).astype(np.int32)  # of another clearance
    batch = batch_of(DAMPER, {"half_clearance": np.array([DAMPER.half_clearance, 5000.0])})
    starts = [idle if far else lively for far in system]
    found = run_members(batch, starts, 0.0, lengths, [Final()], system=system)
    for i, state in enumerate(starts):
        damper = replace(DAMPER, half_clearance=5000.0) if system[i] else DAMPER
        alone = alone_like(found, i, damper, state, lengths[i])
        assert alone.time[-1] == found["time"][i]


def test_members_say_the_same_beside_others_that_repeat_their_flights_or_do_not_yet() -> None:
    steady = STEADY["damper"][1]
    rng = np.random.default_rng(4)
    starts = [
        steady
        if i % 3 == 0
        else vi.State((0.0, rng.uniform(-4.0, 4.0)), tuple(rng.uniform(-2.0, 2.0, 2)), phase=i)
        for i in range(150)
    ]
    settle, observe = 900.0, rng.uniform(50.0, 400.0, len(starts))
    observers = [Final(), Symbol(), Lyapunov()]
    batch = batch_of(DAMPER, {})
    found = run_members(batch, starts, settle, observe, observers)
    for i, state in enumerate(starts):
        alone = run_members(batch, [state], settle, observe[i], observers)
        for name, values in found.items():
            np.testing.assert_array_equal(values[i], alone[name][0], err_msg=f"{name} of {i}")


def loaded(brake: float, pull: float, row: float) -> vi.Mechanism:
    """The impact damper; its free mass braked or pulled, and seen by its contact or not."""
    free = DAMPER.mechanism
    return vi.Mechanism(
        mass=free.mass,
        damping=[[free.damping[0][0], 0.0], [0.0, brake]],
        stiffness=free.stiffness,
        forces=free.forces,
        constant_force=(0.0, pull),
        elements=(
            vi.RigidStop((-1.0, row), -5.0 if row else -1.0, 5.0 if row else np.inf, 0.8),
        ),
    )  # fmt: skip


@pytest.mark.parametrize("row", [1.0, 0.0])
def test_a_free_mass_repeats_its_flights_beside_masses_that_are_loaded_later(row: float) -> None:
    """Lanes that hold free masses alone leave out what loaded ones need, and recall it later."""
    values = {"brake": np.array([0.0, 0.01, 0.0]), "pull": np.array([0.0, 0.0, 0.02])}
    system = np.array([0] * 48 + [1, 2] * 24, dtype=np.int32)
    length = np.where(np.arange(96) % 3 == 0, 1500.0, np.linspace(1000.0, 1200.0, 96))
    starts = [vi.State((0.3, 0.1), (0.2, -1.5), phase) for phase in np.linspace(0.0, 6.0, 96)]
    batch = batch_of(vi.Family(loaded, brake=0.0, pull=0.0, row=row), values)
    found = run_members(batch, starts, 0.0, length, [Final()], system=system)
    for i, (k, state) in enumerate(zip(system, starts, strict=True)):
        mechanism = loaded(values["brake"][k], values["pull"][k], row)
        alone_like(found, i, mechanism, state, length[i])
