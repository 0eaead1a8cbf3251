"""Command vibroimpact plane: motions at every point of a plane of two parameters."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact.cli import common, ensemble
from vibroimpact.cli.output import Done
from vibroimpact.sweeps.analyses.basins import basins
from vibroimpact.sweeps.analyses.motion_codes import categories
from vibroimpact.sweeps.analyses.plane import multistability, plane
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.observers.selection import observer_of
from vibroimpact.sweeps.observers.table import OBSERVERS
from vibroimpact.sweeps.sweep import sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXAMPLE = (
    "  vibroimpact plane impact-damper/A --over omega=0.9:1.1:200 --over half_clearance=1:10:200 "
    "--variable lyapunov --out plane.png --out plane.nc"
)
MOST_PRINTED_MOTIONS = 8  # so many motions are printed at most
LOOKS = ("variable", "most_motions", "symbols")
COUNTING = ("at", "same_within")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    ensemble.add_members(
        parser,
        over="a parameter, or a coordinate of the start, x1, ..., v1, ..., phase, and its values; two of them, the "
        "first for the abscissa. Of more the coordinates are starts from which attractors are counted",
        observe="more than symbol and impacts",
    )
    common.add_arguments_of(parser, sweep, ["follow"])
    parser.add_argument(
        "--variable", metavar="NAME",
        help="what is drawn: motion, a colour for each symbol n-p-q, period, impacts, lyapunov, rotation, attractors, "
        "or another number that is observed (default: motion)",
    )  # fmt: skip
    parser.add_argument(
        "--most-motions", type=int, metavar="COUNT",
        help="symbols with a colour of their own, 1 to 7, the most frequent ones (default: 7)",
    )  # fmt: skip
    parser.add_argument(
        "--symbols", nargs="+", action="extend", metavar="SYMBOL",
        help="these symbols instead, in the order of the legend: 1-1-1 2-2-2",
    )  # fmt: skip
    common.add_arguments_of(
        parser.add_argument_group(
            "counting attractors", "With --starts, or more than two axes, at every point of the parameters."
        ),
        basins, COUNTING,
    )  # fmt: skip
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Compute the motions, or count the attractors."""
    parameters = ensemble.parameters_over(arguments)
    many = arguments.starts is not None or len(arguments.over) > max(2, len(parameters))
    if not many:
        common.check_count("over", arguments.over, 2, common.GRID)
    case = common.case_of(arguments, parameters)
    start = ensemble.start_of(arguments, case)
    looks, axes = common.given(arguments, LOOKS), parameters if many else arguments.over
    if len(axes) == 1 and (unused := sorted(looks.keys() - {"variable"})):
        raise InvalidParameterError(f"{unused[0]}: is for planes. Give --over twice.")
    compute: Callable[..., xr.Dataset]
    if not many:
        compute = partial(plane, case.system, observe=_observed(arguments))
    else:
        compute = partial(multistability, case.system, **_counting(arguments))
        looks = {"variable": "attractors"} | looks

    def draw(of: xr.Dataset) -> Axes:
        return ensemble.picture_over(axes)(of, **looks)

    return ensemble.computed(arguments, case, start, compute, draw, _counts)


def _observed(arguments: argparse.Namespace) -> list[Observer]:
    """Observers, including that of the variable to draw, which need not be named twice."""
    if counting := common.given(arguments, COUNTING):
        raise InvalidParameterError(f"{min(counting)}: is for counting attractors. Give --starts.")
    named = ensemble.observed(arguments)
    drawn = arguments.variable
    missing = drawn in OBSERVERS and drawn not in [one.name for one in named]
    return [*named, observer_of(drawn)] if missing else named


def _counting(arguments: argparse.Namespace) -> dict[str, Any]:
    """Options for counting attractors."""
    if arguments.observe:
        raise InvalidParameterError(
            f"observe = {arguments.observe}: must be left out; the matching of attractors fixes the "
            "observers. For others take vibroimpact sweep."
        )
    return common.given(arguments, COUNTING)


def _counts(found: xr.Dataset) -> list[str]:
    """Number of points with each motion, or with each number of attractors."""
    if "attractors" in found:
        counts = found["attractors"].to_series().value_counts().sort_index()
        listed = ", ".join(f"{k} at {n} points" for k, n in counts.items())
        return [f"attractors met: {listed}"]
    present = sorted(categories(found["motion"]), key=lambda one: -one.members)
    listed = ", ".join(f"{one.words} {one.members}" for one in present[:MOST_PRINTED_MOTIONS])
    return [
        listed
        + (
            f", and {len(present) - MOST_PRINTED_MOTIONS} more"
            if len(present) > MOST_PRINTED_MOTIONS
            else ""
        )
    ]
