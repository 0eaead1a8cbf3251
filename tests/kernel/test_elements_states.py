"""States that elements take where several are reached at once, or where nothing moves them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi

ULPS = 64 * 2.0**-53
Status = vi.Status
WAVE = vi.Harmonic(1.0, (0.2,))


def one(*elements: Any, stiffness: float = 1.0, push: float = 0.0) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[stiffness]], constant_force=(push,),
        elements=elements,
    )  # fmt: skip


def two(*elements: Any, coupling: float = 0.0, free: bool = False, **more: Any) -> vi.Mechanism:
    k = np.array([[1.0 + coupling, -coupling], [-coupling, 1.0 + coupling]]) * (not free)
    return vi.Mechanism(mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=k, elements=elements,
                        **more)  # fmt: skip


# A motion that is not disturbed: machine, start, and position after t of the first coordinate.
def swing(x: float, v: float = 0.0) -> Any:
    return lambda t: x * math.cos(t) + v * math.sin(t)


REST = swing(0.0)
LASTING: dict[str, tuple[vi.Mechanism, vi.State, Any]] = {
    "rest between two springs without a gap": (
        one(vi.SoftStop((1.0,), lower=0.0, upper=0.0, stiffness=3.0)), vi.State((0.0,), (0.0,)),
        REST),
    "rest between two dashpots without a gap": (
        one(vi.SoftStop((1.0,), lower=0.0, upper=0.0, stiffness=3.0, damping=0.2)),
        vi.State((0.0,), (0.0,)), REST),
    "rest at a soft stop": (
        one(vi.SoftStop((1.0,), upper=0.0, stiffness=3.0, damping=0.2)),
        vi.State((0.0,), (0.0,)), REST),
    "rest on a preloaded stop": (
        one(vi.SoftStop((1.0,), upper=-0.5, damping=0.2), push=0.5),
        vi.State((0.0,), (0.0,)), REST),
    "friction with nothing to hold": (
        one(vi.Friction((1.0,), kinetic=0.0)), vi.State((0.0,), (0.0,)), REST),
    "friction that carries its static level": (
        one(vi.Friction((1.0,), kinetic=0.125, static=0.25)), vi.State((0.25,), (0.0,)),
        lambda _: 0.25),
    "equal oscillators with friction between": (
        two(vi.Friction((1.0, -1.0), kinetic=0.1, static=0.15)),
        vi.State((1.0, 1.0), (0.3, 0.3)), swing(1.0, 0.3)),
    "equal oscillators with friction of no force between": (
        two(vi.Friction((1.0, -1.0), kinetic=0.0)),
        vi.State((1.0, 1.0), (0.3, 0.3)), swing(1.0, 0.3)),
    "equal oscillators with a soft stop between": (
        two(vi.SoftStop((1.0, -1.0), upper=0.0, stiffness=3.0, damping=0.2)),
        vi.State((1.0, 1.0), (0.3, 0.3)), swing(1.0, 0.3)),
    "equal oscillators with soft stops both ways between": (
        two(vi.SoftStop((1.0, -1.0), lower=0.0, upper=0.0, stiffness=3.0, damping=0.2)),
        vi.State((1.0, 1.0), (0.3, 0.3)), swing(1.0, 0.3)),
    "a belt that moves like the free mass": (
        one(vi.Friction((1.0,), kinetic=0.3, motion=vi.Harmonic(1.0, (0.2,)))),
        vi.State((0.0,), (0.2,)), swing(0.0, 0.2)),
    "a soft stop that moves like the free mass": (
        one(vi.SoftStop((1.0,), upper=0.0, stiffness=5.0, damping=0.5, motion=WAVE)),
        vi.State((0.0,), (0.2,)), swing(0.0, 0.2)),
    "a rigid stop that moves like the free mass": (
        one(vi.RigidStop((1.0,), upper=0.0, restitution=0.5, motion=WAVE)),
        vi.State((0.0,), (0.2,)), swing(0.0, 0.2)),
}  # fmt: skip


@pytest.mark.parametrize("what", LASTING)
def test_a_margin_that_stays_zero_is_no_chain_of_events(what: str) -> None:
    m, start, position = LASTING[what]
    run = vi.simulate(m, start, t_max=20.0)
    assert run.end is vi.RunEnd.HORIZON
    assert set(run.status) <= {Status.STICK, Status.HORIZON}
    # some 2000 steps, each with the rounding of the largest coordinate
    np.testing.assert_allclose(run.position[-1, 0], position(20.0), atol=2000 * 2.0**-53)


@pytest.mark.parametrize("place", [0.15, -0.15])
def test_friction_holds_a_mass_that_starts_at_rest_within_its_static_level(place: float) -> None:
    m = one(vi.Friction((1.0,), kinetic=0.1, static=0.2))
    run = vi.simulate(m, vi.State((place,), (0.0,)), t_max=5.0)
    assert list(run.status) == [Status.HORIZON]
    assert run.position[-1, 0] == place


def test_friction_holds_a_mass_that_stops_where_its_spring_is_free() -> None:
    # from 1 it turns at -0.8, 0.6, -0.4, 0.2 and 0: there all that is left of y is rounding
    run = vi.simulate(one(vi.Friction((1.0,), kinetic=0.1)), vi.State((1.0,), (0.0,)), t_max=40.0)
    np.testing.assert_allclose(run.time[:-1], math.pi * np.arange(1, 6), rtol=ULPS)
    assert run.end is vi.RunEnd.HORIZON
    assert abs(run.position[-1, 0]) < ULPS


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_equal_masses_that_stick_at_once_do_as_one_does(side: float) -> None:
    friction = [vi.Friction(row, kinetic=0.1, static=0.15) for row in ((1.0, 0.0), (0.0, 1.0))]
    run = vi.simulate(two(*friction, coupling=0.7), vi.State((1.0, side), (0.0, 0.0)), t_max=60.0)
    rate = 1.0 if side > 0.0 else math.sqrt(1.0 + 2.0 * 0.7)
    turn, place = math.pi / rate, 1.0
    level = 0.1 / rate**2
    while place > 0.15 / rate**2 * (1.0 + ULPS):
        place -= 2.0 * level
    turns = round((1.0 - place) / (2.0 * level))
    times = np.unique(np.round(run.time[:-1] / turn, 9))
    np.testing.assert_array_equal(times, np.arange(1, turns + 1))
    np.testing.assert_allclose(abs(run.position[-1]), abs(place), atol=16 * ULPS)
    assert run.end is vi.RunEnd.HORIZON


def test_equal_masses_meet_equal_soft_stops_at_once() -> None:
    stops = [vi.SoftStop(row, upper=0.3, stiffness=5.0, damping=0.5)
             for row in ((1.0, 0.0), (0.0, 1.0))]  # fmt: skip
    both = vi.simulate(two(*stops, coupling=0.7), vi.State((0.0, 0.0), (1.0, 1.0)), t_max=20.0)
    alone = vi.simulate(
        one(vi.SoftStop((1.0,), upper=0.3, stiffness=5.0, damping=0.5)),
        vi.State((0.0,), (1.0,)), t_max=20.0,
    )  # fmt: skip
    np.testing.assert_allclose(both.time, alone.time, rtol=16 * ULPS)
    np.testing.assert_allclose(both.position[:, 1], alone.position[:, 0], atol=16 * ULPS)


def test_one_friction_that_sticks_may_break_another_away_at_once() -> None:
    # Block 2 on block 1 on the ground. Block 1 sticks already; when block 2 catches up, friction
    # between them would have to carry 0.3 > 0.25, so that it slips the other way at once.
    m = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.zeros((2, 2)),
        constant_force=(0.0, -0.3),
        elements=(vi.Friction((1.0, 0.0), kinetic=0.5),
                  vi.Friction((-1.0, 1.0), kinetic=0.25)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 0.55)), t_max=3.0)
    np.testing.assert_allclose(run.time[0], 0.55 / 0.55, rtol=ULPS)
    assert [Status(s) for s in run.status] == [Status.CHANGE, Status.HORIZON]
    np.testing.assert_allclose(run.position[-1], [0.0, 0.275 - 0.05 * 2.0**2 / 2.0], atol=ULPS)


def test_sticking_of_one_mass_lets_another_slip() -> None:
    # Both slide as one, 2 on top of 1; the ground stops 1, and 2 slips on, as 0.05 < 1 needed.
    m = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.zeros((2, 2)),
        constant_force=(0.0, 0.3),
        elements=(vi.Friction((1.0, 0.0), kinetic=0.9, static=2.0),
                  vi.Friction((-1.0, 1.0), kinetic=0.05, static=1.0)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.6, 0.6)), t_max=6.0)
    # together: acceleration (0.3 - 0.9) / 2 = -0.3, the upper friction carries 0.6 < 1; at rest
    # after 2 it carries 0.3 and holds
    np.testing.assert_allclose(run.time[0], 2.0, rtol=ULPS)
    np.testing.assert_allclose(run.position[-1], [0.6, 0.6], atol=ULPS)


def test_a_soft_stop_does_not_press_from_the_other_side_of_its_gap() -> None:
    # k (u - lower) + c u' asks for pressure at the lower stop while u is still at the upper one
    m = one(vi.SoftStop((1.0,), lower=-0.5, upper=0.5, stiffness=1.0, damping=(8.0, 0.5)))
    run = vi.simulate(m, vi.State((0.0,), (4.0,)), impacts=2)
    assert [Status(s) for s in run.status] == [
        Status.ENGAGE, Status.CHANGE, Status.CHANGE, Status.ENGAGE
    ]  # fmt: skip
    np.testing.assert_allclose(run.position[[0, 2, 3], 0], [0.5, 0.5, -0.5], rtol=ULPS)
    assert list(run.side[[0, 3]]) == [1, -1]


def test_friction_between_two_belts_sticks_to_each_in_turn() -> None:
    belts = [vi.Friction((1.0,), kinetic=level, belt_speed=speed)
             for level, speed in ((0.1, 0.5), (0.2, -0.5))]  # fmt: skip
    run = vi.simulate(one(*belts, stiffness=0.0), vi.State((0.0,), (2.0,)), t_max=20.0)
    # 2 - 0.3 t = 0.5, then 0.5 - 0.1 (t - 5) = -0.5; the second holds with 0.1
    np.testing.assert_allclose(run.time, [5.0, 15.0, 20.0], rtol=ULPS)
    np.testing.assert_allclose(run.velocity_after[:, 0], [0.5, -0.5, -0.5], rtol=ULPS)


def test_friction_twice_on_one_coordinate_is_friction_of_both() -> None:
    pair = one(vi.Friction((1.0,), kinetic=0.1), vi.Friction((1.0,), kinetic=0.05))
    single = one(vi.Friction((1.0,), kinetic=0.1 + 0.05))
    runs = [vi.simulate(m, vi.State((1.05,), (0.0,)), t_max=40.0) for m in (pair, single)]
    np.testing.assert_allclose(runs[0].time, runs[1].time, rtol=ULPS)
    np.testing.assert_allclose(runs[0].position, runs[1].position, atol=ULPS)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_block_with_friction_rests_on_a_stop(restitution: float) -> None:
    m = one(vi.Friction((1.0,), kinetic=0.1), vi.RigidStop((1.0,), upper=0.5,
            restitution=restitution), push=1.0)  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (1.0,)), t_max=20.0)
    assert run.end is vi.RunEnd.HORIZON
    assert run.status[-2] == Status.STICK
    np.testing.assert_allclose(run.position[-1], 0.5, rtol=4 * ULPS)  # of a sum of bounces


@pytest.mark.parametrize("restitution", [0.0, 1e-12, 0.3])
def test_a_ball_at_rest_on_a_table_moves_with_it(restitution: float) -> None:
    a, w = 0.1, 2.0  # a w^2 < g: it never leaves
    table = vi.RigidStop((1.0,), lower=0.0, restitution=restitution, motion=vi.Harmonic(w, (a,)))
    run = vi.simulate(one(table, stiffness=0.0, push=-1.0), vi.State((0.6,), (0.0,), 0.3),
                      t_max=40.0)  # fmt: skip
    assert run.end is vi.RunEnd.HORIZON
    assert Status.RELEASE not in run.status
    t = np.linspace(run.time[-2], 40.0, 1000)
    x, v = (part[:, 0] for part in run.at(t))
    # phases are good to the rounding of w t, and to that of some 1000 steps
    np.testing.assert_allclose(x, a * np.sin(0.3 + w * t), atol=1000 * 2.0**-53)
    np.testing.assert_allclose(v, a * w * np.cos(0.3 + w * t), atol=1000 * 2.0**-53)


def test_a_ball_leaves_a_table_that_falls_faster() -> None:
    a, w = 0.5, 2.0
    table = vi.RigidStop((1.0,), lower=0.0, restitution=0.0, motion=vi.Harmonic(w, (a,)))
    run = vi.simulate(one(table, stiffness=0.0, push=-1.0), vi.State((0.6,), (0.0,), 0.3),
                      t_max=40.0)  # fmt: skip
    released = run.status == Status.RELEASE
    assert released.sum() >= 3
    # the table's acceleration -a w^2 sin is -g there
    np.testing.assert_allclose(np.sin(0.3 + w * run.time[released]), 1.0 / (a * w * w), rtol=1e-13)


@pytest.mark.parametrize(
    ("speed", "engaged"), [(-5.0, False), (5.0, True)], ids=["leaves", "is pressed"]
)
def test_a_start_behind_a_soft_stop_is_held_where_its_force_presses(
    speed: float, engaged: bool
) -> None:
    m = one(vi.SoftStop((1.0,), upper=0.0, stiffness=3.0, damping=2.0))
    run = vi.simulate(m, vi.State((0.1,), (speed,)), t_max=5.0)
    first = run.position[0, 0], run.velocity_after[0, 0]
    if engaged:  # the first event is that its force is zero
        assert abs(3.0 * first[0] + 2.0 * first[1]) < 16 * ULPS
    else:  # it flies on, without a force, to x = 0
        np.testing.assert_allclose(first, (0.0, -math.hypot(0.1, 5.0)), rtol=ULPS, atol=ULPS)


def test_a_long_flight_keeps_its_time_where_the_next_mode_has_to_be_built() -> None:
    # Steps are of some 0.7 / sqrt(k): 8192 are behind when the stop is met, and its mode is new.
    m = one(vi.SoftStop((1.0,), upper=0.8, stiffness=1e8 + 3.0))
    run = vi.simulate(m, vi.State((0.0,), (1.0,)), impacts=1)
    np.testing.assert_allclose(run.time[0], math.asin(0.8), rtol=1e-12)  # 1e4 steps of rounding


def test_a_ball_on_a_sinking_table_is_caught_by_the_floor() -> None:
    a, w, floor = 0.5, 0.5, -0.2  # a w^2 < g: it rests on the table but for the floor
    stops = (vi.RigidStop((1.0,), lower=0.0, restitution=0.0, motion=vi.Harmonic(w, (a,))),
             vi.RigidStop((1.0,), lower=floor, restitution=0.0))  # fmt: skip
    run = vi.simulate(one(*stops, stiffness=0.0, push=-1.0), vi.State((0.0,), (a * w,)), t_max=60.0)
    t = np.linspace(0.0, 60.0, 2000)
    np.testing.assert_allclose(
        run.at(t)[0][:, 0], np.maximum(a * np.sin(w * t), floor), atol=1000 * 2.0**-53
    )


def test_a_mass_at_rest_that_is_pushed_in_the_fourth_derivative_leaves() -> None:
    # Mass 1 accelerates, the spring between makes the acceleration of mass 2 grow as t^2: x2 as t^4
    stops = (vi.SoftStop((0.0, 1.0), lower=0.0, upper=0.0, stiffness=1.0),
             vi.SoftStop((1.0, -1.0), lower=0.0, upper=0.0, stiffness=4.0))  # fmt: skip
    m = two(*stops, constant_force=(-0.5, 0.0))
    linear = np.array([[1.0 + 4.0, -4.0], [-4.0, 1.0 + 1.0 + 4.0]])  # both stops pressed for long
    rates, shapes = np.linalg.eigh(linear)
    rest = np.linalg.solve(linear, [-0.5, 0.0])
    t = 0.7
    expected = rest - shapes @ (np.cos(np.sqrt(rates) * t) * (shapes.T @ rest))
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=t)
    assert list(run.status) == [Status.HORIZON]
    np.testing.assert_allclose(run.position[-1], expected, rtol=1e-13)


def test_one_of_three_frictions_on_two_masses_sticks_as_it_can() -> None:
    # At once the slip between both masses passes zero, where friction of the first with its belt
    # cannot hold as before: sticking of all three is no state, as two determine the third.
    m = vi.Mechanism(
        mass=np.eye(2), damping=0.25 * np.eye(2), stiffness=np.eye(2), constant_force=(0.0, -0.5),
        elements=(
            vi.Friction((1.0, 0.0), kinetic=0.5, static=1.0, belt_speed=0.25),
            vi.Friction((0.0, 1.0), kinetic=0.5, static=1.0),
            vi.Friction((1.0, -1.0), kinetic=0.5, static=1.0, belt_speed=0.25,
                        motion=vi.Harmonic(1.0, (0.5,))),
        ),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=20.0)
    assert run.end is vi.RunEnd.HORIZON
    i = int(np.argmin(abs(run.time - 2.5 * math.pi)))  # cos = 0 while both stick
    assert abs(run.time[i] - 2.5 * math.pi) < 1e-12
    after = run.at(run.time[i] + 1e-3)[1]
    # the first slips back with the belt of the third: a = -0.5 sin t
    np.testing.assert_allclose(after, [0.25 - 0.5e-3, 0.0], atol=1e-8)


def test_contacts_close_as_friction_that_sticks_joins_the_masses() -> None:
    # Friction joins 1 and 2. Mass 3 presses on 2 so that 1 leaves the stop to which 1 and 2
    # alone are pushed: all three move with (0.1 + 0.1 - 1.2) / 3.
    m = vi.Mechanism(
        mass=np.eye(3), damping=np.zeros((3, 3)), stiffness=np.zeros((3, 3)),
        constant_force=(0.1, 0.1, -1.2),
        elements=(vi.RigidStop((1.0, 0.0, 0.0), upper=0.0, restitution=0.0),
                  vi.RigidStop((0.0, 1.0, -1.0), upper=0.0, restitution=0.0),
                  vi.Friction((1.0, -1.0, 0.0), kinetic=0.5)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), t_max=2.0)
    assert run.end is vi.RunEnd.HORIZON
    assert [(Status(s), c) for s, c in zip(run.status[:-1], run.contact, strict=False)] == [
        (Status.STICK, 1)
    ]  # fmt: skip
    np.testing.assert_allclose(run.position[-1], -(2.0**2) / 6.0, rtol=ULPS)


@pytest.mark.parametrize("static", [0.25, 0.4])
@pytest.mark.parametrize("row", [1.0, -1.7])
def test_a_block_that_rests_on_a_stop_leaves_where_friction_cannot_hold_it(
    static: float, row: float
) -> None:
    # Under cos(t) it comes to rest on the stop at once; on its way down the force passes the level
    # where the stop carries nothing, and then friction holds alone.
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        forces=(vi.Harmonic(1.0, (0.0,), (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=0.0, restitution=0.0),
                  vi.Friction((row,), kinetic=0.25 / abs(row), static=static / abs(row))),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), t_max=3.0)
    leaves = math.acos(-static)
    t = np.linspace(leaves, 3.0, 20)
    # x'' = cos(t) + 1/4 from rest
    expected = (math.cos(leaves) - np.cos(t) - math.sin(leaves) * (t - leaves)
                + (t - leaves) ** 2 / 8.0)  # fmt: skip
    np.testing.assert_allclose(run.at(t)[0][:, 0], expected, atol=16 * ULPS)
    np.testing.assert_allclose(run.at(np.linspace(0.0, leaves, 20))[0], 0.0, atol=ULPS)
    assert abs(run.time[-2] - leaves) < 16 * ULPS


def test_friction_on_the_coordinate_of_a_stop_never_stalls() -> None:
    for seed in range(40):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 4))
        a, b, row = rng.normal(size=(n, n)), rng.normal(size=(n, n)), rng.normal(size=n)
        mass, stiffness = a @ a.T + n * np.eye(n), b @ b.T + 0.3 * np.eye(n)
        motion = vi.Harmonic(1.1, (0.05,)) if seed % 2 else ()
        m = vi.Mechanism(
            mass=mass, damping=0.05 * stiffness, stiffness=stiffness,
            forces=(vi.Harmonic(0.8, tuple(2.0 * rng.normal(size=n))),),
            constant_force=tuple(0.5 * stiffness @ row / (row @ row) + 0.3 * mass @ row),
            elements=(
                vi.RigidStop(tuple(row), upper=0.1, restitution=0.5 * (seed % 3 == 0),
                             motion=motion),
                vi.Friction(tuple(1.7 * row), kinetic=0.1, static=0.15),
            ),
        )  # fmt: skip
        start = vi.State((0.0,) * n, tuple(0.3 * rng.normal(size=n)), 0.2)
        run = vi.simulate(m, start, impacts=2000, t_max=30.0)
        assert run.end is vi.RunEnd.HORIZON, f"seed {seed}: {run!r}"
        gap = 0.1 - run.position @ row
        if not motion:
            assert gap.min() > -1e-12  # 1500 steps of 4 u


def test_a_stop_lets_go_of_a_mass_that_friction_with_another_holds() -> None:
    # Mass 2 is pressed to its stop; friction joins mass 1 to it, so that the stop below mass 1 has
    # nothing to hold any more once -cos(t) / 2 > 0: a force at one stop could be one at the other.
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 2.0]], damping=np.zeros((2, 2)), stiffness=np.zeros((2, 2)),
        constant_force=(0.0, 0.5), forces=(vi.Harmonic(1.0, (0.0, 0.0), (-0.5, 0.0)),),
        elements=(vi.RigidStop((1.0, 0.0), lower=-0.75, restitution=0.0),
                  vi.RigidStop((0.0, 1.0), upper=0.5, restitution=0.0),
                  vi.Friction((1.0, -1.0), kinetic=0.125, static=0.25)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((-0.75, 0.5), (0.0, 0.0)), t_max=3.0)
    assert run.end is vi.RunEnd.HORIZON
    leaves = math.acos(-0.5)
    t = np.linspace(leaves, 3.0, 20)
    moved = (0.5 * (np.cos(t) - math.cos(leaves)) + 0.5 * math.sin(leaves) * (t - leaves)
             - 0.125 * (t - leaves) ** 2 / 2.0)  # fmt: skip
    np.testing.assert_allclose(run.at(t)[0][:, 0], -0.75 + moved, atol=16 * ULPS)
    np.testing.assert_allclose(run.at(np.linspace(0.0, leaves, 9))[0][:, 0], -0.75, atol=ULPS)
    np.testing.assert_allclose(run.at(t)[0][:, 1], 0.5, atol=ULPS)


@pytest.mark.parametrize("power", [-30, 20])
def test_another_unit_of_length_changes_no_bit_of_a_motion(power: int) -> None:
    """Steps, too, do not shrink with it: lengths, forces and levels are multiplied by a power of two."""

    def run(unit: float) -> vi.Run:
        m = vi.Mechanism(
            mass=[[1.0, 0.0], [0.0, 0.7]], damping=[[0.1, -0.05], [-0.05, 0.08]],
            stiffness=[[2.0, -1.0], [-1.0, 1.5]], forces=(vi.Harmonic(0.9, (unit, 0.0)),),
            elements=(
                vi.SoftStop((1.0, -1.0), -0.3 * unit, 0.4 * unit, stiffness=25.0, damping=0.3),
                vi.Friction((0.0, 1.0), 0.1 * unit),
            ),
        )  # fmt: skip
        return vi.simulate(m, vi.State((0.1 * unit, 0.0), (0.3 * unit, 0.2 * unit)), t_max=60.0)

    plain, scaled = run(1.0), run(2.0**power)
    assert len(plain) > 40
    assert scaled.time.tobytes() == plain.time.tobytes()
    assert (scaled.position * 2.0**-power).tobytes() == plain.position.tobytes()


@pytest.mark.parametrize("shares", [(0.5, 0.5), (0.25, 0.5, 0.25)])
@pytest.mark.parametrize("shock", ["impact", "kick"])
def test_joints_on_one_row_move_as_one_with_the_sum_of_their_levels(
    shares: tuple[float, ...], shock: str
) -> None:
    """Also where a shock makes all of them slip back at once, though one holds and the others cannot."""
    what = (
        vi.RigidStop((1.0,), upper=0.5, restitution=1.0)
        if shock == "impact"
        else vi.PhaseSwitch(1.0, (1.0, 4.0), ((0.0,), (0.0,)), ((-2.0,), (0.0,)))
    )

    def run(levels: tuple[float, ...]) -> vi.Run:
        pads = tuple(vi.Friction((1.0,), kinetic=x, belt_speed=0.5) for x in levels)
        m = vi.Mechanism(
            mass=[[1.0]], damping=[[0.0]], stiffness=[[2.0]], elements=(what, *pads)
        )  # fmt: skip
        return vi.simulate(m, vi.State((0.0,), (0.0,)), t_max=8.0)

    one, several = run((2.0,)), run(tuple(2.0 * x for x in shares))
    assert one.end is several.end is vi.RunEnd.HORIZON
    times = np.linspace(0.0, 8.0, 81)
    for a, b in zip(one.at(times), several.at(times), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-13)


@pytest.mark.parametrize("law", ["linear", "unilateral", "limited"])
@pytest.mark.parametrize("limits", [{"upper": 0.5}, {"lower": -0.5}, {"lower": -0.5, "upper": 0.5}])
def test_a_soft_stop_is_named_by_the_side_on_which_the_mass_is(
    law: Any, limits: dict[str, float]
) -> None:
    """Where it is met, lets go by its force or by its gap, and where it recovers."""
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.8, (1.0,)),),
        elements=(vi.SoftStop((1.0,), stiffness=20.0, damping=2.0, law=law, **limits),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.1,), (0.3,)), t_max=30.0)
    events = run.status != vi.Status.HORIZON
    assert np.count_nonzero(run.status == vi.Status.CHANGE) > 3
    np.testing.assert_array_equal(run.side[events], np.sign(run.position[events, 0]))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_friction_that_comes_to_rest_as_a_contact_opens_sticks_where_it_can(side: float) -> None:
    # Mass 1 is on its stop, pushed by 0.1; mass 2 slides on it, pulled by 1.2 away from the stop. On the
    # stop friction cannot hold 2, 1.2 > 1, and kinetic friction lifts 1 off it, 0.5 > 0.1. Off the
    # stop it holds both with (1.2 + 0.1) / 2 < 1.
    m = two(
        vi.RigidStop((side, 0.0), lower=0.0, restitution=0.0),
        vi.Friction((-1.0, 1.0), kinetic=0.5, static=1.0), constant_force=(-0.1 * side, 1.2 * side),
        free=True,
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, -1.7 * side)), t_max=3.0)
    changes = run.time[run.status == Status.CHANGE]
    np.testing.assert_allclose(changes, [1.7 / 1.7], rtol=ULPS)
    way = 0.5 * (1.2 - 0.1) / 2.0 * 2.0**2
    np.testing.assert_allclose(run.position[-1] * side, [way, way - 0.85], atol=16 * ULPS)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_friction_that_an_impact_brings_to_rest_sticks_where_it_can(side: float) -> None:
    # Mass 1 meets its stop, plastic, as mass 2 turns: 0.75 - 0.5 has taken it from -0.5 to 0 by t = 2.
    # Kinetic friction would let 2 slip on; static friction holds it beside 1, which 1 - 0.75 presses.
    m = two(
        vi.RigidStop((side, 0.0), lower=0.0, restitution=0.0),
        vi.Friction((-1.0, 1.0), kinetic=0.5, static=1.0), constant_force=(-side, 0.75 * side),
        free=True,
    )  # fmt: skip
    run = vi.simulate(m, vi.State((3.0 * side, 0.0), (-side, -0.5 * side)), t_max=4.0)
    np.testing.assert_allclose(run.time[0], 2.0, rtol=ULPS)
    np.testing.assert_allclose(run.position[-1] * side, [0.0, -0.5], atol=16 * ULPS)


def test_friction_on_a_belt_does_not_carry_a_block_behind_its_stop() -> None:
    # A force of 1 presses the block to its stop. At pi / 2 the speed of the belt, -0.3 cos(t), passes that
    # of the block, 0; friction that held it there would take it behind the stop.
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(1.0,),
        elements=(vi.RigidStop((1.0,), upper=0.0, restitution=0.0),
                  vi.Friction((1.0,), kinetic=0.25, static=2.0,
                              motion=vi.Harmonic(1.0, (-0.3,)))),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), t_max=3.0)
    assert run.end is vi.RunEnd.HORIZON
    np.testing.assert_allclose(run.time[-2], math.pi / 2.0, rtol=ULPS)
    np.testing.assert_allclose(run.position[-1], 0.0, atol=ULPS)
