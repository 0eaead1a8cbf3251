"""Units of machines: labels for axes, printed numbers and attributes of datasets.

A number is a number in the units of its machine. Where the machine says that these are those of SI
(its field ``si``), labels name the unit of each quantity; otherwise there is none to name. The
attribute ``quantity`` of a variable of a sweep names its quantity.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from vibroimpact._core.quantities import UNITS, with_unit
from vibroimpact.model.state import COORDINATE

if TYPE_CHECKING:
    import xarray as xr

COORDINATES = {"x": "length", "v": "velocity"}
ORDERS = COORDINATES | {"a": "acceleration"}
OF_FIELDS = {  # of mechanisms and elements
    "omega": "frequency", "mass": "mass", "damping": "damping", "stiffness": "stiffness", "upper": "length",
    "lower": "length", "constant_force": "force", "kinetic": "force", "static": "force", "belt_speed": "velocity",
}  # fmt: skip
INDEX = re.compile(r"\[\d+\]")
OF_ORBITS = {"speed": "velocity", "clearance": "length", "period": "time"}


class Quantity(NamedTuple):
    """Quantity of a parameter (a key of ``UNITS``), and its label in figures."""

    quantity: str = ""
    label: str = ""


def of_quantity(quantity: str, label: str = "") -> Mapping[str, Quantity]:
    """Metadata of a parameter: its quantity, and a label for figures where there is no standard one."""
    return {"quantity": Quantity(quantity, label)}


def quantities_of(system: object) -> dict[str, Quantity]:
    """Quantities of the parameters of a system; numbers without dimension are left out."""
    if not is_dataclass(system):
        return {}
    found = {f.name: f.metadata.get("quantity", Quantity()) for f in fields(system)}
    return {name: one for name, one in found.items() if one.quantity or one.label}


def of_path(path: str) -> str:
    """Quantity of a number of a mechanism by its path, such as "elements[0].upper"; "" where it is another."""
    last = INDEX.sub("", path.rpartition(".")[2])
    if last in ("sine", "cosine"):
        return "length" if "motion" in path else "force"
    return OF_FIELDS.get(last, "")


class Units(NamedTuple):
    """Whether the numbers of a system are in SI units, and the quantities of its parameters."""

    si: bool
    parameters: Mapping[str, Quantity] = MappingProxyType({})

    def unit(self, quantity: str) -> str:
        """Unit of a quantity; "" for a number without dimension, and where units are not those of SI."""
        return UNITS.get(quantity, "") if self.si else ""

    def text(self, *values: float, quantity: str, digits: int = 6) -> str:
        """Numbers with their unit, as they read best: "3 mm", "2 to 50 mm"."""
        return with_unit(*values, unit=self.unit(quantity), digits=digits)

    def formula(self, value: float, quantity: str, digits: int = 6) -> str:
        """A number with its unit, for a formula of a figure."""
        number, _, unit = self.text(value, quantity=quantity, digits=digits).partition(" ")
        unit = unit.replace(" ", r"\,")
        return rf"{number}\,\mathrm{{{unit}}}" if unit else number

    def of_parameter(self, name: str, *values: float, digits: int = 6) -> str:
        """Values of a parameter or a coordinate, with their unit."""
        return self.text(*values, quantity=self.quantity_of(name), digits=digits)

    def label(self, text: str, quantity: str) -> str:
        """Label with its unit."""
        unit = self.unit(quantity)
        return f"{text} [{unit}]" if unit else text

    def of_variables(self, data: xr.Dataset, quantities: Mapping[str, str]) -> xr.Dataset:
        """A dataset with the quantity of each of these variables in its attributes, and the unit in SI."""
        for name, quantity in quantities.items():
            if quantity and name in data.variables:
                data.variables[name].attrs.update({"quantity": quantity} | self.attrs(quantity))
        return data

    def of_entries(self, names: Iterable[str]) -> dict[str, str]:
        """Attribute ``units_of_entries`` of a variable whose entries have different units, in the order of names."""
        quantities = [
            (name, "rad" if name == "phase" else self.unit(self.quantity_of(name)))
            for name in names
        ]
        words = ", ".join(f"{name} [{unit or 1}]" for name, unit in quantities)
        return {"units_of_entries": words} if self.si else {}

    def attrs(self, quantity: str) -> dict[str, str]:
        """Attribute ``units`` of a variable of a dataset, where it has a unit."""
        return {"units": unit} if (unit := self.unit(quantity)) else {}

    def quantity_of(self, name: str) -> str:
        """Quantity of a parameter or a coordinate; "" for a plain number or an angle."""
        if COORDINATE.fullmatch(name):
            return of_coordinate(name)
        known = self.parameters.get(name)
        return known.quantity if known else of_path(name)


def units_of(*systems: object) -> Units:
    """Units in which some systems are: SI if all are."""
    parameters = {name: one for system in systems for name, one in quantities_of(system).items()}
    si = bool(systems) and all(getattr(system, "si", False) for system in systems)
    return Units(si, parameters)


def of_coordinate(name: str) -> str:
    """Quantity of x1, v1, ... and phase."""
    return COORDINATES.get(name[0], "")
