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

from vibroimpact import _kernel
from vibroimpact._core.checks import check_kind
from vibroimpact._core.datasets import (
    Format,
    Row,
    Table,
    reals,
    rows_of_table,
    whole,
    words,
)
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.kinds import EVENTS, kind_of_label
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation.store import (
    attributes_of,
    curve_from,
    located_from,
    located_table,
    variables_of,
)
from vibroimpact.machines.json_text import chosen, text_of
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.problem import Flight, Signature

if TYPE_CHECKING:
    import xarray as xr

FORMAT = Format("vibroimpact branch 1", "Branch.to_dataset", "save_branch")
NOT_NEAR = Nearest(np.nan, -1, 0, -1, np.nan)


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
            "multiplier_real": (both, branch.multipliers.real),
            "multiplier_imaginary": (both, branch.multipliers.imag),
            "admissible": ("point", branch.admissible.astype(np.int8)),
            "stable": ("point", branch.stable.astype(np.int8)),
            "clearance": ("point", branch.clearance),
            "impact_speed": ("point", branch.impact_speed),
            "scale": ("direction", branch.family.scale()),
            **variables_of(curve),
            **special_table(branch.special_points, curve.z.shape[1]),
        },
        coords={"test": list(curve.tests)},
        attrs=_attributes(branch),
    )


def special_table(points: Sequence[BifurcationPoint], unknowns: int) -> Table:
    """Special points of a branch or a curve, one per row."""
    return {
        "special_kind": ("special", words([p.kind for p in points])),
        "special_label": ("special", words([p.label for p in points])),
        **located_table(points, unknowns, "special"),
        "special_segment": ("special", whole([p.segment for p in points])),
        **touches_table([p.nearest for p in points]),
    }


def touches_table(touches: Sequence[Nearest | None]) -> Table:
    """Stops that are touched at special points, one per row."""
    nearest = [touch or NOT_NEAR for touch in touches]
    return {
        "special_gap": ("special", reals([n.gap for n in nearest])),
        "special_gap_contact": ("special", whole([n.contact for n in nearest])),
        "special_gap_side": ("special", whole([n.side for n in nearest])),
        "special_gap_segment": ("special", whole([n.segment for n in nearest])),
        "special_gap_time": ("special", reals([n.time for n in nearest])),
        "special_gap_own": ("special", whole([n.own for n in nearest])),
        "special_gap_watch": ("special", whole([n.watch for n in nearest])),
    }


def _attributes(branch: Branch) -> dict[str, str | int | float]:
    family = branch.family
    return {
        "format": FORMAT.name,
        "parameter": branch.parameter,
        "low": branch.bounds[0],
        "high": branch.bounds[1],
        "symbol": branch.symbol,
        **signature_attributes(family.signature),
        **attributes_of(branch.curve),
        "system": repr(family.system),
        "system_numbers": text_of(family.system),
        "system_value": parameter_value(family.system, branch.parameter),
        "version": _kernel.version(),
    }


def signature_attributes(signature: Signature) -> dict[str, str | int | float]:
    """Signature of the orbits."""
    return {
        "impacts": json.dumps(signature.impacts),
        "flights": json.dumps(signature.flights),
        "cycles": signature.cycles,
        "symmetric": int(signature.symmetric),
    }


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
    with FORMAT.reading(data):
        return _built(data, system)


def _built(data: xr.Dataset, system: System | None) -> Branch:
    a = data.attrs
    name = str(a["parameter"])
    curve = curve_from(data, data["value"].values)
    own = {name: float(a["system_value"])}
    family = OrbitFamily(
        chosen(a["system_numbers"], a["system"], own, system, "a branch"),
        signature_from(a),
        name,
        data["scale"].values,
        EVENTS,
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
        special_points=tuple(
            _special(row, family, bounds) for row in rows_of_table(data, "special")
        ),
        curve=curve,
        family=family,
    )


def signature_from(attributes: Mapping[str, Any]) -> Signature:
    """Signature of :func:`signature_attributes`."""
    impacts = json.loads(attributes["impacts"])
    return Signature(
        tuple(Stop(int(contact), int(side)) for contact, side in impacts),
        int(attributes["cycles"]),
        bool(attributes["symmetric"]),
        tuple(Flight(*flight) for flight in json.loads(attributes["flights"])),
    )


def touch_from(row: Row) -> Nearest | None:
    """Stop that is touched, of :func:`touches_table`."""
    nearest = Nearest(
        float(row["special_gap"]),
        int(row["special_gap_contact"]),
        int(row["special_gap_side"]),
        int(row["special_gap_segment"]),
        float(row["special_gap_time"]),
        bool(row["special_gap_own"]),
        int(row["special_gap_watch"]),
    )
    return nearest if nearest.contact >= 0 else None


def special_from(row: Row) -> dict[str, Any]:
    """Fields of a special point that its row of :func:`special_table` holds."""
    fields = vars(located_from(row, "special"))
    segment = int(row["special_segment"])
    return fields | {
        "label": str(row["special_label"]), "nearest": touch_from(row), "segment": segment,
    }  # fmt: skip


def _special(row: Row, family: OrbitFamily, bounds: tuple[float, float]) -> BifurcationPoint:
    fields = special_from(row)
    kind = kind_of_label(str(row["special_kind"]), symmetric=family.signature.symmetric)
    return BifurcationPoint(
        record=kind,
        parameters={family.parameter: fields["parameter"]},
        orbit=family.orbit(fields["z"], fields["parameter"]),
        problem=family,
        bounds=bounds,
        **fields,
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
    FORMAT.save(dataset_of(branch), path)


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
    if system is not None:
        mechanism_of(system)
    return branch_from(FORMAT.load(path), system)
