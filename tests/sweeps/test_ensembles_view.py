"""Planes, diagrams, basins and counts say what single runs say."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import vibroimpact as vi
from vibroimpact.plotting import plot_basins, plot_plane
from vibroimpact.results.result import words_of_codes
from vibroimpact.sweeps.analyses.label_attractors import label_attractors
from vibroimpact.sweeps.analyses.plane import with_motions
from vibroimpact.sweeps.member_status import NOT_COMPUTED, MemberStatus

SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)
# set B at a frequency of the paper where three attractors coexist
SET_B = vi.ImpactDamper(
    mass_ratio=0.04, omega_n=0.6, zeta=0.025, restitution=0.7, half_clearance=8.0, omega=0.945
)
START = vi.State((0.0, 0.0), (0.0, 1.0))


def word(codes: xr.DataArray) -> str:
    """The category of a single member."""
    return words_of_codes(codes)[int(codes)].replace("_", " ")


@pytest.fixture(scope="module")
def basins_b() -> xr.Dataset:
    axis = np.linspace(-6.0, 6.0, 9)
    return vi.basins(
        SET_B, over={"x1": axis, "v1": axis}, start=START, settle_periods=2000, progress=False
    )  # fmt: skip


# ---- planes --------------------------------------------------------------------------------------


def test_a_plane_has_the_symbols_that_classify_finds() -> None:
    over = {"omega": np.array([0.75, 0.85, 1.05, 1.2]), "half_clearance": np.array([4.0, 5.0])}
    plane = vi.plane(SET_A, over=over, start=START, settle_periods=3000, progress=False)
    periodic = 0
    for cell in plane.stack(cell=list(over)).transpose("cell", ...).cell.values:
        here = plane.sel(omega=cell[0], half_clearance=cell[1])
        damper = replace(SET_A, omega=cell[0], half_clearance=cell[1])
        attractor = vi.classify(damper, START, settle_events=20_000)
        periodic += attractor.type is not None
        assert word(here.motion.assign_attrs(plane.motion.attrs)) == str(
            attractor.type or "not periodic"
        )
        if attractor.type is not None:
            n, a, b = attractor.type
            assert int(here.period) == n
            assert float(here.impacts) == pytest.approx((a + b) / n, abs=2 / 50)  # ends of 50
    assert periodic >= 4


def test_a_plane_takes_other_options_of_the_symbol() -> None:
    from vibroimpact.sweeps.observers import Symbol

    over = {"omega": [1.1, 1.2], "half_clearance": [5.0]}
    strict = Symbol(tolerance=1e-15)
    plane = vi.plane(
        SET_A, over=over, start=START, settle_periods=5, observe=strict, progress=False
    )
    assert [word(cell) for cell in plane.motion.squeeze()] == ["not periodic"] * 2


def bouncing() -> vi.Mechanism:
    """Two masses that strike each other for ever, without forcing."""
    return vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 1.0]], damping=[[0.0, 0.0], [0.0, 0.0]],
        stiffness=[[2.0, -1.0], [-1.0, 2.5]],
        elements=(vi.RigidStop((1.0, -1.0), -0.3, 0.3, 1.0),),
    )  # fmt: skip


def test_what_impacts_without_forcing_is_not_without_impacts() -> None:
    start, options = vi.State((0.0, 0.1), (1.0, 0.3)), {"settle_periods": 100, "periods": 300}
    over = {"stiffness[0][0]": [2.0, 3.0], "elements[0].upper": [0.3, 0.35]}
    plane = vi.plane(bouncing(), over=over, start=start, progress=False, **options)
    assert "no_impacts" not in plane.motion.attrs["flag_meanings"]
    record = vi.simulate(bouncing(), start, impacts=10_000, t_max=400.0)
    seen = (record.time >= 100.0) & (record.status == vi.Status.IMPACT)
    assert float(plane.impacts[0, 0]) * 300 == pytest.approx(seen.sum())
    grid = {"v1": [1.0, 2.0], "x1": [0.0, 0.1]}
    basins = vi.basins(bouncing(), over=grid, start=start, progress=False, **options)
    assert "without impacts" not in basins.name.values
    starts = vi.GridStarts({"v1": [0.0, 1.0]}, vi.State((0.0, 0.0), (0.0, 0.0)))
    counted = vi.multistability(
        bouncing(), over={"stiffness[0][0]": [2.0]}, start=starts, progress=False, **options
    )
    assert counted.attractors.item() == 2  # at rest between the stops, and in motion


def test_a_stored_plane_is_drawn_when_it_is_opened_again(tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    over = {"omega": np.linspace(1.0, 1.2, 3), "half_clearance": np.array([4.0, 5.0])}
    options = {"over": over, "start": START, "settle_periods": 50, "progress": False}
    plane = vi.plane(SET_A, store=tmp_path / "plane.zarr", **options)
    again = xr.open_zarr(tmp_path / "plane.zarr", consolidated=False)
    pictures = [plot_plane(one, variable="impacts") for one in (plane, again)]
    one, other = (ax.collections[0].get_array() for ax in pictures)
    np.testing.assert_array_equal(one, other)


def test_what_a_store_does_not_hold_yet_is_not_computed(tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    over = {"omega": np.linspace(1.0, 1.2, 3), "half_clearance": np.array([4.0, 5.0])}
    options = {"over": over, "start": START, "settle_periods": 50, "progress": False}
    vi.plane(SET_A, store=tmp_path / "plane.zarr", tile=2, observe="lyapunov", **options)
    (tmp_path / "plane.zarr" / "end" / "c" / "0" / "0").unlink()
    partial = xr.open_zarr(tmp_path / "plane.zarr", consolidated=False)
    here = with_motions(partial, ["motion"]).motion
    words = np.vectorize(words_of_codes(here).get)(here.values)
    lost = partial.end.values == NOT_COMPUTED
    assert lost.any()
    assert not lost.all()
    np.testing.assert_array_equal(words == "not_computed", lost)
    assert words_of_codes(partial.end)[NOT_COMPUTED] == "not_computed"
    legend = plot_plane(partial).get_legend()
    assert "not computed" in [text.get_text() for text in legend.get_texts()]


def test_the_attributes_say_how_attractors_and_ways_were_asked_for() -> None:
    options = {"settle_periods": 20, "periods": 10, "progress": False}
    over = {"omega": [1.1, 1.2]}
    both = vi.bifurcation_sweep(SET_A, over=over, start=START, points=3, **options)
    place = {"stop": "A", "contact": 0}
    assert both.attrs["follow"] == "omega, -omega"
    assert json.loads(both.attrs["call"]) == {
        "way": "both", "at": place, "points": 3, "observe": [],
    }  # fmt: skip
    starts = vi.RandomStarts(2, 0, {"x1": (-1.0, 1.0)}, START)
    counted = vi.multistability(SET_A, over=over, start=starts, same_within=0.01, **options)
    assert json.loads(counted.attrs["call"]) == {"at": place, "same_within": 0.01}
    grid = {"x1": [0.0], "v1": [0.0]}
    found = vi.basins(SET_A, over=grid, start=START, same_within=0.02, most_classified=3, **options)
    assert (
        json.loads(found.attrs["call"]).items()
        >= {"same_within": 0.02, "most_classified": 3, "over": grid}.items()
    )


def test_a_plane_of_other_than_two_parameters_is_refused() -> None:
    for over in ({}, {"omega": [1.0]}, [1.0, 2.0]):
        with pytest.raises(vi.InvalidParameterError, match="must be two parameters"):
            vi.plane(SET_A, over=over, start=START)  # type: ignore[arg-type]


# ---- diagrams ------------------------------------------------------------------------------------


def test_a_diagram_goes_up_and_comes_back_from_where_it_ended() -> None:
    omegas = np.linspace(0.94, 0.96, 5)
    options = {"settle_periods": 400, "periods": 40, "progress": False}
    both = vi.bifurcation_sweep(SET_B, over={"omega": omegas}, start=START, points=12, **options)
    assert dict(both.v1.sizes) == {"direction": 2, "omega": 5, "point": 12}
    state = START
    for way, order in (("up", omegas), ("down", omegas[::-1])):
        for omega in order:
            damper = replace(SET_B, omega=omega)
            here = both.sel(direction=way, omega=omega)
            alone = vi.sweep(
                damper, over={"omega": [omega]}, start=state, observe="final", settle_periods=400,
                periods=40, progress=False,
            ).isel(omega=0)  # fmt: skip
            np.testing.assert_array_equal(here.final_position, alone.final_position)
            state = vi.State(
                tuple(alone.final_position.values), tuple(alone.final_velocity.values),
                float(alone.final_phase),
            )  # fmt: skip


def test_the_points_of_a_diagram_are_those_of_the_section() -> None:
    diagram = vi.bifurcation_sweep(
        SET_A, over={"omega": [1.2]}, start=START, way="up", points=3, observe="lyapunov",
        progress=False,
    )  # fmt: skip
    section = vi.section(SET_A, START, settle_events=600, points=3)
    for name, values in {"x1": section.x1, "v1": section.v1, "phase": section.phase}.items():
        # settled: the orbit attracts by 0.98 per period, 250 periods leave 1e-9 of order 1
        np.testing.assert_allclose(diagram[name].values.ravel(), values, atol=1e-7)
    assert float(diagram.lyapunov.item()) < 0.0


def test_random_starts_of_a_diagram_are_not_followed() -> None:
    starts = vi.RandomStarts(3, 1, {"x1": (-1.0, 1.0), "v1": (-1.0, 1.0)}, START)
    diagram = vi.bifurcation_sweep(
        SET_A, over={"omega": [1.1, 1.2]}, start=starts, points=4, progress=False
    )
    assert dict(diagram.x1.sizes) == {"omega": 2, "start": 3, "point": 4}
    assert np.isfinite(diagram.x1).all()


def test_misuse_of_a_diagram_is_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match="must be one parameter"):
        vi.bifurcation_sweep(SET_A, over={}, start=START)
    with pytest.raises(vi.InvalidParameterError, match="way = 'left': must be one of up, down"):
        vi.bifurcation_sweep(SET_A, over={"omega": [1.0]}, start=START, way="left")  # type: ignore[arg-type]
    with pytest.raises(vi.InvalidParameterError, match="points = 0"):
        vi.bifurcation_sweep(SET_A, over={"omega": [1.0]}, start=START, points=0)
    grid = vi.GridStarts({"x1": [0.0, 0.5]}, START)
    with pytest.raises(vi.InvalidParameterError, match="must be a State, which is followed, R"):
        vi.bifurcation_sweep(SET_A, over={"omega": [1.0]}, start=grid)  # type: ignore[arg-type]


def test_both_ways_do_not_fit_into_one_store(tmp_path: Path) -> None:
    asked = {"over": {"omega": [1.1, 1.2]}, "start": START, "settle_periods": 5, "progress": False}
    with pytest.raises(vi.InvalidParameterError, match='way = "down" with another store'):
        vi.bifurcation_sweep(SET_A, store=tmp_path / "both.zarr", **asked)
    pytest.importorskip("zarr", reason="the extra `store` is not installed")
    kept = vi.bifurcation_sweep(SET_A, store=tmp_path / "up.zarr", way="up", **asked)
    xr.testing.assert_equal(kept, vi.bifurcation_sweep(SET_A, way="up", **asked))


def test_a_diagram_goes_down_from_the_start_if_nothing_ran_at_the_top() -> None:
    """The free mass is at 4, the stops are at half_clearance: it is behind them up to 3."""
    asked = {"start": vi.State((0.0, 4.0), (0.0, 0.0)), "settle_periods": 5, "progress": False}
    none = vi.bifurcation_sweep(SET_A, over={"half_clearance": [1.0, 3.0]}, **asked)
    assert (none.end == MemberStatus.INITIAL_PENETRATION).all()
    assert none.v1.isnull().all()


# ---- basins --------------------------------------------------------------------------------------


def test_three_attractors_of_set_b_are_found_and_named(basins_b: xr.Dataset) -> None:
    assert sorted(basins_b.name.values) == ["1-1-1 a", "8-8-8 a", "8-8-8 b"]
    assert float(basins_b.share.sum()) == pytest.approx(1.0, abs=1e-15)
    shares = basins_b.share.values
    assert list(shares) == sorted(shares, reverse=True)
    for label in basins_b.label.values:
        assert float(basins_b.share[label]) == float((basins_b.attractor == label).mean())


def test_every_start_leads_where_it_is_said_to_lead(basins_b: xr.Dataset) -> None:
    """Against classify from the start itself, longer, with its section points compared."""
    known = {
        name: vi.classify(SET_B, vi.attractor_state(basins_b, name), settle_events=2000, points=64)
        for name in basins_b.name.values
    }
    for i, j in [(0, 0), (1, 5), (3, 7), (4, 4), (6, 2), (8, 3)]:
        start = vi.State((float(basins_b.x1[i]), 0.0), (float(basins_b.v1[j]), 1.0))
        reached = vi.classify(SET_B, start, settle_events=16_000, points=400)
        name = str(basins_b.name[int(basins_b.attractor[i, j])].item())
        assert str(reached.type) == name.split()[0]
        own = known[name].section.x1[-reached.type.impacts_a :]  # type: ignore[union-attr]
        assert np.abs(own - reached.section.x1[-1]).min() < 1e-4, (i, j, name)


def test_mirror_images_are_two_attractors(basins_b: xr.Dataset) -> None:
    a, b = (vi.classify(SET_B, vi.attractor_state(basins_b, f"8-8-8 {x}")) for x in "ab")
    image = [-x for x in b.section.x1[-8:]]
    assert not a.symmetric
    # points at stop A of one against those at stop A of the other: they differ
    assert np.abs(np.sort(a.section.x1[-8:]) - np.sort(b.section.x1[-8:])).max() > 0.05
    other = vi.section(SET_B, a.section.last, at=vi.AtStop("B"), points=8, settle_events=0)
    np.testing.assert_allclose(np.sort(other.x1), np.sort(image), atol=1e-6)


def test_the_state_of_an_attractor_leads_to_its_orbit(basins_b: xr.Dataset) -> None:
    orbit = vi.find_orbit(SET_B, vi.attractor_state(basins_b, "8-8-8 a"))
    assert orbit.converged
    assert orbit.symbol == "8-8-8"
    assert orbit.stable
    with pytest.raises(vi.InvalidParameterError, match=r"'9-9-9 a': must be one of .*8-8-8 a"):
        vi.attractor_state(basins_b, "9-9-9 a")


def settled_already(*_: object) -> xr.Dataset:
    raise AssertionError("no member was to go on")


def test_labels_do_not_depend_on_the_order_of_the_members(basins_b: xr.Dataset) -> None:
    turned = basins_b.isel(x1=slice(None, None, -1), v1=slice(None, None, -1))
    own = turned.drop_vars(["attractor", *(v for v in turned if "label" in turned[v].dims)])
    labels, found, _ = label_attractors(SET_B, own, np.zeros(81), settled_already, at=vi.AtStop())
    names = {one.word for one in found}
    assert names == set(basins_b.name.values)
    for code, one in enumerate(found):
        same = basins_b.name.values.tolist().index(one.word)
        here = (labels == code).values
        swapped = {"8-8-8 a": "8-8-8 b", "8-8-8 b": "8-8-8 a"}.get(one.word, one.word)
        other = basins_b.name.values.tolist().index(swapped)
        assert (here == (turned.attractor == same).values).all() or (
            here == (turned.attractor == other).values
        ).all()


def test_motions_that_come_to_rest_are_named_by_their_stop() -> None:
    free = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], constant_force=[-1.0],
        forces=(vi.Harmonic(1.0, (0.01,)),),
        elements=(vi.RigidStop((1.0,), lower=0.0, upper=3.0, restitution=0.5),),
    )  # fmt: skip
    found = vi.basins(
        free,
        at=vi.AtStop("B"),
        over={"x1": [0.5, 1.0, 2.0], "v1": [0.0, 1.0]},
        start=vi.State((0.0,), (0.0,)),
        settle_periods=10,
        periods=3,
        progress=False,
    )
    assert found.name.values.tolist() == ["at rest on stop B"]
    assert float(found.share.item()) == 1.0


def test_starts_behind_a_stop_are_no_attractor() -> None:
    found = vi.basins(
        SET_A, over={"x1": [-6.0, 0.0, 6.0], "v1": [0.0, 1.0]}, start=START, progress=False
    )
    assert found.name.values.tolist() == ["1-1-1 a"]
    assert words_of_codes(found.attractor)[int(found.attractor[0, 0])] == "initial_penetration"
    assert float(found.share.item()) == 1.0  # of the two that can start


def test_starts_in_chaos_lead_to_one_attractor() -> None:
    chaos = replace(SET_A, omega=1.2, half_clearance=9.0)
    axis = np.linspace(-1.0, 1.0, 5)
    found = vi.basins(chaos, over={"x1": axis, "v2": axis}, start=START, progress=False)
    impacting = [name for name in found.name.values if "impacts" not in name]
    assert impacting == ["chaotic a"]


def test_members_that_settle_slowly_make_no_attractor_of_their_own() -> None:
    """The multiplier of the 1-1-1 orbit is 0.9936: 400 periods leave 8%, above the tolerance."""
    axis = np.linspace(-6.0, 6.0, 4)
    found = vi.basins(
        SET_B, over={"x1": axis, "v1": axis}, start=START, settle_periods=400, progress=False
    )
    assert sorted(found.name.values) == ["1-1-1 a", "8-8-8 a", "8-8-8 b"]


def test_members_that_are_on_their_way_go_on_until_they_are_where_they_lead(
    basins_b: xr.Dataset,
) -> None:
    """80 periods leave 0.9936^80 = 60% of the distance to 1-1-1; 2000 leave 3e-6."""
    over = {name: basins_b[name].values for name in ("x1", "v1")}
    early = vi.basins(SET_B, over=over, start=START, settle_periods=30.25, progress=False)
    assert sorted(early.name.values) == sorted(basins_b.name.values)
    assert (early.attractor.values >= 0).all()
    for i, name in enumerate(early.name.values):
        here = early.attractor.values == i
        others = np.unique(basins_b.attractor.values[here])
        assert len(others) == 1
        assert basins_b.name.values[others[0]][:-2] == name[:-2]


def test_an_interruption_while_members_go_on_says_what_is_kept(tmp_path: Path) -> None:
    pytest.importorskip("zarr")
    axis = np.linspace(-6.0, 6.0, 9)

    def stop(report: vi.ProgressReport) -> None:
        assert report.total is not None
        if report.total < axis.size**2:
            raise KeyboardInterrupt

    options = {
        "over": {"x1": axis, "v1": axis},
        "start": START,
        "settle_periods": 30,
        "progress": stop,
    }
    with pytest.raises(KeyboardInterrupt, match="towards their attractors; nothing is kept"):
        vi.basins(SET_B, **options)
    with pytest.raises(KeyboardInterrupt, match=r"the window is whole in .*basins\.zarr"):
        vi.basins(SET_B, store=tmp_path / "basins.zarr", **options)


def test_what_drifts_towards_its_next_impact_is_not_without_impacts() -> None:
    """In 55 periods the free mass moves by 1.5 of the 8 to its stop."""
    over = {"x1": [0.0, 0.1], "v1": [0.0, 0.1]}
    options = {"over": over, "settle_periods": 5, "progress": False}
    slow, still = (vi.State((0.0, 0.0), (0.0, speed)) for speed in (4e-3, 0.0))
    found = vi.basins(SET_B, start=slow, **options)
    assert (found.impacts_a + found.impacts_b == 0).all()
    assert "without impacts" not in found.name.values
    assert vi.basins(SET_B, start=still, **options).name.values.tolist() == ["without impacts"]


def one_sided(omega: float) -> vi.Mechanism:
    """An oscillator that strikes its stop A; B is far away."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[0.2]], stiffness=[[1.0]], forces=(vi.Harmonic(omega, (1.0,)),),
        elements=(vi.RigidStop((1.0,), lower=-50.0, upper=0.5, restitution=0.7),),
    )  # fmt: skip


