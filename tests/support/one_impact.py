"""Periodic motions with one impact per period in closed form, without code of the library.

    M x'' + C x' + K x = f0 + s sin(theta) + c cos(theta),  theta' = omega                   (1)
    row . x = limit + motion_s sin(theta) + motion_c cos(theta) at the impact                (2)

Between impacts (x, v, sin theta, cos theta, 1) moves by the exponential of a constant matrix. After the time T,
n periods, or half an odd number of them with all signs changed, and the impact

    v -> v - (1 + R) w d,  w = row . v - speed of the stop,  d = M^-1 row / (row . M^-1 row) (3)

the motion repeats. (2) and that are linear in (x, v, sin theta, cos theta): a line of solutions, on which
sin^2 + cos^2 = 1 has two, one or none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Closing:
    """A state just after an impact, and the time after which the motion repeats, perhaps with all signs changed."""

    position: Floats
    velocity: Floats
    phase: float
    time: float
    sign: int


def one_impact(
    mass: ArrayLike,
    damping: ArrayLike,
    stiffness: ArrayLike,
    omega: float,
    row: Sequence[float],
    limit: float,
    restitution: float,
    *,
    constant: Sequence[float] = (),
    sine: Sequence[float] = (),
    cosine: Sequence[float] = (),
    motion: tuple[float, float] = (0.0, 0.0),
    periods: float = 1.0,
) -> list[Closing]:
    """Solutions of (1) to (3) that leave the stop; half a period where ``periods`` is no whole number."""
    M, C, K = (np.atleast_2d(np.array(a, dtype=float)) for a in (mass, damping, stiffness))
    n, normal = len(M), np.array(row, dtype=float)
    inverse = np.linalg.inv(M)
    f0, s, c = (np.array(f if len(f) else [0.0] * n) for f in (constant, sine, cosine))
    A = np.zeros((2 * n + 3, 2 * n + 3))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, : 2 * n] = -inverse @ np.hstack([K, C])
    A[n : 2 * n, 2 * n :] = (inverse @ np.array([s, c, f0]).T).reshape(n, 3)
    A[2 * n, 2 * n + 1], A[2 * n + 1, 2 * n] = omega, -omega
    time = periods * 2.0 * math.pi / omega
    sign = 1 if periods == int(periods) else -1
    d = inverse @ normal / (normal @ inverse @ normal)
    J = np.eye(2 * n + 3)
    J[n : 2 * n, n : 2 * n] -= (1.0 + restitution) * np.outer(d, normal)
    a, b = motion
    J[n : 2 * n, 2 * n] -= (1.0 + restitution) * omega * b * d
    J[n : 2 * n, 2 * n + 1] += (1.0 + restitution) * omega * a * d
    flow = (J @ expm(A * time))[: 2 * n]
    equations = np.zeros((2 * n + 1, 2 * n + 3))  # = 0 for (z, sin, cos, 1)
    equations[: 2 * n] = sign * np.eye(2 * n, 2 * n + 3) - flow
    equations[2 * n, :n], equations[2 * n, 2 * n :] = normal, (-a, -b, -limit)
    matrix, right = equations[:, :-1], -equations[:, -1]
    along = np.linalg.svd(matrix)[2][-1]
    at = np.linalg.lstsq(matrix, right, rcond=1e-12)[0]
    assert np.allclose(matrix @ at, right, atol=1e-10 * max(1.0, abs(right).max()))
    p, q = at[2 * n :], along[2 * n :]
    found = []
    for x in np.roots([q @ q, 2.0 * (p @ q), p @ p - 1.0]):
        if abs(x.imag) < 1e-12:
            z = at + x.real * along
            leaving = normal @ z[n : 2 * n] - omega * (a * z[2 * n + 1] - b * z[2 * n])
            if leaving < 0.0:
                phase = math.atan2(z[2 * n], z[2 * n + 1]) % (2.0 * math.pi)
                found.append(Closing(z[:n], z[n : 2 * n], phase, time, sign))
    return found
