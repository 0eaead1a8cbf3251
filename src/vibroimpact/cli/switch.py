"""Command vibroimpact switch: curves that begin at a point of codimension two."""

from __future__ import annotations

import argparse

from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.switch_curve import switch_curve
from vibroimpact.branches.point import NotFound
from vibroimpact.cli import saved
from vibroimpact.cli.output import Done

EXAMPLE = "  vibroimpact switch curve.nc --at R4_1 --out born.nc --out born.svg"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    saved.add_point(parser, "R1 to R4, GPD, LPPD, PDNS, GR or ZERO with its number, such as R4_1")


def run(arguments: argparse.Namespace) -> Done:
    """Follow the curves."""
    request = saved.request_of(arguments)
    found = saved.followed(request, switch_curve)
    curves = [curve for curve in found if isinstance(curve, BifurcationCurve)]
    missing = [f"{curve!r}." for curve in found if isinstance(curve, NotFound)]
    return Done(
        [request.point.orbit.system, *curves, *missing],
        curves,
        lambda: request.draw([request.curve, *curves]),
    )
