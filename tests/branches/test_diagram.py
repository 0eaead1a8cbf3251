"""All branches around an orbit: each found once, with where it comes from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import vibroimpact as vi
from vibroimpact.branches.diagram import (
    Diagram,
    branch_diagram,
)
from vibroimpact.branches.same_orbit import (
    image,
    junction_of,
    loop_of,
    orbits_at,
    primitive_loop,
    same_branch,
    same_loop,
)
from vibroimpact.continuation import Stopped
from vibroimpact.orbits.find import rotated, solve, unfolded
from vibroimpact.orbits.problem import Signature

pytestmark = pytest.mark.usefixtures("no_windows")

SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.75
)
RANGE = (0.6, 0.75)
RUBBING = vi.Mechanism(
    mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], forces=(vi.Harmonic(0.755, (0.0,), (1.5,)),),
    elements=(vi.Friction((1.0,), kinetic=1.0, static=1.1),),
)  # fmt: skip
CLOSE = 1e-8  # Newton's method ends near 1e-14; a square root at a special point halves the digits


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    """Symmetry breaking at 0.707; on what is born there period doubling and grazing, twice each."""
    return branch_diagram(vi.symmetric_orbits(SET_A)[0], "omega", RANGE, depth=2, points=40)


# ---- the tree ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_every_branch_around_the_orbit_is_found_once(diagram: Diagram) -> None:
    found = [(b.symbol, b.family.signature.symmetric) for b in diagram.branches]
    assert found[:2] == [("1-1-1", True), ("1-1-1", False)]
    # from either grazing, one the mirror image of the other: 1-2-1 is 1-1-2 in the mirror
    assert found[2][0] in ("1-2-1", "1-1-2")
    # 2-2-2 grazes as well, and goes on to where 1-1-1 grazes twice
    assert sorted(symbol for symbol, _ in found[3:]) in (
        ["2-2-2", "2-3-2", "2-4-2"], ["2-2-2", "2-2-3", "2-2-4"],
    )  # fmt: skip
    assert all(branch.admissible.all() for branch in diagram.branches)
    for k, first in enumerate(diagram.branches):
        for second in diagram.branches[k + 1 :]:
            assert not same_branch(first, second)


def test_the_tree_says_where_each_branch_comes_from(diagram: Diagram) -> None:
    assert diagram.origin(0) is None
    first = diagram.origin(1)
    assert first is not None
    assert (first.branch, first.label, first.how) == (0, "BP1", "new")
    for number in (2, 3, 4, 5):
        origin = diagram.origin(number)
        assert origin is not None
        here = diagram.branches[origin.branch][origin.label].parameter
        there = diagram.branches[number]
        low, high = there.values.min(), there.values.max()
        assert low - 1e-6 <= here <= high + 1e-6


def test_known_branches_are_reached_but_not_followed_again(diagram: Diagram) -> None:
    how = {(r.branch, r.label): (r.to, r.how) for r in diagram.reached}
    doubled = next(k for k, b in enumerate(diagram.branches) if b.symbol == "2-2-2")
    assert how[1, "PD1"] == (doubled, "new")
    assert how[1, "BP1"] == (0, "known")
    assert how[doubled, "BP1"] == (1, "known")


def test_what_is_left_is_named(diagram: Diagram) -> None:
    doubled = next(k for k, b in enumerate(diagram.branches) if b.symbol == "2-2-2")
    assert (doubled, "PD1") in diagram.untried
    shallow = branch_diagram(vi.symmetric_orbits(SET_A)[0], "omega", (0.7, 0.75), depth=0, points=0)
    assert shallow.untried == ((0, "BP1"),)
    assert shallow.attractors is None
    assert "not tried: BP1 of 0" in repr(shallow)
    few = branch_diagram(
        vi.symmetric_orbits(SET_A)[0], "omega", (0.7, 0.75), most_branches=1, points=0
    )
    assert (len(few.branches), few.untried) == (1, ((0, "BP1"),))


def test_a_point_where_nothing_is_found_is_listed_with_its_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def nothing(point: vi.BifurcationPoint, *_: object, **__: object) -> vi.NotFound:
        return vi.NotFound(point, "the start did not converge")

    monkeypatch.setattr("vibroimpact.branches.diagram.switch_branch", nothing)
    tried = branch_diagram(vi.symmetric_orbits(SET_A)[0], "omega", (0.7, 0.75), points=0)
    assert [(r.label, r.how) for r in tried.failed] == [("BP1", "the start did not converge")]
    assert "no branch at BP1 of 0: the start did not converge" in repr(tried)


@pytest.mark.slow
def test_points_at_which_the_machine_does_not_move_so_are_not_switched_at() -> None:
    tried = branch_diagram(
        vi.symmetric_orbits(replace(SET_A, omega=0.52))[0], "omega", (0.5, 0.53), points=0,
        depth=1, inadmissible=True,
    )  # fmt: skip
    (first,) = (r for r in tried.reached if r.branch == 0)
    assert first.label == "GR1"  # the admissible end counts: the branch is admissible next to it
    assert tried.branches[1].symbol == "1-2-2"
    for r in tried.reached[1:]:
        assert (r.label, r.to) == ("ZERO1", 0)


def test_counts_out_of_range_are_refused() -> None:
    orbit = vi.symmetric_orbits(SET_A)[0]
    for name, value in {"depth": -1, "most_branches": 0, "points": -1}.items():
        with pytest.raises(vi.InvalidParameterError, match=f"{name} = {value}"):
            branch_diagram(orbit, "omega", RANGE, **{name: value})


# ---- what is the same ----------------------------------------------------------------------------


def test_an_orbit_is_itself_wherever_it_begins_and_in_the_mirror(diagram: Diagram) -> None:
    orbit = diagram.branches[3].orbit(40)
    loop, mechanism = loop_of(orbit), orbit.mechanism
    for count in range(1, len(loop.impacts)):
        assert same_loop(loop, loop_of(rotated(orbit, count)), mechanism, CLOSE) == "same"
    (mirror,) = vi.symmetries(mechanism)
    other = image(loop, mirror)
    assert same_loop(loop, other, mechanism, CLOSE) == "mirror image"
    assert same_loop(loop, image(other, mirror), mechanism, CLOSE) == "same"
    moved = loop._replace(states=loop.states * (1.0 + 1e-6))
    assert not same_loop(loop, moved, mechanism, CLOSE)


def test_the_mirror_image_of_an_orbit_is_an_orbit(diagram: Diagram) -> None:
    """What the comparison takes for an orbit solves the equations."""
    orbit = diagram.branches[1].orbit(len(diagram.branches[1]) // 2)
    other = image(loop_of(orbit), vi.symmetries(orbit.system)[0])
    guess = unfolded(orbit)._replace(states=other.states)
    found = solve(orbit.system, Signature(other.impacts, 1), guess)
    assert found.converged
    np.testing.assert_allclose(found.states, other.states, rtol=CLOSE)


def test_an_asymmetric_system_has_no_mirror_images() -> None:
    wall = vi.Mechanism(
        mass=((1.0,),), damping=((0.1,),), stiffness=((1.0,),), forces=(vi.Harmonic(0.8, (1.0,)),),
        elements=(vi.RigidStop((1.0,), lower=-0.5, upper=0.6, restitution=0.7),),
    )  # fmt: skip
    loop = loop_of(vi.continue_orbit(vi.symmetric_orbits(SET_A)[0], "omega", (0.74, 0.76)).orbit(0))
    unlike = loop._replace(impacts=loop.impacts[:1], states=loop.states[:1])
    assert not vi.symmetries(wall)
    assert not same_loop(unlike, image(unlike, vi.symmetries(SET_A)[0]), wall, CLOSE)


def test_a_doubled_orbit_at_its_birth_goes_around_the_simple_one(diagram: Diagram) -> None:
    doubled = next(b for b in diagram.branches if b.symbol == "2-2-2")
    simple = diagram.branches[1]
    there, here = doubled["BP1"], simple["PD1"]
    assert there.parameter == pytest.approx(here.parameter, abs=1e-9)
    assert len(loop_of(there.orbit).impacts) == 4
    reduced = junction_of(there, 1e-4)
    assert len(reduced.impacts) == 2
    assert same_loop(reduced, junction_of(here, 1e-4), here.orbit.mechanism, 1e-4)
    away = loop_of(doubled.orbit(int(np.argmin(doubled.values))))
    assert primitive_loop(away, 1e-4) is away


def test_orbits_of_a_branch_at_a_value_are_all_found(diagram: Diagram) -> None:
    turning = next(b for b in diagram.branches if b.symbol in ("1-2-1", "1-1-2"))  # at 0.6613
    found = list(orbits_at(turning, 0.64))
    assert len(found) == 2
    first, second = (loop_of(orbit) for orbit in found)
    assert not same_loop(first, second, found[0].mechanism, CLOSE)
    assert not list(orbits_at(turning, 0.67))


# ---- attractors, pictures, files -----------------------------------------------------------------


def test_the_sweep_lies_on_the_stable_branches(diagram: Diagram) -> None:
    swept = diagram.attractors
    assert swept is not None
    assert list(swept.direction.values) == ["up", "down"]
    near = swept.sel(omega=0.73, method="nearest")
    damper = replace(SET_A, omega=float(near.omega))
    state = vi.symmetric_orbits(damper)[0].state
    # stable, |lambda| = 0.83: 500 periods leave nothing but rounding, amplified a few times
    np.testing.assert_allclose(near["v1"].values, state.velocity[0], rtol=1e-11)
    np.testing.assert_allclose(near["phase"].values, state.phase, rtol=1e-11)


@pytest.mark.slow
def test_the_picture_shows_every_branch_over_the_attractors(diagram: Diagram) -> None:
    ax = diagram.plot("x1")
    legend = ax.get_legend()
    assert legend is not None
    assert "attractors" in [text.get_text() for text in legend.get_texts()]
    shown = [text.get_text().removesuffix(", symmetric") for text in legend.get_texts()]
    assert {f"{i}: {b.symbol}" for i, b in enumerate(diagram.branches)} <= set(shown)
    assert not diagram.plot("x1", marks=False).texts
    assert diagram.plot("speed").get_ylabel() == "smallest impact speed"  # no cloud of it


def test_the_dataset_holds_the_tree_and_the_cloud(diagram: Diagram) -> None:
    data = diagram.to_dataset()
    assert list(data.symbol.values) == [b.symbol for b in diagram.branches]
    assert list(data.reached_label.values) == [r.label for r in diagram.reached]
    assert data.sizes["omega"] == 40
    assert data.attrs["bounds"] == list(RANGE)
    assert diagram.attractors is not None
    np.testing.assert_array_equal(data["v1"].values, diagram.attractors["v1"].values)


def test_the_repr_is_the_tree(diagram: Diagram) -> None:
    lines = repr(diagram).splitlines()
    assert lines[0] == "Diagram: 6 branches, omega 0.6 to 0.75"
    assert lines[1].startswith("  0: 1-1-1, symmetric, from the orbit, 0.6 to 0.75")
    assert lines[2].startswith("  1: 1-1-1, from BP1 of 0")


def test_progress_is_told_what_is_done() -> None:
    told: list[str] = []
    tried = branch_diagram(
        vi.symmetric_orbits(SET_A)[0], "omega", (0.7, 0.75), points=2, depth=1,
        progress=lambda report: told.append(report.text),
    )  # fmt: skip
    heads = [
        "branch 0, of the orbit", "branch 1, from BP1 of branch 0 (1-1-1), 0 more points to try",
        "following a motion through 2 values, up and down",
    ]  # fmt: skip
    assert [line for line in told if ": " not in line] == heads
    panels = [line for line in told if line.startswith(f"{heads[1]}: ")]
    assert panels[0].startswith(f"{heads[1]}: 12 points, omega = ")
    assert len(panels) == len(np.unique(tried.branches[1].curve.panel))


def after_panels(count: int) -> Callable[[vi.ProgressReport], None]:
    """A progress function that interrupts in the second branch."""
    left = count

    def told(report: vi.ProgressReport) -> None:
        nonlocal left
        left -= report.text.startswith("branch 1") and "points" in report.text
        if not left:
            left = -1
            raise KeyboardInterrupt

    return told


def test_an_interruption_keeps_the_branches_found_until_then() -> None:
    orbit = vi.symmetric_orbits(SET_A)[0]
    for panels in (1, 3):  # before the second branch begins, and in it
        tried = branch_diagram(
            orbit, "omega", (0.7, 0.75), points=10, progress=after_panels(panels)
        )
        assert tried.interrupted
        assert repr(tried).endswith("interrupted")
        assert tried.attractors is None
        assert len(tried.branches) == (1 if panels == 1 else 2)
    assert tried.branches[1].curve.ends[1].reason is Stopped.INTERRUPTED


def test_points_that_are_admissible_themselves_are_tried_first(diagram: Diagram) -> None:
    levels = {0: 0}
    keys = []
    for r in diagram.reached:
        if r.how == "new":
            point = diagram.branches[r.branch][r.label]
            switched = not point.record.touch  # at a touch a branch goes on
            if switched:
                keys.append((not point.admissible, levels[r.branch]))
            levels[r.to] = levels[r.branch] + switched
    assert keys == sorted(keys)


def test_a_diagram_follows_what_does_not_exist_when_asked_for() -> None:
    orbit = vi.find_orbit(RUBBING, vi.State((2.0,), (0.0,)))
    found = branch_diagram(orbit, "omega", (0.74, 0.76), depth=0, points=3)
    assert found.attractors is None  # friction is no stop, at which a sweep could take points
    own, sticking = found.branches
    assert own.values.min() == pytest.approx(sticking.values.max(), abs=1e-2)
    assert own["REST1"].parameter == pytest.approx(sticking["REST1"].parameter, abs=1e-12)
    assert own.admissible.all()
    assert sticking.admissible.all()
    (whole,) = branch_diagram(
        orbit, "omega", (0.74, 0.76), depth=0, points=0, stop_when=None, inadmissible=True
    ).branches
    assert whole.values.min() == 0.74
    assert not whole.admissible.all()
