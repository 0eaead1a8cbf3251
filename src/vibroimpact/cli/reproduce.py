"""Command vibroimpact reproduce: a published case, figure by figure and number by number."""

from __future__ import annotations

import argparse
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from vibroimpact._core.errors import BackendUnavailableError, InvalidParameterError

if TYPE_CHECKING:
    from vibroimpact.cli.output import Done

EXAMPLE = "  vibroimpact reproduce impact-damper --out reproduction"
PAPERS = "vibroimpact.papers"  # entry points: a name, and a function of the output folder


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("case", metavar="CASE", help="the publication: impact-damper")
    parser.add_argument(
        "--out", dest="folder", type=Path, required=True, metavar="DIR",
        help="folder for the report: absent, empty, or an earlier report, which is replaced",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> Done:
    """Reproduce the whole case."""
    from vibroimpact.cli.output import Done  # loads matplotlib

    papers = {paper.name: paper for paper in entry_points(group=PAPERS)}
    if not papers:
        raise BackendUnavailableError(
            "case: no publications are installed. They are a package of their own in the folder "
            "papers/ of the repository: run make build there, or pip install ./papers."
        )
    if arguments.case not in papers:
        raise InvalidParameterError(
            f"case = {arguments.case!r}: must be one of {', '.join(sorted(papers))}."
        )
    score = papers[arguments.case].load()(arguments.folder).score
    counted = ", ".join(f"{count} {word.value}" for word, count in score.items())
    return Done([f"verdicts: {counted}", f"wrote {arguments.folder / 'report.html'}"])
