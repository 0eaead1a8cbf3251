"""First guess of a circle from a long motion, or from the iterates of a formula.

Method      The events in order, impacts and changes of state with the modes that follow, repeat a shortest word;
            its cycles are the mean advance of the phase per word, a whole number of turns       (1)
            It begins with an impact, at an upper stop if there is one; without impacts with any event, of
            those that reset the state only where there is no other.
            The states after every word (every half word and its mirror image, where the word's
            second half is the first with the sides exchanged) are iterates x_n of the full map
            (of the half map), the phase less the cycles passed                                  (2)
            Where they lie on k closed curves, which the map visits in turn, the k-th iterate
            has each of them as its circle                                                       (3)
            With their rotation number rho by weighted averages (attractors/rotation.py),
                c_k = sum_n w_n x_n exp(-2 pi i k n rho)                                         (4)
Assumes     a motion that has settled on a smooth circle
Accuracy    (4) converges faster than any power of the number of iterates
Fails       a sentence: no such word, periodic (locked) motion, no smooth closed curve
Reference   [das2017] for (4)
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vibroimpact._core.progress import counting
from vibroimpact._core.types import Floats
from vibroimpact.attractors.point_sets import InvariantSet, Kind, classify_points
from vibroimpact.attractors.rotation import weights
from vibroimpact.compile.prescribed import NONE_LEFT_OUT, compile_prescribed
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.orbits.closing_segment import (
    ALONE,
    AT_ONCE,
    OPEN,
    TOGETHER,
    Events,
    events_of,
    flights_of,
)
from vibroimpact.orbits.problem import (
    Flight,
    Signature,
    forcing_repeats,
    impacting,
    least_cycles,
    oddness,
)
from vibroimpact.orbits.simultaneous import together
from vibroimpact.simulation.simulate import GOES_ON, Run, Status
from vibroimpact.simulation.simulator import Simulator
from vibroimpact.tori.fourier import values_of
from vibroimpact.tori.maps import CircleMap, FormulaMap, impact_map
from vibroimpact.tori.solve import FEWEST_NODES, Trial

LONGEST_WORD = 64  # events
MOST_WORDS = 16  # until the forcing repeats
# A mean advance of the phase that is so near to a whole number of turns is one.
WHOLE_TURNS_WITHIN = 1e-3
MOST_SETTLINGS = 4  # so many attempts are made, each after four times as many iterates
GUESSED_OF_LARGEST = 1e-6  # smaller harmonics, relative to the largest, are left to Newton's method
MOST_HARMONICS = 127
# Beyond the first harmonics that are so small, those k with k rho near a whole number grow again: a
# slow beat, which the average does not remove. Symmetric curves lack every second harmonic.
NEIGHBOURS = 4


class Started(NamedTuple):
    """Guess of a circle, or the reason why there is none."""

    map: CircleMap | None
    signature: Signature | None
    trial: Trial | None
    status: str = ""


def nothing(status: str, signature: Signature | None = None) -> Started:
    """Return no guess, with the reason."""
    return Started(None, signature, None, status)


# ---- motions of machines -------------------------------------------------------------------------


def from_motion(
    system: System,
    start: State,
    given: Signature | None,
    symmetric: bool | None,
    settle_iterates: int,
    points: int,
) -> Started:
    """Guess from a motion, settled for so many iterates, from so many iterates of the map.

    Without a given signature, that of the motion; ``symmetric`` False leaves out its symmetry.
    """
    motion, found = Simulator(system, start), nothing("")
    word = len(given.impacts) if given else 2
    for _ in range(MOST_SETTLINGS):
        end = motion.settle(settle_iterates * word)
        if end not in GOES_ON:
            return nothing(f"the motion does not go on: {end.sentence}")
        record = _recorded(motion.run(points * word + LONGEST_WORD))
        settle_iterates *= 4
        signature = given or signature_of(record)
        if isinstance(signature, str):
            found = nothing(signature)
            continue  # a motion that has not settled may have other events
        if symmetric is False:
            signature = replace(signature, symmetric=False)
        if len(signature.solved) > word:
            word = len(signature.solved)
            record = _recorded(motion.run(points * word + LONGEST_WORD))
        found, settled = _from_record(record, signature)
        if settled:
            break
    return found


class Record(NamedTuple):
    """A settled motion and its events."""

    run: Run
    events: Events


def _recorded(run: Run) -> Record:
    return Record(run, events_of(run))


def signature_of(record: Record) -> Signature | str:
    """Signature (1) of a recorded motion, as its own mirror image if it can be; or a reason."""
    m, events = mechanism_of(record.run.system), record.events
    if record.run.end not in GOES_ON:
        return f"the motion does not go on: {record.run.end.sentence}"
    if not forcing_repeats(m, least_cycles(m)):
        return "the forcing frequencies have no common period: there is no one map"
    if why := _not_smooth(record):
        return f"its map is not smooth: {why}"
    symbols = np.column_stack([events.stops, events.status, events.codes])
    for length in range(1, min(LONGEST_WORD, len(symbols) // 2) + 1):
        if (symbols[length:] == symbols[:-length]).all():
            break
    else:
        return (
            f"the events follow no word of up to {LONGEST_WORD}: the order of its events changes along the motion, so "
            "that there is no one map, which would be smooth"
        )
    turns = events.states[:, -1] / (2.0 * math.pi)
    for repeats in range(1, min(MOST_WORDS, (len(turns) - 1) // length) + 1):
        advance = _mean_advance(turns, length * repeats) if m.forces else 0.0
        cycles = round(advance)
        near = abs(advance - cycles) <= WHOLE_TURNS_WITHIN
        if near and (cycles or not m.forces) and forcing_repeats(m, cycles):
            break
    else:
        return (
            f"the phase of the forcing advances by {_mean_advance(turns, length):.6g} turns per word of {length} "
            "events, not by a whole number: the circle winds around the phase, which is not solved"
        )
    flights = _flights(record, length)
    if flights is None:
        return f"its map is not smooth: {AT_ONCE}"
    once = Signature(tuple(events.stops[:length]), cycles, False, flights)
    whole = once.rolled(_beginning(record.run.system, once)).repeated(repeats)
    around, half = whole.impacts, len(whole.impacts) // 2
    symmetric = (
        len(around) % 2 == 0
        and around[half:] == tuple(stop.opposite for stop in around[:half])
        and not flights
        and not oddness(m, cycles)
    )
    return replace(whole, cycles=cycles, symmetric=symmetric)


def _mean_advance(turns: Floats, count: int) -> float:
    """Mean advance of the phase in so many events, over a whole number of times as many."""
    last = (len(turns) - 1) // count * count
    return float(turns[last] - turns[0]) * count / last


def _not_smooth(record: Record) -> str:
    """Reason why a motion has no smooth map; "" where none is seen."""
    run, events = record
    if (run.status == Status.NON_UNIQUE).any():
        return OPEN
    if (events.status == Status.STICK).any():
        return ALONE
    if together(run).any():
        return TOGETHER
    return AT_ONCE if (np.diff(events.times) <= 0.0).any() else ""


def _flights(record: Record, length: int) -> tuple[Flight, ...] | None:
    """Flights of the first word; none where nothing but rigid stops is met, None where no guard ends one."""
    if not mechanism_of(record.run.system).switching and not any(record.events.codes[:length]):
        return ()
    found = flights_of(record.run, record.events, slice(0, length))
    return None if None in found else tuple(flight for flight in found if flight)


def _beginning(system: System, word: Signature) -> int:
    """Number of the event with which the map begins."""
    codes = tuple(sorted({flight.mode for flight in word.flights})) or (0,)
    compiled, struck = compile_prescribed(system, "", codes), impacting(mechanism_of(system), word)

    def later(k: int) -> tuple[bool, bool, bool]:
        resets = compiled.solved_coordinate(word.rolled(k).first) == NONE_LEFT_OUT
        return resets, not struck[k], word.impacts[k].side < 0

    return min(range(len(word.impacts)), key=later)


def _from_record(record: Record, signature: Signature) -> tuple[Started, bool]:
    """Guess (2) to (4) from a record, and whether the motion had settled."""
    rows = _iterates(record, signature)
    if rows is None:
        return nothing(f"the events of the motion do not follow {signature.impacts}"), True
    states, times = rows
    impacting = impact_map(record.run.system, signature, _sizes(states), states[0])
    points = impacting.coordinates(states)
    kind = classify_points(points / impacting.sizes)
    if kind.kind is not Kind.QUASIPERIODIC or kind.curve is None:
        return nothing(_no_circle(kind), signature), kind.settled
    k = kind.pieces
    if k > 1:
        symmetric = signature.symmetric and k % 2 == 1
        if signature.symmetric and not symmetric:
            k //= 2
        return _from_record(record, replace(signature.repeated(k), symmetric=symmetric))
    trial = averaged(points, times, kind.curve.rotation.value, 0.0)
    return Started(impacting, signature, trial), kind.settled


def _sizes(states: Floats) -> Floats:
    """Size of every entry of (x, v, theta): of places, of velocities, and 1 for the phase."""
    n = states.shape[1] // 2
    place, speed = np.abs(states[:, :n]).max(), np.abs(states[:, n : 2 * n]).max()
    return np.concatenate([np.full(n, place or 1.0), np.full(n, speed or 1.0), [1.0]])


def _iterates(record: Record, signature: Signature) -> tuple[Floats, Floats] | None:
    """States (2) at the beginning of every word and the flight times that follow; None for another word."""
    events, solved = record.events, len(signature.solved)
    modes = [flight.mode for flight in signature.flights] or [0] * len(signature.impacts)
    word = list(zip(signature.impacts, modes, strict=True))
    passed = list(zip(events.stops, events.codes, strict=True))
    begin = next((i for i in range(len(word)) if passed[i : i + len(word)] == word), None)
    if begin is None:
        return None
    count = (len(passed) - begin - 1) // solved
    expected = (word * (len(passed) // len(word) + 2))[: count * solved]
    if passed[begin : begin + count * solved] != expected:
        return None
    flights = np.diff(events.times[begin:])[: count * solved].reshape(count, solved)
    starts = np.arange(count)
    states = events.states[begin:][starts * solved]
    n = states.shape[1] // 2
    share = 2.0 * math.pi * signature.cycles * (0.5 if signature.symmetric else 1.0)
    states[:, -1] -= share * starts
    states[:, -1] -= 2.0 * math.pi * math.floor(states[:, -1].mean() / (2.0 * math.pi))
    if signature.symmetric:
        states[:, : 2 * n] *= ((-1.0) ** starts)[:, None]
    return states, flights


def _no_circle(kind: InvariantSet) -> str:
    if kind.kind is Kind.PERIODIC:
        return f"the motion is periodic after {kind.period} iterates: no circle, or a locked one"
    return f"the iterates lie on no smooth circle: {kind.reason or kind.kind.value}"


# ---- formulas ------------------------------------------------------------------------------------


def from_iterates(
    formula: ExplicitMap, x: Floats, p: float, settle_iterates: int, points: int
) -> Started:
    """Guess from the iterates of a formula."""
    circle_map = FormulaMap(formula)
    found = nothing("")
    for _ in range(MOST_SETTLINGS):
        orbit = np.empty((points, formula.dimension))
        for _ in counting("settle_iterates", settle_iterates):
            x = formula(x, p)
        for i in range(points):
            orbit[i] = x = formula(x, p)
        if not np.isfinite(orbit).all():
            return nothing("the iterates go to infinity")
        kind = classify_points(orbit / circle_map.sizes)
        if kind.kind is Kind.QUASIPERIODIC and kind.curve is not None and kind.pieces == 1:
            none = np.empty((points, 0))
            trial = averaged(orbit, none, kind.curve.rotation.value, p)
            found = Started(circle_map, None, trial)
        elif kind.pieces > 1:
            found = nothing(
                f"the iterates lie on {kind.pieces} closed curves: take iterate="
                f"{kind.pieces * formula.iterate} for one of them"
            )
        else:
            found = nothing(_no_circle(kind))
        if kind.settled:
            return found
        settle_iterates = max(4 * settle_iterates, points)
    return found


# ---- averages ------------------------------------------------------------------------------------


def averaged(points: Floats, times: Floats, rho: float, p: float) -> Trial:
    """Curve (4) through iterates in the order of the map, with as many nodes as are needed."""
    both = np.column_stack([points, times])
    n = np.arange(len(both))
    w = weights(len(both))
    k = np.arange(MOST_HARMONICS + 1)
    c = np.empty((len(k), both.shape[1]), dtype=np.complex128)
    for i in k:
        c[i] = (w * np.exp(-2j * np.pi * i * rho * n)) @ both
    size = np.abs(c[:, : points.shape[1]]).max(axis=1)
    size[0] = 0.0
    near = np.array([size[i : i + NEIGHBOURS].max() for i in k])
    below = np.flatnonzero(near[1:] <= GUESSED_OF_LARGEST * size.max())
    top = int(below[0]) if below.size else MOST_HARMONICS
    count = max(FEWEST_NODES, 2 * min(int(1.3 * top) + 1, MOST_HARMONICS) + 1)
    curve = values_of(c, count)
    d = points.shape[1]
    return Trial(curve[:, :d], rho, p, curve[:, d:])
