"""Command vibroimpact circle: the invariant circle on which a motion settles, and its family."""

from __future__ import annotations

import argparse
import math

from matplotlib.axes import Axes

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.cli import common
from vibroimpact.cli.members import base_of
from vibroimpact.cli.output import write
from vibroimpact.plotting import plot_circle_branch, plot_invariant_circle
from vibroimpact.tori.branch import CircleBranch
from vibroimpact.tori.circle import Circle
from vibroimpact.tori.continue_circle import continue_circle
from vibroimpact.tori.find import find_circle

EXAMPLE = (
    "  vibroimpact circle impact-damper/A --omega 1.0 --along omega 0.99 1.02 --out circles.nc "
    "--out rotation.svg"
)
SEARCH, LIMITS = ("settle_iterates", "points"), ("tolerance", "most_nodes")
AXES = ("x", "y")
ALONG = ("NAME", "LOW", "HIGH")

Along = tuple[str, tuple[float, float]]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_start(parser, at_orbit=False)
    group = parser.add_argument_group("circle", "Of the motion from the start.")
    common.add_arguments_of(group, find_circle, SEARCH + LIMITS)
    group.add_argument(
        "--full-map", action="store_true",
        help="solve on the full map where the motion is its own mirror image, instead of on the half map: for "
        "parameters that break the symmetry",
    )  # fmt: skip
    group.add_argument(
        "--along", nargs=3, metavar=ALONG,
        help="follow the circle in a parameter over this range, which holds its own value: omega, another "
        "parameter, or a path into a mechanism. The data and the picture are then those of the family: rotation "
        "numbers over the parameter",
    )  # fmt: skip
    common.add_arguments_of(
        group, plot_invariant_circle, AXES,
        x="Coordinate across: x1, x2, ..., v1, v2, ..., phase.",
        y="Coordinate up.",
    )  # fmt: skip
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> str:
    """Find, follow, write, and describe the circle."""
    targets, along = common.targets_of(arguments), _along(arguments)
    case = common.case_of(arguments)
    state = base_of(arguments, case)
    circle = find_circle(
        case.system, state, symmetric=False if arguments.full_map else None,
        **common.given(arguments, SEARCH + LIMITS),
    )  # fmt: skip
    if not circle.converged:
        raise common.Failure(f"no circle was found from {state}: {circle.status}.")
    family = None if along is None else _family(arguments, circle, along)
    result = circle if family is None else family
    write(targets, data=result, picture=lambda: _picture(arguments, circle, family))
    said = [str(case.system), *_described(circle)]
    said += [] if family is None else [str(family)]
    return "\n".join(said) + common.listed(targets)


def _along(arguments: argparse.Namespace) -> Along | None:
    """Parameter and its range."""
    if arguments.along is None:
        return None
    if given := common.given(arguments, AXES):
        name, value = next(iter(given.items()))
        raise InvalidParameterError(
            f"{name} = {value}: is for the picture of one circle; not with --along."
        )
    parameter, *ends = arguments.along
    try:
        low, high = map(float, ends)
    except ValueError:
        raise InvalidParameterError(
            f"along = {' '.join(arguments.along)}: must be {' '.join(ALONG)} with two numbers."
        ) from None
    return parameter, (low, high)


def _family(arguments: argparse.Namespace, circle: Circle, along: Along) -> CircleBranch:
    """The circle, followed in both directions."""
    parameter, bounds = along
    family = continue_circle(
        circle, parameter, bounds, progress=True, **common.given(arguments, LIMITS)
    )
    common.check_interrupted(family)
    return family


def _picture(arguments: argparse.Namespace, circle: Circle, family: CircleBranch | None) -> Axes:
    if family is not None:
        return plot_circle_branch(family)
    return plot_invariant_circle(circle, **common.given(arguments, AXES))


# ---- the words -----------------------------------------------------------------------------------


def _described(circle: Circle) -> list[str]:
    """Description of the circle, its smoothness and clearance, and a state on it."""
    state, (p, q) = circle.state(), circle.resonance
    full = f"; {circle.full_rotation_number:.12g} turns per full map" if circle.symmetric else ""
    kinds = ", ".join(str(kind) for kind in circle.bundles)
    return [
        str(circle),
        f"  near the resonance {p}/{q}{full}",
        f"  normal directions: {kinds}",
        f"  smoothness: decay {circle.decay:.6g} per harmonic, roughness {circle.roughness:.6g}, least angle "
        f"{circle.least_angle:.6g}",
        f"  {_clearance(circle)}; least impact speed {circle.least_impact_speed:.6g}",
        f"  passes through {state}",
    ]


def _clearance(circle: Circle) -> str:
    gap = circle.clearance_to_grazing
    if math.isinf(gap):
        return "no gap has an extremum between impacts"
    return f"clearance to grazing {gap:.6g}"
