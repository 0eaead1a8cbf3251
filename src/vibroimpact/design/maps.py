"""Design maps: an objective over a plane of parameters, and how far it is better than without impacts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import check_memory, check_progress, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.types import AnyFloats, Floats
from vibroimpact.design.objective import Judge, Objective, judge_of
from vibroimpact.design.optimise import TOLERATED_DECIBELS, label_of
from vibroimpact.machines.units import units_of
from vibroimpact.model.system import System
from vibroimpact.results.result import Result, sized
from vibroimpact.sweeps.axes import parameter_axes

BYTES_PER_MACHINE = 2**8  # parameters, value, reduction
BATCH_MACHINES = 64  # so many machines are simulated together


@dataclass(frozen=True, eq=False)
class DesignMap(Result):
    """An objective over a plane of two parameters.

    Attributes
    ----------
    system, objective
        The machine that is judged, and the objective.
    axes
        Values of the two parameters, by name.
    value
        The objective, shape (len(first), len(second)), NaN of machines without one.
    reduction_db
        By how many decibels it is better than the machine as given, all stops open; the same shape.
    """

    system: System
    objective: Objective
    axes: dict[str, Floats]
    value: AnyFloats = field(metadata=sized("first", "second"), repr=False)
    reduction_db: AnyFloats = field(metadata=sized("first", "second"), repr=False)
    judge: Judge = field(repr=False)

    @property
    def best(self) -> dict[str, float]:
        """Parameters of the best machine of the plane."""
        i, j = np.unravel_index(int(np.nanargmin(self._signed)), self.value.shape)
        first, second = self.axes
        return {first: float(self.axes[first][i]), second: float(self.axes[second][j])}

    @property
    def ridge(self) -> Floats:
        """Best value of the second parameter for each of the first; NaN without one."""
        signed = np.where(np.isnan(self._signed), np.inf, self._signed)
        values = list(self.axes.values())[1][np.argmin(signed, axis=1)]
        return np.where(np.isinf(signed.min(axis=1)), np.nan, values)

    @property
    def within(self) -> Any:
        """Whether a machine is within 1 dB of the best one of the plane."""
        best = float(self.objective.sign * np.nanmin(self._signed))
        loss = [-self.judge.decibels(value, best) for value in self.value.ravel().tolist()]
        return np.reshape(loss, self.value.shape) <= TOLERATED_DECIBELS

    @property
    def _signed(self) -> Floats:
        return self.objective.sign * self.value

    @property
    def label(self) -> str:
        """Text of the objective: "worst amplitude of x1 over omega"."""
        return label_of(self.judge)

    def to_dataset(self) -> xr.Dataset:
        """Convert to a dataset over the plane.

        Returns
        -------
        Dataset
            value, reduction_db and within_1db over both parameters; and best_<second parameter> over
            the first.
        """
        units = units_of(self.system)
        first, second = self.axes
        attrs = {name: units.attrs(units.quantity_of(name)) for name in self.axes}
        return xr.Dataset(
            {
                "value": (
                    (first, second), self.value,
                    units.attrs(self.judge.measure.dimension) | {"long_name": self.label},
                ),
                "reduction_db": ((first, second), self.reduction_db, {"units": "dB"}),
                "within_1db": ((first, second), self.within),
                f"best_{second}": (first, self.ridge, attrs[second]),
            },
            coords={name: (name, values, attrs[name]) for name, values in self.axes.items()},
            attrs={"objective": repr(self.objective), "system": repr(self.system)},
        )  # fmt: skip


@interruptible
def design_map(
    system: System,
    over: Mapping[str, ArrayLike],
    objective: Objective,
    *,
    workers: int | None = None,
    progress: ProgressOption = True,
) -> DesignMap:
    """Judge machines over a plane of two parameters.

    Parameters
    ----------
    system
        A forced machine.
    over
        Values of two parameters by name, rising.
    objective
        An :class:`~vibroimpact.Objective`.
    workers
        Threads; by default one per core.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every group of machines.

    Returns
    -------
    DesignMap
        The reduction beside the machine without impacts, best second parameter for each first one,
        and the region within 1 dB of the best.

    Raises
    ------
    InvalidParameterError
        Not two parameters, values that the machine refuses, and as :func:`~vibroimpact.optimise`.

    Notes
    -----
    Cost: that of :class:`~vibroimpact.Objective` for each machine.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6,
    ...                          half_clearance=10.0, omega=1.0)
    >>> found = vi.design_map(damper, {"mass_ratio": [0.05, 0.1], "half_clearance": [5, 10, 20]},
    ...                       vi.Objective("omega", (0.9, 1.1), "x1", points=5, starts=2),
    ...                       progress=False)
    >>> found.reduction_db.shape
    (2, 3)
    """
    axes = parameter_axes(system, over)
    if len(axes) != 2:
        raise refusal("over", list(axes), "two parameters with their values")
    for name, values in axes.items():
        if np.any(np.diff(values) <= 0.0):
            raise InvalidParameterError(f"over[{name!r}]: must rise.")
    check_progress(progress)
    machines = math.prod(map(len, axes.values()))
    check_memory("over", machines, BYTES_PER_MACHINE, "Give fewer values.")
    judge = judge_of(system, objective, tuple(axes), workers)
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    table, shape = np.column_stack([part.ravel() for part in mesh]), mesh[0].shape
    groups = np.array_split(table, -(-len(table) // BATCH_MACHINES))
    found = list[float]()
    with Reporter(progress, "design map") as report:
        for some in report.track(groups, len(table), "machines", size=len):
            found += judge.values(some).tolist()
    gains = [judge.decibels(value, judge.without_impacts) for value in found]
    if not np.isfinite(found).any():
        raise InvalidParameterError("objective: no machine of the plane has a value.")
    return DesignMap(
        system, objective, axes, np.reshape(found, shape), np.reshape(gains, shape), judge
    )
