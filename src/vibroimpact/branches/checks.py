"""Checks before a branch is followed: parameters along which the equations fail are refused."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import parameter_value, with_parameter
from vibroimpact.model.symmetries import SAME
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import asymmetry, symmetry_of

RANGE_HALVINGS = 50  # a range that is halved so often is no wider than rounding


def check_parameter(orbit: Orbit, parameter: str, bounds: tuple[float, float]) -> None:
    """Refuse an orbit that is not on a branch, and a parameter that its equations forbid.

    Raises
    ------
    InvalidParameterError
        An orbit of a family; a parameter that changes the ratios of the forcing frequencies, or
        that breaks the symmetry of an orbit that was solved as symmetric.
    """
    if orbit.family_dimension:
        raise InvalidParameterError(
            f"orbit = {orbit.symbol}: is one of a {orbit.family_dimension}-parameter family at the "
            "same parameters, so that there is no branch of single orbits. Give the system a loss "
            "or a forcing, and add a spring where it can be shifted as a whole."
        )
    compile_prescribed(orbit.system, parameter, orbit.problem.codes)
    if not orbit.symmetric:
        return
    value = parameter_value(orbit.system, parameter)
    for bound in bounds:
        m = _towards(orbit, parameter, value, bound)
        if m and (why := _moved(m, orbit)):
            raise InvalidParameterError(
                f"parameter = {parameter!r}: breaks the symmetry of the orbit: {why}. Solve for it "
                "with find_orbit(..., symmetric=False)."
            )


def _moved(m: Mechanism, orbit: Orbit) -> str:
    """Reason why a mechanism does not have the symmetry of an orbit; "" where it has."""
    if why := asymmetry(m, orbit.signature.cycles):
        return why
    own, here = orbit.problem.symmetry, symmetry_of(m, orbit.signature)
    if own is None or here is None:
        return "the machine has another symmetry there"
    apart = np.abs(np.subtract(here.shift, own.shift)).max()
    return "" if apart <= SAME * np.abs(own.shift).max() else "it moves the centre"


def _towards(orbit: Orbit, parameter: str, value: float, bound: float) -> Mechanism | None:
    """Mechanism between a value and a bound, as near to the value as the system requires.

    None where no value on that side is allowed: the branch will end there, with a status.
    """
    for halvings in range(1, RANGE_HALVINGS):
        there = value + (bound - value) * 0.5**halvings
        with suppress(InvalidParameterError):
            return mechanism_of(with_parameter(orbit.system, parameter, there))
    return None
