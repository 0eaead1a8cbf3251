"""Matching of members of an ensemble that end on the same attractor.

Method      A member is given by its last points on a section, z = (x, v, cos theta, sin theta), x
            and v in units of their largest values in the ensemble. An attractor is given by more
            points of the same section, z_j; d(z) = min over j of |z - z_j|.
              periodic: the last point of the member lies on the orbit, whichever impact it is,
                d(z) <= tolerance                                                           (1)
              else: with e_j the distance of z_j to the nearest of the other z_j,
                median of d over the points of the member <= the 99% quantile of the e_j, on a
                closed curve at least half its widest gap: with a rotation number next to p/q the
                z_j come in q short runs, and all points of a member may lie between them  (2)
            Periodic members with different impacts per forcing period are never joined; those with
            proportional symbols may be, because a slow spiral into 1-1-1 can return after 13
            periods within the tolerance of the symbol, but not yet after one.                (3)
            On one attractor d(z) and e_j are drawn from the same distribution, so that the rule
            needs no length: with k independent points (2) fails with a probability below
            binomial(k, k/2) 0.01^(k/2), 7e-7 for k = 8.
            Where attractors are counted, each is known only by the few points of a member.
            On a torus near p/q they form q clusters and do not show the curve between these.
              periodic with no more impacts at the stop than points: (1), (3)
              else: members in the gaps of a member are on its attractor, median of d <= the
                longest edge of the minimum spanning tree of the z_j; widest gaps first     (4)
Assumes     members that have settled; points of an attractor that visit all of it
Accuracy    (1) joins a member that still settles, by less than ``tolerance``. (1) separates orbits
            farther apart than that, (2) attractors farther apart than their points are from each
            other: L / N on a closed curve of length L
Fails       attractors nearer to each other than that count as one; k consecutive points in a part of a
            chaotic attractor that its own points hardly visit make a second one
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.lazy import xr
from vibroimpact._core.types import Flags, Floats
from vibroimpact.attractors.point_sets import SHORTER_PERIOD_DISTANCE
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation import sections

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

# This is the distance of (1): a member within 1e-6 per period of a return, multiplier up to 0.999.
MEMBER_DISTANCE = 1e-3
DISTANCE_QUANTILE = 0.99  # this is the quantile of (2)


def observed_section(members: xr.Dataset) -> str:
    """Name of the section that an ensemble has: at impacts, or where there are none at a phase."""
    return "section" if "section_position" in members else "stroboscopic"


def strobe_symbols(points: Floats) -> NDArray[np.int64]:
    """Periods of members from their points at a phase, in the place of symbols: shape (..., 2).

    (p, p) where the points repeat after p of them, at most half of those that are there, to 1e-6;
    else zeros. The second column counts points as :func:`count_attractors` counts impacts.

    ``points``: shape (..., k, dimension), missing points NaN.
    """
    k = points.shape[-2]
    found = np.zeros(points.shape[:-2], dtype=np.int64)
    for period in range(k // 2, 0, -1):
        apart = np.linalg.norm(points[..., period:, :] - points[..., :-period, :], axis=-1)
        found = np.where(
            (apart[..., -period:] <= SHORTER_PERIOD_DISTANCE).all(axis=-1), period, found
        )
    return np.stack([found, found], axis=-1)


def scale_of(members: xr.Dataset, system: System) -> sections.Scale:
    """Units of an ensemble with sections and impact speeds.

    From an impact speed |row . v|, a velocity before the impact was at least |row . v| / |row|,
    with |row| the sum of the absolute values.
    """
    section = observed_section(members)
    position, velocity, time = (
        members[f"{section}_{kind}"].values for kind in ("position", "velocity", "time")
    )
    elements = mechanism_of(system).elements
    rows = max((sum(map(abs, e.row)) for e in elements if e.row), default=1.0)
    return sections.scale_of(
        position, velocity, members["speed_largest"].values / rows, time, system
    )


@dataclass(frozen=True)
class KnownAttractor:
    """Attractor given by its points; ``reach`` is the right side of (1) or (2)."""

    tree: cKDTree
    periodic: bool
    reach: float

    def contains(self, points: Floats) -> Flags:
        """Mask of the members, shape (m, k, dimension), on it; missing points are NaN, at the end."""
        looked = last(points)[:, None] if self.periodic else points
        there = np.asarray(np.isfinite(looked).all(axis=-1))
        distance = np.full(there.shape, np.nan)
        distance[there] = self.tree.query(looked[there])[0]
        middle = np.full(len(points), np.inf)
        some = there.any(axis=1)
        middle[some] = np.nanmedian(distance[some], axis=1)
        return np.asarray(middle <= self.reach)


def last(points: Floats) -> Floats:
    """Last point of each member, shape (m, dimension); NaN for one without points."""
    counts = np.isfinite(points).all(axis=-1).sum(axis=1)
    return np.asarray(points[np.arange(len(points)), np.maximum(counts, 1) - 1])


def known_attractor(
    points: Floats, periodic: bool, tolerance: float = MEMBER_DISTANCE, gap: float = 0.0
) -> KnownAttractor:
    """Attractor from its points, shape (n_point, dimension), without NaN.

    ``gap``: widest gap along a closed curve.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    if periodic or len(points) < 2:
        return KnownAttractor(tree, True, tolerance)
    own = tree.query(points, k=2)[0][:, 1]
    return KnownAttractor(tree, False, max(float(np.quantile(own, DISTANCE_QUANTILE)), 0.5 * gap))


