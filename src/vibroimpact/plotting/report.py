"""Report of a frequency response for readers who do not know the field: one HTML page.

Every section is a function of the response, so that other reports can take it.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Collection, Iterator, Sequence
from os import PathLike

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from vibroimpact import _kernel
from vibroimpact._core.checks import check_flag, check_kind, path_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import check_target, write_files
from vibroimpact.machines.registry import name_of
from vibroimpact.machines.units import units_of
from vibroimpact.measures.measure import Rms, coefficients_of
from vibroimpact.model.parameters import names_of
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.stability import Stability
from vibroimpact.plotting import style
from vibroimpact.plotting.machine_table import Varied, machine_table, parameter_words, units_text
from vibroimpact.plotting.mechanism import has_numbers, plot_mechanism
from vibroimpact.plotting.page import Block, Code, Items, Page, Picture, Section, Table, Text
from vibroimpact.plotting.response import plot_response
from vibroimpact.plotting.words import KINDS, kind_of, motion_in_words, number, place_of, value_of
from vibroimpact.response.answers import Answer
from vibroimpact.response.compare import (
    decibels,
    is_comparable,
    measured_beside,
    primary_of,
    touching_factor,
    worst_of_comparison,
)
from vibroimpact.response.response import Response
from vibroimpact.results.files import PAGES

PLAIN = "Numbers are in the units in which the machine was given."
TABLE_VALUES = 5  # the table of answers has so many values of the parameter
MOST_CELL_NAMES = 8  # a cell lists so many names of motions at most
MOST_CELL_STRETCHES = 3  # a cell lists so many stretches of the parameter at most
SAME_RELATIVE = 1e-6  # values that differ by less, relative to them, are as much
LEAST_WRITTEN_RATIO = 2.0  # a smaller ratio is written in per cent


def report_of(
    response: Response, *, title: str = "", compare: Sequence[str] = (), decibel: bool = False,
    command: str = "",
) -> str:  # fmt: skip
    """Write a report of a frequency response as the text of one HTML page.

    Parameters
    ----------
    response
        A result of :func:`vibroimpact.frequency_response`.
    title
        Heading of the page; by default the measure and the machine.
    compare, decibel
        Options of the figure, as for :func:`vibroimpact.plotting.plot_response`.
    command
        The command that repeats the report, which the page states.

    Returns
    -------
    str
        HTML with the pictures inside.
    """
    check_kind("response", response, Response, "a Response, as vi.frequency_response gives")
    check_kind("title", title, str, "a text")
    page = Page(
        title or f"{_capital(machine_words(response.system))}: {response.measure.label}",
        [Text(in_brief(response, compare), brief=True)],
        [
            Section("The machine", machine_section(response)),
            Section("The response", response_section(response, compare, decibel=decibel)),
            Section("Kinds of motion", motion_section(response)),
            Section("At a few places", [table_of_answers(response)]),
            Section("What this statement rests on", [Items([*limits(response)])]),
            Section("To repeat it", repeat_section(response, command)),
        ],
        f"Made by vibroimpact {_kernel.version()}.",
    )
    return page.__html__()


def write_report(
    response: Response, path: str | PathLike[str], *, title: str = "",
    compare: Sequence[str] = (), decibel: bool = False,
) -> None:  # fmt: skip
    """Write a report to a file; see :meth:`Response.report`."""
    target = path_of("path", path)
    check_target(target, PAGES, "path")
    check_flag("decibel", decibel)
    text = report_of(response, title=title, compare=compare, decibel=decibel)
    write_files({target: text.encode()})


# ---- sentences -----------------------------------------------------------------------------------


def in_brief(response: Response, compare: Sequence[str] = ()) -> list[str]:
    """The worst motion, what it would be without the stops, and whether there are others."""
    said = [worst_sentence(response)]
    if is_comparable(response):
        said += [comparison_sentence(response, "linear")]
        said += [comparison_sentence(response, one) for one in compare if one != "linear"]
    return [*said, coexistence_sentence(response)]


def worst_sentence(response: Response) -> str:
    """The largest value on which the machine settles, where, and by what motion."""
    worst = response.worst
    text = (
        f"The largest {response.measure.label}{_whose(response)} {_over(response)} is "
        f"{value_of(worst)}, at {place_of(worst)}. The motion there {motion_in_words(worst.motion)}."
    )
    largest = response.largest(neutral=True)
    if largest.stability is not Stability.NEUTRAL:
        return text
    neutral = "It is neutral: a free mass stands anywhere between its stops, until it is pushed."
    if largest.value == worst.value:
        return f"{text} {neutral}"
    return (
        f"{text} A motion that {motion_in_words(largest.motion)} has {value_of(largest)}, at "
        f"{place_of(largest)}. {neutral}"
    )


def comparison_sentence(response: Response, which: str) -> str:
    """The largest value of a linear machine in the place of this one, and the difference."""
    shown, worst = response.shown, response.worst
    place, value = worst_of_comparison(response, which)
    name = {"linear": without_words(response.system), "tuned": "with a tuned mass damper of the "
            "same mass, the best of its kind,"}[which]  # fmt: skip
    if math.isnan(value):
        return f"{_capital(name)} the machine has no steady motion to compare with."
    if (
        math.isfinite(value)
        and response.worst.silent
        and abs(response.worst.value - value) <= SAME_RELATIVE * value
    ):
        return f"That is as much as {name}: no stop is met.{_touching(response)}"
    where = "over the whole band"
    if not math.isnan(place):
        where = f"at {number(place * shown.across, shown.unit_across)}"
    if math.isinf(value):
        return f"{_capital(name)} it would grow without bound {where}."
    at = f"{number(value, shown.unit)}, {where}"
    if not value > 0.0 or not worst.value > 0.0:
        return f"{_capital(name)} it would be {at}."
    level = float(decibels(worst.value / value, response.measure.dimension))
    return (
        f"{_capital(name)} it would be {at}. This machine has {_share(worst.value / value)}: "
        f"{'a reduction' if level < 0.0 else 'an increase'} of {abs(level):.3g} dB."
    )


def _touching(response: Response) -> str:
    """From where on the stops are touched, for a machine that says what its force and its gap are."""
    factor, known = touching_factor(response), names_of(response.system)
    if not 1.0 < factor < math.inf:
        return ""
    units, said = units_of(response.system), [f"{number(factor)} times the force"]
    if "force" in known:
        said[0] += f", {units_text(units, 'force', factor * known['force'])}"
    for name in ("half_clearance", "clearance"):
        if known.get(name, 0.0) > 0.0:
            words = parameter_words(name, units)[0]
            said.append(f"with a {words} of {units_text(units, 'length', known[name] / factor)}")
    return f" Touching begins at {', or '.join(said)}."


def _share(factor: float) -> str:
    """Text of a ratio."""
    if factor >= LEAST_WRITTEN_RATIO:
        return f"{factor:.3g} times as much"
    return f"{100.0 * abs(1.0 - factor):.3g} % {'less' if factor < 1.0 else 'more'}"


def coexistence_sentence(response: Response) -> str:
    """Whether the start decides between several motions."""
    several = sum(len(many) > 1 for many in settled(response))
    total = len(response.answers)
    if not several:
        return "Only one steady motion was found at each value: the start does not matter."
    return (
        f"At {several} of {total} values more than one steady motion was found: how the machine "
        "is started decides between them. What is stated above is the largest."
    )


def settled(response: Response) -> list[list[Answer]]:
    """Motions at each simulated value on which the machine settles.

    These are the motions that were simulated, and stable orbits that no start reached.
    """
    every = (
        [*many, *_unreached(response, value, many)]
        for value, many in zip(response.values.tolist(), response.answers, strict=True)
    )
    return [[a for a in many if a.attracting] or many for many in every]


def _unreached(response: Response, value: float, many: Sequence[Answer]) -> Iterator[Answer]:
    """Stable orbits at a value that are none of its simulated motions."""
    for curve in response.curves:
        stable = [k for k in curve.stretches(value) if curve.stability[k] == Stability.STABLE]
        if stable and not any(curve.holds(answer, response.size) for answer in many):
            yield Answer(value, curve.between(int(stable[0]), value), curve.symbol)


def without_words(system: System) -> str:
    """Sentence that says what the machine with all stops open is."""
    try:
        primary_of(system)
    except InvalidParameterError:
        return "without stops"
    return "without the damper"


def machine_words(system: System) -> str:
    """Sentence that says what a machine is."""
    name = name_of(system)
    return name.replace("-", " ") if name else "vibro-impact machine"


def _whose(response: Response) -> str:
    """The mass whose coordinate is measured, for readers who do not know its name."""
    units, m = units_of(response.system), mechanism_of(response.system)
    row = coefficients_of(response.measure, m)
    if row is None or not units.si or np.count_nonzero(row) != 1:
        return ""
    i = int(np.flatnonzero(row)[0])
    return f", the mass of {units_text(units, 'mass', m.mass[i][i])},"


def _over(response: Response) -> str:
    """Text of the band."""
    low, high = _ends(response)
    return f"between {low} and {high}"


def _ends(response: Response) -> tuple[str, str]:
    _, unit, across = response.shown
    low, high = (end * across for end in (response.band.low, response.band.high))
    return number(low, unit), number(high, unit)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


# ---- sections ------------------------------------------------------------------------------------


def machine_section(response: Response) -> list[Block]:
    """Table and drawing of the machine."""
    system = response.system
    low, high = _ends(response)
    varied = [Varied(response.parameter, f"varied from {low} to {high}")]
    si = units_of(system).si
    caption = "The model, not to scale: x to the right."
    if has_numbers(system):
        caption += f" Its numbers are those at {low}."
    drawing = picture_of(plot_mechanism(system, caption=False))
    alternative = f"Drawing of the {machine_words(system)}"
    return [
        Picture(drawing, caption, alternative, narrow=True),
        machine_table(system, varied, "" if si else PLAIN),
    ]


def response_section(response: Response, compare: Sequence[str], *, decibel: bool) -> list[Block]:
    """The figure and what it shows."""
    label = response.measure.label
    lines = {
        "linear": f"grey: {without_words(response.system)}", "tuned": "green: with a tuned mass damper",
    }  # fmt: skip
    beside = "".join(f"; {lines[one]}" for one in compare)
    caption = (
        f"{_capital(label)} over the band. Solid lines: motions on which the machine settles; "
        "dashed: motions that it leaves after any disturbance; dotted: no motions of this machine. "
        f"Points: simulated motions, coloured where they are on no line{beside}. {meaning(response)}"
    )
    ax = plot_response(response, compare=compare, decibel=decibel)
    low, high = _ends(response)
    return [Picture(picture_of(ax), caption, f"{label} from {low} to {high}")]


def meaning(response: Response) -> str:
    """Section of what is measured."""
    measure = response.measure
    first = " ".join((inspect.getdoc(type(measure)) or "").partition("\n\n")[0].split())
    text = getattr(measure, "text", "")
    return "Measured: " + (first[:1].lower() + first[1:]).replace(" a row", f" {text or 'a row'}")


def motion_section(response: Response) -> list[Block]:
    """Section of the kinds of motion that occur, where, and how large they are."""
    answers = [answer for many in settled(response) for answer in many]
    grouped = {
        kind: [answer for answer in answers if kind_of(answer.motion) == kind] for kind in KINDS
    }
    rows = [_kind_row(response, kind, found) for kind, found in grouped.items() if found]
    head = (
        "the motion", "where", f"at so many of {len(response.answers)} values",
        f"largest {response.measure.label}", "names",
    )  # fmt: skip
    caption = (
        "Motions on which the machine settles; several may be possible at one value. A name n-p-q: "
        "in n forcing periods p impacts at stop A, the upper one, and q at stop B, the lower one; "
        "more pairs are those of more contacts."
    )
    return [Table(head, rows, caption)]


def _kind_row(response: Response, kind: str, found: Sequence[Answer]) -> list[str]:
    shown, places = response.shown, {answer.parameter for answer in found}
    largest = max((a.value for a in found if math.isfinite(a.value)), default=math.nan)
    names = sorted({a.motion for a in found} - {*KINDS}, key=lambda name: (len(name), name))
    return [
        KINDS[kind], _where(response, places), str(len(places)),
        number(largest, shown.unit), _few(names),
    ]  # fmt: skip


def _where(response: Response, places: Collection[float]) -> str:
    """Stretches of neighbouring simulated values; of many, both ends of all."""
    inside = np.isin(response.values, [*places])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    runs = list(zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True))
    if len(runs) > MOST_CELL_STRETCHES:
        return f"{_span(response, runs[0][0], runs[-1][1])}, in {len(runs)} stretches"
    return ", ".join(_span(response, first, last) for first, last in runs)


def _span(response: Response, first: int, last: int) -> str:
    shown = response.shown
    ends = [response.values[k] * shown.across for k in sorted({first, last})]
    return " to ".join(number(float(end), shown.unit_across) for end in ends)


def _few(names: Sequence[str]) -> str:
    more = len(names) - MOST_CELL_NAMES
    return ", ".join(names[:MOST_CELL_NAMES]) + (f" and {more} more" if more > 0 else "")


def table_of_answers(response: Response) -> Table:
    """Every motion on which the machine settles, at a few values of the parameter."""
    parameter = parameter_words(response.parameter, units_of(response.system))[0]
    head = [parameter, response.measure.label]
    head += ["rms"] if has_rms(response) else []
    head += ["the motion", "reached by"]
    head += [without_words(response.system)] if is_comparable(response) else []
    rows = [
        row
        for own in response.band.values(TABLE_VALUES).tolist()
        for row in _rows_at(response, own)
    ]
    return Table(head, rows, "All motions on which the machine settles, the largest first.")


def has_rms(response: Response) -> bool:
    """Whether answers have an rms beside what is measured."""
    return len(response.simulation.measures) > 1 and not isinstance(response.measure, Rms)


def _rows_at(response: Response, own: float) -> Iterator[list[str]]:
    """Rows for one value of the parameter."""
    shown, units = response.shown, units_of(response.system)
    found = response.at(own * response.band.factor)
    total = sum(answer.members for answer in found)
    beside = measured_beside(response, "linear")(own) if is_comparable(response) else math.nan
    for answer in found:
        if not answer.stable or not math.isfinite(answer.value):
            continue
        row = [place_of(answer), value_of(answer)]
        if has_rms(response):
            row.append(units_text(units, response.simulation.measures[1].dimension, answer.rms))
        row += [motion_in_words(answer.motion), f"{answer.members} of {total} starts"]
        if is_comparable(response):
            row.append(number(beside, shown.unit))
        yield row


def limits(response: Response) -> Iterator[str]:
    """Section of what the statement is true of, and what may be missing."""
    m, s = mechanism_of(response.system), response.simulation
    if m.rigid_stops:
        both = sorted({x for one in m.rigid_stops for x in one.restitutions})
        yield (
            "Rigid stops by the impact law: an impact takes no time and returns the closing speed "
            f"times the coefficient of restitution, {' or '.join(map(number, both))}, whatever the speed."
        )
    if m.switching:
        yield "Soft stops, friction and other elements follow the laws of the model exactly."
    others = 0 if s.starts is None else math.prod(s.starts.dims.values())
    yield (
        f"Motions are simulated at {len(response.values)} values: one followed upwards and "
        f"downwards, and {others or 'no'} other starts at each; observed for {number(s.periods)} forcing periods after "
        f"{number(s.settle_periods)} to settle. A motion that is reached from few starts may be missed."
    )
    if response.unexplained:
        yield (
            "Motions that are on no line of the figure are known at the simulated values only; "
            "where they do not repeat, their value is that of the time observed."
        )
    yield ("Steady motion with one set of values: without wear, tolerances, starting and stopping.")
    for note in response.notes:
        yield f"The search for lines of the figure notes: {note}."
    if response.interrupted:
        yield "The search for branches was interrupted; lines of the figure are missing."


def repeat_section(response: Response, command: str) -> list[Block]:
    """The command, and the machine in full precision."""
    blocks: list[Block] = []
    if command:
        blocks += [Text(["The command:"]), Code(command)]
    s, band = response.simulation, response.band
    low, high = (end * band.factor for end in (band.low, band.high))
    exact = [
        f"machine  {response.system!r}",
        f"band     {band.parameter} = {low!r} to {high!r} {band.unit}".rstrip(),
        f"measure  {response.measure!r}",
        f"starts   {s.start!r}, {s.starts!r}",
    ]
    return [
        *blocks,
        Text(["In full precision:"]),
        Code("\n".join(exact)),
    ]


# ---- pictures ------------------------------------------------------------------------------------


def picture_of(ax: Axes, suffix: str = ".svg") -> bytes:
    """The figure of some axes, which is closed then."""
    try:
        return style.content_of_picture(ax, suffix)
    finally:
        plt.close(style.figure_of(ax))
