"""Attractors of machines without stops, and of machines that advance."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.plotting import plot_section

REST = vi.State((0.0,), (0.0,))
PAIR = vi.State((0.0, 0.0), (0.0, 0.0))
FEW = {"settle_events": 100, "points": 100, "most_settle_events": 800}


def belt(force=0.0):
    """A block on a spring and a belt, forced or not."""
    forces = (vi.Harmonic(1.3, (force,)),) if force else ()
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.02]], stiffness=[[1.0]], forces=forces,
        elements=(vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.05),),
    )  # fmt: skip


def ram():
    """A ram that drives a slider, the soil, before it."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.2, 0.0], [0.0, 0.0]], stiffness=np.zeros((2, 2)),
        elements=(
            vi.SoftStop((1.0, -1.0), upper=0.05, stiffness=40.0, damping=0.8),
            vi.Friction((0.0, 1.0), 0.6),
        ),
        forces=(vi.Harmonic(1.0, (0.8, 0.0)),), constant_force=(0.2, 0.0),
    )  # fmt: skip


def capsule(damping):
    """A mass in a capsule that rubs on the ground."""
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    return vi.Mechanism(
        mass=np.diag([1.0, 3.0]), damping=damping * pair, stiffness=pair,
        elements=(
            vi.SoftStop((1.0, -1.0), upper=0.02, stiffness=27.0, damping=1.0),
            vi.Friction((0.0, 1.0), 0.4),
        ),
        forces=(vi.Harmonic(1.1, (1.0, 0.0)),),
    )  # fmt: skip


def test_stick_slip_without_force_is_periodic_with_two_changes_a_cycle():
    found = vi.classify(belt(), REST, **FEW)
    assert (found.label, found.shape.period) == ("0-0 periodic", 2)
    assert isinstance(found.section.at, vi.AtChange)
    orbit = vi.find_orbit(belt(), REST)
    cycle = found.section.time[-1] - found.section.time[-3]
    assert math.isclose(cycle, orbit.period, rel_tol=1e-12)


def test_a_forced_motion_without_impacts_has_the_symbol_of_its_orbit():
    found = vi.classify(belt(0.05), REST, **FEW)
    orbit = vi.find_orbit(belt(0.05), REST)
    assert (found.symbol, orbit.symbol) == ("3-0-0", "3-0-0")
    assert found.periods_per_point == pytest.approx(1.0, abs=1e-12)
    # log of the largest multiplier per period of the orbit
    largest = math.log(abs(orbit.multipliers[0])) / orbit.period
    assert found.exponent.value == pytest.approx(largest, abs=1e-6)


def test_a_machine_that_only_a_phase_switch_drives_is_classified():
    square = vi.Mechanism(
        mass=[[1.0]], damping=[[0.3]], stiffness=[[2.0]],
        elements=(vi.PhaseSwitch(1.0, (0.5, 2.0), ((1.0,), (0.0,))),),
    )  # fmt: skip
    found = vi.classify(square, REST, **FEW)
    assert found.label == "1-0-0 periodic"
    assert found.exponent.value == pytest.approx(-0.15, abs=1e-4)  # half the damping


def test_points_at_a_phase_count_the_impacts_between_them():
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    )
    start = vi.State((0.0, 0.0), (0.0, 1.0))
    at_stop, at_phase = (vi.classify(damper, start, at=at, **FEW) for at in (None, vi.AtPhase(1.0)))
    assert at_stop.symbol == at_phase.symbol == "1-1-1"
    assert at_phase.type == at_stop.type
    assert (at_phase.symmetric, at_phase.multipliers) == (None, None)
    assert np.allclose(at_phase.section.phase, 1.0)


def test_the_drift_of_a_mass_that_only_slides_is_its_balance_of_forces():
    force, friction, damping, omega = 0.5, 0.2, 0.4, 1.5
    sliding = vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[0.0]], constant_force=(force,),
        forces=(vi.Harmonic(omega, (0.3,)),), elements=(vi.Friction((1.0,), friction),),
    )  # fmt: skip
    found = vi.classify(sliding, vi.State((0.0,), (1.0,)), **FEW)
    assert found.label == "1-0-0 periodic, advancing"
    closed = 2.0 * math.pi / omega * (force - friction) / damping
    assert found.progress[0] == pytest.approx(closed, rel=1e-11)


@pytest.mark.slow
def test_a_pile_that_is_driven_is_periodic_with_the_progress_that_a_sweep_observes():
    found = vi.classify(ram(), PAIR, at=vi.AtPhase(0.0), **FEW)
    assert found.label == "1-1-0 periodic, advancing"
    seen = vi.sweep(
        ram(), over={"damping[0][0]": [0.2]}, start=PAIR, settle_periods=100, periods=50,
        observe="progress", progress=False,
    )  # fmt: skip
    assert np.allclose(found.progress, seen.x_progress.values[0], rtol=1e-9)
    places = found.section.relative
    assert np.ptp(places, axis=0).max() < 1e-9 < 100.0 < np.ptp(found.section.position[:, 1])
    axes = plot_section(found.section, drift=False)
    assert np.ptp(axes.lines[0].get_xdata()) < 1e-9
    assert axes.get_xlabel() == "$x_{1}$, less the drift"
    assert "drift" not in axes.get_ylabel() + plot_section(found.section).get_xlabel()


