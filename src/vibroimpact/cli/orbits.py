"""Command vibroimpact orbits: search for periodic orbits with few impacts."""

from __future__ import annotations

import argparse
from pathlib import Path

from vibroimpact._core.checks import check_target
from vibroimpact.cli import common
from vibroimpact.orbits.search import find_orbits
from vibroimpact.results.files import SUFFIXES as DATA
from vibroimpact.results.files import save

EXAMPLE = (
    "  vibroimpact orbits impact-damper/A --omega 1.2 --cycles 2 --impacts 4 --starts 200 "
    "--out orbits.nc"
)
SEARCH = ("cycles", "impacts", "starts", "seed")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    common.add_system(parser)
    common.add_arguments_of(parser, find_orbits, SEARCH)
    parser.add_argument(
        "--out", type=Path, metavar="FILE",
        help=f"write the data ({', '.join(DATA)}); an existing file is replaced",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> str:
    """Search, write, and list the orbits."""
    out: Path | None = arguments.out
    if out:
        check_target(out, DATA)
    system = common.case_of(arguments).system
    found = find_orbits(system, progress=True, **common.given(arguments, SEARCH))
    if not found.orbits:
        raise common.Failure(f"no periodic orbit was found. {found}")
    if out:
        save(found, out)
    return f"{system}\n{found}\n{found.table()}{common.listed([out] if out else [])}"
