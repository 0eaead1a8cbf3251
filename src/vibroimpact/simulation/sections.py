"""Sections: states of a motion after each impact at one stop, or once per forcing period.

The impact section of the impact damper is Sigma = {x2 - x1 = half_clearance, just after the
impact}, (9) of the paper; here it is any stop of any contact of any mechanism. The stroboscopic
section, at one phase of the force, describes motions without impacts as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.checks import check_count, check_memory, check_stop_name, real, refusal
from vibroimpact._core.deferred import deferred
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import Announcement
from vibroimpact._core.types import Codes, Floats
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop, StopName
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.model.translations import Translations, translations_of
from vibroimpact.simulation.simulate import RunEnd, phase_after, record_bytes
from vibroimpact.simulation.simulator import Impacts, Simulator

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


# Beyond this many impacts per requested section point, on average, the stop counts as not reached:
# chatter on one stop gives some 50 impacts per visit before it is summed.
IMPACTS_PER_POINT = 64
LEAST_POSITION = 2.0**-20  # of a velocity times a time


@dataclass(frozen=True)
class SectionPoints:
    """States of a motion on a section, read-only: common part of all sections."""

    system: System
    position: Floats
    velocity: Floats
    phase: Floats
    time: Floats
    end: RunEnd
    last: State = field(repr=False)

    def __len__(self) -> int:
        return int(self.phase.size)

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
        """Velocity of the second coordinate after the impact."""
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

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the section; see :func:`vibroimpact.plotting.sections.plot_section`."""
        axes: Axes = deferred("plotting.sections", "plot_section")(self, ax=ax)
        return axes

    def _dataset(self, along: str, **attrs: Any) -> xr.Dataset:
        import xarray as xr

        both = (along, "coordinate")
        return xr.Dataset(
            {
                "position": (both, self.position),
                "velocity": (both, self.velocity),
                "phase": (along, self.phase),
                "time": (along, self.time),
            },
            attrs={
                "system": repr(self.system),
                **attrs,
                "end": self.end.name,
                "end_reason": self.end.sentence,
                "version": _kernel.version(),
            },
        )


@dataclass(frozen=True, repr=False)
class Section(SectionPoints):
    """Post-impact states at one stop, read-only; one entry per impact there.

    Attributes
    ----------
    position, velocity
        Coordinates and velocities just after the impact, shape (n_point, n).
    phase
        Phase of the first forcing line in [0, 2 pi).
    time
        Time since the start of the motion, settling included.
    end
        Why the motion ended; ``RunEnd.IMPACTS`` if every requested point is there.
    last
        State of the last point, from which the motion can be continued.
    contact, stop
        Contact and stop of the impacts.
    status
        :class:`~vibroimpact.Status` of each: impact, simultaneous, chatter or engage.
    """

    contact: int
    stop: StopName
    status: Codes

    def __repr__(self) -> str:
        return (
            f"Section: {len(self)} impacts at stop {self.stop} of contact {self.contact}; "
            f"{self.end.sentence}"
        )

    def to_dataset(self) -> xr.Dataset:
        """Return the section as an xarray dataset; attributes describe system, stop and end."""
        dataset = self._dataset("impact", contact=self.contact, stop=self.stop)
        return dataset.assign(status=("impact", self.status))


@dataclass(frozen=True, repr=False)
class StroboscopicSection(SectionPoints):
    """States at one phase of the force, read-only; one entry per forcing period.

    Attributes
    ----------
    position, velocity
        Coordinates and velocities, shape (n_point, n); after an event at that time.
    phase
        Phase of the first forcing line, the requested one at every point.
    time
        Time since the start of the motion, settling included.
    end
        Why the motion ended; ``RunEnd.HORIZON`` if every requested point is there.
    last
        State of the last point, from which the motion can be continued.
    """

    def __repr__(self) -> str:
        at = f" at phase {self.phase[0]:.6g} of the force" if len(self) else ""
        return f"StroboscopicSection: {len(self)} states{at}; {self.end.sentence}"

    def to_dataset(self) -> xr.Dataset:
        """Return the section as an xarray dataset."""
        return self._dataset("period")


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
    least = LEAST_POSITION * v * float(np.median(between)) if between.size else 0.0
    return Scale(max(x, least) or 1.0, v or 1.0, translations)


def _largest(values: Floats) -> float:
    """Largest absolute value, NaN left out; 0 of none."""
    return float(np.nanmax(np.abs(values), initial=0.0))


