"""Command vibroimpact classify: the attractor on which a motion settles."""

from __future__ import annotations

import argparse

from vibroimpact.attractors.classify import classify
from vibroimpact.cli import common
from vibroimpact.cli.output import Done

EXAMPLE = "  vibroimpact classify impact-damper/A --omega 1.0 --out section.svg"
POINTS = ("at", "settle_events", "points")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_start(parser, at_orbit=False)
    common.add_arguments_of(parser, classify, POINTS)
    common.add_out(parser)


def run(arguments: argparse.Namespace) -> Done:
    """Classify the attractor."""
    case = common.case_of(arguments)
    found = classify(
        case.system, common.start_of(arguments, case), **common.given(arguments, POINTS)
    )
    return Done([case.system, found], found, found.plot)
