"""Markers of special points and names of parameters, for every figure of a branch."""

from __future__ import annotations

from typing import Any

from vibroimpact.machines.units import Quantity, Units
from vibroimpact.plotting import style
from vibroimpact.response.band import Band

MARKERS = {
    "SN": ">",
    "PD": "D",
    "NS": "o",
    "BP": "s",
    "GR": "v",
    "ZERO": "X",
    "SIM": "*",
    "STICK": "P",
}
KINDS = {
    "SN": "fold", "PD": "period doubling", "NS": "Neimark-Sacker", "BP": "branch point",
    "GR": "grazing", "ZERO": "zero impact speed", "SIM": "two impacts at once",
    "STICK": "onset of sticking",
}  # fmt: skip
PARAMETERS = {
    "omega": r"forcing frequency $\omega$", "omega_n": r"natural frequency $\omega_n$",
    "zeta": r"damping ratio $\zeta$", "mass_ratio": r"mass ratio $\mu$",
    "restitution": "coefficient of restitution $R$", "half_clearance": r"half clearance $\delta$",
    "force": "force amplitude $F$",
}  # fmt: skip


def parameter_label(name: str, of: Units | None = None) -> str:
    """Label of a parameter, with symbol and unit; a path into a mechanism as it is written."""
    own = of.parameters.get(name, Quantity()).label if of else ""
    text = own or PARAMETERS.get(name) or name.replace("$", r"\$")
    return of.label(text, of.quantity_of(name)) if of else text


def band_label(band: Band, of: Units) -> str:
    """Label of the parameter of a band, in the unit of the band."""
    return "forcing frequency $f$ [Hz]" if band.unit else parameter_label(band.parameter, of)


def marker_of(kind: str) -> dict[str, Any]:
    """Marker of a special point."""
    return {
        "linestyle": "none", "marker": MARKERS[kind], "markersize": 4.5, "zorder": 4,
        "markerfacecolor": "white", "markeredgecolor": style.BLACK, "markeredgewidth": 0.8,
    }  # fmt: skip
