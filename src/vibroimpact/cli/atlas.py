"""Command vibroimpact atlas: all curves of bifurcations that can be reached from an orbit."""

from __future__ import annotations

import argparse

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.bifurcations.atlas import bifurcation_atlas
from vibroimpact.cli import common
from vibroimpact.cli.branch import case_of_branch, orbit_of
from vibroimpact.cli.members import RANGE, ranges_of
from vibroimpact.cli.output import write

EXAMPLE = (
    "  vibroimpact atlas impact-damper/A --over omega=0.9:1.05 --over half_clearance=5:6.3 "
    "--out atlas.nc --out atlas.svg"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_start(parser)
    group = parser.add_argument_group(
        "atlas",
        "From the symmetric orbit in closed form, or from the orbit to which the motion from the start settles. A "
        "parameter that is not given is in the middle of its range if it is the frequency.",
    )
    group.add_argument(
        "--over", action="append", required=True, metavar=RANGE,
        help="a parameter and its range, twice: the first for the abscissa",
    )  # fmt: skip
    group.add_argument(
        "--levels", type=int, default=1, metavar="COUNT",
        help="how many times orbits of a multiple period are followed in turn (default: 1)",
    )  # fmt: skip
    group.add_argument(
        "--touches", action="store_true", help="also follow grazing and vanishing impact speeds"
    )
    group.add_argument(
        "--most", type=int, default=40, metavar="COUNT",
        help="number of curves after which the search stops (default: 40)",
    )  # fmt: skip
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> str:
    """Follow, write, and describe the curves."""
    targets = common.targets_of(arguments)
    over = ranges_of(arguments.over, "over")
    if len(over) != 2:
        raise InvalidParameterError(
            f"over = {', '.join(over)}: give --over {RANGE} twice, with two parameters."
        )
    (first, a), (second, b) = over.items()
    arguments.parameter = "omega" if "omega" in over else first
    arguments.range = over[arguments.parameter]
    start = orbit_of(arguments, case_of_branch(arguments))
    atlas = bifurcation_atlas(
        start, (first, second), (a, b), touches=arguments.touches, levels=arguments.levels,
        most=arguments.most, progress=True,
    )  # fmt: skip
    write(targets, data=atlas, picture=atlas.plot)
    return str(atlas) + common.listed(targets)
