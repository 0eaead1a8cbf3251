"""Command vibroimpact tongue: both sides of a tongue of locked motion, from a weak resonance."""

from __future__ import annotations

import argparse
import math

import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.progress import Progress
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.tongue import NoTongue, Tongue, tongue
from vibroimpact.bifurcations.tongue_region import region_of
from vibroimpact.cli import common, saved
from vibroimpact.cli.curve import described
from vibroimpact.cli.output import write_each

EXAMPLE = (
    "  vibroimpact tongue curve.nc --at 2/9_1 --over omega=0.81:0.83 --over half_clearance=7.7:7.8 "
    "--out side.nc --out tongue.svg"
)
WIDTHS = (0.25, 0.5, 0.75, 0.99)  # shares of the way from the tip to where a side ends or turns

SHORTEST = 2  # points of a side


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    saved.add_point(parser, "a weak resonance of a curve of NS, such as 2/9_1")


def run(arguments: argparse.Namespace) -> str:
    """Follow, write, and describe both sides."""
    targets = common.targets_of(arguments)
    curve = saved.curve_of(arguments)
    bounds, behind = saved.bounds_of(arguments, curve), saved.behind_of(arguments, curve)
    progress = Progress(1)
    progress.stage(f"sides of the tongue at {arguments.at}")
    found = tongue(curve[arguments.at], bounds, progress=saved.noted(progress, curve))
    progress.close()
    if isinstance(found, NoTongue):
        raise common.Failure(f"{found!r}.")
    common.check_interrupted(*found.sides)
    if all(len(side) < SHORTEST for side in found.sides):
        raise common.Failure(
            f"{found.tip.label}: the sides were found, but cannot be followed. Give other ranges --over."
        )
    written = write_each(
        targets,
        data=saved.datasets_of(found.sides),
        picture=lambda: _picture(curve, found, bounds, behind),
    )
    p, q = found.resonance
    system = curve[arguments.at].orbit.system
    said = [str(system), f"Tongue {p}/{q} from {found.tip!r}", *map(described, found.sides)]
    return "\n".join([*said, *_widths(found)]) + common.listed(written)


def _picture(
    curve: BifurcationCurve, found: Tongue, bounds: saved.Both, behind: xr.Dataset | None
) -> Axes:
    return found.plot(ax=saved.picture_of([curve], bounds, behind))


def _widths(found: Tongue) -> list[str]:
    """Widths in the first parameter, where the tongue extends along the second."""
    region = region_of(found)
    first, second = found.sides[0].names
    tip = found.tip.parameters[second]
    values = [tip + share * region.reach for share in WIDTHS] if region.axis == 1 else []
    widths = [(value, found.width(value)) for value in values]
    return [
        f"  width in {first} at {second} = {value:.6g}: {width:.6g}"
        for value, width in widths
        if not math.isnan(width)
    ]
