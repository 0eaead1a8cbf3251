"""Sweeps: every point is the motion that simulate computes, whatever is computed with it."""

from __future__ import annotations

import io
import itertools
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from support.families import compiled
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact._core import progress
from vibroimpact.sweeps.execution.compute import placed
from vibroimpact.sweeps.execution.tiles import (
    compiled_bytes,
    members_per_tile,
    tile_shape,
    tiles_of,
)
from vibroimpact.sweeps.member_status import MemberStatus

DAMPER = paper_damper("A", 1.2)
PLAIN = vi.State((0.0, 0.0), (0.0, 1.0))
OVER = {"omega": np.linspace(1.0, 1.2, 5), "half_clearance": np.linspace(2.0, 5.0, 4)}
SHORT = {"settle_periods": 20, "periods": 10, "progress": False}
FINAL = ("final_position", "final_velocity", "final_phase")


def swept(over=OVER, start=PLAIN, observe=("final", "symbol", "section"), **options):
    return vi.sweep(DAMPER, over=over, start=start, observe=observe, **(SHORT | options))


def state_of(point: xr.Dataset) -> vi.State:
    position, velocity, phase = (point[name].values for name in FINAL)
    return vi.State(tuple(position), tuple(velocity), float(phase))


# --- members --------------------------------------------------------------------------------------


def test_every_point_ends_where_simulate_ends():
    found = swept()
    for omega in OVER["omega"]:
        for clearance in OVER["half_clearance"]:
            damper = paper_damper("A", omega, half_clearance=clearance)
            point = found.sel(omega=omega, half_clearance=clearance)
            run = vi.simulate(damper, PLAIN, t_max=30 * damper.period)
            assert run.end.name == "HORIZON"
            assert point.end == MemberStatus.OK
            # the window is the sum of two lengths: its end differs by rounding of the time
            assert point.time == pytest.approx(run.time[-1], rel=1e-15)
            np.testing.assert_allclose(point.final_position, run.last.position, atol=1e-11)
            np.testing.assert_allclose(point.final_velocity, run.last.velocity, atol=1e-11)


@pytest.mark.parametrize("options", [{"tile": 1}, {"tile": 3, "workers": 3}, {"workers": 1}])
def test_tiles_and_threads_change_no_bit(options):
    xr.testing.assert_identical(swept(**options), swept())


def test_the_order_of_the_values_changes_no_bit():
    there = swept()
    back = swept({name: axis[::-1] for name, axis in OVER.items()})
    xr.testing.assert_equal(back.sortby(list(OVER)), there)


def test_any_number_of_a_mechanism_is_swept():
    system = DAMPER.mechanism
    over = {"elements[0].upper": [4.0, 5.0], "mass[1][1]": [0.1, 0.2, 0.3]}
    found = vi.sweep(system, over=over, start=PLAIN, observe="final", **SHORT)
    assert dict(found.end.sizes) == {"elements[0].upper": 2, "mass[1][1]": 3}
    same = found.isel({"elements[0].upper": 1, "mass[1][1]": 0})
    alone = vi.sweep(DAMPER, over={"omega": [1.2]}, start=PLAIN, observe="final", **SHORT)
    for name in FINAL:
        np.testing.assert_array_equal(same[name], alone[name][0])


