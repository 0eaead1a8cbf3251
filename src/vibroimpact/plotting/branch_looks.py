"""Looks of kinds of special points and names of parameters, for every figure of a branch."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from vibroimpact.machines.units import Quantity, Units
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.plotting import style
from vibroimpact.response.band import Band

COLOUR = "#7A5A3A"  # of curves of other kinds


class Look(NamedTuple):
    """Look of a kind of special point: its marker, and the colour of curves of it; filled where it is one of maps."""

    marker: str = "^"
    colour: str = COLOUR


LOOKS = {
    "SN": Look(">", style.BLUE), "PD": Look("D", style.VERMILION), "NS": Look("o", style.BLACK),
    "BP": Look("s", style.GREEN), "GR": Look("v", style.ORANGE), "ZERO": Look("X", style.SKY),
    "SIM": Look("*", style.PURPLE), "STICK": Look("P"),
    "REST": Look("p", "#4B2E83"), "CHAT": Look("h", "#00565B"), "CS": Look("1", "#8F1D4F"), "GS": Look("3", "#6F7A00"),
    "SS": Look("4", "#3D5AA8"), "AS": Look("+", "#B0651D"), "STILL": Look("_"), "PEAK": Look("2"),
    "CP": Look(">"), "GPD": Look("D"), "CH": Look("h"),
    "R1": Look("o"), "R2": Look("o"), "R3": Look("o"), "R4": Look("o"), "LPPD": Look("d"), "LPNS": Look("<"),
    "PDNS": Look("p"), "NSNS": Look("8"), "WEAK": Look("o"),
}  # fmt: skip
"""Looks by the label of the kind."""


def look_of(kind: PointKind) -> Look:
    """Look of a kind; one of its own for all that are not listed."""
    return LOOKS.get(kind.label, Look())


def in_order(kinds: Iterable[PointKind]) -> list[PointKind]:
    """Kinds once each, in the order of a legend: that of the looks, others last."""
    order = [*LOOKS]
    return sorted(
        dict.fromkeys(kinds),
        key=lambda kind: order.index(kind.label) if kind.label in LOOKS else len(order),
    )


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


def marker_of(kind: PointKind) -> dict[str, Any]:
    """Marker of a special point."""
    return {
        "linestyle": "none", "marker": look_of(kind).marker, "markersize": 4.5, "zorder": 4,
        "markerfacecolor": "white", "markeredgecolor": style.BLACK, "markeredgewidth": 0.8,
    }  # fmt: skip
