"""Named traps: each once broke this engine or another."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi


def free_masses(
    masses: tuple[float, ...], contacts: tuple[vi.RigidStop, ...], force: float = 0.0
) -> vi.Mechanism:
    """Masses without springs, each under the same constant acceleration."""
    n = len(masses)
    return vi.Mechanism(
        mass=np.diag(masses),
        damping=np.zeros((n, n)),
        stiffness=np.zeros((n, n)),
        elements=contacts,
        constant_force=tuple(force * m for m in masses),
    )


def test_an_impact_beside_a_contact_that_leaves_creates_no_energy() -> None:
    contacts = (
        vi.RigidStop((1, -1), lower=0.0, restitution=0.3),
        vi.RigidStop((0, 1), lower=0.0, restitution=0.9),
    )
    m = free_masses((1.0, 0.04), contacts)
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, -1.0)), impacts=20, t_max=50.0)
    energy = 0.5 * (run.velocity_after**2) @ np.array([1.0, 0.04])
    assert np.all(np.diff(np.concatenate([[0.02], energy])) <= 1e-15)


def test_chatter_of_one_ball_leaves_an_elastic_ball_bouncing() -> None:
    contacts = tuple(
        vi.RigidStop(row, lower=0.0, restitution=r) for row, r in (((1, 0), 0.5), ((0, 1), 1.0))
    )
    m = free_masses((1.0, 1.0), contacts, force=-1.0)
    run = vi.simulate(m, vi.State((0.0, 0.0), (5e-9, 5.5e-9)), impacts=400)
    elastic = run.velocity_after[run.contact == 1, 1]
    assert len(elastic) > 100
    np.testing.assert_allclose(elastic, 5.5e-9, rtol=1e-9)


def test_chatter_does_not_hide_the_impact_of_another_mass() -> None:
    contacts = tuple(vi.RigidStop(row, lower=0.0, restitution=0.5) for row in ((1, 0), (0, 1)))
    m = free_masses((1.0, 1.0), contacts, force=-1.0)
    run = vi.simulate(m, vi.State((0.0, 1e-8), (5e-9, -1.0)), impacts=100, t_max=0.5)
    first = run.time[run.velocity_after[:, 1] > 0.0][0]  # with the first of the chatter, at 1e-8
    assert first == pytest.approx(1e-8, rel=1e-6)


def test_a_million_short_hops_do_not_sink_into_the_stop() -> None:
    gravity = vi.Mechanism(
        mass=[[1.3]],
        damping=[[0.0]],
        stiffness=[[0.0]],
        constant_force=(-1.3 * 1.1,),
        elements=(vi.RigidStop((1,), lower=0.7),),
    )
    run = vi.simulate(gravity, vi.State((0.7,), (0.1,)), impacts=100_000)
    # place to its last digits; speed by a random walk of one ulp per impact
    assert abs(run.position[-1, 0] - 0.7) < 4 * 2.0**-53
    assert abs(run.velocity_after[-1, 0] - 0.1) < 1e-13


def test_two_masses_that_graze_at_once_go_on() -> None:
    contacts = tuple(vi.RigidStop(row, upper=1.0, restitution=0.5) for row in ((1, 0), (0, 1)))
    m = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.eye(2), elements=contacts
    )
    run = vi.simulate(m, vi.State((0.6, 0.6), (0.8, 0.8)), impacts=10, t_max=30.0)
    assert run.end is vi.RunEnd.HORIZON


def test_a_mass_at_rest_on_a_stop_without_force_stays_there_in_silence() -> None:
    m = free_masses((1.0,), (vi.RigidStop((1,), upper=1.0, restitution=0.5),))
    run = vi.simulate(m, vi.State((1.0,), (0.0,)), impacts=10, t_max=2000.0)
    assert run.end is vi.RunEnd.HORIZON
    assert len(run) <= 3


def test_dense_output_holds_in_flights_of_a_million_radians() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.8, half_clearance=1e9, omega=0.01
    )
    run = vi.simulate(damper, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1)
    position, _ = run.at(np.linspace(0.0, run.time[-1], 11))
    # long after the start: the forced answer alone
    theta = 0.01 * run.time[-1]
    spring, dash = 1.0 - 0.01**2, 2 * 0.02 * 0.01
    size = math.hypot(spring, dash)
    forced = math.sin(theta - math.atan2(dash, spring)) / size
    assert np.all(np.isfinite(position))
    assert position[-1, 0] == pytest.approx(forced, abs=1e-9)


def test_rates_that_doubles_cannot_carry_are_refused() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=1e40, zeta=0.02, restitution=0.8, half_clearance=1.0, omega=1e40
    )
    with pytest.raises(vi.InvalidParameterError, match="fastest rate"):
        vi.simulate(damper, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1)


def test_a_far_stop_does_not_blind_the_near_one() -> None:
    m = vi.Mechanism(
        mass=[[1.0]],
        damping=[[0.0]],
        stiffness=[[1.0]],
        elements=(vi.RigidStop((1,), lower=-1e9, upper=1.0, restitution=0.5),),
    )
    run = vi.simulate(m, vi.State((0.0,), (1.0 + 1e-8,)), impacts=1, t_max=5.0)
    assert run.status[0] == vi.Status.IMPACT
    # v^2 - 1 = 2e-8 at the stop
    assert -run.rate_before[0] == pytest.approx(math.sqrt(2e-8), rel=1e-6)


def test_a_contact_driven_together_beside_one_at_rest_strikes_before_the_rest_goes_on() -> None:
    rows = ((-0.7, -1.9, -0.2, -1.1), (2.1, -1.7, -1.2, -0.8), (1.2, 0.4, -0.1, -0.7))
    bounce = ((0.3, 1.0), (0.0, 0.9), (0.3, 1.0))
    m = vi.Mechanism(
        mass=[
            [6.6, -0.1, -2.1, -0.7],
            [-0.1, 0.8, 0.8, 0.8],
            [-2.1, 0.8, 2.6, 1.0],
            [-0.7, 0.8, 1.0, 2.6],
        ],
        damping=np.zeros((4, 4)),
        stiffness=np.zeros((4, 4)),
        elements=tuple(
            vi.RigidStop(row, lower=-1e-3, upper=1e-3, restitution=r)
            for row, r in zip(rows, bounce, strict=True)
        ),
        forces=(vi.Harmonic(1.58, (-1.7, -1.4, 0.2, -1.0)),),
    )
    run = vi.simulate(m, vi.State((0.0,) * 4, (0.85, 0.0, 0.0, 0.0)), impacts=3000, t_max=119.0)
    for contact in m.rigid_stops:
        u = run.position @ np.array(contact.row)
        assert contact.lower - 1e-13 <= u.min() <= u.max() <= contact.upper + 1e-13
