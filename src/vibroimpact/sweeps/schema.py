"""Schema of a sweep's dataset: variables, coordinates and attributes, known before it runs."""

from __future__ import annotations

import json
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Arrays
from vibroimpact.machines.json_text import text_of
from vibroimpact.machines.units import Units, units_of
from vibroimpact.sweeps.observers.observer import Variable
from vibroimpact.sweeps.observers.selection import variables_of
from vibroimpact.sweeps.options import call_of
from vibroimpact.sweeps.plan import Plan
from vibroimpact.sweeps.specification import SPECIFICATION_ATTRIBUTE, SweepSpec

Coordinate = tuple[tuple[str, ...], NDArray[Any], dict[str, Any]]  # dims, values, attributes

END = "end"  # the variable that every sweep has
STATE_NAMES = {"x": "position of coordinate", "v": "velocity of coordinate"}


class Schema(NamedTuple):
    """Dataset of a sweep without its results."""

    grid: dict[str, int]  # names and sizes of the dimensions of the grid
    # by name: dimensions and sizes beyond those of the grid, type, fill value, attributes
    variables: dict[str, Variable]
    coords: dict[str, Coordinate]  # by name: (dimensions, values, attributes)
    attrs: dict[str, Any]  # attributes from which the sweep can be repeated

    @property
    def member_bytes(self) -> int:
        """Size of the results of one member."""
        return sum(math.prod(v.shape) * v.dtype.itemsize for v in self.variables.values())

    def dims(self, name: str) -> tuple[str, ...]:
        """All dimensions of a variable."""
        return (*self.grid, *self.variables[name].dims)

    def shape(self, name: str) -> tuple[int, ...]:
        """All sizes of a variable."""
        return (*self.grid.values(), *self.variables[name].shape)

    def empty(self) -> Arrays:
        """Arrays to fill."""
        return {
            name: np.full(self.shape(name), v.fill, dtype=v.dtype)
            for name, v in self.variables.items()
        }

    def dataset(self, arrays: Arrays) -> xr.Dataset:
        """Dataset with these results."""
        data = {
            name: (self.dims(name), arrays[name], v.attrs) for name, v in self.variables.items()
        }
        return xr.Dataset(data, coords=self.coords, attrs=self.attrs)


def schema_of(plan: Plan, specification: SweepSpec) -> Schema:
    """Schema of a plan's dataset.

    Raises
    ------
    InvalidParameterError
        A name that is used twice.
    """
    units = units_of(plan.system)
    variables = {
        name: one._replace(attrs=one.attrs | units.attrs(str(one.attrs.get("quantity", ""))))
        for name, one in variables_of(plan.observers, plan.mechanism).items()
    }
    coords: dict[str, Coordinate] = {
        name: ((name,), axis, _attrs(name, units)) for name, axis in plan.axes.items()
    }
    for name in plan.starts.dims:
        _refuse_known(name, plan.axes)
    for name, (dim, values) in plan.starts.coords.items():
        _refuse_known(name, coords)
        coords[name] = ((dim,), values, _attrs(name, units))
    own = {dim for v in variables.values() for dim in v.dims}
    for name in {*variables, *own}:
        _refuse_known(name, {*coords, *plan.dims})
    return Schema(plan.dims, variables, coords, _attrs_of(plan, specification))


def _refuse_known(name: str, known: Any) -> None:
    if name in known:
        raise InvalidParameterError(
            f"over = {name!r}: is also the name of a start or of a result. Rename the parameter, "
            "or take another label."
        )


def _attrs(name: str, units: Units) -> dict[str, Any]:
    """Attributes of a coordinate."""
    kind = STATE_NAMES.get(name[0]) if name[1:].isdigit() else None
    text = f"{kind} {name[1:]} at the start" if kind else name.replace("_", " ")
    known = {"units": "rad"} if name == "phase" else units.attrs(units.quantity_of(name))
    return {"long_name": text} | known


def _attrs_of(plan: Plan, specification: SweepSpec) -> dict[str, Any]:
    """Attributes from which the sweep can be repeated; no date: equal sweeps have equal bytes."""
    described = json.loads(specification.text)
    seed = {name: x for name, x in described["start"].items() if name == "seed"}
    return seed | {
        **call_of("sweep"),
        "system": repr(plan.system),
        "system_numbers": text_of(plan.system),
        "mechanism": text_of(plan.mechanism),
        "impact_law": plan.mechanism.impact_law,
        "swept": ", ".join(plan.axes),
        "sizes": json.dumps(plan.dims),
        "start": json.dumps(described["start"]),
        "observe": json.dumps(described["observe"]),
        "settle_periods": plan.window.settle_periods,
        "periods": plan.window.periods,
        "most_impacts": plan.window.most_impacts,
        "follow": plan.follow or "",
        "version": _kernel.version(),
        SPECIFICATION_ATTRIBUTE: specification.text,
    }
