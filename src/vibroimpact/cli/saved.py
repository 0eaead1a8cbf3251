"""Parts of the commands that begin at a point of a curve that ``vibroimpact curve`` has written."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from vibroimpact._core.checks import check_choice, check_kind
from vibroimpact.bifurcations.augmented import Both
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.branches.point import BifurcationPoint, NotFound
from vibroimpact.cli import common
from vibroimpact.cli.curve import add_behind, plane_behind
from vibroimpact.results.files import load

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Found = TypeVar("Found")


class Request(NamedTuple):
    """The curve with its point, both bounds, and what draws curves in these bounds or over a plane."""

    curve: BifurcationCurve
    point: BifurcationPoint
    bounds: Both
    draw: Callable[[Sequence[BifurcationCurve]], Axes]


def add_point(parser: argparse.ArgumentParser, example: str) -> None:
    """Add the options for the curve, the point, the bounds, and what is written."""
    parser.add_argument("curve", metavar="CURVE.nc", help="a curve that vibroimpact curve wrote")
    parser.add_argument(
        "--at", required=True, metavar="POINT", help=f"the point of the curve: {example}"
    )
    common.add_named(
        parser, "--bounds", common.RANGE,
        "a parameter of the curve and its bounds; may be given for both (default: the bounds of the "
        "curve). The smaller they are, the sooner the result is there",
    )  # fmt: skip
    add_behind(parser)
    common.add_out(parser)


def request_of(arguments: argparse.Namespace) -> Request:
    """Request of a command, checked before anything is computed."""
    curve, bounds = load(arguments.curve), arguments.bounds
    check_kind("curve", curve, BifurcationCurve, "a file that vibroimpact curve wrote")
    check_choice("at", arguments.at, [point.label for point in curve.special_points])
    common.check_names("bounds", bounds, curve.names)
    known = dict(zip(curve.names, curve.bounds, strict=True)) | bounds
    first, second = (known[name] for name in curve.names)
    behind = plane_behind(arguments, curve.names)

    def draw(curves: Sequence[BifurcationCurve]) -> Axes:
        from vibroimpact.plotting import plot_curves

        return plot_curves(curves, **({"ax": behind()} if behind else {"bounds": (first, second)}))

    return Request(curve, curve[arguments.at], (first, second), draw)


def followed(request: Request, follow: Callable[..., Found | NotFound]) -> Found:
    """Curve that begins at the point; a failure with the reason where nothing does."""
    found = follow(request.point, request.bounds)
    if isinstance(found, NotFound):
        raise common.Failure(f"{found!r}.")
    return found
