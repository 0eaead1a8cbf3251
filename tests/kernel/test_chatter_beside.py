"""Chatter beside what moves fast: summed only where nothing else can happen meanwhile."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support import UNIT

import vibroimpact as vi

SPEED, LASTS = 5e-9, 2e-8  # of the chatter of a mass under its weight 1 with R = 1/2: 4 v
HEAVY = 1e6  # weight of the mass beside it


def pair(push: float, stiffness: float, stop: float) -> vi.Mechanism:
    """Two unit masses, each above a stop of its own: one under its weight, one pushed down."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]],
        damping=[[0.0, 0.0], [0.0, 0.0]],
        stiffness=[[0.0, 0.0], [0.0, stiffness]],
        constant_force=(-1.0, -push),
        elements=(
            vi.RigidStop((1.0, 0.0), 1.0, math.inf, 0.5),
            vi.RigidStop((0.0, 1.0), stop, math.inf, 0.5),
        ),
    )


BESIDE = pytest.mark.parametrize(
    ("push", "stiffness", "stop"), [(HEAVY, 0.0, 0.0), (0.0, HEAVY, 1.0)], ids=["weight", "spring"]
)
PARTS = pytest.mark.parametrize("part", [0.1, 0.6, 0.9, 0.999, 1.001, 1.1, 2.0])


def assert_the_earlier_comes_first(run: vi.Run, beside: float, speed: float, part: float) -> None:
    """Of the end of the chatter and the blow of the mass beside, after this part of LASTS."""
    over = np.flatnonzero((run.contact == 1) | (run.status == vi.Status.CHATTER))[0]
    if part < 1.0:
        assert run.contact[over] == 1  # the other one may be within rounding of its own stop
        assert run.status[over] in (vi.Status.IMPACT, vi.Status.SIMULTANEOUS)
        # places of size 1 are known to some roundings, and so times to that over the speed
        assert abs(run.time[over] - beside) <= 16.0 * UNIT / speed
    else:
        assert (run.status[over], run.contact[over]) == (vi.Status.CHATTER, 0)
        assert run.time[over] == pytest.approx(LASTS, rel=64.0 * UNIT)


@BESIDE
@PARTS
def test_chatter_is_summed_if_a_hop_beside_it_takes_longer(
    push: float, stiffness: float, stop: float, part: float
) -> None:
    """Under a weight a the hop takes 2 v / a; on a spring 2 arctan(v / w) / w."""
    speed = 0.5 * part * LASTS * HEAVY
    w = math.sqrt(stiffness)
    hop = 2.0 * math.atan(speed / w) / w if stiffness else 2.0 * speed / push
    start = vi.State((1.0, stop), (SPEED, speed))
    run = vi.simulate(pair(push, stiffness, stop), start, impacts=60, t_max=1.0)
    assert_the_earlier_comes_first(run, hop, speed, part)


@BESIDE
@PARTS
def test_chatter_is_summed_if_a_fall_beside_it_takes_longer(
    push: float, stiffness: float, stop: float, part: float
) -> None:
    """From rest at the height h it takes sqrt(2 h / a); on a spring cos(w t) = 1 / (1 + h)."""
    place = stop + 0.5 * (part * LASTS) ** 2 * HEAVY
    height, w = place - stop, math.sqrt(stiffness)
    half = math.asin(math.sqrt(0.5 * height / (1.0 + height)))  # of the angle
    fall = 2.0 * half / w if stiffness else math.sqrt(2.0 * height / push)
    start = vi.State((1.0, place), (SPEED, 0.0))
    run = vi.simulate(pair(push, stiffness, stop), start, impacts=60, t_max=1.0)
    assert_the_earlier_comes_first(run, fall, math.sqrt(2.0 * HEAVY * height), part)


@pytest.mark.parametrize("rate", [1.0, 1e3])
def test_chatter_is_not_summed_over_more_than_a_step_of_what_swings_beside_it(rate: float) -> None:
    """A mass under a weight so small that it hops for many periods of an oscillator, a cosine."""
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.0, 0.0], [0.0, 0.0]],
        stiffness=[[0.0, 0.0], [0.0, rate**2]], constant_force=(-1e-20 * rate**2, 0.0),
        elements=(vi.RigidStop((1.0, 0.0), 1.0, math.inf, 0.5),),
    )  # fmt: skip
    start = vi.State((1.0, 1.0), (4e-19 * rate, 0.0))  # the hops take 160 / rate in all
    run = vi.simulate(m, start, impacts=10**4, t_max=200.0 / rate)
    assert vi.Status.CHATTER in run.status
    swing = np.cos(rate * run.time)
    # some 300 steps, of a few roundings each
    np.testing.assert_allclose(run.position[:, 1], swing, rtol=0.0, atol=1000.0 * UNIT)
