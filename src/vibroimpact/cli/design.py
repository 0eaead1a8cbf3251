"""Command vibroimpact design: the best parameters of a machine over a band, with a report."""

from __future__ import annotations

import argparse

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.cli.response import BAND, add_band
from vibroimpact.design.objective import mean_over, worst_over
from vibroimpact.design.optimise import Design, optimise
from vibroimpact.machines.units import units_of
from vibroimpact.model.system import System
from vibroimpact.plotting.design_report import design_report
from vibroimpact.plotting.report import PAGES
from vibroimpact.response.response import frequency_response

EXAMPLE = (
    "  vibroimpact design impact-damper/A --vary half_clearance=1:20 --vary restitution=0.3:0.9 "
    "--over omega=0.4:0.6 --budget 500 --out design.svg --out report.html"
)
JUDGED = ("points", "starts", "settle_periods", "periods")
SEARCHED = ("budget", "refine", "seed", "workers", "store")
NUMBER, STARTS, MOST = 60, 6, 4  # of the response of the best machine in the report


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    group = parser.add_argument_group("design")
    text = "a parameter and its bounds, scaled; once for each parameter"
    common.add_named(group, "--vary", common.RANGE, text, required=True)
    group.add_argument(
        "--si",
        action="store_true",
        help="the bounds of --vary are in SI units: m, N, rad/s; of a [physical] file",
    )
    add_band(group, worst_over)
    group.add_argument(
        "--mean", action="store_true", help="judge by the mean over the band, not by the worst"
    )
    common.add_arguments_of(group, worst_over, JUDGED)
    common.add_arguments_of(group, optimise, SEARCHED)
    common.add_arguments_of(group, design_report, ["title"])
    common.add_out(parser, pages=PAGES)


def run(arguments: argparse.Namespace) -> Done:
    """Search for the best machine."""
    common.check_count(arguments.over, 1, common.RANGE)
    case, vary = common.case_of(arguments, arguments.over), arguments.vary
    ((parameter, band),) = arguments.over.items()
    judge = mean_over if arguments.mean else worst_over
    objective = judge(parameter, band, **common.given(arguments, (*BAND, *JUDGED)))
    best = optimise(
        case.system, _own(case.system, vary) if arguments.si else vary, objective,
        **common.given(arguments, SEARCHED),
    )  # fmt: skip
    common.check_interrupted(best)
    return Done([case.system, best], best, best.plot, lambda: _page(arguments, best))


def _own(system: System, vary: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Bounds in SI units in those of the machine."""
    units = units_of(system)
    if not units.si:
        raise InvalidParameterError(
            "si: the machine has no physical scales. Give a [physical] file, or leave --si out."
        )
    factors = {name: units.factor(units.quantity_of(name)) for name in vary}
    return {name: (a / factors[name], b / factors[name]) for name, (a, b) in vary.items()}


def _page(arguments: argparse.Namespace, best: Design) -> str:
    """The report: the best machine, and its response."""
    seen = best.objective
    response = frequency_response(
        best.system, seen.parameter, seen.band, measure=seen.measure, unit=seen.unit,
        seed=seen.seed, number=NUMBER, starts=STARTS, most=MOST,
    )  # fmt: skip
    command = common.command_of(arguments)
    return design_report(best, response, command=command, **common.given(arguments, ["title"]))
