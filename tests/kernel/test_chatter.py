"""Chatter completed, sticking and release: closed forms, and the damper of set C."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from support import UNIT
from support.kernel import growth
from support.members import alone_like
from support.members import run as run_members
from support.systems import PAPER_SETS, ball, oscillator, paper_damper

import vibroimpact as vi
from vibroimpact.sweeps.execution.batch import batch_of
from vibroimpact.sweeps.observers import Final, Impacts

REFERENCE = Path(__file__).parents[1] / "reference" / "chatter.toml"


def events_of(run: vi.Run) -> list[vi.Status]:
    """Statuses without the impacts."""
    return [vi.Status(s) for s in run.status if s != vi.Status.IMPACT]


@pytest.mark.parametrize("t_max", [10.0, math.inf])
def test_bouncing_ball_comes_to_rest_after_three_falls(t_max: float) -> None:
    """h = 1, g = 9.8, e = 1/2: sqrt(2 h / g) (1 + e) / (1 - e) = 3 sqrt(2 / 9.8)."""
    run = vi.simulate(ball(0.5), vi.State((1.0,), (0.0,)), impacts=1000, t_max=t_max)
    assert events_of(run) == [vi.Status.CHATTER, vi.Status.STICK, vi.Status.HORIZON]
    rest = run.time[run.status == vi.Status.CHATTER][0]
    # some sixty flights, each a rounding or two of a second
    assert abs(rest - 3.0 * math.sqrt(2.0 / 9.8)) <= 64.0 * UNIT
    assert np.all(run.position[-2:] == 0.0)
    assert np.all(run.velocity_after[-2:] == 0.0)


def test_every_bounce_of_the_ball_is_where_it_must_be() -> None:
    run = vi.simulate(ball(0.5), vi.State((1.0,), (0.0,)), impacts=1000, t_max=10.0)
    fall = math.sqrt(2.0 / 9.8)
    n = int((run.status == vi.Status.IMPACT).sum())
    assert n > 20
    expected = fall * (3.0 - 4.0 * 0.5 ** np.arange(1, n + 1))
    np.testing.assert_allclose(run.time[:n], expected, rtol=0.0, atol=64.0 * UNIT)
    np.testing.assert_allclose(
        -run.rate_before[:n], 9.8 * fall * 0.5 ** np.arange(n), rtol=64.0 * UNIT
    )


@pytest.mark.parametrize("restitution", [0.0, 0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("speed", [1.0, 1e-5, 1e-150, 1e-300])
def test_accumulation_time_is_the_geometric_series(restitution: float, speed: float) -> None:
    start = vi.State((0.0,), (speed,))
    run = vi.simulate(ball(restitution), start, impacts=5000, t_max=1000.0)
    rest = run.time[run.status == vi.Status.STICK][0]
    # up to log(1e-16) / log(R) flights of relative accuracy u, in a sum dominated by the first
    expected = 2.0 * speed / (9.8 * (1.0 - restitution))
    assert abs(rest / expected - 1.0) <= 64.0 * UNIT / (1.0 - restitution)


def test_an_elastic_ball_never_rests() -> None:
    run = vi.simulate(ball(1.0), vi.State((1.0,), (0.0,)), impacts=1000)
    assert np.all(run.status == vi.Status.IMPACT)
    expected = math.sqrt(2.0 / 9.8) * (2.0 * np.arange(1, 1001) - 1.0)
    # each flight keeps the speed to a few roundings: they add up linearly in time
    np.testing.assert_allclose(run.time, expected, rtol=1000 * 4.0 * UNIT)


def test_a_plastic_ball_rests_at_its_first_impact() -> None:
    run = vi.simulate(ball(0.0), vi.State((1.0,), (0.0,)), impacts=5, t_max=10.0)
    assert [vi.Status(s) for s in run.status] == [
        vi.Status.IMPACT, vi.Status.STICK, vi.Status.HORIZON,
    ]  # fmt: skip
    assert run.time[0] == run.time[1]


@pytest.mark.parametrize("speed", [0.09, 0.0699, 0.01, 1e-8, 1e-150])
def test_a_hop_under_a_push_and_a_spring_lasts_two_arctangents(speed: float) -> None:
    """x'' + x = -1 from 0 at v: 1 - cos t = v sin t, so tan(t / 2) = v, and it is back at -v."""
    hopper = oscillator(stiffness=1.0, damping=0.0, constant_force=-1.0, lower=0.0)
    run = vi.simulate(hopper, vi.State((0.0,), (speed,)), impacts=1)
    # exact zeros at the start: the root is that of a polynomial with coefficients right to an ulp
    assert abs(run.time[0] / (2.0 * math.atan(speed)) - 1.0) <= 8.0 * UNIT
    assert abs(run.rate_before[0] / -speed - 1.0) <= 8.0 * UNIT


@pytest.mark.parametrize("part", [0.2, 1 / 20, 1 / 130, 1 / 900, 1 / 1100, 1 / 5000])
def test_a_hop_on_a_shaken_floor_keeps_its_relative_accuracy(part: float) -> None:
    """x'' = 3 sin(t + 3.3) - 1, 50 digits; 5/4 of the hop take a part of the step, some 7/10."""
    shaken = replace(ball(1.0, gravity=1.0), forces=(vi.Harmonic(1.0, (3.0,)),))
    phase = 3.3
    speed = 0.4 * 0.7 * part * (1.0 - 3.0 * math.sin(phase))
    run = vi.simulate(shaken, vi.State((0.0,), (speed,), phase), impacts=1)
    with mpmath.workdps(50):
        sine, cosine = 3 * mpmath.sin(phase), 3 * mpmath.cos(phase)

        def climbed(t: mpmath.mpf) -> mpmath.mpf:
            """The height over t."""
            return speed + cosine - t / 2 + (sine - 3 * mpmath.sin(t + phase)) / t

        back = mpmath.findroot(climbed, float(run.time[0]))
        rate = speed + cosine - back - 3 * mpmath.cos(back + phase)
        errors = [run.time[0] / back - 1, run.rate_before[0] / rate - 1]
    # bend and speed are right to some ulp of their terms, which are hardly larger than they
    assert max(abs(float(error)) for error in errors) <= 16.0 * UNIT


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5])
def test_members_hop_as_one_does_alone(restitution: float) -> None:
    """Beside flights of all lengths; the elastic ones more often in a row than lanes let them."""
    jumper, end = ball(restitution), 3.0
    starts = [vi.State((0.0,), (10.0**-i,)) for i in range(4)] + [vi.State((1.0,), (0.3,))]
    found = run_members(batch_of(jumper, {}), starts, 0.0, end, [Final(), Impacts()])
    for i, start in enumerate(starts):
        alone = alone_like(found, i, jumper, start, end)
        hits = np.isin(alone.status, [vi.Status.IMPACT, vi.Status.CHATTER]).sum()
        if alone.end is vi.RunEnd.IMPACTS:  # the cap: no results but the state
            assert np.isnan(found["impacts_b"][i])
        else:
            assert found["impacts_b"][i] * alone.time[-1] == pytest.approx(hits)  # a rate


def test_a_stop_below_the_top_of_a_hop_is_met() -> None:
    """With T = tan(t / 2) the height is h where (2 + h) T^2 - 2 v T + h = 0."""
    speed, height = 0.05, 0.001  # the top would be at sqrt(1 + v^2) - 1 = 0.00125
    hopper = oscillator(stiffness=1.0, damping=0.0, constant_force=-1.0, lower=0.0, upper=height)
    run = vi.simulate(hopper, vi.State((0.0,), (speed,)), impacts=1)
    rising = math.sqrt(speed**2 - height * (2.0 + height))
    expected = 2.0 * math.atan((speed - rising) / (2.0 + height))
    assert run.side[0] == 1  # A, the upper one
    # rounding of a position composed of terms of size 1, over the speed
    assert abs(run.time[0] - expected) <= 16.0 * UNIT / rising


def test_a_ball_put_down_stays_down() -> None:
    run = vi.simulate(ball(0.5), vi.State((0.0,), (0.0,)), impacts=5, t_max=10.0)
    assert events_of(run) == [vi.Status.STICK, vi.Status.HORIZON]
    x, v = run.at([0.0, 3.0, 10.0])
    assert np.all(x == 0.0)
    assert np.all(v == 0.0)


def short_hop(speed: mpmath.mpf, a: mpmath.mpf, b: mpmath.mpf, c: mpmath.mpf) -> Any:
    """How long x'' = a + b t + c t^2 / 2 < 0 takes back to x = 0, and the speed there."""
    back = mpmath.mpf(0)
    for _ in range(6):  # each adds the digits of a time below 1e-7
        back = -2 * (speed + back**2 * (b / 6 + back * c / 24)) / a
    return back, -(speed + back * (a + back * (b / 2 + back * c / 6)))


@pytest.mark.parametrize("restitution", [0.9, 0.99])
@pytest.mark.parametrize("part", [0.1, 3.0, 30.0])
def test_chatter_is_summed_where_the_change_of_the_push_is_lost(
    part: float, restitution: float
) -> None:
    """x'' = (sin(t + 0.6) - 1) / 100, 50 digits, bounce by bounce.

    Bound (2) of transition/rest.hpp leaves the speed off by 2^-53 of the forced one, 1/100: the time by
    that over a. Speeds of `part` of it begin below, or between it and what it is without (1 - R)^2.
    """
    size, phase = 0.01, 0.6
    push, jerk = size * (1.0 - math.sin(phase)), size * math.cos(phase)
    start = part * math.sqrt(UNIT * size / jerk) * push * (1.0 - restitution)
    shaken = replace(
        ball(restitution, gravity=size), forces=(vi.Harmonic(1.0, (size,)),),
        elements=(vi.RigidStop((1.0,), 1.0, math.inf, restitution),),
    )  # fmt: skip
    run = vi.simulate(shaken, vi.State((1.0,), (start,), phase), impacts=10**5, t_max=1.0)
    with mpmath.workdps(50):
        ends, speed = mpmath.mpf(0), mpmath.mpf(start)
        while speed > 1e-18:
            sine, cosine = size * mpmath.sin(phase + ends), size * mpmath.cos(phase + ends)
            back, landing = short_hop(speed, sine - size, cosine, -sine)
            ends, speed = ends + back, restitution * landing
        ends += 2 * speed / (push * (1 - mpmath.mpf(restitution)))
        late = abs(float(run.time[run.status == vi.Status.CHATTER][0] - ends))
    # (T20): 4/3 of that, of a speed that is the sum of two and of what a step may add
    assert late <= 4.0 * UNIT * size / push


@pytest.mark.parametrize("restitution", [0.9, 0.99])
@pytest.mark.parametrize("part", [0.1, 3.0, 30.0])
def test_chatter_is_summed_where_it_leaves_the_stop_by_rounding(
    part: float, restitution: float
) -> None:
    """A sum in one flight ends 2 R v^2 / (g (1 - R)^2) behind the stop: 2^-53 of 1 + 1 at most."""
    bound = math.sqrt(UNIT * 2.0 * 9.8) * (1.0 - restitution)
    on_one = replace(
        ball(restitution), elements=(vi.RigidStop((1.0,), 1.0, math.inf, restitution),)
    )
    run = vi.simulate(on_one, vi.State((1.0,), (part * bound,)), impacts=10**5, t_max=1.0)
    end = run.position[run.status == vi.Status.CHATTER][0, 0]
    assert abs(end - 1.0) <= 6.0 * UNIT  # 4 and a rounding


def pressed(preload: float, stiffness: float, restitution: float = 0.5) -> vi.Mechanism:
    """A unit mass pressed down on x = 0 by a preload and lifted by sin(t)."""
    return oscillator(
        stiffness=stiffness, damping=0.0, forces=(vi.Harmonic(1.0, (1.0,)),),
        constant_force=-preload, lower=0.0, upper=math.inf, restitution=restitution,
    )  # fmt: skip


@pytest.mark.parametrize("stiffness", [0.0, 4.0])
@pytest.mark.parametrize("preload", [0.05, 0.5, 0.99])
def test_release_is_where_the_lifting_force_exceeds_the_preload(
    preload: float, stiffness: float
) -> None:
    run = vi.simulate(
        pressed(preload, stiffness), vi.State((0.0,), (0.0,), 0.0), impacts=1, t_max=20.0
    )
    assert [vi.Status(s) for s in run.status[:2]] == [vi.Status.STICK, vi.Status.RELEASE]
    assert run.time[0] == 0.0
    # the force is released once surely negative: eps / rate, rate = cos
    late = 64.0 * UNIT * (1.0 + preload) * 4.0 / math.sqrt(1.0 - preload**2)
    assert abs(run.time[1] - math.asin(preload)) <= late
    assert abs(run.phase[1] - math.asin(preload)) <= late


@pytest.mark.parametrize("preload", [0.05, 0.5])
def test_flight_after_release_starts_from_rest_with_zero_acceleration(preload: float) -> None:
    """x'' = sin(t) - p from t1 = asin(p): x = cos(t1) s - (sin(t1 + s) - p) - p s^2 / 2."""
    run = vi.simulate(pressed(preload, 0.0), vi.State((0.0,), (0.0,), 0.0), impacts=1)
    t1 = math.asin(preload)
    hit = float(run.time[-1])
    for s in np.linspace(0.05, 1.0, 12) * (hit - run.time[1]):
        x, v = run.at(min(run.time[1] + s, np.nextafter(hit, 0.0)))
        true = math.cos(t1) * s - (math.sin(t1 + s) - preload) - 0.5 * preload * s * s
        speed = math.cos(t1) - math.cos(t1 + s) - preload * s
        # the size of the terms of the closed form
        assert abs(x[0] - true) <= 64.0 * UNIT * (4.0 + s * s)
        assert abs(v[0] - speed) <= 64.0 * UNIT * (4.0 + s)


def test_a_force_that_never_lifts_never_releases() -> None:
    run = vi.simulate(pressed(1.5, 0.0), vi.State((0.0,), (0.0,), 0.0), impacts=1, t_max=500.0)
    assert events_of(run) == [vi.Status.STICK, vi.Status.HORIZON]


@pytest.mark.parametrize("preload", [1.0 - 1e-6, 1.0 + 1e-6])
def test_a_force_that_just_lifts_is_decided(preload: float) -> None:
    run = vi.simulate(
        pressed(preload, 0.0, 0.0), vi.State((0.0,), (0.0,), 0.0), impacts=1, t_max=6.0
    )
    released = vi.Status.RELEASE in run.status
    assert released == (preload < 1.0)


def test_a_start_at_rest_with_an_opening_force_flies_off() -> None:
    run = vi.simulate(pressed(0.5, 0.0), vi.State((0.0,), (0.0,), 0.5 * math.pi), impacts=1)
    assert run.status[0] == vi.Status.IMPACT
    assert run.time[0] > 1.0


@pytest.mark.parametrize("delta", [1e-13, 1e-12, 1e-9, 1e-6, 1e-5, 1e-4, 1e-3])
def test_a_hop_from_rest_is_an_impact_if_it_lands_faster_than_rounding(delta: float) -> None:
    """x'' = sin(t + f) - sin(f), f = pi / 2 - d: x = d t^3 / 6 - t^4 / 24, zero at 4 d.

    It lands at -8/3 d^3, both but for parts of d^2; speeds are sums of terms of size one.
    """
    start = vi.State((0.0,), (0.0,), 0.5 * math.pi - delta)
    run = vi.simulate(pressed(math.cos(delta), 0.0), start, impacts=1, t_max=1.0)
    off = delta**2 + 32.0 * UNIT / delta  # relative, of the jerk: roundings of phases and sines
    assert run.time[0] == pytest.approx(4.0 * delta, rel=off)
    if delta < 1e-4:  # 2.7e-15 and less, below 64 roundings of one
        assert [vi.Status(s) for s in run.status] == [
            vi.Status.GRAZING, vi.Status.STICK, vi.Status.HORIZON,
        ]  # fmt: skip
        assert np.all(run.velocity_after == 0.0)
    else:  # 2.7e-12 and more
        assert run.status[0] == vi.Status.IMPACT
        assert run.rate_before[0] == pytest.approx(-8.0 / 3.0 * delta**3, rel=3.0 * off)


CASES: dict[str, Any] = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))
DAMPER = paper_damper("C", CASES["parameters"]["omega"])


def close(run: vi.Run, event: int) -> float:
    """What rounding explains at an event: some 4 u of the size of the motion, grown since.

    Completing the chatter leaves out terms below u, by its own bound.
    """
    size = float(np.abs(run.position).max() + np.abs(run.velocity_before).max())
    count = int(run.impacts[: event + 1].sum())
    return 4.0 * UNIT * size * growth(DAMPER, run.start, range(1, count + 1))


def assert_times(run: vi.Run, first: int, times: list[str], stops: list[str]) -> None:
    for event, (time, stop) in enumerate(zip(times, stops, strict=True), start=first):
        assert abs(run.time[event] - float(time)) <= close(run, event)
        assert "?AB"[run.side[event]] == stop


def assert_state(run: vi.Run, event: int, wanted: list[str]) -> None:
    theta = run.phase[event]
    got = [run.position[event, 0], run.velocity_after[event, 0], run.position[event, 1],
           run.velocity_after[event, 1], math.sin(theta), math.cos(theta)]  # fmt: skip
    np.testing.assert_allclose(got, [float(x) for x in wanted], rtol=0.0, atol=close(run, event))


@pytest.mark.parametrize("case", CASES["case"], ids=["at A", "at A, slowly", "at B", "later at A"])
def test_chatter_and_release_of_the_damper_agree_with_the_reference(case: dict[str, Any]) -> None:
    x1, v1, x2, v2 = case["start"]
    run = vi.simulate(DAMPER, vi.State((x1, x2), (v1, v2), case["phase"]), impacts=100)
    assert_times(run, 0, case["impact_times"], case["impact_stops"])
    end = int(np.flatnonzero(run.status == vi.Status.CHATTER)[0])
    assert [vi.Status(s) for s in run.status[end : end + 3]] == [
        vi.Status.CHATTER, vi.Status.STICK, vi.Status.RELEASE,
    ]  # fmt: skip
    assert_times(run, end, [case["chatter_time"]], [case["stop"]])
    assert_state(run, end, case["chatter_state"])
    assert_times(run, end + 2, [case["release_time"]], [case["stop"]])
    assert_state(run, end + 2, case["release_state"])
    assert_times(run, end + 3, case["next_times"], case["next_stops"])


def test_the_reference_is_for_the_paper_set() -> None:
    assert {k: v for k, v in CASES["parameters"].items() if k != "omega"} == PAPER_SETS["C"]


def test_masses_move_as_one_while_stuck() -> None:
    x1, v1, x2, v2 = CASES["case"][0]["start"]
    run = vi.simulate(DAMPER, vi.State((x1, x2), (v1, v2), CASES["case"][0]["phase"]), impacts=400)
    stuck = int(np.flatnonzero(run.status == vi.Status.STICK)[0])
    assert run.status[stuck + 1] == vi.Status.RELEASE
    t = np.linspace(run.time[stuck], run.time[stuck + 1], 50)[1:-1]
    x, v = run.at(t)
    np.testing.assert_allclose(x[:, 1] - x[:, 0], DAMPER.half_clearance, rtol=16.0 * UNIT)
    np.testing.assert_allclose(v[:, 1], v[:, 0], rtol=0.0, atol=16.0 * UNIT * np.abs(v).max())