def test_motions_that_never_meet_the_section_are_told_apart_by_their_symbol() -> None:
    over = {"x1": [-1.0, 0.0, 0.3], "v1": [-0.5, 0.5]}
    start = vi.State((0.0,), (0.0,))
    wall = one_sided(0.8)
    names = [
        vi.basins(
            wall, at=vi.AtStop(stop), over=over, start=start, progress=False
        ).name.values.tolist()
        for stop in ("A", "B")
    ]
    assert names[0] == names[1]
    assert names[0][0].endswith("-0 a")  # impacts at A alone
    short = vi.basins(
        wall, at=vi.AtStop("B"), over=over, start=start, settle_periods=0, periods=2, progress=False
    )
    assert short.name.values.tolist() == ["not periodic a"]
    assert short.kind.values.tolist() == ["undecided"]


def test_motions_that_never_meet_the_section_are_counted_by_their_symbol() -> None:
    starts = vi.GridStarts({"x1": [-1.0, 0.0, 0.3]}, vi.State((0.0,), (0.0,)))
    walls = vi.Family(one_sided, omega=0.8)
    for stop in ("A", "B"):
        met = vi.multistability(
            walls,
            at=vi.AtStop(stop),
            over={"omega": [0.8, 1.5]},
            start=starts,
            settle_periods=300,
            progress=False,
        )
        assert met.attractors.values.tolist() == [1, 1]


