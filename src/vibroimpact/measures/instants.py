"""Instants of a signal: its local extrema, and when it is large for the last time.

Method      In each window a signal is a Chebyshev series (flights.py). Its extrema are the zeros of
            the derivative, eigenvalues of a colleague matrix, and ends of flights at which the
            derivative changes its sign, as it does in impacts; levels are reached at zeros of the
            series less the level, or jumped over at the end of a flight.
Accuracy    of values, rounding; of instants of extrema, its square root, as values are flat there
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from vibroimpact._core.chebyshev import real_zeros_of
from vibroimpact._core.checks import memory_here, refusal
from vibroimpact._core.types import Floats
from vibroimpact._core.windows import values_at
from vibroimpact.compile.prescribed import FLAT_OF_LARGEST_RATE, WINDOW_NODES, WINDOW_RADIANS
from vibroimpact.measures.flights import Rows, Signal

BYTES_PER_COEFFICIENT = 64  # a coefficient and its derivative are kept twice while series are made
SAME_INSTANT_OF_WINDOW = 1e-6  # instants that are so near, relative to a window, are one


class Extrema(NamedTuple):
    """Local extrema of a signal in order, shape (k,) each."""

    time: Floats
    value: Floats


def check_span(name: str, value: object, rows: Rows, span: float) -> None:
    """Refuse a time over which the series of a motion would exceed the memory of this machine."""
    windows = span * rows.rate / WINDOW_RADIANS
    needed = windows * BYTES_PER_COEFFICIENT * WINDOW_NODES * (rows.size + 1)
    if not needed <= memory_here():
        raise refusal(
            name,
            value,
            f"shorter: the motion needs {needed / 1e9:.3g} GB, more than this machine has",
        )


def largest_modulus(signal: Signal) -> float:
    """Largest modulus of a signal.

    Extrema are searched for only in windows whose series may reach beyond the largest value at an
    end of a window or a flight.
    """
    w = signal.flights.windows
    inner = np.setdiff1d(np.arange(len(w.segment)), w.last)
    known = [
        np.abs(values_at(signal.series, w.last, w.ends)),
        np.abs(values_at(signal.series, np.arange(len(w.segment)), -1.0)),
        np.abs(values_at(signal.series, inner, 1.0)),
    ]
    largest = max(float(part.max(initial=0.0)) for part in known)
    some = np.flatnonzero(np.abs(signal.series).sum(axis=0) > largest)
    slope = np.asarray(chebyshev.chebder(signal.series[:, some], axis=0), dtype=float)
    at, x = real_zeros_of(slope, FLAT_OF_LARGEST_RATE)
    at, x = w.inside(some[at], x)
    return float(max(largest, np.abs(values_at(signal.series, at, x)).max(initial=0.0)))


def extrema(signal: Signal) -> Extrema:
    """Local maxima and minima of a signal, its first and last value not included."""
    w = signal.flights.windows
    slope = np.asarray(chebyshev.chebder(signal.series, axis=0), dtype=float)
    at, x = w.inside(*real_zeros_of(slope, FLAT_OF_LARGEST_RATE))
    times, values = w.times(at, x), values_at(signal.series, at, x)
    before, after = (
        values_at(slope, w.last[:-1], w.ends[:-1]),
        values_at(slope, w.first[1:], -1.0),
    )
    corner = np.flatnonzero(before * after < 0.0)
    begin = w.begun[1:][corner]
    corners = values_at(signal.series, w.first[1:][corner], -1.0)
    times, values = np.append(times, begin), np.append(values, corners)
    order = np.argsort(times, kind="stable")
    times, values = times[order], values[order]
    apart = np.diff(times, prepend=-np.inf) > SAME_INSTANT_OF_WINDOW * w.length
    return Extrema(times[apart], values[apart])


def last_beyond(signal: Signal, level: float) -> float:
    """Latest time at which the modulus of a signal is not below a level.

    The end of the motion where it is not below then; 0 where it is below all the time.
    """
    w = signal.flights.windows
    ends = w.begun + w.durations
    at_end = np.abs(values_at(signal.series, w.last, w.ends))
    if at_end[-1] >= level:
        return float(ends[-1])
    found = [0.0, *ends[at_end >= level]]
    for side in (level, -level):
        series = signal.series.copy()
        series[0] -= side
        at, x = w.inside(*real_zeros_of(series))
        found += w.times(at, x).tolist()
    return float(max(found))
