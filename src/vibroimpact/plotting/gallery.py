"""Machines of the catalogue in words and pictures: equations, parameters, drawing, a motion, source."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple, cast

import numpy as np
from matplotlib.axes import Axes

from vibroimpact import _kernel
from vibroimpact._core.docstrings import descriptions, head_of
from vibroimpact._core.quantities import UNITS
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.machine import Machine, example_of, parameters_of
from vibroimpact.machines.registry import machine_of
from vibroimpact.machines.units import Quantity
from vibroimpact.model.state import State
from vibroimpact.plotting.bifurcation_diagram import plot_bifurcation_diagram
from vibroimpact.plotting.history import plot_history
from vibroimpact.plotting.mechanism import plot_mechanism
from vibroimpact.plotting.page import Code, Page, Picture, Section, Table, Text
from vibroimpact.plotting.phase_portrait import plot_phase_portrait
from vibroimpact.plotting.report import picture_of
from vibroimpact.plotting.sections import plot_section
from vibroimpact.plotting.words import number
from vibroimpact.simulation.places import AtPhase, AtStop
from vibroimpact.simulation.sections import section
from vibroimpact.simulation.simulate import Run, simulate
from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep

VALUES, POINTS = 300, 40  # of the parameter of a diagram, and of points at each
SECTION_POINTS = 1500


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


def plot_known_for(machine: type[Machine]) -> Axes:
    """Draw what a machine is known for."""
    known = machine.known_for
    example: Any = replace(cast(Any, example_of(machine)), **known.parameters)
    start = State(*known.start) if known.start else example.free_start()
    return _DRAW[known.kind](example, start, known)


def _history(example: Machine, start: State, known: KnownFor) -> Axes:
    return plot_history(*_run(example, start, known))


def _portrait(example: Machine, start: State, known: KnownFor) -> Axes:
    return plot_phase_portrait(*_run(example, start, known))


def _run(example: Machine, start: State, known: KnownFor) -> tuple[Run, float, float]:
    """A motion, and the times between which it is shown."""
    omega = example.mechanism.omega
    period = 2.0 * math.pi / omega if omega else 1.0
    begin, end = known.settled * period, (known.settled + known.shown) * period
    return simulate(example, start, t_max=end, impacts=10**6), begin, end


def _place(known: KnownFor) -> AtPhase | AtStop:
    """Where points of a diagram or a section are taken."""
    return AtPhase(0.0) if known.at == "phase" else AtStop(known.at)


def _diagram(example: Machine, start: State, known: KnownFor) -> Axes:
    assert known.over
    name, first, last = known.over
    data = bifurcation_sweep(
        replace(cast(Any, example), **{name: first}), over={name: np.linspace(first, last, VALUES)}, start=start,
        way=known.way, at=_place(known), points=POINTS, settle_periods=150, progress=False,
    )  # fmt: skip
    return plot_bifurcation_diagram(data, variable=known.variable)


def _section(example: Machine, start: State, known: KnownFor) -> Axes:
    starts = [
        State(start.position, (speed, *start.velocity[1:]), start.phase) for speed in known.speeds
    ] or [start]
    ax = None
    for one in starts:
        found = section(
            example, one, at=_place(known), points=SECTION_POINTS, settle_events=int(known.settled)
        )
        ax = plot_section(found, x="phase" if known.speeds else "x1", ax=ax)
    assert ax is not None
    return ax


_DRAW: dict[str, Callable[[Machine, State, KnownFor], Axes]] = {
    "history": _history,
    "portrait": _portrait,
    "diagram": _diagram,
    "section": _section,
}


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
    known = machine.known_for
    yield Picture(picture_of(plot_known_for(machine)), known.caption, known.caption)
    yield Text([f"Source: {machine.source}"])
    yield Code(commands_of(machine))
