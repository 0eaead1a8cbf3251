"""Command vibroimpact switch: curves that begin at a point of codimension two."""

from __future__ import annotations

import argparse

from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.switch_curve import NoCurve, switch_curve
from vibroimpact.cli import common, saved
from vibroimpact.cli.curve import described

EXAMPLE = "  vibroimpact switch curve.nc --at R4_1 --out born.nc --out born.svg"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    saved.add_point(parser, "R1 to R4, GPD, LPPD, PDNS, GR or ZERO with its number, such as R4_1")


def run(arguments: argparse.Namespace) -> str:
    """Follow, write, and describe the curves."""
    request = saved.request_of(arguments)
    found = saved.followed(request, switch_curve)
    curves = [curve for curve in found if isinstance(curve, BifurcationCurve)]
    common.check_interrupted(*curves)
    missing = [f"{curve!r}." for curve in found if isinstance(curve, NoCurve)]
    return saved.report(
        request, [*map(described, curves), *missing], curves,
        picture=lambda: saved.picture_of(request, [request.curve, *curves]),
    )  # fmt: skip
