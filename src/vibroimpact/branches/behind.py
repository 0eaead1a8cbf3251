"""Attractors behind branches: one motion followed up and down the range of the parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.attractors.sweep_attractor import Step, sweep_attractor
from vibroimpact.branches.branch import Branch
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.state import State
from vibroimpact.model.system import System
from vibroimpact.simulation.sections import Section

if TYPE_CHECKING:
    import xarray as xr

SETTLED, KEPT = 1000, 60  # impacts discarded, section points kept at every value


def swept(branch: Branch, state: State, values: Floats) -> xr.Dataset:
    """Section points at the stop where the orbits of a branch begin.

    Parameters
    ----------
    branch
        Says system, parameter and stop.
    state
        Start at the first value.
    values
        Of the parameter, followed in this order ("up") and back ("down").

    Returns
    -------
    Dataset
        x1, ..., v1, ..., phase with dims "direction", the parameter, "point"; NaN where a motion
        does not reach the stop.
    """
    import xarray as xr

    family = branch.family
    first = family.signature.impacts[0]

    def system(value: float) -> System:
        return with_parameter(family.system, branch.parameter, value)

    def followed(values: Floats, state: State) -> list[Step]:
        return sweep_attractor(
            system,
            None,
            values,
            state,
            settle=SETTLED,
            keep=KEPT,
            stop=first.name,
            contact=first.contact,
        )

    up = followed(values, state)
    down = followed(values[::-1], up[-1].last)[::-1]
    columns = np.array([[_padded(step.section) for step in way] for way in (up, down)])
    dims = ("direction", branch.parameter, "point")
    degrees = family.mechanism.degrees
    names = [f"{kind}{i + 1}" for kind in "xv" for i in range(degrees)] + ["phase"]
    return xr.Dataset(
        {name: (dims, columns[..., i]) for i, name in enumerate(names)},
        coords={"direction": ["up", "down"], branch.parameter: values},
    )


def _padded(section: Section) -> Floats:
    """(x, v, phase) of KEPT section points; missing ones are NaN."""
    rows = np.full((KEPT, 2 * section.position.shape[1] + 1), np.nan)
    rows[: len(section)] = np.column_stack([section.position, section.velocity, section.phase])
    return rows