def coordinates(position: Floats, velocity: Floats, phase: Floats) -> Floats:
    """States as points in which phase 0 and phase 2 pi are the same."""
    return np.column_stack([position, velocity, np.cos(phase), np.sin(phase)])


def impact_section(
    system: System,
    state: State,
    *,
    points: int = 2000,
    settle: int = 1000,
    stop: StopName = "A",
    contact: int = 0,
) -> Section:
    """Record the states just after the impacts at one stop.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one.
    state
        Initial state.
    points
        Impacts at the stop to record, >= 1.
    settle
        Impacts (at all stops) to discard first, >= 0.
    stop
        "A", the upper stop, or "B", the lower.
    contact
        Number of the contact, or of a soft stop, which counts where it is met.

    Returns
    -------
    Section
        Fewer points than requested, with the reason in ``end``, if the motion stops impacting, and
        ``RunEnd.EVENTS`` if fewer than one impact in 64 is at this stop.

    Raises
    ------
    InvalidParameterError
        A stop or contact that the system does not have, counts out of range, a bad start.

    Notes
    -----
    Completed chatter is one point: the state at rest on the stop. 0.3 microseconds per impact of
    the damper settled, 0.6 recorded.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> section = impact_section(damper, vi.State((0.0, 0.0), (0.0, 1.0)), points=10)
    >>> float(round(section.x1[-1], 6))
    0.124126
    """
    check_count("points", points, 1)
    check_count("settle", settle, 0)
    check_stop(system, contact, stop)
    check_points("points", points, system)
    motion = Simulator(system, state)
    end = motion.settle(settle)
    if end is not RunEnd.IMPACTS:
        return section_of(motion, [], contact, stop, points, end)
    return take(motion, points, contact, stop)


def stroboscopic_section(
    system: System, state: State, *, points: int = 2000, settle: int = 1000, phase: float = 0.0
) -> StroboscopicSection:
    """Record the states whenever the phase of the force has one value.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one; it must be forced.
    state
        Initial state.
    points
        States to record, one per period of the first forcing line, >= 1.
    settle
        Forcing periods to discard first, >= 0.
    phase
        Phase of the first forcing line, radians.

    Returns
    -------
    StroboscopicSection
        Fewer points than requested, with the reason in ``end``, if a run cannot continue. Where an
        event falls on such a time, the state after it.

    Raises
    ------
    InvalidParameterError
        No forcing, counts out of range, more points than memory holds, a phase that is not a number,
        a bad start.

    Notes
    -----
    A motion without impacts has a section as well: one point where it is periodic with the force.
    The states are those of ``simulate(...).at(time)``, to rounding.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> section = vi.stroboscopic_section(damper, vi.State((0.0, 0.0), (0.0, 1.0)), points=10)
    >>> float(round(section.x1[-1], 6))
    -0.215956
    """
    check_count("points", points, 1)
    check_count("settle", settle, 0)
    phase = real("phase", phase)
    mechanism = mechanism_of(system)
    size = 8 * (4 * mechanism.degrees + 8)
    check_memory("points", points, size, "Take fewer, then continue from the last state.")
    if not mechanism.forces:
        stops = any(one.is_stop for one in mechanism.elements)
        raise InvalidParameterError(
            "system: has no forcing, so that no phase repeats. Take "
            + ("vi.impact_section, or " if stops else "")
            + "vi.state_section, where an element changes its state."
        )
    motion = Simulator(system, state)
    times = strobe_times(mechanism, state.phase, phase, settle, points)
    rows, end = motion.states_at(
        times, announcement=Announcement("settle + points", settle + points)
    )
    return strobe_of(motion, rows, times, phase, end)


def strobe_times(m: Mechanism, start: float, phase: float, first: int, points: int) -> Floats:
    """Times at which the force has a phase, from a number on; ``start``: phase at time 0."""
    turned = (phase - start) % (2.0 * math.pi)
    times: Floats = turned / m.omega + 2.0 * math.pi / m.omega * np.arange(
        first, first + points, dtype=np.float64
    )
    return times


