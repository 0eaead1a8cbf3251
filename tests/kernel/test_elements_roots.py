"""Double roots and near misses of the guards of elements: none missed, none invented.

A motion of one coordinate is (x - c)^2 + v^2 = A^2; what a guard reads of it has an extremum that
depends on A alone. It is put at the limit but for a depth from 1e-3 to below rounding, on both
sides. Whether the limit is passed is known exactly, by rational numbers, from the start.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pytest

import vibroimpact as vi

UNIT = 2.0**-53
STARTS = 1500  # of each kind
# The proof takes 2^-53 (16 + 4 n) of the terms of a guard as rounding: below 8 here, those of its
# derivative times a step included; steps are of 0.7 / 5 or more, so that n < 16 up to the extremum.
ROUNDING = UNIT * (16 + 4 * 16) * 8.0
FIRED = (vi.Status.IMPACT, vi.Status.ENGAGE, vi.Status.CHANGE, vi.Status.NON_UNIQUE)


def one(*elements: Any, damping: float = 0.0, stiffness: float = 1.0, push: float = 0.0,
        **more: Any) -> vi.Mechanism:  # fmt: skip
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], constant_force=(push,),
        elements=elements, **more,
    )  # fmt: skip


class Case(NamedTuple):
    machine: vi.Mechanism
    start: Callable[[float, float], tuple[float, float]]  # (depth, angle) -> x, v
    depth: Callable[[Fraction, Fraction], Fraction]  # beyond the limit, up to a factor near 1
    within: float  # time up to and beyond the extremum
    span: tuple[float, float] = (0.3, 1.5)  # of the angle before the extremum
    where: float | None = None  # least |x| of an event that counts


def circle(center: float, radius: float, turn: float) -> Callable[..., tuple[float, float]]:
    """A start on the circle, an angle before it comes to the turn: x - c = A sin."""
    return lambda depth, angle: (
        center + radius * (1.0 + depth) * math.sin(turn - angle),
        radius * (1.0 + depth) * math.cos(turn - angle),
    )


def outside(center: float, radius: float, drift: float = 0.0) -> Callable[..., Fraction]:
    """(A^2 / radius^2 - 1) / 2, exactly."""
    c, r, d = map(Fraction, (center, radius, drift))
    return lambda x, v: (((x - c) ** 2 + (v - d) ** 2) / r**2 - 1) / 2


def hyperbola(depth: float, angle: float) -> tuple[float, float]:
    """x = 1 - a exp(t) + b exp(-t), of which x + 2 x' is greatest after a while, and then depth."""
    s = 1.0 - depth
    a, b = s / 6.0 * math.exp(-angle), s / 2.0 * math.exp(angle)
    return 1.0 - a + b, -a - b


HALF = math.pi / 2.0
CASES = {
    "a soft stop is met": Case(
        one(vi.SoftStop((1.0,), upper=1.0, stiffness=5.0)), circle(0.0, 1.0, HALF),
        outside(0.0, 1.0), 2.0),
    "a soft stop with a dashpot is met from above": Case(
        one(vi.SoftStop((1.0,), lower=-1.0, stiffness=5.0, damping=0.5)),
        circle(0.0, 1.0, -HALF), outside(0.0, 1.0), 2.0),
    "a soft stop is left where its gap opens": Case(
        one(vi.SoftStop((1.0,), upper=0.0, stiffness=1.0, law="linear"), stiffness=0.0, push=1.0),
        circle(1.0, 1.0, -HALF), outside(1.0, 1.0), 2.0),
    "a soft stop lets go where its force is zero": Case(  # x + 3/4 x', A = 4/5
        one(vi.SoftStop((1.0,), upper=0.0, stiffness=1.0, damping=0.75), stiffness=0.0, push=1.0,
            damping=-0.75),
        circle(1.0, 0.8, -HALF - math.atan(0.75)), outside(1.0, 0.8), 2.0),
    "a soft stop touches again where its force presses": Case(  # 3 (v^2 - (x - 1)^2) < 1
        one(vi.SoftStop((1.0,), upper=0.0, stiffness=1.0, damping=2.0), stiffness=-1.0, push=-1.0),
        hyperbola, lambda x, v: (1 - 3 * (v * v - (x - 1) ** 2)) / 2, 2.0, where=0.5),
    "friction slips no more": Case(
        one(vi.Friction((1.0,), kinetic=0.5, belt_speed=-1.0)), circle(-0.5, 1.0, math.pi),
        outside(-0.5, 1.0), 2.0),
    "friction slips backward no more": Case(
        one(vi.Friction((1.0,), kinetic=0.5, belt_speed=1.0)), circle(0.5, 1.0, 0.0),
        outside(0.5, 1.0), 2.0),
    "a rigid stop that moves is met": Case(  # x - sin(t) / 2 is as free
        one(vi.RigidStop((1.0,), upper=1.0, restitution=0.5,
                         motion=vi.Harmonic(1.0, (0.5,)))),
        lambda depth, angle: (math.cos(angle) * (1.0 + depth),
                              0.5 + math.sin(angle) * (1.0 + depth)),
        outside(0.0, 1.0, 0.5), 2.0),
    "a soft stop that moves is met": Case(
        one(vi.SoftStop((1.0,), upper=1.0, stiffness=5.0, damping=0.2,
                        motion=vi.Harmonic(1.0, (0.5,)))),
        lambda depth, angle: (math.cos(angle) * (1.0 + depth),
                              0.5 + math.sin(angle) * (1.0 + depth)),
        outside(0.0, 1.0, 0.5), 2.0),
    "friction breaks away from a belt that swings": Case(  # force x - 3/2 sin(2 t)
        one(vi.Friction((1.0,), kinetic=1.0, static=2.0,
                        motion=vi.Harmonic(2.0, (0.5,)))),
        lambda depth, _: (-0.5 - depth, 1.0), lambda x, _: -x - Fraction(1, 2), 1.5),
    "friction breaks away under a force that swings": Case(
        one(vi.Friction((1.0,), kinetic=1.0, static=2.0), forces=(vi.Harmonic(2.0, (1.5,)),)),
        lambda depth, _: (-0.5 - depth, 0.0), lambda x, _: -x - Fraction(1, 2), 1.5),
}  # fmt: skip


