"""Command vibroimpact sweep: any observers over any parameters, from one start or many."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact.cli import common, ensemble
from vibroimpact.cli.output import Done
from vibroimpact.sweeps.sweep import sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXAMPLE = (
    "  vibroimpact sweep impact-damper/A --over omega=0.9:1.1:200 --over half_clearance=1:10:200 "
    "--observe symbol,lyapunov,speeds --store sweep.zarr"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    ensemble.add_members(
        parser,
        over="a parameter, or a coordinate of the start, x1, ..., v1, ..., phase, and its values",
        observe="observers, by default symbol",
    )
    common.add_arguments_of(parser, sweep, ["follow"])
    parser.add_argument(
        "--variable", metavar="NAME",
        help="variable to draw: over one parameter as points, over two as a plane",
    )  # fmt: skip
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Sweep."""
    case = common.case_of(arguments, ensemble.parameters_over(arguments))
    start = ensemble.start_of(arguments, case)
    compute: Callable[..., xr.Dataset] = partial(
        sweep, case.system, observe=ensemble.observed(arguments) or "symbol"
    )
    return ensemble.computed(arguments, case, start, compute, partial(_picture, arguments))


def _picture(arguments: argparse.Namespace, found: xr.Dataset) -> Axes:
    if arguments.variable is None:
        raise InvalidParameterError(
            f"variable: missing. Take one of {', '.join(map(str, found.data_vars))}."
        )
    return ensemble.picture_over(arguments.over)(found, variable=arguments.variable)
