"""Matching of attractors: planted clouds and orbits are joined and kept apart as they should be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

import vibroimpact as vi
from vibroimpact.attractors.matching import (
    MEMBER_DISTANCE,
    count_attractors,
    count_symbols,
    known_attractor,
    longest_gaps,
    scale_of,
)
from vibroimpact.results.result import words_of_codes
from vibroimpact.sweeps.analyses.motion_codes import categories, motions

Floats = NDArray[np.float64]
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
NO_SYMBOL = (0, 0, 0)


def circle(count: int, *, radius: float = 1.0, first: float = 0.0) -> Floats:
    """Iterates of a rotation: a closed curve in four dimensions."""
    turn = 2.0 * np.pi * (first + GOLDEN * np.arange(count))
    flat = np.column_stack([np.cos(turn), np.sin(turn)])
    return np.column_stack([radius * flat, np.ones((count, 2))])


def henon(count: int, x: float) -> Floats:
    """Iterates on the Henon attractor, chaotic."""
    state, points = (x, 0.2), []
    for k in range(count + 100):
        state = (1.0 - 1.4 * state[0] ** 2 + state[1], 0.3 * state[0])
        if k >= 100:
            points.append(state)
    return np.array(points)


def orbit(period: int, *, at: float = 0.0) -> Floats:
    turn = 2.0 * np.pi * np.arange(period) / period
    return np.column_stack([np.cos(turn) + at, np.sin(turn)])


# ---- one attractor against members ---------------------------------------------------------------


@pytest.mark.parametrize("impact", range(3))
def test_a_periodic_member_is_known_at_whichever_impact_it_ends(impact: int) -> None:
    here = known_attractor(orbit(3), periodic=True)
    member = np.roll(orbit(3), impact, axis=0)[None]
    assert here.contains(member + 0.9 * MEMBER_DISTANCE / np.sqrt(2.0)).all()
    assert not here.contains(member + 1.1 * MEMBER_DISTANCE / np.sqrt(2.0)).any()


def test_members_on_one_closed_curve_are_joined_wherever_they_are_on_it() -> None:
    here = known_attractor(circle(4000), periodic=False)
    members = np.array([circle(8, first=f) for f in np.random.default_rng(1).random(500)])
    assert here.contains(members).all()


def test_a_curve_nearby_is_another_one_beyond_the_spacing_of_the_points() -> None:
    here = known_attractor(circle(4000), periodic=False)
    spacing = 2.0 * np.pi / 4000  # of evenly spaced points; a rotation by GOLDEN leaves twice that
    assert here.reach < 2.0 * spacing
    assert not here.contains(circle(8, radius=1.0 + 3.0 * spacing)[None]).any()


def test_members_in_chaos_are_joined_although_no_two_points_repeat() -> None:
    here = known_attractor(henon(4000, 0.1), periodic=False)
    members = np.array([henon(8, x) for x in np.linspace(-0.5, 0.5, 300)])
    assert here.contains(members).all()
    assert not here.contains(members + 0.1).any()


def test_missing_points_are_left_out_and_a_member_without_any_is_on_nothing() -> None:
    here = known_attractor(circle(1000), periodic=False)
    few, none = circle(8, first=0.3), np.full((8, 4), np.nan)
    few[3:] = np.nan
    assert here.contains(np.array([few, none])).tolist() == [True, False]


def test_the_chance_to_be_split_is_that_of_the_binomial() -> None:
    """With one point instead of eight the rule fails for the one in a hundred that (2) says."""
    here = known_attractor(henon(4000, 0.1), periodic=False)
    far = ~here.contains(henon(20_000, 0.3)[:, None, :])
    spread = 3.0 * np.sqrt(0.01 * 0.99 / 4000)  # of the quantile itself, 4000 points
    assert far.mean() == pytest.approx(0.01, abs=spread)


def test_a_single_point_is_known_by_the_tolerance() -> None:
    here = known_attractor(np.zeros((1, 2)), periodic=False, tolerance=0.1)
    assert here.contains(np.full((1, 3, 2), 0.05)).all()


# ---- counting ------------------------------------------------------------------------------------


def counted(members: list[tuple[Floats, tuple[int, int, int]]], k: int = 16) -> int:
    """Each member by its last k points; of shorter records the rest is missing. In any order."""
    points = np.full((len(members), k, members[0][0].shape[1]), np.nan)
    for row, (record, _) in zip(points, members, strict=True):
        row[: len(record)] = record[-k:]
    symbols = np.array([symbol for _, symbol in members])
    orders = [
        np.arange(len(members)),
        *np.random.default_rng(2).permuted([range(len(members))] * 3, axis=1),
    ]
    (count,) = {count_attractors(points[order], symbols[order], 1) for order in orders}
    return count


def repeated(period: int, phase: int = 0, at: float = 0.0) -> Floats:
    return np.roll(np.tile(orbit(period, at=at), (32, 1)), phase, axis=0)


def test_members_on_one_orbit_are_counted_once_in_any_phase() -> None:
    assert counted([(repeated(3, phase), (3, 3, 3)) for phase in range(3)]) == 1


def test_mirror_images_are_two_although_their_symbols_agree() -> None:
    pair = [(repeated(2, 0, at), (2, 2, 2)) for at in (-0.2, 0.2)]
    assert counted(pair) == 2


def test_impacts_per_period_part_orbits_that_are_next_to_each_other() -> None:
    near = repeated(1, at=1e-5)
    assert counted([(repeated(1), (1, 2, 1)), (near, (1, 1, 1))]) == 2
    assert counted([(repeated(1), (13, 13, 13)), (near, (1, 1, 1))]) == 1  # a slow spiral
    assert counted([(repeated(2), (2, 2, 2)), (near, (1, 1, 1))]) == 2  # its far point is looked at


def test_a_member_that_still_settles_is_counted_with_its_orbit() -> None:
    spiral = repeated(1) + MEMBER_DISTANCE * 0.9 ** np.arange(32)[:, None]
    assert counted([(spiral, NO_SYMBOL), (repeated(1), (1, 1, 1))]) == 1
    assert counted([(repeated(1), (1, 1, 1)), (spiral, NO_SYMBOL)]) == 1


def test_an_orbit_beside_chaos_and_a_curve_are_three() -> None:
    chaos = [(henon(16, x), NO_SYMBOL) for x in (0.1, 0.3)]
    curve = (circle(16, radius=0.1)[:, :2] + 5.0, NO_SYMBOL)
    assert counted([*chaos, curve, (repeated(3, at=-7.0), (3, 3, 3))]) == 3


def test_a_torus_that_turns_in_heaps_is_one_wherever_its_members_are() -> None:
    """Rotation 2/5 + 10^-3: sixteen points come in five heaps, a hundredth of the curve each."""
    turns = 2.0 * np.pi * (0.4 + 1e-3) * np.arange(16)
    members = [
        (np.column_stack([np.cos(turns + first), np.sin(turns + first)]), NO_SYMBOL)
        for first in np.linspace(0.0, 2.0, 12)
    ]
    assert counted(members) == 1
    apart = [(record + np.array([2.6, 0.0]), word) for record, word in members]
    assert counted([*members, *apart]) == 2


def test_orbits_with_more_impacts_than_points_are_matched_by_their_gaps() -> None:
    locked = orbit(40)[17 * np.arange(120) % 40]  # a torus that rests at 17/40
    members = [(locked[:-shift], (40, 40, 40)) for shift in (1, 7, 19)]
    assert counted(members) == 1
    assert counted([*members, (locked, (40, 40, 80))]) == 2  # other impacts per period
    assert counted([*members, (locked + 2.5, (40, 40, 40))]) == 2


def test_orbits_with_as_many_impacts_at_the_stop_as_points_are_told_apart() -> None:
    pair = [(repeated(12, at=at), (12, 12, 12)) for at in (0.0, 0.01)]
    assert counted(pair) == 2
    assert counted([*pair, (repeated(12, 5), (12, 12, 12))]) == 2


def test_a_torus_within_chaos_is_taken_for_it_in_any_order() -> None:
    """Sixteen points in chaos leave wide gaps: two that are near count as one."""
    torus = circle(16, radius=0.02)[:, :2] + [0.6, 0.2]
    assert counted([(torus, NO_SYMBOL), (henon(16, 0.1), NO_SYMBOL)]) == 1


def test_the_longest_gap_is_that_of_the_minimum_spanning_tree() -> None:
    points = np.random.default_rng(5).normal(size=(9, 16, 4))
    points[3, 7:] = np.nan
    for one, gap in zip(points, longest_gaps(points), strict=True):
        known_ones = one[np.isfinite(one[:, 0])]
        tree = minimum_spanning_tree(squareform(pdist(known_ones)))
        assert gap == pytest.approx(tree.max(), rel=1e-14)


def test_single_points_are_matched_by_the_tolerance() -> None:
    near = [(np.full((1, 2), at), NO_SYMBOL) for at in (0.0, MEMBER_DISTANCE / 2, 1.0)]
    assert counted(near) == 2


def test_members_without_points_count_nothing() -> None:
    assert counted([(np.full((16, 2), np.nan), NO_SYMBOL)]) == 0


# ---- scale and words -----------------------------------------------------------------------------


def members(n: list[int], p: list[int], end: list[int], impacts: list[float]) -> xr.Dataset:
    meanings = "time_reached most_impacts undecided"
    flagged = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": meanings}
    return xr.Dataset(
        {
            "n": ("start", np.array(n, dtype=np.int16)),
            "p": ("start", np.array(p, dtype=np.int16)),
            "q": ("start", np.array(p, dtype=np.int16)),
            "end": ("start", np.array(end, dtype=np.int8), flagged),
            "impacts_a": ("start", np.array(impacts)),
            "impacts_b": ("start", np.array(impacts)),
        }
    )


def test_motions_are_coded_from_the_most_frequent_symbol_to_the_outcomes() -> None:
    given = members([2, 1, 1, 0, 0, 0, 3], [2, 1, 1, 0, 0, 0, 3], [0, 0, 0, 0, 0, 2, 1],
                    [1.0, 1.0, 1.0, 0.9, 0.0, 0.5, 9.0])  # fmt: skip
    codes = motions(given)
    words = [words_of_codes(codes)[int(code)] for code in codes]
    assert words == [
        *("2-2-2", "1-1-1", "1-1-1", "not_periodic", "no_impacts", "undecided", "most_impacts"),
    ]
    listed = [(one.words, one.members) for one in categories(codes)]
    assert listed[:2] == [("1-1-1", 2), ("2-2-2", 1)]
    assert sum(count for _, count in listed) == len(given.start)


def test_symbols_equally_frequent_are_coded_by_their_numbers() -> None:
    """The numbers go to the largest that the kernel's symbols can hold, 2^15 - 1."""
    n, p, q = [1, 32767, 1, 1, 0], [2, 1, 1, 1, 32767], [0, 1, 2, 1, 32767]
    given = members(n, p, [0] * 5, [1.0] * 5).assign(q=("start", np.array(q)))
    assert [one.words for one in categories(motions(given))] == [
        "32767-32767", "1-1-1", "1-1-2", "1-2-0", "32767-1-1",
    ]  # fmt: skip


