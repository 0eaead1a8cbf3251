"""Invariant sets from iterates of a map: a periodic orbit, closed curves, or a chaotic set.

Method      period p        the smallest p with  max |x_n - x_m| <= 1e-9  over the last third of
                            the record, m in the last p iterates, m = n (mod p). Where it
                            nearly, within 1e-6, returns after a part of p, that part if within
                            1e-8, else none: a slow spiral into a point that turns by 1/p comes
                            back after p iterates, too                                      (1)
            pieces k        the largest k that divides the time lags between near neighbours  (2)
            chaos           exponent above three errors, and more e-folds of stretching than any
                            smooth curve can hold                                           (3)
            closed curves   every iterate, or else every k-th, in the order of its phases runs along
                            a smooth closed curve (rotation.py), without gaps and of a size that
                            does not change                                                  (4)
Assumes     iterates of one map, scaled so that 1 is the size of the whole motion
Fails       undecided, with the reason; ``settled`` is False where more settling may help
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from vibroimpact._core.checks import check_kind, numbers
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import AnyAmount, Count, Floats
from vibroimpact.attractors.rotation import ClosedCurve, closed_curve, weights
from vibroimpact.simulation.lyapunov import LEAST_GROWTH, LyapunovEstimate

FEWEST_POINTS = 64  # fewer are not classified
LONGEST_PERIOD_ITERATES = 256  # longer orbits are undecided, and contracting
# (1): rounding of 1e-16 per iterate, amplified by 1 / (1 - |multiplier|), stays below for every
# orbit that contracts by more than 1e-6 per period; a torus of this size counts as a point.
RETURN_TOLERANCE = 1e-9
# An orbit that repeats so nearly after a part of its period has the shorter period.
SHORTER_PERIOD_DISTANCE = 1e-6
# (2): six neighbours reach both ways along a curve, so that their lags are not all alike; one in a
# thousand may be wrong, at the ends of a chaotic band.
NEIGHBOURS = 6
STRAY_SHARE = 1e-3
MOST_PIECES, FEWEST_PER_PIECE = 64, 64
# Fewer e-folds are no growth: rounding alone leaves 1e-12 where an exponent is 0.
LEAST_UNSTABLE_FOLDS = 0.01
# (4): the weighted spread of a quasiperiodic motion changes between thirds by far less; of a spiral
# by more, unless it contracts by less than this per record.
DRIFT_TOLERANCE = 1e-3
# (4): with a gap longer than one part in twenty of the curve, it is not certain that it closes.
WIDEST_GAP = 0.05


class Kind(StrEnum):
    """Kinds of attractors."""

    PERIODIC = "periodic"
    QUASIPERIODIC = "quasiperiodic"
    CHAOTIC = "chaotic"
    SILENT = "without impacts"
    DIVERGED = "diverging"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class InvariantSet:
    """Invariant set of a record of iterates.

    Attributes
    ----------
    kind
        :class:`Kind`.
    period
        Iterates until a periodic orbit closes, else 0.
    pieces
        Closed curves of quasiperiodic motion, bands of chaos; 1 otherwise.
    curve
        One of the closed curves, of every ``pieces``-th iterate.
    return_distance
        Left side of (1) for the period, or the smallest of any p up to 256.
    drift
        Relative change of the spread over the record, by thirds.
    settled
        False where the record still changes: iterate longer.
    reason
        Reason if it is undecided; else empty.
    """

    kind: Kind
    period: Count = 0
    pieces: Count = 1
    curve: ClosedCurve | None = None
    return_distance: AnyAmount = np.inf
    drift: AnyAmount = 0.0
    settled: bool = True
    reason: str = ""


def classify_points(points: Floats, exponent: LyapunovEstimate | None = None) -> InvariantSet:
    """Classify the invariant set on which the iterates of a map lie.

    Parameters
    ----------
    points
        Consecutive iterates, shape (n_point, dimension), nondimensional: tolerances refer to 1.
    exponent
        Largest Lyapunov exponent of the map. Without it nothing is called chaotic, and an orbit
        that is about to leave an unstable periodic one is called periodic.

    Returns
    -------
    InvariantSet
        ``Kind.UNDECIDED`` with the reason where no test decides.

    Raises
    ------
    InvalidParameterError
        Points that are not finite numbers of this shape, an exponent of another class.

    Notes
    -----
    O(256 N + N log N) for N points; 4000 take some 30 ms. Needs some 64 points per piece. Close to
    a bifurcation a motion settles slowly: ``settled`` is then False.

    Examples
    --------
    >>> import numpy as np
    >>> angle = 2.0 * np.pi * np.sqrt(2.0) * np.arange(1000)
    >>> shape = classify_points(np.column_stack([np.cos(angle), 0.5 * np.sin(angle)]))
    >>> str(shape.kind), shape.pieces
    ('quasiperiodic', 1)
    """
    points = numbers("points", points)
    if points.ndim != 2:
        raise InvalidParameterError(
            f"points has shape {points.shape}; expected (n_point, dimension)."
        )
    check_kind("exponent", exponent, (LyapunovEstimate, type(None)), "a LyapunovEstimate, or None")
    n = len(points)
    if n < FEWEST_POINTS:
        return InvariantSet(
            Kind.UNDECIDED, reason=f"{n} points are too few: at least {FEWEST_POINTS}."
        )
    period, distance = find_period(points)
    if period:
        return _periodic(period, distance, exponent)
    if exponent and exponent.is_positive and exponent.growth.sum() > LEAST_GROWTH:
        pieces, drift = count_pieces(points), spread_drift(points)
        return InvariantSet(Kind.CHAOTIC, pieces=pieces, return_distance=distance, drift=drift)
    one = _curves(points, 1, distance, exponent)
    if one.kind is Kind.QUASIPERIODIC:
        return one
    pieces = count_pieces(points)
    return _curves(points, pieces, distance, exponent) if pieces > 1 else one


def _periodic(period: int, distance: float, exponent: LyapunovEstimate | None) -> InvariantSet:
    if exponent is None or not exponent.is_positive or exponent.growth.sum() < LEAST_UNSTABLE_FOLDS:
        return InvariantSet(Kind.PERIODIC, period=period, return_distance=distance)
    reason = (
        f"The motion repeats after {period} iterates, but the orbit is unstable "
        f"(exponent {exponent.value:.3g}) and the motion will leave it."
    )
    return InvariantSet(Kind.UNDECIDED, return_distance=distance, settled=False, reason=reason)


def _curves(
    points: Floats, pieces: int, distance: float, exponent: LyapunovEstimate | None
) -> InvariantSet:
    """Search for so many closed curves (4); undecided with the reasons where there are none."""
    curve = closed_curve(points[::pieces])
    drift = spread_drift(points[::pieces])
    doubts = [] if curve else [f"{pieces} set(s) of points on no smooth closed curve"]
    if curve and curve.widest_gap > WIDEST_GAP * curve.length:
        gap = curve.widest_gap / curve.length
        doubts += [f"a gap in the closed curve, {gap:.2g} of its length: more points are needed"]
    if drift > DRIFT_TOLERANCE:
        doubts += [f"the spread changes by {drift:.2g} over the record"]
    contracting = exponent is not None and exponent.is_negative
    if exponent and contracting:
        doubts += [
            f"contracting (exponent {exponent.value:.3g}): still settling, or periodic beyond "
            f"{LONGEST_PERIOD_ITERATES} iterates"
        ]
    return InvariantSet(
        Kind.UNDECIDED if doubts else Kind.QUASIPERIODIC,
        pieces=pieces,
        curve=curve,
        return_distance=distance,
        drift=drift,
        settled=drift <= DRIFT_TOLERANCE and not contracting,
        reason="; ".join(doubts),
    )


def find_period(points: Floats) -> tuple[int, float]:
    """Return the period (1) and its return distance, or 0 and the smallest distance."""
    tail = points[-max(len(points) // 3, FEWEST_POINTS // 2) :]
    smallest = np.inf
    for period in range(1, min(LONGEST_PERIOD_ITERATES, len(tail) // 2) + 1):
        distance = _return_distance(tail, period)
        if distance <= RETURN_TOLERANCE:
            return _primitive(tail, period), distance
        smallest = min(smallest, distance)
    return 0, smallest


def _primitive(tail: Floats, period: int) -> int:
    """Period, or a part of it after which all points nearly return; 0 where they still settle.

    Within ten times the tolerance, a short orbit repeats only after more iterates by rounding.
    """
    orbit = tail[-period:]
    for part in (d for d in range(1, period // 2 + 1) if period % d == 0):
        if np.linalg.norm(orbit - np.roll(orbit, part, 0), axis=1).max() <= SHORTER_PERIOD_DISTANCE:
            settled = _farthest_return(tail, part) <= 10.0 * RETURN_TOLERANCE
            return part if settled else 0
    return period


def _return_distance(tail: Floats, period: int) -> float:
    """Largest distance of a point from its counterpart in the last period."""
    # The nearest return is enough to reject, and cheap.
    last = float(np.linalg.norm(tail[-1] - tail[-1 - period]))
    if last > RETURN_TOLERANCE:
        return last
    return _farthest_return(tail, period)


def _farthest_return(tail: Floats, period: int) -> float:
    cycles = len(tail) // period
    folded = tail[len(tail) - cycles * period :].reshape(cycles, period, -1)
    return float(np.linalg.norm(folded - folded[-1], axis=2).max())


def count_pieces(points: Floats) -> int:
    """Count the separate sets (2) that the map visits in turn."""
    from scipy.spatial import cKDTree

    n = len(points)
    _, index = cKDTree(points).query(points, k=NEIGHBOURS + 1)
    lags = np.abs(index - np.arange(n)[:, None]).ravel()
    lags = lags[lags > 0]
    for pieces in range(min(MOST_PIECES, n // FEWEST_PER_PIECE), 1, -1):
        if np.count_nonzero(lags % pieces) <= STRAY_SHARE * lags.size:
            return pieces
    return 1


def spread_drift(points: Floats) -> float:
    """Largest relative change of the weighted spread between the thirds of a record."""
    spreads = [_spread(part) for part in np.array_split(points, 3)]
    return max(abs(s / spreads[-1] - 1.0) for s in spreads) if spreads[-1] > 0.0 else np.inf


def _spread(points: Floats) -> float:
    w = weights(len(points))
    return float(np.sqrt(w @ ((points - w @ points) ** 2).sum(axis=1)))
