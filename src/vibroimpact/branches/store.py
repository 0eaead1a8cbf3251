"""Conversion of branches to datasets and files, and back, exact to the last bit.

A dataset holds the points (dim ``point``), the special points (``special``), and all zeros of test
functions that the continuation found (``zero``). Attributes hold everything else: the system, the
signature, the reasons of both ends, the version of the package.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel
from vibroimpact._core.checks import check_kind, check_target, path_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.files import replacing
from vibroimpact.branches.branch import BifurcationPoint, Branch
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.profile import unknowns_of
from vibroimpact.continuation import Curve, End, SpecialPoint, Stopped
from vibroimpact.continuation.curve import Unresolved
from vibroimpact.machines.json_text import chosen, text_of
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.problem import Signature

if TYPE_CHECKING:
    import xarray as xr

FORMAT = "vibroimpact branch 1"
SUFFIXES = (".nc",)
NEAREST = ("gap", "contact", "side", "segment", "time")

Table = dict[str, tuple[Any, ...]]
Array = NDArray[Any]


# ---- to a dataset --------------------------------------------------------------------------------


def dataset_of(branch: Branch) -> xr.Dataset:
    """Branch as an xarray dataset, from which :func:`branch_from` restores it.

    Dims ``point``, ``special``, ``zero``, ``multiplier``, ``unknown`` (states and flight times of
    all solved segments), ``direction`` (the unknowns and last the parameter), ``test``.
    """
    import xarray as xr

    curve = branch.curve
    both = ("point", "multiplier")
    return xr.Dataset(
        {
            "value": ("point", branch.values),
            "z": (("point", "unknown"), curve.z),
            "tangent": (("point", "direction"), curve.tangent),
            "multiplier_real": (both, branch.multipliers.real),
            "multiplier_imaginary": (both, branch.multipliers.imag),
            "admissible": ("point", branch.admissible.astype(np.int8)),
            "stable": ("point", branch.stable.astype(np.int8)),
            "clearance": ("point", branch.clearance),
            "impact_speed": ("point", branch.impact_speed),
            "arclength": ("point", curve.arclength),
            "residual": ("point", curve.residual),
            "newton_steps": ("point", curve.steps),
            "panel": ("point", curve.panel),
            "scale": ("direction", branch.family.scale()),
            "test_function": (("test", "point"), np.array(list(curve.tests.values()))),
            **_special_table(branch.special_points, curve.z.shape[1]),
            **_zero_table(curve.special, curve.z.shape[1]),
        },
        coords={"test": list(curve.tests)},
        attrs=_attributes(branch),
    )


def _special_table(points: Sequence[BifurcationPoint], unknowns: int) -> Table:
    """Special points, one per row."""
    nearest = [p.nearest or Nearest(np.nan, -1, 0, -1, np.nan) for p in points]
    return {
        "special_kind": ("special", _words([p.kind for p in points])),
        "special_label": ("special", _words([p.label for p in points])),
        "special_value": ("special", _reals([p.parameter for p in points])),
        "special_error": ("special", _reals([p.error for p in points])),
        "special_crossing": ("special", _whole([p.crossing for p in points])),
        "special_segment": ("special", _whole([p.segment for p in points])),
        "special_z": (("special", "unknown"), _rows([unknowns_of(p) for p in points], unknowns)),
        "special_tangent": (
            ("special", "direction"),
            _rows([p.tangent for p in points], unknowns + 1),
        ),
        "special_gap": ("special", _reals([n.gap for n in nearest])),
        "special_gap_contact": ("special", _whole([n.contact for n in nearest])),
        "special_gap_side": ("special", _whole([n.side for n in nearest])),
        "special_gap_segment": ("special", _whole([n.segment for n in nearest])),
        "special_gap_time": ("special", _reals([n.time for n in nearest])),
    }


def _zero_table(points: Sequence[SpecialPoint], unknowns: int) -> Table:
    """Zeros of test functions, one per row."""
    return {
        "zero_name": ("zero", _words([p.name for p in points])),
        "zero_value": ("zero", _reals([p.parameter for p in points])),
        "zero_error": ("zero", _reals([p.error for p in points])),
        "zero_crossing": ("zero", _whole([p.crossing for p in points])),
        "zero_arclength": ("zero", _reals([p.arclength for p in points])),
        "zero_z": (("zero", "unknown"), _rows([p.z for p in points], unknowns)),
        "zero_tangent": (("zero", "direction"), _rows([p.tangent for p in points], unknowns + 1)),
    }


def _attributes(branch: Branch) -> dict[str, str | int | float]:
    family, curve = branch.family, branch.curve
    signature = family.signature
    return {
        "format": FORMAT,
        "parameter": branch.parameter,
        "low": branch.bounds[0],
        "high": branch.bounds[1],
        "symbol": branch.symbol,
        "impacts": json.dumps(signature.impacts),
        "cycles": signature.cycles,
        "symmetric": int(signature.symmetric),
        "ends": json.dumps([[end.reason.name, end.detail] for end in curve.ends]),
        "start": curve.start,
        "rejected": curve.rejected,
        "unresolved": json.dumps([[u.name, u.first, u.last, u.reason] for u in curve.unresolved]),
        "system": repr(family.system),
        "system_numbers": text_of(family.system),
        "system_value": parameter_value(family.system, branch.parameter),
        "version": _kernel.version(),
    }


def _words(items: Sequence[str]) -> Array:
    return np.array(items, dtype=object)


def _reals(items: Sequence[float]) -> Array:
    return np.array(items, dtype=np.float64)


def _whole(items: Sequence[int]) -> Array:
    return np.array(items, dtype=np.int32)


def _rows(items: Sequence[Array], width: int) -> Array:
    return np.array(items, dtype=np.float64).reshape(len(items), width)


# ---- from a dataset ------------------------------------------------------------------------------


def branch_from(data: xr.Dataset, system: System | None = None) -> Branch:
    """Branch of a dataset made by :func:`dataset_of`.

    Parameters
    ----------
    data
        The dataset.
    system
        Needed where the system is code (a :class:`~vibroimpact.Family`, a class of your own), which
        a file cannot hold. It must be the stored one, apart from the value of the parameter.

    Raises
    ------
    InvalidParameterError
        A dataset of another kind or an incomplete one, no system or another one.
    """
    import xarray as xr

    check_kind("data", data, xr.Dataset, "a Dataset, as Branch.to_dataset gives")
    if data.attrs.get("format") != FORMAT:
        raise InvalidParameterError(
            f"data: format {data.attrs.get('format')!r} must be {FORMAT!r}. Give what "
            "Branch.to_dataset or save_branch wrote."
        )
    try:
        return _built(data, system)
    except InvalidParameterError:
        raise
    except KeyError as error:
        raise InvalidParameterError(
            f"data: {error.args[0]} is missing. Give what Branch.to_dataset or save_branch wrote."
        ) from error
    except (ValueError, TypeError, IndexError) as error:
        raise InvalidParameterError(
            f"data: is damaged ({error}). Give what Branch.to_dataset or save_branch wrote."
        ) from error


def _built(data: xr.Dataset, system: System | None) -> Branch:
    a = data.attrs
    name = str(a["parameter"])
    curve = _curve(data)
    impacts = tuple(Stop(int(contact), int(side)) for contact, side in json.loads(a["impacts"]))
    family = OrbitFamily(
        chosen(a["system_numbers"], a["system"], name, float(a["system_value"]), system),
        Signature(impacts, int(a["cycles"]), bool(a["symmetric"])),
        name,
        data["scale"].values,
    )
    bounds = float(a["low"]), float(a["high"])
    real, imaginary = data["multiplier_real"].values, data["multiplier_imaginary"].values
    return Branch(
        parameter=name,
        bounds=bounds,
        values=curve.parameter,
        multipliers=real + 1j * imaginary,
        admissible=data["admissible"].values.astype(bool),
        stable=data["stable"].values.astype(bool),
        clearance=data["clearance"].values,
        impact_speed=data["impact_speed"].values,
        special_points=tuple(_special(row, family, bounds) for row in _table(data, "special")),
        curve=curve,
        family=family,
    )


def _curve(data: xr.Dataset) -> Curve:
    a = data.attrs
    first, last = (End(Stopped[reason], detail) for reason, detail in json.loads(a["ends"]))
    return Curve(
        parameter=data["value"].values,
        z=data["z"].values,
        tangent=data["tangent"].values,
        arclength=data["arclength"].values,
        residual=data["residual"].values,
        steps=data["newton_steps"].values,
        panel=data["panel"].values,
        tests=dict(zip(map(str, data["test"].values), data["test_function"].values, strict=True)),
        special=tuple(_zero(row) for row in _table(data, "zero")),
        ends=(first, last),
        start=int(a["start"]),
        unresolved=tuple(Unresolved(*row) for row in json.loads(a["unresolved"])),
        rejected=int(a["rejected"]),
    )


def _table(data: xr.Dataset, dim: str) -> list[dict[str, Any]]:
    """Rows of a table, with their entries by name."""
    head = dim + "_"
    columns = {str(k): v.values for k, v in data.data_vars.items() if str(k).startswith(head)}
    return [{k: v[i] for k, v in columns.items()} for i in range(data.sizes.get(dim, 0))]


def _zero(row: Mapping[str, Any]) -> SpecialPoint:
    return SpecialPoint(
        name=str(row["zero_name"]),
        parameter=float(row["zero_value"]),
        z=row["zero_z"],
        tangent=row["zero_tangent"],
        arclength=float(row["zero_arclength"]),
        error=float(row["zero_error"]),
        crossing=int(row["zero_crossing"]),
    )


def _special(
    row: Mapping[str, Any], family: OrbitFamily, bounds: tuple[float, float]
) -> BifurcationPoint:
    value = float(row["special_value"])
    nearest = Nearest(
        float(row["special_gap"]),
        int(row["special_gap_contact"]),
        int(row["special_gap_side"]),
        int(row["special_gap_segment"]),
        float(row["special_gap_time"]),
    )
    return BifurcationPoint(
        kind=str(row["special_kind"]),
        label=str(row["special_label"]),
        name=family.parameter,
        parameter=value,
        error=float(row["special_error"]),
        orbit=family.orbit(row["special_z"], value),
        crossing=int(row["special_crossing"]),
        tangent=row["special_tangent"],
        bounds=bounds,
        nearest=nearest if nearest.contact >= 0 else None,
        segment=int(row["special_segment"]),
    )


# ---- files ---------------------------------------------------------------------------------------


def save_branch(branch: Branch, path: str | os.PathLike[str]) -> None:
    """Write a branch to a netCDF file, whole or not at all.

    Parameters
    ----------
    branch
        The branch.
    path
        A name that ends in .nc; an earlier file of that name is replaced.

    Raises
    ------
    InvalidParameterError
        Another suffix, no such folder, no permission.
    """
    check_kind("branch", branch, Branch, "a Branch, as continue_orbit gives")
    target = path_of("path", path)
    check_target(target, SUFFIXES, "path")
    with replacing(target) as temporary:
        dataset_of(branch).to_netcdf(temporary, engine="h5netcdf")


def load_branch(path: str | os.PathLike[str], system: System | None = None) -> Branch:
    """Read a branch that :func:`save_branch` wrote.

    Parameters
    ----------
    path
        The file.
    system
        As for :func:`branch_from`.

    Returns
    -------
    Branch
        With the same numbers to the last bit: ``branch.orbit(i)`` can be continued, special points
        have their normal forms and can be switched at.

    Raises
    ------
    InvalidParameterError
        No such file, no branch in it, no system or another one.
    """
    import xarray as xr

    target = path_of("path", path)
    if system is not None:
        mechanism_of(system)
    try:
        with xr.open_dataset(target, engine="h5netcdf") as opened:
            data = opened.load()
    except (OSError, ValueError) as error:
        raise InvalidParameterError(
            f"path = {target}: cannot be read ({error}). Name a file that save_branch wrote."
        ) from error
    return branch_from(data, system)
