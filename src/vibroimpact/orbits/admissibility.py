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

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vibroimpact._core.chebyshev import fitted, nodes, real_zeros_of
from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Amount, AnyFloat, Count, Flags, Floats, Integers, Sign
from vibroimpact._core.windows import Windows, values_at
from vibroimpact.compile.modes import digit_in_code
from vibroimpact.compile.prescribed import (
    CHATTER_WATCH,
    FORCE_WATCH,
    GAP_WATCH,
    PHASE,
    PHASE_WATCH,
    WINDOW_NODES,
    End,
    Explicit,
    GuardRow,
    Linearised,
    Prescribed,
)
from vibroimpact.model.stop import Stop

# Relative to the largest u' in a window. It moves an extremum of the gap by as much, and its value
# by the square of that; where two extrema are about to merge by the power 3/2, 3e-14.
FLAT_OF_LARGEST_RATE = 1e-9
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


class _Flights(NamedTuple):
    """Flights over all segments."""

    windows: Windows
    values: Floats  # (w, WINDOW_NODES, D) coordinates y
    impacts: Integers  # (m, 2, 2) contact and side of the impacts at the start and the end
    released: Flags  # (m,) whether a contact that rested is released at the start

    def within(self, segments: Integers) -> _Flights:
        """Return the flights of some segments, which keep their numbers."""
        kept = np.isin(self.windows.segment, segments)
        return self._replace(windows=self.windows.only(kept), values=self.values[kept])


def least_gaps(
    compiled: Prescribed,
    states: Floats,
    durations: Floats,
    ends: Sequence[tuple[int, ...]],
    begun: Sequence[Stop],
) -> dict[Place, Nearest]:
    """Nearest approach to each limit of each guard in each flight.

    Considered are the extrema of the gaps within the flights, and the ends where another contact
    impacts. ``begun[k]`` begins flight k, ``ends[k]`` ends it. In chatter that of the stop that chatters is
    left out.
    """
    least: dict[Place, Nearest] = {}
    whole = [End(*end) for end in ends]
    parts = compiled.explicit(states, durations, whole)
    begins = np.diff(parts.segment, prepend=-1) > 0
    before = [
        begun[k] if first else Stop(end.contact, end.side)
        for k, first, end in zip(parts.segment, begins, parts.ends, strict=True)
    ]
    modes = np.array([end.mode for end in parts.ends])
    follows = [whole[k - 1].watch == FORCE_WATCH for k in parts.segment]
    every = _windows(compiled, parts, before, begins & np.array(follows))
    for code in dict.fromkeys(modes.tolist()):
        segments = np.flatnonzero(modes == code)
        flights = every if len(compiled.modes) == 1 else every.within(segments)
        for guard in compiled.modes[code].guards:
            if is_infinite(guard.lower) and is_infinite(guard.upper):
                continue  # its gap is constant
            for near in _gaps(compiled, flights, code, guard, segments):
                k = near.segment
                if parts.chatters[k] and guard[:2] == (parts.ends[k].contact, GAP_WATCH):
                    continue
                here = near._replace(
                    segment=int(parts.segment[k]), time=near.time + float(parts.since[k])
                )
                least[here.place] = min(here, least.get(here.place, here))
    return least


def amplitudes(
    compiled: Prescribed, states: Floats, durations: Floats, ends: Sequence[tuple[int, ...]]
) -> dict[tuple[int, int], float]:
    """Reference size for the gap of each guard, by the numbers of its contact and watch."""
    modes = [End(*end).mode for end in ends]
    most = compiled.largest(compiled.sampled(states, durations, modes))
    sizes: dict[tuple[int, int], float] = {}
    for guard in (guard for mode in {*modes} for guard in compiled.modes[mode].guards):
        limits = [abs(x) for x in (guard.lower, guard.upper, guard.gain) if not is_infinite(x)]
        key = guard.contact, guard.watch
        size = float(np.max([np.abs(guard.row) @ most, *limits]))
        sizes[key] = max(size, sizes.get(key, 0.0))
    return sizes


def _windows(
    compiled: Prescribed, parts: Explicit, begun: Sequence[Stop], released: Flags
) -> _Flights:
    modes = [end.mode for end in parts.ends]
    windows, values = compiled.flights(parts.states, parts.durations, modes)
    since = windows.start[:, None] + (1.0 + nodes(WINDOW_NODES)) * (windows.length / 2.0)
    phase = parts.states[windows.segment, -1][:, None] + compiled.omega * since
    return _Flights(
        windows=windows,
        values=compiled.embedded(values, phase),
        impacts=np.stack([np.array(begun), np.array([end[:2] for end in parts.ends])], axis=1),
        released=released,
    )


