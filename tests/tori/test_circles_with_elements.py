"""Circles with elements, with stops that move and of hybrid systems, against simulation and other machines."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.system import mechanism_of
from vibroimpact.tori.continue_circle import STEPS

OMEGA = 1.00314
REST = vi.State((0.0, 0.0), (0.0, 1.0))
FREE = vi.State((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
SHORT = {"settle_iterates": 2000, "points": 600}
RIDER = 0.05  # mass of the third coordinate


def damper(omega: float = OMEGA) -> vi.Mechanism:
    """The damper of the paper's set A, whose motion at this frequency is a torus."""
    return paper_damper("A", omega).mechanism


def with_rider(*elements: vi.Element) -> vi.Mechanism:
    """The damper and a third mass, driven and coupled weakly to it, on which elements act."""
    m = damper()
    force, k, c = m.forces[0], 0.002, 0.1 * RIDER
    masses = np.diag([m.mass[0][0], m.mass[1][1], RIDER])
    damping, stiffness = (np.pad(np.array(a), (0, 1)) for a in (m.damping, m.stiffness))
    damping[2, 2] += c
    stiffness += k * np.outer([1.0, 0.0, -1.0], [1.0, 0.0, -1.0])
    stiffness[2, 2] += 0.3 * RIDER
    line = vi.Harmonic(
        OMEGA, (*force.sine, RIDER * math.cos(0.8)), (*force.cosine, RIDER * math.sin(0.8))
    )
    stop = replace(m.rigid_stops[0], row=(-1.0, 1.0, 0.0))
    return vi.Mechanism(
        mass=masses,
        damping=damping,
        stiffness=stiffness,
        forces=(line,),
        elements=(stop, *elements),
    )


ROW = (0.0, 0.0, 1.0)
ELEMENTS = {
    "friction that sticks": vi.Friction(ROW, 0.6 * RIDER, 0.7 * RIDER),
    "friction on a belt": vi.Friction(ROW, 0.5 * RIDER, 0.6 * RIDER, belt_speed=0.1),
    "a soft stop that moves": vi.SoftStop(
        ROW, upper=0.5, stiffness=0.1, damping=0.01, motion=vi.Harmonic(OMEGA, (0.05,), (0.02,))
    ),
    "play with dashpots that do not pull": vi.SoftStop(
        ROW, lower=-0.5, upper=0.5, stiffness=0.05, damping=0.002, law="limited"
    ),
    "a preloaded spring": vi.SoftStop(ROW, upper=-0.1, stiffness=0.1),
    "a switched spring": vi.PhaseSwitch(
        OMEGA, (0.4, 0.4 + math.pi), row=ROW, stiffness=(0.0, 0.01)
    ),
}  # fmt: skip


@cache
def circle_with(element: str) -> vi.Circle:
    return vi.find_circle(with_rider(ELEMENTS[element]), FREE, **SHORT)


def hybrid(omega: float = OMEGA) -> vi.HybridSystem:
    """The damper as modes, guards and resets: positions and velocities are its coordinates."""
    m = damper(omega)
    inverse, line = np.linalg.inv(m.mass), m.forces[0]
    field = np.block([
        [np.zeros((2, 2)), np.eye(2)],
        [-inverse @ np.array(m.stiffness), -inverse @ np.array(m.damping)],
    ])  # fmt: skip
    waves = np.zeros((4, 2))
    waves[2:] = inverse @ np.column_stack([line.sine, line.cosine])
    row = np.array([-1.0, 1.0])
    push = inverse @ row
    stop, reset = m.rigid_stops[0], np.eye(4)
    reset[2:, 2:] -= (1.0 + stop.restitutions[0]) * np.outer(push, row) / (row @ push)
    gap = (-1.0, 1.0, 0.0, 0.0)
    return vi.HybridSystem(
        modes={"flight": vi.LinearMode(field, waves=waves)},
        guards={"upper": vi.LinearGuard(gap, stop.upper), "lower": vi.LinearGuard(gap, stop.lower)},
        transitions=(
            vi.Transition("flight", "upper", "rising", "flight", reset),
            vi.Transition("flight", "lower", "falling", "flight", reset),
        ),
        omegas=(omega,),
    )


