"""Orbits that rest on a rigid stop: after a plastic impact, or at the end of chatter."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact import InvalidParameterError
from vibroimpact.measures.motions import flights_of
from vibroimpact.orbits.find import Guess, primitive, rotated, solve
from vibroimpact.orbits.problem import Signature

PUSH = 1.3  # amplitude of the force that lifts the ball from the floor, its weight being 1


def ball(restitution: float) -> vi.Mechanism:
    """A ball on a floor: x'' = PUSH sin t - 1."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        forces=(vi.Harmonic(1.0, (PUSH,)),),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=restitution),),
    )  # fmt: skip


def two_masses(restitution: float, omega: float = 0.5) -> vi.Mechanism:
    """Two masses, of which one meets a floor."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.7]], damping=[[0.3, -0.1], [-0.1, 0.2]],
        stiffness=[[0.5, -0.4], [-0.4, 1.0]], constant_force=(-1.0, -0.2),
        forces=(vi.Harmonic(omega, (1.6, 0.3)),),
        elements=(vi.RigidStop((1.0, 0.0), lower=0.0, restitution=restitution),),
    )  # fmt: skip


@cache
def found(m: vi.Mechanism) -> vi.Orbit:
    """The orbit to which a motion settles."""
    start = vi.State((0.5,) * m.degrees, (0.0,) * m.degrees)
    return vi.find_orbit(m, vi.simulate(m, start, impacts=1500))


def phases_in_fifty_digits(restitution: float) -> list[float]:
    """Phases at which the ball is released, lands and is at rest again, its impacts solved one by one."""
    with mpmath.workdps(50):
        push, r, sin, cos = mpmath.mpf(PUSH), mpmath.mpf(restitution), mpmath.sin, mpmath.cos

        def mean_speed(t0: mpmath.mpf, v: mpmath.mpf, s: mpmath.mpf) -> mpmath.mpf:
            return v - s / 2 + push * (cos(t0) - (sin(t0 + s) - sin(t0)) / s)

        released = now = mpmath.asin(1 / push)
        speed, phases = mpmath.mpf(0), [released]
        step = mpmath.mpf(math.pi - 0.3)
        while len(phases) < 2 or speed > mpmath.mpf(10) ** -45:
            step = mpmath.findroot(lambda s, t0=now, v=speed: mean_speed(t0, v, s), step)
            speed = -r * (speed - step + push * (cos(now) - cos(now + step)))
            now += step
            if len(phases) == 1:
                phases.append(now)
            step = 2 * speed / (1 - push * sin(now))
        return [float(phase) for phase in (*phases, now)]


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_ball_that_rests_on_its_floor_has_the_phases_of_fifty_digits(restitution: float) -> None:
    orbit = found(ball(restitution))
    released, landed, at_rest = phases_in_fifty_digits(restitution)
    explicit = orbit.problem.compiled(0.0).explicit(
        orbit.states, orbit.durations, orbit.signature.ends
    )
    ends = explicit.states[:, -1] + explicit.durations
    first, begun = 2.0 * math.pi, float(explicit.states[0, -1])
    # rounding of phases up to 2 pi, over some fifty impacts
    assert begun % first == pytest.approx(landed, abs=1e-13)
    rest = next(k for k, end in enumerate(explicit.ends) if end.watch == -2)
    assert float(explicit.states[rest, -1]) % first == pytest.approx(at_rest, abs=1e-13)
    assert float(ends[rest]) % first == pytest.approx(released, abs=1e-13)
    assert orbit.stable
    assert orbit.multipliers.tolist() == [0.0, 0.0]  # rest forgets where it began
    assert orbit.symbol == ("1-0-inf" if restitution else "1-0-1")


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_multipliers_are_those_of_the_simulated_map(restitution: float) -> None:
    m = two_masses(restitution)
    orbit = found(m)
    compiled, long = orbit.problem.compiled(0.0), int(np.argmax(orbit.durations * (
        np.array(orbit.problem.modes) == 0)))  # fmt: skip
    middle = compiled.after(orbit.states[long], 0.5 * orbit.durations[long])

    def mapped(x: np.ndarray) -> np.ndarray:
        start = vi.State(tuple(x[:2]), tuple(x[2:]), middle[4])
        run = vi.simulate(m, start, t_max=orbit.period)
        return np.append(run.position[-1], run.velocity_after[-1])

    here, step = middle[:4], 1e-5
    np.testing.assert_allclose(mapped(here), here, rtol=0.0, atol=1e-13)
    slopes = [(mapped(here + step * e) - mapped(here - step * e)) / (2.0 * step) for e in np.eye(4)]
    # differences are good to step^2 and 1e-15 / step
    wanted, got = np.poly(np.array(slopes).T), np.poly(orbit.multipliers)
    np.testing.assert_allclose(got, wanted, rtol=0.0, atol=1e-8)
    assert orbit.zero_multipliers == 2
    assert abs(orbit.multipliers[0]) > 0.05


def test_flights_of_chatter_move_with_a_parameter_as_those_of_neighbouring_orbits() -> None:
    step = 1e-5
    here = flights_of(found(two_masses(0.4)), "omega")
    less, more = (flights_of(found(two_masses(0.4, 0.5 + s))) for s in (-step, step))
    assert len(here.durations) > 25  # impacts, one by one
    slopes = (more.durations - less.durations) / (2.0 * step)
    # two orbits, each good to 1e-12 of its sizes, over 2 step
    np.testing.assert_allclose(here.durations_by, slopes, rtol=1e-7, atol=1e-7)
    speeds = (more.states - less.states)[:, 2:4] / (2.0 * step)
    np.testing.assert_allclose(here.states_by[:, 2:4], speeds, rtol=1e-7, atol=1e-7)


def test_a_branch_passes_through_rest_and_chatter() -> None:
    branch = vi.continue_orbit(found(two_masses(0.4)), "omega", (0.4999, 0.5001))
    for k in (0, len(branch) - 1):
        there = found(two_masses(0.4, float(branch.values[k])))
        assert branch.orbit(k).period == pytest.approx(there.period, rel=1e-13)
        np.testing.assert_allclose(
            branch.multipliers[k][:2], there.multipliers[:2], rtol=0.0, atol=1e-10
        )


def test_a_search_lists_the_resting_orbit_once() -> None:
    search = vi.find_orbits(ball(0.3), most_cycles=1, most_impacts=3, starts=4)
    assert [orbit.symbol for orbit in search.orbits] == ["1-0-inf"]


def test_a_search_lists_one_orbit_for_all_parts_of_its_chatter() -> None:
    ball_on_table = vi.machines.BouncingBall(amplitude=1.3, restitution=0.5)
    search = vi.find_orbits(ball_on_table, most_cycles=1, most_impacts=8, starts=8)
    chattering = [orbit.signature for orbit in search.orbits if orbit.symbol == "1-0-inf"]
    assert len(chattering) == 1


def test_the_signature_of_chatter_does_not_depend_on_the_first_event() -> None:
    orbit = found(vi.machines.BouncingBall(amplitude=1.3, restitution=0.5).mechanism)
    assert orbit.symbol == "1-0-inf"
    for first in range(len(orbit.durations)):
        again = primitive(rotated(orbit, first))
        assert again.converged
        assert again.signature == orbit.signature


@pytest.mark.parametrize("stops", [None, "A"])
def test_a_rest_in_the_transient_is_no_part_of_the_orbit(stops: str | None) -> None:
    """From rest on the stop, at a phase at which the force presses."""
    stop = vi.RigidStop((1.0,), upper=0.0, restitution=0.7)
    m = vi.Mechanism(mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], elements=(stop,),
                     forces=(vi.Harmonic(0.8, (0.0,), (1.0,)),))  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), impacts=500)
    assert run.status[0] == vi.Status.STICK
    assert (run.status[-400:] == vi.Status.IMPACT).all()
    orbit = vi.find_orbit(m, run, stops=stops)
    assert orbit.converged, orbit.status


def test_rest_after_an_impact_that_leaves_the_stop_is_no_motion() -> None:
    plastic = found(ball(0.0))
    guess = Guess(plastic.states, plastic.durations)
    bouncing = solve(ball(0.2), plastic.signature, guess)
    assert not bouncing.admissible


def test_a_signature_with_a_release_takes_no_symmetry() -> None:
    plastic = vi.RigidStop((1.0,), -1.0, 1.0, restitution=0.0)
    both = replace(ball(0.0), constant_force=(), elements=(plastic,))
    impacts, flights = found(ball(0.0)).signature.impacts, found(ball(0.0)).signature.flights
    halves = Signature((impacts[0], impacts[0].opposite), 1, True, flights)
    with pytest.raises(InvalidParameterError, match="rest on a stop are solved as a whole"):
        solve(both, halves, Guess(np.zeros((1, 3)), np.ones(1)))


def test_a_file_keeps_an_orbit_that_rests(tmp_path: Path) -> None:
    orbit = found(two_masses(0.4))
    vi.save(orbit, tmp_path / "orbit.nc")
    again = vi.load(tmp_path / "orbit.nc")
    assert again.signature == orbit.signature
    np.testing.assert_array_equal(again.multipliers, orbit.multipliers)
