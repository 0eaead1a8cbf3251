"""Observers against the record of the same motion, closed forms, and quadrature."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from support import UNIT
from support.members import Case, beating, cases, impacts_in_window
from support.systems import ball, paper_damper

import vibroimpact as vi
from vibroimpact.simulation.simulate import Status
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers import Extremes, Rms, Section

CASES = cases()
FORCED = [name for name in CASES if name != "ball"]
REST = (Status.STICK, Status.RELEASE)


# ---- the record of the same motion ---------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("stop", "points", "stride"), [("A", 7, 1), ("B", 5, 3), ("B", 900, 2)])
def test_the_section_is_the_last_impacts_at_a_stop(
    name: str, stop: str, points: int, stride: int
) -> None:
    case = CASES[name]
    if name == "ball" and stop == "A":
        return  # the ball has a floor only
    record = case.record()
    found = case.member(Section(points=points, stride=stride, stop=stop))
    there = (record.contact == 0) & (record.side == {"A": 1, "B": -1}[stop])
    at = np.flatnonzero(impacts_in_window(case, record) & there)[::stride][-points:]
    for kind, wanted in (
        ("time", record.time), ("phase", record.phase), ("position", record.position),
        ("velocity", record.velocity_after),
    ):  # fmt: skip
        values = found[f"section_{kind}"]
        np.testing.assert_array_equal(values[: len(at)], wanted[at])
        assert np.isnan(values[len(at) :]).all()


@pytest.mark.parametrize("name", FORCED)
@pytest.mark.parametrize(("points", "phase"), [(7, 0.0), (1000, -2.5)])
def test_states_at_a_phase_are_those_of_the_record_at_these_times(
    name: str, points: int, phase: float
) -> None:
    case = CASES[name]
    record, found = case.record(), case.member(vi.observe.Stroboscopic(points=points, phase=phase))
    known = np.isfinite(found["stroboscopic_time"])
    time = found["stroboscopic_time"][known]
    omega = record.system.mechanism.omega if hasattr(record.system, "mechanism") else (
        record.system.omega
    )  # fmt: skip
    periods = case.observe * omega / (2.0 * np.pi)
    assert min(points, np.floor(periods)) <= known.sum() <= min(points, np.ceil(periods))
    turns = (record.start.phase + omega * time - phase) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-11)
    assert np.all(np.diff(np.round(turns)) == 1.0)
    assert time[0] >= case.settle - 1e-9
    position, velocity = record.at(np.minimum(time, record.time[-1]))
    np.testing.assert_allclose(found["stroboscopic_position"][known], position, atol=1e-9)
    np.testing.assert_allclose(found["stroboscopic_velocity"][known], velocity, atol=1e-9)


def test_a_motion_without_impacts_has_states_at_a_phase() -> None:
    """The steady response x = Im(Z exp(i phase)) in closed form, at every member of a sweep."""

    def system(omega: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(omega, (0.5,)),),
            elements=(vi.RigidStop((1.0,), upper=50.0, restitution=0.8),),
        )  # fmt: skip

    omegas = np.array([0.3, 1.7, 2.6])
    diagram = vi.bifurcation_sweep(
        vi.Family(system, omega=1.0),
        at=vi.AtPhase(1.0),
        over={"omega": omegas},
        start=vi.State((0.0,), (0.0,)),
        points=4,
        settle_periods=400,
        progress=False,
    )
    z = 0.5 * np.exp(1j) / (1.0 - omegas**2 + 0.1j * omegas)
    assert dict(diagram.x1.sizes) == {"direction": 2, "omega": 3, "strobe": 4}
    for values, closed in ((diagram.x1, z.imag), (diagram.v1, (1j * omegas * z).imag)):
        np.testing.assert_allclose(values.max(["direction", "strobe"]), closed, atol=1e-9)
        np.testing.assert_allclose(values.min(["direction", "strobe"]), closed, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_the_final_state_is_that_of_a_run_to_the_same_time(name: str) -> None:
    case = CASES[name]
    record, found = case.record(), case.member("final")
    assert found["end"] == MemberStatus.OK
    assert abs(found["time"] - (case.settle + case.observe)) <= 4.0 * UNIT * found["time"]
    np.testing.assert_array_equal(found["final_position"], record.position[-1])
    np.testing.assert_array_equal(found["final_velocity"], record.velocity_after[-1])
    assert found["final_phase"] == record.phase[-1]


@pytest.mark.parametrize("name", CASES)
def test_impacts_are_counted_per_forcing_period_or_unit_of_time(name: str) -> None:
    case = CASES[name]
    record, found = case.record(), case.member("impacts")
    rate = case.mechanism.omega / (2.0 * math.pi) if case.mechanism.forces else 1.0
    periods = case.observe * rate
    for stop in "ab":
        count = (impacts_in_window(case, record) & (record.side == {"a": 1, "b": -1}[stop])).sum()
        # the period, the observed time and their quotient round once each
        assert found[f"impacts_{stop}"] == pytest.approx(count / periods, rel=8.0 * UNIT)


@pytest.mark.parametrize("name", CASES)
def test_speed_statistics_are_those_of_the_recorded_impacts(name: str) -> None:
    case = CASES[name]
    record, found = case.record(), case.member("speeds")
    speed = -record.rate_before[impacts_in_window(case, record, Status.IMPACT, Status.SIMULTANEOUS)]
    rounding = 2.0 * UNIT * len(speed)
    assert found["speed_mean"] == pytest.approx(speed.mean(), rel=rounding)
    assert found["speed_rms"] == pytest.approx(math.sqrt((speed**2).mean()), rel=rounding)
    assert (found["speed_smallest"], found["speed_largest"]) == (speed.min(), speed.max())


def test_rest_is_the_time_between_sticking_and_release() -> None:
    case = CASES["chatter"]
    record, found = case.record(), case.member("shares")
    kinds = record.status[np.isin(record.status, REST)]
    times = record.time[np.isin(record.status, REST)]
    assert kinds[:2].tolist() == [Status.STICK, Status.RELEASE]
    times = np.append(times, case.settle + case.observe)[: len(times) // 2 * 2]
    rest = np.diff(np.clip(times, case.settle, None))[::2].sum()
    assert found["share_at_rest"] == pytest.approx(rest / case.observe, rel=1e-12)
    assert found["chatters"] == impacts_in_window(case, record, Status.CHATTER).sum() > 2
    assert found["grazes"] == 0


def test_a_rest_that_begins_before_the_window_counts_from_its_begin() -> None:
    """The ball of restitution 1/2 rests from t = 3 sqrt(2 / 9.8) = 1.36 on."""
    start = vi.State((1.0,), (0.0,))
    for settle, share in ((2.0, 1.0), (0.0, 1.0 - 3.0 * math.sqrt(2.0 / 9.8) / 4.0)):
        found = Case(ball(0.5), start, settle, 4.0).member("shares")
        assert found["share_at_rest"] == pytest.approx(share, rel=64.0 * UNIT)


def test_an_impact_at_the_very_begin_of_the_window_is_seen() -> None:
    damper = paper_damper("A", 1.2)
    towards = damper.on_stop("A", x1=0.0, v1=0.0, v2=1.0, phase=0.0)
    found = Case(damper, towards, 0.0, 1.0).member("speeds", Section(points=1))
    assert found["section_time"] == [0.0]
    assert found["speed_largest"] == 1.0


def two_on_the_floor() -> Case:
    """Balls 1 and 2 lie on the floor; a third, thrown up, pulls the second off by a string."""
    unit = np.eye(3)
    system = vi.Mechanism(
        mass=unit,
        damping=np.zeros((3, 3)),
        stiffness=np.zeros((3, 3)),
        constant_force=(-9.8, -9.8, -9.8),
        elements=(
            vi.RigidStop(tuple(unit[0]), lower=0.0, restitution=0.5),
            vi.RigidStop(tuple(unit[1]), lower=0.0, restitution=0.5),
            vi.RigidStop(tuple(unit[2] - unit[1]), upper=1.0, restitution=0.5),
        ),
    )
    return Case(system, vi.State((0.0, 0.0, 0.5), (0.0, 0.0, 4.0)), 0.0, 0.4)


def test_a_ball_stays_on_the_floor_while_another_is_pulled_off_it() -> None:
    case = two_on_the_floor()
    record, found = case.record(), case.member("shares", "extremes", "rms")
    assert case.observe - record.time[record.impacts][0] > 0.2
    assert found["share_at_rest"] == 1.0
    assert found["x_smallest"][0] == found["x_largest"][0] == found["x_rms"][0] == 0.0
    assert found["x_largest"][1] > 0.05


# ---- energy --------------------------------------------------------------------------------------


def energy(m: vi.Mechanism, x: Any, v: Any) -> float:
    """Kinetic and potential."""
    return float(0.5 * v @ m.mass @ v + 0.5 * x @ m.stiffness @ x - np.dot(m.constant_force, x))


def work(case: Case, record: vi.Run) -> float:
    """Of forces and dashpots during the window."""
    m, first = case.mechanism, case.state.phase / (case.mechanism.omega or 1.0)
    stop = case.settle + case.observe
    cuts = np.unique(np.clip([case.settle, *record.time, stop], case.settle, stop))
    nodes, weights = np.polynomial.legendre.leggauss(30)
    total = 0.0
    for a, b in itertools.pairwise(cuts):
        for part in np.linspace(a, b, 1 + math.ceil((b - a) / 2.0))[:-1]:
            half = 0.5 * (b - a) / math.ceil((b - a) / 2.0)
            t = np.clip(part + half * (1.0 + nodes), a, min(b, record.time[-1]))
            _, v = record.at(t)
            power = -np.einsum("ti,ij,tj->t", v, np.array(m.damping), v)
            for f in m.forces:
                theta = f.omega * (first + t)
                power += np.sin(theta) * (v @ f.sine) + np.cos(theta) * (v @ f.cosine)
            total += half * float(weights @ power)
    return total


@pytest.mark.parametrize("name", CASES)
def test_the_power_closes_the_balance_of_energy(name: str) -> None:
    case = CASES[name]
    record, found = case.record(), case.member("power")
    (x0, x1), (v0, v1) = record.at([case.settle, record.time[-1]])
    lost = work(case, record) - energy(case.mechanism, x1, v1) + energy(case.mechanism, x0, v0)
    # flights of some steps, 30 nodes each: far below what thousands of roundings leave
    assert found["power"] * case.observe == pytest.approx(lost, rel=1e-9)


def three_balls(middle: float) -> tuple[vi.Mechanism, vi.State]:
    """Two balls meet a third from both sides at the same time."""
    m = vi.Mechanism(
        mass=np.diag([1.0, middle, 1.0]),
        damping=np.zeros((3, 3)),
        stiffness=np.zeros((3, 3)),
        elements=(
            vi.RigidStop((-1.0, 1.0, 0.0), lower=0.0, restitution=0.5),
            vi.RigidStop((0.0, -1.0, 1.0), lower=0.0, restitution=0.5),
        ),
    )
    return m, vi.State((-1.0, 0.0, 1.0), (1.0, 0.0, -1.0))


@pytest.mark.parametrize("middle", [0.3, 2.0])
def test_simultaneous_impacts_lose_what_the_kinetic_energy_falls_by(middle: float) -> None:
    m, start = three_balls(middle)
    case = Case(m, start, 0.5, 1.0)
    record, found = case.record(), case.member("power", "speeds")
    assert Status.SIMULTANEOUS in record.status
    before = energy(m, np.zeros(3), np.array(start.velocity))
    after = energy(m, np.zeros(3), record.velocity_after[-1])
    assert before - after > 0.5
    assert found["power"] * case.observe == pytest.approx(before - after, rel=16.0 * UNIT)


# ---- flights -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_extremes_lie_above_samples_by_no_more_than_the_curvature_allows(name: str) -> None:
    case = CASES[name]
    record, row = case.record(), np.linspace(1.0, -0.5, case.mechanism.degrees)
    found = case.member(Extremes(row=tuple(row), label="u"), "extremes")
    t = np.linspace(case.settle, record.time[-1], 100_001)
    x, _ = record.at(np.sort(np.concatenate([t, record.time[record.time >= case.settle]])))
    u = x @ row
    h = t[1] - t[0]
    _, v = record.at(t)
    within = np.diff(v @ row) / h  # u'' but where an impact lies between
    bulge = 2.0 * np.quantile(abs(within), 0.98) * h * h / 8.0 + 1e-12
    assert 0.0 <= found["u_largest"] - u.max() + 1e-12 <= bulge
    assert 0.0 <= u.min() - found["u_smallest"] + 1e-12 <= bulge
    np.testing.assert_allclose(found["x_largest"], x.max(axis=0), rtol=0.0, atol=100.0 * bulge)
    np.testing.assert_allclose(found["x_smallest"], x.min(axis=0), rtol=0.0, atol=100.0 * bulge)


@pytest.mark.parametrize(
    ("settle", "observe", "lowest", "highest"),
    [
        (0.1, 0.1, 1.0 - 4.9 * 0.04, 1.0 - 4.9 * 0.01),  # falling
        (0.2, 2.0, 0.0, 1.0),  # over the first impact and the top after it
        (0.5, 0.2, None, None),  # rising
    ],
)
def test_extremes_of_an_elastic_ball_are_its_parabola(
    settle: float, observe: float, lowest: float | None, highest: float | None
) -> None:
    found = Case(ball(1.0), vi.State((1.0,), (0.0,)), settle, observe).member("extremes")
    first = math.sqrt(2.0 / 9.8)  # of impact
    if lowest is None or highest is None:
        lowest, highest = (
            9.8 * first * s - 4.9 * s * s for s in (settle - first, settle + observe - first)
        )
    assert found["x_smallest"][0] == pytest.approx(lowest, abs=16.0 * UNIT)
    assert found["x_largest"][0] == pytest.approx(highest, abs=16.0 * UNIT)


@pytest.mark.parametrize("seed", range(8))
def test_extremes_of_a_sum_of_harmonics_are_exact_to_rounding(seed: int) -> None:
    system, u = beating()
    rng = np.random.default_rng(seed)
    settle, observe = rng.uniform(0.0, 5.0), rng.uniform(0.05, 6.0)
    found = Case(system, vi.State((u(0.0),), (u(0.0, 1),)), settle, observe).member("extremes")
    t = np.linspace(settle, settle + observe, 20_001)
    for sign, name in ((1.0, "x_largest"), (-1.0, "x_smallest")):
        best = t[np.argmax(sign * u(t))]
        if settle < best < settle + observe:  # Newton's method from the best sample
            for _ in range(5):
                best -= u(best, 1) / u(best, 2)
        assert found[name][0] == pytest.approx(u(best), abs=256.0 * UNIT)


def test_averages_of_a_sum_of_harmonics_are_exact_to_rounding() -> None:
    system, u = beating()
    settle, observe = 1.3, 6.0
    case = Case(system, vi.State((u(0.0),), (u(0.0, 1),)), settle, observe)
    found = case.member(Rms(row=(2.0,), label="u"))
    mean = quad(lambda t: 2.0 * u(t), settle, settle + observe, epsabs=1e-14)[0] / observe
    square = quad(lambda t: 4.0 * u(t) ** 2, settle, settle + observe, epsabs=1e-14)[0] / observe
    assert found["u_mean"] == pytest.approx(mean, abs=512.0 * UNIT)
    assert found["u_rms"] == pytest.approx(math.sqrt(square), abs=512.0 * UNIT)


def test_averages_of_an_elastic_ball_are_those_of_its_parabola() -> None:
    """From the first impact on for ten hops: mean 2/3, mean square 8/15 of the height 1."""
    first = math.sqrt(2.0 / 9.8)
    found = Case(ball(1.0), vi.State((1.0,), (0.0,)), first, 20.0 * first).member("rms")
    assert found["x_mean"][0] == pytest.approx(2.0 / 3.0, rel=1e-14)
    assert found["x_rms"][0] == pytest.approx(math.sqrt(8.0 / 15.0), rel=1e-14)


@pytest.mark.parametrize("name", CASES)
def test_averages_are_those_of_a_quadrature_of_the_recorded_motion(name: str) -> None:
    case = CASES[name]
    record, found = case.record(), case.member("rms")
    stop = record.time[-1]
    cuts = np.unique(np.clip([*record.time, *np.arange(0.0, stop, 0.5)], case.settle, stop))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    half = 0.5 * np.diff(cuts)[:, None]
    x, _ = record.at(np.clip(cuts[:-1, None] + half * (1.0 + nodes), 0.0, stop))
    both = [np.einsum("ij,j,ijk->k", half + 0 * nodes, weights, x**k) for k in (1, 2)]
    # 12 nodes on pieces of half a unit of time; some thousand roundings
    np.testing.assert_allclose(found["x_mean"], both[0] / case.observe, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(found["x_rms"], np.sqrt(both[1] / case.observe), rtol=1e-11)


def test_points_of_a_section_that_would_be_lost_again_cost_nothing() -> None:
    """A billion periods in one flight: visited one by one they would take minutes."""
    still = vi.ImpactOscillator(omega=0.8, zeta=0.05, restitution=0.7, clearance=50.0, force=1.0)
    asked = {
        "over": {"omega": [0.8]}, "start": vi.State((0.0,), (0.0,)), "settle_periods": 0,
        "observe": vi.observers.Stroboscopic(points=3), "progress": False,
    }  # fmt: skip
    few, many = (vi.sweep(still, periods=periods, **asked) for periods in (1000, 1e9))
    turns = many["stroboscopic_time"].values.ravel() * 0.8 / (2.0 * np.pi)
    np.testing.assert_allclose(turns, 1e9 - np.array([3.0, 2.0, 1.0]), rtol=1e-15)
    for name in ("position", "velocity"):
        here, there = (one[f"stroboscopic_{name}"].values.ravel() for one in (few, many))
        np.testing.assert_allclose(here, there, atol=2.0 * np.spacing(1e10))  # of omega t
