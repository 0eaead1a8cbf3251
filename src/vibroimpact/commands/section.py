"""vibroimpact section: the states just after the impacts at one stop."""

from __future__ import annotations

import argparse

from vibroimpact.commands import common
from vibroimpact.files import write
from vibroimpact.plotting import plot_section
from vibroimpact.sections import impact_section
from vibroimpact.simulate import RunEnd

NAME = "section"
HELP = "record the states just after the impacts at one stop, after a transient"
EXAMPLE = "  vibroimpact section impact-damper/A --omega 1.0 --perturb 1e-3 --out circle.svg"
SECTION = ("points", "settle", "stop", "contact")
AXES = ("x", "y")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_start(parser)
    common.add_arguments_of(parser, impact_section, SECTION)
    common.add_arguments_of(parser, plot_section, AXES)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> str:
    """Record the section, write, and say what it is."""
    targets = common.targets_of(arguments)
    case = common.case_of(arguments)
    state = common.start_of(arguments, case)
    section = impact_section(case.system, state, **common.given(arguments, SECTION))
    if section.end is not RunEnd.IMPACTS:
        raise common.Failure(f"after {len(section)} points: {section.end.sentence}.")
    axes = common.given(arguments, AXES)
    write(targets, data=section.to_dataset, picture=lambda: plot_section(section, **axes))
    return f"{case.system}\n{state}\n{section}\nends in {section.last}{common.listed(targets)}"
