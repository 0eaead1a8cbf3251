"""Machines: systems by name, with parameters.

A machine is one file of this folder: a frozen, keyword-only dataclass that inherits
:class:`Machine`, checks its values in ``__post_init__``, and has a ``mechanism``. Its fields are
its parameters: for sweeps and branches, for TOML and JSON, and as options of the command line,
described by its docstring. Besides those of :class:`Machine` it may have

- a field ``si``, whether its numbers are in SI units, which labels then name, and a class method
  ``from_physical`` that fills the fields from masses, stiffnesses and lengths in SI units, with ``physical``, the
  quantity of each of its arguments, and ``letters``, those of them that are a parameter but for a factor;
- a method ``on_stop(stop, *, x1, ..., v1, ..., phase)``: a state on stop "A" or "B", from the
  remaining coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State

SI = "si"  # the field that is no parameter


class Machine:
    """Base class of systems with a name."""

    __slots__ = ("__weakref__",)  # so that the mechanism is built once: model/system.py

    physical: ClassVar[Mapping[str, str]] = {}
    letters: ClassVar[Mapping[str, tuple[str, float]]] = {}

    @property
    def mechanism(self) -> Mechanism:
        """Masses, springs, forces and stops."""
        raise NotImplementedError

    def free_start(self) -> State:
        """State with all coordinates and velocities zero."""
        zero = (0.0,) * self.mechanism.degrees
        return State(zero, zero)


def parameters_of(machine: type[Machine]) -> tuple[str, ...]:
    """Names of the parameters of a class of machines."""
    return tuple(f.name for f in fields(machine) if f.init and f.name != SI)  # type: ignore[arg-type]
