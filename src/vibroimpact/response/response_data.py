"""Responses as datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from vibroimpact import _kernel
from vibroimpact._core.checks import check_flag
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import units_of

if TYPE_CHECKING:
    from vibroimpact.response.response import Response

END = -1  # kind at the last point of a curve, from which no stretch begins


def dataset_of(response: Response, *, si: bool = False) -> xr.Dataset:
    """See :meth:`Response.to_dataset`."""
    check_flag("si", si)
    units = units_of(response.system)
    quantity = response.measure.dimension
    across = units.quantity_of(response.parameter)
    up, over = (units.factor(q) if si else 1.0 for q in (quantity, across))

    def attrs(text: str, of: str) -> dict[str, str]:
        unit = units.unit(of) if si else ""
        known = {"quantity": "" if si else of, "units": unit}
        return {"long_name": text} | {name: value for name, value in known.items() if value}

    name = response.parameter
    curves = response.curves
    kinds = [np.append(curve.stability, END) for curve in curves]
    answers = [answer for many in response.answers for answer in many]
    off = {id(answer) for answer in response.unexplained}
    measures = response.simulation.measures  # the others are those of its row
    names = ("value", "rms", "peak")[: len(measures)]
    measured = {
        kind: (units.factor(one.dimension) if si else 1.0, attrs(one.label, one.dimension))
        for kind, one in zip(names, measures, strict=True)
    }

    def joined(parts: list[Floats]) -> Floats:
        return np.concatenate(parts) if parts else np.empty(0)

    return xr.Dataset(
        {
            "curve": ("point", np.repeat(np.arange(len(curves)), [len(c.value) for c in curves])),
            f"{name}_of_point": (
                "point", joined([c.parameter for c in curves]) * over, attrs(name, across),
            ),
            "value_of_point": ("point", joined([c.value for c in curves]) * up, measured["value"][1]),
            "derivative": (
                "point", joined([c.derivative for c in curves]) * (up / over),
                {"long_name": f"derivative of {response.measure.label} by {name}"},
            ),
            "kind": (
                "point", np.concatenate(kinds).astype(np.int8) if kinds else np.empty(0, np.int8),
                {
                    "long_name": "kind of the stretch to the next point",
                    "flag_values": np.array([END, 0, 1, 2], dtype=np.int8),
                    "flag_meanings": "end_of_curve stable unstable not_admissible",
                },
            ),
            "symbol": ("branch", np.array([c.symbol for c in curves], dtype=object)),
            f"{name}_of_answer": (
                "answer", np.array([a.parameter for a in answers]) * over, attrs(name, across),
            ),
            **{
                f"{kind}_of_answer": (
                    "answer", np.array([getattr(a, kind) for a in answers]) * factor, known,
                )
                for kind, (factor, known) in measured.items()
            },
            "motion": ("answer", np.array([a.motion for a in answers], dtype=object)),
            "members": ("answer", np.array([a.members for a in answers], dtype=np.int32)),
            "on_curve": ("answer", np.array([id(a) not in off for a in answers], dtype=bool)),
        },
        attrs={
            "system": repr(response.system),
            "parameter": name,
            "band": [response.band.low * over, response.band.high * over],
            "measure": response.measure.label,
            "settle_periods": response.simulation.settle_periods,
            "periods": response.simulation.periods,
            "version": _kernel.version(),
        },
    )  # fmt: skip
