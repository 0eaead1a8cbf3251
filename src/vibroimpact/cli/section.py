"""Command vibroimpact section: states after the impacts at one stop, or once per period."""

from __future__ import annotations

import argparse

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.output import write
from vibroimpact.model.state import State
from vibroimpact.model.system import System
from vibroimpact.plotting import plot_section
from vibroimpact.simulation.sections import (
    Section,
    StroboscopicSection,
    impact_section,
    stroboscopic_section,
)
from vibroimpact.simulation.simulate import RunEnd

EXAMPLE = "  vibroimpact section impact-damper/A --omega 1.0 --perturb 1e-3 --out circle.svg"
COMMON, AT_STOP = ("points", "settle"), ("stop", "contact")
WHOLE = (RunEnd.IMPACTS, RunEnd.HORIZON)  # every requested point is there
AXES = ("x", "y")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_start(parser)
    common.add_arguments_of(
        parser, impact_section, COMMON + AT_STOP,
        points="Points to record, >= 1.",
        settle="Impacts (at all stops) to discard first, or forcing periods with --at-phase.",
    )  # fmt: skip
    parser.add_argument(
        "--at-phase", type=float, metavar="THETA",
        help="take the points once per forcing period, at this phase of the force in radians, "
        "instead of at impacts",
    )  # fmt: skip
    common.add_arguments_of(parser, plot_section, AXES)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> str:
    """Record the section, write, and describe it."""
    targets = common.targets_of(arguments)
    case = common.case_of(arguments)
    state = common.start_of(arguments, case)
    section = _section(arguments, case.system, state)
    if section.end not in WHOLE:
        raise common.Failure(f"after {len(section)} points: {section.end.sentence}.")
    axes = common.given(arguments, AXES)
    write(targets, data=section.to_dataset, picture=lambda: plot_section(section, **axes))
    si = common.in_si(case.system, section.last, float(section.time[-1]))
    return f"{case.system}\n{state}\n{section}\nends in {section.last}{si}{common.listed(targets)}"


def _section(
    arguments: argparse.Namespace, system: System, state: State
) -> Section | StroboscopicSection:
    sizes, place = common.given(arguments, COMMON), common.given(arguments, AT_STOP)
    if arguments.at_phase is None:
        return impact_section(system, state, **sizes, **place)
    if place:
        name, value = next(iter(place.items()))
        raise InvalidParameterError(f"{name} = {value}: is for impacts; not with --at-phase.")
    return stroboscopic_section(system, state, phase=arguments.at_phase, **sizes)
