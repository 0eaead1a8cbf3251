"""Command vibroimpact machines: the catalogue, one line each, and a gallery of pictures."""

from __future__ import annotations

import argparse

from vibroimpact._core.docstrings import head_of
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.machines.registry import MACHINES, machine_of
from vibroimpact.results.files import PAGES

EXAMPLE = "  vibroimpact machines --out gallery.html"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_out(parser, (), PAGES, ())


def run(_: argparse.Namespace) -> Done:
    """List the machines."""
    width = max(map(len, MACHINES)) + 2
    lines = [f"{name:{width}}{head_of(machine_of(name))}" for name in MACHINES]
    more = "vibroimpact show NAME has equations, parameters, units, source, and what to try."
    return Done([*lines, "", more], page=_page)


def _page() -> str:
    from vibroimpact.plotting.gallery import gallery  # loads matplotlib

    return gallery([*MACHINES])
