"""Command vibroimpact tongue: both sides of a tongue of locked motion, from a weak resonance."""

from __future__ import annotations

import argparse
import math

from vibroimpact.bifurcations.tongue import Tongue, tongue
from vibroimpact.bifurcations.tongue_region import region_of
from vibroimpact.cli import common, saved
from vibroimpact.cli.output import Done

EXAMPLE = (
    "  vibroimpact tongue curve.nc --at 2/9_1 --bounds omega=0.81:0.83 --bounds half_clearance=7.7:7.8 "
    "--out side.nc --out tongue.svg"
)
# Widths are told at these shares of the way from the tip to where a side ends or turns.
WIDTH_SHARES = (0.25, 0.5, 0.75, 0.99)
FEWEST_SIDE_POINTS = 2  # a side has so many points at least


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    saved.add_point(parser, "a weak resonance of a curve of NS, such as 2/9_1")


def run(arguments: argparse.Namespace) -> Done:
    """Follow both sides."""
    request = saved.request_of(arguments)
    found = saved.followed(request, tongue)
    common.check_interrupted(*found.sides)
    if all(len(side) < FEWEST_SIDE_POINTS for side in found.sides):
        raise common.Failure(
            f"{found.tip.label}: the sides were found, but cannot be followed. Give other --bounds."
        )
    p, q = found.resonance
    said = [f"Tongue {p}/{q} from {found.tip!r}", *found.sides, *_widths(found)]
    return Done(
        [request.point.orbit.system, *said],
        found.sides,
        lambda: found.plot(ax=request.draw([request.curve])),
    )


def _widths(found: Tongue) -> list[str]:
    """Widths in the first parameter, where the tongue extends along the second."""
    region = region_of(found)
    first, second = found.sides[0].names
    tip = found.tip.parameters[second]
    values = [tip + share * region.reach for share in WIDTH_SHARES] if region.axis == 1 else []
    widths = [(value, found.width(value)) for value in values]
    return [
        f"  width in {first} at {second} = {value:.6g}: {width:.6g}"
        for value, width in widths
        if not math.isnan(width)
    ]
