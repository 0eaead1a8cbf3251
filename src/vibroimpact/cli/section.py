"""Command vibroimpact section: states after impacts or changes of state, or once per period."""

from __future__ import annotations

import argparse

from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.simulation.sections import section
from vibroimpact.simulation.simulate import RunEnd

EXAMPLE = "  vibroimpact section impact-damper/A --omega 1.0 --perturb 1e-3 --out circle.svg"
POINT_ARGUMENTS = ("at", "points", "settle_events")
AXIS_ARGUMENTS = ("x", "y")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser)
    common.add_arguments_of(
        parser, section, POINT_ARGUMENTS,
        at=f"{common.PLACE}; {common.PHASE}; change=ELEMENT, where it changes its state, or "
        "change=ELEMENT:STATE, where it takes that one: stick, forward, backward of friction, open, "
        "upper, lower of a stop, and so on. By default what the machine has first: a stop, a force, "
        "an element.",
    )  # fmt: skip
    common.add_axes(parser)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Record the section."""
    case = common.case_of(arguments)
    state = common.start_of(arguments, case)
    found = section(case.system, state, **common.given(arguments, POINT_ARGUMENTS))
    if found.end is not RunEnd.POINTS:
        raise common.Failure(f"{found}.")
    axes = common.given(arguments, AXIS_ARGUMENTS)
    return Done(
        [case.system, state, found, f"ends in {found.last}"],
        found,
        lambda: found.plot(**axes),
    )
