"""Rotation numbers: known ones, the definition on the record, and motions that have none."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.circles import five_points
from support.members import Case, cases, impacts_in_window
from support.systems import ball, paper_damper

import vibroimpact as vi
from vibroimpact.machines.published import parameter_sets
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers import Rotation

MIDDLE = vi.State((0.0, 0.0), (0.0, 1.0))
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
TORI = [("A", 1.00314), ("B", 0.975), ("C", 0.4268)]  # one closed curve each
LOCKED = [("A", 0.95, 2), ("B", 0.985, 5), ("B", 0.945, 8), ("C", 0.442, 3)]


def damper_case(name: str, omega: float, settle: float, periods: float) -> Case:
    damper = paper_damper(name, omega)
    return Case(damper, MIDDLE, settle * damper.period, periods * damper.period)


def folded(rho: float) -> float:
    return min(rho % 1.0, 1.0 - rho % 1.0)


# ---- numbers that are known ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "ratio", [GOLDEN, math.sqrt(2.0), math.pi, 0.1 * math.sqrt(3.0), 2.5 - 1e-2]
)
def test_a_second_line_of_forcing_turns_the_section_by_the_ratio_of_frequencies(
    ratio: float,
) -> None:
    """One impact per period of the first line: the second advances by the ratio on average."""
    omega = 1.6
    system = vi.Mechanism(
        mass=[[1.0]], damping=[[0.2]], stiffness=[[1.0]],
        forces=(vi.Harmonic(omega, (1.0,)), vi.Harmonic(ratio * omega, (0.02,))),
        elements=(vi.RigidStop((1.0,), upper=0.2, restitution=0.7),),
    )  # fmt: skip
    period = 2.0 * math.pi / omega
    case = Case(system, vi.State((0.0,), (0.0,)), 200.5 * period, 2000.0 * period)
    found = case.member("rotation", "impacts")
    assert found["impacts_a"] == pytest.approx(1.0, abs=1.0 / 2000.0)
    assert abs(found["rotation"] - folded(ratio)) <= found["rotation_error"] < 1e-9


@pytest.mark.parametrize(("name", "omega"), TORI)
def test_on_a_closed_curve_it_is_the_rotation_number_of_its_classification(
    name: str, omega: float
) -> None:
    damper = paper_damper(name, omega)
    single = vi.classify(damper, MIDDLE).rotation
    assert single is not None
    for stop in ("A", "B"):
        found = damper_case(name, omega, 2000, 4000).member(Rotation(stop=stop))
        assert found["rotation_error"] < 1e-8
        error = found["rotation_error"] + single.error
        assert found["rotation"] == pytest.approx(single.value, abs=error)


@pytest.mark.parametrize("name", ["A 1.0079", "B 1.0170", "C 0.4289"])
def test_near_its_birth_a_circle_turns_as_the_normal_form_says(name: str) -> None:
    """By the angle of the multiplier and, on the circle's side, a slope; the rest is quadratic."""
    point = five_points()[name]
    form, damper = point.form, parameter_sets()[name[0]].damper(point.omega)
    off = []
    for step in (1e-4, 2e-4):
        dp = form.side * step * point.omega
        found = Case(
            replace(damper, omega=point.omega + dp),
            MIDDLE,
            2e5 * damper.period,
            4000 * damper.period,
        ).member("rotation", most_impacts=10**7)
        turns = 2.0 * form.rotation_number(dp)  # of the half map, twice
        first = 2.0 * form.angle / (2.0 * math.pi)
        assert abs(found["rotation"] - folded(turns)) < 0.05 * abs(turns - first)
        off.append(found["rotation"] - folded(turns))
    assert off[1] / off[0] == pytest.approx(4.0, rel=0.1)


def order_of(points: np.ndarray[Any, Any]) -> float:
    """p/q of q points on a closed curve: the mean turn to the next one, seen from their centre."""
    angle = np.angle(points - points.mean())
    return folded(np.mean(np.diff(np.append(angle, angle[0])) / (2.0 * np.pi) % 1.0))


@pytest.mark.parametrize(("name", "omega", "period"), LOCKED)
def test_a_locked_motion_has_its_fraction(name: str, omega: float, period: int) -> None:
    case = damper_case(name, omega, 3000, 1000)
    record, found = case.record(), case.member("rotation", "symbol")
    assert [int(found[k]) for k in "npq"] == [period] * 3
    at = np.flatnonzero(impacts_in_window(case, record) & (record.side == 1))[-period:]
    x, v = record.position[at, 0], record.velocity_after[at, 0]
    wanted = order_of((x - x.mean()) / np.ptp(x) + 1j * (v - v.mean()) / np.ptp(v))
    # the turns repeat themselves after at most 8: their average over 1000 has converged
    assert found["rotation"] == pytest.approx(wanted, abs=1e-13)
    assert found["rotation"] <= 0.5
    assert found["rotation_error"] < 1e-9


