"""Parts of the commands that begin at a point of a curve that ``vibroimpact curve`` has written."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice, check_kind
from vibroimpact.bifurcations.augmented import Both
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint
from vibroimpact.bifurcations.switch_curve import NoCurve
from vibroimpact.bifurcations.tongue import NoTongue
from vibroimpact.cli import common
from vibroimpact.cli.curve import add_behind, plane_in
from vibroimpact.cli.members import RANGE, ranges_of
from vibroimpact.cli.output import write_each
from vibroimpact.plotting import plot_curves, plot_plane
from vibroimpact.results.files import load

Found = TypeVar("Found")


class Request(NamedTuple):
    """Request of a command: the files, the curve with its point, both ranges, a plane for behind the curves."""

    targets: list[Path]
    curve: BifurcationCurve
    point: CodimensionTwoPoint
    bounds: Both
    behind: xr.Dataset | None


def add_point(parser: argparse.ArgumentParser, example: str) -> None:
    """Add the options for the curve, the point, the ranges, and what is written."""
    parser.add_argument("curve", metavar="CURVE.nc", help="a curve that vibroimpact curve wrote")
    parser.add_argument(
        "--at", required=True, metavar="POINT", help=f"the point of the curve: {example}"
    )
    parser.add_argument(
        "--over", action="append", default=[], metavar=RANGE,
        help="a parameter of the curve and its range; may be given for both (default: the ranges of the "
        "curve). The smaller they are, the sooner the result is there",
    )  # fmt: skip
    add_behind(parser)
    common.add_out(parser)


def request_of(arguments: argparse.Namespace) -> Request:
    """Request of a command, checked before anything is computed."""
    targets = common.targets_of(arguments)
    curve = load(arguments.curve)
    check_kind("curve", curve, BifurcationCurve, "a file that vibroimpact curve wrote")
    check_choice("at", arguments.at, [point.label for point in curve.special_points])
    bounds = _bounds_of(arguments, curve)
    behind = None if arguments.behind is None else plane_in(arguments.behind, curve.names)
    return Request(targets, curve, curve[arguments.at], bounds, behind)


def _bounds_of(arguments: argparse.Namespace, curve: BifurcationCurve) -> Both:
    """Ranges of both parameters, in the order of the curve."""
    over = ranges_of(arguments.over, "over")
    for name in over:
        check_choice("over", name, curve.names)
    first, second = (
        over.get(name, known) for name, known in zip(curve.names, curve.bounds, strict=True)
    )
    return first, second


def followed(request: Request, follow: Callable[..., Found | NoCurve | NoTongue]) -> Found:
    """What begins at the point; a failure with the reason where nothing does."""
    found = follow(request.point, request.bounds, progress=True)
    if isinstance(found, NoCurve | NoTongue):
        raise common.Failure(f"{found!r}.")
    return found


def picture_of(request: Request, curves: Sequence[BifurcationCurve]) -> Axes:
    """Curves in the ranges of the command, or over the plane."""
    if request.behind is not None:
        return plot_curves(curves, ax=plot_plane(request.behind))
    return plot_curves(curves, bounds=request.bounds)


def report(
    request: Request, said: Sequence[str], curves: Sequence[BifurcationCurve],
    picture: Callable[[], Axes],
) -> str:  # fmt: skip
    """Write the curves, and describe the system, what was found, and the files."""
    written = write_each(request.targets, data=curves, picture=picture)
    return "\n".join([str(request.point.orbit.system), *said]) + common.listed(written)
