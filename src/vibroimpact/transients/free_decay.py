"""Free decay after a shock, with impacts and without: how soon the vibration is small.

Method      With the harmonic forces left out the motion is simulated (simulate.py), and beside it the
            machine without its stops and elements, x(t) by exponential matrices (flights.py). A
            row u of it has fallen when |u - rest| stays below a part of the largest |u - rest| of the
            machine without impacts; extrema and instants are located by instants.py.
Assumes     stops that stand still: others go on to excite the machine
Accuracy    rounding
Fails       a machine that does not exist without its friction, a row that grows without stops, or
            that no spring holds: nothing to compare with; the largest |u - rest| is then that of
            the motion itself
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vibroimpact._core.checks import (
    check_count,
    check_kind,
    names_arguments,
    positive,
    real,
    refusal,
    share,
    shown,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import interruptible
from vibroimpact._core.types import Codes, Floats, Positive, Share
from vibroimpact.machines.units import ORDERS, units_of
from vibroimpact.measures.energy import Energies, energies_of
from vibroimpact.measures.flights import Flights, Signal, Struck, rows_of
from vibroimpact.measures.instants import Extrema, check_span, extrema, largest_modulus, last_beyond
from vibroimpact.measures.linear import ZERO_RELATIVE
from vibroimpact.measures.measure import Peak, Row
from vibroimpact.measures.motions import flights_of_run
from vibroimpact.model.mechanism import Mechanism, element_labels
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.stability import NEUTRAL_DISTANCE
from vibroimpact.results.result import Result
from vibroimpact.simulation.simulate import Run, RunEnd, simulate
from vibroimpact.transients.driven import linear, unforced

NAME = re.compile(r"([xv])([1-9]\d*)")
MANY_IMPACTS = 2**40
# By default it takes until the slowest part of the linear motion is to / SPARE_DECAY.
SPARE_DECAY = 20.0
MOST_RADIANS = 2e5  # it takes so many radians of the fastest rate at most
# A machine that does not decay is simulated over so many of its slowest vibration.
UNDAMPED_CYCLES = 200
MOST_SAMPLES = 10**7
# of the fastest rate: a double zero, as of a free mass, is known to the root of rounding
GROWS = 1e-7


@dataclass(frozen=True, eq=False)
class FreeDecay(Result):
    """Free decay of a machine with impacts, and without.

    Attributes
    ----------
    system
        The machine.
    row
        Row that decays, such as "x1".
    remaining
        Part of :attr:`reference` below which it has to stay.
    rest
        Value of the row at rest.
    run
        The motion with impacts.
    """

    system: System
    row: str
    remaining: Share
    rest: float
    run: Run = field(repr=False)
    _signal: Signal = field(repr=False)
    _without: Signal | None = field(repr=False)
    _cycle: Positive = field(repr=False)

    @property
    def end(self) -> RunEnd:
        """Reason why the simulation ended: HORIZON at ``t_max``."""
        return self.run.end

    @property
    def duration(self) -> float:
        """Time that was simulated."""
        return float(self._signal.flights.durations.sum())

    @cached_property
    def reference(self) -> float:
        """Largest distance of the row from rest: without impacts, if there is such a motion to compare."""
        return largest_modulus(self._without or self._signal)

    @cached_property
    def time(self) -> float:
        """Time after which the row stays below ``remaining * reference``.

        Infinite where it does not do so for one cycle of the slowest vibration at least, before the
        end of the simulation.
        """
        return self._fall(self._signal)

    @cached_property
    def time_without(self) -> float:
        """``time`` of the machine without impacts; NaN where that cannot be compared."""
        return math.nan if self._without is None else self._fall(self._without)

    def _fall(self, signal: Signal) -> float:
        last = last_beyond(signal, self.remaining * self.reference)
        fallen = last <= float(signal.flights.durations.sum()) - self._cycle
        return last if fallen else math.inf

    @property
    def impacts(self) -> int:
        """Number of impacts."""
        return int(self.run.impacts.sum())

    @property
    def last_impact(self) -> float:
        """Time of the last impact; NaN without any."""
        hit = self.run.time[self.run.impacts]
        return float(hit[-1]) if hit.size else math.nan

    @property
    def resting(self) -> tuple[int, ...]:
        """Contacts that rest on a stop at the end."""
        contacts = len(mechanism_of(self.run.system).rigid_stops)
        return tuple(int(i) for i in np.flatnonzero(self.run.all_states[-1, :contacts]))

    @cached_property
    def envelope(self) -> Extrema:
        """Times and values of the local extrema of the row, less its value at rest."""
        return extrema(self._signal)

    @cached_property
    def envelope_without(self) -> Extrema | None:
        """``envelope`` of the machine without impacts."""
        return None if self._without is None else extrema(self._without)

    @cached_property
    def energies(self) -> Energies:
        """Energy at the start and at the end, and what dashpots, contacts and elements have taken."""
        m = mechanism_of(self.run.system)
        return energies_of(self.run, self._signal.flights, m)

    def histories(self, points: int = 4000) -> tuple[Floats, Floats, Floats | None]:
        """Times, the row less its value at rest, and the same of the machine without impacts."""
        check_count("points", points, 2, MOST_SAMPLES)
        span = float(self._signal.flights.durations.sum())
        t = np.linspace(0.0, span, points)
        without = None if self._without is None else self._without.at(t)
        return t, self._signal.at(t), without

    def __repr__(self) -> str:
        percent, units = f"{100.0 * self.remaining:g} %", units_of(self.system)
        size = units.text(self.reference, quantity=ORDERS.get(self.row[:1], ""))
        time, without, last = (
            units.text(t, quantity="time") for t in (self.time, self.time_without, self.last_impact)
        )
        return (
            f"FreeDecay: {self.row} stays below {percent} of {size} after {time}, without impacts after "
            f"{without}; {self.impacts} impacts{f', last at {last}' if self.impacts else ''}"
        )

    def to_dataset(self, points: int = 4000) -> xr.Dataset:
        """Histories, envelopes and energies as an xarray dataset.

        Parameters
        ----------
        points
            Number of samples of the histories.
        """
        t, with_impacts, without = self.histories(points)
        energies, m = self.energies, mechanism_of(self.run.system)
        hit = self.run.impacts
        variables = {
            "row": ("time", with_impacts),
            "extremum_time": ("extremum", self.envelope.time),
            "extremum": ("extremum", self.envelope.value),
            "impact_time": ("impact", self.run.time[hit]),
            "impact_speed": ("impact", -self.run.rate_before[hit]),
            "time_to_fall": self.time,
            "time_to_fall_without": self.time_without,
            "reference": self.reference,
            "energy_start": energies.start,
            "energy_end": energies.end,
            "energy_dashpots": energies.dashpots,
            "energy_taken": ("part", list(energies.parts)),
        }
        if without is not None and self.envelope_without is not None:
            variables |= {
                "row_without": ("time", without),
                "extremum_time_without": ("extremum_without", self.envelope_without.time),
                "extremum_without": ("extremum_without", self.envelope_without.value),
            }
        data = xr.Dataset(
            variables,
            coords={"time": t, "part": element_labels(m)},
            attrs={
                "system": repr(self.system), "start": repr(self.run.start), "of": self.row,
                "remaining": self.remaining, "end": self.end.name, "end_reason": self.end.sentence,
            },
        )  # fmt: skip
        own = ORDERS.get(self.row[:1], "")
        known = dict.fromkeys(
            ("row", "row_without", "extremum", "extremum_without", "reference"), own
        )
        known |= {str(n): "time" for n in data.variables if "time" in str(n)}
        known |= {str(n): "energy" for n in data.variables if str(n).startswith("energy")}
        return units_of(self.system).of_variables(data, known | {"impact_speed": "velocity"})


@names_arguments()
@interruptible
def free_decay(
    system: System,
    start: State | Mapping[str, float],
    *,
    row: Row = "x1",
    remaining: float = 0.1,
    rest: float | None = None,
    t_max: float | None = None,
) -> FreeDecay:
    """Simulate the decay after a shock, and find when a row has fallen to a part and stays there.

    Parameters
    ----------
    system
        A :class:`Mechanism`, or anything with a ``mechanism``. Its harmonic forces and phase switches
        do not act; a constant force does.
    start
        A state; or coordinates and velocities by name, the others zero, ``{"v1": 0.5}``.
    row
        Row that has to decay: "x1", "v1", a sum such as "x2 - x1", or coefficients of coordinates.
    remaining
        Part of the largest value without impacts, in (0, 1).
    rest
        Value of the row at rest, from which it is measured; by default that of equilibrium, with the
        stops that are pressed at the end, friction left out.
    t_max
        Length of the simulation, > 0; by default long enough for the machine without impacts, at most
        2 10^5 radians of its fastest rate.

    Returns
    -------
    FreeDecay
        ``time`` and ``time_without``, envelopes, energies. A motion that chatters, comes to rest on a
        stop or has no impact is a result like others.

    Raises
    ------
    InvalidParameterError
        No such coordinate, a start behind a stop or without any motion of the row.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=1.0, zeta=0.01, restitution=0.6,
    ...                          half_clearance=0.3, omega=1.0)
    >>> decay = vi.free_decay(damper, {"v1": 1.0})
    >>> round(decay.time, 1), round(decay.time_without, 1)
    (71.9, 231.0)
    """
    part = share("remaining", remaining)
    m = unforced(mechanism_of(system))
    state = _state(start, m.degrees)
    measure = Peak(row)
    chosen, order = measure.coefficients(m), measure.derivatives
    plain = _without_impacts(m)
    given = None if rest is None else real("rest", rest)
    wanted, cycle = _long_enough(plain or m, part)
    span = wanted if t_max is None else positive("t_max", t_max)
    check_span("t_max", t_max, rows_of(m), span)
    run = simulate(m, state, impacts=MANY_IMPACTS, t_max=span)
    covered = float(run.time[-1]) if len(run) else 0.0
    if not covered > 0.0:
        raise InvalidParameterError(
            f"start = {shown(start)}: no motion begins there: {run.end.sentence}. Start elsewhere."
        )
    flights = flights_of_run(run, covered)
    level = _at_rest(m, chosen, order, run.all_states[-1]) if given is None else given
    signal = _row_of(flights, chosen, order, level)
    without = None
    if plain is not None and _dies_out(plain, chosen, order):
        its = _at_rest(plain, chosen, order) if given is None else given
        without = _row_of(_flown(plain, state, span), chosen, order, its)
    found = FreeDecay(
        system, measure.text, part, level, run, signal, without, cycle,
    )  # fmt: skip
    if not found.reference > 0.0:
        raise InvalidParameterError(
            f"start = {shown(start)}: must move {measure.text} away from rest. Give a position or a velocity."
        )
    return found


def _state(start: State | Mapping[str, float], n: int) -> State:
    """The start as a state; coordinates and velocities by name."""
    check_kind("start", start, (State, Mapping), 'a State, or values by name such as {"v1": 0.5}')
    if isinstance(start, State):
        return start
    parts = {"x": [0.0] * n, "v": [0.0] * n}
    for name, value in start.items():
        found = NAME.fullmatch(str(name))
        if not found or int(found[2]) > n:
            raise refusal("start", name, f"x1 to x{n} and v1 to v{n}, such as {{'v1': 0.5}}")
        parts[found[1]][int(found[2]) - 1] = real(f"start[{name!r}]", value)
    return State(tuple(parts["x"]), tuple(parts["v"]))


def _without_impacts(m: Mechanism) -> Mechanism | None:
    """The machine without stops and elements; none where these hold a coordinate without mass."""
    try:
        return linear(m)
    except InvalidParameterError:
        return None


def _at_rest(m: Mechanism, row: Floats, order: int, states: Codes | None = None) -> float:
    """Value of a row in equilibrium with stops in these states, without friction, free masses at zero."""
    if order:
        return 0.0
    n = m.degrees
    stiffness, force = np.array(m.stiffness), np.array(m.constant_force)
    closed, limits = [], []
    for part, state in zip(m.elements, [] if states is None else states, strict=False):
        if (spring := part.pressed(state)) is None:
            continue
        limit, k, _ = spring
        if math.isinf(k):
            closed.append(part.row)
            limits.append(limit)
        else:
            stiffness = stiffness + k * np.outer(part.row, part.row)
            force = force + k * limit * np.array(part.row)
    rows = np.array(closed).reshape(-1, n)
    whole = np.block([[stiffness, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    place = np.linalg.lstsq(whole, np.append(force, limits), rcond=None)[0][:n]
    return float(row @ place)


def _dies_out(m: Mechanism, row: Floats, order: int) -> bool:
    """Whether a row of the linear motion is held by springs, and does not grow."""
    rates = np.linalg.eigvals(rows_of(m).flow(0).value[0, :-1, :-1])
    fastest = float(np.abs(rates).max(initial=0.0))
    _, sizes, directions = np.linalg.svd(np.array(m.stiffness))
    loose = directions[sizes <= ZERO_RELATIVE * sizes.max(initial=0.0)]
    held = order > 0 or bool(np.all(np.abs(loose @ row) <= ZERO_RELATIVE * np.abs(row).max()))
    return held and bool(np.all(rates.real <= GROWS * fastest))


def _long_enough(m: Mechanism, remaining: float) -> tuple[float, float]:
    """Time in which the slowest part of the linear motion falls far below a part, and its cycle."""
    rows = rows_of(m)
    rates = np.linalg.eigvals(rows.flow(0).value[0, :-1, :-1])
    fastest = float(np.abs(rates).max(initial=0.0)) or rows.rate
    decaying = -rates.real[rates.real < -NEUTRAL_DISTANCE * fastest]
    turning = np.abs(rates.imag[np.abs(rates.imag) > ZERO_RELATIVE * fastest])
    cycle = 2.0 * math.pi / float(turning.min()) if turning.size else 0.0
    if decaying.size:
        wanted = math.log(SPARE_DECAY / remaining) / float(decaying.min()) + cycle
    else:
        wanted = UNDAMPED_CYCLES * (cycle or 1.0 / fastest)
    return min(wanted, MOST_RADIANS / fastest), cycle


def _flown(m: Mechanism, state: State, span: float) -> Flights:
    """One flight with all stops out of reach."""
    rows = rows_of(m)
    first = np.array([[*state.position, *state.velocity, 0.0]])
    none = Struck(np.array([], dtype=np.int64), [])
    still = np.zeros_like(first), np.zeros(1), np.zeros(1, dtype=np.int64)
    return Flights(rows, first, np.array([span]), (0,), none, *still, periodic=False)


def _row_of(flights: Flights, row: Floats, order: int, level: float) -> Signal:
    """A row less its value at rest, along flights."""
    found = flights.signal(lambda code: flights.rows.moved(code, row, order))
    found.series[0] -= level
    return found
