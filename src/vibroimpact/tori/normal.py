"""Normal stability of an invariant circle: exponents, orientation of bundles, angles.

Method      Tangent vectors are carried by A(phi) = DF(u(phi)) from phi to phi + rho. Frames
            Q = [t, q_1, .., q_(d-1)], t the unit tangent, are carried on all nodes at once,
                A(phi) Q(phi) = Q(phi + rho) R,   QR decomposition,                              (1)
            until Q depends on phi alone; the exponents normal to the circle are
                chi_i = mean over the nodes of ln |R_ii|.                                        (2)
            A shifted grid is as good as the nodes, so that nothing is interpolated but A, by its
            Fourier series. Two exponents whose frame goes on turning while their sum is steady are
            a pair, as complex multipliers are, and share their sum.                             (3)
            The line field of a single exponent, modulo those before it, is followed once round the
            circle: it closes with its sign, and then the multiplier exp(chi) has the sign of R_ii,
            or it is a Moebius band and the multiplier has none.                                 (4)
            Of directions that are known to be forgotten within an iterate, no frames are carried: rounding would be
            all that is left of them.
            The covector l with l(phi + rho) A(phi) = l(phi) vanishes on all directions that are
            invariant apart from the tangent; the angle between both is
                sin(alpha) = |l . u'| / (|l| |u'|).                                              (5)
            It is the left null vector of the Jacobian of the collocation.
Assumes     A smooth along the circle, known to as many harmonics as the circle
Accuracy    (2) converges with the ratio of neighbouring moduli per step, to rounding or the error
            of the collocation; a pair's average is that of its sum
Reference   [jorba2001] for the meaning of (2) as multipliers; theory.md, "Invariant circles"
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.tori.fourier import coefficients, derivative, shifted, values_of

STRIDE_ITERATES = 4  # there are so many iterates between two QR decompositions
MOST_DECOMPOSITIONS = 256  # there are so many decompositions at most
WINDOW_DECOMPOSITIONS = 4  # exponents are checked after so many
PAIR_DECOMPOSITIONS = 32  # so many tell a pair of exponents
CONVERGED_CHANGE = 1e-10  # an exponent that changes by less over a window has converged
STEPS_OF_DIRECTION = 256
PAIR_DISTANCE = 1e-9  # the exponents of a pair whose frames turn evenly differ by less
# What is forgotten, by a plastic impact or a rest, has this one: its logarithm is infinite.
LEAST_EXPONENT = -700.0
FRAME_SEED = 0  # the first frames are random with this seed
TURNING_OSCILLATION = 1e-7  # exponents of a pair whose frames turn oscillate by more


class Bundle(StrEnum):
    """Kinds of invariant normal directions."""

    POSITIVE = "positive"
    NEGATIVE = "negative"
    ONE_SIDED = "one-sided"
    PAIR = "pair"


@dataclass(frozen=True)
class NormalStability:
    """Exponents per iterate, largest first, shape (d - 1,), and the kind of each direction."""

    exponents: Floats
    bundles: tuple[Bundle, ...]

    @property
    def multipliers(self) -> Complexes:
        """Signed multipliers; nan as the imaginary part of a pair's and a one-sided one's."""
        signs = {Bundle.POSITIVE: 1.0, Bundle.NEGATIVE: -1.0}
        values = [
            complex(signs[kind] * size, 0.0) if kind in signs else complex(size, np.nan)
            for size, kind in zip(np.exp(self.exponents), self.bundles, strict=True)
        ]
        return np.array(values, dtype=np.complex128)


def normal_stability(
    points: Floats, by_point: Floats, rotation: float, noise: float = 0.0, zeros: int = 0
) -> NormalStability:
    """Normal exponents (2) and bundles of a circle; points (N, d), derivatives (N, d, d).

    ``noise`` is the relative error of the derivatives between the nodes; so many multipliers are known to be zero.
    """
    cocycle = _Cocycle(derivative(points), coefficients(by_point), rotation)
    tolerance = max(CONVERGED_CHANGE, noise)
    carried = points.shape[1] - 1 - zeros
    frames, record = cocycle.frames(carried), np.empty((0, carried))
    found = None
    while found is None:
        for _ in range(WINDOW_DECOMPOSITIONS):
            frames = cocycle.carried(frames, STRIDE_ITERATES)
            record = np.vstack([record, frames.rates() / STRIDE_ITERATES])
        found = _steady(record, tolerance, last=len(record) >= MOST_DECOMPOSITIONS)
    exponents, paired = found
    there = cocycle.carried(frames)
    kinds = [
        Bundle.PAIR if pair else cocycle.direction(frames, there, i).bundle
        for i, pair in enumerate(paired)
    ]
    order = np.argsort(-exponents, kind="stable")
    return NormalStability(
        np.append(exponents[order], [LEAST_EXPONENT] * zeros),
        (*(kinds[i] for i in order), *[Bundle.POSITIVE] * zeros),
    )


class NormalDirection(NamedTuple):
    """A normal direction, modulo the tangent and those before it.

    ``reversed`` where it comes back so (4); ``field`` then covers two turns. ``sign`` is that of
    its multiplier; in a reversed one, of the multiplier to the continuation of the field.
    """

    field: Floats
    reversed: bool
    sign: float

    @property
    def bundle(self) -> Bundle:
        """Kind of the direction."""
        if self.reversed:
            return Bundle.ONE_SIDED
        return Bundle.POSITIVE if self.sign > 0.0 else Bundle.NEGATIVE


def leading_direction(points: Floats, by_point: Floats, rotation: float) -> NormalDirection:
    """Direction of the largest normal exponent at the nodes, from frames carried until steady."""
    cocycle = _Cocycle(derivative(points), coefficients(by_point), rotation)
    frames = cocycle.frames(1)
    for _ in range(STEPS_OF_DIRECTION // STRIDE_ITERATES):
        frames = cocycle.carried(frames, STRIDE_ITERATES)
    found = cocycle.direction(frames, cocycle.carried(frames), 0)
    turns = 2.0 if found.reversed else 1.0
    return found._replace(field=shifted(found.field, -frames.steps * rotation / turns))


class _Frames(NamedTuple):
    """Frames (1) at the nodes phi_j + n rho after n steps, and R_ii since the last ones."""

    vectors: Floats  # (N, d, 1 + k)
    growth: Floats  # (N, k)
    steps: int

    def rates(self) -> Floats:
        """Means (2)."""
        with np.errstate(divide="ignore"):
            rates = np.maximum(np.log(np.abs(self.growth)), LEAST_EXPONENT)
        return np.asarray(rates.mean(axis=0), dtype=np.float64)


@dataclass(frozen=True)
class _Cocycle:
    """The tangent and the derivatives along the circle."""

    slope: Floats  # (N, d)
    series: Complexes  # (K + 1, d, d)
    rotation: float

    def frames(self, count: int) -> _Frames:
        """Frames of so many normal directions to begin with; almost all do."""
        d = self.slope.shape[1]
        columns = np.random.default_rng(FRAME_SEED).standard_normal((d, d - 1))[:, :count]
        return self._framed(np.tile(columns, (len(self.slope), 1, 1)), 0)

    def carried(self, frames: _Frames, steps: int = 1) -> _Frames:
        """Frames some steps later."""
        vectors = frames.vectors[:, :, 1:]
        for step in range(frames.steps, frames.steps + steps):
            turn = np.exp(2j * np.pi * self.rotation * step * np.arange(len(self.series)))
            vectors = values_of(self.series * turn[:, None, None], len(self.slope)) @ vectors
        return self._framed(vectors, frames.steps + steps)

    def direction(self, frames: _Frames, there: _Frames, i: int) -> NormalDirection:
        """The i-th normal direction (4) of frames, from those one step later."""
        normals, images = (f.vectors[:, :, i + 1] for f in (frames, there))
        signs, closes = _oriented(normals)
        field = normals * signs[:, None]
        pushed = images * (signs * np.sign(there.growth[:, i]))[:, None]
        if not closes:  # over two turns it does
            field, pushed = (np.concatenate([part, -part]) for part in (field, pushed))
        along = shifted(field, self.rotation / (1.0 if closes else 2.0))
        return NormalDirection(field, not closes, float(np.sign((pushed * along).sum())))

    def _framed(self, vectors: Floats, steps: int) -> _Frames:
        """Orthonormal frames that begin with the tangents."""
        tangents = shifted(self.slope, steps * self.rotation)
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        q, r = np.linalg.qr(np.concatenate([tangents[:, :, None], vectors], axis=2))
        return _Frames(q, np.diagonal(r, axis1=1, axis2=2)[:, 1:], steps)


def _oriented(field: Floats) -> tuple[Floats, bool]:
    """Signs that make a line field continuous along the nodes, and whether it closes so."""
    products = np.sign((field * np.roll(field, 1, axis=0)).sum(axis=1))
    products[products == 0.0] = 1.0
    signs = np.cumprod(np.append(1.0, products[1:]))
    return signs, bool(signs[-1] * products[0] > 0.0)


def _steady(rows: Floats, tolerance: float, *, last: bool) -> tuple[Floats, list[bool]] | None:
    """Exponents and whether each belongs to a pair (3), once they are steady, or at last; or None."""
    window = rows[-WINDOW_DECOMPOSITIONS:]
    exponents, paired = window.mean(axis=0), [False] * rows.shape[1]
    moves, i = np.ptp(window, axis=0), 0
    while i < rows.shape[1]:
        alone = moves[i] <= tolerance * (1.0 + abs(exponents[i]))
        if not alone and i + 1 < rows.shape[1] and _turns(rows[:, i], rows[:, i + 1]):
            both = window[:, i] + window[:, i + 1]
            if not last and np.ptp(both) > tolerance * (1.0 + abs(both[-1])):
                return None
            exponents[i : i + 2], paired[i : i + 2] = both.mean() / 2.0, [True, True]
            i += 1
        elif not alone and not last:
            return None
        i += 1
    for j in np.flatnonzero(np.abs(np.diff(exponents)) <= PAIR_DISTANCE).tolist():
        paired[j] = paired[j + 1] = True
    return exponents, paired


def _turns(one: Floats, other: Floats) -> bool:
    """Whether two growth rates go on exchanging their order while their sum is steadier."""
    if len(one) < 2 * PAIR_DECOMPOSITIONS:
        return False
    one, other = one[-PAIR_DECOMPOSITIONS:], other[-PAIR_DECOMPOSITIONS:]
    swing, mean = float(np.ptp(one - other)), abs(float((one - other).mean()))
    steadier = np.ptp(one + other) < min(np.ptp(one), np.ptp(other)) / 2.0
    return bool(steadier and swing > TURNING_OSCILLATION and mean < swing / 2.0)


def least_angle(points: Floats, rotation: float, matrix: Floats) -> float:
    """Least angle (5), radians; ``matrix`` is the square Jacobian of solve.py, points in its units."""
    n, d = points.shape
    last = np.zeros(n * d + 1)
    last[-1] = 1.0
    covectors = np.linalg.solve(matrix.T, last)[:-1].reshape(n, d)  # at phi_j + rho
    slope = shifted(derivative(points), rotation)
    norms = np.linalg.norm(covectors, axis=1) * np.linalg.norm(slope, axis=1)
    sines = np.abs((covectors * slope).sum(axis=1)) / norms
    return float(np.arcsin(np.minimum(sines, 1.0).min()))
