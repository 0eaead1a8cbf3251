"""Command vibroimpact branch: a branch of periodic orbits with bifurcations, and others from it."""

from __future__ import annotations

import argparse

from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice, ends_of, range_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.continue_orbit import continue_orbit
from vibroimpact.branches.stop_rules import Inadmissible, Rule, inadmissible, unstable
from vibroimpact.branches.switch import NoBranch, switch_branch
from vibroimpact.cli import common
from vibroimpact.cli.output import write
from vibroimpact.machines.toml_file import Case
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.state import STATE
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.find import find_orbit
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.symmetric_damper import has_symmetric_orbits, known_orbits
from vibroimpact.plotting import plot_branch_multipliers, plot_branches

EXAMPLE = "  vibroimpact branch impact-damper/A --range 0.5 1.5 --out branch.nc --out branch.svg"
STATED = (*STATE, "on_stop", "perturb")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_branch(parser)
    common.add_arguments_of(parser, plot_branches, ["variable"])
    parser.add_argument(
        "--multipliers", action="store_true",
        help="draw the multipliers of the last branch in the complex plane instead",
    )  # fmt: skip
    common.add_out(parser)


def add_branch(parser: argparse.ArgumentParser) -> None:
    """Add the options that define the branch."""
    common.add_system(parser)
    common.add_start(parser)
    group = parser.add_argument_group(
        "branch",
        "Without a state to start from, the branch of the symmetric orbit, for a machine whose "
        "symmetric orbit has a closed form. Else the branch of the orbit to which the motion from "
        "the start settles. A frequency that is not given is the middle of the range.",
    )
    group.add_argument(
        "--parameter", default="omega", metavar="NAME",
        help="what varies: omega, another parameter, or a path into a mechanism such as "
        "elements[0].restitution (default: omega)",
    )  # fmt: skip
    group.add_argument(
        "--range", type=float, nargs=2, required=True, metavar=("LOW", "HIGH"),
        help="of the parameter; the start lies between",
    )  # fmt: skip
    group.add_argument(
        "--switch", action="append", default=[], metavar="POINT",
        help="switch to the branch that meets this one at a special point such as BP1, PD1 or "
        "GR1; may be repeated",
    )  # fmt: skip
    group.add_argument(
        "--stop-when", type=_rule, action="append", default=[], metavar="RULE",
        help="end branches early: inadmissible=SHARE, once not admissible over more than this share "
        "of the range; unstable=COUNT, where more multipliers than this are outside the unit "
        "circle; may be repeated",
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


def run(arguments: argparse.Namespace) -> str:
    """Follow, write, and describe the branches."""
    targets = common.targets_of(arguments)
    branches = branches_of(arguments)
    write(targets, data=branches[-1], picture=lambda: _picture(arguments, branches))
    system = branches[0].family.system
    return "\n".join([str(system), *map(str, branches)]) + common.listed(targets)


def branches_of(arguments: argparse.Namespace) -> list[Branch]:
    """Requested branch, and every one that was switched to."""
    name, bounds = arguments.parameter, ends_of("range", arguments.range)
    case = case_of_branch(arguments)
    start, stop_when = orbit_of(arguments, case), arguments.stop_when
    low, high = range_of("range", bounds, name, parameter_value(case.system, name))
    branches = [continue_orbit(start, name, (low, high), stop_when=stop_when, progress=True)]
    common.check_interrupted(branches[0].curve)
    for label in arguments.switch:
        point = branches[-1][label]
        found = switch_branch(point, (low, high), stop_when=stop_when)
        if isinstance(found, NoBranch):
            raise common.Failure(f"{point!r}: {found.reason}.")
        common.check_interrupted(found.curve)
        branches.append(found)
    return branches


def case_of_branch(arguments: argparse.Namespace) -> Case:
    """System of the branch; a frequency that is not given is the middle of its range."""
    if not arguments.config:
        check_choice("parameter", arguments.parameter, common.parameters_in(arguments))
        common.check_case(arguments)
        fixed = common.given(arguments, common.parameters_in(arguments))
        free = "omega" not in {*fixed, *common.parameters_of_case(arguments)}
        if free and arguments.parameter == "omega":
            arguments.omega = sum(arguments.range) / 2.0
    return common.case_of(arguments)


def orbit_of(arguments: argparse.Namespace, case: Case) -> Orbit:
    """Symmetric orbit in closed form, or the orbit to which the motion from the start settles."""
    stated = common.given(arguments, STATED) or (case.start and not arguments.orbit)
    if has_symmetric_orbits(type(case.system)) and not stated:
        return _symmetric(case.system, arguments.orbit)
    state = common.start_of(arguments, case)
    found = find_orbit(case.system, state)
    if not found.converged:
        raise common.Failure(f"no periodic orbit was found from {state}: {found.status}.")
    return found


def _symmetric(system: System, sign: str | None) -> Orbit:
    """Symmetric orbit with a sign; by default the stable one, or else the first."""
    signs = zip(common.SIGNS, known_orbits(system), strict=False)
    wanted = [orbit for own, orbit in signs if sign in (None, own)]
    if not wanted:
        raise common.Failure(
            f"no symmetric 1-1-1 orbit exists at omega = {mechanism_of(system).omega}: condition (16) of the "
            "paper fails. Give another --omega, or --position and --velocity."
        )
    return next((orbit for orbit in wanted if orbit.stable), wanted[0])


def _picture(arguments: argparse.Namespace, branches: list[Branch]) -> Axes:
    if arguments.multipliers:
        return plot_branch_multipliers(branches[-1])
    low, high = arguments.range
    return plot_branches(branches, bounds=(low, high), **common.given(arguments, ["variable"]))
