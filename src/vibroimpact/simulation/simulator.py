"""Stepwise simulation of one motion: discard a transient, then record impacts, repeatedly."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.progress import Announcement, announce_measured, expected
from vibroimpact._core.types import Codes, Floats
from vibroimpact.compile.hybrid import Compiled, compile_mechanism
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop, StopName
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.places import AtStop
from vibroimpact.simulation.simulate import (
    COUNTED,
    GOES_ON,
    Flights,
    Run,
    RunEnd,
    Status,
    assembled,
    begin,
    events_for,
    first_phases,
    flight_limit_of,
    rounded_times,
)

CHUNK_EVENTS = 4096  # a record takes so many events at a time
STATES_AT_ONCE = 2**16  # there are so many states between two checks for an interruption
ENDLESS_EVENTS = 2**40  # a run with so many takes as many as there are


@dataclass(frozen=True)
class Impacts:
    """Every impact of a part of a motion, at all stops; arrays with one entry per impact."""

    system: System
    high: Floats
    low: Floats
    phase: Floats
    position: Floats
    velocity_before: Floats
    velocity: Floats
    status: Codes
    contact: Codes
    side: Codes
    sticks: int
    last: State
    end: RunEnd

    @property
    def time(self) -> Floats:
        """Time since the start of the motion."""
        return self.high + self.low

    def at(self, contact: int, stop: StopName) -> NDArray[np.intp]:
        """Return the indices of the impacts at one stop."""
        wanted = (self.contact == contact) & (self.side == Stop.at(stop).side)
        return np.flatnonzero(wanted)


class Simulator:
    """Motion that is continued from call to call, with or without a record of its impacts."""

    def __init__(self, system: System, state: State) -> None:
        self.system, self.start, self.last = system, state, state
        self.compiled: Compiled = compile_mechanism(mechanism_of(system), state)
        self.at: Any = begin(self.compiled, state)

    @property
    def position(self) -> Floats:
        """Present coordinates, shape (n,)."""
        now = self.compiled.kernel.evaluate([self.at.mode], np.array([self.at.y]), np.zeros(1))
        return np.asarray(now[0, : self.compiled.mechanism.degrees])

    def _call(self, kernel_call: Any) -> Any:
        """Repeat a call from the same position until no closed set of contacts is missing."""
        while True:
            at = self.at.copy()
            result = kernel_call(at)
            why, code = _why(result)
            if why is not RunEnd.MISSING or not self.compiled.add_code(code):
                self.at = at
                return result

    def settle(self, impacts: int) -> RunEnd:
        """Advance by so many impacts without a record; of a long time a warning says how long."""
        if impacts == 0:
            return RunEnd.IMPACTS
        begin = self.at

        def beginning(count: int) -> None:
            self._advance(count)
            self.at = begin

        announce_measured("settle", impacts, beginning)
        return self._advance(impacts)

    def _advance(self, impacts: int) -> RunEnd:
        limit, events = flight_limit_of(self.compiled), events_for(self.compiled.mechanism, impacts)
        kernel = self.compiled.kernel
        result = self._call(lambda at: kernel.advance(at, math.inf, limit, events, impacts))
        return _why(result)[0]

    def events(self, impacts: int) -> Any:
        """Every event of the next impacts, as the kernel records them."""
        limit, events = flight_limit_of(self.compiled), events_for(self.compiled.mechanism, impacts)
        kernel = self.compiled.kernel
        return self._call(lambda at: kernel.simulate(at, math.inf, limit, events, impacts))

    def announce(self, at: AtStop, points: int, most: int) -> None:
        """Warn if so many points at a stop, or at most so many impacts, will take long; the motion stays."""
        begin = self.at, self.last

        def beginning(count: int) -> float:
            taken = self.record(count).at(at.contact, at.stop).size
            self.at, self.last = begin
            return max(taken / points, count / most)

        Announcement("points", points).say(expected(2 * points, beginning))

    def record(self, impacts: int) -> Impacts:
        """Record the next impacts."""
        return self.impacts_of(self.events(impacts))

    def run(self, impacts: int) -> Run:
        """The next impacts with all events between them, on the clock of the whole motion."""
        first = self.at
        part = self.events(impacts)
        return assembled(
            self.system,
            self.start,
            self.compiled,
            np.array(first.y),
            first.mode,
            [part],
            _why(part)[0],
        )

    def next_events(self, events: int) -> Any:
        """The next events, impacts or not, as the kernel records them."""
        kernel, limit = self.compiled.kernel, flight_limit_of(self.compiled)
        return self._call(lambda at: kernel.simulate(at, math.inf, limit, events, events))

    def advance_to(self, time: float) -> RunEnd:
        """Advance to a time since the start without a record."""
        kernel = self.compiled.kernel
        return _why(
            self._call(
                lambda at: kernel.advance(at, time, math.inf, ENDLESS_EVENTS, ENDLESS_EVENTS)
            )
        )[0]

    def impacts_of(self, part: Any) -> Impacts:
        """The impacts among recorded events, whose last state becomes that of the motion."""
        n = self.compiled.mechanism.degrees
        if len(part["status"]):
            row, (phase,) = part["after"][-1], first_phases(part["phase"][-1:])
            self.last = State(tuple(row[:n]), tuple(row[n:]), float(phase))
        keep = np.isin(part["status"], COUNTED)
        return Impacts(
            system=self.system,
            high=part["high"][keep],
            low=part["low"][keep],
            phase=first_phases(part["phase"][keep]),
            position=part["after"][keep, :n],
            velocity_before=part["before"][keep, n:],
            velocity=part["after"][keep, n:],
            status=part["status"][keep].astype(np.int32),
            contact=part["contact"][keep].astype(np.int32),
            side=part["side"][keep].astype(np.int32),
            sticks=int((part["status"] == Status.STICK).sum()),
            last=self.last,
            end=_why(part)[0],
        )

    def states_at(
        self,
        times: Floats,
        since: float = 0.0,
        keep: list[Any] | None = None,
        announcement: Announcement | None = None,
    ) -> tuple[Floats, RunEnd]:
        """Advance from the start, or a time since, to the last of times in order.

        The records of the kernel are added to ``keep``, if it is given. The announcement is of the whole time.

        Returns
        -------
        states
            Position and velocity at each time, after an event at that time, shape (m, 2 n); fewer
            where the motion ends before.
        end
            Reason of the end; HORIZON at the last time.
        """
        kernel, end = self.compiled.kernel, RunEnd.EVENTS
        start = np.full(1, since)
        last = Flights(
            start, np.zeros(1), np.array([self.at.y]), np.array([self.at.mode], np.int32)
        )
        rows = np.empty((len(times), 2 * self.compiled.mechanism.degrees))
        done, until = 0, float(times[-1])

        def passed(now: float) -> None:
            if announcement is not None:
                announcement.after(announcement.count * (now - since) / (until - since or 1.0))

        while end in GOES_ON:
            part = self._call(
                lambda at: kernel.simulate(at, until, math.inf, CHUNK_EVENTS, CHUNK_EVENTS)
            )
            if keep is not None:
                keep.append(part)
            end = _why(part)[0]
            whole = end is RunEnd.HORIZON
            new = slice(len(part["mode"]) - whole)  # the event of the horizon is none
            time, low = rounded_times(part["high"], part["low"])
            flights = Flights(
                np.append(last.begin, time[new]),
                np.append(last.low, low[new]),
                np.concatenate([last.y, part["y"][new]]),
                np.append(last.mode, part["mode"][new]),
            )
            known = len(times) if whole else int(np.searchsorted(times, flights.begin[-1]))
            for first in range(done, known, STATES_AT_ONCE):
                these = slice(first, min(first + STATES_AT_ONCE, known))
                rows[these] = flights.at(times[these], self.compiled.kernel)
                passed(float(times[these][-1]))
            passed(float(flights.begin[-1]))
            last = Flights(flights.begin[-1:], flights.low[-1:], flights.y[-1:], flights.mode[-1:])
            done = known
        return rows[:done], end


def joined(parts: list[Impacts]) -> Impacts:
    """Impacts of consecutive parts of a motion, one at least, as one."""
    arrays: dict[str, Any] = {
        one.name: np.concatenate([getattr(part, one.name) for part in parts])
        for one in fields(Impacts)
        if isinstance(getattr(parts[0], one.name), np.ndarray)
    }
    sticks = sum(part.sticks for part in parts)
    return replace(parts[-1], sticks=sticks, **arrays)


def _why(result: Any) -> tuple[RunEnd, int]:
    if isinstance(result, dict):
        return RunEnd(result["why"]), int(result["code"])
    return RunEnd(result[0]), int(result[1])
