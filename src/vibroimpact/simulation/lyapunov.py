"""The largest Lyapunov exponent of the impact map, from the tangent map, with its error.

Method      lambda = lim log |dz_n| / t_n, dz the tangent of the motion between impacts     (1)
            on N blocks b: growth G_b, duration T_b;  lambda = sum w_b G_b / sum w_b T_b,
            w_b = exp(-1 / 4s(1 - s)), s = (b + 1/2) / N                                    (2)
            error = max(scatter of (2) over 16 parts / 4, half of its change from the first half
            to the second, rounding)                                                        (3)
            change    where n_1 log var_1(r) + n_2 log var_2(r) is least, of the n_1 blocks before
                      and the n_2 from there on, if the spreads differ by a factor of four, the
                      lambdas by three errors, and the sum of r before it is more e-folds than a
                      regular motion stretches and shrinks by turns                          (4)
Accuracy    The norm of dz, in units that the machine sets (observe/growth.hpp), changes log |dz_n| by what
            is bounded, and G_b in a periodic motion from block to block. The weights let (2) forget the
            ends and the periods faster than any power of N: there it is log |multiplier| / period
            but for what (3) says. In chaos they raise the error by a sixth
            (lyapunov_spectrum.py). (4) compares plain means, whose errors are found by blocking:
            neighbours are averaged in pairs repeatedly, and the largest of the naive errors of the
            mean is kept. Correlation makes the first levels too small.
            (4) finds where chaos begins or ends, but not phases of fewer than 16 blocks, nor
            a transition between two chaotic phases. In a thousand series of correlated noise it
            found a change in none with correlation times below 10 blocks, in one per cent at 30.
Fails       tangents that vanish: the motion no longer depends on its start (lambda = -inf)
Reference   [das2017] for (2), [flyvbjerg1989] for blocking
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.checks import check_count, names_arguments
from vibroimpact._core.progress import announce_measured, interruptible
from vibroimpact._core.types import Amounts, AnyAmount, AnyFloat, AnyFloats, Floats
from vibroimpact.model.state import State
from vibroimpact.model.system import System
from vibroimpact.results.result import Result, along
from vibroimpact.simulation.simulate import GOES_ON, RunEnd, events_for, flight_limit_of
from vibroimpact.simulation.simulator import Simulator

FIRST_BLOCKS = 1024  # the first level of (3) has so many: six halvings leave the 16 blocks below
FEWEST_BLOCKS = 16  # the error of an error from m blocks is 1 / sqrt(2 m): here 18 %
# One part in so many is discarded while the tangent turns to its own direction.
ALIGNING_DIVISOR = 16
# (4): on a smooth curve of N points tangents never stretch by more than N, some 8 e-folds.
LEAST_GROWTH = 10.0
OTHER_SPREAD_FACTOR = 4.0
# The variance has this part of the whole at least: the growth of periodic motion has none.
LEAST_VARIANCE = 1e-9
# Against errors from few blocks, three errors stand for one chance in a hundred or less.
ERRORS_OF_CERTAINTY = 3.0
ROUNDING_OF_GROWTH = 2.0**-48  # every product adds some ulp to a growth


@dataclass(frozen=True, eq=False)
class LyapunovEstimate(Result):
    """Largest Lyapunov exponent of a motion, without the neutral direction of time.

    Attributes
    ----------
    value, error
        Per unit of time, and one standard error by (3) of the module.
    per_impact
        Growth per event instead of per time.
    growth, duration
        Natural logarithm of the growth, and time, of every block that was used.
    run_end
        Why the run ended; ``RunEnd.OBSERVER`` where the tangent vanished and the value is -inf.
    earlier
        Where the motion changes within the average, as at the end of transient chaos, the estimates
        of its earlier parts, in order; all other fields describe the last part.
    system
        The system that moves.
    """

    value: AnyFloat
    error: AnyAmount
    per_impact: AnyFloat
    growth: AnyFloats = field(metadata=along("block"), repr=False)
    duration: Amounts = field(metadata=along("block", quantity="time"), repr=False)
    run_end: RunEnd
    earlier: tuple[LyapunovEstimate, ...] = field(default=(), repr=False)
    system: System | None = field(default=None, repr=False)

    @property
    def statement(self) -> str:
        """Value and error in words, with those of earlier parts where the motion has changed."""
        sizes = [one.blocks for one in (*self.earlier, self)]
        parts = zip(self.earlier, sizes, strict=False)
        before = [f"{one.value:.3g} +- {one.error:.1g} in {n}" for one, n in parts]
        now = f"{self.value:.3g} +- {self.error:.1g}"
        if not before:
            return now
        return f"{now} in the last {sizes[-1]} of {sum(sizes)} blocks; before, {', '.join(before)}"

    @property
    def blocks(self) -> int:
        """Number of blocks used."""
        return int(self.growth.size)

    @property
    def is_positive(self) -> bool:
        """Whether the value exceeds three errors."""
        return self.value > ERRORS_OF_CERTAINTY * self.error

    @property
    def is_negative(self) -> bool:
        """Whether the value is below minus three errors."""
        return self.value < -ERRORS_OF_CERTAINTY * self.error


@names_arguments()
@interruptible
def lyapunov_exponent(
    system: System, start: State, *, impacts: int = 20_000, settle_impacts: int = 1000
) -> LyapunovEstimate:
    """Estimate the largest Lyapunov exponent of a motion.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one.
    start
        Initial state.
    impacts
        Length of the average, >= 1024. The error falls as 1 / sqrt(impacts) in chaos. A machine
        without stops has none: four times as many changes of its friction count.
    settle_impacts
        Impacts (at all stops) to discard first, >= 0; the first sixteenth of ``impacts`` is
        discarded besides.

    Returns
    -------
    LyapunovEstimate
        Value nan with the reason in ``run_end`` if the motion stops impacting. Where the motion
        changes within the average (transient chaos), the value is that of its last part;
        ``earlier`` holds the others, and ``statement`` lists all.

    Raises
    ------
    InvalidParameterError
        Counts out of range, a bad start.

    Notes
    -----
    The tangent vector goes through flight, impact, completed chatter, sticking and release exactly
    (theory.md, "Jacobian"). It is taken from event to event, so that a shift in time does not
    count; a stable periodic motion gives log |largest multiplier| / period < 0, quasiperiodic
    motion 0, and chaos > 0. Tangents are measured in lengths and times of the machine: units do not
    matter. Smooth weights forget the ends of the average, where a tangent turns: of a periodic motion the
    value is right to 1e-5 of its rates or better; ``vi.find_orbit(...).multipliers`` has it to rounding.
    About 0.5 microseconds per impact of the damper. Unreliable where chaos ends later, or within the last
    16 of 1024 blocks; and near grazing, where single impacts stretch without bound.
    """
    check_count("impacts", impacts, FIRST_BLOCKS)
    check_count("settle_impacts", settle_impacts, 0)
    motion = Simulator(system, start)
    end = motion.settle(settle_impacts)
    if end not in GOES_ON:
        return replace(no_exponent(end), system=system)
    return replace(exponent_from(motion, impacts), system=system)


def exponent_from(motion: Simulator, impacts: int) -> LyapunovEstimate:
    """Estimate from the present position of a motion, which is not changed."""
    block = max(1, impacts // FIRST_BLOCKS)
    events = events_for(motion.compiled.mechanism, impacts)
    kernel, limit = motion.compiled.kernel, flight_limit_of(motion.compiled)
    announce_measured(
        "impacts", impacts, lambda n: kernel.lyapunov(motion.at, math.inf, limit, events, n, n)
    )
    result = kernel.lyapunov(motion.at, math.inf, limit, events, impacts, block)
    while RunEnd(result["why"]) is RunEnd.MISSING and motion.compiled.add_code(result["code"]):
        result = kernel.lyapunov(motion.at, math.inf, limit, events, impacts, block)
    end = RunEnd(result["why"])
    if end is RunEnd.OBSERVER:
        return LyapunovEstimate(-math.inf, 0.0, -math.inf, np.empty(0), np.empty(0), end)
    skip = len(result["time"]) // ALIGNING_DIVISOR
    if end not in GOES_ON or len(result["time"]) - skip <= FEWEST_BLOCKS:
        return no_exponent(end)
    growth, duration = np.diff(result["growth"][skip:]), np.diff(result["time"][skip:])
    *earlier, last = (
        _estimate(growth[part], duration[part], block, end) for part in parts_of(growth, duration)
    )
    return replace(last, earlier=tuple(earlier))


def _estimate(growth: Floats, duration: Floats, block: int, end: RunEnd) -> LyapunovEstimate:
    value = float(weighted_ratio(growth, duration))
    error = float(errors_of(growth[:, None], duration)[0])
    return LyapunovEstimate(value, error, float(growth.mean()) / block, growth, duration, end)


def no_exponent(end: RunEnd) -> LyapunovEstimate:
    """Return an estimate of NaN, with the reason."""
    return LyapunovEstimate(math.nan, math.nan, math.nan, np.empty(0), np.empty(0), end)


def parts_of(growth: Floats, duration: Floats) -> list[slice]:
    """Split blocks repeatedly where the growth changes permanently (4).

    Parameters
    ----------
    growth, duration
        Growth and duration of consecutive blocks, at least 16.
    """
    whole = slice(0, growth.size)
    if growth.size < 2 * FEWEST_BLOCKS or not np.isfinite(growth).all():
        return [whole]
    value, _ = ratio_of_means(growth, duration)
    at = _change(growth - value * duration)
    if not at:
        return [whole]
    sides = slice(0, at), slice(at, growth.size)
    (a, error_a), (b, error_b) = (ratio_of_means(growth[s], duration[s]) for s in sides)
    if not abs(a - b) > ERRORS_OF_CERTAINTY * math.hypot(error_a, error_b):
        return [whole]
    first, second = (parts_of(growth[s], duration[s]) for s in sides)
    return first + [slice(at + part.start, at + part.stop) for part in second]


def _change(residual: Floats) -> int:
    """Index at which the spread of the residuals changes, (4); 0 where it does not."""
    n = np.arange(1, residual.size)
    floor = LEAST_VARIANCE * residual.var() or 1.0
    before = _variances(residual)[:-1]
    after = _variances(residual[::-1])[-2::-1]
    before, after = (np.maximum(variance, floor) for variance in (before, after))
    cost = n * np.log(before) + n[::-1] * np.log(after)
    inside = slice(FEWEST_BLOCKS - 1, residual.size - FEWEST_BLOCKS)
    at = FEWEST_BLOCKS - 1 + int(np.argmin(cost[inside]))
    spread = 0.5 * abs(math.log(before[at] / after[at]))
    growth = abs(float(residual[: at + 1].sum()))
    return at + 1 if spread > math.log(OTHER_SPREAD_FACTOR) and growth > LEAST_GROWTH else 0


def _variances(series: Floats) -> Floats:
    """Variance of the first 1, 2, ... numbers."""
    n = np.arange(1, series.size + 1)
    variances: Floats = np.cumsum(series**2) / n - (np.cumsum(series) / n) ** 2
    return variances


def ratio_of_means(growth: Floats, duration: Floats) -> tuple[float, float]:
    """Growth per duration and its standard error, by blocking.

    Parameters
    ----------
    growth, duration
        Growth and duration of consecutive blocks, at least 16.
    """
    value = float(growth.sum() / duration.sum())
    residual = growth - value * duration
    return value, error_of_mean(residual) / float(duration.mean())


def weights(count: int) -> Floats:
    """Smooth weights (2) of so many terms."""
    s = (np.arange(count) + 0.5) / count
    found: Floats = np.exp(-0.25 / (s * (1.0 - s)))
    return found


def weighted_ratio(growth: Floats, duration: Floats) -> Floats:
    """Growth per duration with smooth weights (2), shape (m,) from (N, m) and (N,)."""
    w = weights(len(duration))
    ratio: Floats = (w @ growth) / (w @ duration)
    return ratio


def errors_of(growth: Floats, duration: Floats) -> Floats:
    """Errors (3) of the weighted ratios."""

    def parts(number: int) -> Floats:
        pieces = zip(np.array_split(growth, number), np.array_split(duration, number), strict=True)
        return np.array([weighted_ratio(*piece) for piece in pieces])

    scatter = parts(FEWEST_BLOCKS).std(axis=0, ddof=1) / math.sqrt(FEWEST_BLOCKS)
    first, second = parts(2)
    rounding = ROUNDING_OF_GROWTH * (1.0 + np.abs(growth).mean(axis=0)) / duration.mean()
    errors: Floats = np.maximum(np.maximum(scatter, 0.5 * np.abs(second - first)), rounding)
    return errors


def error_of_mean(series: Floats) -> float:
    """Return the standard error of the mean of a correlated series, by blocking."""
    largest = 0.0
    while series.size >= FEWEST_BLOCKS:
        largest = max(largest, float(series.std(ddof=1)) / math.sqrt(series.size))
        even = series[: series.size // 2 * 2]
        series = 0.5 * (even[0::2] + even[1::2])
    return largest
