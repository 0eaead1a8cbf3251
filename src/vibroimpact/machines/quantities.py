"""Quantities with units, "4 mm" or "45 Hz", in files and on the command line, as numbers of a machine in SI units."""

from __future__ import annotations

import math
import re

from vibroimpact._core.errors import InvalidParameterError

TURN = 2.0 * math.pi
FACTORS = {  # of units to those of SI, by quantity; spaces and signs of products are left out of the names
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "frequency": {"rad/s": 1.0, "Hz": TURN, "kHz": 1e3 * TURN, "rpm": TURN / 60.0, "1/min": TURN / 60.0},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3},
    "acceleration": {"m/s²": 1.0, "m/s^2": 1.0, "m/s2": 1.0, "mm/s²": 1e-3, "mm/s^2": 1e-3},
    "stiffness": {"N/m": 1.0, "N/mm": 1e3, "N/um": 1e6, "N/µm": 1e6, "kN/m": 1e3, "kN/mm": 1e6, "MN/m": 1e6},
    "damping": {"Ns/m": 1.0, "kg/s": 1.0, "Ns/mm": 1e3, "kNs/m": 1e3},
    "impulse": {"Ns": 1.0},
    "energy": {"J": 1.0, "mJ": 1e-3},
    "power": {"W": 1.0, "mW": 1e-3, "kW": 1e3},
    "unbalance": {"kgm": 1.0, "kgmm": 1e-3, "gmm": 1e-6},
    "rate": {"1/s": 1.0},
    "angle": {"rad": 1.0, "deg": TURN / 360.0, "°": TURN / 360.0},
    "": {"%": 1e-2},
}  # fmt: skip
WRITTEN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\D.*?)?\s*")
ADVICE = "Give numbers, or the data of the machine in SI units, in a table [physical]."


class Measured(float):
    """A number with a unit, in SI units.

    Attributes
    ----------
    quantity
        Its quantity, a key of :data:`FACTORS`.
    text
        As it was written.
    """

    __slots__ = ("quantity", "text", "unit")

    quantity: str
    text: str
    unit: str


def number_in(text: str) -> float:
    """Number of a text, with a unit or without.

    Raises
    ------
    ValueError
        No number, or a unit that is not in the table.
    """
    try:
        return float(text)
    except ValueError:
        pass
    found = WRITTEN.fullmatch(text)
    unit = re.sub(r"[\s*·]", "", found[2] or "") if found else ""
    for quantity, factors in FACTORS.items():
        if found and unit in factors:
            number = Measured(_product(found[1], factors[unit]))
            number.quantity, number.text, number.unit = quantity, text.strip(), unit
            return number
    raise ValueError(f"{text!r} must be a number, or one with a unit: {units_known()}")


def _product(digits: str, factor: float) -> float:
    """A number times a factor, rounded once: by dividing, since 1e6 is a double, and 1e-6 is not."""
    tenth = factor < 1.0 and math.log10(factor).is_integer()
    return float(digits) / round(1.0 / factor) if tenth else float(digits) * factor


def units_known() -> str:
    """All units that are understood, in words."""
    return ", ".join(unit for factors in FACTORS.values() for unit in factors)


def checked(name: str, value: float, quantity: str, *, si: bool) -> float:
    """The number of a machine, where a unit that it was given with fits.

    Raises
    ------
    InvalidParameterError
        A unit of another quantity, or a machine whose numbers have none.
    """
    if not isinstance(value, Measured):
        return value
    if quantity != value.quantity:
        wanted = (
            f"a {quantity}, in {' or '.join(FACTORS[quantity])}"
            if quantity in FACTORS and quantity
            else "a plain number"
        )
        raise InvalidParameterError(f"{name} = {value.text}: must be {wanted}.")
    if not si and quantity not in ("", "angle"):
        raise InvalidParameterError(
            f"{name} = {value.text}: has a unit, and the numbers of this machine have none. {ADVICE}"
        )
    return float(value)
