"""Admissibility of a solution of the orbit equations: no stop is crossed between impacts.

Method      Every flight is expanded, window by window, in Chebyshev polynomials of the contact
            coordinate's rate u', which over a window of 6 radians of the fastest rate have fallen
            to rounding at 25 terms; zeros of u' are the eigenvalues of the colleague matrix, so
            that every extremum of every gap is found, not sampled. An orbit is admissible if
              - no flight takes negative time,                                                 (1)
              - no gap is negative at an interior extremum or at an impact of another contact. (2)
            (2) also decides whether impacts come from the front: a motion that reaches a stop from
            behind has crossed it, and by Rolle's theorem its gap has a negative extremum since
            then, the impact's own, which vanishes with its speed. So no speed has to be compared
            with zero, its value at a touch; only in a flight of no duration, which has no interior,
            the rate itself must have its sign.                                                (3)
            The clearance is the least gap at those places: zero at grazing.
Accuracy    gaps to about 1e-13 of the amplitude: the largest of |row| . |x| along the orbit and of
            the contact's limits. Crossings of less than PLAY of it are contacts; with the
            acceleration a of the gap, a rate of the wrong sign below sqrt(2 a PLAY amplitude) is
            one of them
Reference   theory.md, "Periodic orbits"; Boyd, Solving Transcendental Equations (2014)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from vibroimpact._core.chebyshev import fitted, real_zeros_of
from vibroimpact._core.types import Flags, Floats, Integers
from vibroimpact.compile.prescribed import Linearised, Prescribed
from vibroimpact.model.mechanism import infinite
from vibroimpact.model.stop import Stop

# Relative to the largest u' in a window. It moves an extremum of the gap by as much, and its value
# by the square of that; where two extrema are about to merge by the power 3/2, 3e-14.
FLAT = 1e-9
PLAY = 1e-11  # of the amplitude, of the period: rounding of a flight and of Newton's method


class Place(NamedTuple):
    """Key of a gap: a stop in a flight, with the own extrema of impacts apart."""

    contact: int
    side: int
    segment: int
    own: bool = False


class Nearest(NamedTuple):
    """Gap at one of its extrema, or at the impact of another contact."""

    gap: float
    contact: int
    side: int
    segment: int
    time: float  # since the segment's start
    own: bool = False  # of an impact that is reached or left from behind

    @property
    def place(self) -> Place:
        """The stop and the flight."""
        return Place(self.contact, self.side, self.segment, self.own)

    def __str__(self) -> str:
        return (
            f"the gap at {Stop(self.contact, self.side).words} is {self.gap:.6g} in flight "
            f"{self.segment}, {self.time:.6g} after its start"
        )


class _Flights(NamedTuple):
    """Consecutive windows of free flight over all segments, and the segments' ends."""

    length: float  # of a window
    segment: Integers  # (w,)
    start: Floats  # (w,) since the start of the segment
    values: Floats  # (w, NODES, 2n) x and v
    durations: Floats  # (m,)
    impacts: Integers  # (m, 2, 2) contact and side of the impacts at the start and the end
    first: Integers  # (m,) window of the start
    last: Integers  # (m,) window of the end


def least_gaps(
    compiled: Prescribed,
    states: Floats,
    durations: Floats,
    ends: Sequence[Stop],
    begun: Sequence[Stop],
) -> dict[Place, Nearest]:
    """Nearest approach to each stop in each flight.

    Considered are the extrema of the gaps within the flights, and the ends where another contact
    impacts. ``begun[k]`` begins flight k, ``ends[k]`` ends it.
    """
    least: dict[Place, Nearest] = {}
    flights = _windows(compiled, states, durations, ends, begun)
    for i in range(len(compiled.mechanism.contacts)):
        for here in _gaps(compiled, flights, i):
            least[here.place] = min(here, least.get(here.place, here))
    return least


def amplitudes(compiled: Prescribed, states: Floats, durations: Floats) -> Floats:
    """Reference length for the gap of each contact, shape (contacts,)."""
    contacts, n = compiled.mechanism.contacts, compiled.degrees
    rows = np.abs([contact.row for contact in contacts])
    sizes = (np.abs(compiled.sampled(states, durations)[:, :n]) @ rows.T).max(axis=0)
    limits = [[abs(x) for x in (c.lower, c.upper) if not infinite(x)] for c in contacts]
    return np.array([max(size, *stops) for size, stops in zip(sizes, limits, strict=True)])