def depths() -> np.ndarray[Any, np.dtype[np.float64]]:
    """From 1e-3 down to 1e-17 on both sides, and the limit itself."""
    each = np.logspace(-3.0, -17.0, STARTS // 2)
    return np.concatenate([each, -each, np.zeros(8)])


@pytest.mark.parametrize("what", CASES)
@pytest.mark.one_in(3)
def test_no_touch_is_missed_and_none_invented(what: str) -> None:
    case = CASES[what]
    rng = np.random.default_rng(0)
    passed = short = 0
    for depth in depths():
        x, v = case.start(float(depth), float(rng.uniform(*case.span)))
        run = vi.simulate(case.machine, vi.State((x,), (v,)), t_max=case.within)
        true = float(case.depth(Fraction(x), Fraction(v)))
        fired = [
            i for i in range(len(run)) if run.status[i] in FIRED
            and (case.where is None or abs(run.position[i, 0]) > case.where)
        ]  # fmt: skip
        if true > ROUNDING:
            assert fired, f"missed: depth {true}, start {x}, {v}"
            passed += 1
        if true < -ROUNDING:
            assert not fired, f"invented: depth {true}, start {x}, {v}"
            short += 1
        assert run.end in (vi.RunEnd.HORIZON, vi.RunEnd.IMPACTS)
    assert min(passed, short) > 0.6 * STARTS / 2


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_graze_of_a_soft_stop_is_entered_when_it_is(depth: float) -> None:
    m = one(vi.SoftStop((1.0,), upper=1.0, stiffness=3.0))
    v = math.sqrt(2.0 * depth + depth**2)  # at x = -1: of amplitude 1 + depth
    run = vi.simulate(m, vi.State((-1.0,), (v,)), impacts=1)
    assert run.status[0] == vi.Status.ENGAGE
    # -cos t + v sin t = 1; there it moves at v, and what is rounding of x takes that long
    assert abs(run.time[0] - (math.pi - 2.0 * math.atan(v))) < ROUNDING / v


# ---- starts on the guard itself ------------------------------------------------------------------
# The first derivative that is not zero decides: v, then the acceleration, then that of the force.
STUCK = vi.Friction((1.0,), kinetic=0.25, static=0.5)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_start_on_a_soft_stop_leaves_by_the_first_derivative_that_is_not_zero(
    side: float, order: int, damping: float
) -> None:
    stop = vi.SoftStop((1.0,), upper=0.0, stiffness=4.0, damping=damping)
    free = one(vi.SoftStop((1.0,), upper=9.0), **into(side, order))
    m = one(stop, **into(side, order))
    start = vi.State((0.0,), (side if order == 1 else 0.0,))
    after = vi.simulate(m, start, t_max=0.01).position[-1, 0]
    alone = vi.simulate(free, start, t_max=0.01).position[-1, 0]
    assert side * alone > 0.0
    if side < 0.0:
        assert after == alone
    else:
        assert 0.0 < after < alone


def into(side: float, order: int) -> dict[str, Any]:
    """A push whose first derivative that is not zero is of this order."""
    if order == 2:
        return {"stiffness": 0.0, "push": side}
    if order == 3:
        return {"stiffness": 0.0, "forces": (vi.Harmonic(1.0, (side,)),)}
    return {}


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("order", [1, 2])
def test_friction_at_its_static_level_breaks_away_if_the_force_grows(
    side: float, order: int
) -> None:
    line = (
        vi.Harmonic(1.0, (0.1 * side,)) if order == 1 else vi.Harmonic(1.0, (0.0,), (-0.1 * side,))
    )
    held = 0.5 if order == 1 else 0.5 + 0.1 * side
    m = one(STUCK, stiffness=0.0, push=held, forces=(line,))
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), t_max=0.01)
    assert (run.velocity_after[-1, 0] > 0.0) == (side > 0.0)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_start_on_a_moving_stop_with_its_speed_leaves_where_the_stop_lags(
    restitution: float,
) -> None:
    w, a = 2.0, 0.3
    stop = vi.RigidStop((1.0,), upper=0.0, restitution=restitution,
                        motion=vi.Harmonic(w, (a,)))  # fmt: skip
    for phase in np.linspace(0.1, 6.2, 40):
        place, speed = a * math.sin(phase), a * w * math.cos(phase)
        run = vi.simulate(one(stop), vi.State((place,), (speed,), float(phase)), t_max=1e-3)
        # free: -x = -a sin; the stop: -w^2 a sin. It presses where x'' of the mass is larger
        pressed = -place > -w * w * place
        x = run.position[-1, 0]
        gap = a * math.sin(phase + w * 1e-3) - x
        assert gap > -4.0 * UNIT
        if not pressed:  # (w^2 - 1) |place| t^2 / 2, to its first order
            assert gap == pytest.approx(-(w * w - 1.0) * place * 1e-6 / 2.0, rel=0.1, abs=1e-9)
