"""Whether an orbit of the equations is a motion of the machine: no stop is crossed in between.

Method      Every flight is expanded, window by window, in Chebyshev polynomials of the contact
            coordinate's rate u', which over a window of 6 radians of the fastest rate have fallen
            to rounding at 25 terms; zeros of u' are the eigenvalues of the colleague matrix, so
            that every extremum of every gap is found, not sampled. An orbit is admissible if
              - no flight takes negative time,                                                 (1)
              - no gap is negative at an interior extremum or at an impact of another contact. (2)
            (2) decides whether impacts come from the front, too: a motion that reaches a stop from
            behind has crossed it, and by Rolle's theorem its gap has a negative extremum since. So
            no speed has to be compared with zero, which it is at a touch; only in a flight of no
            duration, where there is nothing in between, the rate itself must have its sign.   (3)
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
from numpy.typing import NDArray

from vibroimpact.chebyshev import fitted, real_zeros
from vibroimpact.mechanism import infinite
from vibroimpact.periodic.prescribed import Impact, Linearised, Prescribed

Floats = NDArray[np.float64]

PLAY = 1e-11  # of the amplitude, of the period: rounding of a flight and of Newton's method

Place = tuple[int, int, int]  # contact, side, segment


class Nearest(NamedTuple):
    """A gap at one of its extrema, or where another contact has its impact."""

    gap: float
    contact: int
    side: int
    segment: int
    time: float  # since the segment's start

    def __str__(self) -> str:
        stop = "upper" if self.side > 0 else "lower"
        return (
            f"the gap at the {stop} stop of contact {self.contact} is {self.gap:.6g} in flight "
            f"{self.segment}, {self.time:.6g} after its start"
        )


def gaps_along(
    compiled: Prescribed,
    states: Floats,
    durations: Floats,
    ends: Sequence[Impact],
    begun: Sequence[Impact],
) -> Iterator[Nearest]:
    """Gaps at all extrema within the flights, and at the ends where others impact.

    ``begun[k]`` begins flight k, ``ends[k]`` ends it.
    """
    window = compiled.window(durations)
    for k, (starts, values) in enumerate(compiled.flights(states, durations)):
        edges = ((0.0, begun[k]), (float(durations[k]), ends[k]))
        for i, contact in enumerate(compiled.mechanism.contacts):
            row = np.array(contact.row)
            n = len(row)
            places, rates = values[..., :n] @ row, values[..., n:] @ row
            times = _extrema(starts, rates, window, durations[k])
            others = [t for t, impact in edges if impact[0] != i]
            for t in [*times, *others]:
                w = min(int(t / window), len(starts) - 1)
                u = _value(places[w], (t - starts[w]) / window)
                if not infinite(contact.upper):
                    yield Nearest(contact.upper - u, i, 1, k, t)
                if not infinite(contact.lower):
                    yield Nearest(u - contact.lower, i, -1, k, t)


def _value(samples: Floats, place: float) -> float:
    return float(chebyshev.chebval(2.0 * place - 1.0, fitted(samples)))


def _extrema(starts: Floats, rates: Floats, window: float, duration: float) -> list[float]:
    """Times within (0, duration) at which the rate vanishes."""
    found: list[float] = []
    for start, samples in zip(starts, rates, strict=True):
        # one at the edge of two windows is a zero of both, though rounding may move it out of both
        found += [start + window * (1.0 + z) / 2.0 for z in real_zeros(fitted(samples))]
    margin = PLAY * duration
    return [t for t in found if margin < t < duration - margin]


def least_gaps(
    compiled: Prescribed,
    states: Floats,
    durations: Floats,
    ends: Sequence[Impact],
    begun: Sequence[Impact],
) -> dict[Place, Nearest]:
    """The nearest approach to each stop in each flight, where its gap has an extremum there."""
    least: dict[Place, Nearest] = {}
    for here in gaps_along(compiled, states, durations, ends, begun):
        place = here.contact, here.side, here.segment
        least[place] = min(here, least.get(place, here))
    return least


def amplitudes(compiled: Prescribed, states: Floats, durations: Floats) -> Floats:
    """What the gap of each contact is compared with, shape (contacts,)."""
    contacts, n = compiled.mechanism.contacts, compiled.degrees
    rows = np.abs([contact.row for contact in contacts])
    sizes = (np.abs(compiled.sampled(states, durations)[:, :n]) @ rows.T).max(axis=0)
    limits = [[abs(x) for x in (c.lower, c.upper) if not infinite(x)] for c in contacts]
    return np.array([max(size, *stops) for size, stops in zip(sizes, limits, strict=True)])


def why_inadmissible(
    parts: Linearised,
    impacts: Sequence[Impact],
    durations: Floats,
    gaps: Mapping[Place, Nearest],
    sizes: Floats,
    slack: float = 0.0,
) -> str:
    """Why no machine moves so, by (1) to (3); "" where one does.

    ``sizes`` are the :func:`amplitudes`; ``slack`` is allowed beyond rounding, relative to the
    period and to them: at a touch that is only nearly one.
    """
    play = max(PLAY, slack)
    shortest = play * float(np.abs(durations).sum())
    for k, duration in enumerate(durations):
        if duration < -shortest:
            return f"flight {k} takes the time {duration:.6g}: two impacts have changed order"
    crossed = {place for place, here in gaps.items() if here.gap < -play * sizes[here.contact]}
    fastest = float(np.abs(parts.rate).max())
    for k, (contact, side) in enumerate(impacts):
        at_once = durations[k] <= shortest and side * parts.rate[k] < -play * fastest
        if at_once or (side * parts.rate[k] < 0.0 and (contact, side, k) in crossed):
            stop = f"the {'upper' if side > 0 else 'lower'} stop of contact {contact}"
            return f"impact {k} reaches {stop} from behind, at {abs(parts.rate[k]):.6g}"
    return str(min(gaps[place] for place in crossed)) if crossed else ""
