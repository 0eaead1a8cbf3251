"""Command vibroimpact curve: a bifurcation followed in two parameters, and other curves through its points."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_choice, path_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.bifurcations.continue_bifurcation import continue_bifurcation
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint
from vibroimpact.branches.branch import BifurcationPoint
from vibroimpact.cli import common
from vibroimpact.cli.branch import add_branch, branches_of
from vibroimpact.cli.members import RANGE, ranges_of
from vibroimpact.cli.output import write
from vibroimpact.normal_forms import Refusal
from vibroimpact.plotting import plot_curves, plot_plane

EXAMPLE = (
    "  vibroimpact curve impact-damper/A --range 0.9 1.0 --at NS1 --over omega=0.7:1.2 "
    "--over half_clearance=3:12 --out curve.nc --out curve.svg"
)
WITH_COEFFICIENTS = ("CP", "GPD", "CH", "R1", "R2", "R3", "R4", "LPPD", "LPNS", "PDNS", "NSNS")
PLANES = (".nc", ".zarr")

Bounds = dict[str, tuple[float, float]]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_branch(parser)
    group = parser.add_argument_group(
        "curve", "From a special point of the branch, or of the last one that was switched to."
    )
    group.add_argument(
        "--at", required=True, metavar="POINT",
        help="the special point: NS1, PD1, SN1, GR1, ..., or BP1 of a symmetric orbit",
    )  # fmt: skip
    group.add_argument(
        "--over", action="append", required=True, metavar=RANGE,
        help="a parameter and its range; two of them, the first for the abscissa. Given once, the second "
        "parameter; the first is then that of the branch, in its range",
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
    if not point or kind not in ("SN", "PD", "BP", "NS"):
        raise argparse.ArgumentTypeError(
            f"{text!r}: must be POINT=KIND, such as R2_1=NS, with a kind SN, PD, BP or NS"
        )
    return point, kind


def run(arguments: argparse.Namespace) -> str:
    """Follow, write, and describe the curves."""
    targets = common.targets_of(arguments)
    bounds = _bounds(arguments)
    behind = None if arguments.behind is None else plane_in(arguments.behind, tuple(bounds))
    curves = _curves(arguments, bounds)
    write(targets, data=curves[-1], picture=lambda: _picture(curves, behind))
    system = curves[0].orbit(curves[0].curve.start).system
    return "\n".join([str(system), *map(described, curves)]) + common.listed(targets)


def _bounds(arguments: argparse.Namespace) -> Bounds:
    """Both parameters with their ranges; the first may be that of the branch."""
    over = ranges_of(arguments.over, "over")
    if len(over) == 1 and arguments.parameter not in over:
        low, high = arguments.range
        return {arguments.parameter: (low, high), **over}
    if len(over) != 2:
        raise InvalidParameterError(
            f"over = {', '.join(over)}: give --over {RANGE} twice, with two parameters; or once, with another "
            f"parameter than {arguments.parameter} of the branch."
        )
    return over


def _curves(arguments: argparse.Namespace, bounds: Bounds) -> list[BifurcationCurve]:
    """The curve from the branch, and those through points of the ones before."""
    point: BifurcationPoint | CodimensionTwoPoint = branches_of(arguments)[-1][arguments.at]
    curves: list[BifurcationCurve] = []
    for label, kind in [(arguments.at, ""), *arguments.then]:
        if kind:
            check_choice("then", label, [p.label for p in curves[-1].special_points])
            point = curves[-1][label]
        (first, a), (second, b) = bounds.items()
        curves.append(
            continue_bifurcation(point, (first, second), (a, b), kind=kind, progress=True)
        )
        common.check_interrupted(curves[-1])
    return curves


# ---- the picture ---------------------------------------------------------------------------------


def plane_in(path: Path, names: Sequence[str]) -> xr.Dataset:
    """Plane of motions of a file or a store."""
    path_of("behind", path)
    try:
        store = path.suffix.lower() != PLANES[0]
        data = xr.open_zarr(path) if store else xr.open_dataset(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise InvalidParameterError(f"behind = {path}: cannot be read ({error}).") from error
    if [*names] != [name for name in data.dims if name in names]:
        raise InvalidParameterError(
            f"behind = {path}: holds {', '.join(map(str, data.dims))}; need a plane of {' and '.join(names)}, in "
            "this order."
        )
    return data


def _picture(curves: Sequence[BifurcationCurve], behind: xr.Dataset | None) -> Axes:
    return plot_curves(curves, ax=None if behind is None else plot_plane(behind))


# ---- the words -----------------------------------------------------------------------------------


def described(curve: BifurcationCurve) -> str:
    """Description of a curve, with the coefficients at its points."""
    points = [line for point in curve.special_points for line in _coefficients(point)]
    parts = [
        f"  {part.name} is not resolved from point {part.first} to {part.last}: {part.reason}"
        for part in curve.curve.unresolved
    ]
    return "\n".join([repr(curve), *points, *parts])


def _coefficients(point: CodimensionTwoPoint) -> list[str]:
    """Coefficients and what is born, or why there are none; weak resonances and touches have none."""
    form = point.normal_form
    if isinstance(form, Refusal):
        none = point.kind not in WITH_COEFFICIENTS
        return [] if none else [f"{point.label}: {form.reason}"]
    shown = [f"{name} = {_number(value)}" for name, value in form.numbers.items()]
    return [f"{point.label}: {', '.join(shown)}", f"  {form.meaning}"]


def _number(value: Any) -> str:
    """A number, several, or the words that stand in its place."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_number, value))})"
    if isinstance(value, complex):
        return f"{value.real:.12g}{value.imag:+.12g}j"
    return f"{value:.12g}" if isinstance(value, float) else str(value)
