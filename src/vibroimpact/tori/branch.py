"""Family of invariant circles in a parameter: the circles, events along it, reasons of its ends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.labels import counted, labelled
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Bounds, Count, Flags, Floats
from vibroimpact.branches.kinds import NS, PD, SN
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation.curve import End
from vibroimpact.machines.units import units_of
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.results.result import Result, rows
from vibroimpact.tori.circle import Circle


def _of_circles(kind: PointKind, meaning: str) -> PointKind:
    """Kind of special point of a family of circles: of a normal multiplier where that of orbits is of a multiplier."""
    return replace(kind, meaning=meaning, normal_form=None, begins=None, in_half_map=None)


BREAKING = _of_circles(PD, "symmetry breaking: two circles that are mirror images are born")
OF_CIRCLES = {
    1.0: _of_circles(SN, "fold: two circles meet"),
    -1.0: _of_circles(PD, "torus doubling"),
    None: _of_circles(NS, "second Neimark-Sacker: a three-frequency torus may be born"),
}
"""Kinds by the normal multiplier that is critical, -1 also for one of modulus 1 of a one-sided direction."""


@dataclass(frozen=True, eq=False)
class CircleBranch(Result):
    """Family of invariant circles with one signature along a parameter.

    Attributes
    ----------
    parameter
        Name of the parameter.
    bounds
        Range in which it was followed.
    circles
        Every :class:`Circle`, in order along the family.
    special_points
        :class:`~vibroimpact.BifurcationPoint` in order along the family, whose ``orbit`` is the circle there.
    ends
        :class:`End` before the first and after the last circle.
    start
        Index of the circle it was started from.
    """

    parameter: str
    bounds: Bounds
    circles: tuple[Circle, ...] = field(repr=False)
    special_points: tuple[BifurcationPoint, ...] = field(metadata=rows("special", "kind"))
    ends: tuple[End, End]
    start: Count

    def __len__(self) -> int:
        return len(self.circles)

    def __getitem__(self, label: str) -> BifurcationPoint:
        return labelled(self.special_points, label)

    @property
    def values(self) -> Floats:
        """Values of the parameter, shape (n,)."""
        return np.array([circle.value for circle in self.circles])

    @property
    def rotation_numbers(self) -> Floats:
        """Rotation numbers per iterate of F, shape (n,), without jumps."""
        return np.array([circle.rotation_number for circle in self.circles])

    @property
    def normal_exponents(self) -> Floats:
        """Normal exponents per iterate of F, largest first, shape (n, d - 1)."""
        return np.array([circle.normal_exponents for circle in self.circles])

    @property
    def clearance(self) -> Floats:
        """Least gap between the impacts along each circle, shape (n,)."""
        return np.array([circle.clearance_to_grazing for circle in self.circles])

    @property
    def stable(self) -> Flags:
        """Whether each circle attracts and is admissible, shape (n,)."""
        return np.array([circle.stable for circle in self.circles])

    def to_dataset(self) -> xr.Dataset:
        """Convert the numbers along the family to an xarray dataset, with the special points."""
        of_each = ("residual", "nodes", "radius", "decay", "roughness", "least_angle")
        each = {name: ("point", [getattr(c, name) for c in self.circles]) for name in of_each}
        of_all = ("values", "rotation_numbers", "clearance", "stable")
        units = units_of(self.circles[0].system)
        known = dict.fromkeys(("values", "special_parameter"), units.quantity_of(self.parameter))
        return units.of_variables(
            super()
            .to_dataset()
            .assign({name: ("point", getattr(self, name)) for name in of_all} | each)
            .assign(normal_exponents=(("point", "normal"), self.normal_exponents))
            .assign_attrs(
                system=repr(self.circles[0].system), signature=repr(self.circles[0].signature)
            ),
            known | {"clearance": "length"},
        )

    def __repr__(self) -> str:
        found = counted((point.kind for point in self.special_points), "no event")
        values, rhos = self.values, self.rotation_numbers
        units = units_of(self.circles[0].system)
        ends = units.of_parameter(self.parameter, values.min(), values.max(), digits=8)
        lines = [
            f"Family of {len(self)} circles, {self.parameter} {ends}, "
            f"rotation number {rhos.min():.6g} to {rhos.max():.6g}; {found}",
            *(f"  {point!r}" for point in self.special_points),
            f"  ends: {self.ends[0]}; {self.ends[1]}",
        ]
        return "\n".join(lines)
