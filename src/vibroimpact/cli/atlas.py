"""Command vibroimpact atlas: all curves of bifurcations that can be reached from an orbit."""

from __future__ import annotations

import argparse

from vibroimpact.bifurcations.atlas import bifurcation_atlas
from vibroimpact.cli import common
from vibroimpact.cli.branch import orbit_of
from vibroimpact.cli.output import Done

EXAMPLE = (
    "  vibroimpact atlas impact-damper/A --bounds omega=0.9:1.05 --bounds half_clearance=5:6.3 "
    "--out atlas.nc --out atlas.svg"
)
SEARCH = ("touches", "depth", "most_curves", "inadmissible")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser)
    group = parser.add_argument_group(
        "atlas",
        "From the symmetric orbit in closed form, or from the orbit to which the motion from the start settles. A "
        "parameter that nothing else fixes is in the middle of its bounds.",
    )
    common.add_named(
        group, "--bounds", common.RANGE, "a parameter and its bounds, twice: the first for the abscissa",
        required=True,
    )  # fmt: skip
    common.add_arguments_of(group, bifurcation_atlas, SEARCH)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Follow the curves."""
    common.check_count("bounds", arguments.bounds, 2, common.RANGE)
    (first, a), (second, b) = arguments.bounds.items()
    start = orbit_of(arguments, common.case_of(arguments, arguments.bounds, "bounds"))
    atlas = bifurcation_atlas(start, (first, second), (a, b), **common.given(arguments, SEARCH))
    return Done([atlas], atlas, atlas.plot)
