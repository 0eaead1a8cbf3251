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
from vibroimpact.continuation.curve import Curve, End, SpecialPoint, Stopped, Unresolved

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
        **_zeros(curve.special, curve.z.shape[1]),
    }


def _zeros(points: Sequence[SpecialPoint], unknowns: int) -> Table:
    """Zeros of test functions, one per row."""
    return {
        "zero_name": ("zero", words([p.name for p in points])),
        "zero_value": ("zero", reals([p.parameter for p in points])),
        "zero_error": ("zero", reals([p.error for p in points])),
        "zero_crossing": ("zero", whole([p.crossing for p in points])),
        "zero_arclength": ("zero", reals([p.arclength for p in points])),
        "zero_z": (("zero", "unknown"), vectors([p.z for p in points], unknowns)),
        "zero_tangent": (
            ("zero", "direction"),
            vectors([p.tangent for p in points], unknowns + 1),
        ),
    }


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
        special=tuple(_zero(row) for row in rows_of_table(data, "zero")),
        ends=(first, last),
        start=int(a["start"]),
        unresolved=tuple(Unresolved(*row) for row in json.loads(a["unresolved"])),
        rejected=int(a["rejected"]),
    )


def _zero(row: Row) -> SpecialPoint:
    return SpecialPoint(
        name=str(row["zero_name"]),
        parameter=float(row["zero_value"]),
        z=row["zero_z"],
        tangent=row["zero_tangent"],
        arclength=float(row["zero_arclength"]),
        error=float(row["zero_error"]),
        crossing=int(row["zero_crossing"]),
    )
