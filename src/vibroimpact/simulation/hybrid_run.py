"""Simulation of hybrid systems given as data: every transition, proved to be the first."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import (
    check_choice,
    check_count,
    check_kind,
    check_memory,
    names_arguments,
    numbers,
    real,
    real_or_infinite,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import Announcement, expected, interruptible
from vibroimpact._core.types import Codes, Floats, Rising
from vibroimpact.compile.sliding import GivenSystem
from vibroimpact.compile.units import units_of
from vibroimpact.model.hybrid_system import HybridSystem
from vibroimpact.model.phases import phases_at
from vibroimpact.results.result import Result, along, sized
from vibroimpact.simulation.simulate import RunEnd, Status, flights_at, rounded_times

KEPT = (
    "high",
    "low",
    "status",
    "contact",
    "mode",
    "before",
    "after",
    "y",
)  # of what the kernel records


@dataclass(frozen=True, eq=False)
class HybridRun(Result):
    """A simulated motion of a :class:`HybridSystem`; arrays are read-only.

    Attributes
    ----------
    time
        Time of each event since the start, shape (n_event,).
    status
        :class:`Status` of each event: CHANGE for a transition, GRAZING where a guard touches its
        level within rounding, HORIZON at the end.
    guard
        Name of the guard at each event, empty at the horizon.
    modes
        Name of the mode at the start, and after each event: n_event + 1 names. ``"A|B"`` is sliding
        on the guard at which A is left for B as it rises, and B for A as it falls.
    before, after
        States before and after each event, shape (n_event, n).
    end
        :class:`RunEnd`, why the run ended.
    reason
        The reason of the end in words, with the names of modes and guards where they matter.
    system, start
        The system, and the state at the start.
    """

    system: HybridSystem
    start: Floats = field(metadata=along("state"))
    time: Rising = field(metadata=along("event"))
    status: Codes = field(metadata=along("event"))
    guard: tuple[str, ...] = field(metadata=along("event"))
    modes: tuple[str, ...] = field(metadata=along("flight"))
    before: Floats = field(metadata=along("event", "state"))
    after: Floats = field(metadata=along("event", "state"))
    end: RunEnd
    reason: str
    _given: GivenSystem = field(repr=False)
    _y: Floats = field(metadata=sized("flight", "unknown"), repr=False)
    _mode: Codes = field(metadata=sized("flight"), repr=False)
    _low: Floats = field(metadata=sized("event"), repr=False)

    def __len__(self) -> int:
        return int(self.time.size)

    def __repr__(self) -> str:
        changes = int(np.sum(self.status == Status.CHANGE))
        span = self.time[-1] if len(self) else 0.0
        return f"HybridRun: {changes} transitions up to t = {span:.6g}; {self.reason}"

    def at(self, t: ArrayLike) -> Floats:
        """States at any times of the run, exact to rounding; after an event at its time.

        Parameters
        ----------
        t
            Times in [0, time of the last event].

        Returns
        -------
        state
            Shape ``t.shape + (n,)``.

        Raises
        ------
        InvalidParameterError
            A time outside the run.
        """
        times, flights = flights_at(t, self.time, self._low, self._y, self._mode)
        unit = self._given.units.time
        flights = flights._replace(begin=flights.begin / unit, low=flights.low / unit)
        rows = flights.at(np.ravel(times) / unit, self._given.kernel)
        return _states(rows, self.system.states).reshape(*times.shape, self.system.states)


@names_arguments()
@interruptible
def simulate_hybrid(
    system: HybridSystem,
    mode: str,
    start: ArrayLike,
    *,
    phase: float = 0.0,
    events: int = 10_000,
    t_max: float = math.inf,
) -> HybridRun:
    """Simulate a hybrid system given as data.

    Parameters
    ----------
    system
        A :class:`HybridSystem`.
    mode
        Name of the mode at the start. A guard that lies beyond its level there is crossed at once.
    start
        Shape (n,).
    phase
        Phase of the first forcing line at the start, in radians.
    events
        Stop after so many events.
    t_max
        Stop at this time.

    Returns
    -------
    HybridRun
        Every transition. The first crossing of every guard is proved, not sampled; what cannot be
        decided is data: see ``run.status`` and ``run.end``.

    Raises
    ------
    InvalidParameterError
        Wrong shapes, a mode that does not exist.

    Notes
    -----
    About ten microseconds per event for a few states.
    """
    check_kind("system", system, HybridSystem, "a HybridSystem")
    check_choice("mode", mode, list(system.modes))
    check_count("events", events, 1)
    if real_or_infinite("t_max", t_max, "a number > 0") <= 0.0:
        raise refusal("t_max", t_max, "> 0")
    if t_max == math.inf:
        check_memory("events", events, 32 * system.states + 96, "Give t_max.")
    y = numbers("start", start)
    if y.shape != (system.states,) or y.dtype != float:
        raise InvalidParameterError(f"start has shape {y.shape}; expected ({system.states},).")
    given = GivenSystem(system, units_of(system, mode, y, t_max))
    at = _start(given, mode, y, real("phase", phase))
    horizon = t_max / given.units.time

    def beginning(count: int) -> float:
        part = _Raw(given, at.copy(), horizon).run(count)
        ended = part.end is not RunEnd.EVENTS or not len(part.high)
        return 1.0 if ended else max(count / events, float(part.high[-1]) / horizon)

    Announcement("events", events).say(expected(events, beginning))
    raw = _Raw(given, at, horizon)
    part = raw.run(int(events))
    time, low = rounded_times(part.high, part.low)
    time, low = time * given.units.time, low * given.units.time
    names = given.names
    for array in (time, part.status, part.before, part.after):
        array.flags.writeable = False
    return HybridRun(
        system=system,
        start=y,
        time=time,
        status=part.status,
        guard=tuple(given.watches[c].guard if c >= 0 else "" for c in part.watch.tolist()),
        modes=tuple(names[m] for m in part.modes.tolist()),
        before=part.before,
        after=part.after,
        end=part.end,
        reason=part.reason,
        _given=given,
        _y=part.y,
        _mode=part.modes,
        _low=low,
    )


def _states(rows: Floats, n: int) -> Floats:
    """States from rows of the kernel: entries with even numbers, then those with odd ones."""
    pairs = rows.shape[1] // 2
    return np.stack([rows[:, :pairs], rows[:, pairs:]], axis=2).reshape(len(rows), 2 * pairs)[:, :n]


def _start(given: GivenSystem, mode: str, y: Floats, phase: float) -> Any:
    whole, omegas = np.zeros(2 * given.pairs), given.system.omegas
    whole[: given.n] = y
    phases = phases_at(phase, np.array([w / omegas[0] for w in omegas])).tolist()
    at = given.kernel.start(whole[::2].tolist(), whole[1::2].tolist(), phases)["at"]
    at.mode = at.states = given.code(mode)
    given.kernel.settle(at)
    return at


class _Events(NamedTuple):
    """Events as arrays; y and modes with those of the start before them."""

    high: Floats
    low: Floats
    status: Codes
    watch: Codes
    before: Floats
    after: Floats
    y: Floats
    modes: Codes
    end: RunEnd
    reason: str


class _Raw:
    """The events of the kernel, those of one instant on one surface made one."""

    def __init__(self, given: GivenSystem, at: Any, t_max: float) -> None:
        self.given, self.at, self.t_max = given, at, t_max
        self.horizon = t_max if t_max < math.inf else 1e9 * max(given.steps)
        self.parts: list[dict[str, Any]] = []
        self.start = np.array(at.y)[None, :], np.array([at.mode])

    def run(self, events: int) -> _Events:
        """Simulate so many events of the run."""
        asked = events
        while True:
            part = self.given.kernel.simulate(self.at, self.t_max, self.horizon, asked, asked)
            self.parts.append(part)
            found = self._merged(RunEnd(part["why"]), events)
            if found.end != RunEnd.EVENTS or len(found.status) == events:
                return found
            asked = 2 * (events + 1 - len(found.status)) + 2

    def _merged(self, end: RunEnd, events: int) -> _Events:
        given = self.given
        whole = {k: np.concatenate([p[k] for p in self.parts]) for k in KEPT}
        y = np.concatenate([self.start[0], whole["y"]])
        modes = np.concatenate([self.start[1], whole["mode"]]).astype(np.int32)
        on = np.array(
            [given.watches[c].surface if c >= 0 else -1 for c in whole["contact"].tolist()],
            dtype=int,
        )
        span = whole["high"] + whole["low"]
        taken, firsts, reason = list[int](), list[int](), ""
        for k in range(len(on)):
            at_once = k > 0 and on[k] >= 0 and on[k] == on[k - 1] and span[k] == span[k - 1]
            if (
                at_once
                and whole["status"][k] == whole["status"][k - 1] == Status.CHANGE
                and taken[-1:] == [k - 1]
            ):
                taken[-1] = k
            else:
                taken.append(k)
                firsts.append(k)
            if reason := self._stops(k, len(on), whole, modes, y, span):
                end = RunEnd.SLIDING
                break
        kept = [
            i
            for i, (first, last) in enumerate(zip(firsts, taken, strict=True))
            if on[first] < 0
            or whole["status"][first] != Status.CHANGE
            or given.names[modes[first]] != given.names[modes[last + 1]]
        ]
        first, last = np.array(firsts, dtype=int)[kept], np.array(taken, dtype=int)[kept]
        if len(first) > events or (
            end == RunEnd.EVENTS and len(first) == events and last[-1] < len(on) - 1
        ):
            first, last, end, reason = first[:events], last[:events], RunEnd.EVENTS, ""
        elif end == RunEnd.EVENTS:
            first = (
                first[: events - 1] if given.surfaces else first
            )  # more of its instant may follow
            last = last[: len(first)]
        if end == RunEnd.STALLED:
            reason = self._stalled(whole, modes)
        after = np.concatenate([[0], last + 1])
        n = given.n
        return _Events(
            whole["high"][first], whole["low"][first], whole["status"][first], whole["contact"][first],
            _states(whole["before"][first], n), _states(whole["after"][last], n), y[after], modes[after], end,
            reason or end.sentence,
        )  # fmt: skip

    def _stops(
        self, k: int, count: int, whole: dict[str, Any], modes: Codes, y: Floats, span: Floats
    ) -> str:
        """Reason why the motion cannot go on from an event; "" where it can."""
        given, watch = self.given, int(whole["contact"][k])
        if watch >= 0 and whole["status"][k] == Status.CHANGE and given.watches[watch].unclear:
            return given.watches[watch].unclear
        number = given.slides(int(modes[k + 1]))
        if number < 0 or given.surfaces[number].flow or k + 1 == count or span[k + 1] == span[k]:
            return ""
        s = given.surfaces[number]
        share = s.share(y[k + 1])
        return (
            f"it slides on {s.guard!r} between {s.below!r} and {s.above!r}: what holds there is "
            f"{1.0 - share:.6g} of {s.below!r} and {share:.6g} of {s.above!r} at this state, which is not linear in "
            "it, as their rates do not differ by a constant"
        )

    def _stalled(self, whole: dict[str, Any], modes: Codes) -> str:
        """The modes and guards that follow one another at one instant."""
        given, last = self.given, slice(-64, None)
        names = sorted({given.names[m] for m in modes[last].tolist()})
        found = {given.watches[c].guard for c in whole["contact"][last].tolist() if c >= 0}
        on = {given.slides(m) for m in modes[last].tolist()} - {-1}
        guards = sorted(found | {given.surfaces[number].guard for number in on})
        both = ": it slides on several at once, and what holds there is not determined"
        return (
            f"{RunEnd.STALLED.sentence}: modes {', '.join(map(repr, names))} undo one another at "
            f"{', '.join(map(repr, guards))}{both if on and len(guards) > 1 else ''}"
        )