def test_without_forcing_lengths_are_times():
    ball = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=(-1.0,),
        elements=(vi.RigidStop((1.0,), lower=0.0, restitution=1.0),),
    )  # fmt: skip
    start = vi.GridStarts({"x1": [0.5, 2.0]}, vi.State((1.0,), (0.0,)))
    found = vi.sweep(ball, over={}, start=start, observe="final", settle_periods=0, periods=7.0,
                     progress=False)  # fmt: skip
    assert found.time.values.tolist() == [7.0, 7.0]
    # an elastic ball of height h returns every 2 sqrt(2 h): seven units are 3.5 returns from 1/2
    assert found.final_position.values[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_a_member_with_too_many_impacts_says_so():
    say = r"^(\d+) of \1 members have no results: they had 7 imp"
    with pytest.warns(UserWarning, match=say) as warned:
        found = swept(most_impacts=7)
    assert warned[0].filename == __file__  # whoever asked
    with pytest.warns(UserWarning, match=say) as warned:
        vi.plane(DAMPER, over=OVER, start=PLAIN, most_impacts=7, **SHORT)
    assert warned[0].filename == __file__
    assert (found.end == MemberStatus.MAX_IMPACTS).all()
    assert not found.n.values.any()


@pytest.mark.parametrize("seed", range(8))
def test_ordinary_chatter_never_meets_the_default_cap(seed):
    """A slow force presses a mass on its stops: it chatters on both in every period."""
    rng = np.random.default_rng(seed)
    damping, stiffness = rng.uniform(0.0, 0.2), rng.uniform(0.0, 1.0)

    def masses(omega: float, restitution: float) -> vi.Mechanism:
        return vi.Mechanism(
            mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]],
            forces=(vi.Harmonic(omega, (2.0,)),),
            elements=(vi.RigidStop((1.0,), -0.2, 0.5, restitution),),
        )  # fmt: skip

    start = vi.GridStarts({"v1": np.linspace(-1.0, 1.0, 4)}, vi.State((0.0,), (0.0,)))
    over = {"omega": [0.01, 0.1 ** rng.uniform(0.0, 2.0)], "restitution": [0.7, 0.9, 0.97]}
    found = vi.sweep(
        vi.Family(masses, omega=0.1, restitution=0.9), over=over, start=start,
        observe=["impacts", "shares"], settle_periods=5, periods=15, progress=False,
    )  # fmt: skip
    assert (found.end == MemberStatus.OK).all()
    slow = found.isel(omega=0)
    assert (slow.chatters >= 28).all()  # two in each of 15 periods, but at the ends
    assert (slow.impacts_a + slow.impacts_b).min() > 60
    assert (slow.impacts_a + slow.impacts_b).max() > 1000


# --- starts ---------------------------------------------------------------------------------------


def test_random_starts_are_those_of_the_seed_in_any_tile():
    ranges = {"v2": (-1.0, 3.0), "x1": (-0.5, 0.5), "phase": (0.0, 6.0)}
    starts = vi.RandomStarts(11, 42, ranges, PLAIN)
    found = swept(start=starts, tile=3)
    unit = np.random.Generator(np.random.PCG64(42)).random((11, 3))
    for i, name in enumerate(["x1", "v2", "phase"]):
        low, high = ranges[name]
        np.testing.assert_array_equal(found[name], low + (high - low) * unit[:, i])
    xr.testing.assert_identical(found, swept(start=starts))
    assert found.attrs["seed"] == 42
    more = vi.RandomStarts(4, 42, ranges, PLAIN, skip=7)
    np.testing.assert_array_equal(swept(start=more).x1, found.x1[7:])


def test_a_grid_of_starts_is_the_same_starts_one_by_one():
    starts = vi.GridStarts({"v1": [-1.0, 0.5], "x2": [-3.0, 0.0, 4.0]}, PLAIN)
    found = swept({"omega": [1.1, 1.2]}, starts)
    assert found.end.dims == ("omega", "v1", "x2")
    for v1 in (-1.0, 0.5):
        for x2 in (-3.0, 0.0, 4.0):
            alone = swept({"omega": [1.1, 1.2]}, vi.State((0.0, x2), (v1, 1.0)))
            point = found.sel(v1=v1, x2=x2, drop=True)
            for name in alone:
                np.testing.assert_array_equal(point[name], alone[name], err_msg=name)


def test_a_coordinate_of_the_start_is_an_axis_like_a_parameter():
    mixed = swept({"x2": [-3.0, 4.0], "omega": [1.1, 1.2], "v1": [-1.0, 0.5]}, PLAIN)
    grid = vi.GridStarts({"x2": [-3.0, 4.0], "v1": [-1.0, 0.5]}, PLAIN)
    xr.testing.assert_identical(mixed, swept({"omega": [1.1, 1.2]}, grid))


