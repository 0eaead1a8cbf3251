"""Rules that end a branch: where, why, and that nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest
from support.curves import circle, nothing

import vibroimpact as vi
from vibroimpact.branches.stop_rules import StopWhen
from vibroimpact.continuation import Steps, Stopped, continue_curve

BOUNDS = (0.45, 0.56)  # period doubling and a zero speed below 0.5, grazing above
STEPS = vi.Steps(first=0.1, largest=2.0, tolerance=1e-5, turn=1.4, points=120)


@pytest.fixture(scope="module")
def orbit() -> vi.Orbit:
    """One impact per period against a stop."""
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.04]], stiffness=[[1.0]],
        forces=(vi.Harmonic(0.5, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=1.26, restitution=0.8),),
    )  # fmt: skip
    return vi.find_orbit(m, vi.State((1.26,), (-1.5,)))


@pytest.fixture(scope="module")
def whole(orbit: vi.Orbit) -> vi.Branch:
    return vi.continue_orbit(orbit, "omega", BOUNDS, steps=STEPS, inadmissible=True)


def stopped(orbit: vi.Orbit, rule: StopWhen) -> vi.Branch:
    return vi.continue_orbit(orbit, "omega", BOUNDS, steps=STEPS, stop_when=rule, inadmissible=True)


def counts(whole: vi.Branch, part: vi.Branch) -> tuple[int, int]:
    """Points before and after the start of a part of a branch, which are those of the whole."""
    before, after = part.curve.start, len(part) - part.curve.start
    same = slice(whole.curve.start - before, whole.curve.start + after)
    np.testing.assert_array_equal(part.values, whole.values[same])
    np.testing.assert_array_equal(part.curve.z, whole.curve.z[same])
    np.testing.assert_array_equal(part.multipliers, whole.multipliers[same])
    return before, after - 1


@pytest.mark.slow
def test_a_branch_ends_at_the_first_point_where_the_rule_says_so(orbit, whole) -> None:
    start = whole.curve.start
    for least in np.quantile(whole.impact_speed, [0.1, 0.5, 0.9]):

        def slow(at: vi.Orbit, least: float = least) -> bool:
            return at.least_impact_speed < least

        part = stopped(orbit, slow)
        directions = (whole.impact_speed[:start][::-1], whole.impact_speed[start + 1 :])
        for length, speeds, k in zip(counts(whole, part), directions, (0, 1), strict=True):
            below = np.flatnonzero(speeds < least)
            assert length == (below[0] + 1 if below.size else len(speeds))
            end = part.curve.ends[k]
            assert (end.detail == "slow") == (end.reason is Stopped.RULE) == bool(below.size)


def test_special_points_beyond_the_end_are_not_listed(orbit, whole) -> None:
    part = stopped(orbit, lambda at: "enough" if at.multipliers[0].real < -1.0 else "")
    counts(whole, part)
    low, high = part.values[0], part.values[-1]  # omega rises along this branch
    inside = [p.label for p in whole.special_points if low <= p.parameter <= high]
    assert "PD1" in inside
    assert "ZERO1" not in inside
    assert [point.label for point in part.special_points] == inside
    assert str(part.curve.ends[0]) == "the rule stop_when ended it: enough"


@pytest.mark.slow
def test_an_inadmissible_stretch_is_followed_as_far_as_its_rule_allows(orbit, whole) -> None:
    span = BOUNDS[1] - BOUNDS[0]
    for beyond, points in ((0.0, 400), (0.1, 400), (1.0, 5), (1.0, 0), (1.0, 400)):
        part = stopped(orbit, vi.stop.inadmissible(beyond=beyond, points=points))
        before, _ = counts(whole, part)
        directions = (
            (part.values[before::-1], part.admissible[before::-1], part.curve.ends[0]),
            (part.values[before:], part.admissible[before:], part.curve.ends[1]),
        )
        for values, admissible, end in directions:
            length = len(admissible) - int(np.flatnonzero(admissible)[-1]) - 1
            travelled = np.abs(np.diff(values[len(values) - length :])).sum() if length else 0.0
            exceeded = length > points or travelled > beyond * span
            assert exceeded == (end.reason is Stopped.RULE)
            assert length <= points + 1  # the point that exceeds is the last
            assert travelled - abs(values[-1] - values[-2]) <= beyond * span


@pytest.mark.slow
def test_a_rule_of_multipliers_counts_those_outside_the_circle(orbit, whole) -> None:
    outside = (np.abs(whole.multipliers) > 1.0 + 1e-9).sum(axis=1)
    start = whole.curve.start
    for most in range(int(outside.max()) + 1):
        part = stopped(orbit, vi.stop.unstable(multipliers=most))
        for length, here in zip(
            counts(whole, part), (outside[:start][::-1], outside[start + 1 :]), strict=True
        ):
            more = np.flatnonzero(here > most)
            assert length == (more[0] + 1 if more.size else len(here))
    assert stopped(orbit, vi.stop.unstable(multipliers=0)).curve.ends[0].detail == (
        "1 multipliers outside the unit circle"
    )


def test_the_first_of_several_rules_ends_the_branch(orbit, whole) -> None:
    first = vi.stop.unstable(multipliers=0)
    second = vi.stop.inadmissible(beyond=0.0)
    alone = [counts(whole, stopped(orbit, rule)) for rule in (first, second)]
    both = counts(whole, stopped(orbit, [first, second]))
    assert both == tuple(np.min(alone, axis=0))
    assert alone[0] != alone[1]


def test_a_rule_for_switched_branches_is_the_same(whole) -> None:
    point = whole["PD1"]
    rule = vi.stop.inadmissible(points=0)
    found = vi.switch_branch(point, steps=STEPS, stop_when=rule)
    assert isinstance(found, vi.Branch)
    for index, end in ((0, found.curve.ends[0]), (-1, found.curve.ends[1])):
        assert found.admissible[index] == (end.reason is not Stopped.RULE)
    assert found.admissible[1:-1].all()


def test_what_is_no_rule_is_refused(orbit) -> None:
    for rule in (3, "inadmissible", [None], {"a": 1}):
        with pytest.raises(vi.InvalidParameterError, match=r"stop_when = .*must be a function"):
            stopped(orbit, rule)
    with pytest.raises(vi.InvalidParameterError, match="stop_when returned 3: must return True"):
        stopped(orbit, lambda _: 3)
    for bad in ({"beyond": -1.0}, {"beyond": np.nan}, {"points": 1.5}, {"beyond": "x"}):
        with pytest.raises(vi.InvalidParameterError, match=next(iter(bad))):
            vi.stop.inadmissible(**bad)
    with pytest.raises(vi.InvalidParameterError, match="multipliers = -1"):
        vi.stop.unstable(multipliers=-1)


def test_a_rule_begins_anew_in_each_direction_and_only_looks_at_the_start() -> None:
    asked: list[list[float]] = []

    def begin():
        asked.append([])

        def ask(_z, p: float) -> str:
            asked[-1].append(p)
            return "third" if len(asked[-1]) in (1, 4) else ""

        return ask

    curve = continue_curve(
        circle(nothing), np.array([1.0]), 0.0, (-2.0, 2.0), steps=Steps(), stop_when=begin
    )
    assert len(curve) == 7
    assert [end.reason for end in curve.ends] == [Stopped.RULE] * 2
    np.testing.assert_array_equal(asked[0], curve.parameter[3:])
    np.testing.assert_array_equal(asked[1], curve.parameter[3::-1])
