"""Orbits in which nothing happens, against the linear response in closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import vibroimpact as vi
from vibroimpact import InvalidParameterError
from vibroimpact.orbits.closing_segment import cycles_of

REST = vi.State((0.0,), (0.0,))
WALL = 4.0
FAR = vi.Mechanism(
    mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.8, (0.0,), (1.0,)),),
    elements=(vi.RigidStop((1.0,), lower=-WALL, upper=WALL, restitution=0.7),),
)  # fmt: skip
ONE_SIDED = replace(FAR, elements=(vi.RigidStop((1.0,), upper=WALL, restitution=0.7),))


def response(omega: float) -> complex:
    """x = Re(X exp(i omega t)) of x'' + 0.1 x' + x = cos(omega t)."""
    return 1.0 / complex(1.0 - omega**2, 0.1 * omega)


TOUCHES = [
    brentq(lambda w: abs(response(w)) - WALL, low, high, xtol=1e-15)
    for low, high in ((0.5, 0.99), (1.0, 2.0))
]


@pytest.mark.parametrize("m", [FAR, ONE_SIDED])
def test_a_motion_that_meets_nothing_is_the_linear_response(m: vi.Mechanism) -> None:
    orbit, omega = vi.find_orbit(m, vi.simulate(m, REST, impacts=5)), 0.8
    amplitude = response(omega)
    assert orbit.symbol == "1-0-0"
    assert orbit.symmetric == (m is FAR)
    assert orbit.stable
    assert orbit.period == pytest.approx(2.0 * math.pi / omega, rel=1e-15)
    # solved to rounding of the motion's size
    assert orbit.state.position[0] == pytest.approx(amplitude.real, abs=1e-13)
    assert orbit.state.velocity[0] == pytest.approx(-omega * amplitude.imag, abs=1e-13)
    assert orbit.clearance_to_grazing == pytest.approx(WALL - abs(amplitude), abs=1e-13)
    free = np.exp(np.roots([1.0, 0.1, 1.0]) * orbit.period)
    np.testing.assert_allclose(orbit.multipliers, np.sort_complex(free)[::-1], rtol=0.0, atol=1e-13)


def test_touches_on_its_branch_are_where_the_amplitude_is_the_clearance() -> None:
    orbit = vi.find_orbit(FAR, REST, stops="")
    branch = vi.continue_orbit(orbit, "forces[0].omega", (0.5, 0.9))
    (touch,) = branch.special_points
    assert touch.kind == "GR"
    assert touch.parameter == pytest.approx(TOUCHES[0], abs=1e-13)
    assert not branch.curve.unresolved


@pytest.mark.slow
def test_orbits_with_impacts_begin_at_its_touch_and_end_with_it() -> None:
    orbit = vi.find_orbit(ONE_SIDED, REST, stops="")
    touch = vi.continue_orbit(orbit, "forces[0].omega", (0.7, 0.9))["GR1"]
    begun = vi.switch_branch(touch, steps=vi.Steps(first=0.02, points=12))
    assert isinstance(begun, vi.Branch)
    assert begun.symbol == "1-1-0"
    speeds = begun.impact_speed
    assert speeds[0] < 1e-8  # the start is a touch, known to rounding, of which speeds are the root
    assert (np.diff(speeds) > 0.0).all()
    impacts = vi.continue_orbit(begun.orbit(-1), "forces[0].omega", (0.7, 0.95))
    zero = next(point for point in impacts.special_points if point.kind == "ZERO")
    again = vi.switch_branch(zero)
    assert isinstance(again, vi.Branch)
    assert again.symbol == "1-0-0"
    places = [point.parameter for point in again.special_points]
    assert min(abs(p - TOUCHES[0]) for p in places) < 1e-12


def test_a_motion_with_an_extremum_at_the_phase_zero_touches_there() -> None:
    """Without damping the response to a cosine is a cosine."""
    m = replace(ONE_SIDED, damping=[[0.0]])
    orbit = vi.find_orbit(m, REST, stops="")
    branch = vi.continue_orbit(orbit, "forces[0].omega", (0.8, 0.88))
    assert branch["GR1"].parameter == pytest.approx(math.sqrt(1.0 - 1.0 / WALL), abs=1e-13)


def test_a_machine_that_always_slips_has_the_response_of_its_linear_mode() -> None:
    belt = vi.Friction((1.0,), 0.3, belt_speed=5.0)
    m = replace(FAR, elements=(belt,))
    orbit = vi.find_orbit(m, REST)
    assert orbit.symbol == "1-0-0"
    amplitude = response(0.8)
    # friction pushes with 0.3 all the time, along the belt
    assert orbit.state.position[0] == pytest.approx(amplitude.real + 0.3, abs=1e-12)
    assert orbit.admissible
    slower = vi.continue_orbit(orbit, "elements[0].belt_speed", (1.0, 6.0))
    # slip ends to be of one sign where the largest speed is the belt's
    assert slower["GS1"].parameter == pytest.approx(0.8 * abs(amplitude), abs=1e-12)


