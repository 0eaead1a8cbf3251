"""Quantities, their units in SI, and numbers with units as they read best: 3 mm, not 0.003 m."""

from __future__ import annotations

import math

UNITS = {  # of quantities, in SI
    "length": "m",
    "velocity": "m/s",
    "acceleration": "m/s²",
    "time": "s",
    "frequency": "rad/s",
    "rate": "1/s",
    "force": "N",
    "impulse": "N s",
    "energy": "J",
    "power": "W",
    "mass": "kg",
    "unbalance": "kg m",
    "stiffness": "N/m",
    "damping": "N s/m",
}
SMALLER = ("m", "m/s", "m/s²", "J")  # units of which small numbers are given in parts: mm, µm
BOTH_WAYS = (
    "N",
    "N s",
    "W",
    "N/m",
    "N s/m",
)  # and of which large numbers are in multiples, too: kN
PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"), (1e9, "G"))


def prefixed(size: float, unit: str) -> tuple[float, str]:
    """Part or multiple of a unit in which a number of this size is 1 to 1000: (1e-3, "mm") for 0.003 and "m".

    (1.0, unit) where the unit has none, or the size is 0 or not finite.
    """
    size = abs(size)
    if unit not in SMALLER + BOTH_WAYS or not math.isfinite(size) or not size:
        return 1.0, unit
    known = [one for one in PREFIXES if one[0] <= 1.0 or unit in BOTH_WAYS]
    factor, prefix = next((one for one in reversed(known) if size >= one[0]), known[0])
    return factor, prefix + unit


def with_unit(*values: float, unit: str = "", digits: int = 6, separator: str = " to ") -> str:
    """Numbers with one unit, as they read best: "3 mm", "2 to 50 mm"."""
    rounded = [float(f"{value:.{digits}g}") for value in values]
    known = [abs(value) for value in rounded if math.isfinite(value)]
    factor, name = prefixed(max(known, default=0.0), unit)
    return f"{separator.join(f'{value / factor:.{max(digits, 6)}g}' for value in rounded)} {name}".rstrip()
