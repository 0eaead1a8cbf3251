"""Command vibroimpact diagram: section points along a parameter, followed up and down."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from vibroimpact._core.lazy import xr
from vibroimpact.cli import common, ensemble
from vibroimpact.cli.output import Done
from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXAMPLE = (
    "  vibroimpact diagram impact-damper/A --over omega=0.92:1.2:400 --variable v1 --out d.png"
)
SECTION = ("way", "at", "points")
FIRST = "v1"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    ensemble.add_members(
        parser,
        over="the parameter and its values",
        observe="more than the section",
    )
    common.add_arguments_of(parser, bifurcation_sweep, SECTION)
    parser.add_argument(
        "--variable", metavar="NAME",
        help=f"variable to draw: x1, ..., v1, ..., phase, or one of the observers (default: {FIRST})",
    )  # fmt: skip
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Compute the diagram."""
    common.check_count("over", arguments.over, 1, common.GRID)
    case = common.case_of(arguments, ensemble.parameters_over(arguments))
    start = ensemble.start_of(arguments, case)
    compute: Callable[..., xr.Dataset] = partial(
        bifurcation_sweep, case.system, observe=ensemble.observed(arguments),
        **common.given(arguments, SECTION),
    )  # fmt: skip
    draw = partial(_picture, arguments.variable or FIRST)
    return ensemble.computed(arguments, case, start, compute, draw)


def _picture(variable: str, found: xr.Dataset) -> Axes:
    from vibroimpact.plotting import plot_along, plot_bifurcation_diagram

    points = variable not in found or {"point", "strobe"} & {*found[variable].dims}
    return (plot_bifurcation_diagram if points else plot_along)(found, variable=variable)
