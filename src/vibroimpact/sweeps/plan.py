"""Plan of a sweep: a grid of members, and blocks of it that are plans themselves."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.types import Floats
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.starts import Starts

Place = tuple[slice, ...]


class Window(NamedTuple):
    """Length of a member's run."""

    # forcing periods before, and while, it is observed; units of time without forcing
    settle_periods: float
    periods: float
    most_impacts: int  # impacts at all stops after which it ends


@dataclass(frozen=True, eq=False)
class Plan:
    """All members of a sweep."""

    system: System  # the system, with its swept parameters at the first values
    axes: dict[str, Floats]  # values by name of a parameter
    starts: Starts  # starts, the same ones at every value of the parameters
    # observers, and the length of the runs
    observers: tuple[Observer, ...]
    window: Window
    # name of the axis along which motions are followed, with a minus sign downwards; or None
    follow: str | None = None

    @property
    def dims(self) -> dict[str, int]:
        """Names and sizes of the grid: parameters, then starts."""
        return {name: axis.size for name, axis in self.axes.items()} | self.starts.dims

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the grid."""
        return tuple(self.dims.values())

    @property
    def size(self) -> int:
        """Number of members."""
        return math.prod(self.shape)

    @cached_property
    def mechanism(self) -> Mechanism:
        """Mechanism of ``system``."""
        return mechanism_of(self.system)

    @property
    def degrees(self) -> int:
        """Number of coordinates of the system."""
        return self.mechanism.degrees

    @property
    def followed(self) -> int | None:
        """Number of the followed dimension."""
        return None if self.follow is None else list(self.axes).index(self.follow.lstrip("-"))

    @property
    def order(self) -> NDArray[np.intp]:
        """Indices along the followed axis in the order of the motion, by value."""
        assert self.follow is not None
        rising = np.argsort(self.axes[self.follow.lstrip("-")])
        return rising[::-1] if self.follow.startswith("-") else rising

    def block(self, place: Place) -> Plan:
        """Part of the grid at one slice per dimension."""
        count = len(self.axes)
        axes = {
            name: axis[part]
            for (name, axis), part in zip(self.axes.items(), place[:count], strict=True)
        }
        return replace(self, axes=axes, starts=self.starts.block(place[count:]))
