"""How runs end: growth without bound, drifts that are followed to their impact, long searches."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vibroimpact as vi
from vibroimpact.attractors.point_sets import Kind
from vibroimpact.compile.hybrid import compile_mechanism
from vibroimpact.orbits.search_result import MotionEnd
from vibroimpact.simulation.simulate import RunEnd, Status
from vibroimpact.sweeps.member_status import MemberStatus

LARGEST = 2.0**256  # coordinates beyond it, in the machine's unit, have diverged


def one_body(
    stiffness: float, damping: float, push: float = 0.0, *,
    lower: float = -math.inf, upper: float = math.inf, restitution: float = 0.8,
) -> vi.Mechanism:  # fmt: skip
    """x'' + c x' + k x = push beside its stops."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], constant_force=(push,),
        elements=(vi.RigidStop((1.0,), lower, upper, restitution),),
    )  # fmt: skip


def numbers_of(run: vi.Run) -> np.ndarray:
    """All that a run says of its events."""
    return np.concatenate(
        [run.time, run.position.ravel(), run.velocity_after.ravel(), run.rate_after, run.phase]
    )


# ---- growth without bound -----------------------------------------------------------------------


def test_a_motion_away_from_its_stop_ends_when_it_leaves_the_largest_size() -> None:
    k, c, push, x0 = -0.75, 0.1, -0.225, 0.31
    m = one_body(k, c, push, lower=0.0)
    run = vi.simulate(m, vi.State((x0,), (0.0,)))
    assert run.end is RunEnd.DIVERGED
    assert [Status(s) for s in run.status] == [Status.DIVERGED]
    # x = p / k + a exp(l t) + b exp(m t), of which the growing part alone is left
    root = math.sqrt(c * c / 4 - k)
    grows, falls = -c / 2 + root, -c / 2 - root
    a = (x0 - push / k) * -falls / (grows - falls)
    compiled = compile_mechanism(m)
    leaves = math.log(LARGEST * compiled.units[0] / a) / grows  # in the unit of its coordinates
    step = compiled.step
    assert leaves - 1e-9 <= run.time[0] <= leaves + 2 * step  # x or x' / rate, at the step after
    assert np.isfinite(numbers_of(run)).all()


def test_impacts_that_gain_more_from_negative_damping_than_they_lose_end_as_diverged() -> None:
    m = one_body(1.0, -0.5, upper=1.0)
    run = vi.simulate(m, vi.State((0.31,), (0.0,)), impacts=20_000)
    assert run.end is RunEnd.DIVERGED
    assert run.impacts.sum() > 200
    assert np.isfinite(numbers_of(run)).all()
    # From stop to stop half a turn of w = sqrt(15) / 4: speeds grow by exp(pi / (4 w)) 0.8.
    speed = -run.rate_before[run.impacts][200:290]
    factor = 0.8 * math.exp(math.pi / math.sqrt(15.0))
    assert np.allclose(speed[1:] / speed[:-1], factor, rtol=1e-9)


