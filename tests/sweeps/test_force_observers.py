"""Forces, impulses, progress and dissipation: closed forms, balances of momentum and energy, quadrature."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi

ULPS = 64 * 2.0**-53
NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


def observed(m: vi.Mechanism, start: vi.State, periods: float, observe: Any, settle: float = 0.0) -> Any:  # fmt: skip
    """What a sweep of one member sees, by name."""
    starts = vi.ListedStarts(
        np.array([start.position]), np.array([start.velocity]), np.array([start.phase])
    )
    found = vi.sweep(m, over={}, start=starts, observe=observe, settle_periods=settle, periods=periods,
                     most_impacts=100_000, progress=False)  # fmt: skip
    assert found.end.values[0] == 0
    return found.isel(start=0)


def tumbling() -> vi.Mechanism:
    """Two free masses that are thrown against all kinds of elements, and settle on some."""
    return vi.Mechanism(
        mass=[[1.0, 0.2], [0.2, 0.7]], damping=[[0.0] * 2] * 2, stiffness=[[0.0] * 2] * 2,
        forces=(vi.Harmonic(1.3, (0.6, -0.4), (0.1, 0.2)),), constant_force=(-0.5, 0.9),
        elements=(
            vi.RigidStop((1.0, 0.0), lower=-0.8, restitution=0.5),
            vi.RigidStop((0.0, 1.0), upper=0.6, restitution=0.3),
            vi.SoftStop((1.0, -1.0), -0.5, 0.4, stiffness=(20.0, 35.0), damping=(0.8, 0.0)),
            vi.Friction((1.0, 0.0), 0.2, 0.3, belt_speed=0.1),
            vi.Friction((0.0, 1.0), 0.5, load=vi.NormalLoad(0.3, motion=vi.Harmonic(1.3, (0.5,)))),
            vi.PhaseSwitch(1.3, (0.5, 2.0), ((0.2, 0.0), (0.0, 0.0)), ((0.3, -0.1), (0.0, 0.2))),
        ),
    )  # fmt: skip


def test_one_contact_with_a_soft_stop_has_the_force_and_the_impulse_of_the_closed_form() -> None:
    mass, k, v = 2.0, 50.0, 0.7
    m = vi.Mechanism(mass=[[mass]], damping=[[0.0]], stiffness=[[0.0]],
                     elements=(vi.SoftStop((1.0,), upper=0.3, stiffness=k),))  # fmt: skip
    found = observed(m, vi.State((0.0,), (v,)), 2.0, ["forces", "impulse"])
    # half a period of sqrt(k / m), from the stop and back
    np.testing.assert_allclose(found.force_smallest.values, [-v * math.sqrt(k * mass)], rtol=ULPS)
    np.testing.assert_allclose(found.force_largest, [0.0], atol=ULPS)
    np.testing.assert_allclose(found.impulse.values, [-2.0 * mass * v], rtol=ULPS)


def test_friction_that_sticks_has_the_force_that_holds_it() -> None:
    w, a = 2.0, 0.4
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(0.3,),
                     forces=(vi.Harmonic(w, (a,)),), elements=(vi.Friction((1.0,), 1.0),))  # fmt: skip
    found = observed(m, vi.State((0.0,), (0.0,)), 3.0, ["forces", "impulse"])
    np.testing.assert_allclose(found.force_smallest, [-0.3 - a], rtol=ULPS)
    np.testing.assert_allclose(found.force_largest, [a - 0.3], rtol=ULPS)
    np.testing.assert_allclose(found.impulse, [-0.3 * 3.0 * 2.0 * math.pi / w], rtol=ULPS)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_ball_that_comes_to_rest_gets_the_impulse_of_its_weight(restitution: float) -> None:
    """Impacts, infinitely many of them, and then the force at rest: together what gravity gives."""
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
                     elements=(vi.RigidStop((1.0,), lower=0.0, restitution=restitution),))  # fmt: skip
    start = vi.State((0.7,), (0.2,))
    found = observed(m, start, 20.0, ["forces", "impulse", "final", "shares"])
    assert (found.chatters.values > 0) == (restitution > 0.0)
    np.testing.assert_allclose(found.final_velocity, [0.0], atol=ULPS)
    np.testing.assert_allclose(found.impulse, [20.0 - 0.2], rtol=1e2 * ULPS)
    assert found.force_smallest.values.tolist() == [0.0]
    np.testing.assert_allclose(found.force_largest, [1.0], rtol=ULPS)


def test_impulses_of_all_forces_are_the_change_of_momentum() -> None:
    m, start = tumbling(), vi.State((0.0, 0.0), (1.0, -0.5), 0.4)
    periods, w = 9.0, 1.3
    found = observed(m, start, periods, ["impulse", "final", "shares", "impacts", "states"])
    assert found.share_at_rest > 0.1
    assert found.chatters > 0
    assert np.count_nonzero(found.share_in_state.values) >= 8
    rows = np.array([part.row for part in m.elements if not isinstance(part, vi.PhaseSwitch)])
    gained = np.array(m.mass) @ (found.final_velocity.values - start.velocity)
    length = periods * 2.0 * math.pi / w  # whole periods: forcing gives nothing
    switched = periods * (np.array([0.2, 0.0]) * 1.5 / w + [0.3, 0.1])
    given = found.impulse.values[:5] @ rows + np.array(m.constant_force) * length + switched
    # some 2000 steps and 200 events, each with the rounding of an impulse of order one
    np.testing.assert_allclose(given, gained, atol=2000 * 2.0**-52)
    assert found.impulse.values[5] == 0.0  # a phase switch has no row


def test_forces_and_impulses_are_those_of_the_run() -> None:
    m, start = tumbling(), vi.State((0.0, 0.0), (1.0, -0.5), 0.4)
    periods = 3.0
    found = observed(m, start, periods, ["forces", "impulse"])
    length = periods * 2.0 * math.pi / 1.3
    run = vi.simulate(m, start, t_max=length, impacts=100_000)
    edges = np.unique(np.concatenate([[0.0], run.time, np.linspace(0.0, length, 40)]))
    span = np.diff(edges)[:, None]
    f = run.forces(edges[:-1, None] + span * (1.0 + NODES) / 2.0)
    integral = np.einsum("i,j,ijk->k", span[:, 0] / 2.0, WEIGHTS, f)
    ends = np.nextafter(edges[1:], -np.inf)
    dense = run.forces(np.linspace(edges[:-1], ends, 200))
    low, high = dense.min(axis=(0, 1)), dense.max(axis=(0, 1))
    curved = 40.0 * (length / 40.0 / 200.0) ** 2  # what samples may miss of rates up to 7
    assert np.all(found.force_smallest.values <= low + 1e-12)
    assert np.all(found.force_largest.values >= high - 1e-12)
    np.testing.assert_allclose(found.force_smallest, low, atol=curved)
    np.testing.assert_allclose(found.force_largest, high, atol=curved)
    np.testing.assert_allclose(found.impulse.values[2:], integral[2:], atol=1e-9)


def test_friction_under_a_load_takes_the_energy_that_is_lost() -> None:
    """A block on a shaken table, which lifts off meanwhile: the table gives no energy along the row."""
    load = vi.NormalLoad(1.0, motion=vi.Harmonic(3.0, (0.0,), (2.0,)))
    m = vi.Mechanism(mass=[[1.5]], damping=[[0.0]], stiffness=[[0.0]],
                     elements=(vi.Friction((1.0,), 0.3, load=load),))  # fmt: skip
    found = observed(m, vi.State((0.0,), (5.0,)), 2.0, ["dissipation", "final", "states"])
    assert found.share_in_state.values[0, vi.FrictionState.LIFTED] > 0.2
    lost = 0.75 * (25.0 - found.final_velocity.values[0] ** 2)
    length = 2.0 * 2.0 * math.pi / 3.0
    np.testing.assert_allclose(found.work_on_element.values * length, [lost], rtol=ULPS)


def test_a_dashpot_against_a_massless_coordinate_takes_what_the_motion_loses() -> None:
    """The stop meets a massless coordinate, whose speed depends on whether it is pressed."""
    c, own = 0.3, 2.0
    stop = vi.SoftStop((1.0, -1.0), upper=0.05, stiffness=4.0, damping=0.7, law="linear")
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.0, 0.0], [0.0, c]], stiffness=[[1.0, 0.0], [0.0, own]],
        elements=(stop,),
    )  # fmt: skip
    start, length = vi.State((-0.2, 0.0), (1.0, 0.0)), 1.2
    run = vi.simulate(m, start, t_max=length)
    found = observed(m, start, length, ["dissipation", "impulse"])
    lost = 0.0  # in the other dashpot
    for a, b in itertools.pairwise(np.unique([0.0, *run.time])):
        _, v = run.at(a + (b - a) * (1.0 + NODES) / 2.0)
        lost += (b - a) / 2.0 * WEIGHTS @ (c * v[:, 1] ** 2)
    x, v = run.at(length)
    energy = (v[0] ** 2 + x[0] ** 2 + own * x[1] ** 2) / 2.0
    work = float(found.work_on_element.values[0]) * length
    assert work > 0.05
    np.testing.assert_allclose(work, (1.0 + 0.04) / 2.0 - energy - lost, rtol=1e-13)


def test_progress_is_the_drift_per_period() -> None:
    w, speed = 2.0, 0.3
    m = vi.Mechanism(mass=[[1.0, 0.0], [0.0, 2.0]], damping=[[0.0] * 2] * 2, stiffness=[[0.0] * 2] * 2,
                     forces=(vi.Harmonic(w, (0.5, 0.0)),),
                     elements=(vi.Friction((0.0, 1.0), 1.0, belt_speed=speed),))  # fmt: skip
    period = 2.0 * math.pi / w
    start = vi.State((0.4, -1.0), (0.1, speed), 0.3)
    seen = ["progress", vi.observe.Progress(row=(1.0, 1.0), label="sum")]
    found = observed(m, start, 5.0, seen, settle=2.0)
    drift = np.array([0.1 + 0.5 / w * math.cos(0.3), speed]) * period
    np.testing.assert_allclose(found.x_progress, drift, rtol=1e2 * ULPS)
    np.testing.assert_allclose(found.sum_progress, drift.sum(), rtol=1e2 * ULPS)
    free = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
                        elements=(vi.RigidStop((1.0,), upper=1e6),))  # fmt: skip
    found = observed(free, vi.State((0.4,), (0.7,)), 5.0, "progress", settle=2.0)
    np.testing.assert_allclose(found.x_progress, [0.7], rtol=1e2 * ULPS)  # per unit of time


def test_a_sweep_of_kicks_has_the_bits_of_single_runs() -> None:
    kicks = vi.PhaseSwitch(2.0, (0.3, 2.0), ((1.0,), (-1.0,)), ((0.5,), (-0.2,)))
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
        elements=(kicks, vi.RigidStop((1.0,), upper=0.6, restitution=0.6), vi.Friction((1.0,), 0.05)),
    )  # fmt: skip
    start = vi.State((0.0,), (0.5,))
    over = {"elements[1].impulses[0][0]": [0.5, 0.8, 1.1], "mass[0][0]": [1.0, 1.3]}
    found = vi.sweep(m, over=over, start=start, settle_periods=0.0, periods=20, observe="final",
                     progress=False)  # fmt: skip
    assert vi.rerun_sweep(found, progress=False).identical(found)
    for (i, p), (j, mass) in itertools.product(*(enumerate(x) for x in over.values())):
        one = vi.Mechanism(
            mass=[[mass]], damping=m.damping, stiffness=m.stiffness,
            elements=(
                *m.rigid_stops,
                vi.PhaseSwitch(2.0, (0.3, 2.0), ((1.0,), (-1.0,)), ((p,), (-0.2,))),
                m.switching[1],
            ),
        )  # fmt: skip
        run = vi.simulate(one, start, t_max=20 * math.pi, impacts=100_000)
        assert run.last.position == tuple(found.final_position.values[i, j])
        assert run.last.velocity == tuple(found.final_velocity.values[i, j])
