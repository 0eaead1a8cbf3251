"""Curve of bifurcations in two parameters, whose special points are of codimension two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_index
from vibroimpact._core.labels import counted, labelled
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import AnyComplexes, Flags, Floats
from vibroimpact.bifurcations.augmented import Augmented, Bounds
from vibroimpact.bifurcations.tests_along import COSINE
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation import Curve, End
from vibroimpact.machines.units import Units, units_of
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.results.result import INSIDE, Result, along, rows


@dataclass(frozen=True, eq=False)
class BifurcationCurve(Result):
    """Bifurcations of one kind in the plane of two parameters, in order along the curve.

    Attributes
    ----------
    record
        What is known of its kind, one of codimension one.
    names
        Names of the two parameters.
    bounds
        Their ranges.
    values
        Both parameters, shape (n, 2).
    multipliers
        Of the map: of the half map for symmetric orbits; shape (n, d).
    admissible
        Whether the orbit is a motion of the machine, shape (n,).
    neutral
        For NS: whether the critical pair is real, so that the point is a neutral saddle and no bifurcation; shape
        (n,).
    special_points
        :class:`BifurcationPoint` in order along the curve.
    curve
        The continued curve: unknowns, residuals, reasons of both ends, parts in which points may be missing.
    problem
        Its equations.
    """

    record: PointKind
    names: tuple[str, str]
    bounds: tuple[Bounds, Bounds]
    values: Floats = field(metadata=along("point", "parameter"))
    multipliers: AnyComplexes = field(metadata=along("point", "multiplier"), repr=False)
    admissible: Flags = field(metadata=along("point"), repr=False)
    neutral: Flags = field(metadata=along("point"), repr=False)
    special_points: tuple[BifurcationPoint, ...] = field(metadata=rows("special", "kind"))
    curve: Curve = field(metadata=INSIDE, repr=False)
    problem: Augmented = field(repr=False)

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, label: str) -> BifurcationPoint:
        return labelled(self.special_points, label)

    @property
    def kind(self) -> str:
        """Label of its kind."""
        return self.record.label

    @property
    def ends(self) -> tuple[End, End]:
        """Reasons why the curve ended, before its start and after it."""
        return self.curve.ends

    def orbit(self, index: int) -> Any:
        """Return the orbit, or fixed point, at a point of the curve."""
        check_index("index", index, len(self))
        return self.problem.orbit(self.curve.z[index], float(self.values[index, 1]))

    @property
    def angle(self) -> Floats:
        """Angle of the critical multiplier of NS in turns, in [0, 1/2]; NaN on neutral saddles; shape (n,)."""
        if self.record.critical != (None,):
            return np.full(len(self), np.nan)
        tests = self.curve.tests[COSINE]
        inside = np.where(self.neutral, np.nan, np.clip(tests, -1.0, 1.0))
        turns: Floats = np.arccos(inside) / (2.0 * np.pi)
        return turns

    def to_dataset(self) -> xr.Dataset:
        """Convert the curve to an xarray dataset: its points, by name of the parameter, and its special points."""
        data = super().to_dataset().assign(angle=("point", self.angle, {"units": "rad"}))
        for k, name in enumerate(self.names):
            at = [point.parameters[name] for point in self.special_points]
            data = data.assign({
                name: ("point", self.values[:, k]),
                f"special_{name}": ("special", np.array(at, dtype=float)),
            })  # fmt: skip
        data["values"].attrs |= units_of_curves([self]).of_entries(self.names)
        return with_units_of([self], self.names, data.assign_coords(parameter=list(self.names)))

    def __repr__(self) -> str:
        found, units = counted(point.kind for point in self.special_points), units_of_curves([self])
        ranges = ", ".join(
            f"{name} {units.of_parameter(name, column.min(), column.max(), digits=5)}"  # of points: no extrema
            for name, column in zip(self.names, self.values.T, strict=True)
        )
        lines = [
            f"Curve of {self.kind} points, {ranges}, {np.mean(self.admissible):.0%} of them admissible; {found}",
            *(f"  {point!r}" for point in self.special_points),
            f"  ends: {self.ends[0]}; {self.ends[1]}",
        ]
        return "\n".join(lines)

    def __str__(self) -> str:
        parts = [
            f"  {part.name} is not resolved from point {part.first} to {part.last}: {part.reason}"
            for part in self.curve.unresolved
        ]
        points = (line for point in self.special_points for line in _coefficients(point))
        return "\n".join([repr(self), *points, *parts])


def _coefficients(point: BifurcationPoint) -> list[str]:
    """Text of the coefficients and of what is born, or why there are none; empty for weak resonances and touches."""
    form = point.normal_form
    if isinstance(form, Refusal):
        none = not point.record.critical
        return [] if none else [f"{point.label}: {form.reason}"]
    listed = [f"{name} = {_number(value)}" for name, value in form.numbers.items()]
    return [f"{point.label}: {', '.join(listed)}", f"  {form.meaning}"]


def _number(value: Any) -> str:
    """A number, several, or the words that stand in its place."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_number, value))})"
    if isinstance(value, complex):
        return f"{value.real:.12g}{value.imag:+.12g}j"
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def units_of_curves(curves: Sequence[BifurcationCurve]) -> Units:
    """Units of the machines of curves; none of maps."""
    return units_of(*(getattr(curve.problem.equations, "system", None) for curve in curves))


def with_units_of(
    curves: Sequence[BifurcationCurve], names: Sequence[str], data: xr.Dataset
) -> xr.Dataset:
    """A dataset with the units of the parameters of curves."""
    units = units_of_curves(curves)
    known = {
        f"{part}{name}": units.quantity_of(name) for part in ("", "special_") for name in names
    }
    return units.of_variables(data, known)


def of_curves(curves: Sequence[BifurcationCurve], names: tuple[str, str]) -> dict[str, Any]:
    """Variables of several curves: all points and special points, with the number of the curve, and the kinds."""
    special = [(k, point) for k, curve in enumerate(curves) for point in curve.special_points]
    order = [[curve.names.index(name) for name in names] for curve in curves]
    values = np.vstack([c.values[:, columns] for c, columns in zip(curves, order, strict=True)])
    return {
        **{name: ("point", values[:, k]) for k, name in enumerate(names)},
        "curve": ("point", np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])),
        "admissible": ("point", np.concatenate([curve.admissible for curve in curves])),
        "neutral": ("point", np.concatenate([curve.neutral for curve in curves])),
        "curve_kind": ("curves", [curve.kind for curve in curves]),
        "special_kind": ("special", [point.kind for _, point in special]),
        "special_label": ("special", [point.label for _, point in special]),
        "special_curve": ("special", [k for k, _ in special]),
        **{f"special_{n}": ("special", [p.parameters[n] for _, p in special]) for n in names},
    }
