"""Branch of periodic orbits: arrays along it, its special points, the reasons of its ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vibroimpact._core.checks import check_index
from vibroimpact._core.labels import counted, labelled
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import (
    AnyAmounts,
    AnyComplexes,
    AnyFloats,
    Bounds,
    Count,
    Flags,
    Floats,
    Integers,
)
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation import Curve
from vibroimpact.machines.units import units_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.stability import Stability
from vibroimpact.results.result import INSIDE, Result, along, rows


class Reached(NamedTuple):
    """Result of following what begins at a special point."""

    # number of the branch and label of the point
    branch: Count
    label: str
    # number of the branch that was found there or was known; None where there is none
    to: int | None
    how: str  # "new"; "known", "mirror image"; or the reason why there is none


@dataclass(frozen=True, eq=False)
class Branch(Result):
    """Orbits with one signature along a parameter; with :attr:`others` those with which it goes on.

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
    stability
        :class:`Stability` by number: 0 stable, 1 neutral, 2 unstable, 3 not admissible; shape (n,).
    clearance
        Least gap between the impacts, infinite where no gap has an extremum, shape (n,).
    impact_speed
        Smallest closing speed of an impact, shape (n,).
    special_points
        :class:`BifurcationPoint` in order along the branch.
    curve
        The continued curve: unknowns, residuals, Newton steps, reasons of both ends.
    progress
        How far each coordinate advances in a period, zero where nothing drifts, shape (n, coordinates).
    others
        Branches of other sequences with which it goes on where its own orbits end to be motions, in the order in
        which they were found; each has its own points and special points.
    reached
        :class:`Reached`, one for every special point at which orbits end to be motions: which branch begins there. The
        branch itself is number 0, ``others[k]`` number k + 1.
    """

    parameter: str
    bounds: Bounds
    values: Floats = field(metadata=along("point"))
    multipliers: AnyComplexes = field(metadata=along("point", "multiplier"), repr=False)
    stability: Integers = field(metadata=along("point", codes=Stability), repr=False)
    clearance: AnyFloats = field(metadata=along("point", quantity="length"), repr=False)
    impact_speed: AnyAmounts = field(metadata=along("point", quantity="velocity"), repr=False)
    special_points: tuple[BifurcationPoint, ...] = field(metadata=rows("special", "kind"))
    curve: Curve = field(metadata=INSIDE, repr=False)
    family: OrbitFamily = field(repr=False)
    progress: Floats = field(metadata=along("point", "coordinate", quantity="length"), repr=False)
    others: tuple[Branch, ...] = field(default=(), repr=False)
    reached: tuple[Reached, ...] = field(default=(), metadata=rows("reached"), repr=False)

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
    def stable(self) -> Flags:
        """Whether the orbits are stable, shape (n,)."""
        return np.equal(self.stability, Stability.STABLE)

    @property
    def admissible(self) -> Flags:
        """Whether the orbits are motions of the machine, shape (n,)."""
        return np.not_equal(self.stability, Stability.INADMISSIBLE)

    @property
    def extent(self) -> tuple[float, float]:
        """Least and largest value of the parameter on the branch, folds included."""
        every = [*self.values, *(point.parameter for point in self.special_points)]
        return float(min(every)), float(max(every))

    @property
    def stable_share(self) -> float:
        """Share of ``extent`` at which an orbit of the branch is stable."""
        points = profile(self)
        stretches = np.sort(np.column_stack([points.parameter[:-1], points.parameter[1:]]), axis=1)
        covered, reached = 0.0, -math.inf
        for low, high in sorted(map(tuple, stretches[points.stability == Stability.STABLE])):
            covered += max(0.0, high - max(low, reached))
            reached = max(reached, high)
        low, high = self.extent
        return covered / (high - low) if low < high else float(self.stable.all())

    def to_dataset(self) -> xr.Dataset:
        """Convert the branch to an xarray dataset: its points, and its special points."""
        data = super().to_dataset()
        units = units_of(self.family.system)
        known = dict.fromkeys(("values", "special_parameter"), units.quantity_of(self.parameter))
        return units.of_variables(data, known).assign_attrs(
            system=repr(self.family.system), symbol=self.symbol
        )

    def __repr__(self) -> str:
        found = counted(point.kind for point in self.special_points)
        units, (low, high) = units_of(self.family.system), self.extent
        ends = units.of_parameter(self.parameter, low, high, digits=8)
        lines = [
            f"Branch of {self.symbol} orbits, {self.parameter} {ends}, "
            f"{self.stable_share:.0%} of it stable; {found}",
            *(f"  {point!r}" for point in self.special_points),
            f"  ends: {self.curve.ends[0]}; {self.curve.ends[1]}",
        ]
        return "\n".join([*lines, *map(repr, self.others)])


# ---- points and special points in order ------------------------------------------------------------


class BranchProfile(NamedTuple):
    """Points and special points of a branch in the order of its arclength."""

    parameter: Floats  # shape (m,)
    z: Floats  # unknowns, shape (m, d)
    special: Integers  # number of the special point, -1 for others, shape (m,)
    stability: Integers  # Stability of the stretch from each point to the next, shape (m - 1,)

    @staticmethod
    def dims_of() -> dict[str, tuple[str, ...]]:
        """Dims of its entries."""
        return {
            "parameter": ("point",),
            "z": ("point", "unknown"),
            "special": ("point",),
            "stability": ("point-1",),
        }


def place_of(branch: Branch, point: BifurcationPoint) -> tuple[int, float]:
    """(index of the nearest point of the branch, arclength) of a special point.

    The arclength is that of the projection onto the tangent there, right to second order of the
    distance between points.
    """
    sizes = branch.family.scale()
    points = np.column_stack([branch.curve.z, branch.values]) / sizes
    away = np.append(point.z, point.parameter) / sizes - points
    nearest = int(np.argmin(np.linalg.norm(away, axis=1)))
    tangent = branch.curve.tangent[nearest] / sizes
    step = float(away[nearest] @ tangent) / float(tangent @ tangent)
    return nearest, float(branch.curve.arclength[nearest]) + step


def profile(branch: Branch) -> BranchProfile:
    """Points and special points of a branch in order."""
    found = branch.special_points
    places = [place_of(branch, point)[1] for point in found]
    order = np.argsort(np.concatenate([branch.curve.arclength, places]), kind="stable")
    special = np.concatenate([np.full(len(branch), -1), np.arange(len(found))]).astype(np.int64)
    stability = np.concatenate([branch.stability, np.full(len(found), -1)]).astype(np.int64)[order]
    parameter = np.concatenate([branch.values, [p.parameter for p in found]])[order]
    z = np.vstack([branch.curve.z, *(point.z[None] for point in found)])[order]
    moves: Flags = np.any(np.diff(np.column_stack([z, parameter]), axis=0), axis=1)
    return BranchProfile(parameter, z, special[order], _with_short_ends(_between(stability), moves))


def _between(stability: Integers) -> Integers:
    """Stability between points: the worse of both ends; special points (-1) do not count.

    Nor does a neutral point beside one that is not: a branch may begin at a bifurcation.
    """
    first, second = stability[:-1], stability[1:]
    stretches = np.maximum(first, second)
    for one, other in ((first, second), (second, first)):
        apart = (one == Stability.NEUTRAL) & (other >= 0)
        stretches[apart] = other[apart]
    unknown = np.flatnonzero(stretches < 0)  # between two special points
    known = np.flatnonzero(stability >= 0)
    for i in unknown:
        near = stability[known[np.argmin(np.abs(known - i))]]
        stretches[i] = max(near, Stability.UNSTABLE)
    return stretches


def _with_short_ends(stretches: Integers, moves: Flags) -> Integers:
    """Give parts of no length, to a special point at an end, the stability of their neighbours."""
    beside = np.where(np.arange(len(stretches)) > 0, -1, 1) + np.arange(len(stretches))
    return np.where(moves, stretches, stretches[np.minimum(beside, len(stretches) - 1)])
