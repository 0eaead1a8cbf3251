"""Closing loop of a motion: the impacts that repeat at its end, and their forcing cycles.

Method      Over the last impacts, the shortest part that ends where it began: within CLOSED of
            the motion's spread, of up to LONGEST impacts; else the nearest within NEARLY_CLOSED, of
            up to LONGEST_NEARLY. Where the sequence is given, its last occurrence in the motion,
            closed or not.
Fails       a sentence: no such part; in its last period a contact rests, or several impact at
            once
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import Run, RunEnd, Status

NEARLY_CLOSED = 0.25  # of the spread of a motion: a loop that Newton's method may close
CLOSED = 1e-5  # the same for a settled periodic motion
LONGEST, LONGEST_NEARLY = 512, 60  # impacts of a loop, at most
REST = (Status.CHATTER, Status.STICK, Status.RELEASE)
TOGETHER = "several contacts impact at once in every period: such orbits have no signature"
RESTING = "the motion chatters or sticks in every period: such orbits have no signature"


class ClosingLoop(NamedTuple):
    """Impacts of a loop, forcing cycles, states after impacts (m, 2n + 1), flight times (m,)."""

    impacts: tuple[Stop, ...]
    cycles: int
    states: Floats
    durations: Floats


def segments_of(run: Run) -> tuple[Floats, Floats, list[Stop]]:
    """States after the impacts (m, 2n + 1) with growing phase, times, stops of a run's impacts."""
    at = np.flatnonzero(run.status == Status.IMPACT)
    omega = mechanism_of(run.system).omega
    phase = run.start.phase + omega * run.time[at]
    states = np.column_stack([run.position[at], run.velocity_after[at], phase])
    sides = np.where(run.stop[at] == 0, 1, -1)
    stops = map(Stop, run.contact[at].tolist(), sides.tolist())
    return states, run.time[at], list(stops)


def cycles_of(system: System, span: float) -> int:
    """Whole forcing cycles nearest to a time, at least 1; 0 where there is no forcing."""
    omega = mechanism_of(system).omega
    return max(1, round(span * omega / (2.0 * math.pi))) if omega else 0


def closing_loop(
    run: Run, sequence: tuple[Stop, ...] | None, cycles: int | None
) -> ClosingLoop | str:
    """Find the loop at the end of a run; return a sentence if there is none.

    Parameters
    ----------
    run
        A simulated motion.
    sequence
        Required impacts; None for any.
    cycles
        Required forcing cycles; None for any.
    """
    states, times, stops = segments_of(run)
    found = _nearest_loop(run, cycles) if sequence is None else _last_time(stops, sequence)
    if found is None:
        wanted = f"with the impacts {sequence}" if sequence else "that closes nearly"
        since = times[-LONGEST_NEARLY - 1] if len(times) > LONGEST_NEARLY else 0.0
        why = "" if run.end is RunEnd.SILENT else _without_signature(run, since, math.inf)
        return why or f"the run has no loop {wanted}: {run.end.sentence}"
    first, last = found
    whole = cycles_of(run.system, times[last] - times[first]) if cycles is None else cycles
    omega = mechanism_of(run.system).omega
    period = 2.0 * math.pi * whole / omega if omega else 0.0
    why = _without_signature(run, min(times[first], times[last] - period), times[last])
    if why:
        return why
    durations = np.diff(times[first : last + 1])
    return ClosingLoop(tuple(stops[first:last]), whole, states[first:last], durations)


def _without_signature(run: Run, since: float, until: float) -> str:
    """Reason why a part of a run has no signature: contacts rest, or several impact at once."""
    status = run.status[(run.time >= since) & (run.time <= until)]
    if np.isin(status, REST).any():
        return RESTING
    return TOGETHER if (status == Status.SIMULTANEOUS).any() else ""


def _nearest_loop(run: Run, cycles: int | None) -> tuple[int, int] | None:
    """(first, last) impact of the shortest good loop at the end of a run."""
    states, times, stops = segments_of(run)
    omega, last = mechanism_of(run.system).omega, len(stops) - 1
    if last < 1:
        return None
    spread = np.ptp(states[:, :-1], axis=0) + np.abs(states[:, :-1]).max() * 1e-9
    best: tuple[float, int] | None = None
    for first in range(last - 1, max(-1, last - LONGEST - 1), -1):
        if stops[first] != stops[last]:
            continue
        distance = float(np.abs((states[last] - states[first])[:-1] / spread).max())
        span = float(times[last] - times[first])
        whole = cycles_of(run.system, span) if cycles is None else cycles
        distance = max(distance, abs(span * omega / (2.0 * math.pi) - whole)) if omega else distance
        if distance < CLOSED:
            return first, last  # longer loops repeat this one
        near = distance < NEARLY_CLOSED and last - first <= LONGEST_NEARLY
        if near and (best is None or distance < best[0]):
            best = distance, first
    return (best[1], last) if best else None


def _last_time(stops: list[Stop], sequence: tuple[Stop, ...]) -> tuple[int, int] | None:
    """(first, last) impact of the last occurrence of a sequence followed by its first stop."""
    count, wanted = len(sequence), [*sequence, *sequence[:1]]
    begins = [k for k in range(len(stops) - count) if stops[k : k + count + 1] == wanted]
    return (begins[-1], begins[-1] + count) if begins else None
