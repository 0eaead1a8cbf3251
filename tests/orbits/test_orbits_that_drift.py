"""Orbits that close but for a displacement of the whole machine: a capsule that creeps on."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.branches.same_orbit import loop_of, same_loop
from vibroimpact.orbits.find import rotated
from vibroimpact.orbits.near_returns import KnownLoops
from vibroimpact.orbits.problem import resisted_translations

CAPSULE = vi.machines.VibroImpactCapsule()
START = vi.State((0.0, 0.0), (0.0, 0.0))


@cache
def creeping(omega: float = 1.1) -> vi.Orbit:
    capsule = replace(CAPSULE, omega=omega)
    return vi.find_orbit(capsule, vi.simulate(capsule, START, impacts=200))


def simulated_progress(omega: float) -> float:
    """Mean advance of the capsule per forcing period over 20 periods of the motion on its orbit."""
    turn = 2.0 * math.pi / omega
    run = vi.simulate(replace(CAPSULE, omega=omega), creeping(omega).state, t_max=20.5 * turn)
    places = run.at(np.array([0.0, 20.0]) * turn)[0]
    return float(places[1, 1] - places[0, 1]) / 20.0


def test_a_capsule_advances_as_in_simulation() -> None:
    orbit = creeping()
    assert orbit.symbol == "1-1-0"
    assert orbit.stable
    assert orbit.family_dimension == 0
    np.testing.assert_allclose(orbit.progress, simulated_progress(1.1), rtol=0.0, atol=1e-10)
    assert orbit.progress[0] > 0.2


def test_a_block_that_is_pushed_off_and_brakes_advances_by_its_closed_form() -> None:
    """m x'' = F sin t - c x' + B: the mean speed is B / c, the progress 2 pi B / c a period."""
    m = vi.Mechanism(  # beside another mass, far from its stop
        mass=np.eye(2).tolist(), damping=[[0.3, 0.0], [0.0, 0.2]], stiffness=[[0.0, 0.0], [0.0, 1.0]],
        constant_force=(0.06, 0.0), forces=(vi.Harmonic(1.0, (0.5, 0.0)),),
        elements=(vi.RigidStop((0.0, 1.0), upper=5.0),),
    )  # fmt: skip
    orbit = vi.find_orbit(m, START, stops="")
    np.testing.assert_allclose(orbit.progress, [2.0 * math.pi * 0.06 / 0.3, 0.0], rtol=1e-12)
    braked = math.exp(-0.3 * 2.0 * math.pi)
    assert len(orbit.multipliers) == 3
    assert np.abs(orbit.multipliers - braked).min() < 1e-13
    branch = vi.continue_orbit(orbit, "constant_force[0]", (-0.05, 0.1))
    (still,) = branch.special_points
    assert still.kind == "STILL"
    assert abs(still.parameter) < 1e-14


def test_its_multipliers_are_those_of_the_simulated_relative_motion() -> None:
    orbit, turn = creeping(), 2.0 * math.pi / 1.1
    start = vi.simulate(CAPSULE, orbit.state, t_max=0.3 * orbit.period)
    here = np.append(start.position[-1], start.velocity_after[-1])
    phase = float(orbit.state.phase) + 1.1 * float(start.time[-1])

    def mapped(y: np.ndarray) -> np.ndarray:
        state = vi.State((here[1] + y[0], here[1]), (y[1], y[2]), phase)
        run = vi.simulate(CAPSULE, state, t_max=turn)
        x, v = run.position[-1], run.velocity_after[-1]
        return np.array([x[0] - x[1], *v])

    y, step = np.array([here[0] - here[1], here[2], here[3]]), 1e-6
    np.testing.assert_allclose(mapped(y), y, rtol=0.0, atol=1e-11)
    slopes = [(mapped(y + step * e) - mapped(y - step * e)) / (2.0 * step) for e in np.eye(3)]
    if here[3] == 0.0:  # the capsule sticks: its speed is no state
        slopes[2] = np.zeros(3)
    wanted, got = np.poly(np.array(slopes).T), np.poly(orbit.multipliers)
    np.testing.assert_allclose(got, wanted, rtol=0.0, atol=1e-7)


def test_all_maps_leave_the_drift_out_alike() -> None:
    orbit = creeping()
    wanted = np.poly(orbit.multipliers)
    for one in (vi.full_map(orbit), vi.stroboscopic_map(orbit, 0.4)):
        np.testing.assert_allclose(
            np.poly(np.linalg.eigvals(one.jacobian())), wanted, rtol=0.0, atol=1e-11
        )


