"""Command vibroimpact section: states after impacts or changes of state, or once per period."""

from __future__ import annotations

import argparse

from vibroimpact.cli import common
from vibroimpact.cli.output import write
from vibroimpact.plotting import plot_section
from vibroimpact.simulation.sections import section
from vibroimpact.simulation.simulate import RunEnd

EXAMPLE = "  vibroimpact section impact-damper/A --omega 1.0 --perturb 1e-3 --out circle.svg"
POINTS, AXES = ("at", "points", "settle"), ("x", "y")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_start(parser)
    common.add_arguments_of(
        parser, section, POINTS,
        at=f"{common.PLACE}; {common.PHASE}; change=ELEMENT, where it changes its state, or "
        "change=ELEMENT:STATE, where it takes that one: stick, forward, backward of friction, open, "
        "upper, lower of a stop, and so on. By default what the machine has first: a stop, a force, "
        "an element.",
    )  # fmt: skip
    common.add_arguments_of(parser, plot_section, AXES)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> str:
    """Record the section, write, and describe it."""
    targets = common.targets_of(arguments)
    case = common.case_of(arguments)
    state = common.start_of(arguments, case)
    found = section(case.system, state, **common.given(arguments, POINTS))
    if found.end is not RunEnd.POINTS:
        raise common.Failure(f"after {len(found)} points: {found.end.sentence}.")
    axes = common.given(arguments, AXES)
    write(targets, data=found, picture=lambda: plot_section(found, **axes))
    return f"{case.system}\n{state}\n{found}\nends in {found.last}{common.listed(targets)}"
