"""Pictures for print: widths of journals, one font, nothing cut, legends where they fit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.text import Text
from PIL import Image
from support.pictures import assert_nothing_is_cut

import vibroimpact as vi
from vibroimpact import plotting
from vibroimpact.cli.main import main
from vibroimpact.plotting import style

pytestmark = pytest.mark.usefixtures("no_windows")

MILLIMETRES = 25.4
MOTIONS = (
    "1-1-1 2-2-2 1-2-1 1-1-2 3-3-3 4-4-4 2-1-0 8-8-8 chaotic not_periodic no_impacts most_impacts"
)


def plane() -> xr.Dataset:
    codes = np.array([*range(8), -2, -1, -3, -5], dtype=np.int32)
    held = {"flag_values": codes, "flag_meanings": MOTIONS}
    coords = {"omega": np.linspace(0.9101, 0.9103, 4), "half_clearance": [1.0, 2.0, 3.0]}
    data = (("omega", "half_clearance"), codes.reshape(4, 3), held)
    numbers = (("omega", "half_clearance"), np.linspace(-0.2, 0.1, 12).reshape(4, 3))
    return xr.Dataset({"motion": data, "lyapunov": numbers}, coords=coords)


def chain() -> vi.Mechanism:
    count = 5
    stops = tuple(
        vi.RigidStop(
            tuple(float(j == i + 1) - float(j == i) for j in range(count)),
            upper=0.0123456,
            restitution=0.7,
        )
        for i in range(count - 1)
    )
    whole = vi.Structure.chain([0.0333333] * count, [1.25] * count, [0.02] * count)
    return whole.mechanism(elements=stops, forces={"x1": vi.Harmonic(1.0, (0.1,))})


def run() -> vi.Run:
    block = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        elements=[vi.SoftStop((1.0,), upper=1.26, stiffness=29.0), vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.5)],
    )  # fmt: skip
    return vi.simulate(block, vi.State((0.0,), (1.0,)), t_max=30.0)


PLOTS: dict[str, Callable[[Axes | None], Axes]] = {
    "a plane of many motions": lambda ax: plotting.plot_plane(plane(), ax=ax),
    "a plane with a colour bar": lambda ax: plotting.plot_plane(
        plane(), variable="lyapunov", ax=ax
    ),
    "a long machine": lambda ax: plotting.plot_mechanism(chain(), ax=ax),
    "elements over time": lambda ax: plotting.plot_history(run(), ax=ax),
}


@pytest.mark.parametrize(("columns", "wide"), [(1, 86.4), (2, 177.8)])
@pytest.mark.parametrize("name", PLOTS)
@pytest.mark.one_in(3)
def test_nothing_is_cut_in_a_column_of_a_journal_or_two(
    name: str, columns: int, wide: float
) -> None:
    before = dict(mpl.rcParams)
    with plotting.print_style(columns):
        figure = PLOTS[name](None).get_figure()
    assert dict(mpl.rcParams) == before
    assert figure.get_figwidth() * MILLIMETRES == pytest.approx(wide, abs=0.1)
    assert_nothing_is_cut(figure)
    letters = [one for one in figure.findobj(Text) if one.get_visible() and one.get_text()]
    assert {one.get_fontname() for one in letters} == {"STIXGeneral"}
    assert max(one.get_fontsize() for one in letters) <= (9.0 if name == "a long machine" else 8.0)


def test_legends_of_subplots_fit_between_them() -> None:
    with plotting.print_style(columns=2):
        figure, axes = plt.subplots(2, 2, figsize=(7.0, 5.0))
        for ax, draw in zip(axes.flat, PLOTS.values(), strict=False):
            draw(ax)
    assert_nothing_is_cut(figure)
    legends = [ax.get_legend() for ax in axes.flat if ax.get_legend()]
    assert len(legends) > 1
    for legend in legends:
        others = [ax for ax in figure.axes if ax is not legend.axes]
        assert not any(legend.get_window_extent().overlaps(ax.get_window_extent()) for ax in others)


def test_a_wide_legend_lies_above_a_narrow_plane() -> None:
    beside, above = (
        plt.figure(figsize=(5.0, 3.0)).subplots(),
        plt.figure(figsize=(2.0, 3.0)).subplots(),
    )
    for ax in (beside, above):
        plotting.plot_plane(plane(), ax=ax)
    (one, other), boxes = (
        [f(ax) for ax in (beside, above)]
        for f in (lambda ax: ax.get_legend().get_window_extent(), lambda ax: ax.get_window_extent())
    )
    assert one.x0 > boxes[0].x1 - 1.0
    assert other.y0 > boxes[1].y1 - 1.0


def test_long_numbers_along_an_axis_do_not_touch() -> None:
    figure = plt.figure(figsize=(3.0, 1.5), layout="constrained")
    with style.drawing(figure.subplots()) as ax:
        ax.plot([-0.00112, 0.00101], [0.0, 1.0])
    assert_nothing_is_cut(figure)


@pytest.mark.parametrize("columns", [0, 3, 1.5, None])
def test_another_number_of_columns_is_refused(columns: object) -> None:
    with pytest.raises(vi.InvalidParameterError, match="columns = "), plotting.print_style(columns):
        pass


@pytest.mark.usefixtures("own_folder")
def test_the_command_line_draws_for_print() -> None:
    words = ["simulate", "bouncing-ball", "--impacts", "5", "--out", "run.png"]
    for columns, pixels in ((1, 1020), (2, 2100)):  # at 300 per inch
        assert main([*words, "--columns", str(columns)]) == 0
        with Image.open(Path("run.png")) as picture:
            assert picture.width == pixels
