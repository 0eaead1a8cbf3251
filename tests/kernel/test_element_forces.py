"""States and forces of elements along a run, against the laws that define them."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact import FrictionState, RigidStopState, SoftStopState

ULPS = 64 * 2.0**-53  # of sums of a few products, relative to the largest


def oscillator(*elements: Any, **more: Any) -> vi.Mechanism:
    one: dict[str, Any] = {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]]}
    return vi.Mechanism(**(one | more), elements=elements)


def inside(run: vi.Run, points: int = 500) -> Any:
    """Times between the events, and the number of the flight of each."""
    t = np.linspace(0.0, run.time[-1], points)
    t = t[np.abs(t[:, None] - run.time).min(axis=1) > 1e-9]
    return t, np.searchsorted(run.time, t, side="right")


def states(run: vi.Run, element: int) -> Any:
    """State of an element before the first event and after each."""
    return run.all_states[:, element]


def test_a_soft_stop_pushes_with_its_spring_and_dashpot_while_it_is_pressed() -> None:
    k, c, upper = 29.0, 0.5, 0.4
    stop = vi.SoftStop((1.0,), upper=upper, stiffness=k, damping=c)
    m = oscillator(stop, forces=(vi.Harmonic(0.8, (1.0,)),))
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), t_max=60.0)
    t, flight = inside(run)
    (x, v), force = run.at(t), run.forces(t)[:, 0]
    pressed = states(run, 0)[flight] == SoftStopState.UPPER
    law = k * (x[:, 0] - upper) + c * v[:, 0]
    np.testing.assert_allclose(force[pressed], -law[pressed], atol=ULPS * abs(law).max())
    assert pressed.any()
    assert (force[~pressed] == 0.0).all()
    assert (force <= ULPS * abs(law).max()).all()  # no adhesion


@pytest.mark.parametrize("side", [1, -1])
def test_the_state_after_an_event_tells_where_the_mass_is(side: int) -> None:
    limits = {"upper" if side > 0 else "lower": side * 0.4}
    stop = vi.SoftStop((1.0,), stiffness=29.0, **limits)
    run = vi.simulate(oscillator(stop), vi.State((0.0,), (2.0,)), impacts=4)
    pressed = SoftStopState.UPPER if side > 0 else SoftStopState.LOWER
    wanted = np.where(run.status == vi.Status.ENGAGE, pressed, SoftStopState.OPEN)
    assert np.array_equal(run.states[:, 0], wanted)
    assert run.states.shape == (len(run), 1)
    assert not run.states.flags.writeable


def test_a_mass_beyond_a_soft_stop_begins_pressed() -> None:
    stop = vi.SoftStop((1.0,), upper=0.4, stiffness=29.0)
    run = vi.simulate(oscillator(stop), vi.State((0.5,), (0.0,)), impacts=1)
    np.testing.assert_allclose(run.forces(0.0), [-29.0 * (0.5 - 0.4)], rtol=ULPS)
    assert states(run, 0)[0] == SoftStopState.UPPER


def test_friction_that_sticks_balances_the_other_forces() -> None:
    speed, kinetic, static = 0.3, 0.4, 0.6
    belt = vi.Friction((1.0,), kinetic, static, belt_speed=speed)
    run = vi.simulate(oscillator(belt), vi.State((0.0,), (0.0,)), t_max=60.0)
    t, flight = inside(run)
    (x, v), force = run.at(t), run.forces(t)[:, 0]
    state = states(run, 0)[flight]
    sticks = state == FrictionState.STICK
    rest = x[:, 0] + 0.1 * v[:, 0]  # the acceleration is zero on a belt of constant speed
    np.testing.assert_allclose(force[sticks], rest[sticks], atol=ULPS)
    assert (force[state == FrictionState.BACKWARD] == kinetic).all()
    assert (abs(force) <= static * (1 + ULPS)).all()
    assert sticks.any()
    assert not sticks.all()


def test_friction_on_a_belt_that_accelerates_carries_the_block_along() -> None:
    a, w = 0.2, 0.5
    belt = vi.Friction((1.0,), 1.0, motion=vi.Harmonic(w, (a,)))
    free = oscillator(belt, stiffness=[[0.0]], damping=[[0.0]])
    run = vi.simulate(free, vi.State((0.0,), (a * w,)), t_max=20.0)
    t = np.linspace(0.0, 20.0, 50)
    np.testing.assert_allclose(run.forces(t)[:, 0], -a * w**2 * np.sin(w * t), atol=ULPS)
    np.testing.assert_allclose(run.at(t)[0][:, 0], a * np.sin(w * t), atol=ULPS)


def test_a_ball_at_rest_on_a_moving_table_presses_with_weight_and_inertia() -> None:
    a, w, g = 0.3, 1.2, 1.0  # a w^2 < g: it stays
    m = oscillator(
        vi.RigidStop((1.0,), lower=0.0, restitution=0.0, motion=vi.Harmonic(w, (a,))),
        stiffness=[[0.0]], damping=[[0.0]], constant_force=(-g,),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((1.0,), (0.0,)), t_max=40.0)
    assert run.states[-1, 0] == RigidStopState.LOWER
    t = np.linspace(run.time[-2], 40.0, 100)[1:]
    np.testing.assert_allclose(run.forces(t)[:, 0], g - a * w**2 * np.sin(w * t), atol=4 * ULPS)


def test_a_rigid_stop_compiled_without_elements_tells_its_force_at_rest_too() -> None:
    w, force, g = 1.2, 0.4, 1.0
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-g,),
        forces=(vi.Harmonic(w, (force,), (0.3,)),),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.0),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (0.0,), 0.7), t_max=30.0)
    t = np.linspace(0.0, 30.0, 40)[1:]
    angle = 0.7 + w * t
    exact = g - force * np.sin(angle) - 0.3 * np.cos(angle)
    # the phase after 36 radians is known to one rounding of it
    np.testing.assert_allclose(run.forces(t)[:, 0], exact, atol=2 * ULPS)


def test_forces_of_all_elements_add_up_to_the_change_of_momentum() -> None:
    m = vi.Mechanism(
        mass=[[2.0, 0.3], [0.3, 1.0]], damping=[[0.2, 0.3], [-0.3, 0.1]],
        stiffness=[[3.0, -1.0], [-1.0, 2.0]], constant_force=(0.1, -0.2),
        forces=(vi.Harmonic(1.1, (2.0, 0.5)),),
        elements=(vi.SoftStop((1.0, -1.0), -0.3, 0.3, 20.0, 0.4),
                  vi.Friction((0.0, 1.0), 0.3, 0.4, motion=vi.Harmonic(1.7, (0.0,), (-0.12,)))),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 0.0)), t_max=15.0)
    knots = np.union1d(0.0, run.time)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    rows, momentum = np.array([e.row for e in m.switching]), np.zeros(2)
    for a, b in itertools.pairwise(knots):
        for one in np.linspace(a, b, 9)[:-1]:  # pieces over which the quadrature is exact
            h = (b - a) / 16
            t = one + h * (nodes + 1)
            x, v = run.at(t)
            pull = run.forces(t) @ rows + m.constant_force - x @ np.transpose(m.stiffness)
            pull += np.outer(np.sin(1.1 * t), m.forces[0].sine) - v @ np.transpose(m.damping)
            momentum += h * weights @ pull
    np.testing.assert_allclose(np.array(m.mass) @ run.last.velocity, momentum, atol=1e-12)
    assert set(run.states[:, 1]) == {*FrictionState} - {FrictionState.LIFTED}


def test_a_dataset_names_elements_and_their_states() -> None:
    wall = vi.RigidStop((1.0,), lower=-1.0, restitution=0.7)
    m = oscillator(vi.SoftStop((1.0,), upper=0.4), vi.Friction((1.0,), 0.1), wall)
    run = vi.simulate(m, vi.State((0.0,), (2.0,)), t_max=5.0)
    data = run.to_dataset()
    assert [*data["element"].values] == ["rigid stop 0", "soft stop 1", "friction 2"]
    assert np.array_equal(data["state"], run.states)
    assert "SoftStopState: 0 OPEN, 1 UPPER" in data.attrs["state_meaning"]
    assert "at the end rigid stop 0 OPEN, soft stop 1 " in repr(run)


def test_a_force_is_given_for_times_of_any_shape_within_the_run() -> None:
    run = vi.simulate(oscillator(vi.Friction((1.0,), 0.1)), vi.State((1.0,), (0.0,)), t_max=9.0)
    assert run.forces(1.0).shape == (1,)
    assert run.forces([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]).shape == (2, 3, 1)
    with pytest.raises(vi.InvalidParameterError, match=r"t = 9\.5: must be in \[0, 9\.0\]"):
        run.forces(9.5)
    assert math.isclose(abs(run.forces(0.5)[0]), 0.1)
