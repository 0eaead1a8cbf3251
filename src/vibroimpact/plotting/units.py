"""Units of figures and printed results: SI where the system has physical scales, else none.

A number of the scaled system times the factor of its quantity (``Scales.factor``) is the number in SI
units. The attribute ``quantity`` of a variable of a sweep names its quantity.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import xarray as xr

from vibroimpact.machines.json_text import system_of
from vibroimpact.machines.machine import Measure, Scales, measures_of, scales_of
from vibroimpact.sweeps.states import COORDINATE

UNITS = {
    "length": "m",
    "velocity": "m/s",
    "acceleration": "m/s²",
    "time": "s",
    "frequency": "rad/s",
    "rate": "1/s",
    "force": "N",
    "impulse": "N s",
    "energy": "J",
    "power": "W",
    "mass": "kg",
    "stiffness": "N/m",
    "damping": "N s/m",
}
COORDINATES = {"x": "length", "v": "velocity"}
OF_ORBITS = {"speed": "velocity", "clearance": "length", "period": "time"}


class Units(NamedTuple):
    """Scales of a system, whether its results are shown in SI units, and its parameters."""

    scales: Scales
    si: bool
    parameters: Mapping[str, Measure] = MappingProxyType({})

    def factor(self, quantity: str) -> float:
        """Factor to SI units; 1 for a number without dimension, and for a nondimensional system."""
        return self.scales.factor(quantity) if self.si else 1.0

    def unit(self, quantity: str) -> str:
        """Unit of a quantity; "" for a number without dimension or in scaled units."""
        return UNITS.get(quantity, "") if self.si else ""

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
            factor = self.factor(self._measured(dataset, name)) if name in dataset else 1.0
            if factor != 1.0:
                array = dataset[name].variable.copy(data=dataset[name].values * factor)
                put = dataset.assign_coords if name in dataset.coords else dataset.assign
                dataset = put({name: array})
        return dataset

    def quantity_of(self, name: str) -> str:
        """Quantity of a parameter or a coordinate; "" for a plain number or an angle."""
        if COORDINATE.fullmatch(name):
            return of_coordinate(name)
        return self.parameters.get(name, Measure()).quantity

    def _measured(self, dataset: xr.Dataset, name: str) -> str:
        """Quantity of a variable, a parameter or a start of a sweep; "" for a plain number."""
        if stated := dataset[name].attrs.get("quantity"):
            return str(stated)
        known = name in dataset.coords or COORDINATE.fullmatch(name)
        return self.quantity_of(name) if known else ""


def units_of(*systems: object) -> Units:
    """Units of figures of some systems: SI if all have the same scales."""
    found = {scales_of(system) for system in systems}
    scales = found.pop() if len(found) == 1 else None
    parameters = {name: one for system in systems for name, one in measures_of(system).items()}
    return Units(scales or Scales(), scales is not None, parameters)


def units_of_sweep(members: xr.Dataset) -> Units:
    """Units of a dataset, by the system in its attributes."""
    text = members.attrs.get("system_numbers")
    return units_of(system_of(text) if text else None)


def of_coordinate(name: str) -> str:
    """Quantity of x1, v1, ... and phase."""
    return COORDINATES.get(name[0], "")
