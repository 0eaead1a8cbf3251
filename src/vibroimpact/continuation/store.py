"""Continued curves as variables and attributes of a dataset, and back, exact to the last bit.

Dims ``point``, ``unknown``, ``direction`` (the unknowns and last the parameter), ``test``, and ``zero``: all zeros of
test functions that the continuation found.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vibroimpact._core.datasets import Row, Table, reals, rows_of_table, vectors, whole, words
from vibroimpact._core.types import Floats
from vibroimpact.continuation.curve import Curve, End, LocatedPoint, Stopped, Unresolved

if TYPE_CHECKING:
    import xarray as xr


def variables_of(curve: Curve) -> Table:
    """Variables of a curve, all but its parameter."""
    return {
        "z": (("point", "unknown"), curve.z),
        "tangent": (("point", "direction"), curve.tangent),
        "arclength": ("point", curve.arclength),
        "residual": ("point", curve.residual),
        "newton_steps": ("point", curve.steps),
        "panel": ("point", curve.panel),
        "test_function": (("test", "point"), np.array(list(curve.tests.values()))),
        **located_table(curve.special, curve.z.shape[1], "zero"),
    }


def located_table(points: Sequence[LocatedPoint], unknowns: int, dim: str) -> Table:
    """Located points, one per row."""
    return {
        f"{dim}_test": (dim, words([p.test for p in points])),
        f"{dim}_value": (dim, reals([p.parameter for p in points])),
        f"{dim}_error": (dim, reals([p.error for p in points])),
        f"{dim}_crossing": (dim, whole([p.crossing for p in points])),
        f"{dim}_arclength": (dim, reals([p.arclength for p in points])),
        f"{dim}_z": ((dim, "unknown"), vectors([p.z for p in points], unknowns)),
        f"{dim}_tangent": ((dim, "direction"), vectors([p.tangent for p in points], unknowns + 1)),
    }


def located_from(row: Row, dim: str) -> LocatedPoint:
    """Point of a row of :func:`located_table`; of several parameters the last counts."""
    return LocatedPoint(
        test=str(row[f"{dim}_test"]),
        parameter=float(np.ravel(row[f"{dim}_value"])[-1]),
        z=row[f"{dim}_z"],
        tangent=row[f"{dim}_tangent"],
        arclength=float(row[f"{dim}_arclength"]),
        error=float(row[f"{dim}_error"]),
        crossing=int(row[f"{dim}_crossing"]),
    )


def attributes_of(curve: Curve) -> dict[str, str | int | float]:
    """Attributes of a curve: its ends, its start, its unresolved parts."""
    return {
        "ends": json.dumps([[end.reason.name, end.detail] for end in curve.ends]),
        "start": curve.start,
        "rejected": curve.rejected,
        "unresolved": json.dumps([[u.name, u.first, u.last, u.reason] for u in curve.unresolved]),
    }


def curve_from(data: xr.Dataset, parameter: Floats) -> Curve:
    """Curve of a dataset, with the values of its parameter."""
    a: Mapping[str, Any] = data.attrs
    first, last = (End(Stopped[reason], detail) for reason, detail in json.loads(a["ends"]))
    return Curve(
        parameter=parameter,
        z=data["z"].values,
        tangent=data["tangent"].values,
        arclength=data["arclength"].values,
        residual=data["residual"].values,
        steps=data["newton_steps"].values,
        panel=data["panel"].values,
        tests=dict(zip(map(str, data["test"].values), data["test_function"].values, strict=True)),
        special=tuple(located_from(row, "zero") for row in rows_of_table(data, "zero")),
        ends=(first, last),
        start=int(a["start"]),
        unresolved=tuple(Unresolved(*row) for row in json.loads(a["unresolved"])),
        rejected=int(a["rejected"]),
    )