def test_impacts_that_nearly_repeat_before_the_silence_are_not_taken_for_the_motion() -> None:
    """The free vibration from far off meets the stop some times, each a little more slowly than before."""
    m = replace(FAR, damping=[[0.02]], forces=(vi.Harmonic(2.0, (1.0,)),),
                elements=(vi.SoftStop((1.0,), upper=1.5, stiffness=0.1),))  # fmt: skip
    run = vi.simulate(m, vi.State((4.0,), (0.0,)), impacts=50, t_max=900.0)
    assert run.impacts.sum() >= 9
    orbit = vi.find_orbit(m, run)
    assert orbit.signature.eventless
    assert orbit.admissible


def test_a_free_mass_stays_where_its_motion_has_brought_it() -> None:
    """m x'' + c x' = sin t: it is anywhere below its stop, and goes round with the amplitude 1 / sqrt(1 + c^2)."""
    m = replace(FAR, damping=[[0.3]], stiffness=[[0.0]], forces=(vi.Harmonic(1.0, (1.0,)),),
                elements=(vi.RigidStop((1.0,), upper=0.5, restitution=0.6),))  # fmt: skip
    run = vi.simulate(m, vi.State((-5.0,), (0.0,)), t_max=200.0)
    orbit = vi.find_orbit(m, run)
    assert orbit.admissible
    assert orbit.family_dimension == 1
    late = run.at(200.0 - np.arange(400) * 2.0 * math.pi / 400.0)[0][:, 0]
    # the largest of 400 samples, and what is left of the start after 200 units of time
    middle = 0.5 * (late.max() + late.min())
    high = middle + 1.0 / math.sqrt(1.0 + 0.3**2)
    assert orbit.clearance_to_grazing == pytest.approx(0.5 - high, abs=1e-4)


def test_a_motion_has_the_cycles_in_which_all_its_lines_repeat() -> None:
    """One of 1.1 cycles of the first line was taken for one of a single cycle, which the second does not allow."""
    m = replace(ONE_SIDED, forces=(vi.Harmonic(0.8, (0.0,), (1.0,)), vi.Harmonic(0.4, (5.0,))))
    assert cycles_of(m, 1.1 * 2.0 * math.pi / 0.8) == 2
    assert cycles_of(m, 3.2 * 2.0 * math.pi / 0.8) == 4
    orbit = vi.find_orbit(m, REST)
    assert orbit.signature.cycles % 2 == 0
    assert orbit.admissible


def test_a_search_lists_the_linear_response_beside_orbits_with_impacts() -> None:
    search = vi.find_orbits(replace(ONE_SIDED, forces=(vi.Harmonic(0.872, (0.0,), (1.0,)),)),
                            most_cycles=1, most_impacts=2, starts=4)  # fmt: skip
    assert "1-0-0" in [orbit.symbol for orbit in search.orbits]


def test_a_free_vibration_and_a_guess_without_a_mode_are_refused() -> None:
    with pytest.raises(InvalidParameterError, match="without forcing"):
        vi.find_orbit(replace(FAR, forces=()), REST, stops="")
    guess = vi.Guess(np.zeros((1, 3)), np.ones(1))
    with pytest.raises(InvalidParameterError, match="Orbit, Run or State"):
        vi.find_orbit(FAR, guess, stops="")


def test_a_block_that_sticks_all_the_time_is_one_of_a_family_with_the_margin_of_its_force() -> None:
    """Of friction 3 the force cos t leaves 2 where the spring is slack, and 2 - 0.7 at the place 0.7."""
    m = replace(FAR, elements=(vi.Friction((1.0,), 3.0),))
    for place in (0.0, 0.7):
        orbit = vi.find_orbit(m, vi.State((place,), (0.0,)))
        assert orbit.state.position == pytest.approx((place,), abs=1e-15)
        assert orbit.family_dimension == 1
        assert orbit.multipliers.tolist() == [1.0, 0.0]
        assert orbit.clearance_to_grazing == pytest.approx(2.0 - place, abs=1e-12)
        assert orbit.admissible
        assert not orbit.stable
    with pytest.raises(InvalidParameterError, match="family"):
        vi.continue_orbit(orbit, "forces[0].omega", (0.7, 0.9))


def test_files_and_pictures_take_it(tmp_path: Path) -> None:
    orbit = vi.find_orbit(FAR, REST)
    vi.save(orbit, tmp_path / "orbit.nc")
    again = vi.load(tmp_path / "orbit.nc")
    assert again.signature == orbit.signature
    np.testing.assert_array_equal(again.states, orbit.states)
    orbit.plot()
    branch = vi.continue_orbit(orbit, "forces[0].omega", (0.78, 0.82))
    vi.save(branch, tmp_path / "branch.nc")
    assert vi.load(tmp_path / "branch.nc").symbol == "1-0-0"
    branch.plot()
    assert branch.to_dataframe().shape[0] == len(branch)
