"""Sections at changes of state: closed forms of stick-slip, and the events of the run."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import vibroimpact as vi

REST = vi.State((0.0,), (0.0,))
KINETIC, STATIC, SPEED = 0.1, 0.2, 0.05


def belt(damping=0.0, speed=SPEED, **more):
    """A block on a spring and a belt; it drives itself."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[1.0]],
        elements=(vi.Friction((1.0,), KINETIC, STATIC, belt_speed=speed),), **more,
    )  # fmt: skip


def test_a_block_on_a_belt_slips_and_sticks_where_the_closed_form_says():
    leaves = vi.section(belt(), REST, at=vi.AtChange(takes="backward"), points=20, settle_events=3)
    sticks = vi.section(
        belt(), REST, at=vi.AtChange(takes=vi.FrictionState.STICK), points=20, settle_events=3
    )
    # It leaves at static, swings about kinetic, and is caught as far on the other side, at 0.
    assert np.allclose(leaves.x1, STATIC, rtol=0.0, atol=1e-14)
    assert np.allclose(sticks.x1, 2.0 * KINETIC - STATIC, rtol=0.0, atol=1e-14)
    assert np.allclose(leaves.v1, SPEED, rtol=0.0, atol=1e-15)
    drop = STATIC - KINETIC
    period = 2.0 * drop / SPEED + 2.0 * (math.pi - math.atan2(drop, SPEED))
    assert np.allclose(np.diff(leaves.time), period, rtol=1e-13)


def test_without_a_state_every_change_is_a_point():
    both = vi.section(belt(), REST, at=vi.AtChange(), points=40, settle_events=5)
    run = vi.simulate(belt(), REST, t_max=400.0)
    states = run.all_states[:, 0]
    changes = np.flatnonzero(np.diff(states))[5:45]
    assert np.array_equal(both.time, run.time[changes])
    assert np.array_equal(both.position, run.position[changes])
    assert np.array_equal(both.state, states[1:][changes])
    assert both.end is vi.RunEnd.POINTS


def test_events_of_other_elements_are_no_points():
    beside = vi.SoftStop((1.0,), lower=-0.05, upper=0.1, stiffness=2.0)
    machine = replace(belt(forces=(vi.Harmonic(1.3, (0.2,)),)), elements=(*belt().elements, beside))
    both = vi.section(machine, REST, at=vi.AtChange(), points=40, settle_events=5)
    run = vi.simulate(machine, REST, t_max=400.0)
    states = run.all_states[:, 0]
    changes = np.flatnonzero(np.diff(states))
    assert changes.size < 0.7 * len(run)
    assert np.array_equal(both.time, run.time[changes[5:45]])


def test_points_across_the_seams_of_the_record_are_those_of_the_run():
    # More events than one part of the record holds, and points on either side of its end.
    forced = belt(0.01, forces=(vi.Harmonic(1.3, (0.05,)),))
    section = vi.section(
        forced, REST, at=vi.AtChange(takes="stick"), points=1500, settle_events=1000
    )
    run = vi.simulate(forced, REST, t_max=float(section.time[-1]) + 50.0, impacts=10)
    states = run.all_states[:, 0]
    begins = np.flatnonzero((states[1:] == 2) & (states[:-1] != 2))[1000:2500]
    assert begins[0] < 4096 < begins[-1]
    assert np.array_equal(section.time, run.time[begins])
    assert np.array_equal(section.phase, run.phase[begins])


def test_a_change_that_an_impact_elsewhere_brings_about_is_a_point():
    # The wall reverses a mass that rubs on the ground: its friction turns at the impact.
    hit = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.RigidStop((1.0,), upper=1.0, restitution=0.5), vi.Friction((1.0,), 0.1)),
    )  # fmt: skip
    section = vi.section(
        hit, vi.State((0.0,), (2.0,)), at=vi.AtChange(1, "backward"), points=1, settle_events=0
    )
    assert section.x1.tolist() == [1.0]
    assert math.isclose(section.v1[0], -0.5 * math.sqrt(4.0 - 2.0 * 0.1), rel_tol=1e-14)


