"""Windows of a motion: points on a section, and the impacts between the first and the last.

A section is at the impacts at one stop, at one phase of the force, or at the changes of state of an
element; what the points are decides how far a motion is settled, too: by so many impacts, forcing
periods or changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

from vibroimpact._core.progress import Announcement
from vibroimpact.attractors.point_sets import FEWEST_POINTS
from vibroimpact.model.stop import StopName
from vibroimpact.simulation.lyapunov import LyapunovEstimate, exponent_from
from vibroimpact.simulation.sections import (
    IMPACTS_PER_POINT,
    section_of,
    strobe_of,
    strobe_times,
)
from vibroimpact.simulation.simulate import RunEnd
from vibroimpact.simulation.simulator import Impacts, Simulator, joined
from vibroimpact.simulation.state_sections import AnySection, take_changes

EXPONENT_IMPACTS = 50_000  # error some 1 / 200 of the spread of the growth per impact
EVENTS_PER_IMPACT = 4  # events that count as an impact where there is none


@dataclass(frozen=True)
class Window:
    """Points on a section and the impacts from before the first to the last of them.

    ``end``: RunEnd.POINTS where the record is whole, though perhaps with few points, as ``found``
    says. ``length``: the impacts, periods or changes that it took.
    """

    part: Impacts
    section: AnySection
    end: RunEnd
    length: int
    found: str = ""


class Sampler(Protocol):
    """A motion with the section on which its points are taken."""

    motion: Simulator

    def settle(self, count: int) -> None:
        """Advance by so many impacts, periods or changes."""

    def take(self, points: int) -> Window:
        """Record the next points."""

    def exponent(self) -> LyapunovEstimate:
        """Estimate the exponent from here; the motion stays."""


@dataclass
class AtStop:
    """Points just after the impacts at one stop."""

    motion: Simulator
    contact: int
    stop: StopName

    def settle(self, count: int) -> None:
        """Advance by so many impacts, at all stops."""
        self.motion.settle(count)

    def take(self, points: int) -> Window:
        """Record so many points, or as many as come."""
        part = self.motion.record(self._impacts_for(points), points)
        whole = part.at(self.contact, self.stop).size >= points
        reason = RunEnd.IMPACTS if whole else part.end
        section = section_of(self.motion, [part], self.contact, self.stop, points, reason)
        enough = part.end is RunEnd.EVENTS and len(section) >= FEWEST_POINTS
        end = RunEnd.POINTS if part.end is RunEnd.IMPACTS or enough else part.end
        here = f"{len(section)} of {len(part.high)} impacts are at stop {self.stop} of contact "
        found = f"{here}{self.contact}: take another stop or contact."
        return Window(part, section, end, len(part.high), found)

    def exponent(self) -> LyapunovEstimate:
        """Estimate the exponent over the next impacts."""
        return exponent_from(self.motion, EXPONENT_IMPACTS)

    def _impacts_for(self, points: int) -> int:
        """Number of impacts at all stops that hold so many section points, from a trial run."""
        motion = self.motion
        at, last = motion.at, motion.last
        count = 2 * points
        while True:
            part = motion.record(count, points)
            motion.at, motion.last = at, last
            enough = part.at(self.contact, self.stop).size >= points
            if enough or part.end is not RunEnd.IMPACTS or count >= IMPACTS_PER_POINT * points:
                return count
            count *= 2


@dataclass
class _AtNoStop:
    """Points that are at no stop."""

    motion: Simulator

    def exponent(self) -> LyapunovEstimate:
        """Estimate the exponent from here: without stops over as many events as elsewhere impacts."""
        return exponent_from(self.motion, EXPONENT_IMPACTS // EVENTS_PER_IMPACT)


@dataclass
class AtPhase(_AtNoStop):
    """Points once per forcing period, with impacts or without; the motion is at its start."""

    phase: float = 0.0
    now: float = field(default=0.0, init=False)
    index: int = field(default=0, init=False)

    def settle(self, count: int) -> None:
        """Advance by so many forcing periods."""
        if count:
            self.index += count
            self.now = float(self._times(1)[0])
            self.motion.advance_to(self.now)

    def take(self, points: int) -> Window:
        """Record so many points."""
        times, parts = self._times(points), list[Any]()
        rows, end = self.motion.states_at(times, self.now, parts, Announcement("points", points))
        self.index, self.now = self.index + points, float(times[-1])
        section = strobe_of(self.motion, rows, times, self.phase, end)
        part = joined([self.motion.impacts_of(part) for part in parts])
        return Window(part, section, RunEnd.POINTS if end is RunEnd.HORIZON else end, points)

    def _times(self, points: int) -> Any:
        mechanism, start = self.motion.compiled.mechanism, self.motion.start
        return strobe_times(mechanism, start.phase, self.phase, self.index, points)


@dataclass
class AtChange(_AtNoStop):
    """Points just after an element has changed its state."""

    element: int

    def settle(self, count: int) -> None:
        """Advance by so many changes."""
        if count:
            take_changes(self.motion, 1, self.element, None, discard=count - 1)

    def take(self, points: int) -> Window:
        """Record so many points, or as many as come."""
        section, parts = take_changes(self.motion, points, self.element, None)
        part = joined([self.motion.impacts_of(part) for part in parts])
        found = f"element {self.element} changes its state {len(section)} times: take another one."
        end = RunEnd.POINTS if section.end is RunEnd.EVENTS else section.end
        return Window(part, section, end, len(section), found)


def sampler_of(motion: Simulator, contact: int, stop: StopName, at_phase: float | None) -> Sampler:
    """The section of a motion: at a phase that is given; at a stop; else where there is one.

    Of an element without a stop, at phase 0 of the force, or without force at its changes.
    """
    if at_phase is not None:
        return AtPhase(motion, at_phase)
    if motion.compiled.mechanism.elements[contact].is_stop:
        return AtStop(motion, contact, stop)
    return without_stops(motion, contact)


def without_stops(motion: Simulator, element: int) -> Sampler:
    """The section of a motion at its start that no stop is needed for.

    Without forcing, at the changes of this element, or of the first friction if it is a stop.
    """
    mechanism = motion.compiled.mechanism
    if mechanism.forces:
        return AtPhase(motion)
    if mechanism.elements[element].is_stop:
        rubs = [i for i, part in enumerate(mechanism.elements) if part.slipping]
        element = (*rubs, element)[0]
    return AtChange(motion, element)
