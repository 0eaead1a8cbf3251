"""Soft stops, friction, moving stops: motions with a closed form."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi

ULPS = 64 * 2.0**-53  # of times and places after a few events


def oscillator(*elements: Any, damping: float = 0.0, **more: Any) -> vi.Mechanism:
    one: dict[str, Any] = {"mass": [[1.0]], "damping": [[damping]], "stiffness": [[1.0]]}
    return vi.Mechanism(**(one | more), elements=elements)


@pytest.mark.parametrize("law", ["linear", "unilateral", "limited"])
def test_a_bilinear_oscillator_has_the_period_of_both_halves(law: Any) -> None:
    m = oscillator(vi.SoftStop((1.0,), upper=0.0, stiffness=8.0, law=law))
    run = vi.simulate(m, vi.State((0.0,), (1.0,)), impacts=20)
    engaged = run.time[run.status == vi.Status.ENGAGE]
    np.testing.assert_allclose(np.diff(engaged), math.pi + math.pi / 3, rtol=ULPS)
    assert set(run.status) == {vi.Status.ENGAGE, vi.Status.CHANGE}


def test_a_bilinear_spring_in_one_element_changes_sides_at_zero() -> None:
    m = oscillator(vi.SoftStop((1.0,), lower=0.0, upper=0.0, stiffness=(3.0, 8.0)))
    run = vi.simulate(m, vi.State((0.0,), (1.0,)), t_max=20.0)
    assert (run.status[:-1] == vi.Status.ENGAGE).all()
    np.testing.assert_allclose(run.time[1:-1:2] - run.time[:-2:2], math.pi / 2, rtol=ULPS)
    np.testing.assert_allclose(run.time[0], math.pi / 3, rtol=ULPS)


def test_friction_takes_two_levels_from_the_amplitude_in_every_half_period() -> None:
    m = oscillator(vi.Friction((1.0,), kinetic=0.1, static=0.15))
    run = vi.simulate(m, vi.State((1.05,), (0.0,)), t_max=40.0)
    turns = run.time[:-1]
    np.testing.assert_allclose(turns, math.pi * np.arange(1, 6), rtol=ULPS)
    np.testing.assert_allclose(
        np.abs(run.position[:5, 0]), [0.85, 0.65, 0.45, 0.25, 0.05], atol=ULPS
    )
    assert run.end is vi.RunEnd.HORIZON  # |x| = 0.05 < static: it sticks


def test_a_block_on_a_belt_leaves_at_the_static_force() -> None:
    speed, damping = 0.05, 0.2
    m = oscillator(vi.Friction((1.0,), kinetic=0.1, static=0.15, belt_speed=speed), damping=damping)
    run = vi.simulate(m, vi.State((0.0,), (speed,)), t_max=40.0)
    leaving = run.position[: len(run) - 1 : 2, 0]
    np.testing.assert_allclose(leaving, 0.15 - damping * speed, rtol=ULPS)


def test_a_run_without_impacts_goes_on_to_its_time() -> None:
    """A record has room for 4 events an impact; where the time is given it is as long as it takes."""
    m = oscillator(vi.Friction((1.0,), kinetic=0.1, static=0.2, belt_speed=0.05), damping=0.02)
    run = vi.simulate(m, vi.State((0.0,), (0.05,)), impacts=1, t_max=2000.0)
    assert run.end is vi.RunEnd.HORIZON
    assert run.time[-1] == 2000.0
    assert len(run) > 4 + 64


@pytest.mark.parametrize("side", [1, -1])
def test_a_soft_stop_with_a_dashpot_returns_the_speed_of_the_closed_form(side: int) -> None:
    k, c, v = 100.0, 4.0, 1.0
    stop = {"upper" if side > 0 else "lower": 0.0}
    m = oscillator(
        vi.SoftStop((1.0,), stiffness=k, damping=c, law="linear", **stop), stiffness=[[0.0]]
    )
    run = vi.simulate(m, vi.State((-side * 1.0,), (side * v,)), t_max=2.0)
    damped = math.sqrt(k - c * c / 4.0)
    np.testing.assert_allclose(run.time[:2], [1.0, 1.0 + math.pi / damped], rtol=ULPS)
    restitution = math.exp(-c / 2.0 * math.pi / damped)
    np.testing.assert_allclose(run.velocity_after[1, 0], -side * v * restitution, rtol=ULPS)


def test_without_adhesion_the_stop_lets_go_where_its_force_is_zero() -> None:
    k, c = 100.0, 4.0
    m = oscillator(vi.SoftStop((1.0,), upper=0.0, stiffness=k, damping=c), stiffness=[[0.0]])
    run = vi.simulate(m, vi.State((-1.0,), (1.0,)), t_max=2.0)
    x, v = run.position[1, 0], run.velocity_after[1, 0]
    assert x > 0.0 > v
    assert abs(k * x + c * v) < ULPS * k * x
    np.testing.assert_allclose(run.time[2], run.time[1] - x / v, rtol=ULPS)  # then it is free


def test_a_ball_meets_a_moving_table_at_its_relative_speed() -> None:
    a, w, g, e = 0.3, 2.0, 1.0, 0.7
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-g,),
        elements=(
            vi.RigidStop((1.0,), lower=0.0, restitution=e, motion=vi.Harmonic(w, (a,))),
        ),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((2.0,), (0.0,), 0.4), impacts=30)
    t = run.time
    table, speed = a * np.sin(0.4 + w * t), a * w * np.cos(0.4 + w * t)
    np.testing.assert_allclose(run.position[:, 0], table, atol=1e3 * ULPS)
    before, after = run.velocity_before[:, 0] - speed, run.velocity_after[:, 0] - speed
    np.testing.assert_allclose(after, -e * before, atol=1e3 * ULPS)


def chain(seed: int, size: int, contacts: int, omegas: list[float]) -> vi.Mechanism:
    rng = np.random.default_rng(seed)
    spring = 2.0 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1)
    return vi.Mechanism(
        mass=np.eye(size).tolist(), damping=(0.05 * spring).tolist(), stiffness=spring.tolist(),
        forces=tuple(vi.Harmonic(w, tuple(rng.normal(size=size))) for w in omegas),
        elements=tuple(
            vi.RigidStop(tuple(np.eye(size)[i]), upper=0.5 + 0.1 * rng.random(), restitution=0.6)
            for i in range(contacts)
        ),
    )  # fmt: skip


def test_a_machine_of_twenty_coordinates_moves_as_its_halves() -> None:
    """Sixteen contacts, twelve lines, in the general flow; its halves are in blocks."""
    lines = [0.7 + 0.13 * i for i in range(12)]
    halves = [chain(1, 10, 8, lines[:6]), chain(2, 10, 8, lines[6:])]
    none, n = np.zeros((10, 10)), np.zeros(10)

    def both(name: str) -> list[list[float]]:
        a, b = (np.array(getattr(m, name)) for m in halves)
        return np.block([[a, none], [none, b]]).tolist()

    whole = vi.Mechanism(
        mass=both("mass"), damping=both("damping"), stiffness=both("stiffness"),
        forces=tuple(
            vi.Harmonic(f.omega, tuple([*f.sine, *n] if i == 0 else [*n, *f.sine]))
            for i, m in enumerate(halves) for f in m.forces
        ),
        elements=tuple(
            vi.RigidStop(tuple([*c.row, *n] if i == 0 else [*n, *c.row]), upper=c.upper,
                       restitution=0.6)
            for i, m in enumerate(halves) for c in m.rigid_stops
        ),
    )  # fmt: skip
    zero = tuple([0.0] * 20)
    run = vi.simulate(whole, vi.State(zero, zero), t_max=12.0)
    apart = [vi.simulate(m, vi.State(zero[:10], zero[:10]), t_max=12.0) for m in halves]
    found = np.sort(np.concatenate([r.time[r.impacts] for r in apart]))
    assert len(found) > 12
    np.testing.assert_allclose(run.time[run.impacts], found, rtol=1e-9)  # before chaos forgets
