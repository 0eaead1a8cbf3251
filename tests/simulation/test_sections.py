"""Sections and following: points lie on the stop, obey the law of impact, and carry over."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.attractors.sweep_attractor import carried, sweep_attractor
from vibroimpact.simulation.sections import impact_section, section_of, take
from vibroimpact.simulation.simulate import RunEnd
from vibroimpact.simulation.simulator import Simulator

DAMPER = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.00314
)
PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))
CHATTERING = vi.ImpactDamper(
    mass_ratio=0.05092, omega_n=1.0, zeta=0.015, restitution=0.7, half_clearance=6.0, omega=0.41719
)


def bouncing_ball(restitution=0.5):
    """A ball on a table that shakes with amplitude 2 g, in the frame of the table."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        forces=(vi.Harmonic(1.0, (2.0,)),),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=restitution),),
        constant_force=(-1.0,),
    )  # fmt: skip


@pytest.mark.parametrize(("stop", "side"), [("A", 1.0), ("B", -1.0)])
def test_points_stand_on_their_stop_and_depart(stop, side):
    section = impact_section(DAMPER, PLAIN, points=300, settle=10, stop=stop)
    assert len(section) == 300
    u = section.x2 - section.x1
    assert np.abs(u - side * DAMPER.half_clearance).max() <= 2e-15 * 8.0  # |x| < 8: one ulp each
    assert np.all(side * (section.v2 - section.v1) < 0.0)
    assert np.all((section.phase >= 0.0) & (section.phase < 2.0 * math.pi))


def test_a_section_is_what_the_simulation_records_at_that_stop():
    run = vi.simulate(DAMPER, PLAIN, impacts=400)
    section = impact_section(DAMPER, PLAIN, points=100, settle=0)
    at_a = np.flatnonzero(run.impacts & (run.stop == 0))[:100]
    assert np.array_equal(section.position, run.position[at_a])
    assert np.array_equal(section.velocity, run.velocity_after[at_a])
    assert np.array_equal(section.phase, run.phase[at_a])
    assert np.array_equal(section.time, run.time[at_a])


def test_settling_skips_that_many_impacts():
    run = vi.simulate(DAMPER, PLAIN, impacts=400)
    section = impact_section(DAMPER, PLAIN, points=20, settle=101)
    at_a = np.flatnonzero(run.stop == 0)
    assert np.array_equal(section.x1, run.position[at_a[at_a >= 101][:20], 0])


def test_phases_follow_from_times():
    section = impact_section(DAMPER, PLAIN, points=500, settle=10)
    turned = section.phase[0] + DAMPER.omega * (section.time - section.time[0])
    # One ulp of omega t, some 500 periods, and as much for the comparison.
    assert np.abs(np.exp(1j * turned) - np.exp(1j * section.phase)).max() < 4e-12


def test_pieces_of_a_record_join_without_a_seam():
    whole = take(Simulator(CHATTERING, PLAIN), 400, 0, "A")
    motion = Simulator(CHATTERING, PLAIN)
    parts = [motion.record(n) for n in (1, 7, 150, 3000)]
    joined = section_of(motion, parts, 0, "A", 400, RunEnd.IMPACTS)
    assert np.array_equal(whole.position, joined.position)
    assert np.allclose(whole.time, joined.time, rtol=1e-15, atol=0.0)


def test_a_dataset_says_what_it_is():
    dataset = impact_section(DAMPER, PLAIN, points=5).to_dataset()
    assert dataset.sizes == {"impact": 5, "coordinate": 2}
    assert dataset.attrs["stop"] == "A"
    assert "omega=1.00314" in dataset.attrs["system"]


def test_arrays_are_read_only_and_the_last_state_goes_on():
    section = impact_section(DAMPER, PLAIN, points=50, settle=0)
    with pytest.raises(ValueError, match="read-only"):
        section.phase[0] = 0.0
    onward = impact_section(DAMPER, section.last, points=50, settle=0)
    direct = impact_section(DAMPER, PLAIN, points=100, settle=0)
    # The state goes through a phase in [0, 2 pi): one rounding, grown over 50 impacts.
    assert np.allclose(onward.position, direct.position[50:], rtol=0.0, atol=1e-9)


def test_a_one_sided_stop_of_any_mechanism_has_a_section():
    section = impact_section(bouncing_ball(), vi.State((1.0,), (0.0,)), points=20, stop="B")
    assert len(section) == 20
    assert np.abs(section.position).max() <= 4e-16  # one ulp of the forced response, 2 wide
    assert np.all(section.velocity >= 0.0)


