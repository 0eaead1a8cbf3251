"""Quantities, physical scales of systems, and the units of figures and printed results.

Results are shown in SI units where the system has physical scales, else without units. A number of
the scaled system times the factor of its quantity (``Scales.factor``) is the number in SI units. The
attribute ``quantity`` of a variable of a sweep names its quantity.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from vibroimpact._core.checks import positive
from vibroimpact.model.state import COORDINATE

if TYPE_CHECKING:
    import xarray as xr

QUANTITIES = {  # (a, b, c) of mass^a length^b time^c, the factor of a quantity, and its unit
    "length": ((0, 1, 0), "m"),
    "velocity": ((0, 1, -1), "m/s"),
    "acceleration": ((0, 1, -2), "m/s²"),
    "time": ((0, 0, 1), "s"),
    "frequency": ((0, 0, -1), "rad/s"),
    "rate": ((0, 0, -1), "1/s"),
    "force": ((1, 1, -2), "N"),
    "impulse": ((1, 1, -1), "N s"),
    "energy": ((1, 2, -2), "J"),
    "power": ((1, 2, -3), "W"),
    "mass": ((1, 0, 0), "kg"),
    "stiffness": ((1, 0, -2), "N/m"),
    "damping": ((1, 0, -1), "N s/m"),
}
PLAIN = ((0, 0, 0), "")  # of a number without dimension
COORDINATES = {"x": "length", "v": "velocity"}
OF_ORBITS = {"speed": "velocity", "clearance": "length", "period": "time"}


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
        (a, b, c), _ = QUANTITIES.get(quantity, PLAIN)
        return float(self.mass**a * self.length**b * self.time**c)


class Quantity(NamedTuple):
    """Quantity of a parameter (a key of ``QUANTITIES``), and its label in figures."""

    quantity: str = ""
    label: str = ""


def of_quantity(quantity: str, label: str = "") -> Mapping[str, Quantity]:
    """Metadata of a parameter: its quantity, and a label for figures where there is no standard one."""
    return {"quantity": Quantity(quantity, label)}


def quantities_of(system: object) -> dict[str, Quantity]:
    """Quantities of the parameters of a system; numbers without dimension are left out."""
    if not is_dataclass(system):
        return {}
    return {f.name: f.metadata["quantity"] for f in fields(system) if "quantity" in f.metadata}


def scales_of(system: object) -> Scales | None:
    """Physical scales of a system; None for one without them."""
    scales = getattr(system, "scales", None)
    return scales if isinstance(scales, Scales) and scales != Scales() else None


def scales_or_ones(system: object) -> Scales:
    """Physical scales of a system; ones for one without them."""
    return scales_of(system) or Scales()


class Units(NamedTuple):
    """Scales of a system, whether its results are shown in SI units, and its parameters."""

    scales: Scales
    si: bool
    parameters: Mapping[str, Quantity] = MappingProxyType({})

    def factor(self, quantity: str) -> float:
        """Factor to SI units; 1 for a number without dimension, and for a nondimensional system."""
        return self.scales.factor(quantity) if self.si else 1.0

    def unit(self, quantity: str) -> str:
        """Unit of a quantity; "" for a number without dimension or in scaled units."""
        return QUANTITIES.get(quantity, PLAIN)[1] if self.si else ""

    def label(self, text: str, quantity: str) -> str:
        """Label with its unit."""
        unit = self.unit(quantity)
        return f"{text} [{unit}]" if unit else text

    def text(self, quantity: str, *values: float) -> str:
        """Text of numbers to six digits, with their unit."""
        listed = ", ".join(f"{value * self.factor(quantity):.6g}" for value in values)
        return f"{listed} {self.unit(quantity)}".rstrip()

    def drawn(self, dataset: xr.Dataset, *names: str) -> xr.Dataset:
        """Dataset with its coordinates, and those of the variables that it has, in these units."""
        for name in (*map(str, dataset.coords), *names):
            factor = self.factor(self._of_quantity(dataset, name)) if name in dataset else 1.0
            if factor != 1.0:
                array = dataset[name].variable.copy(data=dataset[name].values * factor)
                put = dataset.assign_coords if name in dataset.coords else dataset.assign
                dataset = put({name: array})
        return dataset

    def quantity_of(self, name: str) -> str:
        """Quantity of a parameter or a coordinate; "" for a plain number or an angle."""
        if COORDINATE.fullmatch(name):
            return of_coordinate(name)
        return self.parameters.get(name, Quantity()).quantity

    def _of_quantity(self, dataset: xr.Dataset, name: str) -> str:
        """Quantity of a variable, a parameter or a start of a sweep; "" for a plain number."""
        if stated := dataset[name].attrs.get("quantity"):
            return str(stated)
        known = name in dataset.coords or COORDINATE.fullmatch(name)
        return self.quantity_of(name) if known else ""


def units_of(*systems: object) -> Units:
    """Units of figures of some systems: SI if all have the same scales."""
    found = {scales_of(system) for system in systems}
    scales = found.pop() if len(found) == 1 else None
    parameters = {name: one for system in systems for name, one in quantities_of(system).items()}
    return Units(scales or Scales(), scales is not None, parameters)


def of_coordinate(name: str) -> str:
    """Quantity of x1, v1, ... and phase."""
    return COORDINATES.get(name[0], "")
