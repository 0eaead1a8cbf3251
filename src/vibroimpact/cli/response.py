"""Command vibroimpact response: how large a machine vibrates over a band, with a report."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common, members
from vibroimpact.cli.ensemble import system_over
from vibroimpact.cli.output import write
from vibroimpact.machines.toml_file import Case
from vibroimpact.model.state import STATE
from vibroimpact.plotting import plot_response
from vibroimpact.plotting.report import PAGES, in_brief, report_of
from vibroimpact.response.compare import COMPARISONS, measured_beside
from vibroimpact.response.response import Response, frequency_response

EXAMPLE = (
    "  vibroimpact response impact-damper/A --over omega=0.4:0.6 --measure x1 --compare linear "
    "--out response.svg --out report.html"
)
SIMULATION = ("number", "seed", "settle_periods", "periods")
SEARCH = ("most", "depth", "workers")
TEXTS = {
    "settle_periods": "Forcing periods before motions are observed.",
    "periods": "Forcing periods while they are observed.",
    "depth": "Switches from the branch of a simulated orbit to others.",
}
LEAST: dict[str, Any] = {
    "number": 2, "starts": 0, "most": 0, "settle_periods": 0, "periods": 1, "progress": False,
}  # fmt: skip


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_start(parser, at_orbit=False)
    group = parser.add_argument_group("response")
    members.add_band(group, frequency_response)
    group.add_argument(
        "--compare", action="append", default=[], choices=COMPARISONS,
        help="put a linear machine beside it: linear, all stops open; tuned, with a tuned mass "
        "damper of the same mass; may be repeated",
    )  # fmt: skip
    group.add_argument(
        "--decibel", action="store_true", help="draw decibels: 20 lg of the value, 10 lg of a power"
    )
    group.add_argument("--title", default="", metavar="TEXT", help="heading of the report")
    group.add_argument(
        "--starts", type=int, metavar="COUNT",
        help="random starts at each value of the parameter (default: 16)",
    )  # fmt: skip
    common.add_arguments_of(group, frequency_response, (*SIMULATION, *SEARCH), **TEXTS)
    common.add_out(parser, pages=PAGES)


def run(arguments: argparse.Namespace) -> str:
    """Compute the response, write, and say how large it is."""
    targets = common.targets_of(arguments, pages=PAGES)
    parameter, band = members.band_of(arguments)
    case = members.case_of(arguments, {parameter: np.array(band)})
    chosen = {
        "parameter": parameter, "band": band,
        **common.given(arguments, ("unit", "measure")), **_start(arguments, case),
    }  # fmt: skip
    _check_compare(arguments, frequency_response(case.system, **chosen, **LEAST))
    more = common.given(arguments, ("starts", *SIMULATION, *SEARCH))
    response = frequency_response(case.system, **chosen, **more)
    said = _said(arguments, case, response)
    drawn: dict[str, Any] = {"compare": arguments.compare, "decibel": arguments.decibel}
    write(
        targets,
        data=response,
        picture=lambda: plot_response(response, **drawn),
        page=lambda: report_of(
            response, title=arguments.title, command=common.command_of(arguments), **drawn
        ),
    )
    return said + common.listed(targets)


def _start(arguments: argparse.Namespace, case: Case) -> dict[str, Any]:
    """Start of the motion that is followed, where one is given."""
    if not common.given(arguments, (*STATE, "on_stop", "orbit", "perturb")) and not case.start:
        return {}
    return {"start": members.base_of(arguments, case)}


def _check_compare(arguments: argparse.Namespace, response: Response) -> None:
    """Refuse a linear machine that does not exist, before the long work."""
    for one in arguments.compare:
        measured_beside(response, one)(response.band.low)


def _said(arguments: argparse.Namespace, case: Case, response: Response) -> str:
    """What was found, in numbers and in words; a failure where nothing was."""
    if response.interrupted:
        raise KeyboardInterrupt
    try:
        words = in_brief(response, arguments.compare)
    except InvalidParameterError as error:
        raise common.Failure(str(error)) from error
    ends = np.array([response.band.low, response.band.high])
    return "\n".join([system_over(case, {response.parameter: ends}), repr(response), *words])
