"""Rotation numbers and closed curves from the iterates of a map.

Method      weighted Birkhoff average  <f> = sum_i w(i / N) f_i / sum_i w(i / N),
            w(t) = exp(-1 / (t (1 - t)))                                                    (1)
            line of a signal: the frequency rho at which |<s exp(-2 pi i rho n)>| is largest  (2)
            refined by the turn of its phase between the halves of the record               (3)
            closed curve: in the order of the phases {n rho}, the polygon through some points,
            picked at random, has a length that does not depend on their number              (4)
Assumes     smooth quasiperiodic motion; then (1) and (3) converge faster than any power of 1 / N
Accuracy    the error returned is the change of (3) between the first and the second half
Fails       rho within 1 / N of a fraction with a small denominator: two lines blur
Reference   [das2017] for (1), [laskar1993] for (2)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.types import Amount, AnyAmount, Complexes, Counts, Floats

REFINEMENTS = 3  # each reduces an error of 1 / N by an order; the third changes nothing
MOST_TURNS = 4  # a curve that winds more often around its centre is left undecided
# (4): lengths from N / 8 and N / 2 points agree to O(1 / N^2) on a smooth curve and differ by a
# factor of 4 where the points are in disorder; folds of a curve about to break up cost some per
# cent. The points are picked at random because neighbours among the first N are always so many
# iterates apart, which can hide jumps between two strands.
SPARSE_DIVISOR = 8
DENSE_DIVISOR = 2
SMOOTH_LENGTH_RATIO = 1.1
DISORDER_LENGTH_RATIO = 1.5  # from this ratio of the lengths on, the points are not in order
CHOICE_SEED = 0  # the random choice has this seed, so that the result is reproducible


def weights(n: int) -> Floats:
    """Weights (1) at the midpoints of n equal steps, sum 1."""
    t = (np.arange(n) + 0.5) / n
    w = np.exp(-1.0 / (t * (1.0 - t)))
    normal: Floats = w / w.sum()
    return normal


def weighted_average(values: Floats) -> Floats:
    """Weighted Birkhoff average (1) of a series along its first axis."""
    average: Floats = np.tensordot(weights(len(values)), values, axes=1)
    return average


@dataclass(frozen=True, slots=True)
class Rotation:
    """A rotation number in [0, 1/2] and its error.

    A closed curve in a space of more than two dimensions has no preferred orientation, so rho and
    1 - rho are the same; 2 pi rho compares with the angle of a Neimark-Sacker multiplier in
    (0, pi).
    """

    value: float
    error: AnyAmount


@dataclass(frozen=True, slots=True)
class ClosedCurve:
    """A closed curve through the iterates of a map.

    Parameters
    ----------
    rotation
        Share of the curve passed per iterate, folded to [0, 1/2].
    turns
        Number of turns of the curve around its centre before it closes: 2 for a doubled torus.
    order
        Indices of the points along the curve.
    widest_gap
        Longest step between neighbours on the curve.
    length
        Length of the polygon through the points.
    """

    rotation: Rotation
    turns: int
    order: Counts
    widest_gap: AnyAmount
    length: Amount


def rotation_number(signal: Floats) -> Rotation:
    """Rotation number of a closed curve from one coordinate of its points.

    Parameters
    ----------
    signal
        A coordinate, one value per iterate, at least 16.

    Returns
    -------
    Rotation
        The frequency of the strongest line (2): the average angle around the centre per iterate,
        where the curve winds once around it.

    Notes
    -----
    O(N log N). Unreliable for chaotic signals (the error then shows it), for records shorter than
    some ten periods of 1 / rho, and within 1 / N of 0, 1/2 and other fractions of small
    denominator.
    """
    centred = signal - weighted_average(signal)
    coarse = _strongest_line(centred)
    values = [_refined(part, coarse) for part in np.array_split(centred, 2)]
    value = _refined(centred, coarse)
    error = max(abs(value - v) for v in values)
    return Rotation(_folded(value), max(error, float(np.finfo(float).eps)))


def _strongest_line(signal: Floats) -> float:
    """Frequency of the highest peak of the windowed spectrum, to half a line width."""
    n = len(signal)
    spectrum = np.abs(np.fft.rfft(weights(n) * signal, 4 * n))
    return float(np.argmax(spectrum)) / (4 * n)


def _refined(signal: Floats, rho: float) -> float:
    """Frequency (3): the phase of the line turns by 2 pi (true - rho) h over h iterates."""
    half = len(signal) // 2
    w = weights(half)
    for _ in range(REFINEMENTS):
        n = np.arange(2 * half)
        turned: Complexes = signal[: 2 * half] * np.exp(-2j * math.pi * rho * n)
        first, second = np.dot(w, turned[:half]), np.dot(w, turned[half:])
        rho += float(np.angle(second * np.conj(first))) / (2.0 * math.pi * half)
    return rho


def _folded(rho: float) -> float:
    rho = rho % 1.0
    return min(rho, 1.0 - rho)


def main_coordinate(points: Floats) -> Floats:
    """Project the points on the direction in which they spread most, shape (n_point,)."""
    centred = points - points.mean(axis=0)
    _, directions = np.linalg.eigh(centred.T @ centred)
    along: Floats = centred @ directions[:, -1]
    return along


def closed_curve(points: Floats) -> ClosedCurve | None:
    """Find the smooth closed curve on which iterates of a map lie, if there is one.

    Parameters
    ----------
    points
        Shape (n_point, dimension), in the order of the iterates.

    Notes
    -----
    A curve that winds t times around its centre before it closes passes the strongest line rho at
    (rho + s) / t for some s: the smallest t <= 4 whose order (4) is smooth is taken. More than one
    turn is accepted only where one turn is clearly in disorder. O(t^2 N log N).
    """
    strongest = rotation_number(main_coordinate(points))
    for turns in range(1, MOST_TURNS + 1):
        for s in range(turns):
            rho = (strongest.value + s) / turns
            order, disorder = _order(points, rho)
            if disorder <= SMOOTH_LENGTH_RATIO:
                sides = _sides(points[order])
                rotation = Rotation(_folded(rho), strongest.error / turns)
                return ClosedCurve(rotation, turns, order, float(sides.max()), float(sides.sum()))
            if turns == 1 and disorder < DISORDER_LENGTH_RATIO:
                return None
    return None


def _order(points: Floats, rho: float) -> tuple[NDArray[np.intp], float]:
    """Order of the points by phase, and the growth of the length (4) with N."""
    n = len(points)
    order = np.argsort(np.mod(np.arange(n) * rho, 1.0))
    lot = np.random.default_rng(CHOICE_SEED).permutation(n)[order]
    sparse, dense = (
        float(_sides(points[order[lot < n // part]]).sum())
        for part in (SPARSE_DIVISOR, DENSE_DIVISOR)
    )
    return order, dense / sparse if sparse > 0.0 else np.inf


def _sides(ring: Floats) -> Floats:
    """Sides of the closed polygon through points in order."""
    sides: Floats = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
    return sides
