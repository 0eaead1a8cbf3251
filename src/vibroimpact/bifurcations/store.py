"""Conversion of curves of bifurcations to datasets and files, and back, exact to the last bit.

A dataset holds the points (dim ``point``), the special points (``special``), and all zeros of test functions that the
continuation found (``zero``). Attributes hold everything else: the system, the signature, the condition, the reasons
of both ends, the parts in which points may be missing, the version of the package.

What is code cannot be stored: of a curve of fixed points of a map given by a formula there is a dataset, but no file;
a curve of a level comes back without the function whose level it is.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.checks import check_kind
from vibroimpact._core.datasets import (
    Format,
    Row,
    Table,
    rows_of_table,
    vectors,
    whole,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.bifurcations.augmented import Augmented, Tests
from vibroimpact.bifurcations.conditions import Condition, Graze, Level
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.kinds import TWO
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.special import point_on_curve
from vibroimpact.bifurcations.tests_along import condition_of, nothing
from vibroimpact.branches.family import EVENT
from vibroimpact.branches.kinds import EVENTS, LEVEL, kind_of_label
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.branches.store import (
    signature_attributes,
    signature_from,
    special_from,
    special_table,
)
from vibroimpact.continuation.store import attributes_of, curve_from, variables_of
from vibroimpact.machines.json_text import chosen, text_of
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.admissibility import Nearest

if TYPE_CHECKING:
    import xarray as xr

FORMAT = Format("vibroimpact curve 1", "BifurcationCurve.to_dataset", "save_curve")


# ---- to a dataset --------------------------------------------------------------------------------


def dataset_of(curve: BifurcationCurve) -> xr.Dataset:
    """Curve as an xarray dataset, from which :func:`curve_from_dataset` restores one of orbits.

    Dims ``point``, ``parameter`` (both, by name), ``special``, ``zero``, ``multiplier``, ``unknown`` (of the orbit, of
    the condition, and last the first parameter), ``direction`` (the unknowns and last the second parameter), ``test``.
    """
    import xarray as xr

    both = ("point", "multiplier")
    return xr.Dataset(
        {
            "value": (("point", "parameter"), curve.values),
            "multiplier_real": (both, curve.multipliers.real),
            "multiplier_imaginary": (both, curve.multipliers.imag),
            "admissible": ("point", curve.admissible.astype(np.int8)),
            "neutral": ("point", curve.neutral.astype(np.int8)),
            "angle": ("point", curve.angle),
            "size": ("solution", curve.problem.equations.sizes),
            **variables_of(curve.curve),
            **_special_table(curve),
        },
        coords={"parameter": list(curve.names), "test": list(curve.curve.tests)},
        attrs=_attributes(curve),
    )


def _special_table(curve: BifurcationCurve) -> Table:
    """Special points, one per row."""
    points, unknowns = curve.special_points, curve.curve.z.shape[1]
    count = curve.multipliers.shape[1]
    both = ("special", "multiplier")
    at = [np.array([p.parameters[name] for name in curve.names]) for p in points]
    multipliers = [p.multipliers for p in points]
    return special_table(points, unknowns) | {
        "special_value": (("special", "parameter"), vectors(at, 2)),
        "special_admissible": ("special", whole([p.admissible for p in points])),
        "special_multiplier_real": (both, vectors([mu.real for mu in multipliers], count)),
        "special_multiplier_imaginary": (both, vectors([mu.imag for mu in multipliers], count)),
    }


def _attributes(curve: BifurcationCurve) -> dict[str, str | int | float]:
    (low, high), (second_low, second_high) = curve.bounds
    return {
        "format": FORMAT.name,
        "kind": curve.kind,
        "low": low,
        "high": high,
        "second_low": second_low,
        "second_high": second_high,
        **attributes_of(curve.curve),
        **_of_condition(curve.problem.condition),
        **_of_equations(curve),
        "version": _kernel.version(),
    }


def _of_condition(condition: Condition) -> dict[str, str | int | float]:
    """The touch, the segment, the value or the test function by which a condition is chosen."""
    touch = condition.touch if isinstance(condition, Graze) else None
    level = condition.level if isinstance(condition, Level) else 0.0
    return {
        "touch": json.dumps(touch),
        "segment": int(getattr(condition, "segment", -1)),
        "level": float(level),
        "own": condition.own,
    }


def _of_equations(curve: BifurcationCurve) -> dict[str, str | int | float]:
    """System and signature of orbits; a map is a function, and only its name is kept."""
    plane = curve.problem.equations
    if not isinstance(plane, OrbitPlane):
        return {"symbol": "map"}
    return {
        "symbol": curve.orbit(0).symbol,
        **signature_attributes(plane.signature),
        "system": repr(plane.system),
        "system_numbers": text_of(plane.system),
        "system_values": json.dumps([parameter_value(plane.system, name) for name in curve.names]),
    }


# ---- from a dataset ------------------------------------------------------------------------------


def curve_from_dataset(data: xr.Dataset, system: System | None = None) -> BifurcationCurve:
    """Curve of a dataset made by :func:`dataset_of`.

    Parameters
    ----------
    data
        The dataset.
    system
        Needed where the system is code (a :class:`~vibroimpact.Family`, a class of your own), which
        a file cannot hold. It must be the stored one, apart from the values of both parameters.

    Raises
    ------
    InvalidParameterError
        A dataset of another kind or an incomplete one, one of a map, no system or another one.
    """
    with FORMAT.reading(data):
        if data.attrs.get("symbol") == "map":
            raise InvalidParameterError(
                "data: a curve of fixed points of a map, which is code and not in the data. Follow it again with "
                "continue_bifurcation."
            )
        return _built(data, system)


def _built(data: xr.Dataset, system: System | None) -> BifurcationCurve:
    a = data.attrs
    first, second = map(str, data["parameter"].values)
    signature = signature_from(a)
    kind = kind_of_label(str(a["kind"]), symmetric=signature.symmetric)
    bounds = (
        (float(a["low"]), float(a["high"])),
        (float(a["second_low"]), float(a["second_high"])),
    )
    own = dict(zip((first, second), json.loads(a["system_values"]), strict=True))
    plane = OrbitPlane(
        chosen(a["system_numbers"], a["system"], own, system, "a curve"),
        signature,
        (first, second),
        data["size"].values,
        EVENTS,
    )
    problem = Augmented(plane, *_condition(kind, plane, a), bounds)
    values = data["value"].values
    return BifurcationCurve(
        record=kind,
        names=(first, second),
        bounds=bounds,
        values=values,
        multipliers=_complex(data["multiplier_real"].values, data["multiplier_imaginary"].values),
        admissible=data["admissible"].values.astype(bool),
        neutral=data["neutral"].values.astype(bool),
        special_points=tuple(
            _special(row, kind, problem) for row in rows_of_table(data, "special")
        ),
        curve=curve_from(data, np.ascontiguousarray(values[:, 1])),
        problem=problem,
    )


def _condition(kind: PointKind, plane: OrbitPlane, a: Mapping[str, Any]) -> tuple[Condition, Tests]:
    touch = json.loads(a["touch"])
    found = condition_of(kind, plane, touch and Nearest(*touch), int(a["segment"]))
    own = str(a["own"])
    if not found and kind != LEVEL and own != f"{EVENT} {kind.label}":
        raise ValueError(f"no curve of kind {kind.label}")
    return found or (Level(plane, _unknown, float(a["level"]), own), nothing)


def _unknown(*_: Any) -> Any:
    raise InvalidParameterError(
        "function: a file does not hold the function of a level or an event. Follow it again with that function."
    )


def _special(row: Row, kind: PointKind, problem: Augmented) -> BifurcationPoint:
    label = str(row["special_kind"])
    record = TWO.get(label) or kind_of_label(label, symmetric=False)
    return point_on_curve(kind, problem, special_from(row) | {"record": record})


def _complex(real: Any, imaginary: Any) -> Any:
    """Complex numbers from their parts, whose signs of zero are kept."""
    joined = np.empty(np.shape(real), dtype=np.complex128)
    joined.real, joined.imag = real, imaginary
    return joined


# ---- files ---------------------------------------------------------------------------------------


def save_curve(curve: BifurcationCurve, path: str | os.PathLike[str]) -> None:
    """Write a curve of bifurcations of orbits to a netCDF file, whole or not at all.

    Parameters
    ----------
    curve
        The curve.
    path
        A name that ends in .nc; an earlier file of that name is replaced.

    Raises
    ------
    InvalidParameterError
        Another suffix, no such folder, no permission; a curve of a map given by a formula, which is code: its numbers
        are in ``curve.to_dataset()``.
    """
    check_kind(
        "curve", curve, BifurcationCurve, "a BifurcationCurve, as continue_bifurcation gives"
    )
    if not isinstance(curve.problem.equations, OrbitPlane):
        raise InvalidParameterError(
            "curve: its map is a function, which a file cannot hold, so that the curve could not be loaded. Its "
            "numbers alone are in curve.to_dataset()."
        )
    FORMAT.save(dataset_of(curve), path)


def load_curve(path: str | os.PathLike[str], system: System | None = None) -> BifurcationCurve:
    """Read a curve that :func:`save_curve` wrote.

    Parameters
    ----------
    path
        The file.
    system
        Needed where the system is code, as for :func:`~vibroimpact.load_branch`.

    Returns
    -------
    BifurcationCurve
        With the same numbers to the last bit: special points have their coefficients, and curves are followed from
        them. A curve of a level lacks the function.

    Raises
    ------
    InvalidParameterError
        No such file, no curve in it, no system or another one.
    """
    if system is not None:
        mechanism_of(system)
    return curve_from_dataset(FORMAT.load(path), system)
