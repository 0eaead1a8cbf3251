"""What a machine is known for, as data: which picture of it the gallery shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal


@dataclass(frozen=True, slots=True)
class KnownFor:
    """A picture of the gallery.

    Attributes
    ----------
    caption
        What it shows.
    kind
        A time history; the diagram of a section over a parameter; a section; a phase portrait.
    parameters
        Values that differ from the defaults.
    over
        The parameter of a diagram, its first and its last value.
    way
        Whether a diagram is followed up, or up and then down.
    at
        Where a section or a diagram has its points: a stop, "A" or "B", or once a period, "phase".
    variable
        What a diagram shows.
    start
        Position, velocity and phase of the start; that of the machine where left out.
    speeds
        Velocities of the first coordinate of several starts of a section.
    settled, shown
        Forcing periods, or seconds without a force, that pass before a history begins, and that it lasts.
    """

    caption: str
    kind: Literal["history", "diagram", "section", "portrait"] = "history"
    parameters: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    over: tuple[str, float, float] | None = None
    way: Literal["up", "both"] = "up"
    at: Literal["A", "B", "phase"] = "A"
    variable: str = "v1"
    start: tuple[tuple[float, ...], tuple[float, ...], float] | None = None
    speeds: tuple[float, ...] = ()
    settled: float = 40.0
    shown: float = 4.0