def _gaps(
    compiled: Prescribed, flights: _Flights, code: int, guard: GuardRow, segments: Integers
) -> Iterator[Nearest]:
    """Gaps of a guard in the flights of its mode: at its extrema, and where others end the flight."""
    mode, i = compiled.modes[code], guard.contact
    place = fitted((flights.values @ guard.row).T + guard.gain)
    rate = fitted((flights.values @ (guard.row @ mode.b)).T + guard.row @ mode.constant)
    at, x = real_zeros_of(rate, FLAT_OF_LARGEST_RATE)
    w = flights.windows
    times = w.since(at, x)
    whole = w.durations[w.segment[at]]
    margin = PLAY_OF_AMPLITUDE * whole
    inside = (times > margin) & (times < whole - margin)
    inside &= ~_leaving(flights, guard, place, at, times)
    at, times = at[inside], times[inside]
    rigid = guard.watch == GAP_WATCH
    own = np.zeros(len(at), dtype=bool)
    if rigid:
        own = _own(flights, rate, i, w.segment[at], times, segments)
    edges = [(_others(flights, guard, place, rate, segments, edge), edge) for edge in (0, 1)]
    at = np.concatenate([at, *((w.first, w.last)[edge][k] for k, edge in edges)])
    times = np.concatenate([times, *(edge * w.durations[k] for k, edge in edges)])
    own = np.concatenate([own, np.zeros(len(at) - len(own), dtype=bool)])
    u = values_at(place, at, w.place(at, times))
    found = w.segment[at].tolist(), times.tolist(), own.tolist(), u.tolist()
    for k, t, by_impact, value in zip(*found, strict=True):
        if not is_infinite(guard.upper):
            yield Nearest(guard.upper - value, i, 1, k, t, by_impact, guard.watch)
        if not is_infinite(guard.lower):
            yield Nearest(value - guard.lower, i, -1, k, t, by_impact, guard.watch)


def _own(
    flights: _Flights, rate: Floats, i: int, segment: Integers, times: Floats, segments: Integers
) -> Flags:
    """Mask of extrema that belong to an impact which is reached or left from behind."""
    own = np.zeros(len(times), dtype=bool)
    for edge, sense in enumerate((1.0, -1.0)):
        contact, side = flights.impacts[segments, edge].T
        behind = sense * side * _at_edge(flights, rate, segments, edge) > 0.0
        behind &= (edge == 1) | ~flights.released[segments]
        for k in segments[behind & (contact == i)]:
            inside = np.flatnonzero(segment == k)
            if inside.size:
                own[inside[np.argmin(sense * times[inside])]] = True
    return own


def _leaving(
    flights: _Flights, guard: GuardRow, place: Floats, at: Integers, times: Floats
) -> Flags:
    """Mask of extrema of a guard that are its touch of a limit where the element changes.

    Slip begins at speed and acceleration zero, where both levels of friction are equal; and so does the
    gap of a stop that is released.
    """
    w = flights.windows
    k = w.segment[at]
    whole = w.durations[k]
    near = [times < EDGE_OF_FLIGHT * whole, times > (1.0 - EDGE_OF_FLIGHT) * whole]
    if guard.watch == GAP_WATCH:
        near = [near[0] & flights.released[k], np.zeros(len(at), dtype=bool)]
    own = [near[edge] & (flights.impacts[k, edge, 0] == guard.contact) for edge in (0, 1)]
    u = values_at(place, at, w.place(at, times))
    beyond = np.minimum(np.abs(guard.lower - u), np.abs(u - guard.upper))
    leaving: Flags = (own[0] | own[1]) & (beyond <= LIMIT_OF_AMPLITUDE * _size(flights, guard))
    return leaving


def _size(flights: _Flights, guard: GuardRow) -> float:
    """Size of the terms of a guard."""
    return float((np.abs(flights.values) @ np.abs(guard.row)).max()) + abs(guard.gain)


def _others(
    flights: _Flights, guard: GuardRow, place: Floats, rate: Floats, segments: Integers, edge: int
) -> Integers:
    """Flights that begin (edge 0) or end (1) with another contact, so that the gap there counts.

    Where an element changes its state its guards may be at their limits; beyond them they count, too.
    """
    other = flights.impacts[segments, edge, 0] != guard.contact
    if guard.watch != GAP_WATCH:
        u = _at_edge(flights, place, segments, edge)
        beyond = np.maximum(guard.lower - u, u - guard.upper)
        other |= beyond > LIMIT_OF_AMPLITUDE * _size(flights, guard)
    at_phase = flights.impacts[segments, edge, 0] == PHASE
    if at_phase.any():  # nothing happens there: only an extremum counts
        other = np.where(at_phase, _is_flat(flights, rate, segments, edge), other)
    found: Integers = segments[other]
    return found


def _is_flat(flights: _Flights, rate: Floats, segments: Integers, edge: int) -> Flags:
    """Whether a guard has an extremum at the start (0) or the end (1) of some flights."""
    largest = np.abs(np.polynomial.chebyshev.chebval(nodes(WINDOW_NODES), rate)).max()
    flat: Flags = np.abs(_at_edge(flights, rate, segments, edge)) <= FLAT_AT_PHASE * largest
    return flat


def _at_edge(flights: _Flights, series: Floats, segments: Integers, edge: int) -> Floats:
    """Values of a series at the start (0) or the end (1) of some flights."""
    w = flights.windows
    window = (w.first, w.last)[edge][segments]
    return values_at(series, window, w.place(window, edge * w.durations[segments]))


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
