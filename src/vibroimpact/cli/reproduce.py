"""Command vibroimpact reproduce: published cases, statement by statement, with figures and verdicts."""

from __future__ import annotations

import argparse
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING

from vibroimpact._core.errors import BackendUnavailableError, InvalidParameterError

if TYPE_CHECKING:
    from vibroimpact.cli.output import Done

EXAMPLE = "  vibroimpact reproduce bouncing-ball --out reproduction"
PAPERS = "vibroimpact.papers"  # entry points: a name, and an object with a title and a function reproduce


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "cases", metavar="CASE", nargs="*",
        help="publications, by name; all for every one. Without a name they are listed",
    )  # fmt: skip
    parser.add_argument(
        "--out", dest="folder", type=Path, metavar="DIR",
        help="folder for the report: absent, empty, or an earlier report, which is replaced; of several "
        "publications it "
        "has a folder for each",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> Done:
    """Reproduce the whole of each case."""
    from vibroimpact.cli.output import Done  # loads matplotlib

    papers = {paper.name: paper for paper in entry_points(group=PAPERS)}
    if not papers:
        raise BackendUnavailableError(
            "case: no publications are installed. They are a package of their own in the folder "
            "papers/ of the repository: run make build there, or pip install ./papers."
        )
    names = sorted(papers) if arguments.cases == ["all"] else arguments.cases
    for name in names:
        if name not in papers:
            raise InvalidParameterError(
                f"case = {name!r}: must be all, or of {', '.join(sorted(papers))}."
            )
    if not names:
        width = max(map(len, papers)) + 2
        lines = (f"{name:{width}}{papers[name].load().title}" for name in sorted(papers))
        return Done([*lines, "", "vibroimpact reproduce NAME --out DIR judges its statements."])
    if arguments.folder is None:
        raise InvalidParameterError("out: missing. Give --out, a folder for the report.")
    if len(names) == 1:
        return Done([*_one(papers[names[0]], arguments.folder)])
    if arguments.folder.exists() and not arguments.folder.is_dir():
        raise InvalidParameterError(f"out = {arguments.folder}: is not a folder. Name another.")
    arguments.folder.mkdir(exist_ok=True)
    return Done([line for name in names for line in _one(papers[name], arguments.folder / name)])


def _one(paper: EntryPoint, folder: Path) -> list[str]:
    """Reproduce one publication; what is printed of it."""
    score = paper.load().reproduce(folder).score
    counted = ", ".join(f"{count} {word.value}" for word, count in score.items())
    return [f"{paper.name}: {counted}", f"wrote {folder / 'report.html'}"]
