"""Windows of a motion: points on a section, and the impacts between the first and the last.

What the points are decides how far a motion is settled, too: by so many impacts, forcing periods or
changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from vibroimpact._core.progress import Announcement
from vibroimpact.attractors.point_sets import FEWEST_POINTS
from vibroimpact.simulation.lyapunov import LyapunovEstimate, exponent_from
from vibroimpact.simulation.places import At, AtChange, AtPhase, AtStop
from vibroimpact.simulation.sections import (
    EVENTS_PER_POINT,
    Section,
    section_of_impacts,
    strobe_times,
    take_changes,
    take_strobes,
)
from vibroimpact.simulation.simulate import RunEnd
from vibroimpact.simulation.simulator import Impacts, Simulator, joined

EXPONENT_IMPACTS = 50_000  # error some 1 / 200 of the spread of the growth per impact
EVENTS_PER_IMPACT = 4  # events that count as an impact where there is none


@dataclass(frozen=True)
class Window:
    """Points on a section and the impacts from before the first to the last of them.

    ``end``: RunEnd.POINTS where the record is whole, though perhaps with few points, as ``found``
    says. ``length``: the impacts, periods or changes that it took.
    """

    part: Impacts
    section: Section
    end: RunEnd
    length: int
    found: str = ""


@dataclass
class Sampler:
    """A motion, from its start on, with the place where its points are taken.

    ``index``, ``now``: forcing periods that have passed, and the time after them.
    """

    motion: Simulator
    at: At
    index: int = 0
    now: float = 0.0

    def settle(self, count: int) -> None:
        """Advance by so many impacts, at all stops, or forcing periods, or changes."""
        if not count:
            return
        match self.at:
            case AtStop():
                self.motion.settle(count)
            case AtPhase():
                self.index += count
                self.now = float(strobe_times(self.motion, self.at, self.index, 1)[0])
                self.motion.advance_to(self.now)
            case AtChange():
                take_changes(self.motion, self.at, 1, count - 1)

    def take(self, points: int) -> Window:
        """Record so many points, or as many as come."""
        match self.at:
            case AtStop():
                return self._impacts(self.at, points)
            case AtPhase():
                return self._strobes(self.at, points)
            case AtChange():
                return self._changes(self.at, points)

    def exponent(self) -> LyapunovEstimate:
        """Estimate the exponent from here; the motion stays."""
        per_impact = 1 if isinstance(self.at, AtStop) else EVENTS_PER_IMPACT
        return exponent_from(self.motion, EXPONENT_IMPACTS // per_impact)

    def _impacts(self, at: AtStop, points: int) -> Window:
        """Record impacts, each time twice as many, until enough of them are at the stop."""
        motion, count = self.motion, 2 * points
        begin = motion.at, motion.last
        motion.announce(at, points, EVENTS_PER_POINT * points)
        part = motion.record(count)
        while (
            part.at(at.contact, at.stop).size < points
            and part.end is RunEnd.IMPACTS
            and count < EVENTS_PER_POINT * points
        ):
            count *= 2
            motion.at, motion.last = begin
            part = motion.record(count)
        section = section_of_impacts(motion, at, [part], points, part.end)
        enough = part.end is RunEnd.EVENTS and len(section) >= FEWEST_POINTS
        end = RunEnd.POINTS if part.end is RunEnd.IMPACTS or enough else part.end
        here = f"{len(section)} of {len(part.high)} impacts are at stop {at.stop} of contact "
        found = f"{here}{at.contact}: take another stop or contact."
        return Window(part, section, end, len(part.high), found)

    def _strobes(self, at: AtPhase, points: int) -> Window:
        parts, announcement = list[Any](), Announcement("points", points)
        section = take_strobes(self.motion, at, points, self.index, self.now, parts, announcement)
        self.index += points
        self.now = float(strobe_times(self.motion, at, self.index - 1, 1)[0])
        part = joined([self.motion.impacts_of(part) for part in parts])
        return Window(part, section, section.end, points)

    def _changes(self, at: AtChange, points: int) -> Window:
        section, parts = take_changes(self.motion, at, points)
        part = joined([self.motion.impacts_of(part) for part in parts])
        found = f"element {at.element} changes its state {len(section)} times: take another one."
        end = RunEnd.POINTS if section.end is RunEnd.EVENTS else section.end
        return Window(part, section, end, len(section), found)