def strobe_of(
    motion: Simulator, rows: Floats, times: Floats, phase: float, end: RunEnd
) -> StroboscopicSection:
    """The section from the states of a motion at these times, or the first of them."""
    mechanism, begun = motion.compiled.mechanism, motion.start.phase
    times, n = times[: len(rows)], mechanism.degrees
    phases = np.full(len(rows), phase % (2.0 * math.pi))
    last = motion.last
    if len(rows):
        onward = phase_after(mechanism, float(phases[-1]), begun, float(times[-1]))
        last = State(tuple(rows[-1, :n]), tuple(rows[-1, n:]), onward)
    for array in (rows, times, phases):
        array.flags.writeable = False
    return StroboscopicSection(
        system=motion.system, position=rows[:, :n], velocity=rows[:, n:], phase=phases,
        time=times, end=end, last=last,
    )  # fmt: skip


def take(motion: Simulator, points: int, contact: int, stop: StopName) -> Section:
    """Take the next points of a motion at one stop."""
    parts: list[Impacts] = []
    found, spent, end = 0, 0, RunEnd.IMPACTS
    while found < points and end is RunEnd.IMPACTS:
        wanted = 1 + 2 * (points - found)
        parts.append(motion.record(wanted, points))
        found += parts[-1].at(contact, stop).size
        spent, end = spent + wanted, parts[-1].end
        if spent > IMPACTS_PER_POINT * points and found < points:
            end = RunEnd.EVENTS
    return section_of(
        motion, parts, contact, stop, points, RunEnd.IMPACTS if found >= points else end
    )


def section_of(
    motion: Simulator, parts: list[Impacts], contact: int, stop: StopName, points: int, end: RunEnd
) -> Section:
    """Select the impacts at one stop among recorded ones, at most so many."""
    n = motion.compiled.mechanism.degrees
    chosen = [part.at(contact, stop) for part in parts]

    def picked(empty: Any, pick: Any) -> Any:
        pieces = [pick(part)[i] for part, i in zip(parts, chosen, strict=True)]
        return joined(empty, pieces, points)

    nothing = np.empty(0)
    position = picked(np.empty((0, n)), lambda part: part.position)
    velocity = picked(np.empty((0, n)), lambda part: part.velocity)
    phase = picked(nothing, lambda part: part.phase)
    return Section(
        system=motion.system,
        contact=contact,
        stop=stop,
        position=position,
        velocity=velocity,
        phase=phase,
        time=picked(nothing, lambda part: part.time),
        status=picked(np.empty(0, dtype=np.int32), lambda part: part.status),
        end=end,
        last=last_of(motion, position, velocity, phase),
    )


def joined(empty: Any, pieces: Iterable[Any], most: int | None = None) -> Any:
    """Pieces of an array of points as one, read-only, at most so many."""
    array = np.concatenate([empty, *pieces])[:most]
    array.flags.writeable = False
    return array


def last_of(motion: Simulator, position: Floats, velocity: Floats, phase: Floats) -> State:
    """State of the last point; that of the motion where there is none."""
    if not len(phase):
        return motion.last
    return State(tuple(position[-1]), tuple(velocity[-1]), float(phase[-1]))


def check_stop(system: System, contact: Any, stop: StopName) -> None:
    """Refuse a stop that the system does not have: those of contacts, and soft ones."""
    contacts = mechanism_of(system).elements
    if not contacts:
        raise InvalidParameterError(
            "system: has no stop, so no section at impacts. Take vi.stroboscopic_section."
        )
    check_number("contact", contact, len(contacts))
    check_stop_name(stop)
    if not contacts[contact].is_stop:
        stops = [str(i) for i, one in enumerate(contacts) if one.is_stop]
        kind = contacts[contact].kind.replace("_", " ")
        ways = [*stops, f"vi.state_section(..., element={contact}), where it changes its state"]
        if mechanism_of(system).forces:
            ways.append("vi.stroboscopic_section")
        raise InvalidParameterError(
            f"contact = {contact}: is {kind}, which has no stop. Take {', or '.join(ways)}."
        )
    if math.isinf(Stop.at(stop, contact).limit(contacts)):
        raise InvalidParameterError(
            f"stop = {stop!r}: contact {contact} has no such stop; use the other one."
        )


def check_number(name: str, value: Any, count: int, advice: str = "") -> None:
    """Refuse a number that none of so many contacts, or contacts and elements, has."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not 0 <= value < count:
        raise refusal(name, value, " to ".join(dict.fromkeys(("0", str(count - 1)))), advice)


def check_points(name: str, points: int, system: System) -> None:
    """Refuse more section points than memory holds; half of the impacts recorded may be points."""
    size = 2 * record_bytes(mechanism_of(system))
    check_memory(name, points, size, "Take fewer, then continue from the last state.")
