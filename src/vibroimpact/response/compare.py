"""Linear machines beside a response: with all stops open, and with a tuned mass damper.

The tuned mass damper has the mass of the free masses, on which no spring, dashpot or force acts, and
is on the one coordinate that springs hold; it is the best for that machine (tuned.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from vibroimpact._core.checks import check_choice
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.measures.linear import FreeMotion, free_motion
from vibroimpact.measures.measure import Measure, coefficients_of, with_row
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.stability import Stability
from vibroimpact.response.curves import WithoutImpacts
from vibroimpact.response.tuned import TunedDamper, tuned_damper

if TYPE_CHECKING:
    from vibroimpact.response.response import Response

COMPARISONS = ("linear", "tuned")
COMPARED_POINTS = 200  # a comparison is measured at so many values of the band
UNREACHED_LIMIT = 1e100  # a stop at this limit is never met
# A maximum is located so well, and is one if it is so much higher than its neighbours.
MAXIMUM_RELATIVE = 1e-6
# A value that is so many times the largest of the others is a resonance without damping.
RESONANCE_RATIO = 1e4

_KNOWN: WeakKeyDictionary[Response, dict[str, tuple[Floats, Floats]]] = WeakKeyDictionary()


class Primary(NamedTuple):
    """The machine without its free masses: one coordinate on a spring."""

    coordinate: int  # its number
    # of the coordinate
    mass: float
    damping: float
    stiffness: float
    free_mass: float  # sum of the free masses

    @property
    def zeta(self) -> float:
        """Damping ratio."""
        return self.damping / (2.0 * math.sqrt(self.stiffness * self.mass))


def comparison(response: Response, which: str) -> tuple[Floats, Floats]:
    """Values of the parameter, and the measure of a linear machine at each.

    Parameters
    ----------
    response
        The response beside which it is.
    which
        "linear", all stops open; or "tuned".

    Raises
    ------
    InvalidParameterError
        A machine without free masses, or with several coordinates on springs; a measure that
        involves the free masses.
    """
    known = _KNOWN.setdefault(response, {})
    if which not in known:
        values = response.band.values(COMPARED_POINTS)
        if which == "linear":
            system, name, measure = response.system, response.parameter, response.measure
            free = WithoutImpacts(system, name, measure, opened=True)
            known[which] = values, free.measured(values)[0]
        else:
            measured = measured_beside(response, which)
            known[which] = values, np.array([measured(value) for value in values.tolist()])
    return known[which]


def worst_of_comparison(response: Response, which: str) -> tuple[float, float]:
    """Place of the largest value of a linear machine beside a response in the band, and this value.

    The value is infinite at an undamped resonance, NaN where the machine has no steady motion. The
    place is NaN where the value is the same all over the band.

    Parameters
    ----------
    response, which
        As for :func:`comparison`.
    """
    from scipy.optimize import minimize_scalar

    values, measured = comparison(response, which)
    if np.isnan(measured).all():
        return math.nan, math.nan
    k = int(np.nanargmax(measured))
    if measured[k] - np.nanmin(measured) <= MAXIMUM_RELATIVE * measured[k]:
        return math.nan, float(measured[k])
    inner = values[max(k - 1, 0)], values[min(k + 1, len(values) - 1)]
    value_at = measured_beside(response, which)
    found = minimize_scalar(
        lambda value: -value_at(value), bounds=inner, method="bounded",
        options={"xatol": MAXIMUM_RELATIVE * (inner[1] - inner[0])},
    )  # fmt: skip
    largest, place = max((measured[k], values[k]), (-found.fun, found.x))
    return float(place), float(largest) if largest < RESONANCE_RATIO * measured[k] else math.inf


def touching_factor(response: Response) -> float:
    """Factor by which the force must grow, or the gaps be divided, until a stop is touched in the band.

    NaN where it is not known, or where the motion without impacts is not that of the whole band.
    """
    from scipy.optimize import minimize_scalar

    ends = response.band.low, response.band.high
    curve = next((one for one in response.curves if one.branch is None), None)
    if curve is None or tuple(curve.parameter[[0, -1]].tolist()) != ends:
        return math.nan  # it ends within the band
    if (curve.stability == Stability.INADMISSIBLE).any():
        return math.nan

    def factor(value: float) -> float:
        motion = free_motion(with_parameter(response.system, response.parameter, value))
        return math.nan if isinstance(motion, str) else motion.touching_factor

    values = response.band.values(COMPARED_POINTS)
    found = np.array([factor(value) for value in values.tolist()])
    if not np.isfinite(found).all():
        return float(found.min())
    k = int(found.argmin())
    inner = values[max(k - 1, 0)], values[min(k + 1, len(values) - 1)]
    least = minimize_scalar(factor, bounds=inner, method="bounded")
    return float(min(least.fun, found[k]))


def is_comparable(response: Response) -> bool:
    """Whether the machine with all stops open says what the stops do to the measure.

    It does for rows of coordinates; where there are free masses, which rest then, for rows
    without them.
    """
    row = coefficients_of(response.measure, mechanism_of(response.system))
    if row is None:
        return False
    try:
        held = primary_of(response.system).coordinate
    except InvalidParameterError:
        return True
    return not np.delete(row, held).any()


def decibels(ratio: Any, quantity: str) -> Floats:
    """20 lg of a ratio, 10 lg where the quantity is a power."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((10.0 if quantity == "power" else 20.0) * np.log10(ratio))