def test_chaos_is_told_from_the_rest_by_the_growth_of_a_tangent() -> None:
    """e^10 over the window, which is a sixth of the time: exponent 10 / 50."""
    given = members([0, 0, 0, 1], [0, 0, 0, 1], [0, 0, 0, 0], [0.5, 0.5, 0.5, 0.5])
    given["time"] = "start", np.full(4, 300.0)
    given["lyapunov"] = "start", np.array([0.19, 0.21, np.nan, 0.3])
    codes = motions(given.assign_attrs(settle_periods=250.0, periods=50.0))
    words = [words_of_codes(codes)[int(code)] for code in codes]
    assert words == ["not_periodic", "chaotic", "not_periodic", "1-1-1"]


def test_an_ensemble_in_which_nothing_is_periodic_has_codes_too() -> None:
    codes = motions(members([0, 0], [0, 0], [0, 0], [0.5, 0.0]))
    assert [one.words for one in categories(codes)] == ["not periodic", "no impacts"]


@pytest.mark.parametrize(
    ("symbols", "count"),
    [
        ([], 0),
        ([NO_SYMBOL, NO_SYMBOL], 1),
        ([(1, 0, 1), (2, 0, 2), NO_SYMBOL, (13, 0, 13)], 1),
        ([(1, 0, 1), (2, 0, 1), (3, 0, 2)], 3),
        ([(0, 1, 1), (0, 2, 2)], 1),
    ],
)
def test_symbols_that_are_not_proportional_are_different(
    symbols: list[tuple[int, int, int]], count: int
) -> None:
    assert count_symbols(np.array(symbols, dtype=np.int64).reshape(-1, 3)) == count


