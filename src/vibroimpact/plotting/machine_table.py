"""A machine as a table for a report: masses, springs, dashpots, stops, parameters, with units."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import fields
from typing import Any, NamedTuple, cast

from vibroimpact._core.scalars import is_infinite
from vibroimpact.machines.machine import Machine
from vibroimpact.machines.units import Units, of_path, units_of
from vibroimpact.model.elements.element import Element
from vibroimpact.model.mechanism import Mechanism, element_labels, links
from vibroimpact.model.parameters import names_of
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.plotting.branch_looks import parameter_label
from vibroimpact.plotting.page import Cell, Symbol, Table
from vibroimpact.plotting.variables import combination
from vibroimpact.plotting.words import number

PLACE = ("row", "lower", "upper", "motion")  # fields of a stop that are no law
NAMED = re.compile(r"(.*?)\s*\$(.*)\$")  # words and symbol of a label


class Varied(NamedTuple):
    """A parameter that is not fixed, and the text of its range."""

    name: str
    text: str


def machine_table(system: System, varied: Sequence[Varied] = (), caption: str = "") -> Table:
    """Table of a machine: each part with its symbol and value.

    Parameters
    ----------
    system
        The machine.
    varied
        Parameters whose range stands in place of their value.
    caption
        Caption of the table.
    """
    units, m = units_of(system), mechanism_of(system)
    known = {one.name: one.text for one in varied}
    rows = [*_supports(m, units), *_parameters(system, units, known)]
    if not isinstance(system, Machine):
        rows += [*_forces(m, units), *_parts(m, units)]
    return Table(("part", "symbol", "value"), rows, caption)


def free_masses(m: Mechanism) -> Collection[int]:
    """Coordinates on which no spring and no dashpot acts."""
    held = {k for matrix in (m.stiffness, m.damping) for i, j, _ in links(matrix) for k in (i, j)}
    return [i for i in range(m.degrees) if i not in held]


def _supports(m: Mechanism, units: Units) -> Iterator[tuple[Cell, ...]]:
    """Masses, springs and dashpots, as the drawing has them."""
    free = free_masses(m)
    for i in range(m.degrees):
        words = f"mass of x{i + 1}" + (", free between stops" if i in free else "")
        yield words, "", units_text(units, "mass", m.mass[i][i])
        for k in range(i + 1, m.degrees):
            if m.mass[i][k]:
                shared = f"mass shared by x{i + 1} and x{k + 1}"
                yield shared, "", units_text(units, "mass", m.mass[i][k])
    for name, quantity, matrix in (
        ("spring", "stiffness", m.stiffness), ("dashpot", "damping", m.damping),
    ):  # fmt: skip
        for i, j, value in links(matrix):
            where = f"of x{i + 1} to the ground" if j is None else f"between x{i + 1} and x{j + 1}"
            yield f"{name} {where}", "", units_text(units, quantity, value)


def _parameters(system: System, units: Units, varied: dict[str, str]) -> Iterator[tuple[Cell, ...]]:
    """Parameters by name, those that vary with their range."""
    for name, value in names_of(system).items():
        words, symbol = parameter_words(name, units)
        quantity = units.quantity_of(name)
        text = varied.get(name) or units_text(units, quantity, value)
        if name not in varied and units.si and quantity == "frequency":
            text += f" ({number(value / (2.0 * math.pi), 'Hz')})"
        yield words, Symbol(symbol), text


def parameter_words(name: str, units: Units) -> tuple[str, str]:
    """A parameter in words, and its symbol; "" where it has none."""
    label = parameter_label(name, units).partition(" [")[0]
    found = NAMED.fullmatch(label)
    return (found[1], found[2]) if found else (name.replace("_", " "), "")


def _forces(m: Mechanism, units: Units) -> Iterator[tuple[Cell, ...]]:
    """Amplitudes of the forces on each coordinate."""
    for line in m.forces:
        at = (
            ""
            if len(m.forces) == 1
            else f" at frequency {units_text(units, 'frequency', float(line.omega))}"
        )
        for i, (sine, cosine) in enumerate(zip(line.sine, line.cosine, strict=True)):
            if size := math.hypot(sine, cosine):
                yield f"force amplitude on x{i + 1}{at}", "", units_text(units, "force", size)
    for i, value in enumerate(m.constant_force):
        if value:
            yield f"constant force on x{i + 1}", "", units_text(units, "force", value)


def _parts(m: Mechanism, units: Units) -> Iterator[tuple[Cell, ...]]:
    """Stops and other elements."""
    for label, part in zip(element_labels(m), m.elements, strict=True):
        if part.is_stop:
            yield label, "", _stop(part, units)
        else:
            yield label, "", re.sub(r"^\w+\((.*)\)$", r"\1", repr(part))


def _stop(part: Element, units: Units) -> str:
    """Place at which a stop is met, and its law."""
    row = re.sub(r"(?<=\w)([+-])", r" \1 ", re.sub(r"[_{}\\,]", "", combination(part.row)))
    low, high = (
        "" if is_infinite(limit) else units_text(units, "length", limit)
        for limit in map(part.limit_at, (-1, 1))
    )
    ends = f"{low} ≤ " * bool(low) + row + f" ≤ {high}" * bool(high)
    law = [
        value if isinstance(value, str) else f"{name} {_pair(value, units.unit(of_path(name)))}"
        for name, value in ((f.name, getattr(part, f.name)) for f in fields(cast(Any, part)))
        if name not in PLACE and not isinstance(value, bool)
    ]
    return f"{ends}; {', '.join(law)}"


def _pair(both: float | tuple[float, float], unit: str) -> str:
    """A number for both sides, or one for each."""
    low, high = both if isinstance(both, tuple) else (both, both)
    below, above = number(low, unit), number(high, unit)
    return below if low == high else f"{below} below, {above} above"


def units_text(units: Units, quantity: str, value: float) -> str:
    """A value of the system as a text with its unit."""
    return number(value, units.unit(quantity))
