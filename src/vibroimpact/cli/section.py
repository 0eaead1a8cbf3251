"""Command vibroimpact section: states after impacts or changes of state, or once per period."""

from __future__ import annotations

import argparse
from typing import Any

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.model.state import State
from vibroimpact.model.system import System
from vibroimpact.plotting import plot_section
from vibroimpact.simulation.sections import (
    impact_section,
    stroboscopic_section,
)
from vibroimpact.simulation.simulate import RunEnd
from vibroimpact.simulation.state_sections import AnySection, state_section

EXAMPLE = "  vibroimpact section impact-damper/A --omega 1.0 --perturb 1e-3 --out circle.svg"
COMMON, AT_STOP, AT_CHANGE = ("points", "settle"), ("stop", "contact"), ("element", "takes")
WHOLE = (RunEnd.IMPACTS, RunEnd.HORIZON, RunEnd.POINTS)  # every requested point is there
AXES = ("x", "y")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser)
    common.add_arguments_of(
        parser, impact_section, COMMON + AT_STOP,
        points="Points to record, >= 1.",
        settle="Impacts (at all stops) to discard first, or forcing periods with --at-phase, "
        "or changes with --element or --takes.",
    )  # fmt: skip
    common.add_arguments_of(
        parser, state_section, AT_CHANGE,
        element="Number of a contact or element: take the points where it changes its state.",
        takes="Take the points where the element takes this state: stick, forward, backward of friction, "
        "open, upper, lower of a stop, and so on.",
    )  # fmt: skip
    parser.add_argument(
        "--at-phase", type=float, metavar="THETA",
        help="take the points once per forcing period, at this phase of the force in radians, "
        "instead of at impacts",
    )  # fmt: skip
    common.add_arguments_of(parser, plot_section, AXES)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Record the section."""
    case = common.case_of(arguments)
    state = common.start_of(arguments, case)
    section = _section(arguments, case.system, state)
    if section.end not in WHOLE:
        raise common.Failure(f"after {len(section)} points: {section.end.sentence}.")
    axes = common.given(arguments, AXES)
    si = common.in_si(case.system, section.last, float(section.time[-1]))
    return Done(
        [case.system, state, section, f"ends in {section.last}{si}"],
        section.to_dataset,
        lambda: plot_section(section, **axes),
    )


def _section(arguments: argparse.Namespace, system: System, state: State) -> AnySection:
    sizes, place = common.given(arguments, COMMON), common.given(arguments, AT_STOP)
    change = common.given(arguments, AT_CHANGE)
    other = "--at-phase" if arguments.at_phase is not None else ""
    _refuse(change, "changes of state", other)
    _refuse(place, "impacts", other or ("--element or --takes" if change else ""))
    if change:
        return state_section(system, state, **sizes, **change)
    if not other:
        return impact_section(system, state, **sizes, **place)
    return stroboscopic_section(system, state, phase=arguments.at_phase, **sizes)


def _refuse(options: dict[str, Any], purpose: str, other: str) -> None:
    """Refuse options that are for another section than the one asked for."""
    if options and other:
        name, value = next(iter(options.items()))
        raise InvalidParameterError(f"{name} = {value}: is for {purpose}; not with {other}.")
