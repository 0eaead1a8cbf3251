"""Bands of a parameter, in its own unit or in hertz."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from vibroimpact._core.checks import check_choice, check_kind, ends_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.machines.units import scales_or_ones
from vibroimpact.measures.flights import derivative, jet
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import expanded, parameter_value, with_parameter, with_values
from vibroimpact.model.system import System, mechanism_of

Unit = Literal["", "Hz", "rad/s"]
CYCLES = {"Hz": 2.0 * math.pi, "rad/s": 1.0}  # radians per second
FACTOR = 1e-9  # relative: a parameter that all frequencies are proportional to


class Band(NamedTuple):
    """A range of a parameter.

    Attributes
    ----------
    parameter, low, high
        Its name, and the range in the system's own units.
    unit
        "" for these, "Hz" or "rad/s".
    factor
        From the system's own to this unit.
    """

    parameter: str
    low: float
    high: float
    unit: Unit = ""
    factor: float = 1.0

    def own(self, value: float) -> float:
        """A value in the system's own units."""
        return value / self.factor

    def values(self, count: int) -> Floats:
        """Evenly spaced values in the system's own units, both ends included."""
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
        "Hz" or "rad/s" where the band is in these and the parameter is the forcing frequency; by
        default the unit of the parameter itself, scaled for a machine that was made by
        ``from_physical``. Without such scales the unit of time of the system is the second.

    Raises
    ------
    InvalidParameterError
        No such parameter, a band that is empty or reversed, values that the system refuses, a unit
        of a parameter that is not the forcing frequency.
    """
    parameter_value(system, parameter)
    low, high = ends_of("band", band)
    factor = 1.0
    check_kind("unit", unit, str, '"Hz", "rad/s" or ""')
    if unit:
        check_choice("unit", unit, [*CYCLES])
        _check_frequency(system, parameter, unit)
        factor = scales_or_ones(system).frequency / CYCLES[unit]
    for value in (low, high):
        _check_value(system, parameter, value / factor)
    return Band(parameter, low / factor, high / factor, unit, factor)


def is_frequency(system: System, parameter: str) -> bool:
    """Whether all forcing frequencies are equal or proportional to a parameter."""
    m = mechanism_of(system)
    if not m.forces:
        return False
    value, varied = parameter_value(system, parameter), expanded(system, parameter)
    for force in varied.forces:
        omega, by = jet(force.omega).coefficients[:2]
        if abs(by * value - omega) > FACTOR * omega:
            return False
    return abs(derivative(jet(varied.omega)) - 1.0) <= FACTOR


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
        raise InvalidParameterError(f"band: {text}") from error
