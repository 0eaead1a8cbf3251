"""Motions beside which the rates of their machine are slow, or that have none: theory.md, "Flight", *Pace*."""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import vibroimpact as vi

RATES = [10.0**-e for e in range(1, 25)]


def ball(
    omega: float, stiffness: float = 0.0, damping: float = 0.0, restitution: float = 0.9
) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], constant_force=(-9.8,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=restitution),),
        forces=(vi.Harmonic(omega, (1.0,), (0.5,)),),
    )  # fmt: skip


def impacts_of_a_free_ball(omega: float, phase: float, count: int) -> list[float]:
    """Impact times of x'' = -9.8 + sin(theta) + cos(theta) / 2, x(0) = 1, to 50 digits."""
    with mp.workdps(110):  # of which 1 - cos(w t) loses 50
        w, now, x, v, out = mp.mpf(omega), mp.mpf(0), mp.mpf(1), mp.mpf(0), []
        for _ in range(count):
            theta = mp.mpf(phase) + w * now
            # x(t) = x + v t - 4.9 t^2 + what the lines add, which begins with t^2
            sine, cosine = mp.sin(theta), mp.cos(theta)

            def fly(t: Any, x: Any = x, v: Any = v, sine: Any = sine, cosine: Any = cosine) -> Any:
                moved, turned = mp.cos(w * t), mp.sin(w * t)
                first = (1 - moved) / w**2, (w * t - turned) / w**2  # of cos and sin of w s
                place = sine * first[0] + cosine * first[1]
                place += (cosine * first[0] - sine * first[1]) / 2
                speed = sine * turned / w + cosine * (1 - moved) / w
                speed += (cosine * turned / w - sine * (1 - moved) / w) / 2
                g = mp.mpf(9.8)
                return x + v * t - g / 2 * t**2 + place, v - g * t + speed

            guess = (v + mp.sqrt(v**2 + 2 * mp.mpf(9.8) * x)) / mp.mpf(9.8)
            t = mp.findroot(lambda t, fly=fly: fly(t)[0], guess * mp.mpf(1.02), verify=False)
            now, x, v = now + t, mp.mpf(0), -mp.mpf(0.9) * fly(t)[1]
            out.append(float(now))
    return out


@pytest.mark.parametrize("phase", [0.0, 1.0, math.pi / 2.0, 4.0])
def test_a_force_of_any_slowness_acts_on_a_ball_as_at_fifty_digits(phase: float) -> None:
    for omega in RATES:
        expected = impacts_of_a_free_ball(omega, phase, 8)
        run = vi.simulate(ball(omega), vi.State((1.0,), (0.0,), phase), impacts=8)
        # a rate that costs LARGER, 2^14, of the digits: 2^-53 2^14 of the path, at speeds of some 4
        np.testing.assert_allclose(run.time[run.impacts], expected, rtol=1e-10, err_msg=str(omega))


@pytest.mark.parametrize("kind", ["spring", "dashpot", "both"])
def test_weak_springs_and_dashpots_tend_to_none(kind: str) -> None:
    """A rate r changes a path of a few units of time by a part of r at most."""
    free = vi.simulate(ball(1e-3), vi.State((1.0,), (0.0,)), impacts=8).time
    for rate in (r for r in RATES if r < 1e-3):
        stiffness, damping = rate**2 * (kind != "dashpot"), rate * (kind != "spring")
        m = ball(1e-3, stiffness, damping)
        run = vi.simulate(m, vi.State((1.0,), (0.0,)), impacts=8)
        np.testing.assert_allclose(run.time, free, rtol=20.0 * rate + 1e-10, err_msg=str(rate))


@pytest.mark.parametrize("rate", [1e-15, 1e-6, 1e-3, 1.0, 7.0, 1e6, 1e10])
def test_a_machine_without_a_rate_takes_its_step_from_its_start(rate: float) -> None:
    """Between two stops at the speed 2 rate; a falling ball; a block that friction stops."""
    between = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.RigidStop((1.0,), lower=-1.0, upper=1.0, restitution=1.0),),
    )  # fmt: skip
    run = vi.simulate(between, vi.State((0.0,), (2.0 * rate,)), impacts=5)
    np.testing.assert_allclose(run.time * rate, 0.5 + np.arange(5.0), rtol=1e-14)
    falling = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-rate * rate,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=1.0),),
    )  # fmt: skip
    run = vi.simulate(falling, vi.State((0.5,), (0.0,)), impacts=5)
    np.testing.assert_allclose(run.time * rate, 1.0 + 2.0 * np.arange(5.0), rtol=1e-13)
    sliding = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]],
        elements=(vi.Friction((1.0,), 0.5 * rate * rate),),
    )  # fmt: skip
    run = vi.simulate(sliding, vi.State((0.0,), (rate,)), t_max=10.0 / rate)
    assert run.time[0] * rate == pytest.approx(2.0, rel=1e-14)
    assert run.position[0, 0] == pytest.approx(1.0, rel=1e-13)


def test_members_of_a_sweep_have_the_bits_of_their_runs_at_any_pace() -> None:
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-9.8,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=0.9),),
    )  # fmt: skip
    heights = [1e-9, 1e-3, 0.1, 1.0, 1e4]
    start = vi.State((1.0,), (0.0,))
    found = vi.sweep(m, over={}, start=vi.GridStarts({"x1": heights}, start), settle_periods=0.0,
                     periods=2.0, observe=["final"], most_impacts=10**6, progress=False)  # fmt: skip
    for height, place in zip(heights, found.final_position.values.ravel(), strict=True):
        run = vi.simulate(m, vi.State((height,), (0.0,)), t_max=2.0, impacts=10**6)
        assert place == run.position[-1, 0]


@pytest.mark.parametrize("near", [1e-12, 1e-20, 2.4e-26, 1e-60, 1e-300])
@pytest.mark.parametrize("speed", [0.0, -0.86])
@pytest.mark.parametrize("soft", [False, True])
def test_a_start_next_to_a_stop_moves_as_one_on_it(near: float, speed: float, soft: bool) -> None:
    """What is left of a start of rounding's size is no length of the machine."""
    stop = (
        {"elements": (vi.SoftStop((1.0,), upper=0.0, stiffness=20.0, damping=0.1),)} if soft
        else {"elements": (vi.RigidStop((1.0,), upper=0.0, restitution=0.7),)}
    )  # fmt: skip
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(4.0, (1.0,)),), **stop
    )
    # the force pulls it away at first
    runs = [vi.simulate(m, vi.State((-x,), (speed,), 4.0), impacts=20) for x in (0.0, near)]
    there = [run.time[run.impacts][-10:] for run in runs]
    np.testing.assert_allclose(there[1], there[0], rtol=1e-9)
    behind = vi.simulate(m, vi.State((2.4e-26,), (speed - 0.1,), 4.0), impacts=20)
    assert behind.impacts.sum() == 20
