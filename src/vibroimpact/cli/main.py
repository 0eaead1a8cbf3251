"""The command ``vibroimpact``: parse, call one public function, write files.

Exit status: 0 done, 1 numerical failure (the reason in a sentence), 2 misuse (value, what is
allowed, what to do), 130 interrupted. Nothing is left half-written in any case.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from vibroimpact import __version__
from vibroimpact._core.errors import InvalidParameterError, VibroImpactError
from vibroimpact.cli import (
    basins,
    branch,
    diagram,
    normal_form,
    orbit,
    orbits,
    plane,
    reproduce,
    section,
    simulate,
    sweep,
)
from vibroimpact.cli.common import Failure

DONE, FAILED, MISUSE, INTERRUPTED = 0, 1, 2, 130
COMMANDS = (
    reproduce, simulate, orbit, orbits, branch, normal_form, section, sweep, diagram, plane, basins,
)  # fmt: skip
DOWNWARDS = re.compile(r"-[^-]")  # what --follow takes, and argparse would take for options
NEGATIVE_NUMBER = re.compile(r"-\.?\d")  # argparse before 3.14 takes -1e-3 for an option


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv
        Arguments without the program's name; those of the process if not given.

    Returns
    -------
    int
        The exit status.
    """
    arguments = argparse.Namespace()
    try:
        arguments = parser().parse_args(_joined(sys.argv[1:] if argv is None else argv))
        sys.stdout.write(arguments.run(arguments) + "\n")
    except SystemExit as stop:  # argparse: help, version, misuse
        return stop.code if isinstance(stop.code, int) else MISUSE
    except InvalidParameterError as error:
        return _told(str(error), MISUSE)
    except (Failure, VibroImpactError) as error:
        return _told(str(error), FAILED)
    except KeyboardInterrupt as stop:
        return _told(str(stop) or _interrupted(arguments), INTERRUPTED)
    return DONE


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    top = argparse.ArgumentParser(
        prog="vibroimpact",
        description="Exact simulation and analysis of vibro-impact mechanisms.",
        epilog="exit status: 0 done, 1 numerical failure, 2 misuse, 130 interrupted",
        allow_abbrev=False,
    )
    top.add_argument("--version", action="version", version=f"vibroimpact {__version__}")
    commands = top.add_subparsers(metavar="COMMAND", required=True)
    for command in COMMANDS:
        child = commands.add_parser(
            command.NAME,
            help=command.HELP,
            description=f"{command.HELP[0].upper()}{command.HELP[1:]}.",
            epilog=f"example:\n{command.EXAMPLE}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        child._negative_number_matcher = NEGATIVE_NUMBER
        command.add_options(child)
        child.set_defaults(run=command.run)
    return top


def _joined(argv: Sequence[str]) -> list[str]:
    """Arguments with ``--follow -omega`` as one word, ``--follow=-omega``."""
    words: list[str] = []
    for word in argv:
        if words and words[-1] == "--follow" and DOWNWARDS.match(word):
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


def _interrupted(arguments: argparse.Namespace) -> str:
    """What is left where an interruption brings no words of its own."""
    store = getattr(arguments, "store", None)
    if store and Path(store).exists():
        return f"interrupted; no file was written. {store} is kept; the same command goes on."
    return "interrupted; nothing was written."


def _told(message: str, status: int) -> int:
    sys.stderr.write(f"vibroimpact: {message}\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