def test_a_soft_stop_that_lets_go_is_a_section_without_force():
    k, c = 29.0, 1.0
    soft = vi.Mechanism(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]], forces=(vi.Harmonic(0.8, (0.6,)),),
        elements=(vi.SoftStop((1.0,), upper=0.6, stiffness=k, damping=c),),
    )  # fmt: skip
    section = vi.section(
        soft, REST, at=vi.AtChange(takes="behind_upper"), points=30, settle_events=10
    )
    force = k * (section.x1 - 0.6) + c * section.v1
    assert np.abs(force).max() < 1e-13
    assert section.x1.min() > 0.6


def test_phases_of_a_switch_are_a_section_of_a_machine_that_only_it_drives():
    square = vi.Mechanism(
        mass=[[1.0]], damping=[[0.3]], stiffness=[[2.0]],
        elements=(vi.PhaseSwitch(1.0, (0.5, 2.0), ((1.0,), (0.0,))),),
    )  # fmt: skip
    section = vi.section(square, REST, at=vi.AtChange(takes="arc_1"), points=10, settle_events=60)
    strobe = vi.section(square, REST, at=vi.AtPhase(2.0), points=10, settle_events=60)
    assert np.allclose(section.phase, 2.0, rtol=0.0, atol=1e-12)
    assert np.allclose(section.position, strobe.position, rtol=0.0, atol=1e-12)


def test_a_motion_that_keeps_its_state_leaves_the_points_it_had():
    # Beyond a speed of the belt the block only slips, towards x = kinetic.
    damped = vi.section(belt(0.4, speed=1.0), REST, at=vi.AtChange(), points=9, settle_events=0)
    assert len(damped) < 9
    assert damped.end is vi.RunEnd.SILENT
    assert "friction 0 changes" in repr(damped)


def test_the_last_state_goes_on_and_arrays_are_read_only():
    forced = belt(0.01, forces=(vi.Harmonic(1.3, (0.05,)),))
    whole = vi.section(forced, REST, at=vi.AtChange(takes="stick"), points=8, settle_events=0)
    first = vi.section(forced, REST, at=vi.AtChange(takes="stick"), points=5, settle_events=0)
    onward = vi.section(
        forced, first.last, at=vi.AtChange(takes="stick"), points=3, settle_events=0
    )
    assert np.allclose(onward.position, whole.position[5:], rtol=0.0, atol=1e-12)
    with pytest.raises(ValueError, match="read-only"):
        whole.state[0] = 0


def test_a_dataset_says_which_change_it_is():
    dataset = vi.section(
        belt(), REST, at=vi.AtChange(takes="stick"), points=4, settle_events=0
    ).to_dataset()
    assert dataset.sizes == {"point": 4, "coordinate": 1}
    assert dataset.attrs["at"] == "where friction 0 takes STICK"


@pytest.mark.parametrize(
    ("at", "words"),
    [
        (vi.AtChange(1), "element = 1: must be 0"),
        (vi.AtChange(True), "element = True"),
        (vi.AtChange(takes="upper"), '"forward", "backward", "stick"'),
        (vi.AtChange(takes="lifted"), '"forward", "backward", "stick"'),
        (vi.AtChange(takes=vi.SoftStopState.OPEN), "a state of friction 0"),
        (vi.AtStop(), r"Take vi\.AtChange\(0\)"),
        (vi.AtPhase(), r"Take vi\.AtChange\(\)"),
    ],
)
def test_what_the_machine_does_not_have_is_refused_with_what_it_has(at, words):
    with pytest.raises(vi.VibroImpactError, match=words):
        vi.section(belt(), REST, at=at)


def test_the_usual_place_is_what_the_machine_has_first():
    ball = vi.RigidStop((1.0,), lower=0.0)
    fallen = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]], elements=(ball,))
    pushed = replace(belt(), forces=(vi.Harmonic(1.3, (0.2,)),))
    for machine, at in [
        (fallen, vi.AtStop("B")), (pushed, vi.AtPhase()), (belt(), vi.AtChange()),
    ]:  # fmt: skip
        assert vi.section(machine, vi.State((0.1,), (0.0,)), points=1, settle_events=0).at == at


def test_a_section_at_changes_is_drawn_without_the_sign_of_impacts():
    axes = vi.section(belt(), REST, at=vi.AtChange(takes="stick"), points=4, settle_events=0).plot()
    assert "+" not in axes.get_ylabel()
    assert len(axes.lines[0].get_xdata()) == 4