def against(wall: float) -> vi.Mechanism:
    """An oscillator that meets a wall."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(2.082, (1.0,)),),
        elements=(vi.RigidStop((1.0,), upper=wall, restitution=0.7),),
    )  # fmt: skip


@pytest.mark.parametrize("wall", [0.0, 1e-12, -1e-9])
def test_positions_on_a_wall_at_zero_are_rounding_and_tell_nothing_apart(wall: float) -> None:
    start = vi.State((-0.5,), (0.0,))
    assert str(vi.classify(against(wall), start).type) == "1-1-0"
    asked: dict[str, Any] = {"settle_periods": 400, "progress": False}
    many = vi.RandomStarts(40, 0, {"x1": (-2.0, -0.1)}, start)
    walls = vi.Family(against, wall=wall)
    found = vi.multistability(walls, over={"wall": [wall]}, start=many, **asked)
    assert found["attractors"].values.tolist() == [1]
    assert set(found["n"].values.ravel().tolist()) == {1}
    axes = {"x1": [-2.0, -1.0, -0.1], "v1": [-1.0, 1.0]}
    basins = vi.basins(against(wall), over=axes, start=start, **asked)
    assert basins["name"].values.tolist() == ["1-1-0 a"]
    assert (basins["attractor"] == 0).all()


def test_a_turn_of_the_phase_is_no_distance() -> None:
    position = np.array([[[2.0]], [[2.0]]])
    given = xr.Dataset(
        {
            "section_position": (("start", "point", "coordinate"), position),
            "section_velocity": (("start", "point", "coordinate"), -2.0 * position),
            "section_time": (("start", "point"), [[3.0], [4.0]]),
            "speed_largest": ("start", [5.0, np.nan]),
        }
    )
    scale = scale_of(given, against(0.0))
    assert (scale.position, scale.velocity) == (2.0, 5.0)
    phase = np.array([[1e-9], [2.0 * np.pi - 1e-9]])
    here, there = scale.points(position, -2.0 * position, phase)
    np.testing.assert_allclose(here, there, atol=4e-9)
    assert here.shape == (1, 4)
