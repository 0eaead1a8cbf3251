"""Command vibroimpact lyapunov: the largest Lyapunov exponent of a motion, or all of them."""

from __future__ import annotations

import argparse

from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.machines.units import units_of
from vibroimpact.simulation.lyapunov import lyapunov_exponent
from vibroimpact.simulation.lyapunov_spectrum import lyapunov_spectrum

EXAMPLE = "  vibroimpact lyapunov impact-damper/A --omega 0.98 --perturb 1e-3 --out growth.svg"
WINDOW = ("impacts", "settle_impacts")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser, at_orbit=False)
    parser.add_argument(
        "--spectrum", action="store_true", help="all exponents, not the largest alone"
    )
    common.add_arguments_of(parser, lyapunov_exponent, WINDOW)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Estimate the exponent, or all of them."""
    case = common.case_of(arguments)
    start, window = common.start_of(arguments, case), common.given(arguments, WINDOW)
    if arguments.spectrum:
        spectrum = lyapunov_spectrum(case.system, start, **window)
        return Done([case.system, spectrum], spectrum, spectrum.plot)
    found = lyapunov_exponent(case.system, start, **window)
    unit = f" {rate}" if (rate := units_of(case.system).unit("rate")) else " per unit of time"
    words = f"largest exponent {found.statement}{unit}, {found.per_impact:.6g} per impact"
    return Done([case.system, f"{words}; {found.run_end.sentence}"], found, found.plot)
