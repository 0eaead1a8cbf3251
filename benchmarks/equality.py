"""Every method must compute the same impacts before it is timed.

Impact times of chaotic transients cannot agree for long, whatever the method: each impact
multiplies an error. An impact is compared while the reference itself is insensitive: all impact
times up to it move by less than `AMPLIFICATION` times a shift of the initial phase, or of the free
mass's initial velocity. The errors of one flight are a few 1e-13, so the methods' tolerance of
1e-9 leaves them room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.case import START_COLUMNS, Floats, Parameters
from benchmarks.peers.method import Method

IMPACTS = 10
SHIFTED = ("phase", "v2")
SHIFT = 1e-12
AMPLIFICATION = 1000.0


class ImpactsDifferError(AssertionError):
    """A method's impacts differ from the reference."""


@dataclass(frozen=True, slots=True)
class Reference:
    """Impact times of the reference, and which of them are insensitive enough to compare."""

    starts: Floats
    times: Floats
    comparable: NDArray[np.bool_]


def reference(method: Method, starts: Floats, parameters: Parameters) -> Reference:
    """Compute the first `IMPACTS` impacts of every start, and where they are comparable."""
    times = method.run(starts, parameters, IMPACTS).times
    insensitive = np.isfinite(times)
    for column in SHIFTED:
        shifted = starts.copy()
        shifted[:, START_COLUMNS.index(column)] += SHIFT
        moved = np.abs(method.run(shifted, parameters, IMPACTS).times - times)
        insensitive &= np.logical_and.accumulate(moved < AMPLIFICATION * SHIFT, axis=1)
    return Reference(starts, times, insensitive)


def assert_equal(method: Method, parameters: Parameters, expected: Reference) -> float:
    """Raise `ImpactsDifferError` unless the comparable impacts agree; return the largest error."""
    times = method.run(expected.starts, parameters, IMPACTS).times
    error = np.abs(times - expected.times)[expected.comparable]
    if not np.all(error <= method.tolerance):
        wrong = np.count_nonzero(~(error <= method.tolerance))
        raise ImpactsDifferError(
            f"{method.name}: {wrong} of {error.size} impact times differ from the reference by "
            f"more than {method.tolerance:g} (largest {np.nanmax(error):.3g})"
        )
    return float(error.max())
