"""Pictures of curves of bifurcations: what is drawn is the curve, in the look that its points deserve."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.text import Annotation
from numpy.typing import NDArray
from support.bifurcations import PLANE, torus_of_a_map, torus_of_set_a
from support.pictures import words
from support.systems import paper_damper

import vibroimpact as vi
from vibroimpact.bifurcations.stretches import Meaning, stretches
from vibroimpact.branches.kinds import ONE
from vibroimpact.plotting import plot_curves, plot_plane, style
from vibroimpact.plotting.branch_looks import look_of
from vibroimpact.plotting.curves import LINES

COLOURS = {
    label: look_of(kind).colour
    for label, kind in ONE.items()
    if label not in ("STICK", "STILL", "PEAK")  # that of all other kinds
}  # of curves

pytestmark = pytest.mark.usefixtures("no_windows")

DAMPER = paper_damper("A", 0.95)
ALL = ((0.5, 1.3), (1.0, 8.0))


@pytest.fixture(scope="module")
def branch() -> vi.Branch:
    return vi.continue_orbit(vi.symmetric_orbits(DAMPER)[0], "omega", (0.6, 1.0))


@pytest.fixture(scope="module")
def torus() -> vi.BifurcationCurve:
    return torus_of_set_a()


@pytest.fixture(scope="module")
def breaking(branch: vi.Branch) -> vi.BifurcationCurve:
    return vi.continue_bifurcation(branch["BP1"], PLANE, ALL)


@pytest.fixture(scope="module")
def saddles() -> vi.BifurcationCurve:
    return torus_of_a_map()


def drawn(ax: Axes, colour: str) -> list[NDArray[np.float64]]:
    """Lines of a colour that hold data."""
    return [
        np.column_stack([*map(np.asarray, line.get_data())])
        for line in ax.get_lines()
        if len(np.asarray(line.get_xdata())) > 1 and to_rgb(line.get_color()) == to_rgb(colour)
    ]


def texts(ax: Axes) -> list[str]:
    return [text.get_text() for text in ax.texts if isinstance(text, Annotation)]


@pytest.mark.slow
def test_every_point_of_the_curve_is_drawn(torus: vi.BifurcationCurve) -> None:
    lines = drawn(torus.plot(), COLOURS["NS"])
    np.testing.assert_array_equal(
        [row for row in np.vstack(lines) if np.any(np.all(torus.values == row, axis=1))],
        torus.values,
    )


def test_points_of_codimension_two_are_marked_where_they_are_and_labelled(
    torus: vi.BifurcationCurve,
) -> None:
    ax = plot_curves([torus])
    marks = [
        (float(x[0]), float(y[0]))
        for line in ax.get_lines()
        for x, y in [map(np.asarray, line.get_data())]
        if len(x) == 1
    ]
    assert sorted(marks) == sorted(tuple(p.parameters.values()) for p in torus.special_points)
    assert {"R4$_{1}$", "R4$_{2}$", "2/9"} <= set(texts(ax))
    assert not texts(plot_curves([torus], marks=False))


def test_no_label_covers_another(torus: vi.BifurcationCurve) -> None:
    ax = plot_curves([torus])
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in ax.texts]
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


@pytest.mark.slow
def test_neutral_saddles_are_grey_and_begin_at_the_resonances(
    saddles: vi.BifurcationCurve,
) -> None:
    parts = stretches(saddles)
    assert [part.meaning for part in parts] == [
        Meaning.NEUTRAL,
        Meaning.BIFURCATION,
        Meaning.NEUTRAL,
    ]
    ends = sorted(saddles[label].parameters["alpha"] for label in ("R1_1", "R2_1"))
    between = parts[1].values[[0, -1], 0]
    assert sorted(between) == pytest.approx(ends, abs=1e-12)
    ax = plot_curves([saddles])
    assert len(drawn(ax, style.GREY)) == 2
    assert "neutral saddle" in words(ax)


def test_what_is_not_admissible_is_dotted(torus: vi.BifurcationCurve) -> None:
    admissible = torus.admissible.copy()
    admissible[:30] = False
    half = replace(torus, admissible=admissible)
    parts = stretches(half)
    assert [part.meaning for part in parts] == [Meaning.INADMISSIBLE, Meaning.BIFURCATION]
    np.testing.assert_array_equal(parts[0].values[-1], parts[1].values[0])
    ax = plot_curves([half])
    looks = [line.get_linestyle() for line in ax.get_lines() if len(np.asarray(line.get_xdata()))]
    assert "--" in looks  # any pattern of dashes
    assert "not admissible" in words(ax)
    assert LINES[Meaning.INADMISSIBLE]["linestyle"] != LINES[Meaning.NEUTRAL]["linestyle"]


def test_a_point_on_two_curves_is_marked_once(torus: vi.BifurcationCurve) -> None:
    once, twice = plot_curves([torus]), plot_curves([torus, torus])
    assert sorted(texts(once)) == sorted(texts(twice))


@pytest.mark.slow
def test_kinds_have_colours_and_words(
    torus: vi.BifurcationCurve, breaking: vi.BifurcationCurve
) -> None:
    ax = plot_curves([torus, breaking])
    assert words(ax)[:2] == ["Neimark-Sacker", "symmetry breaking"]
    assert {"strong resonance", "weak resonance"} <= set(words(ax))
    assert drawn(ax, COLOURS["BP"])
    assert len(set(COLOURS.values())) == len(COLOURS)
    assert ax.get_xlabel() == r"forcing frequency $\omega$"
    assert ax.get_ylabel() == r"half clearance $\delta$"


@pytest.mark.slow
def test_the_first_curve_decides_the_order_of_the_axes(
    branch: vi.Branch, torus: vi.BifurcationCurve
) -> None:
    turned = vi.continue_bifurcation(branch["BP1"], PLANE[::-1], ALL[::-1])
    ax = plot_curves([torus, turned])
    across = np.vstack(drawn(ax, COLOURS["BP"]))[:, 0]
    assert across.max() < 1.5  # frequencies
    assert ax.get_xlabel() == r"forcing frequency $\omega$"


def test_over_a_plane_its_axes_are_kept(torus: vi.BifurcationCurve) -> None:
    over = {"omega": np.linspace(0.8, 1.1, 4), "half_clearance": np.linspace(4.0, 6.0, 3)}
    plane = vi.plane(
        DAMPER, over=over, start=vi.State((0.0, 0.0), (0.0, 1.0)), settle_periods=10, periods=10
    )
    ax = plot_plane(plane)
    limits, motions = (ax.get_xlim(), ax.get_ylim()), ax.get_legend()
    assert plot_curves([torus], ax=ax) is ax
    assert (ax.get_xlim(), ax.get_ylim()) == limits
    assert motions in ax.get_children()
    assert words(ax)[0] == "Neimark-Sacker"


def test_bounds_are_what_is_shown(torus: vi.BifurcationCurve) -> None:
    ax = plot_curves([torus], bounds=((0.9, 1.0), (4.0, 7.0)))
    assert ax.get_xlim() == (0.9, 1.0)
    assert ax.get_ylim() == (4.0, 7.0)
    assert "2/9" not in texts(ax)  # outside


@pytest.mark.slow
def test_a_machine_in_physical_units_has_si_axes() -> None:
    damper = vi.ImpactDamper.from_physical(
        M1=10.0, M2=1.0, K=2500.0, C=14.2, F0=100.0, Omega=30.0, D=0.1, restitution=0.8
    )
    start = vi.symmetric_orbits(damper)[0]
    gap = damper.half_clearance
    curve = vi.continue_level(
        start,
        lambda states, _durations, _parameters: states[0, 2],
        PLANE,
        ((0.99 * damper.omega, 1.01 * damper.omega), (0.99 * gap, 1.01 * gap)),
    )
    ax = curve.plot()
    assert ax.get_xlabel() == r"forcing frequency $\omega$ [rad/s]"
    np.testing.assert_array_equal(drawn(ax, COLOURS["level"])[0][:, 0], curve.values[:, 0])


def test_what_is_no_curve_is_refused(
    branch: vi.Branch, torus: vi.BifurcationCurve, saddles: vi.BifurcationCurve
) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"curves\[0\]"):
        plot_curves([branch])  # type: ignore[list-item]
    with pytest.raises(vi.InvalidParameterError, match="need one or more in the same two"):
        plot_curves([torus, saddles])
    with pytest.raises(vi.InvalidParameterError, match="need one or more in the same two"):
        plot_curves([])
    with pytest.raises(vi.InvalidParameterError, match=r"bounds"):
        plot_curves([torus], bounds=(0.0, 1.0))  # type: ignore[arg-type]


def test_datasets_are_not_curves(torus: vi.BifurcationCurve) -> None:
    data = torus.to_dataset()
    assert isinstance(data, xr.Dataset)
    with pytest.raises(vi.InvalidParameterError, match="as continue_bifurcation gives"):
        plot_curves([data])  # type: ignore[list-item]
    plt.close("all")
