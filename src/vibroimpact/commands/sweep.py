"""vibroimpact sweep: any observers over any parameters, from one start or many."""

from __future__ import annotations

import argparse

import xarray as xr
from matplotlib.axes import Axes

from vibroimpact.commands import common, ensemble
from vibroimpact.ensembles.sweep import sweep
from vibroimpact.errors import InvalidParameterError
from vibroimpact.files import write
from vibroimpact.plotting import plot_along, plot_plane

NAME = "sweep"
HELP = "observe many motions over any parameters, in memory or in a store that resumes"
EXAMPLE = (
    "  vibroimpact sweep impact-damper/A --over omega=0.9:1.1:200 --over half_clearance=1:10:200 "
    "--observe symbol,lyapunov,speeds --store sweep.zarr"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    ensemble.add_members(
        parser,
        over="a parameter and its values",
        observe="what is computed: symbol, lyapunov, ... (default: symbol)",
    )
    common.add_arguments_of(parser, sweep, ["follow"])
    parser.add_argument(
        "--variable", metavar="NAME",
        help="what is drawn: over one parameter as points, over two as a plane",
    )  # fmt: skip
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> str:
    """Sweep, write, and say how the members ended."""
    targets = common.targets_of(arguments)
    over = ensemble.over_of(arguments)
    case = ensemble.case_of(arguments, over)
    members = sweep(
        case.system, over=over, start=ensemble.start_of(arguments, case),
        observe=ensemble.observed(arguments) or "symbol", **ensemble.options_of(arguments),
    )  # fmt: skip
    write(targets, data=lambda: members, picture=lambda: _picture(arguments, members))
    lines = ensemble.summary(case, over, members)
    return "\n".join(lines) + ensemble.kept(arguments.store) + common.listed(targets)


def _picture(arguments: argparse.Namespace, members: xr.Dataset) -> Axes:
    if arguments.variable is None:
        raise InvalidParameterError(
            f"variable: missing. Take one of {', '.join(map(str, members.data_vars))}."
        )
    draw = plot_plane if len(arguments.over) == 2 else plot_along
    return draw(members, variable=arguments.variable)
