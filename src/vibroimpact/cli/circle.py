"""Command vibroimpact circle: the invariant circle on which a motion settles, and its family."""

from __future__ import annotations

import argparse
from dataclasses import replace

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.tori.continue_circle import STEPS, continue_circle
from vibroimpact.tori.find import find_circle

EXAMPLE = (
    "  vibroimpact circle impact-damper/A --omega 1.0 --bounds omega=0.99:1.02 --out circles.nc "
    "--out rotation.svg"
)
SEARCH_ARGUMENTS = ("settle_iterates", "points")
LIMIT_ARGUMENTS = ("tolerance", "most_nodes")
AXES = ("x", "y")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser, at_orbit=False)
    group = parser.add_argument_group("circle", "Of the motion from the start.")
    common.add_arguments_of(group, find_circle, SEARCH_ARGUMENTS + LIMIT_ARGUMENTS)
    group.add_argument(
        "--full-map", action="store_true",
        help="solve on the full map where the motion is its own mirror image, instead of on the half map: for "
        "parameters that break the symmetry",
    )  # fmt: skip
    common.add_named(
        group, "--bounds", common.RANGE,
        "follow the circle in a parameter within these bounds, which hold its own value: omega, another "
        "parameter, or a path into a mechanism. The data and the picture are then those of the family: rotation "
        "numbers over the parameter",
    )  # fmt: skip
    common.add_axes(parser)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Find the circle, and follow it."""
    along, looks = [*arguments.bounds.items()], common.given(arguments, AXES)
    if len(along) > 1:
        raise InvalidParameterError(f"bounds = {', '.join(arguments.bounds)}: may be given once.")
    if along and looks:
        name, value = next(iter(looks.items()))
        raise InvalidParameterError(
            f"{name} = {value}: is for the picture of one circle; not with --bounds."
        )
    case = common.case_of(arguments)
    state = common.start_of(arguments, case)
    circle = find_circle(
        case.system, state, symmetric=False if arguments.full_map else None,
        **common.given(arguments, SEARCH_ARGUMENTS + LIMIT_ARGUMENTS),
    )  # fmt: skip
    if not circle.converged:
        raise common.Failure(f"no circle was found from {state}: {circle.status}.")
    said: list[object] = [case.system, circle]
    if not along:
        return Done(said, circle, lambda: circle.plot(**looks))
    ((parameter, bounds),) = along
    limits = common.given(arguments, LIMIT_ARGUMENTS)
    steps = replace(STEPS, **{name: limits.pop(name) for name in {"tolerance"} & limits.keys()})
    family = continue_circle(circle, parameter, bounds, steps=steps, **limits)
    return Done([*said, family], family, family.plot)