def test_attractors_beyond_the_limit_are_not_matched() -> None:
    axis = np.linspace(-6.0, 6.0, 5)
    found = vi.basins(
        SET_B,
        over={"x1": axis, "v1": axis},
        start=START,
        settle_periods=2000,
        most_classified=1,
        progress=False,
    )
    assert len(found.name) == 1
    words = words_of_codes(found.attractor)
    assert words[-1] == "not_matched"
    assert (found.attractor.values == -1).any()


def test_misuse_of_basins_is_refused() -> None:
    grid = {"x1": [0.0], "v1": [0.0]}
    with pytest.raises(vi.InvalidParameterError, match="must be two coordinates"):
        vi.basins(SET_A, over={"x1": [0.0]}, start=START)
    with pytest.raises(vi.InvalidParameterError, match="must be one of x1, x2, v1, v2, phase"):
        vi.basins(SET_A, over={"x1": [0.0], "omega": [1.0]}, start=START)
    with pytest.raises(vi.InvalidParameterError, match=r"same_within = 0: must be in \(0, 1\)"):
        vi.basins(SET_A, over=grid, start=START, same_within=0)
    with pytest.raises(vi.InvalidParameterError, match="contact = 3: must be 0"):
        vi.basins(SET_A, at=vi.AtStop(contact=3), over=grid, start=START)
    with pytest.raises(vi.InvalidParameterError, match=r"Compute them with vi\.basins"):
        vi.attractor_state(xr.Dataset({"n": 1}), "1-1-1 a")


