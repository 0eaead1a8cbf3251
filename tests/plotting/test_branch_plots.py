"""Pictures of branches: what is drawn is the branch, in the look that its orbits deserve."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox
from numpy.typing import NDArray
from support.pictures import words

import vibroimpact as vi
from vibroimpact.branches.branch import place_of, profile
from vibroimpact.branches.profile import coordinate
from vibroimpact.orbits.stability import Stability
from vibroimpact.plotting import plot_branch_multipliers, plot_branches, style
from vibroimpact.plotting.branch_multipliers import _step
from vibroimpact.plotting.branches import LINES
from vibroimpact.plotting.labels import Labels
from vibroimpact.plotting.motion_colours import OWN, colours_of

pytestmark = pytest.mark.usefixtures("no_windows")

SET_A = vi.ImpactDamper(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=0.75
)


@pytest.fixture(scope="module")
def symmetric() -> vi.Branch:
    """Through grazing at 0.507, symmetry breaking at 0.707 and a Neimark-Sacker point at 0.932."""
    return vi.continue_orbit(
        vi.symmetric_orbits(SET_A)[0], "omega", (0.48, 0.95), inadmissible=True
    )


@pytest.fixture(scope="module")
def broken(symmetric: vi.Branch) -> vi.Branch:
    found = vi.switch_branch(symmetric["BP1"], (0.65, 0.8))
    assert isinstance(found, vi.Branch)
    return found


COLOURS = colours_of(["1-1-1", "1-1-1"])


def stretches(ax: Axes, colour: str = COLOURS[0]) -> list[tuple[str, NDArray[np.float64]]]:
    """(look, points) of the lines of a branch that hold data."""
    names = {"-": "stable", "--": "unstable", ":": "not admissible"}
    return [
        (names[str(line.get_linestyle())], np.column_stack([*map(np.asarray, line.get_data())]))
        for line in ax.get_lines()
        if len(np.asarray(line.get_xdata())) > 1 and to_rgb(line.get_color()) == to_rgb(colour)
    ]


@pytest.mark.slow
def test_the_look_changes_exactly_at_the_special_points(symmetric: vi.Branch) -> None:
    drawn = stretches(plot_branches([symmetric]))
    assert [look for look, _ in drawn] == ["not admissible", "unstable", "stable", "unstable"]
    ends = [(points[0, 0], points[-1, 0]) for _, points in drawn]
    at = [symmetric[label].parameter for label in ("GR1", "BP1", "NS1")]
    assert ends == list(zip([0.48, *at], [*at, 0.95], strict=True))


def test_every_point_of_the_branch_is_drawn_at_its_value(symmetric: vi.Branch) -> None:
    drawn = np.vstack([points for _, points in stretches(plot_branches([symmetric]))])
    for i in range(0, len(symmetric), 7):
        orbit = symmetric.orbit(i)
        expected = symmetric.values[i], orbit.states[0, 2]
        assert np.any(np.all(drawn == expected, axis=1))


@pytest.mark.slow
def test_special_points_are_in_order_along_a_branch(broken: vi.Branch) -> None:
    points = profile(broken)
    order = [broken.special_points[i].label for i in points.special if i >= 0]
    assert order == [point.label for point in broken.special_points] == ["BP1", "PD1"]
    assert len(points.parameter) == len(broken) + 2
    arclengths = [place_of(broken, point)[1] for point in broken.special_points]
    assert arclengths == sorted(arclengths)
    # between its neighbours, but for rounding next to the birth
    known = 1e-9  # Newton's last step next to a singular point, of the range
    assert np.all(np.diff(points.parameter) <= known)


def test_a_stretch_between_two_special_points_is_never_called_stable() -> None:
    from vibroimpact.branches.branch import _between

    stable, _, unstable, out = Stability
    own = np.array([stable, -1, -1, stable, stable, -1, unstable, out])
    assert list(_between(own)) == [stable, unstable, stable, stable, stable, unstable, out]
    assert list(_between(np.array([out, -1, -1, out]))) == [out, out, out]


def test_a_neutral_point_at_the_end_of_a_branch_does_not_make_its_stretch_neutral() -> None:
    from vibroimpact.branches.branch import _between

    stable, neutral, unstable, out = Stability
    assert list(_between(np.array([neutral, stable, neutral, unstable]))) == [
        stable,
        stable,
        unstable,
    ]
    assert list(_between(np.array([neutral, neutral, -1, out]))) == [neutral, neutral, out]


@pytest.mark.parametrize("impact", [0, 1])
def test_coordinates_are_those_of_the_orbits(symmetric: vi.Branch, impact: int) -> None:
    points = profile(symmetric)
    plain = np.flatnonzero(points.special < 0)
    orbit = symmetric.orbit(20)
    flip = -1.0 if impact else 1.0  # the second impact of a symmetric orbit is the mirror image
    for name, value in {
        "x1": flip * orbit.states[0, 0],
        "v2": flip * orbit.states[0, 3],
        "phase": (orbit.states[0, 4] + impact * np.pi) % (2.0 * np.pi),
        "speed": orbit.least_impact_speed,
        "clearance": orbit.clearance_to_grazing,
        "period": orbit.period,
    }.items():
        drawn = coordinate(symmetric, points, name, impact)[plain[20]]
        assert drawn == pytest.approx(value, rel=1e-12)  # sums of a few rounded numbers


def test_the_phase_does_not_jump_across_the_picture() -> None:
    start = vi.symmetric_orbits(replace(SET_A, omega=1.2))[1]
    branch = vi.continue_orbit(start, "omega", (1.0, 1.5))
    theta = coordinate(branch, profile(branch), "phase")
    ax = plot_branches([branch], variable="phase")
    assert all(np.abs(np.diff(p[:, 1])).max() < np.pi for _, p in stretches(ax))
    assert theta.min() >= 0.0
    assert theta.max() < 2.0 * np.pi


def test_labels_and_markers_name_every_special_point(symmetric: vi.Branch) -> None:
    ax = plot_branches([symmetric])
    written = {text.get_text(): text.xy for text in ax.texts if isinstance(text, Annotation)}
    assert set(written) == {"GR1", "BP1", "NS1"}
    assert written["NS1"][0] == symmetric["NS1"].parameter
    named = words(ax)
    assert named[:3] == ["stable", "unstable", "not admissible"]
    assert {"grazing", "symmetry breaking", "Neimark-Sacker"} < set(named)
    plain = plot_branches([symmetric], marks=False)
    assert not plain.texts


def label_boxes(ax: Axes) -> list[Bbox]:
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.canvas.draw()
    return [Text.get_window_extent(text) for text in ax.texts]  # without the leader


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_labels_neither_cover_each_other_nor_leave_the_axes(seed: int) -> None:
    """Clusters of points, of which some lie at the edges: more labels than there is room for."""
    rng = np.random.default_rng(seed)
    _, ax = plt.subplots(figsize=(4.0, 3.0), dpi=100.0)
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    labels = Labels(ax)
    for centre in rng.random((8, 2)):
        for x, y in np.clip(centre + 0.02 * rng.standard_normal((12, 2)), 0.0, 1.0):
            labels.add("NS12", x, y, "black")
    labels.place()
    boxes, frame = label_boxes(ax), ax.get_window_extent()
    assert len(boxes) > 40
    assert not any(first.overlaps(second) for first, second in combinations(boxes, 2))
    for box in boxes:
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1


def test_no_two_of_twenty_branches_have_the_same_colour() -> None:
    assert len(set(style.series(20))) == 20
    assert style.series(20)[:3] == style.series(3)


def test_a_coordinate_that_varies_by_rounding_alone_is_a_level_line_with_short_ticks() -> None:
    """The place of a mass at its own stop is 1.26 to some rounding errors."""
    _, ax = plt.subplots()
    ax.plot([0.0, 1.0, 2.0], [1.26, 1.26 * (1.0 + 1e-12), 1.26])
    style.widen_constant(ax)
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.canvas.draw()
    ticks = [label.get_text() for label in ax.get_yticklabels()]
    assert max(map(len, ticks)) <= 5
    assert ax.get_ylim() == pytest.approx((1.26 * 0.95, 1.26 * 1.05))


def test_branches_have_their_own_colours_and_names(symmetric: vi.Branch, broken: vi.Branch) -> None:
    ax = plot_branches([symmetric, broken])
    assert words(ax)[:2] == ["0: 1-1-1, symmetric", "1: 1-1-1"]
    assert stretches(ax, COLOURS[0])
    assert stretches(ax, COLOURS[1])


@pytest.mark.slow
def test_at_a_stop_every_impact_there_is_drawn_and_the_mirror_images(broken: vi.Branch) -> None:
    doubled = vi.switch_branch(broken["PD1"], (0.65, 0.67))
    assert isinstance(doubled, vi.Branch)
    expected = [unfolded[k, 0] for unfolded in [doubled.orbit(0).states] for k in (0, 2)]
    image = [-doubled.orbit(0).states[k, 0] for k in (1, 3)]
    ax = plot_branches([doubled], variable="x1", stop=(0, 1), mirror=True, marks=False)
    drawn = stretches(ax, OWN[doubled.symbol])
    at_start = [p[0, 1] for _, p in drawn if p[0, 0] == doubled.values[0]]
    np.testing.assert_array_equal(sorted(at_start), sorted([*expected, *image]))


def test_attractors_are_drawn_behind_without_the_missing_points(symmetric: vi.Branch) -> None:
    values = np.array([[[1.0, 2.0], [3.0, np.nan]]])
    cloud = xr.Dataset(
        {"v1": (("direction", "omega", "point"), values)},
        coords={"direction": ["up"], "omega": [0.6, 0.7]},
    )
    ax = plot_branches([symmetric], attractors=cloud)
    behind = min(ax.get_lines(), key=lambda line: line.get_zorder())
    x, y = (np.asarray(d) for d in behind.get_data())
    assert sorted(zip(x, y, strict=True)) == [(0.6, 1.0), (0.6, 2.0), (0.7, 3.0)]
    with pytest.raises(vi.InvalidParameterError, match="x2 over omega"):
        plot_branches([symmetric], variable="x2", attractors=cloud)


@pytest.mark.slow
def test_a_branch_of_a_single_point_leaves_the_picture_empty(symmetric: vi.Branch) -> None:
    one = slice(0, 1)
    curve = replace(
        symmetric.curve, parameter=symmetric.values[one], z=symmetric.curve.z[one],
        tangent=symmetric.curve.tangent[one], arclength=symmetric.curve.arclength[one],
    )  # fmt: skip
    single = replace(
        symmetric, values=symmetric.values[one], multipliers=symmetric.multipliers[one],
        stability=symmetric.stability[one],
        special_points=(), curve=curve,
    )  # fmt: skip
    assert not stretches(plot_branches([single]))
    assert plot_branch_multipliers(single)


def test_misuse_is_refused_with_what_there_is(symmetric: vi.Branch) -> None:
    with pytest.raises(vi.InvalidParameterError, match="x1, x2, v1, v2, phase, speed, clearance"):
        plot_branches([symmetric], variable="x3")
    with pytest.raises(vi.InvalidParameterError, match="need one or more"):
        plot_branches([])


def test_paths_of_the_multipliers_are_drawn_and_the_critical_ones_marked(
    symmetric: vi.Branch,
) -> None:
    ax = plot_branch_multipliers(symmetric)
    shown = np.vstack([np.asarray(c.get_offsets()) for c in ax.collections if len(c.get_offsets())])
    points = np.column_stack(
        [symmetric.multipliers.real.ravel(), symmetric.multipliers.imag.ravel()]
    )
    assert {tuple(p) for p in points} <= {tuple(p) for p in shown}
    nu = next(m for m in symmetric["NS1"].multipliers if m.imag > 0 and abs(abs(m) - 1.0) < 1e-6)
    marks = [tuple(line.get_xydata()[0]) for line in ax.get_lines() if len(line.get_xydata()) == 1]
    assert (nu.real, nu.imag) in marks
    assert (nu.real, -nu.imag) in marks
    assert {text.get_text() for text in ax.texts} == {"BP1", "NS1"}


def test_a_path_does_not_jump_to_another_multiplier(symmetric: vi.Branch) -> None:
    from vibroimpact.plotting.branch_multipliers import _sorted

    shuffled = np.array([np.roll(row, i) for i, row in enumerate(symmetric.multipliers[60:100])])
    paths = _sorted(shuffled)
    np.testing.assert_array_equal(np.sort_complex(paths), np.sort_complex(shuffled))
    gaps = np.abs(np.diff(paths, axis=0)).max()
    assert gaps <= np.abs(np.diff(_sorted(symmetric.multipliers[60:100]), axis=0)).max()


def test_paths_of_the_multipliers_have_no_gaps(symmetric: vi.Branch) -> None:
    for path in plot_branch_multipliers(symmetric).collections:
        if isinstance(path, LineCollection):
            steps = [np.asarray(step.vertices) for step in path.get_paths()]
            for before, after in pairwise(steps):
                np.testing.assert_allclose(before[-1], after[0], rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("turned", [False, True])
def test_a_pair_that_meets_takes_the_roots_of_the_polynomial_between(turned: bool) -> None:
    """z^2 - 2 m z + m^2 - h, with m from 0.3 to 0.4 and h from 0.04 to -0.09: numpy's roots."""
    ends = [np.array([0.5 + 0j, 0.1 + 0j]), np.array([0.4 + 0.3j, 0.4 - 0.3j])]
    paths = [_step(ends[::-1] if turned else ends, i) for i in (0, 1)]
    np.testing.assert_allclose([path[0] for path in paths], ends[1 if turned else 0], atol=1e-15)
    h = np.linspace(0.04, -0.09, 33)[:: -1 if turned else 1]
    assert any(path.imag[1:-1].any() and path.real.any() for path in paths)
    for value in h:
        share = (value - h[0]) / (h[-1] - h[0])
        m = 0.4 - 0.1 * share if turned else 0.3 + 0.1 * share
        for root in np.roots([1.0, -2.0 * m, m * m - value]):
            # A double root moves by the root of a rounding error.
            assert min(np.abs(path - root).min() for path in paths) < 1e-7


def test_plots_draw_where_asked_and_leave_the_settings(symmetric: vi.Branch) -> None:
    before = mpl.rcParams.copy()
    _, ax = plt.subplots()
    assert symmetric.plot("speed", ax=ax) is ax
    assert plot_branch_multipliers(symmetric, ax=plt.subplots()[1])
    assert mpl.rcParams == before
    assert ax.get_xlabel() == r"forcing frequency $\omega$"
    assert LINES[Stability.STABLE] == "-"
