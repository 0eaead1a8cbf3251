"""Near returns: parts of a motion that nearly close, without repetition.

A loop is a sequence of impacts over whole forcing cycles with the state after each impact; the
impact at which it begins does not matter. With elements the changes of their states belong to it; a
motion that meets no stop has loops of these changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from vibroimpact._core.types import Flags, Floats, Integers
from vibroimpact.compile.prescribed import FORCE_WATCH
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import mechanism_of
from vibroimpact.model.translations import Translations
from vibroimpact.orbits.closing_segment import (
    Events,
    events_of,
    flights_of,
    in_order,
)
from vibroimpact.orbits.find import Guess
from vibroimpact.orbits.problem import Flight, Signature, forcing_repeats, resisted_translations
from vibroimpact.orbits.simultaneous import together
from vibroimpact.simulation.simulate import COUNTED, Run, Status

Loop = tuple[Signature, Guess]
Key = tuple[int, tuple[Stop, ...], tuple[Flight, ...]]


def unprescribed(run: Run) -> Flags:
    """Mask of the events that no signature describes."""
    found: Flags = together(run) | (run.status == Status.NON_UNIQUE)
    return found


def loops_of(run: Run, cycles: int, impacts: int, widths: Floats, coarse: float) -> list[Loop]:
    """Parts of a run that close to ``coarse``, the most nearly closed first.

    Left out are those that have no signature: contacts that move each other are struck at once, the law leaves a state
    open, rest on a stop begins without an impact.

    Parameters
    ----------
    run
        A simulated motion.
    cycles, impacts
        Bounds; ``cycles`` counts only where there is forcing. A part without impacts begins with the
        change of state of the least number of its kind; ``impacts`` bounds changes of this kind.
    widths
        Units of distances of (x, v), shape (2n,).
    coarse
        The largest distance of the ends, in widths and in forcing cycles.
    """
    m = mechanism_of(run.system)
    events = events_of(run)
    states, times = resisted_translations(m).relative(events.states), events.times
    blocked = np.cumsum(unprescribed(run))[events.last]
    turns = times * (m.omega / (2.0 * math.pi))
    allowed = [k for k in range(1, cycles + 1) if forcing_repeats(m, k)] if m.forces else [0]
    kinds, struck = _kinds(events), np.isin(run.status[events.first], COUNTED)
    found: list[tuple[float, int, int, int]] = []
    for at in _groups(struck, kinds):
        for count in range(1, min(impacts, len(at) - 1) + 1):
            i, j = at[:-count], at[count:]
            elapsed = turns[j] - turns[i]
            whole = np.rint(elapsed)
            apart = np.abs(states[j, :-1] - states[i, :-1]) / widths
            distance = np.maximum(apart.max(axis=1), np.abs(elapsed - whole))
            closes = (distance <= coarse) & np.isin(whole, allowed)
            closes &= (kinds[j] == kinds[i]) & (blocked[j] == blocked[i])
            found += [
                (distance[k], int(j[k] - i[k]), int(i[k]), int(whole[k]))
                for k in np.flatnonzero(closes)
                if struck[i[k]] or kinds[i[k]] == kinds[i[k] : j[k]].min()
            ]
    cut = _cutter(run, events)
    loops = (cut(i, i + length, whole) for _distance, length, i, whole in sorted(found))
    return [loop for loop in loops if loop is not None]


def _kinds(events: Events) -> Integers:
    """Number of the kind of each event: its contact or element, its side, the mode after it."""
    rows = [(*stop, code) for stop, code in zip(events.stops, events.codes, strict=True)]
    _, kinds = np.unique(np.array(rows).reshape(-1, 3), axis=0, return_inverse=True)
    return kinds.ravel()


def _groups(struck: Flags, kinds: Integers) -> list[Integers]:
    """Events among which parts begin and end.

    The impacts; and, between two impacts, the changes of state of each kind.
    """
    groups = [np.flatnonzero(struck)]
    changes = np.flatnonzero(~struck)
    if changes.size:
        keys = np.column_stack([np.cumsum(struck), kinds])[changes]
        _, group = np.unique(keys, axis=0, return_inverse=True)
        order = np.argsort(group.ravel(), kind="stable")
        sizes = np.bincount(group.ravel())
        groups += np.split(changes[order], np.cumsum(sizes)[:-1])
    return groups


def _cutter(run: Run, events: Events) -> Callable[[int, int, int], Loop | None]:
    """Function that cuts the part from an event to another of a run.

    With elements, and with rest on stops, it gives None where the part has no signature.
    """
    m = mechanism_of(run.system)
    before_last = slice(0, len(events.times) - 1)
    codes = events.codes[before_last]
    several = any(codes) or bool(m.switching and codes)
    flights = flights_of(run, events, before_last) if several else []

    def cut(i: int, j: int, whole: int) -> Loop | None:
        durations, here = np.diff(events.times[i : j + 1]), flights[i:j]
        if several and (
            None in here or not in_order(events, i, j) or (events.status[i:j] == Status.STICK).any()
        ):
            return None
        passed = (
            tuple(flight for flight in here if flight) if m.switching or any(codes[i:j]) else ()
        )
        signature = Signature(tuple(events.stops[i:j]), whole, False, passed)
        return signature, Guess(events.states[i:j], durations)

    return cut


@lru_cache(maxsize=4096)
def beginnings(impacts: tuple[Stop, ...], flights: tuple[Flight, ...] = ()) -> tuple[int, ...]:
    """Indices at which a sequence begins its first rotation in order, upper stops before lower.

    With elements the flights after the impacts decide between equal sequences. One that rests on a stop
    begins after a release.
    """
    turned = [stop.opposite for stop in impacts]
    around: list[Any] = list(zip(turned, flights, strict=True)) if flights else [*turned]
    watches = [flight.watch for flight in flights]
    if FORCE_WATCH in watches:
        around = [(watches[k - 2] != FORCE_WATCH, part) for k, part in enumerate(around)]
    rotations = [around[k:] + around[:k] for k in range(len(around))]
    first = min(rotations)
    return tuple(k for k, rotation in enumerate(rotations) if rotation == first)


class KnownLoops:
    """Set of loops, compared independently of their first impact, and of how far a machine has drifted.

    Parameters
    ----------
    widths
        Units of distances of (x, v), shape (2n,); that of phases is 2 pi.
    drifts
        Displacements along which a loop need not close.
    """

    def __init__(self, widths: Floats, drifts: Translations) -> None:
        self._widths, self._drifts = widths, drifts
        self._known: dict[Key, Floats] = {}

    def add(self, signature: Signature, states: Floats) -> None:
        """Add a loop by the states after its impacts, shape (m, 2n + 1)."""
        first = beginnings(signature.impacts, signature.flights)[0]
        key, loop = _key(signature, first), self._scaled(np.roll(states, -first, axis=0))[None]
        self._known[key] = np.vstack([self._known[key], loop]) if key in self._known else loop

    def has(self, signature: Signature, states: Floats, within: float) -> bool:
        """Whether a loop is within a distance of a known one."""
        first = beginnings(signature.impacts, signature.flights)
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
        relative = self._drifts.relative(states)
        return np.column_stack([relative[:, :-1] / self._widths, phase])


def _key(signature: Signature, first: int) -> Key:
    impacts, flights = signature.impacts, signature.flights
    around = impacts[first:] + impacts[:first], flights[first:] + flights[:first]
    return signature.cycles, *around
