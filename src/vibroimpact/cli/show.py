"""Command vibroimpact show: a machine in words, and its drawing."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

from vibroimpact._core.docstrings import head_of
from vibroimpact.cli import common
from vibroimpact.cli.output import Done
from vibroimpact.machines.machine import Machine, example_of
from vibroimpact.machines.registry import case_named, machine_of
from vibroimpact.results.files import PAGES

EXAMPLE = "  vibroimpact show impact-oscillator --out oscillator.svg"
HEAD = ("parameter", "default", "SI unit", "meaning")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("name", metavar="NAME", help="a machine: vibroimpact machines lists them")
    common.add_out(parser, pages=PAGES, data=())


def run(arguments: argparse.Namespace) -> Done:
    """Describe the machine."""
    from vibroimpact.plotting.gallery import gallery
    from vibroimpact.plotting.mechanism import plot_mechanism

    name, _ = case_named(arguments.name)
    machine = machine_of(name)
    return Done(
        [*_said(name, machine)],
        picture=lambda: plot_mechanism(example_of(machine)),
        page=lambda: gallery([name]),
    )


def _said(name: str, machine: type[Machine]) -> Iterator[str]:
    """What is printed, part by part."""
    from vibroimpact.plotting.gallery import commands_of, equations_of, parameter_rows

    yield f"{name}: {head_of(machine)}.\n\n{equations_of(machine)}\n"
    yield from _columns([HEAD, *parameter_rows(machine)])
    yield f"\nin Python: vi.machines.{machine.__name__}; in a file: [{name}], or [{name}.physical] in SI units"
    yield f"source: {machine.source}\n\n{commands_of(machine)}"


def _columns(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Rows of a table below each other."""
    widths = [max(map(len, column)) + 2 for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (f"{text:{width}}" for text, width in zip(row, widths, strict=True))
        yield "".join(cells).rstrip()