@pytest.mark.slow
def test_a_block_that_rubs_below_its_stop_has_points_at_a_phase():
    below = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.31, (0.9,)),),
        elements=(vi.RigidStop((1.0,), upper=0.95), vi.Friction((1.0,), 0.1)),
    )  # fmt: skip
    found = vi.classify(below, REST, **FEW)
    assert found.label == "1-0-0 periodic"
    assert isinstance(found.section.at, vi.AtPhase)


@pytest.mark.slow
def test_a_capsule_whose_friction_changes_often_is_classified_at_its_stop():
    found = vi.classify(capsule(0.3), PAIR, **FEW)
    assert found.label.startswith("1-1-0 periodic")
    assert isinstance(found.section.at, vi.AtStop)
    # The multipliers of the map of a period, without the drift, by differences of simulations.
    period, at = 2.0 * math.pi / 1.1, vi.section(capsule(0.3), PAIR, at=vi.AtPhase(), points=1).last

    def after_a_period(relative, *speeds):
        start = vi.State((relative, 0.0), speeds, at.phase)
        last = vi.simulate(capsule(0.3), start, t_max=period, impacts=1000).last
        return np.array([last.position[0] - last.position[1], *last.velocity])

    here, step = np.array([at.position[0] - at.position[1], *at.velocity]), 1e-6 * np.eye(3)
    columns = [(after_a_period(*here + h) - after_a_period(*here - h)) / 2e-6 for h in step]
    slow = sorted(np.linalg.eigvals(np.array(columns)), key=abs)[1:]
    assert np.allclose(sorted(found.multipliers[1:3], key=abs), slow, rtol=0.0, atol=1e-7)
    # Both bodies get on by the same.
    assert found.progress[0] == pytest.approx(found.progress[1], rel=1e-12)
    assert found.progress[0] > 0.3


@pytest.mark.parametrize(
    ("damping", "force", "label"),
    [
        (0.4, 0.0, "without impacts"),  # friction holds it where it stops
        (0.4, 0.1, "1-0-0 periodic"),  # it holds it against the force, too
        (-0.4, 0.0, "diverging"),
        (-0.4, 1.0, "diverging"),
    ],
)
def test_rest_and_growth_have_their_names(damping, force, label):
    rubs = vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[1.0]], elements=(vi.Friction((1.0,), 0.5),),
        forces=(vi.Harmonic(1.0, (force,)),) if force else (),
    )  # fmt: skip
    far = 20.0 if label == "diverging" else 0.2
    assert vi.classify(rubs, vi.State((far,), (0.0,)), **FEW).label == label


def test_a_machine_in_its_place_has_no_progress():
    found = vi.classify(belt(0.05), REST, **FEW)
    assert not found.progress.any()
    assert np.array_equal(found.section.relative, found.section.position)


@pytest.mark.parametrize(
    ("machine", "keywords", "words"),
    [
        (belt(), {"at": vi.AtPhase()}, "has no forcing"),
        (belt(0.05), {"at": vi.AtPhase(math.nan)}, "phase = nan"),
        (belt(0.05), {"at": vi.AtChange(1)}, "element = 1: must be 0"),
    ],
)
def test_a_section_that_is_not_there_is_refused(machine, keywords, words):
    with pytest.raises(vi.VibroImpactError, match=words):
        vi.classify(machine, REST, **keywords)


@pytest.mark.parametrize("omega", [0.7, 1.0, 1.3, 2.0])
def test_a_free_body_that_only_rubs_does_not_advance_by_rounding(omega: float) -> None:
    """Its motion is its own mirror image after half a period, so that it comes back."""
    body = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], forces=(vi.Harmonic(omega, (1.0,)),),
        elements=(vi.Friction((1.0,), 0.3),),
    )  # fmt: skip
    found = vi.classify(body, vi.State((0.0,), (0.3,)), settle_events=20, points=64)
    assert found.label == "1-0-0 periodic"
    assert found.progress.tolist() == [0.0]


def test_impacts_are_those_between_the_points_at_changes_of_state() -> None:
    block = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), upper=0.19, restitution=0.5),
                  vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.05)),
    )  # fmt: skip
    start = vi.State((0.0,), (0.0,))
    found = vi.classify(block, start, at=vi.AtChange(1), settle_events=20, points=64)
    run = vi.simulate(block, start, t_max=float(found.section.time[-1]), impacts=10**6)
    changes = run.time[np.flatnonzero(np.diff(run.all_states[:, 1]))]
    assert (changes < found.section.time[0]).sum() == 20
    between = run.impacts & (run.time >= found.section.time[0])
    assert 0 <= found.impacts - between.sum() <= 1  # and the one before the first point
