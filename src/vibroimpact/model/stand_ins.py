"""Stops at the place of another one.

Method      Where rows are proportional and limits and motions are so, too, every motion strikes both stops at once. By
            (T19) the larger restitution decides; by the law "sequential" the contact of the lower number. The
            other stop never acts.
Accuracy    numbers are proportional if they are so but for rounding
Reference   (T19), theory.md, "Several contacts at once"
"""

from __future__ import annotations

import math

from vibroimpact.model.dashpots import vanishes
from vibroimpact.model.harmonic import by_frequency
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import Stop


def stand_ins(m: Mechanism) -> dict[Stop, Stop]:
    """Stops that never act, and of each the one at the same place that decides in its stead."""
    stops = [
        Stop(i, side)
        for i, contact in enumerate(m.rigid_stops)
        for side, limit in ((-1, contact.lower), (1, contact.upper))
        if not math.isinf(limit)
    ]
    found: dict[Stop, Stop] = {}
    for k, one in enumerate(stops):
        same = [one, *(other for other in stops[k + 1 :] if _at_one_place(m, one, other))]
        if one not in found and len(same) > 1:
            decides = one
            if m.impact_law == "moreau":
                decides = max(same, key=lambda stop: stop.restitution(m.rigid_stops))
            found |= {stop: decides for stop in same if stop != decides}
    return found


def _at_one_place(m: Mechanism, one: Stop, other: Stop) -> bool:
    """Whether two stops of two contacts bound the same motions."""
    if one.contact == other.contact:
        return False
    numbers, frequencies = [], []
    for stop in (one, other):
        contact = m.rigid_stops[stop.contact]
        lines = by_frequency(contact.motion)
        omegas = sorted(lines)
        amplitudes = [x for w in omegas for x in (*lines[w].sine, *lines[w].cosine)]
        numbers.append([*contact.row, stop.limit(m.rigid_stops), *amplitudes])
        frequencies.append(omegas)
    j = max(range(m.degrees), key=lambda k: abs(numbers[0][k]))
    ratio = numbers[1][j] / numbers[0][j]
    return (
        one.side * other.side * ratio > 0.0
        and frequencies[0] == frequencies[1]
        and all(vanishes([ratio * x, -y]) for x, y in zip(*numbers, strict=True))
    )