def test_the_least_progress_along_a_branch_is_a_special_point() -> None:
    branch = vi.continue_orbit(creeping(), "omega", (1.0, 1.15))
    (peak,) = branch.special_points
    assert peak.kind == "PEAK"
    w = peak.parameter
    less, here, more = (simulated_progress(omega) for omega in (w - 1e-3, w, w + 1e-3))
    assert here < min(less, more)
    # the lowest point of the parabola through them, which a third derivative moves by some 1e-6
    assert abs(1e-3 * (less - more) / (less - 2.0 * here + more)) < 4e-6
    k = len(branch) // 3
    wanted = simulated_progress(float(branch.values[k]))
    np.testing.assert_allclose(branch.progress[k], wanted, rtol=0.0, atol=1e-9)


def test_files_keep_the_progress(tmp_path: Path) -> None:
    branch = vi.continue_orbit(creeping(), "omega", (1.09, 1.11))
    vi.save(branch, tmp_path / "branch.nc")
    np.testing.assert_array_equal(vi.load(tmp_path / "branch.nc").progress, branch.progress)
    assert "progress" in branch.to_dataset()


@pytest.mark.slow
def pushed(push: float, tilt: float) -> vi.Mechanism:
    """x'' = 0.5 sin t - 0.3 x' + push - tilt^2, beside another mass, far from its stop."""
    return vi.Mechanism(
        mass=np.eye(2).tolist(), damping=[[0.3, 0.0], [0.0, 0.2]], stiffness=[[0.0, 0.0], [0.0, 1.0]],
        constant_force=(push - tilt * tilt, 0.0), forces=(vi.Harmonic(1.0, (0.5, 0.0)),),
        elements=(vi.RigidStop((0.0, 1.0), upper=5.0),),
    )  # fmt: skip


def test_a_block_stands_still_along_the_curve_on_which_its_forces_balance() -> None:
    m = vi.Family(pushed, push=0.1, tilt=0.2)
    branch = vi.continue_orbit(vi.find_orbit(m, START, stops=""), "push", (0.03, 0.11))
    curve = vi.continue_bifurcation(
        branch["STILL1"], ("push", "tilt"), ((0.03, 0.06), (0.18, 0.22))
    )
    push, tilt = curve.values.T
    assert np.ptp(tilt) == pytest.approx(0.04)
    np.testing.assert_allclose(push, tilt**2, rtol=0.0, atol=1e-12)


@pytest.mark.slow
def test_period_doublings_of_a_capsule_in_two_parameters_are_those_of_its_branches() -> None:
    bounds = (0.01, 0.1)
    first = vi.continue_orbit(creeping(), "damping", (0.01, 0.1), inadmissible=True)
    curve = vi.continue_bifurcation(first["PD1"], ("damping", "gap"), (bounds, (0.01, 0.021)))
    damping, gap = curve.values[np.argmin(curve.values[:, 1])]
    assert gap == pytest.approx(0.01)
    other = replace(CAPSULE, gap=float(gap))
    orbit = vi.find_orbit(other, vi.simulate(other, START, impacts=200))
    again = vi.continue_orbit(orbit, "damping", bounds, inadmissible=True)
    assert again["PD1"].parameter == pytest.approx(damping, abs=1e-11)


def test_a_search_lists_an_orbit_that_drifts_once_wherever_the_capsule_is() -> None:
    found = vi.find_orbits(CAPSULE, most_cycles=1, most_impacts=2, starts=3)
    (orbit,) = (o for o in found.orbits if o.stable)
    np.testing.assert_allclose(orbit.progress, creeping().progress, rtol=1e-9)
    np.testing.assert_allclose(
        np.poly(orbit.multipliers), np.poly(creeping().multipliers), rtol=0.0, atol=1e-9
    )
    known = KnownLoops(np.ones(4), resisted_translations(orbit.mechanism))
    known.add(orbit.signature, orbit.states)
    for k in range(len(orbit.durations)):  # begun at another event, a hundred lengths farther
        turned = rotated(orbit, k)
        moved = turned.states + np.array([100.0, 100.0, 0.0, 0.0, 0.0])
        assert known.has(turned.signature, moved, 1e-9)
        same = loop_of(turned)
        assert same_loop(loop_of(orbit), same, orbit.mechanism, 1e-9) == "same"
