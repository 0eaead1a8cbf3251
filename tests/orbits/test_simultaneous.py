"""Orbits with impacts of several contacts at one instant in every period.

Witnesses: closed forms of single masses (the exponential of the free flight and the saltation matrix), machines with
one stop fewer, simulations from beside the orbit.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import fsolve

import vibroimpact as vi
from vibroimpact.compile.prescribed import FORCE_WATCH, End, compile_prescribed
from vibroimpact.model.stand_ins import stand_ins
from vibroimpact.model.stop import Stop
from vibroimpact.orbits.closing_segment import events_of

Array = NDArray[np.float64]

RESTITUTION, DAMPING, OMEGA, LIMIT = 0.6, 0.1, 2.0, 0.1
PERIOD = 2.0 * math.pi / OMEGA
ASIDE = vi.State((0.01, -0.02), (0.1, 0.12))  # from which two masses come together


def masses(
    spring: float = 0.0, dashpot: float = 0.0, inertia: float = 0.0, sense: float = 1.0
) -> vi.Mechanism:
    """Two equal masses, each with its stop and the same force, or its mirror image; joined by three couplings."""

    def joined(own: float, between: float) -> list[list[float]]:
        return [[own + between, -sense * between], [-sense * between, own + between]]

    limit = {"upper": LIMIT} if sense > 0.0 else {"lower": -LIMIT}
    return vi.Mechanism(
        mass=[[1.0, inertia], [inertia, 1.0]],
        damping=joined(DAMPING, dashpot),
        stiffness=joined(1.0, spring),
        forces=(vi.Harmonic(OMEGA, (1.0, sense)),),
        elements=(
            vi.RigidStop((1.0, 0.0), upper=LIMIT, restitution=RESTITUTION),
            vi.RigidStop((0.0, 1.0), **limit, restitution=RESTITUTION),
        ),
    )


def one_mass() -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[DAMPING]], stiffness=[[1.0]], forces=(vi.Harmonic(OMEGA, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=LIMIT, restitution=RESTITUTION),),
    )  # fmt: skip


def steady(m: vi.Mechanism, start: vi.State = ASIDE) -> vi.Run:
    """Motion to which masses come: what is beside it falls to a half in every period, of which there are 64."""
    return vi.simulate(m, start, impacts=10**4, t_max=64.0 * PERIOD)


def strike() -> list[float]:
    """Phase and speed of the impacts of one mass, nearly, by simulation."""
    run = vi.simulate(one_mass(), vi.State((0.0,), (0.1,)), impacts=9)
    return [float(run.phase[-1]), float(run.velocity_before[-1, 0])]


def closed_form(stiffness: float, near: list[float], omega: float = OMEGA) -> list[complex]:
    """Multipliers along a coordinate with this stiffness, of one impact in a period of the force.

    The motion is that of one mass: from impact to impact x = X(t) + e^(A t) (x+ - X(0)), X the forced one without stop.
    Its phase and speed at the impact are nearly known.
    """
    period = 2.0 * math.pi / omega
    forced = 1.0 / (1.0 - omega**2 + 1j * DAMPING * omega)  # of the force Im e^(i omega t)
    free = expm(np.array([[0.0, 1.0], [-1.0, -DAMPING]]) * period)

    def unclosed(unknowns: Array) -> Array:
        phase, speed = unknowns
        there = np.imag(forced * np.exp(1j * phase) * np.array([1.0, 1j * omega]))
        after = np.array([LIMIT, -RESTITUTION * speed])
        return there + free @ (after - there) - [LIMIT, speed]

    phase, speed = fsolve(unclosed, near, xtol=1e-12)
    before, after = (math.sin(phase) - LIMIT - DAMPING * v for v in (speed, -RESTITUTION * speed))
    jump = np.array([[-RESTITUTION, 0.0], [(RESTITUTION * before + after) / speed, -RESTITUTION]])
    flight = expm(np.array([[0.0, 1.0], [-stiffness, -DAMPING]]) * period)
    return [*np.linalg.eigvals(jump @ flight)]


@pytest.mark.parametrize("spring", [0.0, 0.2])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_multipliers_of_masses_that_strike_at_one_instant_are_those_of_their_common_and_opposite_motions(
    spring: float, sense: float
) -> None:
    """Of separate masses, those of each one twice. The equal motions see the spring not at all, others twice."""
    start = vi.State((0.01, -0.02 * sense), (0.1, 0.12 * sense))
    m = masses(spring, sense=sense)
    orbit = vi.find_orbit(m, steady(m, start))
    assert orbit.converged
    assert orbit.stable
    assert len(orbit.signature.impacts) == 2
    assert abs(orbit.durations).min() < 1e-12
    # without the spring the multipliers are double: rounding moves each by its root, their polynomial not
    near = strike()
    wanted = [*closed_form(1.0, near), *closed_form(1.0 + 2.0 * spring, near)]
    np.testing.assert_allclose(np.poly(orbit.multipliers), np.poly(wanted), rtol=0.0, atol=1e-12)
    assert (
        orbit.clearance_to_grazing > 1.0
    )  # a stop that is struck at the same instant is not touched


def beside(m: vi.Mechanism, orbit: vi.Orbit, step: float, way: Array) -> Array:
    """Change of (x, v) after a period, by that at its beginning, from beside an orbit."""
    since = 0.5 * float(orbit.durations.max())

    def passed(z: Array, time: float, phase: float) -> Array:
        begun = vi.State(tuple(z[:2]), tuple(z[2:]), phase)
        return np.concatenate(vi.simulate(m, begun, t_max=time).at(time))

    start = passed(
        np.concatenate([orbit.state.position, orbit.state.velocity]), since, orbit.state.phase
    )
    phase = orbit.state.phase + m.omega * since
    after = [passed(start + change, PERIOD, phase) for change in (step * way, 0.0 * way)]
    return (after[0] - after[1]) / step


@pytest.mark.parametrize("joined", ["spring", "dashpot"])
def test_the_map_has_one_derivative_unless_a_dashpot_joins_masses_that_strike_at_one_instant(
    joined: str,
) -> None:
    """The state beside the orbit in which one mass is ahead, and that in which the other is."""
    m = masses(**{joined: 0.2})
    orbit = vi.find_orbit(m, steady(m))
    ahead = np.array([1.0, -1.0, 0.0, 0.0])
    step = 1e-6  # with differences that are good to so much times the curvature, of order 10
    bend = np.abs(beside(m, orbit, step, ahead) + beside(m, orbit, step, -ahead)).max()
    if joined == "spring":
        assert bend < 1e-4
        assert orbit.stable
    else:
        assert bend > 0.1
        assert not orbit.converged
        assert orbit.status == (
            "the upper stop of contact 0 and the upper stop of contact 1 are struck at one instant in every period, "
            "and the impact at one changes the acceleration at the other: the map has a derivative for each order of "
            "the impacts, and no multipliers"
        )


def test_motions_beside_masses_that_move_each_other_and_strike_at_one_instant_jump() -> None:
    m = masses(inertia=0.1)
    run = vi.simulate(m, vi.State((0.01, 0.01), (0.1, 0.1)), t_max=64.0 * PERIOD)
    orbit = vi.find_orbit(m, run)
    assert not orbit.converged
    assert orbit.status.startswith("contacts that move each other are struck at one instant")
    at = run.time[-5] + 0.5 * PERIOD
    place, speed = (x.ravel() for x in run.at(at))
    moved = []
    for step in (1e-6, -1e-6):
        begun = vi.State((place[0] + step, place[1]), tuple(speed), OMEGA * at)
        moved.append(vi.simulate(m, begun, t_max=PERIOD).at(PERIOD)[1])
    assert np.abs(moved[0] - moved[1]).max() > 1e-2  # not of the size of the step


def test_a_branch_of_masses_that_strike_at_one_instant_doubles_its_period_with_one_mass() -> None:
    m = masses(0.2)
    branch = vi.continue_orbit(vi.find_orbit(m, steady(m)), "omega", (OMEGA, 2.5))
    assert [point.label for point in branch.special_points] == [
        "PD1"
    ]  # no impacts that change order
    assert branch.extent == (OMEGA, 2.5)
    assert branch.admissible.all()
    point = branch["PD1"]
    phase, speed = point.orbit.states[0, -1], -point.orbit.states[0, 2] / RESTITUTION
    wanted = closed_form(1.0, [phase, speed], point.parameter)
    assert np.abs(np.array(wanted) + 1.0).min() < 1e-9


def test_where_masses_strike_at_one_instant_another_stop_is_touched_where_the_simulation_says() -> (
    None
):
    touching = 2.1
    alone = vi.find_orbit(
        masses(0.2).replace(omega=touching), steady(masses(0.2).replace(omega=touching))
    )
    times = np.linspace(0.0, alone.period, 4001)
    run = vi.simulate(alone.system, alone.state, t_max=alone.period)
    least = float(run.at(times)[0][:, 0].min())
    limited = vi.RigidStop((1.0, 0.0), lower=least, upper=LIMIT, restitution=RESTITUTION)
    m = masses(0.2).replace(omega=2.2)
    m = m.replace(elements=(limited, m.elements[1]))
    branch = vi.continue_orbit(vi.find_orbit(m, steady(m)), "omega", (2.05, 2.3), inadmissible=True)
    assert [point.label for point in branch.special_points] == ["GR1"]
    # The minimum of the samples is too large by the acceleration 2.5 times (T / 8000)^2 / 2, over a slope of 5.4.
    assert branch["GR1"].parameter == pytest.approx(touching, abs=1e-7)


def test_a_curve_of_masses_that_strike_at_one_instant_has_no_impacts_that_change_order() -> None:
    def machine(omega: float, damping: float) -> vi.Mechanism:
        return masses(0.2).replace(omega=omega, damping=(damping * np.eye(2)).tolist())

    family = vi.Family(machine, omega=OMEGA, damping=DAMPING)
    orbit = vi.find_orbit(family, vi.simulate(family, ASIDE, impacts=10**4, t_max=64.0 * PERIOD))
    branch = vi.continue_orbit(orbit, "omega", (OMEGA, 2.5))
    ranges = ((2.4, 2.5), (0.095, 0.105))
    curve = vi.continue_bifurcation(branch["PD1"], ("omega", "damping"), ranges)
    assert len(curve.special_points) == 0
    assert curve.admissible.all()


def test_three_masses_whose_impacts_are_not_quite_at_one_instant_yet_have_an_orbit_in_which_they_are() -> (
    None
):
    """A run in which they come one after the other, in another order in each period."""
    n = 3
    m = vi.Mechanism(
        mass=np.eye(n), damping=0.1 * np.eye(n), stiffness=1.4 * np.eye(n) - 0.2,
        forces=(vi.Harmonic(1.3, (1.5,) * n),),
        elements=tuple(vi.RigidStop(tuple(row), lower=0.0, restitution=0.6) for row in np.eye(n)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.1, 0.12, 0.08), (0.0, 0.1, 0.05)), t_max=600.0)
    assert len({tuple(run.contact[k : k + n]) for k in range(len(run) - 31, len(run) - 1, n)}) > 1
    assert (np.diff(run.time) > 0.0).all()
    orbit = vi.find_orbit(m, run)
    assert [stop.contact for stop in orbit.signature.impacts] in ([0, 1, 2], [1, 2, 0], [2, 0, 1])
    alone = vi.find_orbit(
        vi.Mechanism(
            mass=[[1.0]], damping=[[0.1]], stiffness=[[0.8]], forces=(vi.Harmonic(1.3, (1.5,)),),
            elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.6),),
        ),
        vi.State((0.1,), (0.0,)),
    )  # fmt: skip
    for multiplier in alone.multipliers:  # of the common motion; the opposite ones are two alike
        assert np.abs(orbit.multipliers - multiplier).min() < 1e-12


def test_masses_that_rest_and_are_released_at_one_instant_have_an_orbit_that_forgets_all() -> None:
    """Its times are those of one mass, which is released where the force on it is zero."""

    def plastic(n: int) -> vi.Orbit:
        spring = 0.2 * (n - 1)
        m = vi.Mechanism(
            mass=np.eye(n), damping=0.1 * np.eye(n), stiffness=(1.0 + n * spring) * np.eye(n) - spring,
            forces=(vi.Harmonic(1.3, (1.5,) * n),), constant_force=(-1.0,) * n,
            elements=tuple(vi.RigidStop(tuple(row), lower=0.0, restitution=0.0) for row in np.eye(n)),
        )  # fmt: skip
        start = vi.State((0.1, 0.12)[:n], (0.0, 0.1)[:n])
        return vi.find_orbit(m, vi.simulate(m, start, t_max=100.0))

    pair, alone = plastic(2), plastic(1)
    assert pair.stable
    assert pair.clearance_to_grazing > 0.1
    assert np.abs(pair.durations).min() < 1e-12
    again = vi.simulate(pair.system, pair.state, t_max=pair.period).at(pair.period)
    np.testing.assert_allclose(again, np.reshape(pair.states[0, :4], (2, 2)), rtol=0.0, atol=1e-12)
    assert pair.multipliers.tolist() == [0.0] * 4
    times = np.sort(pair.durations)
    np.testing.assert_allclose(times[:2], 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(times[2:], np.sort(alone.durations), rtol=1e-13)
    assert times.sum() == pytest.approx(2.0 * math.pi / 1.3, rel=1e-14)
    released = [
        stop
        for stop, watch in zip(pair.signature.impacts, pair.signature.begun, strict=True)
        if watch == FORCE_WATCH
    ]
    assert released == [Stop(0, -1), Stop(1, -1)]
    phases = pair.states[[watch == FORCE_WATCH for watch in pair.signature.begun], -1]
    np.testing.assert_allclose(1.5 * np.sin(phases), 1.0, rtol=0.0, atol=1e-13)


def test_masses_that_chatter_at_once_have_no_word() -> None:
    m = vi.Mechanism(
        mass=np.eye(2), damping=0.1 * np.eye(2), stiffness=np.eye(2),
        forces=(vi.Harmonic(1.3, (1.5, 1.5)),), constant_force=(-1.0, -1.0),
        elements=tuple(vi.RigidStop(tuple(row), lower=0.0, restitution=0.4) for row in np.eye(2)),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.1, 0.12), (0.0, 0.1)), t_max=50.0)
    assert vi.find_orbit(m, run).status == (
        "several events are at one instant in every period: such orbits have no signature"
    )


# ---- stops at one place --------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["moreau", "sequential"])
@pytest.mark.parametrize("restitution", [0.3, 0.9])
def test_of_two_stops_at_one_place_the_orbit_is_that_of_the_one_that_decides(
    law: str, restitution: float
) -> None:
    """By Moreau's law the larger restitution decides, by the other law the first stop. Rows are multiples."""
    single = one_mass()
    other = vi.RigidStop((-2.0,), lower=-2.0 * LIMIT, restitution=restitution)
    m = replace(single, elements=(*single.elements, other), impact_law=law)
    decides = law == "moreau" and restitution > RESTITUTION
    wanted = vi.find_orbit(
        replace(single, elements=(other,)) if decides else single, vi.State((0.0,), (0.1,))
    )
    orbit = vi.find_orbit(m, vi.State((0.0,), (0.1,)))
    assert {stop.contact for stop in orbit.signature.impacts} == {int(decides)}
    assert orbit.stable == wanted.stable
    np.testing.assert_allclose(orbit.states, wanted.states, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(orbit.multipliers, wanted.multipliers, rtol=0.0, atol=1e-12)
    assert orbit.clearance_to_grazing == pytest.approx(wanted.clearance_to_grazing, rel=1e-12)


def test_stops_at_one_place_are_those_of_proportional_rows_limits_and_motions() -> None:
    def stop(row: float, limit: float, amplitude: float, restitution: float = 0.5) -> vi.RigidStop:
        side = {"upper": limit} if row > 0.0 else {"lower": limit}
        motion = vi.Harmonic(OMEGA, (amplitude,))
        return vi.RigidStop((row,), **side, restitution=restitution, motion=motion)

    first = stop(1.0, 0.3, 0.01)
    halves = (vi.Harmonic(OMEGA, (0.005,)),) * 2
    others = [
        (stop(3.0, 0.9, 0.03), {Stop(1, 1): Stop(0, 1)}),
        (replace(first, motion=halves), {Stop(1, 1): Stop(0, 1)}),
        (stop(-1.0, -0.3, -0.01, 0.6), {Stop(0, 1): Stop(1, -1)}),
        (stop(1.0, 0.31, 0.01), {}),
        (stop(1.0, 0.3, 0.02), {}),
        (stop(2.0, -0.6, 0.02), {}),
    ]
    for other, wanted in others:
        assert stand_ins(replace(one_mass(), elements=(first, other))) == wanted


# ---- impacts while another contact rests ---------------------------------------------------------


@pytest.mark.parametrize("inertia", [0.5, -0.5])
def test_an_impact_presses_a_contact_that_rests_or_opens_it(inertia: float) -> None:
    """The velocities after it are those of the simulation, which solves the complementarity problem (T19) itself."""
    floors = tuple(vi.RigidStop(tuple(row), lower=0.0, restitution=0.4) for row in np.eye(2))
    m = vi.Mechanism(
        mass=[[1.0, inertia], [inertia, 1.0]], damping=np.zeros((2, 2)).tolist(),
        stiffness=np.eye(2).tolist(), constant_force=(-3.0, -1.0), elements=floors,
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0, 1.0), (0.0, 0.0)), impacts=1)
    k = int(np.flatnonzero(run.status == vi.Status.SIMULTANEOUS)[0])
    code, closed = run.all_codes[k], 2
    assert code == closed
    before = np.concatenate([run.position[k], run.velocity_before[k], [0.0]])
    after = compile_prescribed(m, "", (closed,)).linearise(
        before[None], np.zeros(1), [End(1, -1, closed)]
    ).after  # fmt: skip
    np.testing.assert_allclose(after[0, 2:4], run.velocity_after[k], rtol=0.0, atol=1e-14)
    rests = run.all_codes[-1] % 3 == closed
    assert rests == (inertia > 0.0)
    assert Stop(1, -1) in events_of(run).stops