def test_every_second_point_turns_twice_as_far() -> None:
    case = damper_case("B", 1.01, 2000, 4000)
    once, twice = case.member("rotation"), case.member(Rotation(stride=2))
    error = twice["rotation_error"] + 2.0 * once["rotation_error"]
    assert twice["rotation"] == pytest.approx(folded(2.0 * once["rotation"]), abs=error)


# ---- the definition ------------------------------------------------------------------------------


def bump(t: Any) -> Any:
    return np.exp(-1.0 / (t * (1.0 - t)))


def by_definition(case: Case, record: vi.Run, stride: int) -> tuple[float, float]:
    """The formulas of observe/rotation.hpp, on the record."""
    at = impacts_in_window(case, record) & (record.contact == 0) & (record.side == 1)
    u, t = (x[at][::stride] for x in (-record.rate_before, record.time))
    a, b, t = u[2:] - u[:-2], u[2:] - 2.0 * u[1:-1] + u[:-2], (t[2:] - case.settle) / case.observe
    early, size = t < 0.125, 1e-6 * np.max([u[2:], u[1:-1], u[:-2]], axis=0)
    if (np.maximum(abs(a), abs(b)) <= size)[~early].any():
        return math.nan, math.nan
    g = np.clip(np.sqrt(np.sum(a[early] ** 2) / np.sum(b[early] ** 2)), 1.0 / 64.0, 64.0)
    d = np.diff(np.arctan2(a, g * b)[~early] / (2.0 * np.pi))
    d, t = (d + 0.25) % 1.0 - 0.25, (t[~early][1:] - 0.125) / 0.875
    if d.min() < -0.1875 or d.max() > 0.6875:
        return math.nan, math.nan
    rho = np.average(d, weights=bump(t))
    halves = [np.average(d[h], weights=bump(2.0 * t[h] % 1.0)) for h in (t < 0.5, t >= 0.5)]
    return folded(rho), float(max(abs(halves - rho)))


@pytest.mark.parametrize("stride", [1, 2])
def test_it_is_what_its_definition_says_of_the_record(stride: int) -> None:
    known = 0
    for omega in np.linspace(0.93, 1.03, 21):
        case = damper_case("B", float(omega), 2000, 150)
        found = case.member(Rotation(stride=stride))
        rho, error = by_definition(case, case.record(), stride)
        known += not math.isnan(rho)
        # rounding of angles, largest near the fixed point: 1e-16 over the tolerance
        assert found["rotation"] == pytest.approx(rho, abs=1e-10, nan_ok=True)
        assert found["rotation_error"] == pytest.approx(error, abs=1e-10, nan_ok=True)
    assert 5 < known < 21


def test_its_error_falls_faster_than_any_plain_average() -> None:
    found = [damper_case("B", 1.005, 2000, n).member("rotation") for n in (100, 400, 1600)]
    best = damper_case("B", 1.005, 2000, 6400).member("rotation")
    errors = [one["rotation_error"] for one in found]
    assert errors[1] < errors[0] / 16.0
    assert errors[2] < errors[1] / 256.0
    for one in found:
        assert abs(one["rotation"] - best["rotation"]) <= 2.0 * one["rotation_error"]


# ---- what has none -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(damper_case("A", 1.2, 1000, 200), id="a fixed point"),
        pytest.param(
            replace(
                damper_case("A", 1.2, 10, 200),
                system=paper_damper("A", 1.2, half_clearance=1e3),
                state=vi.State((0.0, 0.0), (0.0, 0.0)),
            ),
            id="no impacts",
        ),
        pytest.param(damper_case("B", 1.005, 500, 16), id="too few points"),
        pytest.param(replace(cases()["chaotic"], observe=6500.0), id="chaos"),  # 1000 periods
    ],
)
def test_a_motion_without_a_rotation_number_has_nan(case: Case) -> None:
    found = case.member("rotation")
    assert found["end"] == MemberStatus.OK
    assert math.isnan(found["rotation"])
    assert math.isnan(found["rotation_error"])


def test_a_ball_that_repeats_its_bounce_does_not_turn() -> None:
    found = Case(ball(1.0), vi.State((1.0,), (0.0,)), 1.0, 100.0).member(Rotation(stop="B"))
    assert math.isnan(found["rotation"])


def test_a_member_that_ends_in_the_first_half_of_its_window_has_none() -> None:
    found = damper_case("B", 1.005, 100, 1000).member("rotation", most_impacts=800)
    assert found["end"] == MemberStatus.MAX_IMPACTS
    assert math.isnan(found["rotation"])


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Rotation(stride=0), "stride = 0"),
        (lambda: Rotation(contact=-1), "contact = -1"),
        (lambda: Rotation(stop="C"), "stop = 'C'"),  # type: ignore[arg-type]
        (lambda: Rotation(tolerance=0.0), "tolerance = 0.0"),
        (lambda: Case(ball(0.5), vi.State((1.0,), (0.0,)), 1.0, 1.0).member("rotation"), "stop"),
    ],
)
def test_bad_options_are_refused_by_name(make: Any, says: str) -> None:
    with pytest.raises(vi.InvalidParameterError) as refused:
        make()
    assert says in str(refused.value)