def test_listed_starts_go_on_where_another_sweep_ended():
    first = vi.GridStarts({"v1": [-1.0, 0.5, 0.7]}, PLAIN)
    ended = swept({}, first, observe="final")
    listed = vi.ListedStarts(ended.final_position, ended.final_velocity, ended.final_phase)
    found = swept({"omega": [1.1, 1.2]}, listed, tile=2)
    assert found.end.dims == ("omega", "start")
    for i, state in enumerate(zip(*listed.states(), strict=True)):
        position, velocity, phase = state
        alone = swept({"omega": [1.1, 1.2]}, vi.State(tuple(position), tuple(velocity), phase))
        point = found.isel(start=i)
        assert (point.x1, point.v2, point.phase) == (position[0], velocity[1], phase)
        for name in alone:
            np.testing.assert_array_equal(point[name], alone[name], err_msg=name)


def test_a_start_behind_a_stop_is_an_outcome():
    starts = vi.GridStarts({"x2": [-7.0, 0.0, 7.0]}, PLAIN)
    found = swept({"half_clearance": [5.0, 8.0]}, starts)
    behind, moves = MemberStatus.INITIAL_PENETRATION, MemberStatus.OK
    assert found.end.values.tolist() == [[behind, moves, behind], [moves] * 3]
    meanings = found.end.attrs["flag_meanings"].split()
    assert meanings[list(found.end.attrs["flag_values"]).index(behind)] == "initial_penetration"


def test_following_passes_an_undamped_resonance():
    over = {"omega": [0.4, 0.5, 0.6]}
    damper = paper_damper("A", 1.2, zeta=0.0)
    asked = {"start": PLAIN, "observe": "final"} | SHORT
    found = vi.sweep(damper, over=over, follow="omega", **asked)
    assert found.end.values.tolist() == [MemberStatus.OK] * 3
    last = (found[name].values[1] for name in ("final_position", "final_velocity", "final_phase"))
    position, velocity, phase = last
    start = vi.State(tuple(position), tuple(velocity), float(phase))
    alone = vi.sweep(damper, over={"omega": [0.6, 0.7]}, **asked | {"start": start})
    for name in FINAL:
        np.testing.assert_array_equal(found[name][2], alone[name][0], err_msg=name)


# --- following ------------------------------------------------------------------------------------


@pytest.mark.parametrize("downwards", [False, True])
def test_a_followed_member_starts_where_it_ended_at_the_value_before(downwards):
    found = swept(follow="-omega" if downwards else "omega", tile=5)
    for clearance in OVER["half_clearance"]:
        state = PLAIN
        for omega in OVER["omega"][:: -1 if downwards else 1]:
            over = {"omega": [omega], "half_clearance": [clearance]}
            alone = swept(over, state).isel(omega=0, half_clearance=0)
            point = found.sel(omega=omega, half_clearance=clearance)
            for name in alone:
                np.testing.assert_array_equal(point[name], alone[name], err_msg=name)
            state = state_of(alone)


def test_following_goes_by_value_not_by_place():
    shuffled = {"omega": np.array([1.1, 1.0, 1.2])}
    xr.testing.assert_equal(
        swept(shuffled, follow="omega").sortby("omega"),
        swept({"omega": np.array([1.0, 1.1, 1.2])}, follow="omega"),
    )


def test_following_with_incommensurate_lines_goes_on_at_the_same_instant():
    def system(damping):
        return vi.Mechanism(
            mass=[[1.0]], damping=[[damping]], stiffness=[[1.0]],
            forces=(vi.Harmonic(1.3, (1.0,)), vi.Harmonic(0.5**0.5, (0.7,))),
            elements=(vi.RigidStop((1.0,), upper=1.0, restitution=0.8),),
        )  # fmt: skip

    start = vi.State((0.0,), (0.3,), 0.4)
    same = [0.1, np.nextafter(0.1, 1.0)]  # as good as one value
    asked = {"over": {"damping[0][0]": same}, "follow": "damping[0][0]", "start": start}
    length = {"settle_periods": 0, "periods": 1.5, "progress": False}
    twice = vi.sweep(system(0.1), observe="final", **asked, **length)
    run = vi.simulate(system(0.1), start, t_max=2 * 1.5 * 2 * math.pi / 1.3)
    # rounding of three periods' motion, grown by impacts that are few and not near grazing
    np.testing.assert_allclose(twice.final_position[1], run.last.position, atol=1e-12)
    np.testing.assert_allclose(twice.final_velocity[1], run.last.velocity, atol=1e-12)


