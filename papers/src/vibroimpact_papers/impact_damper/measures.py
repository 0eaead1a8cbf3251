"""Numbers that describe a cloud of section points in the projection (x1, x1'+).

extent      diagonal of the box around the points                                    (1)
harmonics   fewest K with sum over |k| <= K of |c_k|^2 >= (1 - 1e-4) of the variance,
            c_k = <z_n exp(-2 pi i k rho n)>, z = (x1 + i x1'+) in units of the box  (2)
width       median over angles around the centre of (largest - smallest radius)      (3)
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from vibroimpact._core.types import Floats
from vibroimpact.attractors.rotation import weighted_average

SHARE = 1e-4  # of the variance that (2) leaves out
MOST_HARMONICS = 400
SECTORS = 72  # of five degrees, for (3)
FEWEST_IN_SECTOR = 10
SAME = 0.02  # two clouds are one if nearly all points have a neighbour within this share of (1)
NEARLY_ALL = 0.9
SAME_FLOOR = 1e-6  # and in any case if they are as near as this


def extent(points: Floats) -> float:
    """Return (1)."""
    return float(np.hypot(*np.ptp(points, axis=0)))


def same_cloud(a: Floats, b: Floats) -> bool:
    """Return whether two clouds of points, shape (n, 2), show the same attractor."""
    reach = max(SAME * extent(np.concatenate([a, b])), SAME_FLOOR)
    pairs = ((a, b), (b, a))
    gaps = [cKDTree(other).query(one)[0] for one, other in pairs]
    return all(float(np.quantile(gap, NEARLY_ALL)) <= reach for gap in gaps)


def harmonics(points: Floats, rotation: float) -> float:
    """Return (2), the roughness of a closed curve; nan if 400 harmonics do not suffice."""
    size = np.ptp(points, axis=0)
    z = (points / size) @ np.array([1.0, 1.0j])
    z = z - weighted_average(z)
    total = float(weighted_average(np.abs(z) ** 2))
    turn = np.exp(-2j * np.pi * rotation * np.arange(len(z)))
    held, up, down = 0.0, np.ones_like(z), np.ones_like(z)
    for k in range(1, MOST_HARMONICS + 1):
        up, down = up * turn, down * turn.conj()
        held += sum(abs(complex(weighted_average(z * wave))) ** 2 for wave in (up, down))
        if held >= (1.0 - SHARE) * total:
            return float(k)
    return float("nan")


def width(points: Floats) -> float:
    """Return (3), the width of a belt around its centre, in units of its extent (1)."""
    centred = points - points.mean(axis=0)
    radius, angle = np.hypot(*centred.T), np.arctan2(centred[:, 1], centred[:, 0])
    sector = ((angle / (2.0 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
    widths = [
        np.ptp(radius[sector == k])
        for k in range(SECTORS)
        if np.count_nonzero(sector == k) >= FEWEST_IN_SECTOR
    ]
    return float(np.median(widths)) / extent(points) if widths else float("nan")
