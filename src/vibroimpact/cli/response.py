"""Command vibroimpact response: how large a machine vibrates over a band, with a report."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from typing import Any

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.ensemble import system_over
from vibroimpact.cli.output import Done, wants, write
from vibroimpact.response.compare import measured_beside
from vibroimpact.response.response import frequency_response
from vibroimpact.results.files import PAGES, PICTURES

EXAMPLE = (
    "  vibroimpact response impact-damper/A --band omega=0.4:0.6 --measure x1 --compare linear "
    "--out response.svg --out report.html"
)
BAND = ("unit", "measure")
DRAWING_SHARE = 0.1  # of the time drawing takes so much at most
SIMULATION = ("points", "seed", "settle_periods", "periods")
SEARCH = ("most_branches", "depth", "inadmissible", "workers")
LOOKS = ("compare", "decibel")
LEAST: dict[str, Any] = {
    "points": 2, "starts": 0, "most_branches": 0, "settle_periods": 0, "periods": 1, "progress": False,
}  # fmt: skip


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser, at_orbit=False)
    group = parser.add_argument_group("response")
    add_band(group, frequency_response)
    group.add_argument(
        "--compare", nargs="+", action="extend", metavar="WITH",
        help="draw beside it: linear, the machine with all stops open, and tuned, with a tuned mass damper of the "
        "same mass in place of the free masses",
    )  # fmt: skip
    group.add_argument(
        "--decibel", action="store_true", default=None,
        help="draw 20 lg of the value, 10 lg of a power",
    )  # fmt: skip
    common.add_title(group)
    group.add_argument(
        "--starts", type=int, metavar="COUNT",
        help="random starts at each value of the parameter (default: 16)",
    )  # fmt: skip
    common.add_arguments_of(group, frequency_response, (*SIMULATION, *SEARCH))
    common.add_out(parser, pages=PAGES)


def _drawing(arguments: argparse.Namespace, drawn: dict[str, Any]) -> Callable[[Any], None] | None:
    """What writes the pictures of a response as it is found; None where no file is one.

    They are drawn again after a branch where that takes a small share of the time since they were drawn.
    """
    paths = [path for path in arguments.out if wants([path], PICTURES)]
    if not paths:
        return None
    last, took = -math.inf, 0.0

    def draw(response: Any) -> None:
        nonlocal last, took
        begin = time.monotonic()
        if begin - last < took / DRAWING_SHARE:
            return
        write(paths, Done([], response, lambda: response.plot(**drawn)), arguments.columns)
        if not took:
            arguments.drawn = paths  # an interruption says that they are there
            names = ", ".join(map(str, paths))
            sys.stderr.write(f"{names}: what is simulated; branches are added as they are found\n")
        last = time.monotonic()
        took = last - begin

    return draw


def add_band(parser: argparse._ActionsContainer, function: Callable[..., Any]) -> None:
    """Add what varies while a machine runs, its band, and what a function measures over it."""
    text = "the parameter, usually omega, and its band, in --unit where it is given"
    common.add_named(parser, "--band", common.RANGE, text, required=True)
    common.add_arguments_of(parser, function, BAND)


def run(arguments: argparse.Namespace) -> Done:
    """Compute the response."""
    from vibroimpact.plotting.report import in_brief, report_of

    common.check_count("band", arguments.band, 1, common.RANGE)
    case = common.case_of(arguments, arguments.band, "band")
    parameter, bounds = common.band_of(arguments)
    chosen = {"parameter": parameter, "bounds": bounds, **common.given(arguments, BAND)}
    if common.given(arguments, common.START) or case.start:
        chosen["start"] = common.start_of(arguments, case, arguments.band)
    few = frequency_response(case.system, **chosen, **LEAST)
    drawn = common.given(arguments, LOOKS)
    for one in drawn.get("compare", ()):  # refuses a linear machine that does not exist
        measured_beside(few, one)(few.band.low)
    response = frequency_response(
        case.system, **chosen, **common.given(arguments, ("starts", *SIMULATION, *SEARCH)),
        so_far=_drawing(arguments, drawn),
    )  # fmt: skip
    common.check_interrupted(response)
    try:
        words = in_brief(response, drawn.get("compare", ()))
    except InvalidParameterError as error:
        raise common.Failure(str(error)) from error
    system = system_over(case, {response.parameter: (response.band.low, response.band.high)})
    return Done(
        [system, response, *words],
        response,
        lambda: response.plot(**drawn),
        lambda: report_of(
            response,
            command=common.command_of(arguments),
            **drawn,
            **common.given(arguments, ["title"]),
        ),
    )
