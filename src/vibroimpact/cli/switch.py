"""Command vibroimpact switch: curves of other orbits that begin at a point of codimension two."""

from __future__ import annotations

import argparse

from vibroimpact._core.progress import Progress
from vibroimpact.bifurcations.switch_curve import NoCurve, switch_curve
from vibroimpact.cli import common, saved
from vibroimpact.cli.curve import described
from vibroimpact.cli.output import write_each

EXAMPLE = "  vibroimpact switch curve.nc --at R4_1 --out born.nc --out born.svg"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    saved.add_point(parser, "R1 to R4, GPD, LPPD or PDNS with its number, such as R4_1")


def run(arguments: argparse.Namespace) -> str:
    """Follow, write, and describe the curves."""
    targets = common.targets_of(arguments)
    curve = saved.curve_of(arguments)
    bounds, behind = saved.bounds_of(arguments, curve), saved.behind_of(arguments, curve)
    progress = Progress(1)
    progress.stage(f"curves from {arguments.at}")
    found = switch_curve(curve[arguments.at], bounds, progress=saved.noted(progress, curve))
    progress.close()
    if isinstance(found, NoCurve):
        raise common.Failure(f"{found!r}.")
    common.check_interrupted(*found)
    written = write_each(
        targets,
        data=saved.datasets_of(found),
        picture=lambda: saved.picture_of([curve, *found], bounds, behind),
    )
    system = curve[arguments.at].orbit.system
    return "\n".join([str(system), *map(described, found)]) + common.listed(written)
