"""Verification that a zero of a test function is a special point.

Method      at the zero the equations hold (checked by family.py), and of the solved map
            SN, BP         a multiplier is 1
            PD             a multiplier is -1, as it is at BP of a symmetric orbit
            NS             a complex pair has the product 1. Two other zeros of its function are
                           no bifurcation: a real pair with the product 1 (a neutral saddle), and
                           an impact speed that vanishes, which is a factor of the function
            within CRITICAL_DISTANCE. At ZERO, SIM and STICK the function itself, a speed, a time, an
            acceleration, is below VANISHED_OF_LARGEST of its largest along the curve.
Assumes     no more than three multipliers meet: rounding moves a triple one by its cube root
Fails       a sentence with the condition that fails. Where an impact speed vanishes, all functions
            of the equations can have a zero that is not one of the map: an undamped flight over
            whole half periods of its own does this.
"""

from __future__ import annotations

import numpy as np

from vibroimpact._core.types import Complexes
from vibroimpact.branches.family import FLIP, SPEED, TORUS, OrbitFamily
from vibroimpact.continuation import Curve, LocatedPoint
from vibroimpact.continuation.panel import BUILT_IN
from vibroimpact.orbits.orbit import Orbit

# A critical multiplier is so near: more than the cube root of rounding, 6e-6.
CRITICAL_DISTANCE = 1e-5
VANISHED_OF_LARGEST = 1e-8  # what is smaller, relative to its largest value, is zero


def why_none(family: OrbitFamily, curve: Curve, point: LocatedPoint, orbit: Orbit) -> str:
    """Reason why a zero of a test function is no special point; "" where it is one."""
    if not orbit.converged:
        return f"the orbit there is not solved for: {orbit.status}"
    if point.test in BUILT_IN:
        return _not_critical(orbit, 1.0)
    if point.test == FLIP:
        return _not_critical(orbit, -1.0)
    if point.test == TORUS:
        return _no_pair(orbit)
    value = float(family.watch(point.z[None], np.array([point.parameter]))[point.test][0])
    size = float(np.nanmax(np.abs(curve.tests[point.test])))
    return (
        ""
        if abs(value) <= VANISHED_OF_LARGEST * size
        else f"{point.test} is not zero there, but {value:g}"
    )


def is_neutral(curve: Curve, point: LocatedPoint, orbit: Orbit) -> bool:
    """Whether a zero of the function for NS is one of the two kinds without bifurcation."""
    if point.test != TORUS or not orbit.converged:
        return False
    fastest = [np.abs(f).max() for name, f in curve.tests.items() if name.startswith(SPEED)]
    if np.any(np.abs(orbit.linearised.rate) <= VANISHED_OF_LARGEST * np.array(fastest)):
        return True
    first, second = _critical_pair(orbit)
    return abs(first * second - 1.0) <= CRITICAL_DISTANCE and first.imag == 0.0


def _solved(orbit: Orbit) -> Complexes:
    """Multipliers of the solved map."""
    return orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers


def _not_critical(orbit: Orbit, value: float) -> str:
    mu = _solved(orbit)
    nearest = mu[np.argmin(np.abs(mu - value))]
    if abs(nearest - value) <= CRITICAL_DISTANCE:
        return ""
    return f"no multiplier is {value:g} there: the nearest is {nearest:.6g}"


def _critical_pair(orbit: Orbit) -> tuple[complex, complex]:
    """Two multipliers whose product is nearest to 1."""
    mu = _solved(orbit)
    i, j = np.triu_indices(len(mu), 1)
    nearest = int(np.argmin(np.abs(mu[i] * mu[j] - 1.0)))
    return complex(mu[i[nearest]]), complex(mu[j[nearest]])


def _no_pair(orbit: Orbit) -> str:
    first, second = _critical_pair(orbit)
    if abs(first * second - 1.0) <= CRITICAL_DISTANCE:
        return ""
    return f"no pair of multipliers has the product 1 there: nearest {first:.6g}, {second:.6g}"
