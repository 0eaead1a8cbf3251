"""vibroimpact plane: what happens at every point of a plane of two parameters."""

from __future__ import annotations

import argparse

import xarray as xr

from vibroimpact.commands import common, ensemble
from vibroimpact.ensembles.motions import categories
from vibroimpact.ensembles.observers import OBSERVERS
from vibroimpact.ensembles.plane import multistability, plane
from vibroimpact.ensembles.starts import RandomStarts
from vibroimpact.ensembles.sweep import sweep
from vibroimpact.files import write
from vibroimpact.plotting import plot_plane

NAME = "plane"
HELP = "colour a plane of two parameters by symbol, exponent, rotation number, or attractors met"
EXAMPLE = (
    "  vibroimpact plane impact-damper/A --over omega=0.9:1.1:200 --over half_clearance=1:10:200 "
    "--variable lyapunov --out plane.png --out plane.nc"
)
LISTED = 8  # motions that are printed


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    ensemble.add_members(
        parser,
        over="a parameter and its values; two of them, the first across",
        observe="more than symbol and impacts: lyapunov, speeds, ...",
    )
    common.add_arguments_of(parser, sweep, ["follow"])
    common.add_arguments_of(parser, plot_plane, ["variable", "most"])
    ensemble.add_window(parser)


def run(arguments: argparse.Namespace) -> str:
    """Compute, write, and say what occurs."""
    targets = common.targets_of(arguments)
    over = ensemble.over_of(arguments)
    case = ensemble.case_of(arguments, over)
    start, options = ensemble.start_of(arguments, case), ensemble.options_of(arguments)
    looks = common.given(arguments, ["variable", "most"])
    if isinstance(start, RandomStarts):
        found = multistability(case.system, over=over, start=start, **options)
        looks = {"variable": "attractors"} | looks
    else:
        observe = [*ensemble.observed(arguments), *_drawn(arguments)]
        found = plane(case.system, over=over, start=start, observe=observe, **options)
    write(targets, data=lambda: found, picture=lambda: plot_plane(found, **looks))
    lines = [*ensemble.summary(case, over, found), _said(found)]
    return "\n".join(lines) + ensemble.kept(arguments.store) + common.listed(targets)


def _drawn(arguments: argparse.Namespace) -> list[str]:
    """The observer whose number is drawn, so that it need not be named twice."""
    return [arguments.variable] if arguments.variable in OBSERVERS else []


def _said(found: xr.Dataset) -> str:
    """How often each motion, or each number of attractors, occurs."""
    if "attractors" in found:
        counts = found["attractors"].to_series().value_counts().sort_index()
        return "attractors met: " + ", ".join(f"{k} at {n} points" for k, n in counts.items())
    present = sorted(categories(found["motion"]), key=lambda one: -one.members)
    listed = ", ".join(f"{one.words} {one.members}" for one in present[:LISTED])
    return listed + (f", and {len(present) - LISTED} more" if len(present) > LISTED else "")
