"""Pictures of tongues: the sides, the tip, and the region that both sides bound."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from support.pictures import words

import vibroimpact as vi
from vibroimpact.bifurcations.tongue_region import region_of
from vibroimpact.plotting import plot_curves, plot_tongue

pytestmark = pytest.mark.usefixtures("no_windows")

E = 0.3  # coefficient of conj(z)^4: the sides are b = +-E a^(3/2) to leading order


def planted(x: Any, p: Any) -> list[Any]:
    """z -> e^(2 pi i / 5) ((1 + a + i b) z - z |z|^2 + E conj(z)^4), in real coordinates."""
    u, v = x
    square = u * u + v * v
    c2, s2 = u * u - v * v, -2.0 * u * v
    re = (1.0 + p[0] - square) * u - p[1] * v + E * (c2 * c2 - s2 * s2)
    im = (1.0 + p[0] - square) * v + p[1] * u + E * 2.0 * c2 * s2
    c, s = math.cos(2.0 * math.pi / 5.0), math.sin(2.0 * math.pi / 5.0)
    return [c * re - s * im, s * re + c * im]


@pytest.fixture(scope="module")
def curve() -> vi.BifurcationCurve:
    model = vi.ExplicitMap(planted, dimension=2, parameters=("a", "b"))
    start = vi.map_bifurcation("NS", model, (0.0, 0.0), (-0.02, 0.2))
    return vi.continue_bifurcation(start, ("a", "b"), ((-0.3, 0.3), (-0.3, 0.3)))


@pytest.fixture(scope="module")
def tongue(curve: vi.BifurcationCurve) -> vi.Tongue:
    found = vi.tongue(curve["1/5_1"])
    assert isinstance(found, vi.Tongue)
    return found


def filled(ax: Axes) -> np.ndarray:
    (region,) = (patch for patch in ax.patches if isinstance(patch, Polygon))
    return np.asarray(region.get_xy())


@pytest.mark.slow
def test_the_region_is_bounded_by_both_sides(tongue: vi.Tongue) -> None:
    axis, reach, corners = region_of(tongue)
    assert (axis, reach) == (0, pytest.approx(0.3, abs=1e-12))
    inside = corners[(corners[:, 0] > 0.01) & (corners[:, 0] < 0.03)]
    np.testing.assert_allclose(np.abs(inside[:, 1]) / inside[:, 0] ** 1.5, E, rtol=0.2)
    assert set(np.sign(inside[:, 1])) == {-1.0, 1.0}
    np.testing.assert_array_equal(filled(tongue.plot())[: len(corners)], corners)


def test_the_region_ends_where_a_side_turns_back(tongue: vi.Tongue) -> None:
    first, second = tongue.sides
    values = first.values.copy()
    order = values if values[0, 0] < values[-1, 0] else values[::-1]  # from the tip
    turn = float(np.interp(0.5, np.linspace(0.0, 1.0, len(order)), order[:, 0]))
    order[:, 0] = np.where(order[:, 0] > turn, 2.0 * turn - order[:, 0], order[:, 0])
    bent = replace(tongue, sides=(replace(first, values=values), second))
    region = region_of(bent)
    assert region.axis == 0
    assert region.corners[:, 0].max() == pytest.approx(turn, rel=0.1)
    assert region.corners[:, 0].max() <= turn


def test_the_sides_are_in_the_legend_and_the_tip_has_its_label(tongue: vi.Tongue) -> None:
    ax = plot_tongue(tongue)
    assert words(ax) == ["sides of the tongue 1/5", "weak resonance"]
    assert [text.get_text() for text in ax.texts] == ["1/5"]
    (xlow, xhigh), (ylow, yhigh) = ax.get_xlim(), ax.get_ylim()
    assert xlow < 0.0 < 0.3 < xhigh
    assert ylow < -0.05 < 0.05 < yhigh


def test_over_its_curve_a_tongue_keeps_the_limits_and_extends_the_legend(
    curve: vi.BifurcationCurve, tongue: vi.Tongue
) -> None:
    ax = plot_curves([curve])
    before, labels = (ax.get_xlim(), ax.get_ylim()), [text.get_text() for text in ax.texts]
    assert tongue.plot(ax=ax) is ax
    assert (ax.get_xlim(), ax.get_ylim()) == before
    assert [text.get_text() for text in ax.texts] == labels  # the tip is labelled once
    assert words(ax) == ["Neimark-Sacker", "weak resonance", "sides of the tongue 1/5"]


def test_over_a_coloured_plane_the_region_is_hatched(tongue: vi.Tongue) -> None:
    _, ax = plt.subplots()
    ax.pcolormesh([0.0, 0.1, 0.3], [-0.1, 0.0, 0.1], [[0.0, 1.0], [1.0, 0.0]])
    tongue.plot(ax=ax)
    (region,) = (patch for patch in ax.patches if isinstance(patch, Polygon))
    assert region.get_hatch()
    assert not region.get_fill()
    (alone,) = (patch for patch in tongue.plot().patches if isinstance(patch, Polygon))
    assert not alone.get_hatch()
    assert alone.get_fill()


def test_sides_that_part_in_both_parameters_bound_no_region(tongue: vi.Tongue) -> None:
    first, _ = tongue.sides
    opposite = replace(tongue, sides=(first, replace(first, values=-first.values)))
    assert region_of(opposite).reach == 0.0
    assert np.ptp(region_of(opposite).corners, axis=0).max() < 0.01
    assert opposite.plot().has_data()


def test_another_legend_stays(tongue: vi.Tongue) -> None:
    _, ax = plt.subplots()
    ax.plot([0.0, 0.3], [0.0, 0.0], label="mine")
    mine = ax.legend()
    tongue.plot(ax=ax)
    assert mine in ax.artists or mine in ax.get_children()
    assert "mine" not in words(ax)


def test_only_tongues_are_drawn(curve: vi.BifurcationCurve) -> None:
    with pytest.raises(vi.InvalidParameterError, match=r"tongue = .*a Tongue, as vi\.tongue gives"):
        plot_tongue(curve)  # type: ignore[arg-type]
