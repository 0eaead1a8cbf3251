"""Report of a design for readers who do not know the field: one HTML page, the response included."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from os import PathLike

from vibroimpact import _kernel
from vibroimpact._core.checks import check_kind, path_of
from vibroimpact._core.files import check_target, write_files
from vibroimpact.design.optimise import Design
from vibroimpact.machines.units import units_of
from vibroimpact.plotting.machine_table import parameter_words
from vibroimpact.plotting.page import Block, Items, Page, Picture, Section, Symbol, Table, Text
from vibroimpact.plotting.report import (
    in_brief,
    limits,
    machine_section,
    machine_words,
    motion_section,
    picture_of,
    repeat_section,
    response_section,
    table_of_answers,
)
from vibroimpact.plotting.words import number
from vibroimpact.response.response import Response
from vibroimpact.results.files import PAGES


def design_report(best: Design, response: Response, *, title: str = "", command: str = "") -> str:
    """Write a report of a design as the text of one HTML page.

    Parameters
    ----------
    best
        A result of :func:`vibroimpact.optimise`.
    response
        The frequency response of its machine.
    title
        Heading of the page; by default the machine.
    command
        The command that repeats the report, which the page states.

    Returns
    -------
    str
        HTML with the pictures inside.
    """
    page = Page(
        title or f"The best {machine_words(best.system)}",
        [Text([*_in_brief(best), *in_brief(response)], brief=True)],
        [
            Section("The best machine", machine_section(response)),
            Section("Before and after", [_before_and_after(best)]),
            Section("How sensitive it is", [_sensitivities(best)]),
            Section("The response", response_section(response, (), decibel=False)),
            Section("Kinds of motion", motion_section(response)),
            Section("At a few places", [table_of_answers(response)]),
            Section("What this statement rests on", [Items([*_limits(best), *limits(response)])]),
            Section("To repeat it", repeat_section(response, command)),
        ],
        f"Made by vibroimpact {_kernel.version()}.",
    )
    return page.__html__()


def write_report(
    best: Design, response: Callable[[], Response], path: str | PathLike[str], *, title: str = ""
) -> None:
    """Write a report to a file; see :meth:`Design.report`. The response is computed where the name can be written."""
    target = path_of("path", path)
    check_target(target, PAGES, "path")
    check_kind("title", title, str, "a text")
    text = design_report(best, response(), title=title)
    write_files({target: text.encode()})


def _in_brief(best: Design) -> Iterator[str]:
    """The parameters, and what they gain."""
    units = units_of(best.system)
    listed = ", ".join(
        f"{parameter_words(name, units)[0]} {number(value, best.units[name])}"
        for name, value in best.parameters.items()
    )
    yield f"Best of {best.machines} machines: {listed}."
    for name, end in best.at_bounds.items():
        yield (
            f"The {parameter_words(name, units)[0]} is at its {end} bound: beyond it there may be better "
            "machines."
        )
    if math.isfinite(best.reduction_db):
        yield (
            f"The {best.label} is {number(best.value, best.units[''])}, {best.reduction_db:.3g} dB better than "
            "with all stops open, as verified with more values of the band and other starts than those of the "
            f"search, in which it was {number(best.searched, best.units[''])}."
        )


def _before_and_after(best: Design) -> Block:
    return Picture(
        picture_of(best.plot()),
        "The best machine beside the given one with all its stops open, as verified.",
        "The response before and after",
    )


def _sensitivities(best: Design) -> Block:
    """Table of the parameters: best value, derivative of the objective, range within 1 dB."""
    units, rows = units_of(best.system), []
    for name, value in best.parameters.items():
        words, symbol = parameter_words(name, units)
        low, high, at_bounds = best.robust()[name]
        unit = best.units[name]
        ends = [
            f"{number(x, unit)}{' (bound)' if at else ''}"
            for x, at in zip((low, high), at_bounds, strict=True)
        ]
        slope = f"{best.sensitivity[name].value:.3g}"
        at = f" ({best.at_bounds[name]} bound)" if name in best.at_bounds else ""
        rows.append((words, Symbol(symbol), number(value, unit) + at, slope, " to ".join(ends)))
    kind = "exact" if best.sensitivity_exact else "by differences"
    up = f" in {best.units['']}" if best.units[""] else ""
    caption = (
        f"By how much the {best.label} changes{up} per unit of a parameter ({kind}), and how far each "
        "may stray, the others at their best, until 1 dB is lost."
    )
    return Table(("parameter", "symbol", "best", "derivative", "within 1 dB"), rows, caption)


def _limits(best: Design) -> Iterator[str]:
    """Section of what the search did."""
    first, last = best.search.judges[0].objective, best.objective
    yield (
        f"A search of {best.machines} machines ({best.why_stopped}): each at {first.points} values of the "
        f"band from {first.starts} starts, {first.periods:g} forcing periods after {first.settle_periods:g}; "
        f"verified at {last.points} values from {last.starts} starts. "
        "Another seed may find another machine that is as good."
    )
