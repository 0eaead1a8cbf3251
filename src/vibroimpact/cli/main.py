"""The command ``vibroimpact``: parse, call one public function, write files.

Exit status: 0 done, 1 numerical failure (the reason in a sentence), 2 misuse (value, what is
allowed, what to do), 130 interrupted, 141 nobody reads what is printed. Nothing is left half-written in any case.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn, TextIO

from vibroimpact._core.errors import InvalidParameterError, VibroImpactError, printable
from vibroimpact._core.words import OF_ARGUMENTS, OF_COMMANDS, meant

DONE, FAILED, MISUSE, INTERRUPTED = 0, 1, 2, 130
PIPE_CLOSED = 141  # as of a program that the signal of a broken pipe ends
COMMANDS = {  # a file of this folder each
    "machines": "list the machines of the catalogue, with a gallery of their pictures",
    "show": "show a machine: equations, parameters, units, defaults, source, and what to try",
    "reproduce": "judge the statements of publications, figure by figure and number by number",
    "explore": "open a machine in the browser: it moves, with sliders, sections, diagrams, planes",
    "simulate": "simulate a motion and record every impact",
    "classify": "say on what a motion settles: periodic, quasiperiodic or chaotic, with its exponent",
    "lyapunov": "estimate the largest Lyapunov exponent of a motion, or all of them",
    "orbit": "find a periodic orbit, with multipliers and stability; of a damper the symmetric ones",
    "orbits": "list the periodic orbits with few impacts, stable or not, that a search finds",
    "branch": "follow a branch of periodic orbits in a parameter, with all bifurcations on it",
    "normal-form": "compute the normal form at a bifurcation of a periodic orbit",
    "curve": "follow a bifurcation in two parameters, with all points of codimension two on it",
    "atlas": "follow all curves of bifurcations that can be reached from an orbit, in two parameters",
    "switch": "follow the curves that begin at a point of a saved curve, on other orbits",
    "tongue": "follow both sides of a tongue of locked motion from a weak resonance of a saved curve",
    "circle": "find the invariant circle on which a motion settles, and follow it in a parameter",
    "section": "record states after impacts at one stop, once per forcing period, or at changes of an element",
    "sweep": "observe many motions over any parameters, in memory or in a store that resumes",
    "diagram": "draw a bifurcation diagram by brute force, followed up and down or from random starts",
    "plane": "colour a plane of two parameters by symbol, exponent, rotation number, or attractors met",
    "response": "find how large a machine vibrates over a band of frequencies, with a report",
    "design": "find the parameters of a machine that are best over a band, with a report",
    "basins": "find the attractors from a grid of starts, and their basins",
}
DOWNWARDS = re.compile(r"-[^-]")  # values of --follow that argparse would take for options
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
    os.environ["MPLBACKEND"] = "agg"  # pictures go to files: any other might be missing here
    words = _joined(sys.argv[1:] if argv is None else argv)
    arguments = argparse.Namespace(words=words)  # a report states its command
    return _flushed(_ran(words, arguments))


def _ran(words: list[str], arguments: argparse.Namespace) -> int:
    """Run the command line; an error is a sentence on standard error."""
    try:
        if not sys.stdout:
            raise VibroImpactError("standard output is closed. Nothing was computed.")
        parser().parse_args(words, arguments)
        with warnings.catch_warnings():
            warnings.showwarning = _warned(set())
            sys.stdout.write(_done(arguments))
    except SystemExit as stop:  # argparse: help, version, misuse
        return stop.code if isinstance(stop.code, int) else MISUSE
    except InvalidParameterError as error:
        return _report(str(error), MISUSE)
    except VibroImpactError as error:
        return _report(str(error), FAILED)
    except MemoryError:
        return _report(f"the memory is full; {_left(arguments)} Compute less at once.", FAILED)
    except KeyboardInterrupt as stop:
        return _report(str(stop) or f"interrupted; {_left(arguments)}", INTERRUPTED)
    except BrokenPipeError:
        return PIPE_CLOSED
    except OSError as error:
        return _report(f"cannot write ({error.strerror or error}).", FAILED)
    return DONE


def _warned(said: set[str]) -> Callable[..., None]:
    """How warnings are shown: each as a sentence on standard error, once."""

    def show(message: Warning | str, *_: object) -> None:
        if str(message) not in said:
            _report(str(message), DONE)
            said.add(str(message))

    return show


def _flushed(status: int) -> int:
    """Status, when all is printed; what cannot be is dropped, and a full disk is a failure."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except BrokenPipeError:
            _dropped(stream)
            status = status or PIPE_CLOSED
        except OSError as error:
            _dropped(stream)
            if stream is sys.stdout:
                status = status or _report(f"cannot write ({error.strerror}).", FAILED)
    return status


