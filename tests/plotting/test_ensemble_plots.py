"""Pictures of ensembles: each cell has the colour of what is in it, and the legend says which."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch
from numpy.typing import NDArray

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.plotting import maps, motion_colours, style
from vibroimpact.plotting import plane as plane_look
from vibroimpact.plotting.maps import edges, geometric
from vibroimpact.plotting.rotation_look import fractions
from vibroimpact.sweeps.analyses.motion_codes import motions

pytestmark = pytest.mark.usefixtures("no_windows")

OVER = {"omega": np.linspace(0.9, 1.1, 6), "half_clearance": np.array([1.0, 2.0, 4.0, 8.0])}
DIMS = tuple(OVER)
OUTCOMES = {
    "flag_values": np.arange(3, dtype=np.int8),
    "flag_meanings": "time_reached most_impacts undecided",
}


def some_plane() -> xr.Dataset:
    """Periods 0 to 11, one cell that failed, one without impacts."""
    n = np.arange(24).reshape(6, 4) // 2
    n[5] = 1
    end, impacts = np.zeros_like(n), np.ones(n.shape)
    end[0, 1], impacts[0, 0] = 2, 0.0
    data = xr.Dataset(
        {
            **{name: (DIMS, n.astype(np.int16)) for name in ("n", "p", "q")},
            "end": (DIMS, end.astype(np.int8), OUTCOMES),
            "impacts_a": (DIMS, impacts),
            "impacts_b": (DIMS, impacts),
            "lyapunov": (DIMS, np.linspace(-0.3, 0.05, 24).reshape(6, 4)),
            "attractors": (DIMS, (n % 4).astype(np.int16)),
        },
        coords=OVER,
    )
    return data.assign(motion=motions(data.drop_vars("lyapunov")), period=data.n)


def turning_plane() -> xr.Dataset:
    """Rotation numbers 0.30 to 0.46; one that is unknown, one that has not converged."""
    rho, error = np.linspace(0.3, 0.46, 24).reshape(6, 4), np.full((6, 4), 1e-6)
    rho[0, 0], rho[1, 1], error[1, 1] = np.nan, 0.01, 0.1
    given = {"rotation": (DIMS, rho), "rotation_error": (DIMS, error)}
    return xr.Dataset(given, coords=OVER)


def some_basins() -> xr.Dataset:
    labels = np.array([[0, 0, 1], [0, 2, -5]], dtype=np.int32)
    meanings = {
        "flag_values": [0, 1, 2, -5],
        "flag_meanings": "1-1-1_a 1-1-1_b chaotic_a undecided",
    }
    ends = np.arange(12.0).reshape(2, 3, 2)
    return xr.Dataset(
        {
            "attractor": (("x1", "v2"), labels, meanings),
            "final_position": (("x1", "v2", "coordinate"), ends),
            "final_velocity": (("x1", "v2", "coordinate"), -ends),
        },
        coords={"x1": [0.0, 10.0], "v2": [-11.0, -5.0, 1.0]},
    )


def some_ways() -> xr.Dataset:
    exponents = np.array([[-0.1, 0.02, np.nan], [-0.1, -0.2, -0.3]])
    points = np.arange(12.0).reshape(2, 3, 2)
    return xr.Dataset(
        {
            "lyapunov": (("direction", "half_clearance"), exponents),
            "v1": (("direction", "half_clearance", "point"), points),
        },
        coords={"direction": ["up", "down"], "half_clearance": [1.0, 2.0, 3.0]},
    )


PLOTS: dict[str, Callable[[Axes | None], Axes]] = {
    "motion": lambda ax: plotting.plot_plane(some_plane(), ax=ax),
    "exponents": lambda ax: plotting.plot_plane(some_plane(), variable="lyapunov", ax=ax),
    "counts": lambda ax: plotting.plot_plane(some_plane(), variable="attractors", ax=ax),
    "rotation": lambda ax: plotting.plot_plane(turning_plane(), variable="rotation", ax=ax),
    "numbers": lambda ax: plotting.plot_plane(some_plane(), variable="impacts_a", ax=ax),
    "basins": lambda ax: plotting.plot_basins(some_basins(), ax=ax),
    "exponent": lambda ax: plotting.plot_along(some_ways(), ax=ax),
    "diagram": lambda ax: plotting.plot_bifurcation_diagram(some_ways(), ax=ax),
}


def cells(ax: Axes) -> tuple[QuadMesh, NDArray[np.float64]]:
    """The mesh of the picture and its values, the first dim across."""
    (mesh,) = (c for c in ax.collections if isinstance(c, QuadMesh))
    values = np.ma.filled(mesh.get_array().astype(float), np.nan)
    return mesh, np.asarray(values).reshape(mesh.get_coordinates().shape[0] - 1, -1)


def colours(ax: Axes) -> NDArray[np.float64]:
    """RGB of every cell, shape (up, across, 3)."""
    mesh, values = cells(ax)
    return np.asarray(mesh.to_rgba(values))[..., :3]


def legend(ax: Axes) -> dict[str, tuple[float, float, float]]:
    """Words and colours of the legend."""
    found = ax.get_legend()
    assert found is not None
    handles = [h for h in found.legend_handles if isinstance(h, Patch)]
    texts = [text.get_text() for text in found.get_texts()]
    return {t: to_rgb(h.get_facecolor()) for t, h in zip(texts, handles, strict=True)}


def test_values_in_any_order_give_the_picture_of_those_in_order() -> None:
    ordered = some_plane()
    shuffled = ordered.isel(omega=[3, 0, 5, 1, 4, 2], half_clearance=[2, 3, 1, 0])
    for variable in ("motion", "lyapunov"):
        (mesh, values), (other, others) = (
            cells(plotting.plot_plane(data, variable=variable)) for data in (ordered, shuffled)
        )
        np.testing.assert_array_equal(other.get_coordinates(), mesh.get_coordinates())
        np.testing.assert_array_equal(others, values)


def test_a_sweep_is_drawn_as_the_plane_that_it_becomes() -> None:
    plane = some_plane().drop_vars("lyapunov")
    for variable in ("motion", "period"):
        pictures = (plane, plane.drop_vars(["motion", "period"]))
        one, other = (cells(plotting.plot_plane(p, variable=variable))[1] for p in pictures)
        np.testing.assert_array_equal(one, other)


def test_a_symbol_has_the_same_colour_in_every_picture() -> None:
    plane = some_plane()
    n = plane.n.copy(data=np.select([plane.n == 1, plane.n == 2], [2, 1], plane.n))
    other = plane.assign(n=n, p=n, q=n).drop_vars(["motion", "lyapunov"])
    planes = plane, other.assign(motion=motions(other))
    named = ["12-12-12", "3-3-3", "1-1-1", "2-2-2"]  # the first of which does not occur
    own = {symbol: to_rgb(motion_colours.OWN[symbol]) for symbol in named[1:]}
    for some in planes:
        assert legend(plotting.plot_plane(some)).items() >= own.items()
        found = legend(plotting.plot_plane(some, symbols=named))
        assert list(found)[:4] == [*named[1:], plane_look.OTHER]
        assert found.items() >= own.items()
    known = legend(plotting.plot_basins(some_basins()))
    assert known["1-1-1 a, 50%"] == own["1-1-1"]
    assert known["chaotic a, 16.7%"] == to_rgb(plane_look.PLAIN["chaotic"])


@given(st.lists(st.sampled_from([*motion_colours.OWN, "7-7-7", "5-1-3", "1-1-1,0-1"]), max_size=40))
def test_motions_of_a_picture_have_different_colours(words: list[str]) -> None:
    found = motion_colours.colours_of(words)
    assert len({*found}) == min(
        len(words), len({*found, *motion_colours.PALETTE, *motion_colours.MORE})
    )
    for word in set(words) & set(motion_colours.COMMON):
        assert found[words.index(word)] == motion_colours.OWN[word]


@pytest.mark.parametrize(
    "symbols", ["1-1-1", [], ["1"], ["1-1-1"] * 2, [f"{n}-1-1" for n in range(8)]]
)
def test_what_is_no_list_of_symbols_is_refused(symbols: list[str]) -> None:
    with pytest.raises(vi.InvalidParameterError, match="must be 1 to 7 different ones"):
        plotting.plot_plane(some_plane(), symbols=symbols)


def test_a_count_is_labelled_with_what_it_is_counted_per() -> None:
    counted = some_plane().drop_vars("lyapunov")
    for units in ("per forcing period", "per unit of time"):
        counted.impacts_a.attrs["units"] = units
        figure = plotting.plot_plane(counted, variable="impacts").get_figure(root=True)
        assert f"impacts {units}" in [ax.get_ylabel() for ax in figure.axes]


@pytest.mark.parametrize("name", PLOTS)
def test_a_plot_draws_where_asked_and_leaves_the_users_settings_alone(name: str) -> None:
    before = dict(mpl.rcParams)
    _, ax = plt.subplots()
    assert PLOTS[name](ax) is ax
    assert PLOTS[name](None) is not ax
    assert dict(mpl.rcParams) == before
    assert "$" in ax.get_xlabel()
    assert "$" in ax.get_ylabel()


@pytest.mark.parametrize("name", PLOTS)
@pytest.mark.slow
def test_the_same_data_give_the_same_file(name: str, tmp_path: Path) -> None:
    for number in (1, 2):
        plotting.save(PLOTS[name](None), tmp_path / f"{number}.svg")
    assert (tmp_path / "1.svg").read_bytes() == (tmp_path / "2.svg").read_bytes()


@pytest.mark.parametrize("name", ["motion", "exponents", "counts", "numbers", "basins"])
def test_cells_are_stored_as_pixels(name: str) -> None:
    mesh, _ = cells(PLOTS[name](None))
    assert mesh.get_rasterized()


# ---- planes --------------------------------------------------------------------------------------


def test_every_cell_has_the_colour_that_the_legend_gives_to_its_symbol() -> None:
    plane = some_plane()
    ax = plotting.plot_plane(plane)
    known, drawn = legend(ax), colours(ax)
    for i, j in np.ndindex(plane.n.shape):
        n = int(plane.n[i, j])
        words = f"{n}-{n}-{n}" if f"{n}-{n}-{n}" in known else "other periodic"
        if n == 0:
            words = {(0, 0): "no impacts", (0, 1): "undecided"}[i, j]
        assert tuple(drawn[j, i]) == pytest.approx(known[words], abs=1e-6), (i, j, words)


def test_the_most_frequent_symbols_have_colours_of_their_own() -> None:
    words = list(legend(plotting.plot_plane(some_plane(), most_motions=3)))
    assert words[0] == "1-1-1"  # six cells
    assert len(words) == 6
    assert words[3:] == ["other periodic", "no impacts", "undecided"]


def test_a_cell_reaches_half_way_to_its_neighbours() -> None:
    plane = some_plane().assign_coords(half_clearance=[1.0, 2.0, 4.0, 9.0])
    mesh, _ = cells(plotting.plot_plane(plane))
    y = np.asarray(mesh.get_coordinates())[:, 0, 1]
    np.testing.assert_allclose(y, [0.5, 1.5, 3.0, 6.5, 11.5], rtol=1e-15)
    assert edges(np.array([2.0])).tolist() == [1.0, 3.0]


def test_zero_exponent_is_white_and_its_sign_is_seen() -> None:
    plane = some_plane()
    ax = plotting.plot_plane(plane, variable="lyapunov")
    mesh, values = cells(ax)
    np.testing.assert_array_equal(values, plane.lyapunov.values.T)
    red, green, blue = np.moveaxis(colours(ax), -1, 0)
    middle = np.asarray(mesh.to_rgba(np.zeros(1)))[0, :3]
    assert middle.min() > 0.95
    strong = np.abs(values) > 0.02
    assert np.all((red > blue)[strong] == (values > 0.0)[strong])
    assert green.max() <= 1.0


def test_cells_without_a_number_have_the_colour_of_nothing() -> None:
    plane = some_plane()
    plane.lyapunov[2, 1] = np.nan
    ax = plotting.plot_plane(plane, variable="lyapunov")
    assert np.isnan(cells(ax)[1][1, 2])
    assert to_rgb(ax.get_facecolor()) == to_rgb(style.NOTHING)


def test_a_plane_without_any_number_is_drawn_empty() -> None:
    plane = some_plane()
    plane["lyapunov"] = plane.lyapunov * np.nan
    assert np.isnan(cells(plotting.plot_plane(plane, variable="lyapunov"))[1]).all()


def test_colours_of_symbols_are_told_apart_by_readers_without_red_or_green() -> None:
    """Distances in the two planes that dichromats see, by the matrices of Vienot et al. 1999."""
    reduced = {
        "protan": np.array(
            [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.0040, -0.0040, 1.0]]
        ),
        "deutan": np.array(
            [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]]
        ),
    }
    shown = [*motion_colours.PALETTE, style.SILVER, *plane_look.PLAIN.values(), *maps.FAILED]
    for matrix in reduced.values():
        seen = [matrix @ (np.array(to_rgb(c)) ** 2.2) for c in shown]
        for one, other in combinations(seen, 2):
            assert np.linalg.norm(one - other) > 0.02


def test_outcomes_have_colours_of_their_own() -> None:
    basins = some_basins()
    basins["attractor"][0, 0] = -6
    basins["attractor"].attrs = {
        "flag_values": [0, 1, 2, -5, -6],
        "flag_meanings": "1-1-1_a 1-1-1_b chaotic_a undecided initial_penetration",
    }
    shown = legend(plotting.plot_basins(basins))
    assert len(set(shown.values())) == len(shown) == 5


def test_attractors_beyond_the_colours_are_one_entry_of_the_legend() -> None:
    words = " ".join(f"{k}-1-0_a" for k in range(12))
    meanings = {"flag_values": np.arange(12), "flag_meanings": words}
    labels = (("x1", "v2"), np.arange(12, dtype=np.int32).reshape(3, 4), meanings)
    coords = {"x1": [0.0, 1.0, 2.0], "v2": [0.0, 1.0, 2.0, 3.0]}
    found = xr.Dataset({"attractor": labels}, coords=coords)
    shown = legend(plotting.plot_basins(found, marks=False))
    assert len(shown) == len(set(shown.values())) == 8
    assert list(shown)[-1] == "other attractors, 41.7%"


def test_an_exponent_of_minus_infinity_is_no_missing_number() -> None:
    plane = some_plane()
    plane["lyapunov"][2, 1], plane["lyapunov"][3, 1] = -np.inf, np.nan
    mesh, values = cells(plotting.plot_plane(plane, variable="lyapunov"))
    seen = values.reshape(4, 6).T
    assert seen[2, 1] == mesh.norm.vmin
    assert np.argwhere(np.isnan(seen)).tolist() == [[3, 1]]
    ways = some_ways()
    ways["lyapunov"][0, 0] = -np.inf
    marks = [line for line in plotting.plot_along(ways).get_lines() if line.get_marker() == "v"]
    assert [list(line.get_xdata()) for line in marks] == [[1.0]]


def test_rotation_numbers_that_have_not_converged_have_no_colour() -> None:
    plane = turning_plane()
    mesh, values = cells(plotting.plot_plane(plane, variable="rotation"))
    blank = np.isnan(values.reshape(4, 6).T)
    assert np.argwhere(blank).tolist() == [[0, 0], [1, 1]]
    assert mesh.norm.vmin is not None
    assert mesh.norm.vmin > 0.3
    whole = plane.drop_vars("rotation_error")
    assert np.isnan(cells(plotting.plot_plane(whole, variable="rotation"))[1]).sum() == 1


def test_simple_fractions_stand_beside_rotation_numbers() -> None:
    bar = plotting.plot_plane(turning_plane(), variable="rotation").figure.axes[-1]
    marks = {t.get_text(): y for t, y in zip(bar.get_yticklabels(), bar.get_yticks(), strict=True)}
    assert {"1/3", "2/5", "3/7"} <= set(marks)
    ends = [text for text in marks if "/" not in text]
    assert ends == ["0.308"]  # no fraction is near the lower end
    for text, y in marks.items():
        assert y == pytest.approx(float(Fraction(text)), abs=5e-4 if text in ends else 0.0)


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.5), (0.4, 0.4), (0.49, 0.5), (0.381, 0.3811)])
def test_fractions_lie_in_their_range_and_apart(low: float, high: float) -> None:
    found = [p / q for p, q in fractions(low, high)]
    assert all(low <= x <= high for x in found)
    assert all(abs(x - y) >= 0.1 * (high - low) for x, y in combinations(found, 2))
    assert len(found) <= 5


def test_an_axis_of_equal_ratios_is_logarithmic_with_edges_between_the_points() -> None:
    ax = plotting.plot_plane(some_plane(), variable="lyapunov")
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "log")
    # ratios of 2: edges at the points times 2^(-1/2), 2^(1/2), to a few roundings
    np.testing.assert_allclose(ax.get_ylim(), [2.0**-0.5, 2.0**3.5], rtol=1e-14)
    for points in ([1.0, 2.0], [1.0, 2.0, 3.0], [-1.0, -2.0, -4.0], [1.0, 2.0, 4.1]):
        assert not geometric(np.array(points))


def test_misuse_of_a_plane_is_refused() -> None:
    plane = some_plane()
    with pytest.raises(vi.InvalidParameterError, match="'speed': must be one of n, p, q"):
        plotting.plot_plane(plane, variable="speed")
    with pytest.raises(vi.InvalidParameterError, match="most_motions = 9: must be at most 7"):
        plotting.plot_plane(plane, most_motions=9)
    with pytest.raises(vi.InvalidParameterError, match=r"has the dims omega: must have two"):
        plotting.plot_plane(plane.isel(half_clearance=0))


# ---- basins --------------------------------------------------------------------------------------


def test_basins_have_the_names_and_shares_of_their_attractors() -> None:
    known = legend(plotting.plot_basins(some_basins()))
    assert list(known) == ["1-1-1 a, 50%", "1-1-1 b, 16.7%", "chaotic a, 16.7%", "undecided, 16.7%"]
    drawn = colours(plotting.plot_basins(some_basins()))
    assert tuple(drawn[2, 0]) == pytest.approx(known["1-1-1 b, 16.7%"], abs=1e-6)
    assert tuple(drawn[2, 1]) == pytest.approx(to_rgb(maps.FAILED[0]), abs=1e-6)


@pytest.mark.parametrize("word", ["initial_penetration", "behind_stop"])  # now, and in older files
def test_starts_behind_a_stop_have_no_share(word: str) -> None:
    basins = some_basins()
    meanings = str(basins["attractor"].attrs["flag_meanings"]).replace("undecided", word)
    basins["attractor"].attrs["flag_meanings"] = meanings
    known = list(legend(plotting.plot_basins(basins)))
    assert known == ["1-1-1 a, 60%", "1-1-1 b, 20%", "chaotic a, 20%", "behind stop"]


def test_mirror_images_have_the_same_colours_whichever_is_more_frequent() -> None:
    one = maps.with_mirrors({"1-1-1": 9, "1-1-2": 5, "2-2-2": 4, "1-2-1": 3})
    other = maps.with_mirrors({"1-1-1": 9, "1-2-1": 5, "2-2-2": 4, "1-1-2": 3})
    assert one == other == ["1-1-1", "1-2-1", "1-1-2", "2-2-2"]
    named = maps.with_mirrors({"1-1-2 a": -3, "chaotic a": -2, "1-2-1 a": -1, "at rest": -4})
    assert named == ["1-2-1 a", "1-1-2 a", "chaotic a", "at rest"]
    assert maps.with_mirrors({"0-1,2-1": 1, "1-0,1-2": 2}) == ["1-0,1-2", "0-1,2-1"]
    assert maps.with_mirrors({"0-1": 1, "1-0": 2}) == ["1-0", "0-1"]


def test_a_part_of_the_basins_keeps_the_colours_of_the_whole() -> None:
    whole = legend(plotting.plot_basins(some_basins()))
    part = legend(plotting.plot_basins(some_basins().isel(x1=[1], v2=[1, 2]), marks=False))
    assert list(part) == ["1-1-1 a, 0%", "1-1-1 b, 0%", "chaotic a, 50%", "undecided, 50%"]
    assert list(part.values()) == list(whole.values())


def test_attractors_are_marked_where_their_members_end() -> None:
    basins = some_basins()
    lines = plotting.plot_basins(basins).get_lines()
    assert len(lines) == 3
    x = np.asarray(lines[0].get_xdata())
    y = np.asarray(lines[0].get_ydata())
    np.testing.assert_array_equal(x, [0.0, 2.0, 6.0])  # x1 of members (0, 0), (0, 1), (1, 0)
    np.testing.assert_array_equal(y, [-1.0, -3.0, -7.0])  # v2
    assert not plotting.plot_basins(basins, marks=False).get_lines()


def test_marks_do_not_move_the_edges_of_the_basins() -> None:
    ends = [plotting.plot_basins(some_basins(), marks=m).axis() for m in (True, False)]
    assert ends[0] == ends[1]


def test_a_dataset_without_attractors_is_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match="no variable attractor"):
        plotting.plot_basins(some_plane())


# ---- along one parameter -------------------------------------------------------------------------


def test_exponents_are_drawn_over_their_parameter_in_the_colours_of_the_directions() -> None:
    zero, up, down, both = plotting.plot_along(some_ways()).get_lines()
    assert set(np.asarray(zero.get_ydata())) == {0.0}
    assert to_rgb(up.get_color()) != to_rgb(down.get_color())
    known = [(x, y) for x, y in up.get_xydata() if np.isfinite(y)]
    assert known == [(2.0, 0.02)]
    np.testing.assert_array_equal(down.get_ydata(), [np.nan, -0.2, -0.3])
    assert {tuple(at) for at in both.get_xydata() if np.isfinite(at).all()} == {(1.0, -0.1)}


def test_exponents_of_random_starts_share_a_colour() -> None:
    given = some_ways().rename(direction="start").drop_vars("start")
    _, points = plotting.plot_along(given).get_lines()
    np.testing.assert_array_equal(points.get_xdata(), [1.0, 1.0, 2.0, 2.0, 3.0, 3.0])
    np.testing.assert_array_equal(points.get_ydata(), [-0.1, -0.1, 0.02, -0.2, np.nan, -0.3])


def test_a_diagram_of_another_number_names_it() -> None:
    ax = plotting.plot_bifurcation_diagram(some_ways(), variable="lyapunov")
    assert ax.get_ylabel() == plotting.plot_along(some_ways()).get_ylabel()


def test_a_diagram_names_any_parameter() -> None:
    ax = plotting.plot_bifurcation_diagram(some_ways())
    assert ax.get_xlabel() == r"half clearance $\delta$"
    assert [len(line.get_xdata()) for line in ax.get_lines()[:2]] == [6, 6]


def test_misuse_of_pictures_along_a_parameter_is_refused() -> None:
    with pytest.raises(vi.InvalidParameterError, match="'lyapunov': must be one of attractor"):
        plotting.plot_along(some_basins())
    with pytest.raises(vi.InvalidParameterError, match="must have one parameter"):
        plotting.plot_along(some_plane())
    with pytest.raises(vi.InvalidParameterError, match="must have one parameter"):
        plotting.plot_bifurcation_diagram(some_plane(), variable="lyapunov")


def test_cells_without_a_number_are_explained() -> None:
    turning = legend(plotting.plot_plane(turning_plane(), variable="rotation"))
    assert turning == {"none, or not converged": to_rgb(style.NOTHING)}
    counted = some_plane()
    assert legend(plotting.plot_plane(counted, variable="attractors")) == {
        "none": to_rgb(style.NOTHING)
    }
    assert plotting.plot_plane(counted, variable="impacts_a").get_legend() is None


def test_rotation_numbers_of_a_label_look_like_those_without() -> None:
    plane = turning_plane()
    names = {"rotation": "rotation_low", "rotation_error": "rotation_low_error"}
    one = plotting.plot_plane(plane, variable="rotation")
    other = plotting.plot_plane(plane.rename(names), variable="rotation_low")
    np.testing.assert_array_equal(colours(one), colours(other))
    bars = [ax.figure.axes[-1] for ax in (one, other)]
    labels = [[t.get_text() for t in bar.get_yticklabels()] for bar in bars]
    assert labels[0] == labels[1]
    assert bars[1].get_ylabel() == bars[0].get_ylabel() + ", low"


def test_many_whole_numbers_are_coloured_by_their_ratios() -> None:
    plane = some_plane()
    plane["period"] = plane.n.copy(data=2 ** np.minimum(plane.n.values, 6))
    ax = plotting.plot_plane(plane, variable="period")
    mesh, _ = cells(ax)
    steps = np.diff(np.asarray(mesh.norm(2.0 ** np.arange(7))))
    np.testing.assert_allclose(steps, steps[0], rtol=1e-12)
    bar = ax.figure.axes[-1]
    assert [t.get_text() for t in bar.get_yticklabels()] == [str(2**k) for k in range(7)]
    assert not len(bar.get_yticks(minor=True))


def test_whole_numbers_along_a_parameter_have_whole_ticks() -> None:
    counts = xr.Dataset({"attractors": ("omega", [1, 2, 2])}, coords={"omega": [1.0, 1.1, 1.2]})
    ticks = plotting.plot_along(counts, variable="attractors").get_yticks()
    assert all(tick == round(tick) for tick in ticks)


def test_a_rotation_number_that_is_everywhere_the_same_is_marked_once() -> None:
    for low, high, marks in ((0.4, 0.4, ["2/5"]), (0.3999, 0.4001, ["0.39990", "2/5", "0.40010"])):
        plane = turning_plane().drop_vars("rotation_error")
        plane["rotation"] = plane.rotation.copy(data=np.linspace(low, high, 24).reshape(6, 4))
        bar = plotting.plot_plane(plane, variable="rotation").figure.axes[-1]
        assert [t.get_text() for t in bar.get_yticklabels()] == marks


def test_zeros_truths_and_huge_numbers_are_drawn() -> None:
    plane = some_plane()
    plane["lyapunov"] = 0.0 * plane.lyapunov
    assert np.all(colours(plotting.plot_plane(plane, variable="lyapunov")) > 0.95)
    plane["often"] = plane.n > 3
    assert np.isnan(cells(plotting.plot_plane(plane, variable="often"))[1]).any()
    plane["huge"] = plane.n.astype(np.int64) * 2**36
    bar = plotting.plot_plane(plane, variable="huge").figure.axes[-1]
    assert len(bar.get_yticks()) < 12


def test_symbols_without_forcing_can_have_colours() -> None:
    assert plotting.plot_plane(some_plane(), symbols=["1-1", "1-1-1"]).get_legend() is not None
