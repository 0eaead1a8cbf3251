"""vibroimpact reproduce: a published case, figure by figure and number by number."""

from __future__ import annotations

import argparse
from pathlib import Path

from vibroimpact.errors import InvalidParameterError

NAME = "reproduce"
HELP = "redo every figure and number of a publication, with a verdict on each"
EXAMPLE = "  vibroimpact reproduce impact-damper --out reproduction"
CASES = ("impact-damper",)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("case", metavar="CASE", help=f"which one: {', '.join(CASES)}")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR",
        help="folder for the report: absent, empty, or an earlier report, which is replaced",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> str:
    """Do the whole case."""
    if arguments.case not in CASES:
        raise InvalidParameterError(
            f"case = {arguments.case!r}: must be one of {', '.join(CASES)}."
        )
    from vibroimpact.literature.impact_damper.reproduce import reproduce

    score = reproduce(arguments.out).score
    counted = ", ".join(f"{count} {word.value}" for word, count in score.items())
    return f"verdicts: {counted}\nwrote {arguments.out / 'report.html'}"
