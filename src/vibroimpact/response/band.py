"""Bands of a parameter, in its unit or in hertz."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from vibroimpact._core.checks import check_choice, check_kind, ends_of
from vibroimpact._core.errors import InvalidParameterError, warn
from vibroimpact._core.types import Floats
from vibroimpact.measures.flights import derivative, jet
from vibroimpact.measures.linear import natural_frequencies
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import expanded, parameter_value, with_parameter, with_values
from vibroimpact.model.system import System, mechanism_of

Unit = Literal["", "Hz"]
# By unit of the band: the factor from the unit of the parameter.
HERTZ = 1.0 / (2.0 * math.pi)
BAND_FACTORS = {"": 1.0, "Hz": HERTZ}
# a frequency is near a band from so many times its low end to its high end over that
NEAR_BAND_FACTOR = 0.5
# All frequencies are so nearly proportional to a parameter that scales them.
PROPORTIONAL_RELATIVE = 1e-9


class Band(NamedTuple):
    """A range of a parameter."""

    # its name, and the range in the unit of the parameter
    parameter: str
    low: float
    high: float
    unit: Unit = ""  # "" for that unit, or "Hz"

    @property
    def factor(self) -> float:
        """Factor from the unit of the parameter to that of the band."""
        return BAND_FACTORS[self.unit]

    def values(self, count: int) -> Floats:
        """Evenly spaced values in the unit of the parameter, both ends included."""
        return np.linspace(self.low, self.high, count)


def band_of(system: System, parameter: str, band: tuple[float, float], unit: Unit = "") -> Band:
    """Check a band of a parameter.

    Parameters
    ----------
    system, parameter
        The system, and any real parameter of it.
    band
        (low, high), low < high.
    unit
        "Hz" where the band is in hertz and the parameter is the forcing frequency, in radians per
        second; by default the band is in the unit of the parameter.

    Raises
    ------
    InvalidParameterError
        No such parameter, a band that is empty or reversed, values that the system refuses, a unit
        of a parameter that is not the forcing frequency.
    """
    parameter_value(system, parameter)
    low, high = ends_of("bounds", band)
    check_kind("unit", unit, str, '"Hz" or ""')
    check_choice("unit", unit, [*BAND_FACTORS])
    if unit:
        _check_frequency(system, parameter, unit)
    found = Band(parameter, low / BAND_FACTORS[unit], high / BAND_FACTORS[unit], unit)
    for value in (found.low, found.high):
        _check_value(system, parameter, value)
    if not unit and getattr(system, "si", False) and is_frequency(system, parameter):
        _question(found, natural_frequencies(mechanism_of(system)))
    return found


def _question(band: Band, natural: Floats) -> None:
    """Warn of a band far from all natural frequencies, which it would hold in hertz."""
    low, high = NEAR_BAND_FACTOR * band.low, band.high / NEAR_BAND_FACTOR
    near = (low <= natural) & (natural <= high)
    in_hertz = (band.low / HERTZ <= natural) & (natural <= band.high / HERTZ)
    if in_hertz.any() and not near.any():
        there = ", ".join(f"{HERTZ * x:.4g} Hz ({x:.4g} rad/s)" for x in natural[in_hertz])
        warn(
            f"bounds = ({band.low:g}, {band.high:g}): is in rad/s, far from the natural frequency of the machine, "
            f"{there}. Give unit = 'Hz', or --unit Hz, if hertz are meant."
        )


def is_frequency(system: System, parameter: str) -> bool:
    """Whether all forcing frequencies are equal or proportional to a parameter."""
    m = mechanism_of(system)
    if not m.forces:
        return False
    value, varied = parameter_value(system, parameter), expanded(system, parameter)
    for force in varied.forces:
        omega, by = jet(force.omega).coefficients[:2]
        if abs(by * value - omega) > PROPORTIONAL_RELATIVE * omega:
            return False
    return abs(derivative(jet(varied.omega)) - 1.0) <= PROPORTIONAL_RELATIVE


def _check_frequency(system: System, parameter: str, unit: str) -> None:
    if not is_frequency(system, parameter):
        raise InvalidParameterError(
            f"unit = {unit!r}: {parameter} is not the forcing frequency. Leave unit out; the band is "
            "in the unit of the parameter then."
        )


def _check_value(system: System, parameter: str, value: float) -> None:
    """Refuse an end of a band for which the system cannot be built."""
    try:
        mechanism_of(with_parameter(system, parameter, value))
    except InvalidParameterError as error:
        named = with_values(str(error), {parameter: value})
        text = str(error) if not isinstance(system, Mechanism) else named
        raise InvalidParameterError(f"bounds: {text}") from error
