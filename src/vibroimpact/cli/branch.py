"""Command vibroimpact branch: a branch of periodic orbits with bifurcations, and others from it."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from vibroimpact._core.checks import range_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.continue_orbit import continue_orbit
from vibroimpact.branches.point import NotFound
from vibroimpact.branches.stop_rules import Inadmissible, Rule, inadmissible, unstable
from vibroimpact.branches.switch import switch_branch
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.machines.toml_file import Case
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.state import STATE
from vibroimpact.orbits.find import find_orbit
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.symmetric_damper import has_symmetric_orbits

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXAMPLE = (
    "  vibroimpact branch impact-damper/A --bounds omega=0.5:1.5 --out branch.nc --out branch.svg"
)
Bounds = dict[str, tuple[float, float]]
STATED = (*STATE, "on_stop", "perturb")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_branch(parser)
    parser.add_argument(
        "--variable", metavar="NAME",
        help="what is drawn over the parameter: x1, x2, ..., v1, v2, ... just after an impact, phase of the force "
        "there; or, of the whole orbit, speed, the smallest closing speed of an impact, clearance, the least gap "
        "between the impacts, or period (default: v1)",
    )  # fmt: skip
    parser.add_argument(
        "--multipliers", action="store_true",
        help="draw the multipliers of the last branch in the complex plane instead",
    )  # fmt: skip
    common.add_out(parser)


def add_branch(parser: argparse.ArgumentParser, name: str = "--bounds") -> None:
    """Add the options that define the branch; one of this name has its parameter and bounds."""
    common.add_start(parser)
    group = parser.add_argument_group(
        "branch",
        "Without a state to start from, the branch of the symmetric orbit, for a machine whose "
        "symmetric orbit has a closed form. Else the branch of the orbit to which the motion from "
        "the start settles. The parameter, where nothing else fixes it, is in the middle of the bounds.",
    )
    common.add_named(
        group, name, common.RANGE,
        "what varies along the branch, and its bounds, with the start between: omega, another "
        "parameter, or a path into a mechanism such as elements[0].restitution", required=True,
    )  # fmt: skip
    parser.set_defaults(branch_option=name)
    group.add_argument(
        "--switch", action="append", default=[], metavar="POINT",
        help="switch to the branch that meets this one at a special point such as BP1, PD1 or "
        "GR1; may be repeated",
    )  # fmt: skip
    group.add_argument(
        "--stop-when", type=_rule, action="append", default=[], metavar="RULE",
        help="end branches early: with --inadmissible, inadmissible=SHARE, once not admissible over more than "
        "this share of the range; unstable=COUNT, where more multipliers than this are outside the unit circle; "
        "may be repeated",
    )  # fmt: skip
    common.add_arguments_of(
        group, continue_orbit, ["inadmissible"],
        inadmissible="follow each sequence of impacts to its end, motions or not; else a branch follows what "
        "exists, through changes of the sequence",
    )  # fmt: skip


def _rule(text: str) -> Rule | Inadmissible:
    """Rule of ``vi.stop`` from its name and number."""
    name, _, number = text.partition("=")
    try:
        if name == "inadmissible":
            return inadmissible(beyond=float(number))
        if name == "unstable":
            return unstable(multipliers=int(number))
    except (ValueError, InvalidParameterError):
        pass
    raise argparse.ArgumentTypeError(
        f"{text!r}: must be inadmissible=SHARE with a share >= 0 of the range, or unstable=COUNT "
        "with an integer >= 0"
    )


def run(arguments: argparse.Namespace) -> Done:
    """Follow the branch, and every one that is switched to."""
    branches = branches_of(arguments)
    system = branches[0].family.system
    return Done([system, *branches], branches[-1], lambda: _picture(arguments, branches))


def along_of(arguments: argparse.Namespace) -> tuple[str, Bounds]:
    """Name of the option for what varies along the branch, and the parameter with its bounds."""
    option = arguments.branch_option.removeprefix("--")
    varied: Bounds = getattr(arguments, option)
    common.check_count(option, varied, 1, common.RANGE)
    return option, varied


def branches_of(arguments: argparse.Namespace) -> list[Branch]:
    """Requested branch, and every one that was switched to."""
    option, varied = along_of(arguments)
    ((name, bounds),) = varied.items()
    case = common.case_of(arguments, varied, option)
    start = orbit_of(arguments, case)
    how = {"stop_when": arguments.stop_when, **common.given(arguments, ["inadmissible"])}
    low, high = range_of(option, bounds, name, parameter_value(case.system, name))
    branches = [_whole(continue_orbit(start, name, (low, high), **how))]
    for label in arguments.switch:
        point = branches[-1][label]
        found = switch_branch(point, (low, high), **how)
        if isinstance(found, NotFound):
            raise common.Failure(f"{point!r}: {found.reason}.")
        branches.append(_whole(found))
    return branches


def _whole(branch: Branch) -> Branch:
    """A branch that was not interrupted, nor any with which it goes on."""
    common.check_interrupted(*(one.curve for one in (branch, *branch.others)))
    return branch


def orbit_of(arguments: argparse.Namespace, case: Case) -> Orbit:
    """Symmetric orbit in closed form, or the orbit to which the motion from the start settles."""
    stated = common.given(arguments, STATED) or (case.start and not arguments.orbit)
    if has_symmetric_orbits(type(case.system)) and not stated:
        return common.symmetric_orbit(case.system, arguments.orbit)
    state = common.start_of(arguments, case)
    found = find_orbit(case.system, state)
    if not found.converged:
        raise common.Failure(f"no periodic orbit was found from {state}: {found.status}.")
    return found


def _picture(arguments: argparse.Namespace, branches: list[Branch]) -> Axes:
    from vibroimpact.plotting import plot_branch_multipliers, plot_branches

    if arguments.multipliers:
        return plot_branch_multipliers(branches[-1])
    (bounds,) = along_of(arguments)[1].values()
    return plot_branches(branches, bounds=bounds, **common.given(arguments, ["variable"]))