def test_a_motion_that_stops_impacting_leaves_the_points_it_had():
    # A pendulum-like oscillator that touches its stop only at first.
    damped = vi.Mechanism(
        mass=[[1.0]], damping=[[0.4]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), lower=-0.5, restitution=0.9),),
    )  # fmt: skip
    section = impact_section(damped, vi.State((2.0,), (0.0,)), points=100, settle=0, stop="B")
    assert 1 <= len(section) < 100
    assert section.end is RunEnd.SILENT


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"points": 0}, "points = 0"),
        ({"settle": -1}, "settle = -1"),
        ({"stop": "C"}, "stop = 'C'"),
        ({"contact": 1}, "contact = 1"),
        ({"points": 2.5}, "points = 2.5"),
    ],
)
def test_misuse_is_named(keywords, words):
    with pytest.raises(vi.InvalidParameterError, match=words):
        impact_section(DAMPER, PLAIN, **keywords)


def test_a_stop_that_is_not_there_is_refused():
    with pytest.raises(vi.InvalidParameterError, match="no such stop"):
        impact_section(bouncing_ball(), vi.State((1.0,), (0.0,)), stop="A")


# --- once per forcing period ----------------------------------------------------------------------


def oscillator(omega, stop):
    """x'' + 0.1 x' + x = 0.5 sin(omega t), x <= stop."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (0.5,)),),
        elements=(vi.RigidStop((1.0,), upper=stop, restitution=0.8),),
    )  # fmt: skip


def steady(omega, phase):
    """Position and velocity of the steady response of the oscillator without its stop."""
    z = 0.5 * np.exp(1j * (phase % (2.0 * math.pi))) / (1.0 - omega**2 + 0.1j * omega)
    return z.imag, (1j * omega * z).imag


@pytest.mark.parametrize("system", [DAMPER, CHATTERING, bouncing_ball()])
def test_states_at_a_phase_are_those_of_the_simulation(system):
    degrees = getattr(system, "mechanism", system).degrees
    start = PLAIN if degrees == 2 else vi.State((1.0,), (0.0,), 0.4)
    section = vi.stroboscopic_section(system, start, points=40, settle=7, phase=-1.0)
    run = vi.simulate(system, start, impacts=10**5, t_max=1.01 * float(section.time[-1]))
    position, velocity = run.at(section.time)
    # one rounding of a time up to 700, in which a velocity of 6 changes by less than 6
    np.testing.assert_allclose(section.position, position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(section.velocity, velocity, rtol=0.0, atol=1e-12)
    omega = getattr(system, "mechanism", system).omega
    turned = (start.phase + omega * section.time + 1.0) / (2.0 * math.pi)
    np.testing.assert_allclose(turned, np.round(turned), atol=1e-12)
    assert np.all(np.diff(np.round(turned)) == 1.0)
    assert section.phase == pytest.approx(2.0 * math.pi - 1.0)
    assert section.end is RunEnd.HORIZON


def test_a_record_in_many_pieces_has_the_states_of_one(monkeypatch):
    whole = vi.stroboscopic_section(DAMPER, PLAIN, points=60, settle=5, phase=2.0)
    monkeypatch.setattr("vibroimpact.simulation.simulator.CHUNK", 5)
    pieces = vi.stroboscopic_section(DAMPER, PLAIN, points=60, settle=5, phase=2.0)
    np.testing.assert_array_equal(whole.position, pieces.position)
    np.testing.assert_array_equal(whole.velocity, pieces.velocity)


@pytest.mark.parametrize("phase", [0.0, 1.0, 4.5, -20.0])
@pytest.mark.parametrize("omega", [0.3, 1.7, 2.6])
def test_a_motion_without_impacts_has_the_closed_form_at_every_phase(omega, phase):
    """20000 periods without an event, which is longer than a run without impacts is followed."""
    system = oscillator(omega, 50.0)
    section = vi.stroboscopic_section(system, vi.State((0.0,), (0.0,)), phase=phase, points=20_000)
    assert len(section) == 20_000
    x, v = steady(omega, phase)
    # at t = 4e5 a time has 6e-11 of a radian
    np.testing.assert_allclose(section.x1, x, atol=1e-9)
    np.testing.assert_allclose(section.v1, v, atol=1e-9)


def test_at_the_time_of_an_impact_the_state_is_that_after_it():
    """The orbit's impact at A is put at the phase of the section."""
    orbit = vi.symmetric_orbits(replace(DAMPER, omega=1.2))[0]
    system = replace(DAMPER, omega=1.2)
    later = orbit.state.phase + 1e-9  # of its own phase the times could be rounded to before it
    section = vi.stroboscopic_section(system, orbit.state, points=5, settle=3, phase=later)
    np.testing.assert_allclose(section.v2, orbit.state.velocity[1], atol=1e-7)
    direct = vi.stroboscopic_section(
        system, orbit.state, points=1, settle=0, phase=orbit.state.phase
    )
    assert direct.position[0] == pytest.approx(orbit.state.position)
    assert direct.velocity[0] == pytest.approx(orbit.state.velocity)