def returns(circle: vi.Circle, iterates: int) -> np.ndarray:
    """Simulated states (x, v, theta) just after the events with which iterates begin, from a state of the circle."""
    m = mechanism_of(circle.system)
    run = vi.simulate(circle.system, circle.state(), impacts=8 * iterates)
    first, word = circle.signature.impacts[0], circle.signature.impacts
    assert word.count(first) == 1
    side = run.limit_side == first.side
    met = np.isin(run.status, (vi.Status.IMPACT, vi.Status.ENGAGE, vi.Status.CHANGE))
    at = np.flatnonzero((run.contact == first.contact) & side & met & (run.time > 0.0))[:iterates]
    assert len(at) == iterates
    phase = run.start.phase + m.omega * run.time[at]
    return np.column_stack([run.position[at], run.velocity_after[at], phase])


def apart(circle: vi.Circle, iterates: int) -> float:
    """Largest distance of simulated returns from u(k rho), in units of the sizes."""
    rows = returns(circle, iterates)
    points = circle.at(circle.rotation_number * (1.0 + np.arange(iterates)))
    off = rows[:, list(circle.map.kept)] - points
    if circle.map.kept[-1] == rows.shape[1] - 1:
        off[:, -1] = np.angle(np.exp(1j * off[:, -1]))
    return float(np.abs(off / circle.map.sizes).max())


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_long_motion_goes_round_the_circle_of_a_machine_with_elements(element: str) -> None:
    circle = circle_with(element)
    assert circle.stable, circle
    assert circle.residual < 1e-10
    # A disturbance by the residual fades by a factor exp(-0.017) in every iterate.
    assert apart(circle, 500) < 60.0 * max(circle.residual, 1e-12)


def test_what_friction_forgets_on_a_circle_is_known() -> None:
    circle = circle_with("friction that sticks")
    assert any(mode not in (0, 3) for mode in (flight.mode for flight in circle.signature.flights))
    assert circle.normal_multipliers[-1] < 1e-300
    assert circle.normal_exponents[-2] > -10.0


def moving_and_still() -> tuple[vi.Mechanism, vi.Mechanism]:
    """A stop that moves by 0.002 sin + 0.01 cos, and the same machine in its coordinates.

    The second mass has no spring: seen from the stop, it is driven by its mass times the acceleration of the stop.
    """
    m = damper(0.995)
    sine, cosine = 0.002, 0.01
    stop = replace(m.rigid_stops[0], motion=vi.Harmonic(m.omega, (sine,), (cosine,)))
    force, added = m.forces[0], m.mass[1][1] * m.omega**2
    line = vi.Harmonic(m.omega, (force.sine[0], added * sine), (force.cosine[0], added * cosine))
    return m.replace(elements=(stop,)), m.replace(forces=(line,))


def test_a_stop_that_moves_has_the_circle_of_its_own_coordinates() -> None:
    moving, still = (vi.find_circle(m, REST, symmetric=False) for m in moving_and_still())
    # Both have errors of the residual, over what is left of a disturbance: 1 - exp(-0.034).
    play = 30.0 * max(moving.residual, still.residual)
    assert abs(moving.rotation_number - still.rotation_number) < play
    assert np.abs(moving.normal_exponents - still.normal_exponents).max() < 1e-9
    phi = np.linspace(0.0, 1.0, 9)
    x1, x2, *_, theta = moving.states(phi).T
    place = 0.002 * np.sin(theta) + 0.01 * np.cos(theta)
    assert np.abs(x2 - x1 - place - 5.0).max() < 1e-14 * 5.0
    own = np.abs(moving.coefficients[:3, :2]), np.abs(still.coefficients[:3, :2])  # x1, v1
    assert np.abs(own[0] - own[1]).max() < 1e-9