@pytest.mark.parametrize("stiffness", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_start_beyond_the_largest_size_has_diverged_at_once(
    stiffness: float, side: float
) -> None:
    m = one_body(stiffness, 0.0, **({"upper": 1.0} if side < 0 else {"lower": 1.0}))
    run = vi.simulate(m, vi.State((side * 1e308,), (0.0,)))
    assert run.end is RunEnd.DIVERGED
    assert run.time.tolist() == [0.0]
    assert run.status.tolist() == [Status.DIVERGED]


def test_a_clearance_lost_in_the_rounding_of_its_bodies_has_diverged() -> None:
    m = vi.Mechanism(
        mass=np.eye(2), damping=-0.2 * np.eye(2), stiffness=[[2.0, -1.0], [-1.0, 2.0]],
        elements=(vi.RigidStop((-1.0, 1.0), -1.0, 1.0, 0.5),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((1.0, 1.5), (0.3, 0.0)), impacts=10**6)
    assert run.end is RunEnd.DIVERGED
    terms = np.abs(run.position[-1]).sum()
    assert 2.0 < 16 * 64 * 2.0**-53 * 4.0 * terms < 64.0  # of u = x2 - x1, its clearance being 2


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_whatever_grows_ends_with_finite_numbers(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 3))
    k, c = (a + a.T for a in random.normal(size=(2, n, n)))
    m = vi.Mechanism(
        mass=np.eye(n), damping=0.3 * c, stiffness=k,
        forces=(vi.Harmonic(float(random.uniform(0.5, 2.0)), tuple(random.normal(size=n))),),
        elements=tuple(
            vi.RigidStop(tuple(random.normal(size=n)), -0.5, 0.7, 0.6) for _ in range(n)
        ),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((0.0,) * n, tuple(random.normal(size=n))), impacts=300)
    assert np.isfinite(numbers_of(run)).all()
    if run.end is RunEnd.DIVERGED:
        assert run.status[-1] == Status.DIVERGED
        assert np.abs(np.append(run.position[-1], run.velocity_after[-1])).max() > 2.0**40


def test_divergence_is_said_alike_everywhere() -> None:
    m = one_body(-0.75, 0.1, -0.225, lower=0.0)
    away = vi.State((0.31,), (0.0,))
    found = vi.classify(m, away, at=vi.AtStop("B"))
    assert found.kind is Kind.DIVERGED
    assert "diverged" in found.shape.reason
    assert vi.lyapunov_exponent(m, away).run_end is RunEnd.DIVERGED
    assert vi.section(m, away, at=vi.AtStop("B"), points=10).end is RunEnd.DIVERGED
    starts = vi.GridStarts({"x1": [0.31, 0.35, 1e300]}, away)
    members = vi.sweep(
        m, over={}, start=starts, settle_periods=10.0, periods=1000.0, progress=False
    )
    assert np.all(members.end == MemberStatus.DIVERGED)
    assert MotionEnd.DIVERGED in vi.find_orbits(m, starts=20).motions


# ---- drifts that are sure to end in an impact ---------------------------------------------------


def drifting(clearance: float, omega: float) -> vi.Mechanism:
    """A forced oscillator, and a free mass that flies between two stops on it."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.1]], damping=[[0.3, 0.0], [0.0, 0.0]],
        stiffness=[[1.5, 0.0], [0.0, 0.0]], forces=(vi.Harmonic(omega, (1.0, 0.0)),),
        elements=(vi.RigidStop((-1.0, 1.0), -clearance, clearance, 0.5),),
    )  # fmt: skip


@settings(max_examples=30, deadline=None)
@given(
    clearance=st.floats(3.0, 20.0), omega=st.floats(0.5, 3.0), size=st.floats(-9.0, -4.0),
    side=st.sampled_from((-1.0, 1.0)),
)  # fmt: skip
def test_a_slow_drift_is_followed_to_its_impact(
    clearance: float, omega: float, size: float, side: float
) -> None:
    m, speed = drifting(clearance, omega), side * 10.0**size
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, speed)), impacts=1)
    assert run.end is RunEnd.IMPACTS
    assert run.time[-1] > 10_000 * 2 * math.pi / omega or abs(speed) > 1e-5
    # Long after the transients x1 = a sin(theta + p), and x2 = speed t.
    a = abs(1.0 / complex(1.5 - omega**2, 0.3 * omega))
    x1, x2 = run.position[-1]
    assert abs(x2 - x1) == pytest.approx(clearance, rel=1e-12)
    assert x2 == pytest.approx(speed * run.time[-1], rel=1e-9)
    assert abs(x1) <= a * (1.0 + 1e-9)
    # The first contact is where the forced motion is at its end, to the way of some periods' drift.
    way = abs(speed) * 2 * math.pi / omega
    assert abs(x2) == pytest.approx(clearance - a, abs=2 * way + 1e-9)


def test_the_phase_after_a_long_drift_is_that_of_the_time() -> None:
    m, speed, omega = drifting(5.0, 1.25), 2.0**-20, 1.25
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, speed)), impacts=1)
    with mp.workdps(40):
        turns = mp.mpf(omega) * mp.mpf(float(run.time[-1])) / (2 * mp.pi)
        expected = float((turns - mp.floor(turns)) * 2 * mp.pi)
    # rates are known to some 2^-53, phases to that times the angle turned
    assert abs(run.phase[-1] - expected) < 16 * 2.0**-53 * omega * run.time[-1]


@pytest.mark.parametrize("pull", [1e-12, -3e-9, 2.0**-40])
def test_a_weak_constant_force_brings_a_free_mass_to_its_stop(pull: float) -> None:
    m = one_body(0.0, 0.0, pull, lower=-2.0, upper=3.0)
    run = vi.simulate(m, vi.State((0.0,), (0.0,)), impacts=1)
    way = 3.0 if pull > 0 else 2.0
    assert run.time[0] == pytest.approx(math.sqrt(2 * way / abs(pull)), rel=1e-12)
    assert -run.rate_before[0] == pytest.approx(math.sqrt(2 * way * abs(pull)), rel=1e-12)


def test_a_free_mass_meets_its_stop_after_whatever_time() -> None:
    m = one_body(0.0, 0.0, lower=-1.0, upper=1.0)
    for exponent in range(3, 18, 2):
        run = vi.simulate(m, vi.State((0.0,), (10.0**-exponent,)), impacts=1)
        assert run.end is RunEnd.IMPACTS
        assert run.time[0] == pytest.approx(10.0**exponent, rel=1e-12)


def test_a_mass_at_rest_between_its_stops_is_silent() -> None:
    m = drifting(5.0, 1.0)
    run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 0.0)), impacts=1)
    assert run.end is RunEnd.SILENT
    held = vi.simulate(one_body(0.0, 0.1, lower=-1.0), vi.State((0.0,), (0.05,)), impacts=1)
    assert held.end is RunEnd.SILENT  # it comes to rest half way


def test_t_max_ends_a_drift_as_it_ends_any_flight() -> None:
    m = drifting(5.0, 1.0)
    for t_max in (1e3, 1e5, 1e6):
        run = vi.simulate(m, vi.State((0.0, 0.0), (0.0, 1e-6)), impacts=1, t_max=t_max)
        assert run.end is RunEnd.HORIZON
        assert run.time[-1] == pytest.approx(t_max, rel=1e-15)


@pytest.mark.parametrize("before", [2.0**-40, 1e-9, 1e-4, 0.03])
def test_an_impact_just_after_t_max_is_not_there(before: float) -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    )
    start = vi.State((0.0, 0.0), (0.0, 1.0))
    whole = vi.simulate(damper, start, impacts=40)
    for k in range(40):
        t_max = float(whole.time[k]) - before
        run = vi.simulate(damper, start, impacts=40, t_max=t_max)
        assert run.end is RunEnd.HORIZON
        assert run.impacts.sum() == (whole.time < t_max).sum()
        assert run.time[-1] == pytest.approx(t_max, rel=4 * 2.0**-52)


def test_chaos_with_drifts_of_many_periods_is_chaos() -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.6, zeta=0.02, restitution=0.4, half_clearance=12.0, omega=1.3
    )
    found = vi.classify(damper, vi.State((0.0, 0.0), (0.0, 1.4210526315789473)))
    assert found.kind is Kind.CHAOTIC
    assert found.exponent.value == pytest.approx(0.075, abs=0.005)


# ---- long searches -----------------------------------------------------------------------------


def random_mechanism(random: np.random.Generator, top: float, far: int) -> vi.Mechanism:
    """Three coordinates of rates 1 to `top`, two contacts, and some that are far away."""
    n = 3
    a, b = random.normal(size=(2, n, n))
    low = np.linalg.cholesky(a @ a.T + n * np.eye(n))
    turn = np.linalg.qr(random.normal(size=(n, n)))[0]
    rates = np.geomspace(1.0, top, n)
    k = low @ (turn * rates**2) @ turn.T @ low.T
    c = low @ ((turn * (0.3 * rates)) @ turn.T + 0.05 * b @ b.T) @ low.T
    force = tuple(3 * random.normal(size=n))
    rows = random.normal(size=(2 + far, n))
    limits = [(-0.1, 0.2), (-0.15, 0.1)] + [(-1e4, 1e4)] * far
    return vi.Mechanism(
        mass=low @ low.T, damping=(c + c.T) / 2, stiffness=(k + k.T) / 2,
        forces=(vi.Harmonic(1.9, force),),
        elements=tuple(
            vi.RigidStop(tuple(row), *limit, 0.7) for row, limit in zip(rows, limits, strict=True)
        ),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("top", [5.0, 300.0, 1e4])
@pytest.mark.one_in(5)
def test_strides_meet_the_impacts_that_blocks_meet(seed: int, top: float) -> None:
    """With five contacts there are no blocks; three of them are never reached."""
    start = vi.State((0.0,) * 3, (0.0,) * 3)
    runs = []
    for far in (0, 3):
        m = random_mechanism(np.random.default_rng(seed), top, far)
        assert compile_mechanism(m).dense is bool(far)
        runs.append(vi.simulate(m, start, impacts=4))
    blocks, strides = runs
    assert strides.status.tolist() == blocks.status.tolist()
    if (
        blocks.end is RunEnd.SILENT
    ):  # proofs without blocks need damping beside the growth of the norm
        assert strides.end in (RunEnd.SILENT, RunEnd.QUIET)
        return
    assert strides.end is blocks.end
    tolerance = 1e-11 + 64 * 2.0**-53 * top**2  # the slow rate is what is left of fast ones
    assert np.allclose(strides.time, blocks.time, rtol=0, atol=tolerance)
    assert np.allclose(strides.position, blocks.position, rtol=0, atol=tolerance)


# ---- the run at any time -------------------------------------------------------------------------


@settings(max_examples=200, deadline=None)
@given(t_max=st.floats(1e-3, 1e4), speed=st.floats(-3.0, 3.0))
def test_a_run_is_known_at_the_time_it_was_to_end(t_max: float, speed: float) -> None:
    damper = vi.ImpactDamper(
        mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
    )
    run = vi.simulate(damper, vi.State((0.0, 0.0), (0.0, speed)), impacts=10**5, t_max=t_max)
    assert run.end is RunEnd.HORIZON
    position, _ = run.at(t_max)
    assert np.allclose(position, run.position[-1], rtol=0, atol=1e-9)


def test_times_outside_a_run_are_counted_not_listed() -> None:
    m = one_body(1.0, 0.0, upper=1.0)
    run = vi.simulate(m, vi.State((0.0,), (0.5,)), t_max=10.0)
    with pytest.raises(vi.InvalidParameterError, match=r"^t = 10.5 and 98 others: must be in") as e:
        run.at(np.append(np.zeros(300), 10.5 + np.arange(99)))
    assert len(str(e.value)) < 120
    with pytest.raises(vi.InvalidParameterError, match="must be finite"):
        run.at(math.nan)
    for t in (-1e-9, 10.001):
        with pytest.raises(vi.InvalidParameterError, match="the span of the run"):
            run.at(t)
