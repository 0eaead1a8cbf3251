"""Command vibroimpact design: the best parameters of a machine over a band, with a report."""

from __future__ import annotations

import argparse

from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.cli.response import BAND, add_band
from vibroimpact.design.objective import Kind, Objective
from vibroimpact.design.optimise import Design, optimise
from vibroimpact.results.files import PAGES

EXAMPLE = (
    "  vibroimpact design impact-damper/A --bounds half_clearance=1:20 --bounds restitution=0.3:0.9 "
    "--band omega=0.4:0.6 --budget 500 --out design.svg --out report.html"
)
JUDGED = ("points", "starts", "settle_periods", "periods")
SEARCHED = ("budget", "refine", "seed", "workers", "store")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    group = parser.add_argument_group("design")
    text = "a parameter and its bounds; once for each parameter"
    common.add_named(group, "--bounds", common.RANGE, text, required=True)
    add_band(group, Objective)
    group.add_argument(
        "--mean", action="store_true", help="judge by the mean over the band, not by the worst"
    )
    common.add_arguments_of(group, Objective, JUDGED)
    common.add_arguments_of(group, optimise, SEARCHED)
    common.add_title(group)
    common.add_out(parser, pages=PAGES)


def run(arguments: argparse.Namespace) -> Done:
    """Search for the best machine."""
    common.check_count("band", arguments.band, 1, common.RANGE)
    case = common.case_of(arguments, arguments.band, "band")
    parameter, band = common.band_of(arguments)
    judged = common.given(arguments, (*BAND, *JUDGED))
    kind: Kind = "mean" if arguments.mean else "worst"
    objective = Objective(parameter, band, kind=kind, **judged)
    best = optimise(case.system, arguments.bounds, objective, **common.given(arguments, SEARCHED))
    common.check_interrupted(best)
    return Done([case.system, best], best, best.plot, lambda: _page(arguments, best))


def _page(arguments: argparse.Namespace, best: Design) -> str:
    """The report: the best machine, and its response."""
    from vibroimpact.plotting.design_report import design_report

    command = common.command_of(arguments)
    return design_report(
        best, best.response(), command=command, **common.given(arguments, ["title"])
    )
