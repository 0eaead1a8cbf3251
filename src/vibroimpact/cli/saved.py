"""Options of commands that begin at a point of a curve that ``vibroimpact curve`` has written."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence

import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice
from vibroimpact._core.progress import Progress
from vibroimpact.bifurcations.augmented import Bounds
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.store import load_curve
from vibroimpact.cli import common
from vibroimpact.cli.curve import add_behind, plane_in
from vibroimpact.cli.members import RANGE, ranges_of
from vibroimpact.continuation.walk import CurveProgress
from vibroimpact.plotting import plot_curves, plot_plane

Both = tuple[Bounds, Bounds]


def add_point(parser: argparse.ArgumentParser, example: str) -> None:
    """Add the options for the curve, the point, the ranges, and what is written."""
    parser.add_argument("curve", metavar="CURVE.nc", help="a curve that vibroimpact curve wrote")
    parser.add_argument(
        "--at", required=True, metavar="POINT", help=f"the point of the curve: {example}"
    )
    parser.add_argument(
        "--over", action="append", default=[], metavar=RANGE,
        help="a parameter of the curve and its range, scaled; may be given for both (default: the ranges of the "
        "curve). The smaller they are, the sooner the result is there",
    )  # fmt: skip
    add_behind(parser)
    common.add_out(parser)


def curve_of(arguments: argparse.Namespace) -> BifurcationCurve:
    """The curve; the point is one of its points."""
    curve = load_curve(arguments.curve)
    check_choice("at", arguments.at, [point.label for point in curve.special_points])
    return curve


def bounds_of(arguments: argparse.Namespace, curve: BifurcationCurve) -> Both:
    """Ranges of both parameters, in the order of the curve."""
    over = ranges_of(arguments.over, "over")
    for name in over:
        check_choice("over", name, curve.names)
    first, second = (
        over.get(name, known) for name, known in zip(curve.names, curve.bounds, strict=True)
    )
    return first, second


def behind_of(arguments: argparse.Namespace, curve: BifurcationCurve) -> xr.Dataset | None:
    """Plane behind the curves."""
    return None if arguments.behind is None else plane_in(arguments.behind, curve.names)


def noted(progress: Progress, curve: BifurcationCurve) -> CurveProgress:
    """What is shown after every panel."""
    return lambda count, value: progress.note(f"{count} points, {curve.names[1]} = {value:.6g}")


def picture_of(curves: Sequence[BifurcationCurve], bounds: Both, behind: xr.Dataset | None) -> Axes:
    """Curves in the ranges of the command, or over the plane."""
    if behind is not None:
        return plot_curves(curves, ax=plot_plane(behind))
    return plot_curves(curves, bounds=bounds)


def datasets_of(curves: Sequence[BifurcationCurve]) -> list[Callable[[], xr.Dataset]]:
    """What makes the data of each curve."""
    return [curve.to_dataset for curve in curves]
