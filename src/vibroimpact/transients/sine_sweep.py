"""Sine sweeps in time: a slow change of the frequency, up and down, and the response on the way.

Method      The frequency changes in steps. Each step lasts whole forcing periods, and the state is handed
            over at the phase with which it began, where the force sin is continuous and only its rate
            jumps: by bifurcation_sweep without settling. Peaks and averages are those of each step,
            between impacts, too. With a rate r steps follow each other by
                w' = w + r n T(w),    T = 2 pi / w;      logarithmic:  w' = w 2^(r n T(w)),         (1)
            n periods a step: the frequency at the begin of a step is that of a steady change.
Assumes     n small against the number of periods in which the response changes; vary it to see
Accuracy    of the motion with these steps, rounding
Reference   Lewis, Trans. ASME 54 (1932) 253: passing through a resonance
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from vibroimpact._core.checks import check_choice, check_count, check_kind, positive, refusal, shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, interruptible
from vibroimpact._core.quantities import with_unit
from vibroimpact._core.types import Count, Floats
from vibroimpact.machines.units import ORDERS, units_of
from vibroimpact.measures.measure import Peak, Row
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.response.band import Band, Unit, band_of, is_frequency
from vibroimpact.results.result import Result
from vibroimpact.simulation.places import AtPhase
from vibroimpact.sweeps.analyses.diagram import WAYS, Way, bifurcation_sweep
from vibroimpact.sweeps.observers.extremes import Extremes
from vibroimpact.sweeps.observers.impacts import Impacts
from vibroimpact.sweeps.observers.rms import Rms
from vibroimpact.sweeps.options import Observe, together

Spacing = Literal["linear", "log"]
QUANTITIES = ("peak", "amplitude", "rms", "mean", "impacts")
DEFAULT_POINTS = 200  # a sweep has so many steps if none are given
MOST_POINTS = 100_000
LABEL = "swept"


@dataclass(frozen=True, eq=False)
class SineSweep(Result):
    """Response to a sine sweep: one value for each step, with dimensions "direction" and "step".

    Attributes
    ----------
    system
        The machine.
    band
        The parameter, its range and unit.
    row
        Row that was observed, such as "x1".
    periods_per_step
        Forcing periods of a step.
    members
        What :func:`~vibroimpact.bifurcation_sweep` gave: final states, statuses and further observers.
    """

    system: System
    band: Band
    row: str
    periods_per_step: Count
    members: xr.Dataset = field(repr=False)

    @property
    def directions(self) -> tuple[str, ...]:
        """The ways: "up", "down"."""
        return tuple(self.members["direction"].values.tolist())

    @property
    def values(self) -> Floats:
        """Values of the parameter, rising, in the unit of the band, shape (k,)."""
        values: Floats = self.members[self.band.parameter].values * self.band.factor
        return values

    @property
    def duration(self) -> float:
        """Time of the sweep in one direction."""
        return float(self.members["time"].values[0].sum())

    def quantity(self, name: str) -> xr.DataArray:
        """One of "peak", "amplitude", "rms", "mean", "impacts", of each step.

        Dims are "direction" and the parameter. Impacts are per forcing period; NaN where a step could
        not be simulated to its end.
        """
        check_choice("quantity", name, QUANTITIES)
        m = self.members
        if name == "impacts":
            found = m["impacts_a"] + m["impacts_b"]
        elif name in ("rms", "mean"):
            found = m[f"{LABEL}_{name}"]
        else:
            low, high = (m[f"{LABEL}_{end}"] for end in ("smallest", "largest"))
            found = (high - low) / 2.0 if name == "amplitude" else high.where(high > -low, -low)
        return found.assign_coords({self.band.parameter: self.values}).rename(name)

    @property
    def peak(self) -> Floats:
        """Largest modulus of the row in each step, shape (directions, k)."""
        return np.asarray(self.quantity("peak").values)

    @property
    def rms(self) -> Floats:
        """Root mean square of the row in each step, shape (directions, k)."""
        return np.asarray(self.quantity("rms").values)

    @property
    def hysteresis(self) -> Floats:
        """Peak upwards less peak downwards at each value; there must be both ways."""
        if len(self.directions) < 2:
            raise InvalidParameterError(
                f'way = {self.directions[0]!r}: hysteresis needs way="both".'
            )
        difference: Floats = self.peak[0] - self.peak[1]
        return difference

    def __repr__(self) -> str:
        parts, units = [], units_of(self.system)
        unit = self.band.unit or units.unit(units.quantity_of(self.band.parameter))
        for way, peak in zip(self.directions, self.peak, strict=True):
            if np.isfinite(peak).any():
                k = int(np.nanargmax(peak))
                size = units.text(peak[k], quantity=ORDERS.get(self.row[:1], ""))
                parts.append(f"{way} {size} at {with_unit(self.values[k], unit=unit)}")
        return (
            f"SineSweep: {self.values.size} steps of {self.periods_per_step} periods from "
            f"{with_unit(self.values[0], self.values[-1], unit=unit)}; largest {self.row}: "
            f"{', '.join(parts)}"
        )

    def to_dataset(self) -> xr.Dataset:
        """All quantities as an xarray dataset, with the time at which each step begins."""
        lasting = self.members["time"]
        order = {"up": slice(None), "down": slice(None, None, -1)}
        begin = np.array(
            [
                _begins(row[order[way]])[order[way]]
                for way, row in zip(self.directions, lasting.values, strict=True)
            ]
        )
        found = xr.Dataset({name: self.quantity(name) for name in QUANTITIES})
        name, units = self.band.parameter, units_of(self.system)
        found = found.assign(time=(("direction", name), begin)).assign_attrs(
            system=repr(self.system), of=self.row, unit=self.band.unit,
            periods_per_step=self.periods_per_step,
        )  # fmt: skip
        found = units.of_variables(found, {name: units.quantity_of(name), "time": "time"})
        if self.band.unit:
            found.variables[name].attrs["units"] = self.band.unit
        return found


def _begins(lasting: Floats) -> Floats:
    begins: Floats = np.cumsum(lasting) - lasting
    return begins


@interruptible
def sine_sweep(
    system: System,
    parameter: str,
    bounds: tuple[float, float],
    *,
    row: Row = "x1",
    unit: Unit = "",
    points: int | None = None,
    rate: float | None = None,
    spacing: Spacing = "linear",
    periods_per_step: int = 10,
    way: Way = "both",
    start: State | None = None,
    observe: Observe = (),
    most_impacts: int | None = None,
    backend: str = "threads",
    workers: int | None = None,
    client: Any = None,
    tile: int | None = None,
    progress: ProgressOption = True,
) -> SineSweep:
    """Sweep the forcing frequency slowly, up and down, and observe the response on the way.

    Parameters
    ----------
    system
        System with a harmonic force.
    parameter
        Name of the forcing frequency; another parameter may be swept as well.
    bounds
        (low, high), low < high.
    row
        Row that is observed: a coordinate "x1", a sum such as "x2 - x1", or coefficients.
    unit
        "Hz" for a band in hertz of a frequency in radians per second; by default that of the parameter.
    points
        Number of values from low to high, 200 where neither it nor ``rate`` is given.
    rate
        Change of the parameter per time, > 0, instead of ``points``, in the unit of the band; octaves
        per time for ``spacing="log"``.
    spacing
        "linear" or "log".
    periods_per_step
        Forcing periods at each value, >= 1.
    way
        "up", "down", or "both": down from where up ended.
    start
        State at the first value; by default at rest.
    observe
        Further observers.
    most_impacts, backend, workers, client, tile, progress
        As for :func:`~vibroimpact.sweep`.

    Returns
    -------
    SineSweep
        Peak, amplitude, rms, mean of the row and impacts in each step; ``hysteresis``.

    Raises
    ------
    InvalidParameterError
        A band outside of what the system allows, both ``points`` and ``rate``, a row of velocities,
        more than 10^5 of them.

    Notes
    -----
    This is a transient: a step begins with the motion of the one before. With more periods per step the
    response comes near the steady one.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6,
    ...                          half_clearance=8.0, omega=1.0)
    >>> swept = vi.sine_sweep(damper, "omega", (0.8, 1.2), points=41, progress=False)
    >>> swept.peak.shape, bool(swept.peak.max() < 25.0)
    ((2, 41), True)
    """
    if not mechanism_of(system).forces:
        raise InvalidParameterError("system: has no harmonic force to be swept. Give it forces.")
    chosen = band_of(system, parameter, bounds, unit)
    check_choice("spacing", spacing, ("linear", "log"))
    check_choice("way", way, WAYS)
    check_count("periods_per_step", periods_per_step, 1)
    check_kind("start", start, (State, type(None)), "a State, or None for rest")
    measure = Peak(row)
    if measure.derivatives:
        raise refusal("row", row, 'a row of coordinates, such as "x1" or "x2 - x1"')
    m = mechanism_of(system)
    coefficients = tuple(measure.coefficients(m).tolist())
    if spacing == "log" and chosen.low <= 0.0:
        raise refusal("bounds", bounds, "above 0 for spacing = 'log'")
    values = _values(system, chosen, points, rate, spacing, periods_per_step)
    own = [Extremes(row=coefficients, label=LABEL), Rms(row=coefficients, label=LABEL), Impacts()]
    observers = together(own, observe)
    members = bifurcation_sweep(
        system, over={parameter: values}, start=start or _rest(m.degrees), way=way, at=AtPhase(),
        points=1, observe=observers, settle_periods=0, periods=periods_per_step,
        most_impacts=most_impacts, backend=backend, workers=workers, client=client, tile=tile,
        progress=progress,
    )  # fmt: skip
    return SineSweep(system, chosen, measure.text, int(periods_per_step), members)


def _rest(n: int) -> State:
    return State((0.0,) * n, (0.0,) * n)


def _values(
    system: System,
    band: Band,
    points: int | None,
    rate: float | None,
    spacing: Spacing,
    periods: int,
) -> Floats:
    """Values of the steps in the unit of the parameter, (1)."""
    if points is not None and rate is not None:
        raise InvalidParameterError(
            f"points = {shown(points)}, rate = {shown(rate)}: give one of them. With a rate their number follows."
        )
    if rate is None:
        count = DEFAULT_POINTS if points is None else points
        check_count("points", count, 2, MOST_POINTS)
        space = np.geomspace if spacing == "log" else np.linspace
        return np.asarray(space(band.low, band.high, count))
    own = positive("rate", rate)
    if spacing == "linear":
        own /= band.factor
    lasting = _lasting(system, band.parameter, periods)
    change = math.log2(band.high / band.low) if spacing == "log" else band.high - band.low
    found = [band.low]
    most = change / (own * min(lasting(band.low), lasting(band.high)))
    if not most <= MOST_POINTS:
        raise refusal("rate", rate, f"so fast that there are at most {MOST_POINTS} steps")
    while found[-1] < band.high:
        change = own * lasting(found[-1])
        found.append(found[-1] * 2.0**change if spacing == "log" else found[-1] + change)
    return np.array([*found[:-1], band.high])


def _lasting(system: System, parameter: str, periods: int) -> Callable[[float], float]:
    """Duration of a step, by the value of the parameter."""
    if is_frequency(system, parameter):
        return lambda value: periods * 2.0 * math.pi / value
    return lambda value: (
        periods * 2.0 * math.pi / mechanism_of(with_parameter(system, parameter, value)).omega
    )
