"""Sections: points lie on the stop, obey the law of impact, and carry over."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.simulation.sections import section_of_impacts, take_impacts
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
    section = vi.section(DAMPER, PLAIN, at=vi.AtStop(stop), points=300, settle_events=10)
    assert len(section) == 300
    u = section.x2 - section.x1
    assert np.abs(u - side * DAMPER.half_clearance).max() <= 2e-15 * 8.0  # |x| < 8: one ulp each
    assert np.all(side * (section.v2 - section.v1) < 0.0)
    assert np.all((section.phase >= 0.0) & (section.phase < 2.0 * math.pi))


def test_a_section_is_what_the_simulation_records_at_that_stop():
    run = vi.simulate(DAMPER, PLAIN, impacts=400)
    section = vi.section(DAMPER, PLAIN, points=100, settle_events=0)
    at_a = np.flatnonzero(run.impacts & (run.side == 1))[:100]
    assert np.array_equal(section.position, run.position[at_a])
    assert np.array_equal(section.velocity, run.velocity_after[at_a])
    assert np.array_equal(section.phase, run.phase[at_a])
    assert np.array_equal(section.time, run.time[at_a])


def test_settling_skips_that_many_impacts():
    run = vi.simulate(DAMPER, PLAIN, impacts=400)
    section = vi.section(DAMPER, PLAIN, points=20, settle_events=101)
    at_a = np.flatnonzero(run.side == 1)
    assert np.array_equal(section.x1, run.position[at_a[at_a >= 101][:20], 0])


def test_phases_follow_from_times():
    section = vi.section(DAMPER, PLAIN, points=500, settle_events=10)
    turned = section.phase[0] + DAMPER.omega * (section.time - section.time[0])
    # One ulp of omega t, some 500 periods, and as much for the comparison.
    assert np.abs(np.exp(1j * turned) - np.exp(1j * section.phase)).max() < 4e-12


def test_pieces_of_a_record_join_without_a_seam():
    whole = take_impacts(Simulator(CHATTERING, PLAIN), vi.AtStop(), 400)
    motion = Simulator(CHATTERING, PLAIN)
    parts = [motion.record(n) for n in (1, 7, 150, 3000)]
    joined = section_of_impacts(motion, vi.AtStop(), parts, 400, RunEnd.IMPACTS)
    assert np.array_equal(whole.position, joined.position)
    assert np.allclose(whole.time, joined.time, rtol=1e-15, atol=0.0)


def test_a_dataset_says_what_it_is():
    dataset = vi.section(DAMPER, PLAIN, points=5).to_dataset()
    assert dataset.sizes == {"point": 5, "coordinate": 2}
    assert dataset.attrs["at"] == "at stop A of contact 0"
    assert "omega=1.00314" in dataset.attrs["system"]


def test_arrays_are_read_only_and_the_last_state_goes_on():
    section = vi.section(DAMPER, PLAIN, points=50, settle_events=0)
    with pytest.raises(ValueError, match="read-only"):
        section.phase[0] = 0.0
    onward = vi.section(DAMPER, section.last, points=50, settle_events=0)
    direct = vi.section(DAMPER, PLAIN, points=100, settle_events=0)
    # The state goes through a phase in [0, 2 pi): one rounding, grown over 50 impacts.
    assert np.allclose(onward.position, direct.position[50:], rtol=0.0, atol=1e-9)


def test_a_one_sided_stop_of_any_mechanism_has_a_section():
    section = vi.section(bouncing_ball(), vi.State((1.0,), (0.0,)), at=vi.AtStop("B"), points=20)
    assert len(section) == 20
    assert np.abs(section.position).max() <= 4e-16  # one ulp of the forced response, 2 wide
    assert np.all(section.velocity >= 0.0)


def test_a_motion_that_stops_impacting_leaves_the_points_it_had():
    # A pendulum-like oscillator that touches its stop only at first.
    damped = vi.Mechanism(
        mass=[[1.0]], damping=[[0.4]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), lower=-0.5, restitution=0.9),),
    )  # fmt: skip
    section = vi.section(
        damped, vi.State((2.0,), (0.0,)), at=vi.AtStop("B"), points=100, settle_events=0
    )
    assert 1 <= len(section) < 100
    assert section.end is RunEnd.SILENT


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"points": 0}, "points = 0"),
        ({"settle_events": -1}, "settle_events = -1"),
        ({"at": vi.AtStop("C")}, "stop = 'C'"),  # type: ignore[arg-type]
        ({"at": vi.AtStop(contact=1)}, "contact = 1"),
        ({"at": "A"}, r"at = 'A': must be vi\.AtStop"),
        ({"at": vi.AtPhase(math.nan)}, "phase = nan"),
        ({"at": vi.AtPhase("x")}, "phase = 'x'"),  # type: ignore[arg-type]
        ({"points": 2.5}, "points = 2.5"),
    ],
)
def test_misuse_is_named(keywords, words):
    with pytest.raises(vi.InvalidParameterError, match=words):
        vi.section(DAMPER, PLAIN, **keywords)


def test_a_stop_that_is_not_there_is_refused():
    with pytest.raises(vi.InvalidParameterError, match="no such stop"):
        vi.section(bouncing_ball(), vi.State((1.0,), (0.0,)), at=vi.AtStop("A"))


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
    section = vi.section(system, start, at=vi.AtPhase(-1.0), points=40, settle_events=7)
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
    assert section.end is RunEnd.POINTS


def test_a_record_in_many_pieces_has_the_states_of_one(monkeypatch):
    whole = vi.section(DAMPER, PLAIN, at=vi.AtPhase(2.0), points=60, settle_events=5)
    monkeypatch.setattr("vibroimpact.simulation.simulator.CHUNK_EVENTS", 5)
    pieces = vi.section(DAMPER, PLAIN, at=vi.AtPhase(2.0), points=60, settle_events=5)
    np.testing.assert_array_equal(whole.position, pieces.position)
    np.testing.assert_array_equal(whole.velocity, pieces.velocity)


@pytest.mark.parametrize("phase", [0.0, 1.0, 4.5, -20.0])
@pytest.mark.parametrize("omega", [0.3, 1.7, 2.6])
def test_a_motion_without_impacts_has_the_closed_form_at_every_phase(omega, phase):
    """20000 periods without an event, which is longer than a run without impacts is followed."""
    system = oscillator(omega, 50.0)
    section = vi.section(system, vi.State((0.0,), (0.0,)), at=vi.AtPhase(phase), points=20_000)
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
    section = vi.section(system, orbit.state, at=vi.AtPhase(later), points=5, settle_events=3)
    np.testing.assert_allclose(section.v2, orbit.state.velocity[1], atol=1e-7)
    direct = vi.section(
        system, orbit.state, at=vi.AtPhase(orbit.state.phase), points=1, settle_events=0
    )
    assert direct.position[0] == pytest.approx(orbit.state.position)
    assert direct.velocity[0] == pytest.approx(orbit.state.velocity)


def test_a_stroboscopic_section_goes_on_from_its_last_state():
    whole = vi.section(DAMPER, PLAIN, at=vi.AtPhase(0.3), points=20, settle_events=0)
    first = vi.section(DAMPER, PLAIN, at=vi.AtPhase(0.3), points=10, settle_events=0)
    second = vi.section(DAMPER, first.last, at=vi.AtPhase(0.3), points=11, settle_events=0)
    np.testing.assert_allclose(second.position, whole.position[9:], atol=1e-10)


@pytest.mark.usefixtures("no_windows")
def test_a_stroboscopic_section_is_drawn_without_the_plus_of_impacts():
    section = vi.section(DAMPER, PLAIN, at=vi.AtPhase(), points=5)
    assert section.plot().get_ylabel() == r"$\dot x_{1}$"
    assert vi.section(DAMPER, PLAIN, points=5).plot().get_ylabel() == r"$\dot x_{1+}$"
    assert section.to_dataset().sizes == {"point": 5, "coordinate": 2}


def test_without_forcing_there_is_no_phase_to_look_at():
    free = vi.Mechanism(
        mass=[[1.0]], damping=[[0.4]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), lower=-0.5, restitution=0.9),),
    )  # fmt: skip
    with pytest.raises(vi.InvalidParameterError, match="no forcing"):
        vi.section(free, vi.State((2.0,), (0.0,)), at=vi.AtPhase())