def measured_beside(response: Response, which: str) -> Callable[[float], float]:
    """The measure of a linear machine as a function of the parameter."""
    check_choice("compare", which, COMPARISONS)
    measure, system, name = response.measure, response.system, response.parameter
    if which == "linear":
        return lambda value: _opened(measure, with_parameter(system, name, value))
    tuned = _damper_of(primary_of(system))
    return lambda value: _with_tuned(measure, with_parameter(system, name, value), tuned)


def _opened(measure: Measure, system: System) -> float:
    motion = free_motion(system, opened=True)
    if isinstance(motion, str):
        return math.nan
    return measure.of_orbit(motion)


def primary_of(system: System) -> Primary:
    """The one coordinate that springs hold, and the mass of the free ones.

    Raises
    ------
    InvalidParameterError
        Another machine.
    """
    m = mechanism_of(system)
    mass, damping, stiffness = map(np.array, (m.mass, m.damping, m.stiffness))
    held = [
        i for i in range(m.degrees)
        if stiffness[i].any() or stiffness[:, i].any() or damping[i].any() or damping[:, i].any()
        or any(force.sine[i] or force.cosine[i] for force in m.forces)
    ]  # fmt: skip
    free = [i for i in range(m.degrees) if i not in held]
    if len(held) != 1 or not free or stiffness[held[0], held[0]] <= 0.0:
        raise InvalidParameterError(
            f"compare = 'tuned': needs one mass on a spring and free masses beside it; {len(held)} "
            f"of {m.degrees} coordinates have springs, dashpots or forces. Take compare = 'linear'."
        )
    i = held[0]
    return Primary(
        i, float(mass[i, i]), float(damping[i, i]), float(stiffness[i, i]),
        float(sum(mass[j, j] for j in free)),
    )  # fmt: skip


@lru_cache
def _damper_of(primary: Primary) -> TunedDamper:
    return tuned_damper(primary.free_mass / primary.mass, primary.zeta)


def _with_tuned(measure: Measure, system: System, tuned: TunedDamper) -> float:
    """The measure of a machine with a tuned mass damper."""
    m, p = mechanism_of(system), primary_of(system)
    row = coefficients_of(measure, m)
    if row is None or np.delete(row, p.coordinate).any():
        raise InvalidParameterError(
            f"compare = 'tuned': {measure.label} involves more than x{p.coordinate + 1}. "
            f"Measure x{p.coordinate + 1}."
        )
    mass = tuned.mass_ratio * p.mass
    rate = tuned.frequency_ratio * math.sqrt(p.stiffness / p.mass)
    k, c = mass * rate**2, 2.0 * tuned.damping_ratio * rate * mass
    machine = Mechanism(
        mass=[[p.mass, 0.0], [0.0, mass]],
        damping=[[p.damping + c, -c], [-c, c]],
        stiffness=[[p.stiffness + k, -k], [-k, k]],
        forces=tuple(
            Harmonic(f.omega, (f.sine[p.coordinate], 0.0), (f.cosine[p.coordinate], 0.0))
            for f in m.forces
        ),
        elements=(RigidStop((-1.0, 1.0), upper=UNREACHED_LIMIT),),
    )
    if hasattr(measure, "base") and measure.base is None:
        machine_measure = replace(measure, base=_static(m, p))  # type: ignore[call-arg]
    else:
        machine_measure = measure
    motion = FreeMotion(machine, np.zeros(2))
    return with_row(machine_measure, (row[p.coordinate], 0.0)).of_orbit(motion)


def _static(m: Mechanism, p: Primary) -> float:
    """Static deflection of the machine itself, not of the two together."""
    force = m.forces[0]
    return math.hypot(force.sine[p.coordinate], force.cosine[p.coordinate]) / p.stiffness
