"""Parts of a curve of bifurcations with one meaning: bifurcations, neutral saddles, orbits that are no motions.

Between two points of the curve of different meaning the change is at the special point there, a touch or a strong
resonance; where none was found the part that is no bifurcation is the longer one.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vibroimpact._core.codes import NamedCode
from vibroimpact._core.types import Floats, Integers
from vibroimpact.bifurcations.curve import BifurcationCurve

# A special point that is so near, in scaled arclength, is a point of the curve.
SAME_ARCLENGTH = 1e-12


class Meaning(NamedCode):
    """Meaning of a part of a curve; of two, the larger one holds."""

    BIFURCATION = 0
    INADMISSIBLE = 1
    NEUTRAL = 2


class Stretch(NamedTuple):
    """Part of a curve with one meaning."""

    meaning: Meaning  # of all of it
    values: Floats  # both parameters along it, ends included, shape (k, 2)


def stretches(curve: BifurcationCurve) -> list[Stretch]:
    """Parts of a curve in order; each begins where the one before ends."""
    meanings = np.where(curve.neutral, Meaning.NEUTRAL, ~curve.admissible * Meaning.INADMISSIBLE)
    places = [
        (float(s), int(m), v)
        for s, m, v in zip(curve.curve.arclength, meanings, curve.values, strict=True)
    ]
    nodes = curve.curve.arclength
    for point in curve.special_points:
        if np.abs(nodes - point.arclength).min() > SAME_ARCLENGTH:
            at = np.array([point.parameters[name] for name in curve.names])
            places.append((point.arclength, -1, at))
    places.sort(key=lambda place: place[0])
    own = np.array([meaning for _, meaning, _ in places])
    values = np.array([at for _, _, at in places])
    between = _between(own)
    breaks = [0, *(np.flatnonzero(np.diff(between)) + 1).tolist(), len(between)]
    return [
        Stretch(Meaning(between[first]), values[first : last + 1])
        for first, last in pairwise(breaks)
        if last > first
    ]


def _between(own: Integers) -> Integers:
    """Meaning between each two neighbours; at special points, where it is -1, that of the other neighbour counts."""
    found: Integers = np.maximum(own[:-1], own[1:])
    for k in np.flatnonzero(found < 0):  # between two special points
        sides = [own[:k][own[:k] >= 0][-1:], own[k + 1 :][own[k + 1 :] >= 0][:1]]
        found[k] = max(np.concatenate(sides))
    return found