def _dropped(stream: TextIO) -> None:
    """Let what is left in a stream go nowhere: Python would try again at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def _done(arguments: argparse.Namespace) -> str:
    """Run a command, write its files, and return what it prints."""
    from vibroimpact._core.checks import path_of  # loads numpy
    from vibroimpact._core.files import check_target
    from vibroimpact.cli.common import check_interrupted
    from vibroimpact.cli.output import write

    arguments.out = [path_of("out", one) for one in arguments.out]
    for i, path in enumerate(arguments.out):
        check_target(path, arguments.suffixes)
        if os.path.realpath(path) in map(os.path.realpath, arguments.out[:i]):
            raise InvalidParameterError(f"out = {path}: is given twice. Name each file once.")
    done = arguments.run(arguments)
    check_interrupted(*done.said)
    said = _encodable("".join(f"{one}\n" for one in done.said))
    written = write(arguments.out, done, getattr(arguments, "columns", None))
    return said + (_encodable(f"wrote {', '.join(map(str, written))}\n") if written else "")


def _encodable(text: str) -> str:
    """Text that standard output can show, with escapes for what it cannot."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    return printable(text).encode(encoding, "backslashreplace").decode(encoding)


def parser() -> argparse.ArgumentParser:
    """Parser of the whole command line; a command is imported when it is parsed."""
    top = _Top(
        prog="vibroimpact",
        description="Exact simulation and analysis of vibro-impact mechanisms.",
        epilog="exit status: 0 done, 1 numerical failure, 2 misuse, 130 interrupted",
        allow_abbrev=False,
    )
    top.add_argument("--version", action=_Version, nargs=0, help="the version of the package")
    commands = top.add_subparsers(metavar="COMMAND", required=True, parser_class=_Command)
    for name, text in COMMANDS.items():
        commands.add_parser(
            name,
            help=text,
            description=f"{text[0].upper()}{text[1:]}.",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
    return top


def module_of(command: str) -> Any:
    """Module of a command: EXAMPLE, add_options, run."""
    return import_module(f"vibroimpact.cli.{command.replace('-', '_')}")


class _Parser(argparse.ArgumentParser):
    """Parser that ends with one line where an argument is wrong."""

    def error(self, message: str) -> NoReturn:
        """End with one line."""
        self.exit(_report(message, MISUSE))


class _Top(_Parser):
    """Parser of the command."""

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse; a word that is no command is refused."""
        words = list(args or ())
        if words and not words[0].startswith("-") and words[0] not in COMMANDS:
            near = meant(words[0], COMMANDS, OF_COMMANDS)
            self.error(f"{words[0]}: is no command.{near} {self.prog} --help lists them.")
        return super().parse_known_args(words, namespace)


class _Command(_Parser):
    """Parser of a command, with options that depend on the machine."""

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse with the options of the machine; unknown options are refused."""
        words = list(args or ())
        self._complete(words)
        self._check_options(words)
        return super().parse_known_args(words, namespace)

    def _check_options(self, words: Sequence[str]) -> None:
        """Refuse an option that is not known, before those that are missing and after a machine that is not known."""
        known = [one for one in self._option_string_actions if one.startswith("--")]
        given = [word.partition("=")[0] for word in words if word.startswith("--")]
        unknown = next((one for one in given if one not in known), None)
        if unknown is None:
            return
        if (check := self.get_default("check")) and not words[0].startswith("-"):
            check(argparse.Namespace(case=words[0], machine=self.get_default("machine")))
        same = {_option(one): tuple(map(_option, names)) for one, names in OF_ARGUMENTS.items()}
        near = meant(unknown, known, same)
        self.error(f"{unknown}: is no option of {self.prog}.{near} {self.prog} --help lists them.")

    def _complete(self, words: Sequence[str]) -> None:
        if self.epilog:
            return
        from vibroimpact.cli.machine_words import machine_in_words  # loads numpy

        module = module_of((self.prog or "").split()[-1])
        self.epilog = f"example:\n{module.EXAMPLE}"
        self._negative_number_matcher = NEGATIVE_NUMBER
        self.set_defaults(run=module.run, machine=machine_in_words(words), out=[])
        module.add_options(self)


def _option(name: str) -> str:
    """Name of an option from that of a parameter."""
    return "--" + name.replace("_", "-")


class _Version(argparse.Action):
    """Option that prints the version, for which alone the kernel is loaded."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        version = import_module("vibroimpact").__version__
        sys.stdout.write(f"vibroimpact {version}\n")
        parser.exit()


def _joined(argv: Sequence[str]) -> list[str]:
    """Arguments with ``--follow -omega`` as one word, ``--follow=-omega``."""
    words: list[str] = []
    for word in argv:
        if words and words[-1] == "--follow" and DOWNWARDS.match(word):
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


def _left(arguments: argparse.Namespace) -> str:
    """What a command that did not come to its end has left: a store, pictures, or nothing."""
    store = getattr(arguments, "store", None)
    if store and Path(store).expanduser().exists():
        return f"no file was written. {store} is kept; the same command continues it."
    if pictures := getattr(arguments, "drawn", ()):
        return f"{', '.join(map(str, pictures))}: what was found until then. No other file was written."
    return "nothing was written."


def _report(message: str, status: int) -> int:
    if sys.stderr:
        encoding = getattr(sys.stderr, "encoding", None) or "utf-8"
        text = f"vibroimpact: {message}\n".encode(encoding, "backslashreplace").decode(encoding)
        with suppress(OSError):
            sys.stderr.write(text)
    return status


if __name__ == "__main__":
    sys.exit(main())