def longest_gaps(points: Floats) -> Floats:
    """Longest edge of the minimum spanning tree of the points of each member, (4): shape (m,).

    By Prim's algorithm, for all members at once; points as in :func:`count_attractors`.
    """
    apart = np.linalg.norm(points[:, :, None] - points[:, None], axis=-1)
    apart = np.where(np.isfinite(apart), apart, np.inf)
    rows = np.arange(len(points))
    away, inside = apart[:, 0].copy(), np.zeros(points.shape[:2], dtype=bool)
    inside[:, 0] = True
    longest = np.zeros(len(points))
    for _ in range(points.shape[1] - 1):
        away[inside] = np.inf
        nearest = away.argmin(axis=1)
        step = away[rows, nearest]
        longest = np.where(np.isfinite(step), np.maximum(longest, step), longest)
        inside[rows, nearest] = True
        away = np.minimum(away, apart[rows, nearest])
    return longest


def proportional(symbols: NDArray[np.int64], symbol: NDArray[np.int64]) -> Flags:
    """Mask of symbols (m, k) with the impacts per forcing period of one (3); true for zeros."""
    largest = symbol.argmax()
    scaled = symbols * symbol[largest] == symbols[:, largest, None] * symbol
    return np.asarray(scaled.all(axis=1))


def count_symbols(symbols: NDArray[np.int64]) -> int:
    """Number of symbols (m, k) that are not proportional (3); zeros count only by themselves."""
    left, count = symbols[symbols.any(axis=1)], 0
    while len(left):
        left = left[~proportional(left, left[0])]
        count += 1
    return count or min(len(symbols), 1)


def count_attractors(
    points: Floats, symbols: NDArray[np.int64], column: int, tolerance: float = MEMBER_DISTANCE
) -> int:
    """Number of attractors of some members, by (1) and (4), independent of their order.

    Parameters
    ----------
    points
        Shape (member, k, dimension), missing points NaN, at the end.
    symbols
        n, all p, all q of each, shape (member, k), zeros where not periodic.
    column
        Column of ``symbols`` with the impacts at the stop.
    tolerance
        Tolerance of (1).
    """
    from scipy.spatial import cKDTree

    there = np.asarray(np.isfinite(points).all(axis=-1))
    left, impacts = there[:, 0].copy(), symbols[:, 1:].sum(axis=1)
    short = (impacts > 0) & (symbols[:, column] <= there.sum(axis=1))
    gaps = longest_gaps(points)
    count = 0
    for first in np.lexsort((np.where(short, impacts, -gaps), ~short)):  # short orbits, wide gaps
        if not left[first]:
            continue
        own = points[first][there[first]]
        reach = tolerance if short[first] else max(tolerance, float(gaps[first]))
        shape = KnownAttractor(cKDTree(own), bool(short[first]), reach)
        same = (short[first] | ~short) & proportional(symbols, symbols[first])
        left &= ~(same & shape.contains(points))
        left[first] = False
        count += 1
    return count