def test_circles_of_stiff_stops_tend_to_that_of_the_rigid_one() -> None:
    """Contact takes a time ~ k^(-1/2), and moves the rotation number by as much."""
    m = damper(0.995)
    stop, mass = m.rigid_stops[0], 0.1 / 1.1
    share = -math.log(0.8) / math.hypot(math.pi, math.log(0.8))  # of critical: restitution 0.8
    rigid, errors = vi.find_circle(m, REST, symmetric=False), []
    for k in (1e4, 1e6):
        c = 2.0 * share * math.sqrt(k * mass)
        soft = vi.SoftStop(stop.row, stop.lower, stop.upper, k, c, law="linear")
        circle = vi.find_circle(m.replace(elements=(soft,)), REST, **SHORT)
        errors.append(circle.rotation_number - rigid.rotation_number)
    assert abs(errors[1]) < 1e-4
    # The next order is smaller by the share k^(-1/2) of a flight that a contact takes, some hundredths at 1e4.
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.05)


def test_a_hybrid_system_has_the_circle_of_the_machine_that_it_is() -> None:
    m = vi.find_circle(damper(), REST, symmetric=False)
    start = vi.State((0.0, 0.0, 0.0, 1.0), (0.0,) * 4)
    circle = vi.find_circle(hybrid(), start, **SHORT)
    assert circle.stable, circle
    assert circle.rotation_number == pytest.approx(m.rotation_number, abs=1e-11)
    # One multiplier more, along the flow, which the reset forgets.
    assert np.allclose(circle.normal_exponents[:3], m.normal_exponents, atol=1e-8)
    assert circle.normal_multipliers[-1] < 1e-300
    family = vi.continue_circle(
        circle, "guards.upper.level", (5.0 - 1e-3, 5.0 + 1e-3), steps=replace(STEPS, points=2)
    )
    moved = damper().replace({"elements[0].upper": family.values[-1]})
    other = vi.find_circle(moved, REST)
    assert family.rotation_numbers[-1] == pytest.approx(other.rotation_number, abs=1e-10)


@pytest.mark.parametrize(
    ("element", "parameter"),
    [
        ("friction that sticks", "elements[1].static"),
        ("a soft stop that moves", "elements[1].motion[0].sine[0]"),
        ("a switched spring", "elements[1].stiffness[1]"),
        ("a soft stop that moves", "elements[0].upper"),
    ],
)
def test_derivatives_of_maps_with_elements_are_those_of_their_differences(
    element: str, parameter: str
) -> None:
    circle = circle_with(element)
    circle_map = replace(circle.map, parameter=parameter)
    p, h = parameter_value(circle.system, parameter), 1e-6
    points, times = circle.points[:5], circle.times[:5]
    here = circle_map.images(points, p, times)

    def difference(d_points: np.ndarray, dp: float) -> np.ndarray:
        ends = [circle_map.images(points + s * d_points, p + s * dp, times) for s in (h, -h)]
        return (ends[0].points - ends[1].points) / (2.0 * h)

    # Third derivatives times h^2, and rounding over h.
    d = points.shape[1]
    assert np.abs(here.by_parameter).max() > 1e-3
    assert np.allclose(here.by_parameter, difference(np.zeros(d), 1.0), rtol=1e-6, atol=1e-6)
    for j, e in enumerate(np.eye(d)):
        assert np.allclose(here.by_point[:, :, j], difference(e, 0.0), rtol=1e-6, atol=1e-6)


def test_motions_without_one_map_have_no_circle_and_say_why() -> None:
    early = vi.PhaseSwitch(OMEGA, (1.8, 1.8 + math.pi), row=ROW, stiffness=(0.0, 0.01))
    changing = vi.find_circle(with_rider(early), FREE, settle_iterates=100, points=100)
    assert "the order of its events changes" in changing.status
    assert math.isnan(changing.clearance_to_grazing)
    assert math.isnan(changing.least_impact_speed)
    assert np.isnan(changing.normal_exponents).all()
    assert not changing.stable
    assert changing.to_dataset().attrs["status"] == changing.status