def test_the_phases_that_were_asked_for_are_an_axis() -> None:
    phases = np.array([0.0, 1.0, 2.0])
    found = vi.basins(SET_A, over={"v2": [0.5, 1.0], "phase": phases}, start=START, progress=False)
    np.testing.assert_array_equal(found["phase"], phases)
    assert found.attractor.dims == ("v2", "phase")
    state = vi.attractor_state(found, "1-1-1 a")
    assert state.phase == float(found.attractor_phase[0])
    assert str(vi.classify(SET_A, state).type) == "1-1-1"


def test_where_every_start_is_behind_a_stop_there_is_no_attractor() -> None:
    over = {"x1": [0.0, 1.0], "x2": [90.0, 91.0]}
    found = vi.basins(SET_A, over=over, start=START, progress=False)
    assert found.attractor_position.shape == found.attractor_velocity.shape == (0, 2)
    assert [text.get_text() for text in plot_basins(found).get_legend().get_texts()] == [
        "behind stop"
    ]


# ---- counting ------------------------------------------------------------------------------------


def test_the_count_is_that_of_the_basins(basins_b: xr.Dataset) -> None:
    axis = np.linspace(-6.0, 6.0, 9)
    met = vi.multistability(
        SET_B, over={"omega": [0.945, 1.0]}, settle_periods=2000, progress=False,
        start=vi.GridStarts({"x1": axis, "v1": axis}, START),
    )  # fmt: skip
    assert int(met.attractors[0]) == len(basins_b.name)
    assert met.attractors.dims == ("omega",)