def test_a_stroboscopic_section_goes_on_from_its_last_state():
    whole = vi.stroboscopic_section(DAMPER, PLAIN, points=20, settle=0, phase=0.3)
    first = vi.stroboscopic_section(DAMPER, PLAIN, points=10, settle=0, phase=0.3)
    second = vi.stroboscopic_section(DAMPER, first.last, points=11, settle=0, phase=0.3)
    np.testing.assert_allclose(second.position, whole.position[9:], atol=1e-10)


@pytest.mark.usefixtures("no_windows")
def test_a_stroboscopic_section_is_drawn_without_the_plus_of_impacts():
    section = vi.stroboscopic_section(DAMPER, PLAIN, points=5)
    assert section.plot().get_ylabel() == r"$\dot x_{1}$"
    assert impact_section(DAMPER, PLAIN, points=5).plot().get_ylabel() == r"$\dot x_{1+}$"
    assert section.to_dataset().sizes == {"period": 5, "coordinate": 2}


@pytest.mark.parametrize(
    ("keywords", "words"),
    [({"points": 0}, "points = 0"), ({"settle": -1}, "settle = -1"),
     ({"phase": math.nan}, "phase = nan"), ({"phase": "x"}, "phase = 'x'")],
)  # fmt: skip
def test_misuse_of_a_stroboscopic_section_is_named(keywords, words):
    with pytest.raises(vi.InvalidParameterError, match=words):
        vi.stroboscopic_section(DAMPER, PLAIN, **keywords)


def test_without_forcing_there_is_no_phase_to_look_at():
    free = vi.Mechanism(
        mass=[[1.0]], damping=[[0.4]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), lower=-0.5, restitution=0.9),),
    )  # fmt: skip
    with pytest.raises(vi.InvalidParameterError, match="no forcing"):
        vi.stroboscopic_section(free, vi.State((2.0,), (0.0,)))


# --- following -----------------------------------------------------------------------------------


def test_every_step_starts_where_the_last_one_ended():
    values = [1.2, 1.15, 1.1]
    steps = sweep_attractor(DAMPER, "omega", values, PLAIN, settle=50, keep=20)
    state = PLAIN
    for step, value in zip(steps, values, strict=True):
        alone = impact_section(replace(DAMPER, omega=value), state, points=20, settle=50)
        assert step.value == value
        assert np.array_equal(step.section.position, alone.position)
        state = step.last
        assert state == alone.last


def test_down_and_up_may_differ_but_agree_on_a_single_attractor():
    down = sweep_attractor(DAMPER, "omega", [1.3, 1.25, 1.2], PLAIN, settle=3000, keep=10)
    up = sweep_attractor(DAMPER, "omega", [1.1, 1.15, 1.2], PLAIN, settle=3000, keep=10)
    assert np.allclose(down[-1].section.x1, up[-1].section.x1, atol=1e-12)


def test_a_moving_stop_takes_the_free_mass_along():
    steps = sweep_attractor(DAMPER, "half_clearance", [5.0, 4.9, 5.1], PLAIN, settle=0, keep=1)
    for step in steps:
        u = step.section.x2[-1] - step.section.x1[-1]
        assert abs(u) == pytest.approx(step.value, rel=1e-15)


def test_placing_a_state_keeps_the_centre_of_mass_and_nothing_moves_with_an_equal_stop():
    state = DAMPER.on_stop("A", x1=0.7, v1=0.1, v2=-3.0, phase=1.0)
    wider = replace(DAMPER, half_clearance=5.5)
    placed = carried(wider.mechanism, state, 0, "A", on_stop=True)
    mass = np.array([1.0, DAMPER.mass_ratio])
    assert placed.position[1] - placed.position[0] == pytest.approx(5.5, rel=1e-15)
    assert mass @ placed.position == pytest.approx(float(mass @ state.position), rel=1e-14)
    assert carried(DAMPER.mechanism, state, 0, "A", on_stop=True) is state


def test_a_function_of_the_parameter_can_be_followed():
    steps = sweep_attractor(
        bouncing_ball, None, [0.5, 0.4], vi.State((1.0,), (0.0,)), settle=10, keep=5, stop="B"
    )
    assert [len(step.section) for step in steps] == [5, 5]


@pytest.mark.parametrize("parameter", ["frequency", None])
def test_a_parameter_that_is_not_there_is_named(parameter):
    with pytest.raises(vi.InvalidParameterError, match="parameter"):
        sweep_attractor(DAMPER, parameter, [1.0], PLAIN)
