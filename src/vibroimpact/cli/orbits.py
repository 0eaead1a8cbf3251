"""Command vibroimpact orbits: search for periodic orbits with few impacts."""

from __future__ import annotations

import argparse

from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.orbits.search import find_orbits

EXAMPLE = (
    "  vibroimpact orbits impact-damper/A --omega 1.2 --most-cycles 2 --most-impacts 4 --starts 200 "
    "--out orbits.nc"
)
SEARCH = ("most_cycles", "most_impacts", "starts", "seed")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_arguments_of(parser, find_orbits, SEARCH)
    common.add_out(parser, pictures=())


def run(arguments: argparse.Namespace) -> Done:
    """Search for orbits."""
    system = common.case_of(arguments).system
    found = find_orbits(system, **common.given(arguments, SEARCH))
    if not found.orbits:
        raise common.Failure(f"no periodic orbit was found. {found!r}")
    return Done([system, found], found)
