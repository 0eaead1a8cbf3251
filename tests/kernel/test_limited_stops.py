"""Soft stops whose damping force is limited by their spring force, against closed forms and SciPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import vibroimpact as vi
from vibroimpact import SoftStopState as S
from vibroimpact.model.parameters import with_parameter

Array = NDArray[np.float64]
UNIT = 2.0**-53
K, SPEED = 100.0, 1.0


def free(stop: vi.SoftStop) -> vi.Mechanism:
    return vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], elements=(stop,))


def forced(stop: vi.SoftStop, omega: float = 0.8) -> vi.Mechanism:
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], elements=(stop,),
        forces=(vi.Harmonic(omega, (1.5,)),),
    )  # fmt: skip


def contact(c: float) -> tuple[list[mpf], list[mpf], list[mpf]]:
    """Times since contact begins, penetrations and speeds where the force of one contact changes its law.

    Until c s' = k s the mass is on a spring 2 k; then on k and c, until c s' = -k s; then it is free.
    """
    k, c_, v = mpf(K), mpf(c), mpf(SPEED)
    fast = mp.sqrt(2 * k)
    first = mp.atan(c_ * fast / k) / fast
    s1, v1 = v / fast * mp.sin(fast * first), v * mp.cos(fast * first)
    a, turn = c_ / 2, mp.sqrt(mp.mpc(k - c_ * c_ / 4))

    def later(t: mpf) -> tuple[mpf, mpf]:
        cos, sin = mp.cos(turn * t), mp.sin(turn * t) / turn
        decay = mp.exp(-a * t)
        s = decay * (s1 * cos + (v1 + a * s1) * sin)
        speed = decay * (v1 * cos - (k * s1 + a * v1) * sin)
        return s.real, speed.real

    def room(t: mpf) -> mpf:
        s, speed = later(t)
        return c_ * speed + k * s

    # it falls from 2 k s1: the sign changes once before half a turn of the oscillator without a dashpot
    low, high = mpf(0), mp.pi / mp.sqrt(k)
    for _ in range(150):
        middle = (low + high) / 2
        low, high = (middle, high) if room(middle) > 0 else (low, middle)
    s2, v2 = later(low)
    times = [mpf(0), first, first + low, first + low - s2 / v2]
    return times, [mpf(0), s1, s2, mpf(0)], [v, v1, v2, v2]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("c", [0.5, 4.0, 30.0])
def test_one_contact_is_a_spring_of_twice_the_stiffness_then_a_dashpot_beside_it(
    c: float, side: int
) -> None:
    with mp.workdps(40):
        wanted = [[float(x) for x in part] for part in contact(c)]
    place = {"upper" if side > 0 else "lower": 0.0}
    stop = vi.SoftStop((1.0,), stiffness=K, damping=c, law="limited", **place)
    run = vi.simulate(free(stop), vi.State((-side * 1.0,), (side * SPEED,)), t_max=4.0)
    # a step is 0.7 / (sqrt(200) + 30) or more, and leaves 4 u; so does the first second
    allowed = 4.0 * UNIT * (16.0 + 4.0 * 45.0 / 0.7)
    np.testing.assert_allclose(run.time[:4] - 1.0, wanted[0], atol=allowed)
    np.testing.assert_allclose(side * run.position[:4, 0], wanted[1], atol=allowed)
    np.testing.assert_allclose(side * run.velocity_after[:4, 0], wanted[2], atol=allowed)
    pressed, behind, limited = (s for s in S if stop.side_of(s) == side)
    assert run.states[:4, 0].tolist() == [limited, pressed, behind, S.OPEN]
    assert list(run.status[:4]) == [vi.Status.ENGAGE, *[vi.Status.CHANGE] * 3]
    assert run.side[0] == side
    assert run.impacts[:4].tolist() == [True, False, False, False]


def test_without_a_dashpot_the_three_laws_are_the_same_spring() -> None:
    ends = set()
    for law in ("linear", "unilateral", "limited"):
        stop = vi.SoftStop((1.0,), -0.2, 0.3, stiffness=29.0, law=law)
        run = vi.simulate(forced(stop), vi.State((0.0,), (0.0,)), t_max=100.0)
        ends.add(run.position.tobytes() + run.states.tobytes())
    assert len(ends) == 1


def test_a_strong_dashpot_doubles_the_stiffness_and_gives_nothing_back() -> None:
    """The deepest place tends to v / sqrt(2 k), and the speed after it to k s / c."""
    for c in (1e3, 1e4):
        stop = vi.SoftStop((1.0,), upper=0.0, stiffness=K, damping=c, law="limited")
        run = vi.simulate(free(stop), vi.State((-1.0,), (SPEED,)), t_max=1.5)
        deepest = SPEED / math.sqrt(2.0 * K)
        released = list(run.states[:, 0]).index(S.BEHIND_UPPER)
        back = -run.velocity_after[released, 0]
        # where both end is k s / c off the speed zero; both are right to that in relation to the speed
        off = K * deepest / c / SPEED
        np.testing.assert_allclose(run.position[released, 0], deepest, rtol=4.0 * off)
        np.testing.assert_allclose(back, K * deepest / c, rtol=4.0 * off)


@pytest.mark.parametrize("motion", [(), vi.Harmonic(1.7, (0.1,), (0.05,))], ids=["still", "moving"])
def test_the_force_is_the_law_at_any_time_and_never_pulls(motion: Any) -> None:
    k, c, low, high = (30.0, 50.0), (4.0, 1.0), -0.3, 0.2
    stop = vi.SoftStop((1.0,), low, high, stiffness=k, damping=c, law="limited", motion=motion)
    run = vi.simulate(forced(stop), vi.State((0.0,), (0.5,)), t_max=60.0)
    assert {*run.states[:, 0]} == {*S}
    t = np.linspace(0.0, 60.0, 20_001)
    x, v = (part[:, 0] for part in run.at(t))
    if motion:
        x = x - 0.1 * np.sin(1.7 * t) - 0.05 * np.cos(1.7 * t)
        v = v - 1.7 * (0.1 * np.cos(1.7 * t) - 0.05 * np.sin(1.7 * t))
    wanted = np.zeros_like(t)
    for side, place, i in ((1, high, 1), (-1, low, 0)):
        spring = k[i] * np.maximum(side * (x - place), 0.0)
        wanted -= side * (spring + np.clip(c[i] * side * v, -spring, spring))
    force = run.forces(t)[:, 0]
    # lines and positions are right to 16 u of the angle, some 100
    np.testing.assert_allclose(force, wanted, atol=2.0 * max(k) * 16.0 * UNIT * 100.0)
    assert np.all(force * np.where(x > high, 1.0, -1.0) <= 0.0)


@pytest.mark.parametrize(("lower", "upper"), [(-0.3, 0.2), (0.1, 0.1)], ids=["gap", "no gap"])
def test_the_motion_is_that_of_scipy(lower: float, upper: float) -> None:
    k, c, w = (30.0, 50.0), (4.0, 1.0), 0.8

    def rate(t: float, y: Array) -> list[float]:
        x, v = y
        force = 1.5 * math.sin(w * t) - 0.1 * v - x
        for side, place, i in ((1, upper, 1), (-1, lower, 0)):
            spring = k[i] * max(side * (x - place), 0.0)
            force -= side * (spring + min(max(c[i] * side * v, -spring), spring))
        return [v, force]

    stop = vi.SoftStop((1.0,), lower, upper, stiffness=k, damping=c, law="limited")
    run = vi.simulate(forced(stop, w), vi.State((0.0,), (0.5,)), t_max=20.0)
    assert len(run) > 10
    # the right side has kinks: within a step over one an error of h^3, with h = 1e-3, remains of each
    witness = solve_ivp(
        rate, (0.0, 20.0), (0.0, 0.5), method="DOP853", rtol=1e-12, atol=1e-13, max_step=2e-3
    )
    x, v = run.at(np.array([20.0]))
    np.testing.assert_allclose([x[0, 0], v[0, 0]], witness.y[:, -1], atol=1e-8)


@pytest.mark.slow
def test_an_orbit_is_found_and_continued_and_its_multipliers_are_those_of_differences() -> None:
    m = forced(vi.SoftStop((1.0,), upper=0.4, stiffness=20.0, damping=3.0, law="limited"))
    orbit = vi.find_orbit(m, vi.State((0.0,), (0.0,)))
    assert orbit.symbol == "1-1-0"
    states = {S(int(s)) for s in vi.simulate(m, orbit.state, t_max=1.5 * orbit.period).states[:, 0]}
    assert states == {S.OPEN, S.UPPER, S.BEHIND_UPPER, S.LIMITED_UPPER}

    def after(x: float, v: float, phase: float) -> Array:
        end = vi.simulate(m, vi.State((x,), (v,), phase), t_max=orbit.period, impacts=1000)
        return np.array([end.position[-1, 0], end.velocity_after[-1, 0]])

    k = int(np.argmax(orbit.durations))
    compiled = orbit.problem.compiled(0.0)
    x, v, phase = compiled.after(orbit.states[k], orbit.durations[k] / 2.0, orbit.problem.modes[k])
    h = 2.0**-18  # the second-order term of a central difference is h^2, its rounding 1e-15 / h
    columns = [
        (after(x + dx, v + dv, phase) - after(x - dx, v - dv, phase)) / (2.0 * h)
        for dx, dv in ((h, 0.0), (0.0, h))
    ]
    differences = np.poly(np.linalg.eigvals(np.array(columns).T))
    np.testing.assert_allclose(np.poly(orbit.multipliers), differences, atol=1e-8)

    branch = vi.continue_orbit(orbit, "elements[0].damping", (2.0, 4.0))
    assert sorted(branch.values[[0, -1]]) == [2.0, 4.0]
    for c, multipliers in zip(branch.values[[0, -1]], branch.multipliers[[0, -1]], strict=True):
        other = vi.find_orbit(with_parameter(m, "elements[0].damping", float(c)), orbit.state)
        np.testing.assert_allclose(np.poly(other.multipliers), np.poly(multipliers), atol=1e-11)
