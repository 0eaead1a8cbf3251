"""Simulation: every impact of a motion, proved to be the first, and the motion between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact import _kernel
from vibroimpact._core.checks import (
    check_count,
    check_kind,
    check_memory,
    memory_here,
    names_arguments,
    numbers,
    real_or_infinite,
    refusal,
)
from vibroimpact._core.codes import NamedCode
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import FIRST_PROBE, PROBED, Announcement, expected, interruptible
from vibroimpact._core.reason import Reason
from vibroimpact._core.types import Angles, Codes, Floats, Indices, Rising, Sides
from vibroimpact.compile.hybrid import Compiled, compile_mechanism
from vibroimpact.compile.modes import closed_from_code
from vibroimpact.compile.piecewise import states_from_code
from vibroimpact.machines.units import units_of
from vibroimpact.model.elements.rigid_stop import RigidStopState
from vibroimpact.model.mechanism import (
    ImpactLaw,
    Mechanism,
    element_labels,
)
from vibroimpact.model.phases import phases_at
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.results.result import Result, along, plotting, sized
from vibroimpact.simulation.reach import reach_in_words

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation

Phase = TypeVar("Phase", float, Floats)  # one, or an array of them

# After so many forcing periods without an event it is asked whether one is to come.
LONG_PERIODS = 10_000
LONG_STEPS = 100_000  # without forcing it is asked after so many steps of the march
EVENTS_PER_IMPACT = 64  # a machine with elements has so many events per impact at most


class Status(NamedCode):
    """Kinds of events of a run.

    ENGAGE, CHANGE and NON_UNIQUE are those of soft stops and friction: ``run.contact`` has the number
    of the element, and ``run.states`` the state that it takes.
    """

    IMPACT = 0  #: one contact closed and opened again
    GRAZING = 1  #: a gap touched zero within rounding; no impulse
    CHATTER = 2  #: infinitely many impacts summed; the contact is at rest afterwards
    STICK = 3  #: a contact begins to press
    RELEASE = 4  #: its force has fallen to zero; opening by an impact elsewhere is no event
    SIMULTANEOUS = 5  #: an impact that moves several touching contacts, by the system's impact_law
    HORIZON = 6  #: no event up to the given time
    UNDECIDED = 7  #: the search for the next event could not be finished
    DIVERGED = 8  #: the state became so large that nothing can be decided
    STEPS = 9  #: the search for the next event took more steps than are allowed
    ENGAGE = 13  #: a soft stop is met; counts as an impact
    CHANGE = 14  #: an element takes another state: friction sticks or slips, a soft stop lets go
    NON_UNIQUE = 15  #: the same, where other states could have lasted, too


COUNTED = (Status.IMPACT, Status.SIMULTANEOUS, Status.CHATTER, Status.ENGAGE)  # as impacts


class RunEnd(Reason):
    """Reason for the end of a run."""

    IMPACTS = 0, "the requested number of impacts was reached"
    HORIZON = 1, "t_max was reached"
    SILENT = 2, "no contact, and no change of an element, will come any more: this is proved"
    UNDECIDED = 3, "the next event could not be decided at double precision"
    STALLED = 4, "time does not advance: more than 4096 events at one instant"
    MISSING = (
        5,
        "a set of closed contacts, and of friction that sticks, could not be compiled: they "
        "depend on each other, or the forcing meets an undamped resonance of it",
    )
    EVENTS = 6, "the record is full: mostly events that are no impacts, or all of the memory"
    OBSERVER = 7, "the tangent vector vanished: a motion at rest does not depend on its start"
    INTERRUPTED = 8, "it was interrupted"
    DIVERGED = (
        9,
        "the motion diverged: beyond 2^256 of the machine's size, or a clearance lost in rounding",
    )
    STEPS = 10, "one flight took more than 2^22 steps of the search"
    POINTS = 11, "the requested number of points was reached"
    QUIET = (
        12,
        "no contact in a long flight, and neither that one will come nor that none will could be "
        "proved: the motion may have stopped impacting; t_max takes it further",
    )
    SLIDING = 13, "a hybrid system slides on a guard, and its modes do not say how"


# A motion that ends so goes on: the record was full, perhaps of events of friction without an impact.
GOES_ON = (RunEnd.IMPACTS, RunEnd.EVENTS)
ENDS_QUIETLY = (RunEnd.SILENT, RunEnd.QUIET)  # a motion ends so only without t_max


@dataclass(frozen=True, eq=False)
class Run(Result):
    """A simulated motion: arrays with one entry per event, read-only.

    Attributes
    ----------
    time
        Time of each event since the start, kept to far below its last digit, shape (n_event,).
    status
        :class:`Status` of each event.
    contact, side
        Number of the contact or element of the event (-1: none), and the side of its stop: 1 is A
        (upper), -1 B (lower), 0 none. Contacts, the rigid stops, count first; soft stops and friction follow.
        For friction ``side`` tells the limit met: of the slip speed, or of the force while it sticks. Of a
        soft stop it is the one that is met, lets go or recovers.
    position, velocity_before, velocity_after
        Shape (n_event, n).
    phase
        Phase of the first forcing line in [0, 2 pi).
    rate_before, rate_after
        Rate of the gap, relative to a stop that moves: -rate_before is the impact speed.
    limit_side
        Side of the limit that ended the flight: 1 upper, -1 lower, 0 none; of a gap, a slip speed or a force.
    end
        :class:`RunEnd`, why the run ended.
    start, system
        Initial state and system of the motion.
    """

    system: System
    start: State
    time: Rising = field(metadata=along("event", quantity="time"))
    status: Codes = field(metadata=along("event", codes=Status))
    contact: Indices = field(metadata=along("event"))
    side: Sides = field(metadata=along("event"))
    position: Floats = field(metadata=along("event", "coordinate", quantity="length"))
    velocity_before: Floats = field(metadata=along("event", "coordinate", quantity="velocity"))
    velocity_after: Floats = field(metadata=along("event", "coordinate", quantity="velocity"))
    phase: Angles = field(metadata=along("event", units="rad"))
    rate_before: Floats = field(metadata=along("event", quantity="velocity"))
    rate_after: Floats = field(metadata=along("event", quantity="velocity"))
    end: RunEnd
    limit_side: Sides = field(metadata=along("event"), repr=False)
    _compiled: Compiled = field(repr=False)
    _y: Floats = field(metadata=sized("flight", "unknown"), repr=False)
    _mode: Codes = field(metadata=sized("flight"), repr=False)
    _low: Floats = field(metadata=sized("event"), repr=False)

    def __len__(self) -> int:
        return int(self.time.size)

    def __repr__(self) -> str:
        kinds, counts = np.unique(self.status, return_counts=True)
        listed = ", ".join(
            f"{n} {Status(k).name}"
            for k, n in zip(kinds, counts, strict=True)
            if k != Status.HORIZON
        )
        span = self.time[-1] if len(self) else 0.0
        end = units_of(self.system).text(span, quantity="time")
        text = f"Run: {listed or 'no events'} up to t = {end}; {self.end.sentence}"
        if self.end in ENDS_QUIETLY and (reach := reach_in_words(self)):
            text += f"; {reach}"
        m = self._compiled.mechanism
        if not m.switching:
            return text
        last = zip(element_labels(m), m.elements, self.all_states[-1], strict=True)
        return f"{text}; at the end {', '.join(f'{a} {e.State(s).name}' for a, e, s in last)}"

    @property
    def impact_law(self) -> ImpactLaw:
        """Law of impacts that move several touching contacts, as of the :class:`Mechanism`."""
        return self._compiled.mechanism.impact_law

    @property
    def impacts(self) -> NDArray[np.bool_]:
        """Mask of the events that are impacts (completed chatter counts as one)."""
        return np.isin(self.status, COUNTED)

    @property
    def last(self) -> State:
        """State after the last event, from which the motion can be continued."""
        if not len(self):
            return self.start
        mechanism, time = mechanism_of(self.system), float(self.time[-1])
        phase = phase_after(mechanism, float(self.phase[-1]), self.start.phase, time)
        return State(tuple(self.position[-1]), tuple(self.velocity_after[-1]), phase)

    @property
    def codes(self) -> list[int]:
        """Code of the mode (compile/piecewise.py) after each event."""
        return self.all_codes[1:]

    @property
    def all_codes(self) -> list[int]:
        """Code of the mode at the start and after each event."""
        return [self._compiled.codes[mode] for mode in self._mode]

    @property
    def states(self) -> Codes:
        """State of every contact and element after each event, shape (n_event, n_element).

        Columns are numbered as in ``contact``: rigid stops (:class:`RigidStopState`) first, then
        soft stops (:class:`SoftStopState`) and friction (:class:`FrictionState`).
        """
        return self.all_states[1:]

    @property
    def all_states(self) -> Codes:
        """State of every contact and element at the start and after each event.

        The shape is (n_event + 1, n_element), with the columns of ``states``.
        """
        states = states_of_modes(self._compiled, self._mode)
        states.flags.writeable = False
        return states

    def forces(self, t: ArrayLike) -> Floats:
        """Force of every contact and element at any times of the run, exact to rounding.

        A force f acts on the coordinates as f row: it is negative at an upper stop, positive at a
        lower one, and friction opposes the slip. A soft stop has its contact force, friction its
        force while it slips and while it sticks, a rigid stop the force at rest. Impulses of
        impacts are not included. At the time of an event the force is that after it.

        Parameters
        ----------
        t
            Times in [0, time of the last event], as for :meth:`at`.

        Returns
        -------
        ndarray
            Shape ``t.shape + (n_element,)``, columns as in ``states``, in the unit of force of the
            system: mass times length over time squared.

        Raises
        ------
        InvalidParameterError
            A time outside the run.
        """
        times, flights = flights_at(t, self.time, self._low, self._y, self._mode)
        m = self._compiled.mechanism
        flat = np.ravel(times)
        index, dt = flights.since(flat)
        both = flights.at(flat, self._compiled.kernel)
        rows = self._compiled.piecewise
        y = np.ones((flat.size, rows.size + 1))
        n = m.degrees
        y[:, 0 : 2 * n : 2] = both[:, :n]
        y[:, 1 : 2 * n : 2] = both[:, n:] / rows.scale
        y[:, 2 * n : -1] = self._compiled.waves(flights.y[index], dt)
        mode = flights.mode[index]
        found = np.empty((flat.size, len(m.elements)))
        for one in np.unique(mode):
            matrix = np.array(rows.force_rows(self._compiled.codes[one]))
            found[mode == one] = y[mode == one] @ matrix.T
        return found.reshape((*times.shape, found.shape[1]))

    def at(self, t: ArrayLike) -> tuple[Floats, Floats]:
        """Positions and velocities at any times of the run, exact to rounding.

        Parameters
        ----------
        t
            Times in [0, time of the last event], and ``t_max`` where the run has reached it; at
            the time of an event the state after it.

        Returns
        -------
        position, velocity
            Shape ``t.shape + (n,)``.

        Raises
        ------
        InvalidParameterError
            A time outside the run.
        """
        times, flights = flights_at(t, self.time, self._low, self._y, self._mode)
        both = flights.at(np.ravel(times), self._compiled.kernel)
        n = self.position.shape[1]
        shape = (*times.shape, n)
        return both[:, :n].reshape(shape), both[:, n:].reshape(shape)

    def animate(
        self,
        t0: float = 0.0,
        t1: float | None = None,
        *,
        seconds: float = 6.0,
        frames_per_second: int = 20,
    ) -> FuncAnimation:
        """Let the run move: bodies and stops above, the time history below; impacts flash.

        Parameters
        ----------
        t0, t1
            Window of time within the run; to its last event if ``t1`` is not given.
        seconds
            Length of the animation, > 0.
        frames_per_second
            Frames in a second of it, 1 to 100.

        Returns
        -------
        matplotlib.animation.FuncAnimation
            ``save("run.gif")`` writes it, in MP4 where FFmpeg is installed; ``to_jshtml()`` is a page of it.

        Raises
        ------
        InvalidParameterError
            A window outside the run, more than 5000 frames.

        Notes
        -----
        Every frame is evaluated from the flights, exact to rounding. A frame takes some 50 ms to draw. Stops
        of one coordinate and of the difference of two are drawn; soft ones, too, at the place where they begin.
        """
        animation: FuncAnimation = plotting("animation").animate_run(
            self, t0, t1, seconds=seconds, frames_per_second=frames_per_second
        )
        return animation

    def to_dataset(self) -> xr.Dataset:
        """Convert the record to an xarray dataset, with the states of all contacts and elements."""
        m = self._compiled.mechanism
        kinds = dict.fromkeys(e.State for e in m.elements)
        data = super().to_dataset().assign(state=(("event", "element"), self.states))
        return data.assign_coords(element=element_labels(m)).assign_attrs(
            impact_law=self.impact_law,
            state_meaning="; ".join(
                f"{kind.__name__}: {', '.join(f'{s.value} {s.name}' for s in kind)}"
                for kind in kinds
            ),
        )


def states_of_modes(compiled: Compiled, modes: Codes) -> Codes:
    """State of every contact and element in each mode, shape (len(modes), n_element)."""
    m = compiled.mechanism
    contacts, elements = len(m.rigid_stops), len(m.switching)
    used, index = np.unique(modes, return_inverse=True)
    table = np.zeros((len(used), contacts + elements), dtype=np.int32)
    for row, mode in zip(table, used, strict=True):
        code = compiled.codes[mode]
        for number, stop in closed_from_code(code, contacts):
            row[number] = RigidStopState.UPPER if stop > 0 else RigidStopState.LOWER
        row[contacts:] = states_from_code(code, contacts, elements)
    states: Codes = table[index]
    return states


def first_phases(phases: Floats) -> Floats:
    """Phases of the first forcing line from those of all, (k, L); 0 without forcing."""
    return phases[:, 0] if phases.shape[1] else np.zeros(len(phases))


def phases_of(mechanism: Mechanism, phase: float) -> list[float]:
    """Phases of all forcing lines when the first has this one."""
    ratios = np.array([force.omega / mechanism.omega for force in mechanism.forces])
    return cast(list[float], phases_at(phase, ratios).tolist())


class Flights(NamedTuple):
    """Consecutive flights: times and states at which they begin."""

    begin: Floats  # (k,)
    low: Floats  # rounding errors of these times
    y: Floats  # (k, m)
    mode: Codes

    def since(self, times: Floats) -> tuple[NDArray[np.intp], Floats]:
        """Flight of each time, and the time since it began."""
        index = np.searchsorted(self.begin, times, side="right") - 1
        return index, np.maximum((times - self.begin[index]) - self.low[index], 0.0)

    def at(self, times: Floats, kernel: _kernel.System) -> Floats:
        """Positions and velocities at times since the first begins, shape (len(times), 2 n)."""
        index, dt = self.since(times)
        y = np.ascontiguousarray(self.y[index])
        return np.asarray(kernel.evaluate(list(map(int, self.mode[index])), y, dt))


def flights_at(
    t: ArrayLike, time: Floats, low: Floats, y: Floats, mode: Codes
) -> tuple[Floats, Flights]:
    """Times within a run as an array, and its flights, whose first begins before the first event."""
    times = numbers("t", t, "times")
    span = float(time[-1]) if len(time) else 0.0
    outside = times[~((times >= 0.0) & (times <= latest(span)))]
    if outside.size:
        others = f" and {outside.size - 1} others" if outside.size > 1 else ""
        raise InvalidParameterError(
            f"t = {outside.flat[0]}{others}: must be in [0, {span}], the span of the run."
        )
    begin, lost = (np.concatenate([[0.0], part]) for part in (time, low))
    return times, Flights(begin, lost, y, mode)


def rounded_times(high: Floats, low: Floats) -> tuple[Floats, Floats]:
    """Times of a clock in two parts, rounded, and their rounding errors."""
    total = high + low
    return total, low - (total - high)


def latest(span: float) -> float:
    """Latest time that a run covers: durations that add up to t_max are rounded."""
    return span + 4.0 * math.ulp(span)


def phase_after(mechanism: Mechanism, phase: Phase, start: float, time: Phase) -> Phase:
    """Phase of later states: in [0, 2 pi), unless 2 pi is not a period of all lines."""
    lines = mechanism.forces
    if any((line.omega / lines[0].omega) % 1.0 for line in lines):
        return start + lines[0].omega * time
    return phase


def begin(compiled: Compiled, start: State) -> Any:
    """Position of a state in the kernel; a state behind a stop is refused."""
    m = compiled.mechanism
    check_kind("start", start, State, "a State")
    if len(start.position) != m.degrees:
        raise InvalidParameterError(
            f"position has shape ({len(start.position)},); expected ({m.degrees},)."
        )
    report = _begun(compiled, start)
    for stop, gap in _behind(m, report):
        raise InvalidParameterError(
            f"position = {start.position}: lies {-gap:.6g} behind the {'upper' if stop.upper else 'lower'} stop "
            f"{stop.limit(m.rigid_stops):.6g} of contact {stop.contact}; gaps must be >= 0. Move the state into the "
            "clearance, or put it on the stop (its method on_stop)."
        )
    return settled(compiled, report["at"])


def _begun(compiled: Compiled, start: State) -> dict[str, Any]:
    """What the kernel says of a state: its place in the kernel and the gaps of all contacts."""
    phases = phases_of(compiled.mechanism, start.phase)
    report: dict[str, Any] = compiled.kernel.start(
        list(start.position), list(start.velocity), phases
    )
    return report


def _behind(m: Mechanism, report: dict[str, Any]) -> list[tuple[Stop, float]]:
    """The stops that a state lies behind, by more than rounding, and their gaps."""
    return [
        (Stop(i, side), float(gaps[i]))
        for i in range(len(m.rigid_stops))
        for side, gaps in ((-1, report["gap_lower"]), (1, report["gap_upper"]))
        if gaps[i] < -report["eps"][i]
    ]


def before_stops(system: System, state: State) -> State:
    """State put on the stops that it lies behind, by the least change of its position.

    It stays as it is where none is behind, and behind stops that leave no place between them.
    """
    m = mechanism_of(system)
    compiled, at, on = compile_mechanism(m), state, set[Stop]()
    while behind := {stop for stop, _ in _behind(m, _begun(compiled, at))} - on:
        on |= behind
        gaps = _begun(compiled, state)
        rows = [stop.side * np.array(m.rigid_stops[stop.contact].row) for stop in sorted(on)]
        gap = [
            gaps["gap_upper" if stop.upper else "gap_lower"][stop.contact] for stop in sorted(on)
        ]
        step = np.linalg.lstsq(np.array(rows), np.array(gap), rcond=None)[0]
        at = replace(state, position=tuple(np.add(state.position, step).tolist()))
    return at


def settled(compiled: Compiled, at: Any) -> Any:
    """Position whose elements have the states that they take there."""
    while (code := compiled.kernel.settle(at)) > 0:
        if not compiled.add_code(code):
            break  # the run says so
    return at


def flight_limit_of(compiled: Compiled) -> float:
    """Flight after which, without t_max, it is asked whether an event is to come."""
    omega = compiled.mechanism.omega
    return LONG_PERIODS * 2.0 * math.pi / omega if omega else LONG_STEPS * compiled.step


def check_counts(impacts: Any, t_max: float) -> None:
    """Refuse an impossible length of run."""
    check_count("impacts", impacts, 1)
    if real_or_infinite("t_max", t_max, "a number > 0") <= 0.0:
        raise refusal("t_max", t_max, "> 0")


def events_for(mechanism: Mechanism, impacts: int) -> int:
    """Largest number of events of a run of so many impacts.

    Between two impacts there are some releases and grazes, but friction may stick and slip many times.
    """
    stops = any(e.is_stop for e in mechanism.elements)
    each = EVENTS_PER_IMPACT if mechanism.switching and stops else 4
    return each * impacts + 64


def record_bytes(m: Mechanism) -> int:
    """Memory for the record of an event: five vectors of n, kept twice while they are joined."""
    return 2 * 8 * (6 * m.degrees + len(m.forces) + 8)


@names_arguments()
@interruptible
def simulate(system: System, start: State, *, impacts: int = 1000, t_max: float = math.inf) -> Run:
    """Simulate until a number of impacts or a time is reached.

    Parameters
    ----------
    system
        A :class:`Mechanism`, or anything with a ``mechanism``, such as :class:`ImpactDamper`.
    start
        Initial state: inside the clearance, or on a stop with any departing speed down to zero;
        on a stop and approaching it, it impacts at t = 0. Soft stops and friction take the states
        that last there: a mass beyond a soft stop begins pressed.
    impacts
        Stop after so many impacts (completed chatter counts as one, meeting a soft stop as one).
    t_max
        Stop at this time. Without it a run in which no impact is to come ends as ``RunEnd.SILENT`` where
        that is proved, as ``RunEnd.QUIET`` where it is not; with it neither occurs.

    Returns
    -------
    Run
        Every event with its :class:`Status`. Chatter, sticking, grazing, silence and undecided
        searches are data: see ``run.status`` and ``run.end``. ``run.states`` and ``run.forces``
        tell about the elements.

    Raises
    ------
    InvalidParameterError
        A state behind a stop, wrong shapes; without ``t_max``, more impacts than memory holds.

    Notes
    -----
    Each flight's first contact is proved, not sampled (theory.md, "First contact"). About one
    microsecond per impact of the damper, most of it for the record; 2 to 20 for larger mechanisms. Before a
    run of more than a minute a warning says how long it will take.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> run = vi.simulate(damper, vi.State((0.0, 0.0), (0.0, 1.0)), impacts=10)
    >>> len(run)
    10
    """
    check_counts(impacts, t_max)
    mechanism = mechanism_of(system)
    size = record_bytes(mechanism)
    if t_max == math.inf:
        check_memory("impacts", impacts, size, "Give t_max, or take vi.section.")
    compiled = compile_mechanism(mechanism, start, t_max)
    at = begin(compiled, start)
    first, first_mode = np.array(at.y), at.mode
    parts, why = [], RunEnd.MISSING
    remaining = int(impacts)
    room = memory_here() // size
    events = room if t_max < math.inf else min(events_for(mechanism, remaining), room)
    while why is RunEnd.MISSING:
        part, at = _record(compiled, at, remaining, t_max, events)
        parts.append(part)
        why = RunEnd(part["why"])
        if why is RunEnd.MISSING:
            if not compiled.add_code(part["code"]):
                break
            remaining -= int(np.isin(part["status"], COUNTED).sum())
    return assembled(system, start, compiled, first, first_mode, parts, why)


def _record(
    compiled: Compiled, at: Any, impacts: int, t_max: float, events: int
) -> tuple[Any, Any]:
    """The events from a position on, and the position after them; before a long run a warning says how long."""
    limit = flight_limit_of(compiled)

    def begun(count: int) -> tuple[Any, Any]:
        there = at.copy()
        return compiled.kernel.simulate(there, t_max, limit, count, impacts), there

    def shares(part: Any) -> tuple[float, float]:
        """Shares of the impacts and of t_max; without t_max, of impacts or room for events, whichever is full first."""
        if part["why"] != RunEnd.EVENTS:
            return 1.0, 1.0
        counted = np.count_nonzero(np.isin(part["status"], COUNTED)) / impacts
        if t_max == math.inf:
            return max(counted, len(part["status"]) / events), 0.0
        return counted, float(part["high"][-1]) / t_max

    if events < PROBED:
        return compiled.kernel.simulate(at, t_max, limit, events, impacts), at
    part, there = begun(FIRST_PROBE)
    if part["why"] != RunEnd.EVENTS:
        return part, there
    by_impacts, by_time = shares(part)
    seconds = expected(events, lambda count: max(shares(begun(count)[0])))
    Announcement(*(("t_max", t_max) if by_time > by_impacts else ("impacts", impacts))).say(seconds)
    return begun(events)


def assembled(
    system: System,
    state: State,
    compiled: Compiled,
    first: Floats,
    first_mode: int,
    parts: list[Any],
    why: RunEnd,
) -> Run:
    """The run whose record comes in parts, in order, on one clock."""

    def joined(name: str) -> Any:
        arrays = [part[name] for part in parts]
        array = arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
        array.flags.writeable = False
        return array

    n = compiled.mechanism.degrees
    after, side = joined("after"), joined("side")
    status, contact = joined("status"), joined("contact")
    mode = np.concatenate([[first_mode], joined("mode")]).astype(np.int32)
    time, low = rounded_times(joined("high"), joined("low"))
    return Run(
        system=system,
        start=state,
        time=time,
        status=status,
        contact=contact,
        side=sides_of(compiled, status, contact, side, mode),
        position=after[:, :n],
        velocity_before=joined("before")[:, n:],
        velocity_after=after[:, n:],
        phase=first_phases(joined("phase")),
        rate_before=joined("rate_before"),
        rate_after=joined("rate_after"),
        end=why,
        limit_side=side,
        _compiled=compiled,
        _y=np.concatenate([first[None, :], joined("y")]),
        _mode=mode,
        _low=low,
    )


def sides_of(compiled: Compiled, status: Codes, contact: Codes, side: Codes, mode: Codes) -> Codes:
    """The side of each event: of the limit met, or of the soft stop that changes its state.

    ``mode``: that at the start, then those after the events.
    """
    sides = np.array(side)
    for number, e in enumerate(compiled.mechanism.elements):
        if e.rigid or not e.is_stop:
            continue
        changed = (status == Status.CHANGE) | (status == Status.NON_UNIQUE)
        if (here := np.flatnonzero(changed & (contact == number))).size:
            states = states_of_modes(compiled, mode)[:, number]
            known = np.array([e.side_of(one) for one in e.State], dtype=np.int32)
            was, now = known[states[here]], known[states[here + 1]]
            sides[here] = np.where(now, now, was)
    return sides
