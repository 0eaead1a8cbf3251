"""The largest Lyapunov exponent of the impact map, from the tangent map, with its error.

Method      lambda = lim log |dz_n| / t_n, dz the tangent of the motion between impacts     (1)
            on blocks b: growth G_b, duration T_b;  lambda = sum G_b / sum T_b              (2)
            error^2 = max over levels of var(mean of r_b) / T^2,  r_b = G_b - lambda T_b    (3)
Accuracy    (3) is the blocking method: neighbours are averaged in pairs again and again, and the
            largest of the naive errors of the mean is kept. Correlation makes the first levels too
            small; anticorrelation (quasiperiodic motion) makes the last too small.
Fails       tangents that vanish: the motion forgets its start altogether (lambda = -inf)
Reference   [flyvbjerg1989]
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vibroimpact.mechanism import check_count
from vibroimpact.motion import EVENTS_PER_IMPACT, Motion
from vibroimpact.simulate import RunEnd, System, flight_limit_of
from vibroimpact.state import State

Floats = NDArray[np.float64]

BLOCKS = 1024  # first level of (3): six halvings leave the 16 blocks below
FEWEST_BLOCKS = 16  # the error of an error from m blocks is 1 / sqrt(2 m): here 18 %
ALIGNING = 16  # one part in so many is discarded while the tangent turns to its own direction
# Against errors from few blocks, three errors stand for one chance in a hundred or less.
ERRORS = 3.0


@dataclass(frozen=True)
class LyapunovEstimate:
    """Largest Lyapunov exponent of the motion, the neutral direction of time left out.

    Attributes
    ----------
    value, error
        Per unit of time, and one standard error by (3) of the module.
    per_impact
        The same growth per event instead of per time.
    growth, duration
        Of every block that was used: natural logarithm, time.
    run_end
        Why the run ended; ``RunEnd.OBSERVER`` where the tangent vanished and the value is -inf.
    """

    value: float
    error: float
    per_impact: float
    growth: Floats = field(repr=False)
    duration: Floats = field(repr=False)
    run_end: RunEnd

    @property
    def blocks(self) -> int:
        """Number of blocks used."""
        return int(self.growth.size)

    @property
    def is_positive(self) -> bool:
        """Whether the value exceeds three errors."""
        return self.value > ERRORS * self.error

    @property
    def is_negative(self) -> bool:
        """Whether the value is below minus three errors."""
        return self.value < -ERRORS * self.error


def lyapunov_exponent(
    system: System, state: State, *, impacts: int = 20_000, settle: int = 1000
) -> LyapunovEstimate:
    """Estimate the largest Lyapunov exponent of a motion.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one.
    state
        Where to start.
    impacts
        Length of the average, >= 1024. The error falls as 1 / sqrt(impacts) in chaos.
    settle
        Impacts (at all stops) to discard first, >= 0; the first sixteenth of ``impacts`` is
        discarded besides.

    Returns
    -------
    LyapunovEstimate
        Value nan with the reason in ``run_end`` if the motion stops impacting.

    Raises
    ------
    InvalidParameterError
        Counts out of range, a bad start.

    Notes
    -----
    The tangent vector goes through flight, impact, completed chatter, sticking and release exactly
    (theory.md, "Jacobian"). It is taken from event to event, where a shift along the motion is no
    change; so a stable periodic motion gives log |largest multiplier| / period < 0, quasiperiodic
    motion 0, and chaos > 0. About 0.5 microseconds per impact of the damper. Unreliable where a
    motion is chaotic only for a while: settle longer; and near grazing, where single impacts
    stretch without bound.
    """
    check_count("impacts", impacts, BLOCKS)
    check_count("settle", settle, 0)
    motion = Motion(system, state)
    end = motion.settle(settle)
    if end is not RunEnd.IMPACTS:
        return _nothing(end)
    return exponent_from(motion, impacts)


def exponent_from(motion: Motion, impacts: int) -> LyapunovEstimate:
    """Estimate from where a motion stands; the motion stays there."""
    block = max(1, impacts // BLOCKS)
    events = EVENTS_PER_IMPACT * impacts + 64
    kernel, limit = motion.compiled.kernel, flight_limit_of(motion.compiled)
    result = kernel.lyapunov(motion.at, math.inf, limit, events, impacts, block)
    while RunEnd(result["why"]) is RunEnd.MISSING and motion.compiled.add_code(result["code"]):
        result = kernel.lyapunov(motion.at, math.inf, limit, events, impacts, block)
    end = RunEnd(result["why"])
    if end is RunEnd.OBSERVER:
        return LyapunovEstimate(-math.inf, 0.0, -math.inf, np.empty(0), np.empty(0), end)
    skip = len(result["time"]) // ALIGNING
    if end not in (RunEnd.IMPACTS, RunEnd.EVENTS) or len(result["time"]) - skip <= FEWEST_BLOCKS:
        return _nothing(end)
    growth, duration = np.diff(result["growth"][skip:]), np.diff(result["time"][skip:])
    value, error = ratio_of_means(growth, duration)
    return LyapunovEstimate(value, error, float(growth.mean()) / block, growth, duration, end)


def _nothing(end: RunEnd) -> LyapunovEstimate:
    return LyapunovEstimate(math.nan, math.nan, math.nan, np.empty(0), np.empty(0), end)


def ratio_of_means(growth: Floats, duration: Floats) -> tuple[float, float]:
    """Growth per duration (2) and its standard error (3).

    Parameters
    ----------
    growth, duration
        Of consecutive blocks, at least 16.
    """
    value = float(growth.sum() / duration.sum())
    residual = growth - value * duration  # (3)
    return value, error_of_mean(residual) / float(duration.mean())


def error_of_mean(series: Floats) -> float:
    """Return the standard error of the mean of a correlated series, by blocking."""
    largest = 0.0
    while series.size >= FEWEST_BLOCKS:
        largest = max(largest, float(series.std(ddof=1)) / math.sqrt(series.size))
        even = series[: series.size // 2 * 2]
        series = 0.5 * (even[0::2] + even[1::2])
    return largest
