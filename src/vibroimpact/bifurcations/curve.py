"""Curve of bifurcations in two parameters, and its points of codimension two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from vibroimpact._core.checks import check_index
from vibroimpact._core.labels import counted, labelled
from vibroimpact._core.types import Complexes, Flags, Floats
from vibroimpact.bifurcations.augmented import Augmented, Bounds
from vibroimpact.bifurcations.grazing_contact import Touching, grazing_contact
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.branches.branch import MEANINGS as BRANCH_MEANINGS
from vibroimpact.branches.branch import is_admissible
from vibroimpact.continuation import Curve, End
from vibroimpact.normal_forms import codimension_two
from vibroimpact.normal_forms.critical import Refusal, Status
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.results.result import INSIDE, Result, along, rows

if TYPE_CHECKING:
    import xarray as xr

TOUCHES = ("GR", "ZERO", "SIM", "STICK")
MEANINGS = {
    "CP": "cusp: two folds meet",
    "GPD": "generalised flip: a fold of the doubled orbits begins",
    "CH": "Chenciner point: a fold of circles begins",
    "R1": "resonance 1:1, two multipliers 1: SN and NS touch",
    "R2": "resonance 1:2, two multipliers -1: PD and NS touch",
    "R3": "resonance 1:3: a saddle orbit of period three shrinks to the point",
    "R4": "resonance 1:4: orbits of period four compete with the circle",
    "LPPD": "fold-flip: multipliers 1 and -1",
    "LPNS": "fold and Neimark-Sacker: multipliers 1 and a pair",
    "PDNS": "flip and Neimark-Sacker: multipliers -1 and a pair",
    "NSNS": "two pairs on the unit circle",
    "WEAK": "weak resonance: a tongue of locked orbits begins",
    "BP": "two curves of this kind cross",
} | {kind: BRANCH_MEANINGS[kind] for kind in TOUCHES}


@dataclass(frozen=True, eq=False)
class CodimensionTwoPoint:
    """Special point of a curve of bifurcations.

    Attributes
    ----------
    kind
        "CP", "GPD", "CH", "R1" to "R4", "LPPD", "LPNS", "PDNS", "NSNS", "WEAK", "BP", or a touch of the orbit:
        "GR", "ZERO", "SIM", "STICK".
    label
        Kind, or for a weak resonance p/q, and number along the curve: "R4_1", "2/9_1".
    parameters
        Values of both parameters by name.
    error
        Estimated error of the second parameter.
    orbit
        The orbit there, or the :class:`~vibroimpact.normal_forms.explicit.FixedPoint` of a map.
    curve_kind
        Kind of the curve.
    multipliers
        Multipliers of the map whose resonance it is: of the half map for symmetric orbits.
    resonance
        (p, q) of R1 to R4 and of weak resonances; else None.
    nearest
        For GR: the stop that is touched, and where.
    segment
        For ZERO and STICK the number of the solved impact, for SIM that of the flight; else -1.
    """

    kind: str
    label: str
    parameters: Mapping[str, float]
    error: float
    orbit: Any
    curve_kind: str
    multipliers: Complexes = field(repr=False)
    resonance: tuple[int, int] | None
    nearest: Nearest | None
    arclength: float
    z: Floats = field(repr=False)  # unknowns of the curve's problem, the first parameter last
    tangent: Floats = field(repr=False)
    problem: Augmented = field(repr=False)
    segment: int = -1

    @property
    def meaning(self) -> str:
        """Meaning of the point in words."""
        return MEANINGS[self.kind]

    @property
    def admissible(self) -> bool:
        """Whether the orbit there is a motion of the machine, apart from rounding at a touch."""
        return is_motion(self.orbit, self.kind)

    @cached_property
    def normal_form(self) -> Any:
        """Critical coefficients, at GR and ZERO the contact of the two curves, or a refusal with the reason."""
        if self.kind in ("GR", "ZERO") and isinstance(self.problem.equations, OrbitPlane):
            return grazing_contact(touching(self))
        if self.kind in (*TOUCHES, "WEAK", "BP"):
            reason = f"{self.kind} ({self.meaning}): there are no coefficients of codimension two."
            return Refusal(self.kind, Status.NOT_CRITICAL, reason, self.multipliers)
        z, _, a = self.problem.parts(self.z, self.parameters[self.problem.equations.names[1]])
        return codimension_two(self.kind, self.problem.equations.forms(z, a))

    def __repr__(self) -> str:
        at = ", ".join(f"{name} = {value:.9g}" for name, value in self.parameters.items())
        real = "" if self.admissible else ", not admissible"
        return f"{self.label} at {at}: {self.meaning}{real}"


def touching(point: CodimensionTwoPoint) -> Touching:
    """What the contact of the two curves at a point of kind GR or ZERO is computed from."""
    plane = point.problem.equations
    assert isinstance(plane, OrbitPlane)
    z, _, a = point.problem.parts(point.z, point.parameters[plane.names[1]])
    (low, high), (second_low, second_high) = point.problem.bounds
    return Touching(
        point.kind, point.curve_kind, point.orbit, plane, z, a, point.tangent,
        (high - low, second_high - second_low), point.nearest, point.segment,
    )  # fmt: skip


def is_motion(solution: Any, kind: str = "") -> bool:
    """Whether an orbit is admissible, touches left aside; fixed points of maps always are."""
    return not isinstance(solution, Orbit) or is_admissible(solution, kind)


@dataclass(frozen=True, eq=False)
class BifurcationCurve(Result):
    """Bifurcations of one kind in the plane of two parameters, in order along the curve.

    Attributes
    ----------
    kind
        "SN", "PD", "BP" (of symmetric orbits), "NS", "GR", "ZERO", "SIM", or "level".
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
        :class:`CodimensionTwoPoint` in order along the curve.
    curve
        The continued curve: unknowns, residuals, reasons of both ends, parts in which points may be missing.
    problem
        Its equations.
    """

    kind: str
    names: tuple[str, str]
    bounds: tuple[Bounds, Bounds]
    values: Floats = field(metadata=along("point", "parameter"))
    multipliers: Complexes = field(metadata=along("point", "multiplier"), repr=False)
    admissible: Flags = field(metadata=along("point"), repr=False)
    neutral: Flags = field(metadata=along("point"), repr=False)
    special_points: tuple[CodimensionTwoPoint, ...] = field(metadata=rows("special"))
    curve: Curve = field(metadata=INSIDE, repr=False)
    problem: Augmented = field(repr=False)

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, label: str) -> CodimensionTwoPoint:
        return labelled(self.special_points, label)

    @property
    def ends(self) -> tuple[End, End]:
        """Why the curve ended before its start and after it."""
        return self.curve.ends

    def orbit(self, index: int) -> Any:
        """Return the orbit, or fixed point, at a point of the curve."""
        check_index("index", index, len(self))
        return self.problem.orbit(self.curve.z[index], float(self.values[index, 1]))

    @property
    def angle(self) -> Floats:
        """For NS: the angle of the critical multiplier in turns, in [0, 1/2]; NaN on neutral saddles; shape (n,)."""
        if self.kind != "NS":
            return np.full(len(self), np.nan)
        tests = self.curve.tests["R4"]  # the cosine of the angle
        inside = np.where(self.neutral, np.nan, np.clip(tests, -1.0, 1.0))
        turns: Floats = np.arccos(inside) / (2.0 * np.pi)
        return turns

    def to_dataset(self) -> xr.Dataset:
        """Convert the curve to an xarray dataset: its points, by name of the parameter, and its special points."""
        data = super().to_dataset().assign(angle=("point", self.angle))
        for name in self.names:
            at = [point.parameters[name] for point in self.special_points]
            data = data.assign({f"special_{name}": ("special", np.array(at, dtype=float))})
        return data.assign_coords(parameter=list(self.names))

    def __repr__(self) -> str:
        found = counted(point.kind for point in self.special_points)
        ranges = ", ".join(
            f"{name} {column.min():.8g} to {column.max():.8g}"
            for name, column in zip(self.names, self.values.T, strict=True)
        )
        lines = [
            f"Curve of {self.kind} points, {ranges}, {np.mean(self.admissible):.0%} of them admissible; {found}",
            *(f"  {point!r}" for point in self.special_points),
            f"  ends: {self.ends[0]}; {self.ends[1]}",
        ]
        return "\n".join(lines)


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
