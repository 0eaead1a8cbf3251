"""Objectives of a design: the worst, or the mean, of a measure over a band, starts and uncertainties.

Method      Every machine is simulated at evenly spaced values of the band, from the same random
            starts, at the middle and the corners of the uncertainties; all of these, of all machines,
            are members of one sweep (population.py). The worst is the largest of the measure over
            them; the mean is that over starts and uncertainties, and over the band by the trapezoidal
            rule.
Accuracy    that of the grid: narrow peaks between two values of the band are not seen; attractors with
            small basins are missed
Fails       A machine of which one member does not reach the end of its window, for too many impacts,
            has no value: it is worse than any other. Starts behind a stop do not count.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from vibroimpact._core.checks import (
    LARGEST_SEED,
    check_choice,
    check_count,
    check_kind,
    check_memory,
    ends_of,
    names_arguments,
    nonnegative,
    positive,
    real,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Floats
from vibroimpact.design.population import NUMBER, Population
from vibroimpact.measures.linear import free_motion
from vibroimpact.measures.measure import Measure, measure_of
from vibroimpact.model.parameters import parameter_value, with_parameters
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.response.answers import SAMPLED_MACHINES, random_starts, rest_of
from vibroimpact.response.band import Band, Unit, band_of
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.final import Final
from vibroimpact.sweeps.starts import RandomStarts
from vibroimpact.sweeps.sweep import sweep

Aim = Literal["small", "large"]
Kind = Literal["worst", "mean"]
Spread = Mapping[str, float | tuple[float, float]]

BYTES_PER_MEMBER = 2**8  # of a member: start, parameters, what is observed
LINEAR_VALUES = 101  # the machine without impacts is measured at so many values of the band
# A ratio of powers has ten times its logarithm, one of all other quantities twenty times.
DECIBELS_OF_RATIO = {"power": 10.0}


@names_arguments()
@dataclass(frozen=True)
class Objective:
    """Number of a machine by which designs are compared: the worst, or the mean, of a measure over a band.

    Parameters
    ----------
    parameter, bounds
        Usually the forcing frequency, and (low, high) of it, both ends included.
    measure
        A measure or its name, as for :func:`~vibroimpact.frequency_response`: "x1", "rms v1", ...
    kind
        "worst" over the band, starts and uncertainties; or "mean": over the band the integral divided by its width,
        by the trapezoidal rule, over starts and uncertainties of all members equally.
    points
        Evenly spaced values of the band, >= 2.
    starts
        Random starts at each of them, >= 1, the same for all machines.
    seed
        Seed of the random starts.
    settle_periods, periods
        Forcing periods before, and while, motions are observed.
    unit
        "Hz" if the band is in hertz of a frequency in radians per second; by default that of the parameter.
    spread
        Parameters that are not known: a range (low, high) of values, or a number, the half width
        relative to the value of the machine. The machine is run at the middle and at all corners.
    aim
        "small": the worst is the largest value; "large", for a harvester: it is the smallest.

    Notes
    -----
    A machine costs points x starts x (1 + 2^k) x (settle_periods + periods) forcing periods with k
    uncertain parameters: about ten milliseconds for an impact damper with the defaults, whatever is
    measured.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> vi.Objective("omega", (0.8, 1.2), "x1", spread={"restitution": (0.5, 0.7)}).points
    24
    >>> vi.Objective("omega", (6.0, 10.0), "power", kind="mean", unit="Hz", aim="large").kind
    'mean'
    """

    parameter: str
    bounds: tuple[float, float]
    measure: Measure | str = "x1"
    _: KW_ONLY
    kind: Kind = "worst"
    points: int = 24
    starts: int = 4
    seed: int = 0
    settle_periods: float = 250
    periods: float = 50
    unit: Unit = ""
    spread: Spread | None = field(default=None, hash=False)
    aim: Aim = "small"

    def __post_init__(self) -> None:
        check_kind("parameter", self.parameter, str, "the name of a parameter")
        check_kind("measure", self.measure, (str, Measure), "a measure or its name, such as 'x1'")
        check_choice("kind", self.kind, ["worst", "mean"])
        check_choice("aim", self.aim, ["small", "large"])
        check_count("points", self.points, 2)
        check_count("starts", self.starts, 1)
        check_memory(
            "points",
            self.points,
            int(self.starts) * BYTES_PER_MEMBER,
            "Take fewer, or fewer starts.",
        )
        check_count("seed", self.seed, 0, LARGEST_SEED)
        checked = {
            "bounds": ends_of("bounds", self.bounds),
            "points": int(self.points),
            "starts": int(self.starts),
            "seed": int(self.seed),
            "settle_periods": nonnegative("settle_periods", self.settle_periods),
            "periods": positive("periods", self.periods),
            "spread": None if self.spread is None else _spread(self.spread),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def sign(self) -> float:
        """1 where small values are good, -1 where large ones are."""
        return 1.0 if self.aim == "small" else -1.0


def _spread(spread: Any) -> Spread:
    check_kind("spread", spread, Mapping, "a dictionary from names of parameters to ranges")
    found: dict[str, float | tuple[float, float]] = {}
    for name, width in spread.items():
        label = f"spread[{name!r}]"
        if isinstance(width, Sequence | np.ndarray):
            found[name] = ends_of(label, width)
            continue
        half = real(label, width, "a range (low, high), or a relative half width in (0, 1)")
        if not 0.0 < half < 1.0:
            raise refusal(label, width, "in (0, 1), a half width relative to the parameter")
        found[name] = half
    return found


# ---- of machines ---------------------------------------------------------------------------------


class Member(NamedTuple):
    """A simulated motion of a machine."""

    value: float  # its measure
    system: System  # the machine at that place of the band and of the uncertainties
    state: State  # a state on the motion
    # value of each uncertain parameter that has a relative width over that of the machine
    factors: dict[str, float]


@dataclass(frozen=True, eq=False)
class Judge:
    """An objective for machines of one kind."""

    # what is judged, the machine, and the names of its parameters that vary
    objective: Objective
    system: System
    names: tuple[str, ...]
    # those of the objective, for the machine
    band: Band
    measure: Measure
    starts: RandomStarts  # the starts of every machine
    options: dict[str, Any] = field(default_factory=dict)  # of the sweeps: workers

    @property
    def factor(self) -> float:
        """Decibels per decade of the ratio: 10 of powers, 20 of others."""
        return DECIBELS_OF_RATIO.get(self.measure.dimension, 20.0)

    def decibels(self, value: float, beside: float) -> float:
        """Decibels by which a value is better than another; NaN where one of two that differ is not positive."""
        if value == beside:
            return 0.0
        if not (value > 0.0 and beside > 0.0 and math.isfinite(value) and math.isfinite(beside)):
            return math.nan
        return self.objective.sign * self.factor * math.log10(beside / value)

    def values(self, table: Floats) -> Floats:
        """The objective of each machine, its parameters in a row: shape (k,), NaN without one."""
        _, members, (worth,) = self._measured(table, [self])
        return self._of_members(members, worth, len(table))

    @staticmethod
    def values_of(others: Sequence[Judge], table: Floats) -> Floats:
        """The objectives of several judges, shape (j, k), those with equal members from one sweep."""
        groups: dict[Objective, list[int]] = {}
        for number, other in enumerate(others):
            groups.setdefault(_members_only(other.objective), []).append(number)
        found = np.empty((len(others), len(table)))
        for numbers in groups.values():
            some = [others[k] for k in numbers]
            _, members, worths = some[0]._measured(table, some)
            for k, worth in zip(numbers, worths, strict=True):
                found[k] = others[k]._of_members(members, worth, len(table))
        return found

    def _of_members(self, members: xr.Dataset, worth: Floats, machines: int) -> Floats:
        """The objective of each machine from the measure of its members."""
        counted = members["end"].values != MemberStatus.INITIAL_PENETRATION
        shape = machines, len(self._corners), self.objective.points, -1
        worth, counted = worth.reshape(shape), counted.reshape(shape)
        if self.objective.kind == "worst":
            sign = self.objective.sign
            signed = np.where(counted, sign * worth, -math.inf).max(axis=(1, 2, 3))
            return np.where(np.isfinite(signed), sign * signed, math.nan)
        with np.errstate(invalid="ignore"):
            over = np.where(counted, worth, 0.0).sum(axis=(1, 3)) / counted.sum(axis=(1, 3))
        return np.asarray(over @ _weights(self.objective.points))

    def over_band(self, row: Floats) -> Floats:
        """The worst value of a machine at each value of the band, shape (points,)."""
        _, _, (worth,) = self._measured(row[None], [self])
        shaped = self.objective.sign * worth.reshape(len(self._corners), self.objective.points, -1)
        shaped = np.where(np.isnan(shaped), -math.inf, shaped).max(axis=(0, 2))
        return np.asarray(self.objective.sign * np.where(np.isinf(shaped), math.nan, shaped))

    def worst(self, row: Floats) -> Member:
        """The member of a machine that is worst.

        Raises
        ------
        InvalidParameterError
            None has a value.
        """
        every = [one for corner in self.worst_each(row) for one in corner]
        valued = [one for one in every if math.isfinite(one.value)]
        if not valued:
            raise InvalidParameterError(
                f"objective: no motion of {self.machine(row)} reaches the end of its window."
            )
        return max(valued, key=lambda one: self.objective.sign * one.value)

    def worst_each(self, row: Floats) -> list[list[Member]]:
        """The worst members of a machine: for each corner of the uncertainties, over the band.

        Where no motion has a value it is NaN, and the state is zero.
        """
        population, members, (worth,) = self._measured(row[None], [self])
        signed = np.where(np.isnan(worth), -math.inf, self.objective.sign * worth)
        start = np.argmax(signed, axis=1)
        ends = [members[f"final_{kind}"].values for kind in ("position", "velocity", "phase")]
        found, points = [], self.objective.points
        for number, k in enumerate(start.tolist()):
            none = not math.isfinite(worth[number, k])
            place, speed, phase = (
                np.zeros_like(e[number, k]) if none else e[number, k] for e in ends
            )
            corner = self._corners[number // points]
            factors = {name: factor for name, (factor, _) in corner.items() if factor}
            machine = with_parameters(self.system, population.values(number))
            state = State(tuple(place.tolist()), tuple(speed.tolist()), float(phase))
            found.append(Member(float(worth[number, k]), machine, state, factors))
        return [found[k : k + points] for k in range(0, len(found), points)]

    @cached_property
    def without_impacts(self) -> float:
        """The objective of the machine as it was given, all stops open, in closed form.

        The worst over the band is located, not that of the points. NaN where a motion without impacts
        does not settle. A machine without stops is judged as it was given.
        """
        given = np.array([parameter_value(self.system, name) for name in self.names])
        if not any(e.is_stop for e in mechanism_of(self.system).elements):
            return float(self.values(given[None])[0])
        values = self.opened(LINEAR_VALUES)
        if self.objective.kind == "mean" or not np.isfinite(values).all():
            return float(values @ _weights(LINEAR_VALUES))
        return self._worst_opened(values)

    def _worst_opened(self, values: Floats) -> float:
        from scipy.optimize import minimize_scalar

        sign, at = self.objective.sign, self.band.values(LINEAR_VALUES)
        k = int(np.argmax(sign * values))
        ends = at[max(k - 1, 0)], at[min(k + 1, LINEAR_VALUES - 1)]
        found = minimize_scalar(lambda x: -sign * self._opened(x), bounds=ends, method="bounded")
        return float(sign * max(-found.fun, sign * values[k]))

    def opened(self, points: int) -> Floats:
        """The measure of the machine as given, all stops open, over the band; NaN where none."""
        return np.array([self._opened(value) for value in self.band.values(points).tolist()])

    def _opened(self, value: float) -> float:
        motion = free_motion(
            with_parameters(self.system, {self.band.parameter: float(value)}), opened=True
        )
        if isinstance(motion, str) or not motion.settles:
            return math.nan
        return self.measure.of_orbit(motion)

    def machine(self, row: Floats) -> System:
        """The machine with these values of its parameters."""
        return with_parameters(self.system, dict(zip(self.names, row.tolist(), strict=True)))

    def check_finer(self, times: int) -> None:
        """Refuse a refinement for which there is no memory."""
        o = self.objective
        check_memory("refine", times, times * o.points * o.starts * BYTES_PER_MEMBER, "Take less.")

    def finer(self, times: int, *, seed: int = 0) -> Judge:
        """Return a judge with ``refine`` times as many steps over the band and starts; seed 0 keeps its own."""
        self.check_finer(times)
        o = self.objective
        finer = replace(
            o, points=times * (o.points - 1) + 1, starts=times * o.starts, seed=seed or o.seed
        )
        return judge_of(self.system, finer, self.names, self.options.get("workers"))

    @property
    def _corners(self) -> list[dict[str, tuple[float, float]]]:
        """Middle and corners of the uncertainties: (factor, 0) or (0, value) by name."""
        spread = self.objective.spread or {}
        if not spread:
            return [{}]
        middle = {name: _at(width, 0.5) for name, width in spread.items()}
        ends = itertools.product(*([_at(w, 0.0), _at(w, 1.0)] for w in spread.values()))
        names = list(spread)
        return [middle, *(dict(zip(names, one, strict=True)) for one in ends)]

    def _population(self, table: Floats) -> Population:
        """All machines at all corners and all values of the band, the last fastest."""
        corners, values = self._corners, self.band.values(self.objective.points)
        each, size = len(corners) * len(values), len(table) * len(corners) * len(values)
        columns = {name: np.repeat(table[:, i], each) for i, name in enumerate(self.names)}
        for name in self.objective.spread or {}:
            own = columns.get(name, np.full(size, parameter_value(self.system, name)))
            factor, value = (np.array([corner[name][k] for corner in corners]) for k in (0, 1))
            spread = (np.tile(np.repeat(part, len(values)), len(table)) for part in (factor, value))
            columns[name] = own * next(spread) + next(spread)
        columns[self.band.parameter] = np.tile(values, len(table) * len(corners))
        return Population(self.system, columns)

    def _measured(
        self, table: Floats, judges: Sequence[Judge]
    ) -> tuple[Population, xr.Dataset, list[Floats]]:
        """The population of these machines, its members, and each judge's measure: (k, starts)."""
        population, o = self._population(table), self.objective
        measures = [measure_of(population, judge.objective.measure) for judge in judges]
        observers = [one for measure in measures for one in measure.observers]
        members = sweep(
            population, over={NUMBER: np.arange(population.count, dtype=float)},
            start=self.starts, observe=[*observers, Final()], settle_periods=o.settle_periods, periods=o.periods,
            progress=False, **self.options,
        )  # fmt: skip
        return population, members, [measure.of_sweep(members).values for measure in measures]


