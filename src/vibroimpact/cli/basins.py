"""Command vibroimpact basins: attractors of a grid of starts, and their basins."""

from __future__ import annotations

import argparse

import xarray as xr

from vibroimpact.cli import common, ensemble, members
from vibroimpact.cli.output import write
from vibroimpact.plotting import plot_basins
from vibroimpact.sweeps.analyses.basins import attractor_state, basins, share_of_starts
from vibroimpact.sweeps.analyses.label_attractors import NOT_MATCHED

EXAMPLE = (
    "  vibroimpact basins impact-damper/B --omega 0.945 --over x1=-6:6:100 --over v1=-6:6:100 "
    "--out basins.png --out basins.nc"
)
MATCHING = ("at", "tolerance", "most")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    ensemble.add_start(parser)
    ensemble.add_over(parser, "a coordinate of the start, x1, x2, ..., v1, v2, ..., phase, and "
                      "its values; two of them, the first for the abscissa")  # fmt: skip
    common.add_arguments_of(parser, basins, MATCHING, **ensemble.TEXTS)
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> str:
    """Compute, write, and list the attractors."""
    targets = common.targets_of(arguments)
    case = common.case_of(arguments)
    over = members.over_of(arguments, 2)
    found = basins(
        case.system, over=over, start=members.base_of(arguments, case),
        **common.given(arguments, MATCHING), **ensemble.options_of(arguments),
    )  # fmt: skip
    write(targets, data=found, picture=lambda: plot_basins(found))
    return ensemble.report(arguments, targets, case, over, found, *_listed(found))


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
            f"not matched: {100.0 * left:.3g}% of the starts. Raise --settle-periods, or --most."
        )
    return lines
