"""Answers: motions on which a machine settles over a band, simulated up, down, and from many starts.

Method      Members of :func:`~vibroimpact.sweep` at every value of a parameter: one motion followed
            upwards, then downwards, and one from each random start. Members at one value are one
            answer where their motions have the same kind and the same ranges of all coordinates,
            within SAME_PERIODIC_OF_RANGE of the largest for periodic motions, within
            SAME_IRREGULAR_OF_RANGE for others, whose ranges in a window scatter; mirror images are one answer.
Accuracy    of measured numbers, that of the members, where a window is not whole periods of a periodic motion that of
            a run over its period; extremes of motions that are not periodic grow with the length of the window
Fails       attractors with small basins are missed; slow transients are answers of their own
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.lazy import xr
from vibroimpact._core.quantities import with_unit
from vibroimpact._core.types import Amount, AnyAmount, AnyFloat, Count, Floats, Positive
from vibroimpact.measures.linear import free_motion
from vibroimpact.measures.measure import Measure, Peak, Rms, measure_of, of_same_row
from vibroimpact.measures.motions import Motion
from vibroimpact.model.mechanism import stop_sizes, with_mass
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.stability import Stability, in_words
from vibroimpact.results.result import words_of_codes
from vibroimpact.simulation.places import AtPhase
from vibroimpact.simulation.simulate import simulate
from vibroimpact.sweeps.analyses.diagram import bifurcation_sweep
from vibroimpact.sweeps.analyses.motion_codes import BELOW, motions
from vibroimpact.sweeps.observers.extremes import Extremes
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.starts import Many, RandomStarts
from vibroimpact.sweeps.sweep import sweep

# Ranges of one periodic motion agree so well, relative to the largest.
SAME_PERIODIC_OF_RANGE = 1e-4
SAME_IRREGULAR_OF_RANGE = 0.1  # ranges of one motion that is not periodic agree so well
COMPARED_COORDINATES = 12  # the ranges of so many coordinates at most tell motions apart
SAMPLED_MACHINES = 9  # so many machines of the band tell the size of random speeds
SPEED_FACTOR = 1.5  # random speeds reach so many times those of the linear machine
# A motion that has no symbol has one of these words.
SILENT = "no impacts"
WORDS_WITHOUT_SYMBOL = ("chaotic", "not periodic", SILENT)
# Sweeps hold these observers besides those of the measure.
OBSERVER_NAMES = ("symbol", "impacts", "lyapunov", "final")


class Shown(NamedTuple):
    """Units of the measure and of the band in words, and the factor from the parameter to the latter."""

    unit: str = ""
    unit_across: str = ""
    across: float = 1.0


PLAIN = Shown()


@dataclass(frozen=True, eq=False)
class Answer:
    """A steady motion at a value of the parameter, and what is measured of it.

    Attributes
    ----------
    parameter, value
        The value of the parameter, and the measure.
    motion
        Symbol n-p-q of a periodic motion; "chaotic", "not periodic", "no impacts".
    stability
        Of an orbit, :class:`Stability`; a motion that was simulated is stable, or neutral where a mass that
        nothing holds stands between its stops.
    attracting
        Whether it attracts starts of positive measure.
    derivative
        Exact derivative of the measure along the branch; NaN of a motion that is on none.
    rms, peak
        Root mean square and largest modulus of the measured row, in its unit; NaN where no row is
        measured, and of orbits that are not looked up by ``response.at``.
    members
        Number of simulated motions that ended there.
    ways
        How these were started: "up", "down", "starts".
    orbit
        The orbit, or motion without impacts; None of a motion that is on no branch.
    state
        A state on a simulated motion, None for others.
    shown
        :class:`Shown`: units in which it is printed.
    """

    parameter: float
    value: AnyFloat
    motion: str
    stability: Stability = Stability.STABLE
    attracting: bool = True
    derivative: AnyFloat = math.nan
    rms: AnyAmount = math.nan
    peak: AnyAmount = math.nan
    members: Count = 0
    ways: tuple[str, ...] = ()
    orbit: Motion | None = field(default=None, repr=False)
    state: State | None = field(default=None, repr=False)
    shown: Shown = field(default=PLAIN, repr=False)

    @property
    def stable(self) -> bool:
        """Whether it is stable."""
        return self.stability is Stability.STABLE

    @property
    def admissible(self) -> bool:
        """Whether it is a motion of the machine."""
        return self.stability is not Stability.INADMISSIBLE

    @property
    def silent(self) -> bool:
        """Whether it has no impacts."""
        return self.motion == SILENT or is_silent(self.motion)

    @property
    def parameter_shown(self) -> float:
        """The value of the parameter in the unit of the band."""
        return self.parameter * self.shown.across

    @property
    def periodic(self) -> bool:
        """Whether it is a periodic motion with impacts, or an orbit without."""
        return self.orbit is not None or self.motion not in WORDS_WITHOUT_SYMBOL

    def __repr__(self) -> str:
        family = getattr(self.orbit, "family_dimension", 0)
        kind = in_words(self.stability, family)
        value = with_unit(self.value, unit=self.shown.unit)
        place = with_unit(self.parameter_shown, unit=self.shown.unit_across)
        motion = self.motion if self.motion in WORDS_WITHOUT_SYMBOL else (
            f"{self.motion}, {'without' if self.silent else 'with'} impacts"
        )  # fmt: skip
        return f"Answer({value} at {place}: {motion}, {kind})"


@dataclass(frozen=True)
class Simulation:
    """Simulation that finds the answers at each value of a parameter.

    Attributes
    ----------
    system, parameter, measure
        What is measured of which machine.
    start
        Start of the motion that is followed up and down.
    starts
        Random, or listed, starts of the others; None for none.
    settle_periods, periods
        Forcing periods before, and while, members are observed.
    options
        Of the sweeps: workers, progress.
    """

    system: System
    parameter: str
    measure: Measure
    start: State
    starts: Many | None
    settle_periods: Amount
    periods: Positive
    options: dict[str, Any] = field(default_factory=dict)

    def answers(self, values: Floats) -> list[list[Answer]]:
        """Answers at each value, those with most members first."""
        over = {self.parameter: values}
        given: dict[str, Any] = {
            "over": over, "observe": self._observers(), "settle_periods": self.settle_periods,
            "periods": self.periods, "progress": False,
        }  # fmt: skip
        ways = bifurcation_sweep(
            self.system,
            start=self.start,
            way="both",
            points=1,
            at=AtPhase(),
            **given | self.options,
        )
        parts = [(str(way), ways.sel(direction=way)) for way in ways["direction"].values]
        if self.starts is not None:
            found = sweep(self.system, start=self.starts, **given | self.options)
            apart = {
                str(dim): found.sizes[dim] for dim in found["end"].dims if dim != self.parameter
            }
            places = np.ndindex(*apart.values())
            parts += [("starts", found.isel(dict(zip(apart, k, strict=True)))) for k in places]
        rows = zip(*(_rows(way, part, self) for way, part in parts), strict=True)
        return [
            self._joined(value, list(at)) for value, at in zip(values.tolist(), rows, strict=True)
        ]

    def _observers(self) -> list[str | Observer]:
        measured = [one for measure in self.measures for one in measure.observers]
        n = mechanism_of(self.system).degrees
        units = np.eye(n)[:COMPARED_COORDINATES].tolist()
        ranges = [Extremes(row=tuple(row), label=f"range{i}") for i, row in enumerate(units)]
        return [*OBSERVER_NAMES, *ranges, *measured]

    @property
    def measures(self) -> tuple[Measure, ...]:
        """The measure, and of a row its rms and peak."""
        others = (of_same_row(self.measure, kind) for kind in (Rms, Peak))
        return self.measure, *(measure_of(self.system, one) for one in others if one)

    def _joined(self, value: float, rows: list[_Row]) -> list[Answer]:
        """Answers of the members at one value."""
        rows = [row for row in rows if row.motion]
        largest = np.max([row.ranges for row in rows], axis=0) if rows else np.zeros(0)
        largest[largest == 0.0] = 1.0
        groups: list[list[_Row]] = []
        for row in sorted(rows, key=lambda r: tuple(-r.ranges)):
            near = (
                SAME_PERIODIC_OF_RANGE
                if row.motion not in WORDS_WITHOUT_SYMBOL
                else SAME_IRREGULAR_OF_RANGE
            )
            for group in groups:
                apart = np.abs(group[0].ranges - row.ranges) / largest
                if group[0].motion == row.motion and apart.max() <= near:
                    group.append(row)
                    break
            else:
                groups.append([row])
        groups.sort(key=len, reverse=True)
        return [self._answer(value, group) for group in groups]

    def _answer(self, value: float, group: list[_Row]) -> Answer:
        first = group[0]
        measured, rms, peak = (*self._numbers(value, first), math.nan, math.nan)[:3]
        ways = tuple(dict.fromkeys(row.way for row in group))
        stability, attracting = Stability.STABLE, True
        if first.motion == SILENT:
            free = free_motion(with_parameter(self.system, self.parameter, value))
            if not isinstance(free, str) and free.stability is Stability.NEUTRAL:
                stability, attracting = free.stability, free.attracting
        return Answer(
            value, measured, first.motion, stability, attracting, rms=rms, peak=peak, members=len(group), ways=ways,
            state=first.state,
        )  # fmt: skip

    def _numbers(self, value: float, row: _Row) -> list[float]:
        """The measures of a motion: over its own period where the window is not a multiple of that."""
        if row.motion in WORDS_WITHOUT_SYMBOL:
            return row.numbers
        cycles = int(row.motion.partition("-")[0])
        if self.periods % cycles == 0.0:
            return row.numbers
        system = with_parameter(self.system, self.parameter, value)
        span = cycles * 2.0 * math.pi / mechanism_of(system).omega
        run = simulate(system, row.state, t_max=span, impacts=2**40)
        return [measure.of_run(run, span) for measure in self.measures]


class _Row(NamedTuple):
    """A member: how it was started, its motion, "" where it has none, ranges, numbers, state."""

    way: str
    motion: str
    ranges: Floats
    numbers: list[float]
    state: State


def _rows(way: str, members: xr.Dataset, simulation: Simulation) -> Iterator[_Row]:
    """Members of one start, one after the other over all values."""
    codes = motions(members)
    words = words_of_codes(codes)
    count = sum(str(name).startswith("range") for name in members) // 2
    ends = (
        [members[f"range{i}_{end}"].values for i in range(count)] for end in ("smallest", "largest")
    )
    low, high = (np.stack(end, axis=-1) for end in ends)
    columns = [measure.of_sweep(members).values for measure in simulation.measures]
    kinds = ("position", "velocity", "phase")
    states = zip(*(members[f"final_{kind}"].values for kind in kinds), strict=True)
    for k, (code, ranges, state) in enumerate(zip(codes.values, high - low, states, strict=True)):
        known = code > BELOW - 1 and np.isfinite(ranges).all()
        motion = words[int(code)].replace("_", " ") if known else ""
        place, speed, phase = state
        start = State(tuple(place), tuple(speed), float(phase)) if motion else State((), ())
        yield _Row(way, motion, ranges, [float(c[k]) for c in columns], start)


def is_silent(symbol: str) -> bool:
    """Whether the symbol of an orbit counts no impacts."""
    return re.fullmatch(r"\d+-0-0(,0-0)*", symbol.partition(" ")[0]) is not None


# ---- starts --------------------------------------------------------------------------------------


def rest_of(system: System) -> State:
    """A state away from all stops, the machine's own if it names one."""
    own = getattr(system, "free_start", None)
    if own is not None:
        return own()  # type: ignore[no-any-return]
    m = mechanism_of(system)
    place = np.zeros(m.degrees)
    limits = [(np.array(c.row), c.lower, c.upper) for c in m.rigid_stops]
    if not all(low <= row @ place <= high for row, low, high in limits):
        place = _inside(limits, m.degrees)
    return State(tuple(place.tolist()), (0.0,) * m.degrees)


