"""Machines of the catalogue in words and pictures: equations, parameters, drawing, a motion, source."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any, NamedTuple, cast

from matplotlib.axes import Axes

from vibroimpact import _kernel
from vibroimpact._core.docstrings import descriptions, head_of
from vibroimpact._core.quantities import UNITS
from vibroimpact.machines.machine import Machine, example_of, parameters_of
from vibroimpact.machines.registry import machine_of
from vibroimpact.machines.units import Quantity
from vibroimpact.plotting.history import plot_history
from vibroimpact.plotting.mechanism import plot_mechanism
from vibroimpact.plotting.page import Code, Page, Picture, Section, Table, Text
from vibroimpact.plotting.report import picture_of
from vibroimpact.plotting.words import number
from vibroimpact.simulation.simulate import simulate

SETTLED_PERIODS, SHOWN_PERIODS = 40, 4  # of the motion in the picture
FREE_TIME = 60.0  # of a machine without forcing


class Row(NamedTuple):
    """A parameter: its name, default, unit in SI, and meaning."""

    parameter: str
    default: str
    unit: str
    meaning: str


def parameter_rows(machine: type[Machine]) -> Iterator[Row]:
    """Parameters of a class of machines."""
    texts, example = descriptions(machine), example_of(machine)
    of_fields = {one.name: one for one in fields(cast(Any, machine))}
    for name in parameters_of(machine):
        value, field = getattr(example, name), of_fields[name]
        quantity = field.metadata.get("quantity", Quantity()).quantity
        default = "" if name in machine.example else "none" if value is None else number(value)
        yield Row(name, default, UNITS.get(quantity, ""), texts.get(name, "").replace("``", ""))


def equations_of(machine: type[Machine]) -> str:
    """Equations of a machine, from the head of its file."""
    return (sys.modules[machine.__module__].__doc__ or "").strip()


def commands_of(machine: type[Machine]) -> str:
    """What to try, each command with what it shows."""
    return "\n".join(f"vibroimpact {line}    # {what}" for line, what in machine.to_try)


def plot_example(machine: Machine) -> Axes:
    """Draw a settled motion of a machine from its default start."""
    omega = machine.mechanism.omega
    period = 2.0 * math.pi / omega if omega else FREE_TIME / SHOWN_PERIODS
    settled = SETTLED_PERIODS if omega else 0
    end = (settled + SHOWN_PERIODS) * period
    run = simulate(machine, machine.free_start(), t_max=end, impacts=10**6)
    return plot_history(run, settled * period, end)


def gallery(names: Sequence[str]) -> str:
    """Page of some machines of the catalogue, by their names, as the text of one HTML page.

    Parameters
    ----------
    names
        Names in the registry.

    Returns
    -------
    str
        HTML with the pictures inside.
    """
    page = Page(
        f"{names[0]}: {head_of(machine_of(names[0]))}" if len(names) == 1 else "Machines",
        [
            Text(
                [
                    f"The catalogue of vibroimpact: {len(names)} of its machines, with their defaults."
                ]
            )
        ],
        [Section(name, [*_blocks(name)], name) for name in names],
        f"Made by vibroimpact {_kernel.version()}.",
        contents=len(names) > 1,
    )
    return page.__html__()


def _blocks(name: str) -> Iterator[Text | Code | Picture | Table]:
    """The part of the page on one machine."""
    machine = machine_of(name)
    example = example_of(machine)
    head = head_of(machine)
    yield Text([f"{head}."])
    yield Picture(picture_of(plot_mechanism(example)), "Not to scale.", f"drawing of {name}")
    yield Code(equations_of(machine))
    yield Table(("parameter", "default", "SI unit", "meaning"), [*parameter_rows(machine)])
    yield Picture(
        picture_of(plot_example(example)), "A motion with the defaults.", f"motion of {name}"
    )
    yield Text([f"Source: {machine.source}"])
    yield Code(commands_of(machine))
