"""First guess of a circle from a long motion, or from the iterates of a formula.

Method      The stops of the impacts, in order, repeat a shortest word; its cycles are the mean
            advance of the phase per word, a whole number of turns                               (1)
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
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.orbits.problem import Signature, forcing_repeats, oddness
from vibroimpact.simulation.simulate import RunEnd, Status
from vibroimpact.simulation.simulator import Impacts, Simulator
from vibroimpact.tori.fourier import values_of
from vibroimpact.tori.maps import CircleMap, FormulaMap, impact_map
from vibroimpact.tori.solve import FEWEST_NODES, Trial

LONGEST_WORD = 64  # impacts
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
        if end is not RunEnd.IMPACTS:
            return nothing(f"the motion does not go on impacting: {end.sentence}")
        record = motion.record(points * word + LONGEST_WORD)
        if why := _irregular(record):
            return nothing(why)
        signature = given or signature_of(record, mechanism_of(system))
        if isinstance(signature, str):
            return nothing(signature)
        if symmetric is False:
            signature = replace(signature, symmetric=False)
        if len(signature.solved) > word:
            word = len(signature.solved)
            record = motion.record(points * word + LONGEST_WORD)
        found, settled = _from_record(system, record, signature)
        if settled:
            return found
        settle_iterates *= 4
    return found


def _irregular(record: Impacts) -> str:
    if record.end is not RunEnd.IMPACTS:
        return f"the motion does not go on impacting: {record.end.sentence}"
    if record.sticks or (record.status != Status.IMPACT).any():
        return "the motion chatters, sticks or has several impacts at once: its map is not smooth"
    return ""


def signature_of(record: Impacts, m: Mechanism) -> Signature | str:
    """Signature (1) of a recorded motion, as its own mirror image if it can be; or a reason."""
    stops = np.column_stack([record.contact, record.side])
    for length in range(1, LONGEST_WORD + 1):
        if (stops[length:] == stops[:-length]).all():
            break
    else:
        return f"the impacts follow no word of up to {LONGEST_WORD} stops: there is no one map"
    turns = _turns(record, m)
    per_word = (turns[-1] - turns[0]) / (len(turns) - 1) * length
    for repeats in range(1, MOST_WORDS + 1):
        cycles = round(per_word * repeats)
        whole = abs(per_word * repeats - cycles) <= WHOLE_TURNS_WITHIN
        if whole and (cycles or not m.forces) and (not m.forces or forcing_repeats(m, cycles)):
            break
    else:
        return (
            f"the phase of the forcing advances by {per_word:.6g} turns per word of {length} "
            "impacts, not by a whole number: the circle winds around the phase, which is not solved"
        )
    begin = int(np.argmax(stops[:length, 1] > 0)) if (stops[:length, 1] > 0).any() else 0
    around = [Stop(int(c), int(s)) for c, s in stops[begin : begin + length]] * repeats
    half = len(around) // 2
    symmetric = (
        len(around) % 2 == 0
        and around[half:] == [stop.opposite for stop in around[:half]]
        and not oddness(m, cycles)
    )
    return Signature(tuple(around), cycles, symmetric)


def _turns(record: Impacts, m: Mechanism) -> Floats:
    """Turns of the first forcing line since the start, exact to rounding of the phase."""
    if not m.forces:
        return np.zeros(len(record.phase))
    phase = record.phase / (2.0 * math.pi)
    passed = m.omega * (record.time - record.time[0]) / (2.0 * math.pi) + phase[0]
    return np.asarray(phase + np.rint(passed - phase))


def _from_record(system: System, record: Impacts, signature: Signature) -> tuple[Started, bool]:
    """Guess (2) to (4) from a record, and whether the motion had settled."""
    rows = _iterates(system, record, signature)
    if rows is None:
        return nothing(f"the impacts of the motion do not follow {signature.impacts}"), True
    states, times = rows
    impacting = impact_map(system, signature, _sizes(states))
    points = impacting.coordinates(states)
    kind = classify_points(points / impacting.sizes)
    if kind.kind is not Kind.QUASIPERIODIC or kind.curve is None:
        return nothing(_no_circle(kind), signature), kind.settled
    k = kind.pieces
    if k > 1:
        symmetric = signature.symmetric and k % 2 == 1
        if signature.symmetric and not symmetric:
            k //= 2
        whole = Signature(signature.impacts * k, signature.cycles * k, symmetric)
        return _from_record(system, record, whole)
    trial = averaged(points, times, kind.curve.rotation.value, 0.0)
    return Started(impacting, signature, trial), kind.settled


def _sizes(states: Floats) -> Floats:
    """Size of every entry of (x, v, theta): of places, of velocities, and 1 for the phase."""
    n = states.shape[1] // 2
    place, speed = np.abs(states[:, :n]).max(), np.abs(states[:, n : 2 * n]).max()
    return np.concatenate([np.full(n, place or 1.0), np.full(n, speed or 1.0), [1.0]])


def _iterates(
    system: System, record: Impacts, signature: Signature
) -> tuple[Floats, Floats] | None:
    """States (2) at the beginning of every word and the flight times that follow."""
    m, solved = mechanism_of(system), len(signature.solved)
    stops = [Stop(int(c), int(s)) for c, s in zip(record.contact, record.side, strict=True)]
    word = list(signature.impacts)
    begin = next((i for i in range(len(word)) if stops[i : i + len(word)] == word), None)
    if begin is None:
        return None
    count = (len(stops) - begin - 1) // solved
    expected = (word * (len(stops) // len(word) + 2))[: count * solved]
    if stops[begin : begin + count * solved] != expected:
        return None
    n = m.degrees
    turns = _turns(record, m)[begin:]
    high, low = record.high[begin:], record.low[begin:]
    flights = np.diff(high) + np.diff(low)
    starts = np.arange(count) * solved
    share = signature.cycles * (0.5 if signature.symmetric else 1.0)
    passed = turns[starts] - share * np.arange(count)
    sign = (-1.0) ** np.arange(count) if signature.symmetric else np.ones(count)
    states = np.zeros((count, 2 * n + 1))
    states[:, :n] = sign[:, None] * record.position[begin:][starts]
    states[:, n : 2 * n] = sign[:, None] * record.velocity[begin:][starts]
    states[:, 2 * n] = 2.0 * math.pi * (passed - math.floor(passed.mean()))
    return states, flights[: count * solved].reshape(count, solved)


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
