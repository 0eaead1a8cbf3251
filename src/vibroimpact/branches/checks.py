"""What is refused before a branch is followed: ranges, parameters, starts of the wrong kind."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

from vibroimpact.errors import InvalidParameterError
from vibroimpact.mechanism import Mechanism
from vibroimpact.orbits import SymmetricOrbit
from vibroimpact.parameters import parameter_value, with_parameter
from vibroimpact.periodic.find import of_symmetric
from vibroimpact.periodic.orbit import Orbit
from vibroimpact.periodic.prescribed import compile_prescribed
from vibroimpact.periodic.problem import asymmetry
from vibroimpact.simulate import mechanism_of

NARROWEST = 256.0  # units in the last place of the parameter
HALVINGS = 50  # of a range, until it is no wider than rounding


def converged(orbit: Any) -> Orbit:
    """An orbit that a branch can start at.

    Raises
    ------
    InvalidParameterError
        Something else, or an orbit that is not converged.
    """
    start = of_symmetric(orbit) if isinstance(orbit, SymmetricOrbit) else orbit
    if not isinstance(start, Orbit) or not start.converged:
        raise InvalidParameterError(
            f"orbit = {orbit!r}: must be a converged orbit, as find_orbit gives."
        )
    return start


def range_of(bounds: Any, parameter: str, value: float) -> tuple[float, float]:
    """(low, high) as floats, with a value of the parameter between.

    Raises
    ------
    InvalidParameterError
        Not two finite numbers, not in this order, without the value, or so close that hardly a
        number lies between.
    """
    low, high = math.nan, math.nan
    with suppress(TypeError, ValueError):
        low, high = (float(bound) for bound in bounds)
    if not (math.isfinite(low) and math.isfinite(high) and low < high and low <= value <= high):
        raise InvalidParameterError(
            f"bounds = {bounds!r}: need low < high with {parameter} = {value} of the orbit between."
        )
    narrowest = NARROWEST * math.ulp(max(abs(low), abs(high)))
    if high - low < narrowest:
        raise InvalidParameterError(
            f"bounds = {bounds!r}: are {high - low:.1e} apart; rounding of {parameter} asks for at "
            f"least {narrowest:.1e}."
        )
    return low, high


def check_parameter(orbit: Orbit, parameter: str, bounds: tuple[float, float]) -> None:
    """Refuse a parameter along which the orbit's equations do not hold.

    Raises
    ------
    InvalidParameterError
        One that changes the ratios of the forcing frequencies, or that breaks the symmetry of an
        orbit that was solved as symmetric.
    """
    compile_prescribed(orbit.system, parameter)
    if not orbit.symmetric:
        return
    value = parameter_value(orbit.system, parameter)
    for bound in bounds:
        m = _towards(orbit, parameter, value, bound)
        if m and (why := asymmetry(m, orbit.signature.cycles)):
            raise InvalidParameterError(
                f"parameter = {parameter!r}: breaks the symmetry of the orbit: {why}. Solve for it "
                "with find_orbit(..., symmetric=False)."
            )


def _towards(orbit: Orbit, parameter: str, value: float, bound: float) -> Mechanism | None:
    """The mechanism between a value and a bound, as near to the value as the system asks for.

    None where it takes no value on that side: the branch will end there, with a status.
    """
    for halvings in range(1, HALVINGS):
        there = value + (bound - value) * 0.5**halvings
        with suppress(InvalidParameterError):
            return mechanism_of(with_parameter(orbit.system, parameter, there))
    return None