def test_a_stop_that_moves_past_a_followed_member_takes_it_along():
    clearances = np.linspace(1.0, 6.0, 41)
    found = swept(
        {"half_clearance": clearances}, follow="-half_clearance", settle_periods=0, periods=0.3
    )
    ends = found.final_position.values @ [-1.0, 1.0]
    behind = np.abs(ends[1:]) > clearances[:-1]
    assert behind.any()  # the case is met: somewhere the next stop lies inside
    assert (found.end == MemberStatus.OK).all()


def test_a_start_that_was_never_admissible_is_not_moved():
    beyond = vi.State((0.0, 5.5), (0.0, 0.0))
    found = swept({"half_clearance": [4.0, 5.0, 6.0]}, beyond, follow="half_clearance")
    assert found.end.values.tolist() == [
        MemberStatus.INITIAL_PENETRATION,
        MemberStatus.INITIAL_PENETRATION,
        MemberStatus.OK,
    ]


# --- the dataset ----------------------------------------------------------------------------------


def test_a_dataset_goes_to_netcdf_and_back(tmp_path: Path):
    found = swept(start=vi.RandomStarts(3, 1, {"v1": (-1.0, 1.0)}, PLAIN))
    found.to_netcdf(tmp_path / "sweep.nc", engine="h5netcdf")
    xr.testing.assert_identical(
        xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf")[list(found)], found
    )


def test_the_attributes_say_everything_that_was_asked():
    starts = vi.RandomStarts(3, 5, {"v1": (-1.0, 1.0)}, PLAIN)
    attrs = swept(start=starts, follow="-omega").attrs
    assert attrs["settle_periods"] == 20
    assert attrs["periods"] == 10
    assert attrs["follow"] == "-omega"
    assert json.loads(attrs["start"])["base"]["velocity"] == [0.0, 1.0]
    assert "restitution=0.8" in attrs["system"]
    assert {type(value) for value in attrs.values()} <= {str, int, float}


def test_the_value_of_a_swept_parameter_in_the_given_system_is_of_no_consequence():
    other = paper_damper("A", 0.7, half_clearance=1.0)
    found = vi.sweep(other, over=OVER, start=PLAIN, observe=("final", "symbol", "section"), **SHORT)
    xr.testing.assert_identical(found, swept())


def test_progress_counts_members():
    told: list[tuple[int, int]] = []
    swept(tile=8, progress=lambda report: told.append((report.done, report.total)))
    assert told[-1] == (20, 20)
    assert [done for done, _ in told] == sorted({done for done, _ in told})


