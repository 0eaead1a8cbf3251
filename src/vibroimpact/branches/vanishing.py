"""Flights of soft stops and friction that last no time: where the sequence of an orbit changes.

Method      A flight that begins and ends with the same element has the time t_k. Where t_k vanishes at a
            closing rate that vanishes, too, the element is only touched: the orbit grazes, and beyond it
            none has this sequence. The equations of problem.py have a branch point there, since a flight
            of no time may be put into any crossing; it is no bifurcation.                       (1)
            Elsewhere a state of the element is passed over: two events coincide.                (2)
            Where a closing rate vanishes alone the orbit grazes as well: beyond it the limit would be
            reached from behind, as the orbits with which these meet cross it no longer.          (3)
Accuracy    that of the zeros of t_k
Reference   theory.md, "Branches"
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vibroimpact.branches.family import rests_of
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.maps import NO_TIME_OF_PERIOD
from vibroimpact.orbits.orbit import Orbit


def passing(orbit: Orbit) -> Iterator[int]:
    """Numbers of the solved flights that begin and end with the same element."""
    rigid, signature = len(orbit.mechanism.rigid_stops), orbit.signature
    for k, end in enumerate(signature.ends):
        if end.contact >= rigid and signature.impacts[k].contact == end.contact:
            yield k


def passed_over(orbit: Orbit) -> str:
    """Reason why the sequence of an orbit has ended; "" where it goes on."""
    shortest = -NO_TIME_OF_PERIOD * float(np.abs(orbit.durations).sum())
    rigid = len(orbit.mechanism.rigid_stops)
    for k in {*passing(orbit), *rests_of(orbit.mechanism, orbit.signature)}:
        if orbit.durations[k] < shortest:
            contact = orbit.signature.ends[k].contact
            held = f"in which the stop of contact {contact} is rested on"
            what = held if contact < rigid else f"with a state of element {contact}"
            return f"flight {k}, {what}, takes no time"
    for k in orbit.from_behind:
        return (
            f"impact {k} reaches a limit of element {orbit.signature.ends[k].contact} from behind"
        )
    return ""


def rest_at(orbit: Orbit) -> bool:
    """Whether a stop is rested on, or friction sticks, for no time in an orbit."""
    longest = NO_TIME_OF_PERIOD * float(np.abs(orbit.durations).sum())
    return any(
        abs(orbit.durations[k]) <= longest for k in rests_of(orbit.mechanism, orbit.signature)
    )


def touch_at(orbit: Orbit) -> Nearest | None:
    """The touch (1) of an orbit in which a flight lasts no time; None where there is none."""
    longest = NO_TIME_OF_PERIOD * float(np.abs(orbit.durations).sum())
    rests = rests_of(orbit.mechanism, orbit.signature)
    for k in passing(orbit):
        if k in rests:
            continue  # as long as it lasts the rates of its guards vanish with it
        before, ends = k - 1, orbit.signature.ends
        still = before in orbit.rateless or before + len(ends) in orbit.rateless
        if abs(orbit.durations[k]) <= longest and still:
            contact, side, _, watch = ends[before]
            count, time = before % len(ends), float(orbit.durations[before])
            return Nearest(0.0, contact, side, count, time, watch=watch)
    return None
