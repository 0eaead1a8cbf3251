"""Command vibroimpact design: the best parameters of a machine over a band, with a report."""

from __future__ import annotations

import argparse

import numpy as np

from vibroimpact.cli import common, members
from vibroimpact.cli.members import RANGE, ranges_of
from vibroimpact.cli.output import write
from vibroimpact.design.objective import mean_over, worst_over
from vibroimpact.design.optimise import Design, optimise
from vibroimpact.plotting.design_report import design_report
from vibroimpact.plotting.report import PAGES
from vibroimpact.response.response import frequency_response

EXAMPLE = (
    "  vibroimpact design impact-damper/A --vary half_clearance=1:20 --vary restitution=0.3:0.9 "
    "--over omega=0.4:0.6 --budget 500 --out design.svg --out report.html"
)
JUDGED = ("points", "starts", "settle_periods", "periods")
SEARCHED = ("budget", "refine", "seed", "workers")
NUMBER, STARTS, MOST = 60, 6, 4  # of the response of the best machine in the report


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    group = parser.add_argument_group("design")
    group.add_argument(
        "--vary", required=True, action="append", metavar=RANGE,
        help="a parameter and its bounds; once for each parameter",
    )  # fmt: skip
    members.add_band(group, worst_over)
    group.add_argument(
        "--mean", action="store_true", help="judge by the mean over the band, not by the worst"
    )
    common.add_arguments_of(group, worst_over, JUDGED)
    common.add_arguments_of(group, optimise, SEARCHED)
    group.add_argument(
        "--store", metavar="FILE.nc",
        help="keep every machine that was tried; the same command goes on where it was interrupted",
    )  # fmt: skip
    group.add_argument("--title", default="", metavar="TEXT", help="heading of the report")
    common.add_out(parser, pages=PAGES)


def run(arguments: argparse.Namespace) -> str:
    """Search, write, and describe the best machine."""
    targets = common.targets_of(arguments, pages=PAGES)
    parameter, band = members.band_of(arguments)
    case = members.case_of(arguments, {parameter: np.array(band)})
    judge = mean_over if arguments.mean else worst_over
    objective = judge(parameter, band, **common.given(arguments, ("measure", "unit", *JUDGED)))
    best = optimise(
        case.system, ranges_of(arguments.vary, "vary"), objective,
        **common.given(arguments, (*SEARCHED, "store")),
    )  # fmt: skip
    if best.interrupted:
        raise KeyboardInterrupt
    write(targets, data=best, picture=best.plot, page=lambda: _page(arguments, best))
    return f"{case.system}\n{best}\n{_looked_at(best)}{common.listed(targets)}"


def _looked_at(best: Design) -> str:
    """The value looked at more closely; derivatives and robust ranges, a line for each parameter."""
    lines = []
    for name, slope in best.sensitivity.items():
        low, high, _ = best.robust[name]
        unit = best.units[name]
        lines.append(
            f"  {name}: derivative {slope.value:.4g}; within 1 dB from {low:.6g} to {high:.6g} {unit}".rstrip()
        )
    seen = f"  {best.verified:.6g} {best.units['']}".rstrip()
    seen += " with twice as many values of the band and starts as the last judgement"
    kind = "exact derivatives" if best.sensitivity_exact else "derivatives by differences"
    return "\n".join([seen, f"  {kind} of the objective, and ranges:", *lines])


def _page(arguments: argparse.Namespace, best: Design) -> str:
    """The report: the best machine, and its response."""
    seen = best.objective
    response = frequency_response(
        best.system, seen.parameter, seen.band, measure=seen.measure, unit=seen.unit,
        seed=seen.seed, number=NUMBER, starts=STARTS, most=MOST,
    )  # fmt: skip
    command = common.command_of(arguments)
    return design_report(best, response, title=arguments.title, command=command)
