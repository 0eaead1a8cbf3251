"""Machines: systems by name, with parameters.

A machine is one file of this folder: a frozen, keyword-only dataclass that inherits
:class:`Machine`, checks its values in ``__post_init__``, and has a ``mechanism``. Its fields are
its parameters: for sweeps and branches, for TOML and JSON, and as options of the command line,
described by its docstring. Besides those of :class:`Machine` it may have

- a field ``scales``, :class:`Scales`, and a class method ``from_physical`` that fills it: results
  are then printed and drawn in SI units;
- a method ``on_stop(stop, *, x1, ..., v1, ..., phase)``: a state on stop "A" or "B", from the
  remaining coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import ClassVar, NamedTuple

from vibroimpact._core.checks import positive
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State

SCALES = "scales"  # the field that is no parameter
POWERS = {  # (a, b, c) of mass^a length^b time^c, the factor of a quantity
    "length": (0, 1, 0),
    "velocity": (0, 1, -1),
    "acceleration": (0, 1, -2),
    "time": (0, 0, 1),
    "frequency": (0, 0, -1),
    "rate": (0, 0, -1),
    "force": (1, 1, -2),
    "impulse": (1, 1, -1),
    "energy": (1, 2, -2),
    "power": (1, 2, -3),
    "mass": (1, 0, 0),
    "stiffness": (1, 0, -2),
    "damping": (1, 0, -1),
}


@dataclass(frozen=True, slots=True)
class Scales:
    """Physical units of the nondimensional system: factors from scaled to SI values.

    Parameters
    ----------
    time
        Seconds per unit of t.
    length
        Metres per unit of x.
    mass
        Kilograms of the main mass.
    """

    time: float = 1.0
    length: float = 1.0
    mass: float = 1.0

    def __post_init__(self) -> None:
        for name in ("time", "length", "mass"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))

    @property
    def velocity(self) -> float:
        """Metres per second per unit of velocity."""
        return self.length / self.time

    @property
    def frequency(self) -> float:
        """Radians per second per unit of angular frequency."""
        return 1.0 / self.time

    @property
    def force(self) -> float:
        """Newtons per unit of force."""
        return self.mass * self.length / self.time**2

    def factor(self, quantity: str) -> float:
        """SI units per unit of a quantity, such as "velocity"; 1 for a plain number, ""."""
        a, b, c = POWERS.get(quantity, (0, 0, 0))
        return float(self.mass**a * self.length**b * self.time**c)


class Machine:
    """Base class of systems with a name."""

    __slots__ = ("__weakref__",)  # so that the mechanism is built once: model/system.py

    SCALING: ClassVar[str] = ""
    """Scaling of ``from_physical`` in words: such as "t = T sqrt(K / M), x = K X / F0"."""

    @property
    def mechanism(self) -> Mechanism:
        """Masses, springs, forces and stops."""
        raise NotImplementedError

    def free_start(self) -> State:
        """State with all coordinates and velocities zero."""
        zero = (0.0,) * self.mechanism.degrees
        return State(zero, zero)


# ---- parameters ----------------------------------------------------------------------------------


class Measure(NamedTuple):
    """Quantity of a parameter (a key of plotting/units.py), and its label in figures."""

    quantity: str = ""
    label: str = ""


def measured(quantity: str, label: str = "") -> Mapping[str, Measure]:
    """Metadata of a field: its quantity, and a label for figures where there is no standard one."""
    return {"measure": Measure(quantity, label)}


def measures_of(system: object) -> dict[str, Measure]:
    """Quantities of the parameters of a system; numbers without dimension are left out."""
    if not is_dataclass(system):
        return {}
    return {f.name: f.metadata["measure"] for f in fields(system) if "measure" in f.metadata}


def parameters_of(machine: type[Machine]) -> tuple[str, ...]:
    """Names of the parameters of a class of machines."""
    return tuple(f.name for f in fields(machine) if f.init and f.name != SCALES)  # type: ignore[arg-type]


def scales_of(system: object) -> Scales | None:
    """Physical scales of a system; None for one without them."""
    scales = getattr(system, "scales", None)
    return scales if isinstance(scales, Scales) and scales != Scales() else None


def scales_or_ones(system: object) -> Scales:
    """Physical scales of a system; ones for one without them."""
    return scales_of(system) or Scales()