def _windows(
    compiled: Prescribed,
    states: Floats,
    durations: Floats,
    ends: Sequence[Stop],
    begun: Sequence[Stop],
) -> _Flights:
    flights = compiled.flights(states, durations)
    counts = np.array([len(starts) for starts, _ in flights])
    after = np.cumsum(counts)
    return _Flights(
        length=compiled.window(durations),
        segment=np.repeat(np.arange(len(flights)), counts),
        start=np.concatenate([starts for starts, _ in flights]),
        values=np.concatenate([values for _, values in flights]),
        durations=durations,
        impacts=np.stack([np.array(begun), np.array(ends)], axis=1),
        first=after - counts,
        last=after - 1,
    )


def _gaps(compiled: Prescribed, flights: _Flights, i: int) -> Iterator[Nearest]:
    """Gaps of contact i at its extrema and where another contact impacts."""
    contact = compiled.mechanism.contacts[i]
    row = np.array(contact.row)
    n = len(row)
    place = fitted((flights.values[..., :n] @ row).T)
    rate = fitted((flights.values[..., n:] @ row).T)
    at, x = real_zeros_of(rate, FLAT)
    times = flights.start[at] + flights.length * (1.0 + x) / 2.0
    whole = flights.durations[flights.segment[at]]
    margin = PLAY * whole
    inside = (times > margin) & (times < whole - margin)
    at, times = at[inside], times[inside]
    own = np.zeros(len(at) + 2 * len(flights.durations), dtype=bool)
    own[: len(at)] = _own(flights, rate, i, flights.segment[at], times)
    starting, ending = (flights.impacts[:, edge, 0] != i for edge in (0, 1))
    at = np.concatenate([at, flights.first[starting], flights.last[ending]])
    times = np.concatenate([times, np.zeros(starting.sum()), flights.durations[ending]])
    u = _values(flights, place, at, times)
    found = flights.segment[at].tolist(), times.tolist(), own[: len(at)].tolist(), u.tolist()
    for k, t, by_impact, value in zip(*found, strict=True):
        if not infinite(contact.upper):
            yield Nearest(contact.upper - value, i, 1, k, t, by_impact)
        if not infinite(contact.lower):
            yield Nearest(value - contact.lower, i, -1, k, t, by_impact)


def _own(flights: _Flights, rate: Floats, i: int, segment: Integers, times: Floats) -> Flags:
    """Mask of extrema that belong to an impact which is reached or left from behind."""
    own = np.zeros(len(times), dtype=bool)
    zero = np.zeros(len(flights.durations))
    edges = ((flights.first, zero, 1.0), (flights.last, flights.durations, -1.0))
    for edge, (window, time, sense) in enumerate(edges):
        contact, side = flights.impacts[:, edge].T
        behind = sense * side * _values(flights, rate, window, time) > 0.0
        for k in np.flatnonzero(behind & (contact == i)):
            inside = np.flatnonzero(segment == k)
            if inside.size:
                own[inside[np.argmin(sense * times[inside])]] = True
    return own


def _values(flights: _Flights, series: Floats, window: Integers, times: Floats) -> Floats:
    """Values of a series (NODES, w) in some windows at times since their segments' start."""
    x = 2.0 * (times - flights.start[window]) / flights.length - 1.0
    return np.asarray(chebyshev.chebval(x, series[:, window], tensor=False))


def why_inadmissible(
    parts: Linearised,
    impacts: Sequence[Stop],
    durations: Floats,
    gaps: Mapping[Place, Nearest],
    sizes: Floats,
    slack: float = 0.0,
) -> str:
    """Reason why an orbit is not admissible, by (1) to (3); "" for an admissible one.

    ``sizes`` are the :func:`amplitudes`; ``slack`` is allowed beyond rounding, relative to the
    period and to them, for a touch that is known approximately.
    """
    play = max(PLAY, slack)
    shortest = play * float(np.abs(durations).sum())
    for k, duration in enumerate(durations):
        if duration < -shortest:
            return f"flight {k} takes the time {duration:.6g}: two impacts have changed order"
    crossed = {place for place, here in gaps.items() if here.gap < -play * sizes[here.contact]}
    behind = {place[:3] for place in crossed}
    fastest = float(np.abs(parts.rate).max())
    for k, (contact, side) in enumerate(impacts):
        at_once = durations[k] <= shortest and side * parts.rate[k] < -play * fastest
        if at_once or (side * parts.rate[k] < 0.0 and (contact, side, k) in behind):
            stop = Stop(contact, side).words
            return f"impact {k} reaches {stop} from behind, at {abs(parts.rate[k]):.6g}"
    return str(min(gaps[place] for place in crossed)) if crossed else ""