def test_progress_on_a_terminal_shows_the_rate_and_the_time_left(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr(progress.time, "monotonic", itertools.count().__next__)
    terminal = Terminal()
    bar = progress.Display(1, stream=terminal)
    assert [*bar.track("sweep", [30, 70], 100, size=int, unit="members")] == [30, 70]
    drawn = terminal.getvalue().split("\r")
    assert re.search(r"sweep +\.{24}$", drawn[2])
    assert re.search(r"#{24} 33\.3 members/s +0 s left$", drawn[-1])


# --- tiles ----------------------------------------------------------------------------------------


@given(
    shape=st.lists(st.integers(1, 7), min_size=1, max_size=4).map(tuple),
    members=st.integers(1, 60),
    data=st.data(),
)
def test_tiles_cover_the_grid_once_and_never_cut_a_followed_axis(shape, members, data):
    followed = data.draw(st.sampled_from([None, *range(len(shape))]))
    sizes = tile_shape(shape, members, followed)
    seen = np.zeros(shape, dtype=int)
    for tile in tiles_of(shape, sizes):
        seen[tile.place] += 1
        assert tile.size == seen[tile.place].size
    assert (seen == 1).all()
    if followed is None:
        assert math.prod(sizes) <= members
    else:
        assert sizes[followed] == shape[followed]


def test_tiles_are_smaller_where_members_take_long_or_hold_much():
    usual = members_per_tile(10**9, 300, 4000)
    assert members_per_tile(10**9, 30_000, 4000) < usual
    assert members_per_tile(10**9, 300, 10**6) < usual
    assert members_per_tile(10**9, 1e12, 4000) == 1
    assert members_per_tile(100, 300, 4000) >= 100
    assert members_per_tile(4 * 10**6, 300, 4000, along=2000) > 2000 * 10


def test_the_size_of_a_compiled_system_is_about_that_of_its_tables():
    batch = compiled(DAMPER, {"omega": np.linspace(1.0, 1.2, 100)})
    (_, tables), *others = batch
    assert not others
    flat = [*tables.systems.values()]
    for mode in tables.modes:
        flat += [x for x in (*mode.values(), *mode["flow"].values()) if isinstance(x, np.ndarray)]
    held = sum(x.nbytes for x in flat) / 100
    # twice, to be on the safe side; the small arrays are not counted
    assert compiled_bytes(DAMPER.mechanism) == pytest.approx(2 * held, rel=0.5)


# --- misuse ---------------------------------------------------------------------------------------

BAD = {
    "an unknown parameter": ({"over": {"omgea": [1.0]}}, "omgea"),
    "no values": ({"over": {"omega": []}}, r"over\['omega'\] has shape \(0,\)"),
    "a table of values": ({"over": {"omega": [[1.0]]}}, r"shape \(1, 1\)"),
    "a value that is no number": ({"over": {"omega": ["a"]}}, "must be numbers"),
    "an infinite value": ({"over": {"omega": [1.0, np.inf]}}, "omega'].1. = inf"),
    "a value twice": ({"over": {"omega": [1.0, 1.1, 1.0]}}, "1.0: is given 2 times"),
    "a value out of range": ({"over": {"restitution": [0.5, 1.5]}}, "restitution = 1.5"),
    "no axis": ({"over": {}}, "names no parameter"),
    "axes that are no dictionary": ({"over": [1.0]}, "must be a dictionary"),
    "a coordinate that no state has": ({"over": {"x9": [0.0]}}, "'x9': must be one of x1, x2, v1"),
    "a coordinate beside several starts": (
        {"over": {"x1": [0.0]}, "start": vi.GridStarts({"v1": [0.0, 1.0]}, PLAIN)},
        "varies one state",
    ),
    "an unknown observer": ({"observe": "symbols"}, "symbols"),
    "a kind of observer": ({"observe": vi.observe.Section}, r"such as Section\(\)"),
    "progress that is none": ({"progress": "yes"}, "progress = 'yes': must be True, a function"),
    "no state": ({"start": (0.0, 0.0)}, "must be a State"),
    "a state of another system": ({"start": vi.State((0.0,), (0.0,))}, r"shape \(1,\)"),
    "following no axis": ({"follow": "zeta"}, "follow = 'zeta': must be None or one of 'omega'"),
    "following what is no name": ({"follow": 5}, "follow = 5"),
    "a window for ever": ({"periods": 1e30}, "settle_periods . periods = 1e.30: must be shorter"),
    "impacts for ever": ({"most_impacts": 10**20}, "must be at most 1125899906842624"),
    "a store that is no name": ({"store": 5}, "store = 5: must be the name of a file or a folder"),
    "a negative length": ({"settle_periods": -1}, "settle_periods = -1"),
    "no length": ({"periods": 0}, "periods = 0"),
    "no impacts": ({"most_impacts": 0}, "most_impacts = 0"),
    "no workers": ({"workers": 0}, "workers = 0"),
    "no tile": ({"tile": 0}, "tile = 0"),
    "an unknown backend": ({"backend": "thread"}, "backend = 'thread'"),
}


@pytest.mark.parametrize(("options", "said"), BAD.values(), ids=BAD)
def test_misuse_is_refused_by_name(options, said):
    with pytest.raises(vi.InvalidParameterError, match=said):
        swept(**options)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: vi.RandomStarts(0, 1, {"v1": (0.0, 1.0)}, PLAIN), "starts = 0"),
        (lambda: vi.RandomStarts(1, -1, {"v1": (0.0, 1.0)}, PLAIN), "seed = -1"),
        (
            lambda: vi.RandomStarts(1, 2**64, {"v1": (0.0, 1.0)}, PLAIN),
            "at most 18446744073709551615",
        ),
        (lambda: vi.RandomStarts(1, 1, {"v3": (0.0, 1.0)}, PLAIN), "'v3'"),
        (lambda: vi.RandomStarts(1, 1, {"v1": (1.0, 0.0)}, PLAIN), "low < high"),
        (lambda: vi.RandomStarts(1, 1, {"v1": 1.0}, PLAIN), "low < high"),
        (lambda: vi.RandomStarts(1, 1, {}, PLAIN), "at least one"),
        (lambda: vi.GridStarts({"x3": [0.0]}, PLAIN), "'x3'"),
        (lambda: vi.GridStarts({"x1": [0.0, np.nan]}, PLAIN), "finite"),
        (lambda: vi.GridStarts({"x1": [0.0]}, (0.0, 0.0)), "must be a State"),
        (lambda: vi.ListedStarts([0.0, 1.0], [0.0, 1.0]), r"position has shape \(2,\); .*\(k, n\)"),
        (lambda: vi.ListedStarts([[0.0]], [[0.0], [1.0]]), r"velocity has .*expected \(1, 1\)"),
        (lambda: vi.ListedStarts([[0.0]], [[0.0]], [0.0, 1.0]), r"phase has shape \(2,\)"),
        (lambda: vi.ListedStarts([[0.0, np.inf]], [[0.0, 0.0]]), r"position\[0, 1\] = inf: every"),
        (lambda: vi.ListedStarts([["a"]], [[0.0]]), "position = .*: must be an array of numbers"),
    ],
)
def test_starts_that_are_none_are_refused_by_name(make, said):
    with pytest.raises(vi.InvalidParameterError, match=said):
        make()


