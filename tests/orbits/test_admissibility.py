"""Which orbits are motions of the machine, and how near to grazing: against simulation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from support.periodic import chain, coco, damper_orbits, largest, orbits_of_chains
from support.systems import oscillator, paper_damper, random_mechanism

import vibroimpact as vi
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.continuation import Steps
from vibroimpact.orbits.admissibility import PLAY_OF_AMPLITUDE, least_gaps
from vibroimpact.orbits.find import unfolded
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.search import find_orbits

EPS = np.finfo(float).eps


def repeats_in_simulation(orbit: Orbit) -> bool:
    """Whether the machine, started on an orbit, has its impacts at its times, or is back after a period."""
    durations = unfolded(orbit).durations
    counted = not (orbit.signature.eventless or orbit.zero_multipliers)
    try:
        run = vi.simulate(
            orbit.system, orbit.state, t_max=1.5 * orbit.period, impacts=len(durations) if counted else 10**5
        )  # fmt: skip
    except vi.InvalidParameterError:  # it starts behind another stop
        return False
    # a start wrong by 1e-13 is wrong by at most that times the largest multiplier at the end
    allowed = 1e-10 * max(1.0, largest(orbit.multipliers))
    if not counted:  # without impacts, or with rest after any number of them
        now, later = (np.concatenate(run.at(t)) for t in (0.0, orbit.period))
        silent = not orbit.signature.eventless or bool(np.all(run.contact < 0))
        return silent and bool(np.abs(later - now).max() <= allowed * np.abs(now).max())
    times = np.cumsum(durations)
    stops = [(int(c), int(s)) for c, s in zip(run.contact, run.side, strict=True)]
    around = [*orbit.signature.impacts[1:], orbit.signature.impacts[0]]
    return (
        len(run) == len(times)
        and stops == around
        and bool(np.all(run.status == vi.Status.IMPACT))
        and bool(np.all(np.abs(run.time - times) <= allowed * orbit.period))
    )


@pytest.mark.slow
def test_exactly_the_admissible_orbits_are_motions_of_the_machine() -> None:
    orbits = [*orbits_of_chains(), *damper_orbits()]
    verdicts = [orbit.admissible for orbit in orbits]
    assert verdicts.count(False) >= 10
    assert verdicts.count(True) >= 100
    assert [repeats_in_simulation(orbit) for orbit in orbits] == verdicts


@pytest.mark.slow
def test_orbits_of_random_mechanisms_are_what_they_say() -> None:
    """Up to three coordinates, two-sided contacts, free masses: simulation and the determinant."""
    verdicts = []
    for seed in range(16):
        rng, n = np.random.default_rng([11, seed]), 1 + seed % 3
        m = random_mechanism(rng, n, contacts=1 + seed % 2, stiff_rank=n - (seed % 4 == 3))
        for orbit in find_orbits(m, most_cycles=2, most_impacts=6, starts=3).orbits:
            if orbit.zero_multipliers:
                assert orbit.determinant_error == 0.0
            else:
                sizes = np.abs(orbit.multipliers)
                # each is known to some roundings of the largest; the smallest loses most
                assert orbit.determinant_error <= 1e3 * EPS * len(sizes) * sizes[0] / sizes[-1]
            if abs(orbit.clearance_to_grazing) > 1e-6 and orbit.least_impact_speed > 1e-6:
                verdicts.append(orbit.admissible)
                assert repeats_in_simulation(orbit) == orbit.admissible, orbit
    assert verdicts.count(True) >= 10
    assert verdicts.count(False) >= 3


def dense_gaps(orbit: Orbit) -> list[tuple[float, int, int, int, float]]:
    """(gap, contact, side, flight, time) at local minima of sampled gaps, by another flight.

    The machine without stops is simulated: modal coordinates instead of Taylor series.
    """
    m = orbit.mechanism
    far = tuple(replace(c, lower=-1e6, upper=1e6) for c in m.rigid_stops)
    free, n, found = replace(m, elements=far), m.degrees, []
    for k, (state, duration) in enumerate(zip(orbit.states, orbit.durations, strict=True)):
        start = vi.State(tuple(state[:n]), tuple(state[n : 2 * n]), float(state[-1]))
        run = vi.simulate(free, start, t_max=float(duration))
        times = np.linspace(0.0, float(run.time[-1]), 20_001)
        place = run.at(times)[0]
        for i, c in enumerate(m.rigid_stops):
            for side, gap in ((1, c.upper - place @ c.row), (-1, place @ c.row - c.lower)):
                low = np.flatnonzero((gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:])) + 1
                found += [(float(gap[j]), i, side, k, float(times[j])) for j in low if gap[j] < 1e5]
    return found


@pytest.mark.slow
def test_the_clearance_is_that_of_a_dense_evaluation() -> None:
    orbits = [*orbits_of_chains(), *damper_orbits()]
    compared = 0
    for orbit in orbits:
        sampled = [g for g in dense_gaps(orbit) if 1e-3 < g[4] < orbit.durations[g[3]] - 1e-3]
        several = len(orbit.mechanism.rigid_stops) > 1  # then gaps count at others' impacts too
        if not sampled or (several and min(sampled)[0] > orbit.clearance_to_grazing):
            continue
        gap, contact, side, flight, time = min(sampled)
        compared += 1
        # half a step from the minimum: (dt / 2)^2 u'' / 2, with u'' below 1e2 in all these
        dt = orbit.durations[flight] / 20_000
        assert orbit.clearance_to_grazing == pytest.approx(gap, abs=13.0 * dt**2 + 1e-10)
        assert orbit.nearest is not None
        assert orbit.nearest[1:4] == (contact, side, flight)
        assert orbit.nearest.time == pytest.approx(time, abs=2.0 * dt)
    assert compared >= 15


def test_an_inadmissible_orbit_names_the_gap_that_it_violates() -> None:
    damper = paper_damper("B", 0.6)
    early, behind = (vi.find_orbit(damper, closed) for closed in vi.symmetric_orbits(damper))
    gap = min(dense_gaps(early))[0]
    assert f"the gap at the upper stop of contact 0 is {gap:.5g}"[:-1] in early.inadmissible_reason
    assert "in flight 0" in early.inadmissible_reason
    assert "from behind" in behind.inadmissible_reason
    assert not early.stable
    assert early.inadmissible_reason in repr(early)


def test_a_gap_that_another_contact_leaves_open_or_crosses_is_seen_at_its_impact() -> None:
    """A second wall, beyond the first by little, is behind the mass at every impact."""
    one = coco()
    orbit = vi.find_orbit(one, vi.State((0.0,), (0.0,)))
    wall = one.rigid_stops[0]
    for limit, admissible in ((1.5, True), (0.9, False)):
        both = replace(one, elements=(wall, replace(wall, upper=limit)))
        again = vi.find_orbit(both, unfolded(orbit), stops=["A"], cycles=1)
        assert again.admissible == admissible
        assert again.clearance_to_grazing == pytest.approx(limit - 1.0, abs=1e-12)


def test_a_contact_left_at_the_start_of_a_flight_may_be_crossed_before_its_end() -> None:
    """x2 = cos t / 2 - sin t leaves its stop at 1/2, and is behind it when x1 impacts at t = 4.5.

    On the way its gap has a maximum and no minimum.
    """
    m = vi.Mechanism(
        mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.diag([0.0, 1.0]),
        elements=(vi.RigidStop((1.0, 0.0), upper=1.0), vi.RigidStop((0.0, 1.0), upper=0.5)),
    )  # fmt: skip
    start = np.array([[1.0 - 4.5, 0.5, 1.0, -1.0, 0.0]])
    for begun, ends in (((1, 1), (0, 1)), ((1, 1), (1, 1))):
        found = least_gaps(compile_prescribed(m), start, np.array([4.5]), [ends], [begun])
        least = min(found.values())
        assert least is not None
        crossed = 0.5 - (0.5 * np.cos(4.5) - np.sin(4.5))
        if ends == (0, 1):
            assert least.gap == pytest.approx(crossed, abs=1e-13)
            assert least[1:5] == (1, 1, 0, 4.5)
        else:  # its own impact: the gap there is the equation's business
            assert least.contact == 0


# ---- touches: impacts of speed zero --------------------------------------------------------------


def touching(m: vi.Mechanism, row: np.ndarray, side: int, turns: int = 1) -> vi.Orbit:
    """The steady motion of a mechanism under one harmonic, with a stop where row . x turns round.

    M x'' + C x' + K x = f0 + Im(F exp(i theta)) has x = K^-1 f0 + Im(X exp(i theta)).
    """
    line, n = m.forces[0], m.degrees
    mass, damping, stiffness = (np.array(a) for a in (m.mass, m.damping, m.stiffness))
    force = np.array(line.sine or np.zeros(n)) + 1j * np.array(line.cosine or np.zeros(n))
    dynamic = stiffness + 1j * line.omega * damping - line.omega**2 * mass
    response = np.linalg.solve(dynamic, force)
    mean = np.linalg.solve(stiffness, np.array(m.constant_force or np.zeros(n)))
    along = row @ response
    phase = side * math.pi / 2.0 - math.atan2(along.imag, along.real)
    now = response * np.exp(1j * phase)
    state = [*(mean + now.imag), *(line.omega * now.real), phase]
    limit = float(row @ mean + side * abs(along))
    stop = {"upper": limit} if side > 0 else {"lower": limit}
    touched = replace(m, elements=(vi.RigidStop(tuple(row), restitution=0.8, **stop),))
    period = 2.0 * math.pi / line.omega
    states = np.array([[*state[:-1], phase + 2.0 * math.pi * k] for k in range(turns)])
    guess = vi.Guess(states, np.full(turns, period))
    return vi.find_orbit(touched, guess, stops=[(0, side)] * turns, cycles=turns)


@given(
    omega=st.floats(0.3, 3.0),
    damping=st.floats(0.01, 1.0),
    stiffness=st.floats(0.3, 10.0),
    unit=st.sampled_from([1e-6, 1.0, 1e6]),
    mean=st.sampled_from([0.0, 1.0, -5.0]),
    side=st.sampled_from([1, -1]),
    turns=st.sampled_from([1, 2]),
)
@settings(max_examples=60, deadline=None)
def test_an_oscillator_that_touches_its_stop_moves_so(
    omega: float,
    damping: float,
    stiffness: float,
    unit: float,
    mean: float,
    side: int,
    turns: int,
) -> None:
    """Whatever sign rounding gives the speed of the touch, in any units, about any place."""
    m = oscillator(
        stiffness=stiffness, damping=damping, constant_force=mean * unit,
        forces=(vi.Harmonic(omega, (unit,)),), lower=-math.inf, upper=1.0, restitution=0.8,
    )  # fmt: skip
    orbit = touching(m, np.ones(1), side, turns)
    assert orbit.converged
    assert orbit.least_impact_speed <= 1e-6 * unit
    assert orbit.inadmissible_reason == ""


def test_a_touch_of_a_wall_at_the_origin_is_one() -> None:
    """Every position at an impact is zero: the amplitude is that of the flight."""
    for omega in np.linspace(0.3, 2.7, 13):
        response = 1.0 / (1.0 + 0.1j * omega - omega**2)
        m = oscillator(stiffness=1.0, damping=0.1, constant_force=-abs(response),
                       forces=(vi.Harmonic(float(omega), (1.0,)),), lower=-math.inf,
                       upper=1.0, restitution=0.8)  # fmt: skip
        orbit = touching(m, np.ones(1), 1)
        assert largest(orbit.states[:, 0]) <= 1e-12
        assert orbit.inadmissible_reason == ""


@pytest.mark.parametrize("n", [2, 3, 4])
def test_masses_that_touch_a_stop_move_so(n: int) -> None:
    for seed in range(8):
        m, rng = chain(n, seed), np.random.default_rng(seed)
        orbit = touching(m, rng.normal(size=n), (-1) ** seed)
        assert orbit.converged
        assert orbit.inadmissible_reason == ""


def of_speed(speed: float, unit: float = 1.0) -> vi.Orbit:
    """x'' + 0.1 x' + x = A cos t, x <= unit, R = 0.8: the orbit of a given closing speed.

    With its free motion after the impact known, A and the phase follow linearly.
    """
    decay, turn = 0.05, math.sqrt(1.0 - 0.05**2)
    t = 2.0 * math.pi
    c, s, e = math.cos(turn * t), math.sin(turn * t) / turn, math.exp(-decay * t)
    flow = e * np.array([[c + decay * s, s], [-s, c - decay * s]])
    # a cos t + b sin t solves it for A cos(t + phase) = 0.1 (b cos t - a sin t)
    before, after = np.array([unit, speed]), np.array([unit, -0.8 * speed])
    steady = np.linalg.solve(np.eye(2) - flow, before - flow @ after)
    a, b = steady
    amplitude, phase = 0.1 * math.hypot(a, b), math.atan2(a, b)
    guess = vi.Guess(np.array([[unit, -0.8 * speed, phase]]), np.array([t]))
    m = replace(coco(amplitude), elements=(vi.RigidStop((1.0,), upper=unit, restitution=0.8),))
    return vi.find_orbit(m, guess, stops=["A"], cycles=1)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_an_impact_from_behind_counts_once_its_depth_is_not_rounding(unit: float) -> None:
    """At the rate -w the stop was crossed by w^2 / 2, the acceleration there being -1."""
    for share, admissible in ((0.0, True), (0.1, True), (10.0, False), (1e8, False)):
        orbit = of_speed(-math.sqrt(2.0 * share * PLAY_OF_AMPLITUDE) * unit, unit)
        assert orbit.converged
        assert orbit.admissible == admissible
        if not admissible:
            assert "from behind" in orbit.inadmissible_reason
    assert of_speed(1e-9 * unit, unit).admissible


@pytest.mark.parametrize("points", [20, 50, 120])
@pytest.mark.slow
def test_a_touch_on_a_branch_is_admissible_however_the_branch_is_stepped(points: int) -> None:
    """The steady motion of amplitude A / 0.1 touches the wall at A = 0.1."""
    orbit = vi.find_orbit(coco(), vi.State((0.0,), (0.0,)))
    steps = Steps(points=points, first=1.0 / points)
    branch = vi.continue_orbit(orbit, "forces[0].cosine[0]", (0.02, 1.5), steps=steps)
    touches = [point for point in branch.special_points if point.kind == "ZERO"]
    for touch in touches:
        assert touch.parameter == pytest.approx(0.1, rel=1e-9)
        assert touch.orbit.inadmissible_reason == ""
        assert touch.admissible
    assert touches or points < 100


PUSH = 1.6


def pushed_ball(stop: vi.Element) -> vi.Mechanism:
    """x'' = PUSH sin t - 1 above a stop at 0."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        forces=(vi.Harmonic(1.0, (PUSH,)),), elements=(stop,),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("stop", "end"),
    [
        (vi.RigidStop((1.0,), lower=0.0, restitution=0.5), (0, -1)),
        (vi.SoftStop((1.0,), lower=0.0, stiffness=1e8), (0, -1, 0, 0)),
    ],
)
def test_a_stop_that_is_left_slowly_is_crossed_soon_after(
    stop: vi.Element, end: tuple[int, ...]
) -> None:
    """Left at the time tau before the force lifts, slower than 3 c tau^2 / 8, c the rate of the force there.

    The flight of 3.8 goes through the stop after 9e-4, at a depth of 5e-11, and is above it from 1.3e-3 on.
    """
    tau = 5e-4
    theta, rate = math.asin(1.0 / PUSH) - tau, math.sqrt(PUSH**2 - 1.0)
    v = 0.5 * 3.0 * rate * tau**2 / 8.0

    def x(t: float) -> float:
        return (
            v * t
            - t**2 / 2.0
            - PUSH * (math.sin(theta + t) - math.sin(theta) - t * math.cos(theta))
        )

    def speed(t: float) -> float:
        return v - t - PUSH * (math.cos(theta + t) - math.cos(theta))

    deepest, duration = brentq(speed, tau, 3.0 * tau), brentq(x, 1.0, 8.0)
    compiled, start = compile_prescribed(pushed_ball(stop)), np.array([[0.0, v, theta]])
    found = least_gaps(compiled, start, np.array([duration]), [end], [(0, -1)])
    ((place, least),) = found.items()
    assert not place.own
    assert least.time == pytest.approx(deepest, rel=1e-3)
    assert least.gap == pytest.approx(x(deepest), abs=1e-15)
    assert least.gap < -4e-11


