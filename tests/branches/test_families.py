"""Orbits that come in families, and motions that have no orbit: against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.periodic import coco, damper_orbits, orbits_of_chains
from support.systems import oscillator, random_symmetric

import vibroimpact as vi
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.orbits.problem import Signature
from vibroimpact.orbits.search import find_orbits

# Newton's method ends within some hundred roundings of the largest coordinate.
SOLVED = 1e-11
# A run of 2000 impacts drifts along a family of orbits, in each flight by up to 71 times 4 ulp.
DRIFTED = 1e-10
DOUBLE = 1e-6  # a double multiplier is known to the root of rounding


def ball(gravity: float, restitution: float = 1.0, floor: float = 0.0) -> vi.Mechanism:
    """A ball above a floor."""
    return oscillator(stiffness=0.0, damping=0.0, constant_force=-gravity, lower=floor,
                      upper=math.inf, restitution=restitution)  # fmt: skip


# ---- families ------------------------------------------------------------------------------------


@given(
    gravity=st.floats(0.1, 10.0),
    height=st.floats(0.1, 10.0),
    floor=st.sampled_from([0.0, -3.0, 2.0]),
    unit=st.sampled_from([1e-6, 1.0, 1e6]),
)
@settings(max_examples=30, deadline=None)
def test_a_lossless_ball_bounces_for_ever_from_any_height(
    gravity: float, height: float, floor: float, unit: float
) -> None:
    """Height h: period 2 sqrt(2 h / g), speed sqrt(2 g h)."""
    system = ball(gravity * unit, floor=floor * unit)
    orbit = vi.find_orbit(system, vi.State(((floor + height) * unit,), (0.0,)))
    assert orbit.converged
    assert orbit.period == pytest.approx(2.0 * math.sqrt(2.0 * height / gravity), rel=DRIFTED)
    speed = math.sqrt(2.0 * gravity * height) * unit
    assert orbit.least_impact_speed == pytest.approx(speed, rel=DRIFTED)
    assert orbit.multipliers == pytest.approx([1.0], abs=SOLVED)
    assert orbit.determinant_error <= SOLVED
    assert orbit.family_dimension == 1
    assert orbit.admissible
    assert not orbit.stable
    assert "neutral" in repr(orbit)
    assert "one of a 1-parameter family" in repr(orbit)


@pytest.mark.parametrize("name", ["constant_force[0]", "elements[0].restitution"])
def test_orbits_of_a_family_are_no_branch(name: str) -> None:
    orbit = vi.find_orbit(ball(1.0), vi.State((0.5,), (0.0,)))
    with pytest.raises(vi.InvalidParameterError, match="one of a 1-parameter family"):
        vi.continue_orbit(orbit, name, (-2.0, 1.0))


@given(turn=st.floats(0.2, 2.9), stiffness=st.floats(0.1, 100.0))
@settings(max_examples=30, deadline=None)
def test_a_lossless_oscillator_has_an_orbit_for_every_energy(turn: float, stiffness: float) -> None:
    """x = cos(w t - a) / cos a leaves x = 1 at w t = 2 a; turn is half the angle of the flight."""
    omega, wall = math.sqrt(stiffness), -math.cos(turn)
    if abs(wall) < 0.05:
        return
    system = oscillator(stiffness=stiffness, damping=0.0, lower=-math.inf, upper=wall,
                        restitution=1.0)  # fmt: skip
    orbit = vi.find_orbit(system, vi.State((-1.0,), (0.0,)))
    assert orbit.converged
    assert orbit.period == pytest.approx(2.0 * turn / omega, rel=DRIFTED)
    assert orbit.multipliers == pytest.approx([1.0], abs=SOLVED)
    assert orbit.family_dimension == 1


@pytest.mark.parametrize("off", [1e-12, 1e-6, 1e-3, 0.05])
def test_the_member_found_is_the_one_next_to_the_guess(off: float) -> None:
    """Of the orbits with t = 2 v / g: a guess off by a share leads nowhere farther than that."""
    rng = np.random.default_rng(5)
    for _ in range(10):
        v, gravity = rng.uniform(0.5, 2.0, 2)
        wrong = 1.0 + off * rng.uniform(-1.0, 1.0, 2)
        guess = vi.Guess(np.array([[0.0, v * wrong[0], 0.0]]), np.array([2.0 * v / gravity]))
        guess.durations[:] *= wrong[1]
        orbit = vi.find_orbit(ball(gravity), guess, stops=["B"], cycles=0)
        assert orbit.converged
        assert orbit.period == pytest.approx(2.0 * orbit.states[0, 1] / gravity, rel=SOLVED)
        assert orbit.states[0, 1] == pytest.approx(v, rel=2.0 * off + SOLVED)


def box(sides: int) -> vi.Mechanism:
    """A free particle between elastic walls at -1 and 1."""
    rows = np.eye(sides)
    zero = np.zeros((sides, sides))
    walls = tuple(vi.RigidStop(tuple(row), -1.0, 1.0, 1.0) for row in rows)
    return vi.Mechanism(mass=rows, damping=zero, stiffness=zero, elements=walls)


@pytest.mark.parametrize(
    ("place", "velocity", "dimension"),
    # the speed; in a box of rational slope also the distance of parallel paths
    [((0.0,), (1.5,), 1), ((0.0, 0.2), (1.0, 2.0), 2), ((0.1, 0.2, -0.45), (1.0, 2.0, 1.0), 3)],
)
def test_a_billiard_in_a_box_has_families_of_orbits(
    place: tuple[float, ...], velocity: tuple[float, ...], dimension: int
) -> None:
    """Side i takes the time 4 / v_i there and back: with v = (1, 2) both are back after 4."""
    orbit = vi.find_orbit(box(len(place)), vi.State(place, velocity))
    assert orbit.converged
    assert orbit.period == pytest.approx(4.0 / min(velocity), rel=DRIFTED)
    assert orbit.family_dimension == dimension
    assert orbit.multipliers == pytest.approx(np.ones(2 * len(place) - 1), abs=DOUBLE**0.5)
    assert orbit.admissible


def test_two_elastic_masses_have_a_family() -> None:
    """Energy is the one integral: the multipliers are 1 and a pair mu, 1 / mu."""
    system = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=[[2.0, -1.0], [-1.0, 2.0]],
        elements=(vi.RigidStop((-1.0, 1.0), lower=-0.5, restitution=1.0),),
    )  # fmt: skip
    orbit = vi.find_orbit(system, vi.State((0.0, 0.0), (1.0, -1.0)))
    assert orbit.converged
    assert orbit.family_dimension == 1
    assert np.abs(orbit.multipliers - 1.0).min() <= 1e-9
    assert orbit.determinant_error <= 1e-9


def test_a_forced_mechanism_that_is_fixed_nowhere_has_one_for_every_place() -> None:
    system = vi.Mechanism(
        mass=np.eye(2), damping=[[0.1, -0.1], [-0.1, 0.1]], stiffness=[[1.0, -1.0], [-1.0, 1.0]],
        forces=(vi.Harmonic(1.1, (1.0, -1.0)),),
        elements=(vi.RigidStop((-1.0, 1.0), lower=-0.5, restitution=0.7),),
    )  # fmt: skip
    orbit = vi.find_orbit(system, vi.State((5.0, 5.0), (0.0, 0.0)))
    assert orbit.converged
    assert orbit.family_dimension == 1
    assert orbit.states[:, :2].sum(axis=1) == pytest.approx(10.0, abs=1e-9)  # the centre stays
    assert not orbit.stable


@pytest.mark.slow
def test_an_isolated_orbit_is_in_no_family() -> None:
    assert {orbit.family_dimension for orbit in [*orbits_of_chains(), *damper_orbits()]} == {0}


@pytest.mark.slow
def test_folds_and_branch_points_are_no_families() -> None:
    """Their Jacobian is singular too, but no orbit is next to them at the same parameter."""
    start = vi.symmetric_orbits(vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    ))[0]  # fmt: skip
    points = vi.continue_orbit(start, "omega", (0.3, 1.5)).special_points
    singular = [point for point in points if point.kind in ("SN", "BP")]
    assert singular
    for point in singular:
        assert np.abs(point.orbit.multipliers - 1.0).min() <= 1e-3
        assert point.orbit.family_dimension == 0
        again = vi.find_orbit(point.orbit.system, point.orbit)
        assert again.converged  # though rounding moves it by the root of rounding
        assert again.residual <= 1e-12


def test_a_search_lists_one_member_of_a_family() -> None:
    search = find_orbits(ball(1.0), starts=5, most_impacts=2)
    assert len(search) == 1
    assert search.orbits[0].family_dimension == 1


# ---- where there is no orbit ---------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.one_in(3)
def test_without_forcing_no_lossy_impact_is_part_of_an_orbit(seed: int) -> None:
    """Energy falls at every impact and rises nowhere."""
    rng = np.random.default_rng(seed)
    n = 1 + seed % 3
    system = vi.Mechanism(
        mass=np.eye(n) + random_symmetric(rng, n, n),
        damping=(seed % 2) * 0.1 * random_symmetric(rng, n, n),
        stiffness=random_symmetric(rng, n, n) + 0.1 * np.eye(n),
        elements=(vi.RigidStop(tuple(rng.normal(size=n)), lower=float(rng.uniform(-0.3, 0.3)),
                             restitution=float(rng.uniform(0.1, 0.9))),),
    )  # fmt: skip
    row = np.array(system.rigid_stops[0].row)
    place = row / (row @ row) * (system.rigid_stops[0].lower + 1.0)
    start = vi.State(tuple(place), tuple(rng.normal(size=n)))
    guess = vi.Guess(np.array([[*place, *rng.normal(size=n), 0.0]]), np.array([2.0]))
    for orbit in (
        vi.find_orbit(system, start),
        vi.find_orbit(system, guess, stops=["B"], cycles=0),
    ):
        if orbit.converged:  # an undamped motion that only touches the stop loses nothing
            assert not seed % 2
            assert orbit.least_impact_speed <= 1e-6
        else:
            assert "every impact loses energy" in orbit.status


def test_a_flight_that_shrinks_to_nothing_is_rest_and_no_orbit() -> None:
    """v = 0, t = 0 solves the equations of every autonomous system on its stop, as rest does."""
    for wall, v, t in ((0.5, 1e-2, 1e-2), (0.5, 0.3, 0.1), (0.0, 1e-3, 1.0), (0.0, 1.0, 2.0)):
        system = oscillator(stiffness=1.0, damping=0.0, lower=wall, upper=math.inf,
                            restitution=1.0)  # fmt: skip
        guess = vi.Guess(np.array([[wall, v, 0.0]]), np.array([t]))
        orbit = vi.find_orbit(system, guess, stops=["B"], cycles=0)
        # x = wall cos t + v sin t comes back after twice the angle of its velocity
        back = 2.0 * math.atan2(orbit.states[0, 1], wall)
        assert not orbit.converged or orbit.period == pytest.approx(back, rel=SOLVED)
        assert not orbit.converged or orbit.period >= 0.1 * t


def test_a_run_that_ends_in_tiny_hops_gives_no_tiny_orbit() -> None:
    """Hops of 1e-18 beside a stop at 0.2 are rounding of it, and solve the equations."""
    system = oscillator(stiffness=1.7, damping=0.004, lower=0.2, upper=math.inf, restitution=0.83)
    for speed in (1e-9, 1e-7, 1e-5):
        guess = vi.Guess(np.array([[0.2, speed, 0.0]]), np.array([2.0 * speed / (1.7 * 0.2)]))
        orbit = vi.find_orbit(system, guess, stops=["B"], cycles=0)
        assert not orbit.converged
        assert "every impact loses energy" in orbit.status


def test_a_ball_that_reaches_two_walls_at_once_is_in_a_family_of_speeds_and_delays() -> None:
    """Both coordinates may have another speed, and one may be behind the other."""
    orbit = vi.find_orbit(box(2), vi.State((0.1, 0.1), (1.0, 1.0)))
    assert orbit.admissible
    assert orbit.period == pytest.approx(4.0, rel=1e-14)
    np.testing.assert_allclose(np.sort(orbit.durations), [0.0, 0.0, 2.0, 2.0], rtol=0.0, atol=1e-13)
    assert orbit.family_dimension == 2


def test_two_elastic_impacts_at_once_are_no_motion() -> None:
    """They cancel, so that the second, from behind, solves the equations."""
    signature = Signature(((0, -1), (0, -1), (0, -1)), 0)
    states = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    orbit = vi.Orbit(ball(1.0), signature, states, np.array([2.0, 0.0, 0.0]), 0.0)
    z = orbit.problem.packed(orbit.states, orbit.durations)
    assert np.abs(orbit.problem.residual(z, 0.0)).max() <= 1e-15
    assert "from behind" in orbit.inadmissible_reason


@pytest.mark.parametrize("residual", [1.6e4, 1e-6, math.nan, math.inf])
def test_an_orbit_whose_equations_do_not_hold_is_not_converged(residual: float) -> None:
    found = vi.find_orbit(coco(), vi.State((0.0,), (0.0,)))
    wrong = replace(found, residual=residual)
    assert not wrong.converged
    assert not wrong.admissible
    assert not wrong.stable
    assert f"relative residual {residual:.1e}" in wrong.inadmissible_reason


# ---- flights of free masses ----------------------------------------------------------------------


@given(stiffness=st.sampled_from([0.0, 1e-30, 1e-16, 1e-8, 1e-4]), gravity=st.floats(0.1, 1e3))
@settings(max_examples=30, deadline=None)
def test_a_weak_spring_under_a_constant_force_keeps_its_digits(
    stiffness: float, gravity: float
) -> None:
    """x = v t - g t^2 / 2 + ..., to first order in the stiffness; its square is below rounding."""
    system = replace(ball(gravity), stiffness=[[stiffness]])
    compiled = compile_prescribed(system)
    for t in (0.1, 1.0, 3.0):
        x, v, _ = compiled.after(np.array([0.0, 1.0, 0.0]), t)
        pulled = stiffness * (t**3 / 6.0 - gravity * t**4 / 24.0)
        slowed = stiffness * (t**2 / 2.0 - gravity * t**3 / 6.0)
        size = 1.0 + gravity * t * (1.0 + t)
        neglected = (stiffness * t**2) ** 2
        assert x == pytest.approx(t - gravity * t**2 / 2.0 - pulled, abs=size * (neglected + 1e-14))
        assert v == pytest.approx(1.0 - gravity * t - slowed, abs=size * (neglected + 1e-14))