def test_results_that_no_memory_holds_are_refused_before_anything_runs(monkeypatch):
    axis = np.linspace(0.9, 1.1, 1_000_000)
    over = {"omega": axis, "half_clearance": 5.0 * axis}
    with pytest.raises(vi.InvalidParameterError, match=r"results of 1\.5e\+04 GB.* Give store="):
        vi.sweep(DAMPER, over=over, start=PLAIN, progress=False)
    monkeypatch.setattr("vibroimpact.sweeps.sweep.memory_here", lambda: 29)  # 2 x 15
    with pytest.raises(vi.InvalidParameterError, match="more than the memory here"):
        vi.sweep(DAMPER, over={"omega": axis[:2]}, start=PLAIN, progress=False)


def test_following_without_a_parameter_is_refused():
    starts = vi.GridStarts({"x1": [0.0, 0.5]}, PLAIN)
    with pytest.raises(vi.InvalidParameterError, match="must be None: over has no parameter"):
        vi.sweep(DAMPER, over={}, start=starts, follow="x1", **SHORT)


def test_two_names_of_one_number_are_refused():
    over = {"stiffness[0][1]": [0.0, 0.1], "stiffness[1][0]": [0.0, 0.1]}
    with pytest.raises(vi.InvalidParameterError, match="one changes the other"):
        vi.sweep(DAMPER.mechanism, over=over, start=PLAIN, **SHORT)


def test_a_value_that_a_mechanism_refuses_is_named():
    over = {"mass[1][1]": [0.3, -0.2], "omega": [1.0, 1.2]}
    with pytest.raises(vi.InvalidParameterError, match=r"mass\[1\]\[1\] = -0.2, omega = 1.0"):
        vi.sweep(DAMPER.mechanism, over=over, start=PLAIN, **SHORT)


def test_a_parameter_named_like_a_result_is_refused():
    def build(n):
        return paper_damper("A", 1.2, half_clearance=n).mechanism

    with pytest.raises(vi.InvalidParameterError, match="'n'"):
        vi.sweep(vi.Family(build, n=5.0), over={"n": [4.0, 5.0]}, start=PLAIN, **SHORT)


def test_a_state_behind_a_stop_is_put_on_it_with_the_centre_of_mass_in_its_place() -> None:
    damper = paper_damper("A", 1.2)
    state = damper.on_stop("A", x1=0.7, v1=0.1, v2=-3.0, phase=1.0)
    assert placed(damper.mechanism, state) is state
    near = replace(damper, half_clearance=damper.half_clearance - 0.5)
    there = placed(near.mechanism, state)
    gap = there.position[1] - there.position[0]
    assert gap == pytest.approx(near.half_clearance, rel=1e-15)
    mass = np.array([1.0, damper.mass_ratio])
    assert mass @ there.position == pytest.approx(float(mass @ state.position), rel=1e-14)