def test_a_gap_that_opens_at_speed_zero_after_a_plastic_impact_has_no_touch_there() -> None:
    compiled = compile_prescribed(pushed_ball(vi.RigidStop((1.0,), lower=0.0, restitution=0.0)))
    for late in (1e-4, 1e-2):  # after the force has begun to lift
        start = np.array([[0.0, 0.0, math.asin(1.0 / PUSH) + late]])
        for speed in (0.0, 1e-17, -1e-17):  # rounding
            start[0, 1] = speed
            found = least_gaps(compiled, start, np.array([3.8]), [(0, -1)], [(0, -1)])
            assert [place.own for place in found] == [False]
            assert min(found.values()).gap > 1.0


def test_the_turn_behind_a_stop_that_an_impact_is_reached_from_is_told_from_grazing():
    # x = sin t with the stop at 1/2: reached at pi / 6 from the front, at 5 pi / 6 from behind
    free = {"mass": [[1.0]], "damping": [[0.0]], "stiffness": [[1.0]]}
    m = vi.Mechanism(**free, elements=(vi.RigidStop((1.0,), upper=0.5, lower=-2.0),))
    compiled, start = compile_prescribed(m), np.array([[0.0, 1.0, 0.0]])
    for duration, own in ((np.pi / 6.0, []), (5.0 * np.pi / 6.0, [True])):
        found = least_gaps(compiled, start, np.array([duration]), [(0, 1)], [(0, -1)])
        assert [place.own for place in found if place.side > 0] == own
    assert min(found.values()).gap == pytest.approx(-0.5, abs=1e-13)
    # 2 pi + pi / 6 later it comes from the front again, and the turn at pi / 2 is a crossing
    found = least_gaps(compiled, start, np.array([13.0 * np.pi / 6.0]), [(0, 1)], [(0, -1)])
    assert {place.own for place in found} == {False}