def _members_only(objective: Objective) -> Objective:
    """An objective without what its members do not depend on."""
    return replace(objective, kind="worst", measure="", aim="small")


def _weights(points: int) -> Floats:
    """Weights of the trapezoidal rule, whose sum is 1."""
    weights = np.ones(points)
    weights[[0, -1]] = 0.5
    return np.asarray(weights / weights.sum())


def judge_of(
    system: System, objective: Objective, names: Sequence[str], workers: int | None = None
) -> Judge:
    """Bind an objective to a machine and the names of its parameters that vary.

    Raises
    ------
    InvalidParameterError
        A band or a measure that the machine does not have; a parameter that is named twice.
    """
    check_kind(
        "objective",
        objective,
        Objective,
        "a vi.Objective, such as vi.Objective('omega', (0.9, 1.1))",
    )
    if workers is not None:
        check_count("workers", workers, 1)
    band = band_of(system, objective.parameter, objective.bounds, objective.unit)
    if band.parameter in names:
        raise InvalidParameterError(
            f"bounds[{band.parameter!r}]: is what the band of the objective varies. Leave it out."
        )
    if not mechanism_of(system).forces:
        raise InvalidParameterError("system: has no forcing, so it does not settle on a motion.")
    _check_spread(system, objective, names, band)
    first = with_parameters(system, {band.parameter: band.low})
    measure = measure_of(first, objective.measure)
    base = rest_of(first)
    sampled = [
        with_parameters(system, {band.parameter: v}) for v in band.values(SAMPLED_MACHINES).tolist()
    ]
    starts = random_starts(first, sampled, objective.starts, objective.seed, base)
    options = {} if workers is None else {"workers": workers}
    return Judge(objective, system, tuple(names), band, measure, starts, options)


def _check_spread(system: System, objective: Objective, names: Sequence[str], band: Band) -> None:
    """Refuse uncertain parameters that there are not, or that are given twice."""
    for name, width in (objective.spread or {}).items():
        value = parameter_value(system, name)
        if name == band.parameter:
            raise InvalidParameterError(f"spread[{name!r}]: is what the band varies. Leave it out.")
        if not isinstance(width, float):
            if name in names:
                raise refusal(
                    f"spread[{name!r}]", width, "a relative half width, for a parameter that varies"
                )
            for end in width:
                mechanism_of(with_parameters(system, {name: end}))
        elif name not in names:
            for end in (1.0 - width, 1.0 + width):
                mechanism_of(with_parameters(system, {name: end * value}))


def _at(width: float | tuple[float, float], part: float) -> tuple[float, float]:
    """Factor of, and addition to, the value of a machine at a part of a range, 0 to 1."""
    if isinstance(width, float):
        return 1.0 + width * (2.0 * part - 1.0), 0.0
    low, high = width
    return 0.0, low + part * (high - low)
