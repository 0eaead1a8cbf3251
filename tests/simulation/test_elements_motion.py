"""Sections, exponents and classification of machines with soft stops, friction, moving stops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.model.parameters import with_parameter

ULPS = 64 * 2.0**-53  # of a few events
START = vi.State((0.1,), (0.3,), 0.1)


def oscillator(*elements: Any, omega: float = 1.3, force: float = 1.0) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.06]], stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (force,)),), elements=elements,
    )  # fmt: skip


BILINEAR = vi.SoftStop((1.0,), upper=0.0, stiffness=29.0)
BELT = vi.Friction((1.0,), 0.2, 0.3, belt_speed=0.1)


def test_a_section_at_a_soft_stop_has_the_engagements_of_the_run() -> None:
    m = oscillator(BELT, vi.SoftStop((1.0,), upper=0.5, stiffness=8.0, damping=0.3))
    section = vi.section(m, START, at=vi.AtStop(contact=1), points=20, settle_events=0)
    run = vi.simulate(m, START, t_max=float(section.time[-1]) + 1e-9, impacts=10_000)
    met = run.status == vi.Status.ENGAGE
    assert np.all(section.status == vi.Status.ENGAGE)
    assert section.time.tobytes() == run.time[met].tobytes()
    np.testing.assert_allclose(section.position[:, 0], 0.5, rtol=ULPS)
    assert np.all(section.velocity[:, 0] > 0.0)


def test_friction_is_no_impact_section_and_the_message_says_what_is() -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"no stop\. Take vi\.AtChange.*AtPhase"):
        vi.section(oscillator(BELT), START, at=vi.AtStop())
    with pytest.raises(vi.InvalidParameterError, match=r"friction, which has no stop\. Take 1, or"):
        vi.section(oscillator(BELT, BILINEAR), START, at=vi.AtStop(contact=0))
    switch = vi.PhaseSwitch(2.0, (0.0, 3.0), ((1.0,), (-1.0,)))
    with pytest.raises(vi.InvalidParameterError, match="phase switch, which has no stop"):
        vi.section(oscillator(switch), START, at=vi.AtStop())


@pytest.mark.parametrize("elements", [(BILINEAR,), (BELT,)])
def test_a_stroboscopic_section_has_the_states_of_the_run(elements: Any) -> None:
    m = oscillator(*elements, omega=0.7)
    section = vi.section(m, START, at=vi.AtPhase(), points=10, settle_events=5)
    run = vi.simulate(m, START, t_max=float(section.time[-1]) + 1.0, impacts=10_000)
    x, v = run.at(section.time)
    np.testing.assert_allclose(section.position, x, atol=1e3 * ULPS)
    np.testing.assert_allclose(section.velocity, v, atol=1e3 * ULPS)


def test_the_multipliers_of_a_bilinear_oscillator_lose_what_the_dashpot_takes() -> None:
    """Without a dashpot in the stop the flow contracts by exp(-c T) in all of its modes."""
    found = vi.classify(oscillator(BILINEAR), START)
    assert found.symbol == "1-1-0"
    assert found.multipliers is not None
    product = np.prod(found.multipliers).real
    period = 2.0 * math.pi / 1.3
    # an orbit closed to 1e-9 of its size has multipliers with errors of some 10 of that
    np.testing.assert_allclose(product, math.exp(-0.06 * period), rtol=1e-7)
    rate = math.log(abs(found.multipliers[0])) / period
    assert abs(found.exponent.value - rate) < 5.0 * found.exponent.error + 1e-4


@pytest.mark.parametrize("omega", [1.3, 0.5])  # periodic, chaotic
def test_the_exponents_of_a_bilinear_oscillator_add_up_to_minus_its_damping(omega: float) -> None:
    found = vi.lyapunov_spectrum(oscillator(BILINEAR, omega=omega), START, impacts=4000)
    assert found.values.shape == (2,)
    assert found.complete
    # (T33): the ends of the average are 1 / (duration) apart, and tangents turn at both
    assert abs(found.sum + 0.06) < 1e-4
    largest = vi.lyapunov_exponent(oscillator(BILINEAR, omega=omega), START, impacts=4000)
    assert abs(largest.value - found.values[0]) < 3.0 * (largest.error + found.errors[0])
    assert (found.values[0] > 0.0) == (omega == 0.5)


def test_a_machine_without_stops_has_exponents_from_its_changes() -> None:
    m = oscillator(BELT, omega=0.7, force=0.3)
    largest = vi.lyapunov_exponent(m, START, impacts=2000, settle_impacts=100)
    assert largest.value < 0.0
    # while it sticks, velocity and belt agree, so that directions are forgotten
    assert vi.lyapunov_spectrum(m, START, impacts=2000, settle_impacts=100).values[-1] == -math.inf


@pytest.mark.parametrize("x", [0.12, -0.12, 0.149, -0.149])
def test_a_start_at_rest_sticks_up_to_the_static_force(x: float) -> None:
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        elements=(vi.Friction((1.0,), kinetic=0.1, static=0.15),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((x,), (0.0,)), t_max=10.0)
    assert run.status.tolist() == [vi.Status.HORIZON]
    assert run.position[-1, 0] == x


def test_a_frequency_moves_stops_with_it() -> None:
    motion = vi.Harmonic(2.0, (0.3,))
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.7, motion=motion),),
    )  # fmt: skip
    faster = with_parameter(m, "omega", 3.0)
    assert isinstance(faster, vi.Mechanism)
    assert faster.forces[0].omega == 3.0
    assert faster.rigid_stops[0].motion[0].omega == 3.0
    run = vi.simulate(faster, vi.State((2.0,), (0.0,)), impacts=5)
    np.testing.assert_allclose(run.position[:, 0], 0.3 * np.sin(3.0 * run.time), atol=1e2 * ULPS)


def test_blocks_that_hold_each_other_stick_together() -> None:
    """The force that one friction takes to stick depends on what the others do."""
    m = vi.Mechanism(
        mass=np.eye(3).tolist(), damping=np.zeros((3, 3)).tolist(),
        stiffness=[[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]],
        elements=(
            vi.Friction((1.0, -1.0, 0.0), 0.05),
            vi.Friction((0.0, 1.0, -1.0), 0.04, 0.05),
            vi.Friction((0.0, 0.0, 1.0), 0.03),
        ),
    )  # fmt: skip
    # the first slips and pulls with 0.05 + x1, which the last one holds up to 0.03
    run = vi.simulate(m, vi.State((-0.04, 0.0, 0.0), (0.9, 0.0, 0.0)), t_max=0.05)
    assert run.status[0] == vi.Status.CHANGE
    np.testing.assert_allclose(run.position[0], [-0.02, 0.0, 0.0], atol=ULPS)


def bouncing(gamma: float, e: float = 0.5) -> vi.Mechanism:
    """A ball on a table of acceleration gamma g."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        elements=(
            vi.RigidStop((1.0,), lower=0.0, restitution=e, motion=vi.Harmonic(1.0, (gamma,))),
        ),
    )  # fmt: skip


