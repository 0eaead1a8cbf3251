"""Near returns: parts of a motion that nearly close, without repetition.

A loop is a sequence of impacts over whole forcing cycles with the state after each impact; the
impact at which it begins does not matter.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.closing_segment import segments_of
from vibroimpact.orbits.find import Guess
from vibroimpact.orbits.problem import Signature, forcing_repeats
from vibroimpact.simulation.simulate import Run, Status

Loop = tuple[Signature, Guess]

NOT_FREE = (Status.CHATTER, Status.STICK, Status.RELEASE, Status.SIMULTANEOUS)


def loops_of(run: Run, cycles: int, impacts: int, widths: Floats, coarse: float) -> list[Loop]:
    """Parts of a run that close to ``coarse``, the most nearly closed first.

    Parameters
    ----------
    run
        A simulated motion.
    cycles, impacts
        Bounds; ``cycles`` counts only where there is forcing.
    widths
        Units of distances of (x, v), shape (2n,).
    coarse
        The largest distance of the ends, in widths and in forcing cycles.
    """
    m = mechanism_of(run.system)
    states, times, stops = segments_of(run)
    rests = np.cumsum(np.isin(run.status, NOT_FREE))[run.status == Status.IMPACT]
    number = np.array([2 * contact + side for contact, side in stops])
    turns = times * (m.omega / (2.0 * math.pi))
    allowed = [k for k in range(1, cycles + 1) if forcing_repeats(m, k)] if m.forces else [0]
    found: list[tuple[float, int, int, int]] = []
    for count in range(1, min(impacts, len(times) - 1) + 1):
        elapsed = turns[count:] - turns[:-count]
        whole = np.rint(elapsed)
        apart = np.abs(states[count:, :-1] - states[:-count, :-1]) / widths
        distance = np.maximum(apart.max(axis=1), np.abs(elapsed - whole))
        closes = (distance <= coarse) & np.isin(whole, allowed)
        closes &= (number[count:] == number[:-count]) & (rests[count:] == rests[:-count])
        found += [(distance[i], count, int(i), int(whole[i])) for i in np.flatnonzero(closes)]
    return [
        (
            Signature(tuple(stops[i : i + count]), whole),
            Guess(states[i : i + count], np.diff(times[i : i + count + 1])),
        )
        for _distance, count, i, whole in sorted(found)
    ]


@lru_cache(maxsize=4096)
def beginnings(impacts: tuple[Stop, ...]) -> tuple[int, ...]:
    """Indices at which a sequence begins its first rotation in order, upper stops before lower."""
    around = [stop.opposite for stop in impacts]
    rotations = [around[k:] + around[:k] for k in range(len(around))]
    first = min(rotations)
    return tuple(k for k, rotation in enumerate(rotations) if rotation == first)


class KnownLoops:
    """Set of loops, compared independently of their first impact.

    Parameters
    ----------
    widths
        Units of distances of (x, v), shape (2n,); that of phases is 2 pi.
    """

    def __init__(self, widths: Floats) -> None:
        self._widths = widths
        self._known: dict[tuple[int, tuple[Stop, ...]], Floats] = {}

    def add(self, signature: Signature, states: Floats) -> None:
        """Add a loop by the states after its impacts, shape (m, 2n + 1)."""
        first = beginnings(signature.impacts)[0]
        key, loop = _key(signature, first), self._scaled(np.roll(states, -first, axis=0))[None]
        self._known[key] = np.vstack([self._known[key], loop]) if key in self._known else loop

    def has(self, signature: Signature, states: Floats, within: float) -> bool:
        """Whether a loop is within a distance of a known one."""
        first = beginnings(signature.impacts)
        known = self._known.get(_key(signature, first[0]))
        if known is None:
            return False
        here = self._scaled(states)
        for k in first:
            apart = np.abs(known - np.roll(here, -k, axis=0))
            apart[..., -1] = np.minimum(apart[..., -1], 1.0 - apart[..., -1])  # of a turn
            if np.any(apart.max(axis=(1, 2)) <= within):
                return True
        return False

    def _scaled(self, states: Floats) -> Floats:
        phase = states[:, -1] / (2.0 * math.pi) % 1.0
        return np.column_stack([states[:, :-1] / self._widths, phase])


def _key(signature: Signature, first: int) -> tuple[int, tuple[Stop, ...]]:
    impacts = signature.impacts
    return signature.cycles, impacts[first:] + impacts[:first]