def _inside(limits: list[tuple[Floats, float, float]], n: int) -> Floats:
    """A place within all contacts, by a linear programme; zero where there is none."""
    from scipy.optimize import linprog

    rows = [(side * row, side * limit) for row, low, high in limits
            for side, limit in ((1.0, high), (-1.0, low)) if math.isfinite(limit)]  # fmt: skip
    across = np.array([np.append(row, 1.0) for row, _ in rows])
    size = max(abs(limit) for _, limit in rows) or 1.0
    most, right = [(None, None)] * n + [(None, 1.0)], [limit / size for _, limit in rows]
    found = linprog(np.append(np.zeros(n), -1.0), across, right, bounds=most)
    return np.asarray(found.x[:n]) * size if found.success else np.zeros(n)


def random_starts(
    system: System, values: Sequence[System], count: int, seed: int, start: State
) -> RandomStarts:
    """Starts with random speeds and phases, of the size of the linear machine's over the band."""
    m = mechanism_of(system)
    reach = max(stop_sizes(m), default=0.0)  # the largest distance of a stop
    speeds = []
    for one in values:
        motion = free_motion(one, opened=True)
        omega = mechanism_of(one).omega
        size = reach
        if not isinstance(motion, str):
            state = motion.flights().states[0]
            size += float(
                np.abs(state[: m.degrees]).max() + np.abs(state[m.degrees : -1]).max() / omega
            )
        speeds.append(omega * size)
    speed = SPEED_FACTOR * float(np.median(speeds)) or 1.0
    ranges = {f"v{i + 1}": (-speed, speed) for i in with_mass(m)}
    return RandomStarts(count, seed, ranges | {"phase": (0.0, 2.0 * math.pi)}, start)


def explained(answer: Answer, by: Answer) -> Answer:
    """An answer of a branch with the members of a simulated one."""
    ways = tuple(dict.fromkeys((*by.ways, *answer.ways)))
    return replace(by, members=by.members + answer.members, ways=ways, state=answer.state)
