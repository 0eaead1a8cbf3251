"""Command vibroimpact curve: a bifurcation followed in two parameters, and other curves through its points."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vibroimpact._core.checks import check_choice, check_kind, path_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact.bifurcations.continue_bifurcation import continue_bifurcation
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.branches.kinds import ONE
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.cli import common
from vibroimpact.cli.branch import Bounds, add_branch, along_of, branches_of
from vibroimpact.cli.output import Done
from vibroimpact.results.files import NETCDF, read
from vibroimpact.sweeps.execution.store import read_store
from vibroimpact.sweeps.reading import check_dataset

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXAMPLE = (
    "  vibroimpact curve impact-damper/A --branch omega=0.9:1.0 --at NS1 --bounds omega=0.7:1.2 "
    "--bounds half_clearance=3:12 --out curve.nc --out curve.svg"
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_branch(parser, "--branch")
    group = parser.add_argument_group(
        "curve", "From a special point of the branch, or of the last one that was switched to."
    )
    group.add_argument(
        "--at", required=True, metavar="POINT",
        help="the special point: NS1, PD1, SN1, GR1, ..., or BP1 of a symmetric orbit",
    )  # fmt: skip
    common.add_named(
        group, "--bounds", common.RANGE,
        "a parameter and its bounds; two of them, the first for the abscissa. Given once, the second "
        "parameter; the first is then that of the branch, in its bounds", required=True,
    )  # fmt: skip
    group.add_argument(
        "--then", type=_then, action="append", default=[], metavar="POINT=KIND",
        help="follow another curve through a point of codimension two of the last one: R2_1=NS; may be repeated",
    )  # fmt: skip
    add_behind(group)
    common.add_out(parser)


def add_behind(parser: argparse._ActionsContainer) -> None:
    """Add the option for a plane behind the curves."""
    parser.add_argument(
        "--behind", type=Path, metavar="FILE",
        help="draw over this plane of the same parameters, that vibroimpact plane wrote: a .nc file or a store",
    )  # fmt: skip


def _then(text: str) -> tuple[str, str]:
    """Point and kind."""
    point, _, kind = text.partition("=")
    smooth = [one.label for one in ONE.values() if one.critical]
    if not point or kind not in smooth:
        raise argparse.ArgumentTypeError(
            f"{text!r}: must be POINT=KIND, such as R2_1=NS, with a kind {', '.join(smooth)}"
        )
    return point, kind


def run(arguments: argparse.Namespace) -> Done:
    """Follow the curve from the branch, and those through points of the ones before."""
    bounds = _bounds(arguments)
    behind = plane_behind(arguments, tuple(bounds))
    curves = _curves(arguments, bounds)
    system = curves[0].orbit(curves[0].curve.start).system
    return Done(
        [system, *curves],
        curves[-1],
        lambda: _picture(curves, behind),
    )


def _picture(curves: Sequence[BifurcationCurve], behind: Callable[[], Axes] | None) -> Axes:
    from vibroimpact.plotting import plot_curves

    return plot_curves(curves, ax=behind and behind())


def _bounds(arguments: argparse.Namespace) -> Bounds:
    """Names of both parameters with their bounds; the first may be that of the branch."""
    bounds: Bounds = arguments.bounds
    along = along_of(arguments)[1]
    if len(bounds) == 1 and not along.keys() & bounds.keys():
        return along | bounds
    common.check_count("bounds", bounds, 2, common.RANGE)
    return bounds


def _curves(arguments: argparse.Namespace, bounds: Bounds) -> list[BifurcationCurve]:
    point: BifurcationPoint = branches_of(arguments)[-1][arguments.at]
    (first, a), (second, b) = bounds.items()
    curves: list[BifurcationCurve] = []
    for label, kind in [(arguments.at, ""), *arguments.then]:
        if kind:
            check_choice("then", label, [p.label for p in curves[-1].special_points])
            point = curves[-1][label]
        curve = continue_bifurcation(point, (first, second), (a, b), kind=kind)
        common.check_interrupted(curve)
        curves.append(curve)
    return curves


def plane_behind(arguments: argparse.Namespace, names: Sequence[str]) -> Callable[[], Axes] | None:
    """Function that draws the plane of motions of --behind, a file or a store; None without one."""
    if (path := arguments.behind) is None:
        return None
    path = path_of("behind", path)
    if path.suffix.lower() == NETCDF:
        data = read("behind", path)
        check_kind("behind", data, xr.Dataset, "a plane, as vibroimpact plane writes")
    else:
        data = read_store("behind", path)
        check_dataset(data)
    if [*names] != [name for name in data.dims if name in names]:
        raise InvalidParameterError(
            f"behind = {path}: holds {', '.join(map(str, data.dims))}; need a plane of {' and '.join(names)}, in "
            "this order."
        )

    def draw() -> Axes:
        from vibroimpact.plotting import plot_plane

        return plot_plane(data)

    return draw
