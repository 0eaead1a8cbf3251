"""Admissibility of a solution of the orbit equations: no guard is crossed between impacts.

Method      Every flight is expanded, window by window, in Chebyshev polynomials of the rate u' of
            every guard of its mode, which over a window of 6 radians of the fastest rate have fallen
            to rounding at 25 terms; zeros of u' are the eigenvalues of the colleague matrix, so
            that every extremum of every gap is found, not sampled. An orbit is admissible if
              - no flight takes negative time,                                                 (1)
              - no gap is negative at an interior extremum or at an impact of another contact; the gap
                being the margin to a limit, of an element's guard, too, but not where that limit is
                reached or left.                                                               (2)
            (2) also decides whether impacts come from the front: a motion that reaches a stop from
            behind has crossed it, and by Rolle's theorem its gap has a negative extremum since
            then, the impact's own, which vanishes with its speed. So no speed has to be compared
            with zero, its value at a touch; only in a flight of no duration, which has no interior,
            the rate itself must have its sign.                                                (3)
            The clearance is the least gap at those places: zero at grazing.
Accuracy    gaps to about 1e-13 of the amplitude: the largest of |row| . |y| along the orbit and of
            the guard's limits. Crossings of less than PLAY_OF_AMPLITUDE of it are contacts; with the
            acceleration a of the gap, a rate of the wrong sign below sqrt(2 a PLAY_OF_AMPLITUDE amplitude) is
            one of them
Reference   theory.md, "Periodic orbits"; Boyd, Solving Transcendental Equations (2014)
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence, Set
from typing import NamedTuple

import numpy as np

from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Amount, AnyFloat, Count, Floats, Sign
from vibroimpact.compile.modes import digit_in_code
from vibroimpact.compile.prescribed import (
    CHATTER_WATCH,
    FORCE_WATCH,
    GAP_WATCH,
    PHASE,
    PHASE_WATCH,
    End,
    Explicit,
    GuardAlong,
    Linearised,
    Passage,
    Prescribed,
)
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import Stop

# A flight and Newton's method are rounded by so much, relative to the amplitude and to the period.
PLAY_OF_AMPLITUDE = 1e-11
# A rate at a phase of a motion without events, relative to its largest, of which the extremum is so near
# that the gap there differs from it by the square of this.
FLAT_AT_PHASE = 1e-7
EDGE_OF_FLIGHT = 1e-3  # an end of a flight is nearer, relative to its duration
# The guard of the element that has just changed is at its limit within this.
LIMIT_OF_AMPLITUDE = 1e-9


class Place(NamedTuple):
    """Key of a gap: a stop in a flight, with the own extrema of impacts apart.

    Of an element ``watch`` is the number of the guard in its mode.
    """

    contact: int
    side: int
    segment: int
    own: bool = False
    watch: int = GAP_WATCH


class Nearest(NamedTuple):
    """Gap at one of its extrema, or at the impact of another contact."""

    gap: AnyFloat
    contact: Count
    side: Sign
    segment: Count
    time: Amount  # since the segment's start
    own: bool = False  # of an impact that is reached or left from behind
    watch: int = GAP_WATCH

    @property
    def place(self) -> Place:
        """The stop and the flight."""
        return Place(self.contact, self.side, self.segment, self.own, self.watch)

    def __str__(self) -> str:
        limit = "upper" if self.side > 0 else "lower"
        gap = f"the gap at {Stop(self.contact, self.side).words}"
        margin = (
            f"the force on contact {self.contact}, which rests on its stop,"
            if self.watch == FORCE_WATCH
            else f"the margin to the {limit} limit of guard {self.watch}, of element {self.contact},"
        )
        return (
            f"{gap if self.watch == GAP_WATCH else margin} is {self.gap:.6g} in flight "
            f"{self.segment}, {self.time:.6g} after its start"
        )


class _Ends(NamedTuple):
    """What begins and ends a flight."""

    stops: tuple[tuple[int, int], tuple[int, int]]  # contact and side at the start and at the end
    together: tuple[Set[int], Set[int]]  # contacts at the instant of the start, and of the end
    level: tuple[Set[int], Set[int]]  # those of them whose guards have the rate zero there
    before: int  # code of the mode before


def least_gaps(
    compiled: Prescribed,
    states: Floats,
    durations: Floats,
    ends: Sequence[tuple[int, ...]],
    begun: Sequence[Stop],
    hidden: Container[Stop] = (),
) -> dict[Place, Nearest]:
    """Nearest approach to each limit of each guard in each flight.

    Considered are the extrema of the gaps within the flights, and the ends where another contact
    impacts. ``begun[k]`` begins flight k, ``ends[k]`` ends it. In chatter that of the stop that chatters is
    left out, and everywhere those that are ``hidden``: at the place of another (model/stand_ins.py).
    """
    least: dict[Place, Nearest] = {}
    whole = [End(*end) for end in ends]
    stops, rubbing = compiled.mechanism.rigid_stops, _rubbing(compiled.mechanism)
    parts = compiled.explicit(states, durations, whole)
    numbers, since = parts.segment.tolist(), parts.since.tolist()
    before = []
    for j, (k, end) in enumerate(zip(numbers, parts.ends, strict=True)):
        before.append(tuple(begun[k]) if j == 0 or numbers[j - 1] != k else end[:2])
    together = _together(before, parts)
    flights = []
    for j, (k, end) in enumerate(zip(numbers, parts.ends, strict=True)):
        released = parts.since[j] == 0.0 and whole[k - 1].watch == FORCE_WATCH
        first, at = Stop(*before[j]), (together[j], together[j + 1])
        plastic = 0 <= first.contact < len(stops) and first.restitution(stops) == 0.0
        opening = {*range(len(stops))} if released or plastic else set[int]()
        level = at[0] & (rubbing | opening), at[1] & rubbing
        flights.append(_Ends((first, end[:2]), at, level, parts.ends[j - 1].mode))
    modes = [end.mode for end in parts.ends]
    found = compiled.approach(parts.states, parts.durations, modes)
    for guard in found.guards:
        if is_infinite(guard.lower) and is_infinite(guard.upper):
            continue  # its gap is constant
        for j, along in guard.flights.items():
            k, chatters = numbers[j], parts.chatters[j]
            if chatters and (guard.contact, guard.watch) == (parts.ends[j].contact, GAP_WATCH):
                continue
            for near in _gaps(guard, along, flights[j], float(parts.durations[j])):
                if guard.watch == GAP_WATCH and Stop(near.contact, near.side) in hidden:
                    continue
                here = near._replace(segment=k, time=near.time + since[j])
                least[here.place] = min(here, least.get(here.place, here))
    return least


def _rubbing(m: Mechanism) -> set[int]:
    """Numbers of the elements with friction, of which slip begins at speed and acceleration zero."""
    return {k for k, e in enumerate(m.switching, len(m.rigid_stops)) if e.slipping}


def _together(begun: Sequence[tuple[int, ...]], parts: Explicit) -> list[Set[int]]:
    """Contacts at the instant at which each flight begins, and at which the last one ends.

    They are several where flights between impacts, or between releases, take no time.
    """
    at: list[Set[int]] = [*({stop[0]} for stop in begun), {parts.ends[-1].contact}]
    shortest = PLAY_OF_AMPLITUDE * float(np.abs(parts.durations).sum())
    none = [
        j
        for j in np.flatnonzero(np.abs(parts.durations) <= shortest).tolist()
        if parts.ends[j - 1].watch == parts.ends[j].watch in (GAP_WATCH, FORCE_WATCH)
    ]
    for j in none:
        at[j + 1] = at[j] | at[j + 1]
    for j in reversed(none):
        at[j] = at[j + 1]
    if begun[0][0] in at[-1]:
        at[0] = at[-1] = at[0] | at[-1]
    return at


def amplitudes(
    compiled: Prescribed, states: Floats, durations: Floats, ends: Sequence[tuple[int, ...]]
) -> dict[tuple[int, int], float]:
    """Reference size for the gap of each guard, by the numbers of its contact and watch."""
    modes = [End(*end).mode for end in ends]
    most = compiled.approach(states, durations, modes).most
    sizes: dict[tuple[int, int], float] = {}
    for guard in (guard for mode in {*modes} for guard in compiled.modes[mode].guards):
        limits = [abs(x) for x in (guard.lower, guard.upper, guard.gain) if not is_infinite(x)]
        key = guard.contact, guard.watch
        size = max(float(np.abs(guard.row) @ most), *limits, sizes.get(key, 0.0))
        sizes[key] = size
    return sizes


def relative_gap(near: Nearest, sizes: Mapping[tuple[int, int], float]) -> float:
    """Gap relative to the amplitude of its guard; of rigid stops to the largest of theirs, so that they compare."""
    if near.watch == GAP_WATCH:
        size = max(size for (_, watch), size in sizes.items() if watch == GAP_WATCH)
    else:
        size = sizes[near.contact, near.watch]
    return near.gap / size if size else near.gap


def _gaps(guard: GuardAlong, along: Passage, ends: _Ends, whole: float) -> Iterator[Nearest]:
    """Gaps of a guard in a flight: at its extrema, and where others begin or end it."""
    margin = PLAY_OF_AMPLITUDE * whole
    inside = [
        (t, u)
        for t, u in along.extrema
        if margin < t < whole - margin and not _leaves(guard, ends, t, u, whole)
    ]
    own = _own(guard, along, ends, [t for t, _ in inside]) if guard.watch == GAP_WATCH else set()
    edges = [
        (edge * whole, along.values[edge]) for edge in (0, 1) if _counts(guard, along, ends, edge)
    ]
    for j, (t, u) in enumerate([*inside, *edges]):
        if not is_infinite(guard.upper):
            yield Nearest(guard.upper - u, guard.contact, 1, 0, t, j in own, guard.watch)
        if not is_infinite(guard.lower):
            yield Nearest(u - guard.lower, guard.contact, -1, 0, t, j in own, guard.watch)


def _own(guard: GuardAlong, along: Passage, ends: _Ends, times: list[float]) -> set[int]:
    """Extrema that belong to an impact which is reached or left from behind."""
    own = set()
    for edge, sense in enumerate((1.0, -1.0)):
        contact, side = ends.stops[edge]
        if contact != guard.contact or not times or contact in ends.level[edge]:
            continue
        if sense * side * along.rates[edge] > 0.0:
            own.add(min(range(len(times)), key=lambda j, sense=sense: sense * times[j]))  # type: ignore[misc]
    return own


def _leaves(guard: GuardAlong, ends: _Ends, time: float, u: float, whole: float) -> bool:
    """Whether an extremum of a guard is the limit at which the flight begins or ends.

    Slip begins at speed and acceleration zero, where both levels of friction are equal; and the gap of a stop opens at
    speed zero where it is released, or after a plastic impact. A guard that leaves its limit at a rate, however slow,
    has its extrema elsewhere: they are touches.
    """
    near = time < EDGE_OF_FLIGHT * whole, time > (1.0 - EDGE_OF_FLIGHT) * whole
    level = any(near[edge] and guard.contact in ends.level[edge] for edge in (0, 1))
    beyond = min(abs(guard.lower - u), abs(u - guard.upper))
    return level and beyond <= LIMIT_OF_AMPLITUDE * guard.size


def _counts(guard: GuardAlong, along: Passage, ends: _Ends, edge: int) -> bool:
    """Whether a flight begins (edge 0) or ends (1) with another contact, so that the gap there counts.

    Where an element changes its state its guards may be at their limits; beyond them they count, too.
    """
    contact = ends.stops[edge][0]
    if contact == PHASE:  # nothing happens there: only an extremum counts
        return abs(along.rates[edge]) <= FLAT_AT_PHASE * guard.fastest
    if guard.watch != GAP_WATCH:
        beyond = max(guard.lower - along.values[edge], along.values[edge] - guard.upper)
        if beyond > LIMIT_OF_AMPLITUDE * guard.size:
            return True
    elif edge == 0 and digit_in_code(ends.before, guard.contact):
        return False  # an impact elsewhere opens what has rested
    return guard.contact not in ends.together[edge]


def why_inadmissible(
    parts: Linearised,
    ends: Sequence[tuple[int, ...]],
    durations: Floats,
    gaps: Mapping[Place, Nearest],
    sizes: Mapping[tuple[int, int], float],
    slack: float = 0.0,
) -> str:
    """Reason why an orbit is not admissible, by (1) to (3); "" for an admissible one.

    ``sizes`` are the :func:`amplitudes`; ``slack`` is allowed beyond rounding, relative to the
    period and to them, for a touch that is known approximately.
    """
    play = max(PLAY_OF_AMPLITUDE, slack)
    shortest = play * float(np.abs(durations).sum())
    for k, duration in enumerate(durations):
        if duration < -shortest:
            return f"flight {k} takes the time {duration:.6g}: two impacts have changed order"
    crossed = {
        place for place, here in gaps.items() if here.gap < -play * sizes[here.contact, here.watch]
    }
    behind = {(place.contact, place.side, place.segment, place.watch) for place in crossed}
    period, named = float(np.abs(durations).sum()), [End(*end) for end in ends]
    rigid = [k for k, end in enumerate(named) if end.watch == GAP_WATCH]
    closing = float(np.abs(parts.rate[rigid]).max(initial=0.0))
    for k, (contact, side, _, watch) in enumerate(named):
        if watch in (CHATTER_WATCH, PHASE_WATCH):
            continue
        rests = watch == GAP_WATCH and digit_in_code(named[(k + 1) % len(named)].mode, contact)
        if rests and abs(parts.rate_after[k]) > play * closing:
            return (
                f"impact {k} leaves {Stop(contact, side).words} at {abs(parts.rate_after[k]):.6g}, and "
                "rest is to follow"
            )
        fastest = closing if watch == GAP_WATCH else sizes[contact, watch] / period
        at_once = durations[k] <= shortest and side * parts.rate[k] < -play * fastest
        if at_once or (side * parts.rate[k] < 0.0 and (contact, side, k, watch) in behind):
            stop = (
                Stop(contact, side).words if watch == GAP_WATCH else f"a limit of element {contact}"
            )
            return f"impact {k} reaches {stop} from behind, at {abs(parts.rate[k]):.6g}"
    return str(min(gaps[place] for place in crossed)) if crossed else ""
