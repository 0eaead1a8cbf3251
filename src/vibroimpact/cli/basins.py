"""Command vibroimpact basins: attractors of a grid of starts, and their basins."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from vibroimpact._core.lazy import xr
from vibroimpact.cli import common, ensemble
from vibroimpact.cli.output import Done
from vibroimpact.sweeps.analyses.basins import attractor_state, basins, share_of_starts
from vibroimpact.sweeps.analyses.label_attractors import NOT_MATCHED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXAMPLE = (
    "  vibroimpact basins impact-damper/B --omega 0.945 --over x1=-6:6:100 --over v1=-6:6:100 "
    "--out basins.png --out basins.nc"
)
MATCHING = ("at", "same_within", "most_classified")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser, at_orbit=False)
    ensemble.add_over(parser, "a coordinate of the start, x1, x2, ..., v1, v2, ..., phase, and "
                      "its values; two of them, the first for the abscissa")  # fmt: skip
    common.add_arguments_of(parser, basins, MATCHING)
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Compute the basins."""
    case = common.case_of(arguments)
    common.check_count("over", arguments.over, 2, common.GRID)
    found = basins(
        case.system, over=arguments.over, start=common.start_of(arguments, case),
        **common.given(arguments, MATCHING), **ensemble.options_of(arguments),
    )  # fmt: skip
    listed = _listed(found)
    return ensemble.report(arguments, case, found, listed, lambda: _picture(found))


def _picture(found: xr.Dataset) -> Axes:
    from vibroimpact.plotting import plot_basins

    return plot_basins(found)


def _listed(found: xr.Dataset) -> list[str]:
    """A line per attractor, and one for unmatched starts."""
    lines = []
    for i, name in enumerate(found["name"].values):
        row, state = found.isel(label=i), attractor_state(found, str(name))
        share = f"{100.0 * row['share'].item():.3g}% of the starts"
        lines.append(f"{name}: {row['kind'].item()}, {share}, for example {state}")
    left = share_of_starts(found["attractor"], NOT_MATCHED)
    if left:
        lines.append(
            f"not matched: {100.0 * left:.3g}% of the starts. Raise --settle-periods, or --most-classified."
        )
    return lines