def test_a_torus_near_locking_is_counted_once() -> None:
    """Next to 2/5 sixteen points of a member come in five heaps."""
    near = replace(SET_B, omega=0.99, half_clearance=9.5)
    starts = vi.RandomStarts(16, 1, {"x1": (-6.0, 6.0), "v1": (-6.0, 6.0)}, START)
    met = vi.multistability(
        near, over={"omega": [0.99]}, start=starts, settle_periods=1000, progress=False
    )
    assert met.attractors.item() == 1


def test_where_one_orbit_attracts_every_start_one_is_counted() -> None:
    starts = vi.RandomStarts(6, 2, {"x1": (-3.0, 3.0), "v1": (-3.0, 3.0)}, START)
    over = {"omega": [1.1, 1.2], "half_clearance": [4.5, 5.0, 5.5]}
    met = vi.multistability(SET_A, over=over, start=starts, settle_periods=1000, progress=False)
    np.testing.assert_array_equal(met.attractors, np.ones((2, 3)))


def test_motion_without_impacts_counts_as_one() -> None:
    """The main mass swings by 1 / (1.2^2 - 0.5^2) < 5 and leaves a free mass at rest alone."""
    starts = vi.GridStarts({"v2": [0.0, 0.001, 1.0], "v1": [0.0, -0.1]}, START)
    met = vi.multistability(
        SET_A, over={"omega": [1.2]}, start=starts, settle_periods=6000, periods=100, progress=False
    )
    assert met.attractors.values.tolist() == [2]


def test_counting_needs_several_starts() -> None:
    with pytest.raises(vi.InvalidParameterError, match="must be RandomStarts, GridStarts or"):
        vi.multistability(SET_A, over={"omega": [1.0]}, start=START)  # type: ignore[arg-type]
