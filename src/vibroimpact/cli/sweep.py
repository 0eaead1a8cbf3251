"""Command vibroimpact sweep: any observers over any parameters, from one start or many."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial

import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common, ensemble, members
from vibroimpact.sweeps.sweep import sweep

EXAMPLE = (
    "  vibroimpact sweep impact-damper/A --over omega=0.9:1.1:200 --over half_clearance=1:10:200 "
    "--observe symbol,lyapunov,speeds --store sweep.zarr"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    ensemble.add_members(
        parser,
        over="a parameter and its values",
        observe="observers, by default symbol",
    )
    common.add_arguments_of(parser, sweep, ["follow"], **ensemble.TEXTS)
    parser.add_argument(
        "--variable", metavar="NAME",
        help="variable to draw: over one parameter as points, over two as a plane",
    )  # fmt: skip
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> str:
    """Sweep, write, and count the ends of the members."""
    targets = common.targets_of(arguments)
    over = members.over_of(arguments)
    case = members.case_of(arguments, over)
    start = members.start_of(arguments, case, over)
    compute: Callable[..., xr.Dataset] = partial(
        sweep, case.system, observe=members.observed(arguments) or "symbol"
    )
    draw = partial(_picture, arguments)
    found = ensemble.computed(arguments, targets, over, start, compute, draw)
    return ensemble.report(arguments, targets, case, over, found)


def _picture(arguments: argparse.Namespace, found: xr.Dataset) -> Axes:
    if arguments.variable is None:
        raise InvalidParameterError(
            f"variable: missing. Take one of {', '.join(map(str, found.data_vars))}."
        )
    return ensemble.picture_over(arguments)(found, variable=arguments.variable)