@pytest.mark.parametrize(
    ("element", "place", "push"),
    [
        (vi.Friction(ROW, 2.0 * RIDER), 0.3, 0.0),
        (vi.RigidStop(ROW, lower=0.3, restitution=0.4), 0.3, -0.2),
    ],
)
def test_what_is_held_all_the_time_is_as_if_it_were_ground(
    element: vi.Element, place: float, push: float
) -> None:
    """The spring and the dashpot to the third mass then lead to the ground, at its place."""
    held = with_rider(element).replace(constant_force=(0.0, 0.0, push))
    start = replace(FREE, position=(0.0, 0.0, place))
    circle = vi.find_circle(held, start, **SHORT)
    assert circle.stable, circle
    k, m = 0.002, damper()
    stiffness = np.array(m.stiffness) + np.diag([k, 0.0])
    grounded = m.replace(stiffness=stiffness, constant_force=(k * place, 0.0))
    alone = vi.find_circle(grounded, REST, **SHORT)
    assert circle.rotation_number == pytest.approx(alone.rotation_number, abs=1e-11)
    assert np.allclose(circle.normal_exponents, alone.normal_exponents, atol=1e-8)
    assert apart(circle, 200) < 60.0 * max(circle.residual, 1e-12)


def test_a_circle_with_elements_and_its_family_come_back_from_files(tmp_path: Path) -> None:
    circle = circle_with("a switched spring")
    family = vi.continue_circle(
        circle,
        "elements[1].stiffness[1]",
        (0.0099, 0.0101),
        both=False,
        steps=replace(STEPS, points=2),
    )
    vi.save(circle, tmp_path / "circle.nc")
    vi.save(family, tmp_path / "family.nc")
    again, last = vi.load(tmp_path / "circle.nc"), vi.load(tmp_path / "family.nc").circles[-1]
    assert again.signature == circle.signature
    np.testing.assert_array_equal(again.points, circle.points)
    assert again.clearance_to_grazing == circle.clearance_to_grazing
    assert last.admissible
    assert last.rotation_number == family.rotation_numbers[-1]
    there = last.map.images(last.points, last.value, last.times).points
    np.testing.assert_allclose(
        there, last.at(np.arange(last.nodes) / last.nodes + last.rotation_number), atol=1e-9
    )


def test_a_stop_at_the_place_of_one_that_decides_is_no_nearer_to_the_circle() -> None:
    """Seen from the stop that is struck it is at zero at every impact. Nothing else of the circle comes near a stop."""
    m = damper()
    stop = m.rigid_stops[0]
    rows = tuple(2.0 * x for x in stop.row)
    behind = vi.RigidStop(rows, lower=2.0 * stop.lower, upper=2.0 * stop.upper, restitution=0.5)
    circle = vi.find_circle(m.replace(elements=(stop, behind)), REST, symmetric=False, **SHORT)
    assert circle.stable
    assert circle.clearance_to_grazing == math.inf


def test_what_is_periodic_has_no_circle_but_a_dataset_also_with_coordinates_without_mass() -> None:
    spring = vi.SoftStop((1.0, 0.0), upper=0.1, stiffness=10.0)
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.0]], damping=[[0.2, 0.0], [0.0, 0.5]], stiffness=[[1.1, -0.1], [-0.1, 0.2]],
        forces=(vi.Harmonic(0.7, (0.5, 0.0)),), elements=(spring,),
    )  # fmt: skip
    circle = vi.find_circle(m, vi.State((0.0, 0.0), (0.0, 0.0)), settle_iterates=100, points=64)
    assert circle.status.startswith("the motion is periodic")
    data = circle.to_dataset()
    names = [str(name) for name in data["coordinate"].values]
    assert len(names) == data.sizes["coordinate"] == 3  # of x1, v1, x2 and the phase, less one
    assert np.isnan(data["points"]).all()


def test_motions_under_frequencies_without_a_common_period_have_no_circle() -> None:
    m = damper()
    swing = vi.Harmonic(m.omega * math.sqrt(2.0), (0.01,))
    moving = m.replace(elements=(replace(m.rigid_stops[0], motion=swing),))
    circle = vi.find_circle(moving, REST, settle_iterates=64, points=64)
    assert "no common period" in circle.status