def test_a_ball_on_a_table_doubles_its_period_at_the_closed_form() -> None:
    """One bounce per period is lost at G^2 = (pi (1 - e) / (1 + e))^2 + (2 (1 + e^2) / (1 + e)^2)^2."""
    e = 0.5
    born, turn = math.pi * (1.0 - e) / (1.0 + e), 2.0 * (1.0 + e * e) / (1.0 + e) ** 2
    doubling = math.hypot(born, turn)

    def classified(gamma: float) -> tuple[float, vi.Attractor]:
        """Phase of the bounce, and the attractor next to the orbit, which is thrown up at pi."""
        phase = math.acos(born / gamma)
        start = vi.State((gamma * math.sin(phase),), (math.pi + 0.01,), phase)
        return phase, vi.classify(bouncing(gamma), start, at=vi.AtStop("B"))

    phase, found = classified(0.5 * (born + doubling))
    assert found.symbol == "1-0-1"
    assert found.multipliers is not None
    np.testing.assert_allclose(np.prod(found.multipliers).real, e * e, rtol=1e-7)
    np.testing.assert_allclose(found.section.phase, phase, atol=1e-7)
    assert classified(0.99 * doubling)[1].symbol == "1-0-1"
    assert classified(1.01 * doubling)[1].symbol == "2-0-2"


def test_friction_that_sticks_and_slips_often_between_impacts_leaves_no_record_too_small() -> None:
    """A capsule driven from inside slips and sticks six times for each time that its stop is met."""
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 3.0]], damping=[[0.3, -0.3], [-0.3, 0.3]],
        stiffness=[[1.0, -1.0], [-1.0, 1.0]], forces=(vi.Harmonic(1.1, (1.0, 0.0)),),
        elements=(vi.SoftStop((1.0, -1.0), upper=0.02, stiffness=27.0, damping=1.0),
                  vi.Friction((0.0, 1.0), kinetic=0.4)),
    )  # fmt: skip
    start = vi.State((0.0, 0.0), (0.0, 0.0))
    run = vi.simulate(m, start, impacts=50)
    assert run.end is vi.RunEnd.IMPACTS
    assert len(run) > 5 * run.impacts.sum()
    assert len(vi.section(m, start, points=20, settle_events=20).x1) == 20
    exponent = vi.lyapunov_exponent(m, start, settle_impacts=50, impacts=1024)
    assert abs(exponent.value) < 1e-9  # its place does not matter: a shift neither grows nor dies


def test_exponents_go_on_where_impacts_end_and_friction_does_not() -> None:
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.31, (0.9,)),),
        elements=(vi.RigidStop((1.0,), upper=0.9, restitution=0.5), vi.Friction((1.0,), 0.1)),
    )  # fmt: skip
    start = vi.State((0.0,), (0.0,))
    assert vi.simulate(m, start, impacts=9).end is vi.RunEnd.EVENTS
    spectrum = vi.lyapunov_spectrum(m, start, settle_impacts=100, impacts=1024)
    assert spectrum.values[1] == -np.inf  # it sticks
    assert vi.lyapunov_exponent(m, start, settle_impacts=100, impacts=1024).value < 0.0
