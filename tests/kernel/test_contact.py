"""Certified first contact under attack: nothing missed, nothing invented outside eps_g."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from support import UNIT
from support.grazing import Graze, grazes
from support.kernel import first_event, fly, stated_eps
from support.replay import flights
from support.systems import ball, damper_witness, oscillator, paper_damper
from witness import damper as reference
from witness.precision import exact, mp

import vibroimpact as vi
from vibroimpact.compile.hybrid import compile_mechanism

GAPS = [sign * 10.0**-k for k in range(1, 17) for sign in (1.0, -1.0)]
GRAZED = {
    "A": paper_damper("A", 1.2),
    "B": paper_damper("B", 0.95),
    "C": paper_damper("C", 0.43),
    "undamped": paper_damper("A", 1.2, zeta=0.0),
    "critical": paper_damper("A", 1.2, zeta=1.0),
    "overdamped": paper_damper("B", 1.1, zeta=1.5),
}


def eps_at_extremum(g: Graze) -> tuple[float, float]:
    """eps_g as the kernel states it for the step in which the extremum lies: the least, the most.

    How many rounds there were before that, the kernel knows: mostly one for six steps. The most
    allows for one a step.
    """
    d, step = g.damper, compile_mechanism(g.damper.mechanism).step
    steps = float(g.time) // step
    x, v = fly(d, g.state, steps * step)
    theta = g.state.phase + d.omega * steps * step
    eps = (
        stated_eps(d, x[0, 0], v[0, 0], x[0, 1], v[0, 1], theta, steps, rounds)
        for rounds in (0, steps + 1)
    )
    least, most = map(float, eps)
    return least, most


def check_graze(g: Graze) -> None:
    """Outside eps_g the extremum is decided as it is; inside, the flight ends as grazing.

    What rounding really adds is a small part of eps_g: half of it is left for that.
    """
    event = first_event(g.damper, g.state, g.t_max)
    least, eps = eps_at_extremum(g)
    if abs(g.gap) > 1.5 * eps:
        assert event.status == (vi.Status.HORIZON if g.gap > 0 else vi.Status.IMPACT), (g, eps)
    elif abs(g.gap) < 0.5 * least:
        assert event.status is vi.Status.GRAZING, (g, least)
    if event.status is vi.Status.IMPACT:
        assert event.side == np.sign(g.side)
        late = 1.5 * eps / abs(event.rate) + 4.0 * np.spacing(event.time)
        assert abs(exact(event.time) - g.root) <= late, (g, event)


@pytest.mark.parametrize("left", [False, True], ids=["interior", "departing"])
@pytest.mark.parametrize("name", GRAZED)
@pytest.mark.one_in(3)
def test_near_grazes_are_decided_outside_eps_and_reported_inside(name: str, left: bool) -> None:
    rng = np.random.default_rng(20210401)
    cases = list(grazes(GRAZED[name], rng, 9, GAPS, left=left))
    assert len(cases) == 9 * len(GAPS)
    for case in cases:
        check_graze(case)


def test_double_roots_are_found_for_polynomial_gaps() -> None:
    """x = x0 + v0 t - t^2 / 2 under a ceiling at 1: the apex is rational, hence known exactly."""
    m = oscillator(
        stiffness=0.0, damping=0.0, constant_force=-1.0, lower=-math.inf, upper=1.0,
        restitution=0.5,
    )  # fmt: skip
    rng = np.random.default_rng(7)
    for k in range(1, 17):
        for sign in (1.0, -1.0) * 20:
            v0 = rng.uniform(0.5, 3.0)
            x0 = 1.0 - v0 * v0 / 2.0 - sign * 10.0**-k
            gap = 1 - (Fraction(x0) + Fraction(v0) ** 2 / 2)
            event = first_event(m, vi.State((x0,), (v0,)), t_max=2.0 * v0)
            step = compile_mechanism(m).step
            eps = UNIT * 16.0 * (abs(x0) + (step + v0) * 2.0 * v0 + 1.0)
            if abs(gap) > eps:
                wanted = vi.Status.HORIZON if gap > 0 else vi.Status.IMPACT
                assert event.status == wanted, (x0, v0, float(gap))
            elif abs(gap) < UNIT * 8.0:
                assert event.status is vi.Status.GRAZING


@pytest.mark.parametrize("rate", [1.01, 1.013, 0.992])
def test_grazes_after_hundreds_of_rounds_are_reported(rate: float) -> None:
    """u = sin t - sin(rate t) beats: its highest top is some 400 steps away, known at 50 digits.

    A round may add 8 ulp, so eps_g is 32 to 8000 ulp of u and the limit there.
    """

    def height(t: Any) -> Any:
        return mp.sin(t) - mp.sin(exact(rate) * t)

    def slope(t: Any) -> Any:
        return mp.cos(t) - exact(rate) * mp.cos(exact(rate) * t)

    beat, fast = math.pi / abs(rate - 1.0), (1.0 + rate) / 2.0  # half a beat lasts so long
    near = [
        (k + (rate > 1.0)) * math.pi / fast for k in range(0, int(2.0 * beat * fast / math.pi), 2)
    ]
    tops = [mp.findroot(slope, t) for t in near if abs(t - beat) < 0.5 * beat]
    second, highest = sorted(height(t) for t in tops)[-2:]
    assert highest - second > 1e-6
    for gap in (g * sign for g in (3e-14, 1e-14, 1e-15, 1e-11, 1e-9) for sign in (1.0, -1.0)):
        limit = float(highest + exact(gap))
        m = vi.Mechanism(
            mass=np.eye(2), damping=np.zeros((2, 2)), stiffness=np.diag([1.0, rate * rate]),
            elements=(vi.RigidStop(row=(1.0, -1.0), upper=limit, restitution=0.5),),
        )  # fmt: skip
        event = first_event(m, vi.State((0.0, 0.0), (1.0, rate)), t_max=2.0 * beat)
        if abs(gap) < 32.0 * UNIT * 2.0 * limit:
            assert event.status is vi.Status.GRAZING, gap
        elif abs(gap) > 8000.0 * UNIT * 2.0 * limit:
            assert event.status == (vi.Status.HORIZON if gap > 0 else vi.Status.IMPACT), gap


@pytest.mark.parametrize("clearance", [1e-2, 1e-4])
def test_both_stops_within_one_step_are_taken_in_order(clearance: float) -> None:
    d = paper_damper("A", 1.2, half_clearance=clearance, force=10.0)
    step = compile_mechanism(d.mechanism).step
    rng = np.random.default_rng(3)
    crossed = 0
    for _ in range(12):
        x1, v1 = rng.normal(size=2) * (5.0, 5.0)
        state = vi.State((x1, x1), (v1, v1 + rng.normal()), rng.uniform(0.0, 6.28))
        run = vi.simulate(d, state, impacts=12)
        assert np.all(run.status[:3] == vi.Status.IMPACT)
        crossed += run.time[1] < step and run.side[0] != run.side[1]
        for flight in flights(run):
            flight.check()
    assert crossed >= 8  # the attack was one


def test_a_gap_that_leaves_through_both_stops_in_one_polynomial_finds_the_first() -> None:
    """One step of 0.7 radians of motion a hundred times wider than the clearance."""
    d = paper_damper("A", 1.2, half_clearance=0.01, force=100.0)
    w = damper_witness(d)
    rng = np.random.default_rng(4)
    for _ in range(60):
        x1, v1, v2 = rng.normal(size=3) * (50.0, 50.0, 1.0)
        x2 = x1 + rng.uniform(-0.009, 0.009)
        phase = rng.uniform(0.0, 6.28)
        event = first_event(d, vi.State((x1, x2), (v1, v1 + v2), phase))
        z = reference.state(x1, v1, x2, v1 + v2, phase=phase)
        true = reference.first_contact(w, z, t_max=100)
        assert true is not None
        assert event.status is vi.Status.IMPACT
        assert "?AB"[event.side] == true.stop
        eps = float(stated_eps(d, x1, v1, x2, v1 + v2, phase, 1.0))
        assert abs(exact(event.time) - true.time) <= eps / abs(event.rate) + 4.0 * np.spacing(0.1)


def on_stop_a(d: vi.ImpactDamper, speed: float, phase: float, ulps: int) -> vi.State:
    """At rest but for the free mass, which leaves stop A; so many ulps off the stop."""
    x2 = d.half_clearance
    for _ in range(abs(ulps)):
        x2 = float(np.nextafter(x2, math.copysign(math.inf, ulps)))
    return vi.State((0.0, x2), (0.0, -speed), phase)


SPEEDS = [1.0, 1e-2, 1e-4, 1e-7, 1e-10, 1e-13, 1e-16, 1e-30, 1e-100, 1e-300, 5e-324, 0.0]
OPENS, CLOSES = 0.5 * math.pi, 1.5 * math.pi  # phases at which the gap accelerates by +1, -1


@pytest.mark.parametrize("ulps", [-1, 0, 1])
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.one_in(3)
def test_starts_on_a_stop_fly_on_where_the_gap_opens(speed: float, ulps: int) -> None:
    d = paper_damper("A", 1.2)
    event = first_event(d, on_stop_a(d, speed, OPENS, ulps))
    z = reference.state(0, 0, d.half_clearance, -speed, phase=OPENS)
    true = reference.first_contact(
        damper_witness(d), z, t_max=100, from_stop="A", order=1 if speed else 2
    )
    assert true is not None
    assert event.status is vi.Status.IMPACT
    assert "?AB"[event.side] == true.stop
    # ten or so steps, terms below 40: eps / speed, speeds are of order one
    assert abs(exact(event.time) - true.time) <= 64.0 * UNIT * 40.0 / abs(event.rate)


@pytest.mark.parametrize("ulps", [-1, 0, 1])
@pytest.mark.parametrize("speed", SPEEDS[1:])  # faster, it has no time to come to rest
def test_starts_on_a_stop_come_to_rest_where_the_gap_closes(speed: float, ulps: int) -> None:
    d = paper_damper("A", 1.2)
    run = vi.simulate(d, on_stop_a(d, speed, CLOSES, ulps), impacts=200, t_max=3.0)
    assert vi.Status.STICK in run.status
    assert np.all(run.side[run.status != vi.Status.HORIZON] == 1)
    # g = v t - t^2 / 2 + O(t^3) returns after 2 v (1 + O(v)), all ends after 2 v / (1 - R)
    stick = run.time[run.status == vi.Status.STICK][0]
    assert abs(stick - 2.0 * speed / (1.0 - d.restitution)) <= 20.0 * speed**2 + 1e-12 * speed


@pytest.mark.parametrize("speed", [1e-3, 1e-6, 1e-9, 1e-12])
def test_short_hops_keep_their_relative_accuracy(speed: float) -> None:
    d = paper_damper("A", 1.2, restitution=1.0)
    event = first_event(d, on_stop_a(d, speed, CLOSES, 0))
    z = reference.state(0, 0, d.half_clearance, -speed, phase=CLOSES)
    true = reference.first_contact(damper_witness(d), z, t_max=100, from_stop="A")
    assert true is not None
    assert event.status is vi.Status.IMPACT
    # gap acceleration and parameters carry a few roundings: so does 2 v / a
    assert abs(exact(event.time) / true.time - 1) <= 64.0 * UNIT
    assert abs(exact(event.rate) / speed + 1) <= 64.0 * UNIT + speed


@pytest.mark.parametrize("speed", [1.0, 1e-8, 1e-100, 1e-300])
def test_elastic_hops_of_any_size_last_two_v_over_g(speed: float) -> None:
    event = first_event(ball(1.0), vi.State((0.0,), (speed,)), t_max=100.0)
    assert event.status is vi.Status.IMPACT
    assert abs(event.time / (2.0 * speed / 9.8) - 1.0) <= 16.0 * UNIT
    assert abs(event.rate / -speed - 1.0) <= 16.0 * UNIT


@pytest.mark.parametrize("speed", [1e4, 1e5])
def test_a_ball_thrown_far_up_comes_back(speed: float) -> None:
    """Up and down in 9000 and in 90 000 steps, most of which are leapt over."""
    system = ball(1.0)
    event, duration = first_event(system, vi.State((0.0,), (speed,)), t_max=1e6), 2.0 * speed / 9.8
    assert event.status is vi.Status.IMPACT
    # 4 ulp of the height at every application of a stored step are UNIT of the duration each
    applications = 62 + duration / compile_mechanism(system).step / 1024
    assert abs(event.time / duration - 1.0) <= (16.0 + applications) * UNIT


def test_a_start_just_behind_a_stop_within_rounding_is_on_it() -> None:
    d = paper_damper("A", 1.2)
    for ulps in (-2, -1, 0, 1, 2):
        state = on_stop_a(d, -1.0, OPENS, ulps)  # approaching
        event = first_event(d, state)
        assert (event.status, event.time) == (vi.Status.IMPACT, 0.0)


@pytest.mark.parametrize(("name", "omega"), [("A", 0.3), ("B", 0.5), ("C", 0.4172)])
def test_no_flight_returns_to_its_stop_before_it_can(name: str, omega: float) -> None:
    """A flight that leaves at rate v is free of roots for 2 v / M: no re-trigger after impacts."""
    d = paper_damper(name, omega)
    run = vi.simulate(d, vi.State((0.3, 0.1), (0.2, 0.7)), impacts=20_000)
    hits = run.status == vi.Status.IMPACT
    after, same = hits[:-1] & hits[1:], run.side[:-1] == run.side[1:]
    wait = np.diff(run.time)[after & same]
    speed = run.rate_after[:-1][after & same]
    x, v = np.abs(run.position[:, 0]).max(), np.abs(run.velocity_after[:, 0]).max()
    reach = x + v / d.omega_n + d.force / (2.0 * d.zeta * d.omega_n * d.omega)
    bound = d.omega_n**2 * reach + 2.0 * d.zeta * d.omega_n**2 * reach + d.force
    assert len(wait) > 0
    assert np.all(wait >= 2.0 * speed / bound - 4.0 * np.spacing(run.time[-1]))
    assert np.all(run.rate_before[hits] < 0.0)
    opposite = np.diff(run.time)[after & ~same]
    assert opposite.min() > 0.0


def drifting(d: vi.ImpactDamper, speed: float) -> vi.State:
    """The main mass in its forced response; the free mass in the middle, nearly at rest."""
    w = damper_witness(d)
    p, q = map(float, w.apart.forced())
    return vi.State((q, 0.0), (d.omega * p, speed), 0.0)


@pytest.mark.parametrize("speed", [5.0e-4, -3.7e-4, 3.1e-4])
@pytest.mark.slow
def test_a_nearly_resting_mass_is_followed_for_ten_thousand_time_units(speed: float) -> None:
    """Peak after peak comes nearer to the stop by |speed| times a period: a train of grazes."""
    d = paper_damper("A", 1.3)
    state = drifting(d, speed)
    event = first_event(d, state)
    z = reference.state(*state.position[:1], *state.velocity[:1], *state.position[1:],
                        *state.velocity[1:], phase=0)  # fmt: skip
    true = reference.first_contact(damper_witness(d), z, t_max=20_000)
    assert true is not None
    assert event.time > 6000.0
    assert event.status is vi.Status.IMPACT
    assert "?AB"[event.side] == true.stop
    # rates rounded once or twice: the phase after 1e4 units is off by some 4 u omega t
    late = 4.0 * UNIT * d.omega * event.time * 2.0 / abs(event.rate) + np.spacing(event.time)
    assert abs(exact(event.time) - true.time) <= late


def test_a_mass_at_rest_in_the_clearance_is_silent() -> None:
    d = paper_damper("A", 1.3)
    run = vi.simulate(d, drifting(d, 0.0), impacts=1)
    assert run.end is vi.RunEnd.SILENT
    run = vi.simulate(d, drifting(d, 1e-300), impacts=1, t_max=1e4)
    assert run.end is vi.RunEnd.HORIZON
    assert run.time[-1] == 1e4


def test_the_horizon_cuts_a_flight_before_its_impact() -> None:
    d = paper_damper("A", 1.2)
    state = vi.State((0.2, 0.1), (0.0, 1.0), 0.3)
    t = first_event(d, state).time
    assert first_event(d, state, t_max=t * (1 - 4 * UNIT)).status is vi.Status.HORIZON
    assert first_event(d, state, t_max=t * (1 + 4 * UNIT)).status is vi.Status.IMPACT
