"""Sections: states of a motion after impacts, once per forcing period, or where an element changes.

The impact section of the impact damper is Sigma = {x2 - x1 = half_clearance, just after the
impact}, (9) of the paper; here it is any stop of any contact of any mechanism. The section at one
phase of the force describes motions without impacts as well, that at changes of state those without
forcing: friction that sticks or slips, a soft stop that lets go.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.checks import check_count, check_memory, names_arguments
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import Announcement, interruptible
from vibroimpact._core.types import Angles, Codes, Floats, Rising
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.model.translations import Translations, translations_of
from vibroimpact.results.result import Result, along
from vibroimpact.simulation.places import At, AtChange, AtPhase, AtStop, place_in
from vibroimpact.simulation.reach import reach_in_words
from vibroimpact.simulation.simulate import (
    ENDS_QUIETLY,
    GOES_ON,
    RunEnd,
    Status,
    first_phases,
    phase_after,
    record_bytes,
    rounded_times,
    simulate,
    states_of_modes,
)
from vibroimpact.simulation.simulator import CHUNK_EVENTS, Impacts, Simulator, joined

# Beyond this many events per requested section point, on average, the place counts as not reached:
# chatter on one stop gives some 50 impacts per visit before it is summed.
EVENTS_PER_POINT = 64
# A position is so large at least, relative to a velocity times a time.
LEAST_POSITION_OF_PATH = 2.0**-20


@dataclass(frozen=True, eq=False, repr=False)
class Section(Result):
    """Points of a motion on a section, read-only.

    Attributes
    ----------
    system, at
        System of the motion, and where the points are: :class:`~vibroimpact.AtStop`,
        :class:`~vibroimpact.AtPhase` or :class:`~vibroimpact.AtChange`.
    position, velocity
        Coordinates and velocities, after an event at that time, shape (n_point, n).
    phase
        Phase of the first forcing line in [0, 2 pi); 0 without forcing.
    time
        Time since the start of the motion, settling included.
    end
        Why the motion ended; ``RunEnd.POINTS`` if every requested point is there.
    last
        State of the last point, from which the motion can be continued.
    status
        :class:`~vibroimpact.Status` of each impact at a stop: impact, simultaneous, chatter or
        engage; else None.
    state
        State that the element of ``AtChange`` takes at each point; else None.
    """

    system: System
    at: At
    position: Floats = field(metadata=along("point", "coordinate", quantity="length"))
    velocity: Floats = field(metadata=along("point", "coordinate", quantity="velocity"))
    phase: Angles = field(metadata=along("point", units="rad"))
    time: Rising = field(metadata=along("point", quantity="time"))
    end: RunEnd
    last: State = field(repr=False)
    status: Codes | None = field(default=None, metadata=along("point", codes=Status))
    state: Codes | None = field(default=None, metadata=along("point"))

    def __len__(self) -> int:
        return int(self.phase.size)

    def __repr__(self) -> str:
        where = self.at.words(mechanism_of(self.system))
        rare = f"fewer than one event in {EVENTS_PER_POINT} is such a point"
        end = rare if self.end is RunEnd.EVENTS else self.end.sentence
        return f"Section: {len(self)} points {where}; {end}{self.reach and '; ' + self.reach}"

    @property
    def reach(self) -> str:
        """How far a motion that stopped impacting stays from the stops, in words; else empty."""
        if self.end not in ENDS_QUIETLY:
            return ""
        return reach_in_words(simulate(self.system, self.last, impacts=1))

    @property
    def x1(self) -> Floats:
        """First coordinate."""
        return self.position[:, 0]

    @property
    def x2(self) -> Floats:
        """Second coordinate."""
        return self.position[:, 1]

    @property
    def v1(self) -> Floats:
        """Velocity of the first coordinate at each point, after the event that makes it."""
        return self.velocity[:, 0]

    @property
    def v2(self) -> Floats:
        """Velocity of the second coordinate after the event."""
        return self.velocity[:, 1]

    @property
    def relative(self) -> Floats:
        """Positions less the drift, shape (n_point, n): relative to a body that nothing holds.

        What a displacement of the whole machine would not change, as of a pile or a capsule: the
        last such body has 0. The positions themselves where every body is held or meets a stop.
        """
        return translations_of(mechanism_of(self.system)).removed(self.position)

    def coordinates(self) -> Floats:
        """Positions, velocities and the point (cos phase, sin phase), shape (n_point, 2 n + 2)."""
        return coordinates(self.position, self.velocity, self.phase)

    def to_dataset(self) -> xr.Dataset:
        """Convert the section to an xarray dataset; attributes describe system, place and end."""
        return super().to_dataset().assign_attrs(at=self.at.words(mechanism_of(self.system)))


@dataclass(frozen=True)
class Scale:
    """Largest position and velocity of a motion at its impacts: the units of section points.

    Positions are taken less the drift, where nothing holds the machine (model/translations.py).
    """

    position: float
    velocity: float
    translations: Translations

    def points(self, position: Floats, velocity: Floats, phase: Floats) -> Floats:
        """Points z of states, shape (..., 2 n + 2), from (..., n), (..., n) and (...)."""
        n = position.shape[-1]
        flat = coordinates(
            self.translations.removed(position.reshape(-1, n)) / self.position,
            velocity.reshape(-1, n) / self.velocity,
            phase.ravel(),
        )
        return flat.reshape(*phase.shape, 2 * n + 2)


def scale_of(
    position: Floats, velocity: Floats, before: Floats, time: Floats, system: System
) -> Scale:
    """The units of section points, shapes (..., k, n), (..., k, n) and (..., k); NaN is missing.

    Velocities after plastic impacts are rounding errors, so those ``before`` impacts, of any
    shape, count as well. Where the stop is at zero, positions on it are rounding errors: those far
    smaller than a velocity times the time between two points do not count.
    """
    translations = translations_of(mechanism_of(system))
    x, after, v = map(_largest, (translations.removed(position), velocity, before))
    v = max(v, after)
    between = np.diff(time)
    between = between[np.isfinite(between)]
    least = LEAST_POSITION_OF_PATH * v * float(np.median(between)) if between.size else 0.0
    return Scale(max(x, least) or 1.0, v or 1.0, translations)


def _largest(values: Floats) -> float:
    """Largest absolute value, NaN left out; 0 of none."""
    return float(np.nanmax(np.abs(values), initial=0.0))


def coordinates(position: Floats, velocity: Floats, phase: Floats) -> Floats:
    """States as points in which phase 0 and phase 2 pi are the same."""
    return np.column_stack([position, velocity, np.cos(phase), np.sin(phase)])


@names_arguments()
@interruptible
def section(
    system: System,
    start: State,
    *,
    at: At | None = None,
    points: int = 2000,
    settle_events: int = 1000,
) -> Section:
    """Record the states of a motion on a section.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one.
    start
        Initial state of the motion.
    at
        Where the points are: ``AtStop("B", contact=1)``, after the impacts at one stop;
        ``AtPhase(0.5)``, once per forcing period; ``AtChange(0, "stick")``, where an element changes
        its state. If left out, at the first stop; where contact or element 0 has none, at phase 0 of
        the force; without forcing at its changes.
    points
        Points to record, >= 1.
    settle_events
        Impacts (at all stops), forcing periods or changes to discard first, >= 0.

    Returns
    -------
    Section
        Fewer points than requested, with the reason in ``end``, if the motion cannot continue or
        comes there no more, and ``RunEnd.EVENTS`` if fewer than one event in 64 is such a point.

    Raises
    ------
    InvalidParameterError
        A stop, an element or a state that the system does not have, a phase without forcing, counts
        out of range, more points than memory holds, a bad start.

    Notes
    -----
    A motion without impacts has a section at a phase as well: one point where it is periodic with
    the force. Those states are ``simulate(...).at(time)``, to rounding. A section at changes needs
    neither stops nor forcing: that of a self-excited machine. The cost is 0.3 microseconds per impact
    of the damper settled, 0.6 recorded; some microseconds per event of other machines.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> start = vi.State((0.0, 0.0), (0.0, 1.0))
    >>> float(round(vi.section(damper, start, points=10).x1[-1], 6))
    0.124126
    >>> float(round(vi.section(damper, start, at=vi.AtPhase(), points=10).x1[-1], 6))
    -0.215956

    A block on a belt begins to slip where its spring pulls with the static level.

    >>> block = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
    ...                      elements=(vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.05),))
    >>> leaves = vi.AtChange(0, "backward")
    >>> vi.section(block, vi.State((0.0,), (0.0,)), at=leaves, points=3).x1.round(9).tolist()
    [0.2, 0.2, 0.2]
    """
    check_count("points", points, 1)
    check_count("settle_events", settle_events, 0)
    at = place_in(system, at)
    check_points(system, at, points)
    motion = Simulator(system, start)
    match at:
        case AtStop():
            end = motion.settle(settle_events)
            whole = end is RunEnd.IMPACTS
            return take_impacts(motion, at, points) if whole else _empty(motion, at, end)
        case AtPhase():
            announcement = Announcement("settle_events + points", settle_events + points)
            return take_strobes(motion, at, points, settle_events, announcement=announcement)
        case AtChange():
            return take_changes(motion, at, points, settle_events)[0]


def check_points(system: System, at: At, points: int) -> None:
    """Refuse more points than memory holds; half of the events recorded may be points."""
    mechanism = mechanism_of(system)
    strobe = 8 * (4 * mechanism.degrees + 8)
    size = strobe if isinstance(at, AtPhase) else 2 * record_bytes(mechanism)
    check_memory("points", points, size, "Take fewer, then continue from the last state.")


def take_impacts(motion: Simulator, at: AtStop, points: int) -> Section:
    """Take the next points of a motion at one stop."""
    parts: list[Impacts] = []
    found, spent, end = 0, 0, RunEnd.IMPACTS
    motion.announce(at, points, EVENTS_PER_POINT * points)
    while found < points and end is RunEnd.IMPACTS:
        wanted = 1 + 2 * (points - found)
        parts.append(motion.record(wanted))
        found += parts[-1].at(at.contact, at.stop).size
        spent, end = spent + wanted, parts[-1].end
        if spent > EVENTS_PER_POINT * points and found < points:
            end = RunEnd.EVENTS
    return section_of_impacts(motion, at, parts, points, end)


def section_of_impacts(
    motion: Simulator, at: AtStop, parts: list[Impacts], points: int, end: RunEnd
) -> Section:
    """Select the impacts at one stop among recorded ones, at most so many; ``end`` if there are fewer."""
    part = joined(parts)
    chosen = part.at(at.contact, at.stop)[:points]
    return _section(
        motion, at, np.hstack([part.position[chosen], part.velocity[chosen]]), part.phase[chosen],
        part.time[chosen], RunEnd.POINTS if len(chosen) >= points else end,
        status=part.status[chosen],
    )  # fmt: skip


def strobe_times(motion: Simulator, at: AtPhase, first: int, points: int) -> Floats:
    """Times at which the force has a phase, from a number on."""
    omega = motion.compiled.mechanism.omega
    turned = (at.phase - motion.start.phase) % (2.0 * math.pi)
    times: Floats = turned / omega + 2.0 * math.pi / omega * np.arange(
        first, first + points, dtype=np.float64
    )
    return times


def take_strobes(
    motion: Simulator, at: AtPhase, points: int, first: int, since: float = 0.0,
    keep: list[Any] | None = None, announcement: Announcement | None = None,
) -> Section:  # fmt: skip
    """Take the points of a motion at one phase from a number on; others as of ``Simulator.states_at``."""
    times = strobe_times(motion, at, first, points)
    rows, end = motion.states_at(times, since, keep, announcement)
    phases = np.full(len(rows), at.phase % (2.0 * math.pi))
    found = _section(
        motion,
        at,
        rows,
        phases,
        times[: len(rows)],
        RunEnd.POINTS if end is RunEnd.HORIZON else end,
    )
    if not len(rows):
        return found
    # of several forcing lines the first may have turned further than by its phase
    mechanism, last, time = motion.compiled.mechanism, found.last, float(times[len(rows) - 1])
    onward = phase_after(mechanism, last.phase, motion.start.phase, time)
    return replace(found, last=State(last.position, last.velocity, onward))


def take_changes(
    motion: Simulator, at: AtChange, points: int, discard: int = 0
) -> tuple[Section, list[Any]]:
    """Take the next changes of an element, after some; also the records that hold the points."""
    parts: list[Any] = []
    rows: list[tuple[Any, NDArray[np.intp], Codes]] = []
    found, spent, end = -discard, 0, RunEnd.EVENTS
    before, announcement = motion.at.mode, Announcement("settle_events + points", discard + points)
    while found < points and end in GOES_ON:
        announcement.after(found + discard)
        begin, missing = motion.at, points - found
        part = motion.next_events(CHUNK_EVENTS)
        chosen, states = _changes_in(motion, part, before, at)
        if len(chosen) >= missing:  # again, up to the last of them
            motion.at = begin
            part = motion.next_events(int(chosen[missing - 1]) + 1)
            chosen, states = _changes_in(motion, part, before, at)
        spent, end = spent + len(part["status"]), RunEnd(part["why"])
        before = motion.at.mode
        skipped = min(max(-found, 0), len(chosen))
        found += len(chosen)
        if found >= 0:
            parts.append(part)
            rows.append((part, chosen[skipped:], states[skipped:]))
        if spent > EVENTS_PER_POINT * (points + discard) + CHUNK_EVENTS and found < points:
            break

    def picked(empty: Any, pick: Any) -> Any:
        return np.concatenate([empty, *(pick(part)[chosen] for part, chosen, _ in rows)])

    nothing = np.empty(0)
    after = picked(np.empty((0, 2 * motion.compiled.mechanism.degrees)), lambda part: part["after"])
    taken = _section(
        motion, at, after, picked(nothing, lambda part: first_phases(part["phase"])),
        picked(nothing, lambda part: rounded_times(part["high"], part["low"])[0]),
        RunEnd.POINTS if found >= points else RunEnd.EVENTS if end in GOES_ON else end,
        state=np.concatenate([np.empty(0, dtype=np.int32), *(states for *_, states in rows)]),
    )  # fmt: skip
    return taken, parts


def _changes_in(
    motion: Simulator, part: Any, before: int, at: AtChange
) -> tuple[NDArray[np.intp], Codes]:
    """Events after which an element is in a new state, and that state.

    ``before``: the mode before the first event.
    """
    modes = np.concatenate([[before], part["mode"]]).astype(np.int32)
    states = states_of_modes(motion.compiled, modes)[:, at.element]
    changed = states[1:] != states[:-1]
    if at.takes is not None:
        changed &= states[1:] == at.takes
    chosen = np.flatnonzero(changed)
    return chosen, states[1:][chosen]


def _section(
    motion: Simulator, at: At, rows: Floats, phase: Floats, time: Floats, end: RunEnd,
    **codes: Codes,
) -> Section:  # fmt: skip
    """The section from its states, shape (n_point, 2 n); the last one is that of the motion if there is none."""
    arrays: tuple[Floats | Codes, ...] = (rows, phase, time, *codes.values())
    for array in arrays:
        array.flags.writeable = False
    n, last = motion.compiled.mechanism.degrees, motion.last
    if len(rows):
        last = State(tuple(rows[-1, :n]), tuple(rows[-1, n:]), float(phase[-1]))
    return Section(motion.system, at, rows[:, :n], rows[:, n:], phase, time, end, last, **codes)


def _empty(motion: Simulator, at: AtStop, end: RunEnd) -> Section:
    """The section of a motion that ends before its first point."""
    n, nothing = motion.compiled.mechanism.degrees, np.empty(0)
    rows, status = np.empty((0, 2 * n)), np.empty(0, dtype=np.int32)
    return _section(motion, at, rows, nothing, nothing, end, status=status)
