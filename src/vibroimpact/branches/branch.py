"""Branch of periodic orbits: arrays along it, its special points, the reasons of its ends."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from vibroimpact._core.checks import check_index
from vibroimpact._core.deferred import deferred
from vibroimpact._core.labels import counted, labelled
from vibroimpact._core.types import Complexes, Flags, Floats
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation import Curve
from vibroimpact.orbits.orbit import Orbit

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class Branch:
    """Orbits with one signature along a parameter.

    Attributes
    ----------
    parameter
        Name of the parameter.
    bounds
        Range in which it was followed.
    values
        Its values along the branch, shape (n,).
    multipliers
        Multipliers of the full map, shape (n, d).
    admissible, stable
        Shape (n,); stable orbits are admissible.
    clearance
        Least gap between the impacts, infinite where no gap has an extremum, shape (n,).
    impact_speed
        Smallest closing speed of an impact, shape (n,).
    special_points
        :class:`BifurcationPoint` in order along the branch.
    curve
        The continued curve: unknowns, residuals, Newton steps, reasons of both ends.
    """

    parameter: str
    bounds: tuple[float, float]
    values: Floats
    multipliers: Complexes = field(repr=False)
    admissible: Flags = field(repr=False)
    stable: Flags = field(repr=False)
    clearance: Floats = field(repr=False)
    impact_speed: Floats = field(repr=False)
    special_points: tuple[BifurcationPoint, ...]
    curve: Curve = field(repr=False)
    family: OrbitFamily = field(repr=False)

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, label: str) -> BifurcationPoint:
        return labelled(self.special_points, label)

    def orbit(self, index: int) -> Orbit:
        """Return the orbit at a point of the branch; the last has the index -1."""
        check_index("index", index, len(self))
        return self.family.orbit(self.curve.z[index], float(self.values[index]))

    @property
    def symbol(self) -> str:
        """Symbol n-p-q of its orbits."""
        return self.orbit(0).symbol

    @property
    def extent(self) -> tuple[float, float]:
        """Least and largest value of the parameter on the branch, folds included."""
        every = [*self.values, *(point.parameter for point in self.special_points)]
        return float(min(every)), float(max(every))

    @property
    def stable_share(self) -> float:
        """Share of ``extent`` at which an orbit of the branch is stable."""
        share: float = deferred("branches.profile", "stable_share")(self)
        return share

    def plot(self, variable: str = "v1", *, ax: Axes | None = None) -> Axes:
        """Draw the branch; see :func:`vibroimpact.plotting.plot_branches`."""
        axes: Axes = deferred("plotting.branches", "plot_branches")(
            [self], variable=variable, ax=ax
        )
        return axes

    def to_dataset(self) -> xr.Dataset:
        """Convert the branch to an xarray dataset, as :func:`vibroimpact.save_branch` writes it."""
        dataset: xr.Dataset = deferred("branches.store", "dataset_of")(self)
        return dataset

    def __repr__(self) -> str:
        found = counted(point.kind for point in self.special_points)
        low, high = self.extent
        lines = [
            f"Branch of {self.symbol} orbits, {self.parameter} {low:.8g} to {high:.8g}, "
            f"{self.stable_share:.0%} of it stable; {found}",
            *(f"  {point!r}" for point in self.special_points),
            f"  ends: {self.curve.ends[0]}; {self.curve.ends[1]}",
        ]
        return "\n".join(lines)
