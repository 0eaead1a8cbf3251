"""Type n-p-q of a periodic motion, its multipliers, and the symmetry of attractors.

Method      n = elapsed forcing periods, p and q = impacts at stops A and B while the orbit closes
            multipliers: eigenvalues of the Jacobian of the closed loop of impacts in the section,
            from tangents dz along it that stay on the stop, row . dx = 0                    (1)
            symmetric: the states at stop B, mapped by (x, v, theta) -> (-x, -v, theta + pi), are
            those at stop A                                                                  (2)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes, Count
from vibroimpact.attractors.point_sets import InvariantSet, Kind
from vibroimpact.attractors.windows import Window
from vibroimpact.model.system import mechanism_of
from vibroimpact.simulation.places import AtStop
from vibroimpact.simulation.sections import Scale
from vibroimpact.simulation.simulate import RunEnd, Status, events_for, flight_limit_of, phases_of
from vibroimpact.simulation.simulator import Impacts, Simulator

# Elapsed time over forcing periods may miss an integer by the return tolerance and rounding.
WHOLE_PERIODS = 1e-6
# Mirror images of a periodic orbit agree to the return tolerance, amplified by the map between.
MIRROR_TOLERANCE = 1e-6
# Points of a curve lie up to half the widest gap from those of its mirror image; the other stop
# stretches the gap by a factor of order 1, here at most 4.
MIRROR_GAPS = 2.0


class OrbitType(NamedTuple):
    """n-p-q: forcing periods, impacts at stops A and B of one contact, until the orbit closes."""

    n_periods: Count
    impacts_a: Count
    impacts_b: Count

    def __str__(self) -> str:
        impacts = f"{self.impacts_a}-{self.impacts_b}"
        return f"{self.n_periods}-{impacts}" if self.n_periods else impacts


def symbol_word(n: int, counts: Sequence[Sequence[float]]) -> str:
    """n-p-q with a pair p-q for every contact that impacts: "1-1-1", "1-1-1,0-2".

    Parameters
    ----------
    n
        Forcing periods; 0 without forcing, or where the time is no whole number of them. There is
        no n then: "1-0".
    counts
        Impacts at stops A and B of every contact, shape (contact, 2); infinite, "inf", where a
        motion chatters. Contacts are named unless
        they are the first ones: "1-2-1 (contact 1)". Without impacts "3-0-0".
    """
    struck = [contact for contact, pair in enumerate(counts) if any(pair)] or [0]
    pairs = ",".join("{}-{}".format(*counts[contact]) for contact in struck)
    word = f"{n}-{pairs}" if n else pairs
    first = struck == list(range(len(struck)))
    return word if first else f"{word} (contact {', '.join(map(str, struck))})"


def loop_of(shape: InvariantSet, window: Window) -> tuple[int, int]:
    """Indices of impacts: the last closed loop has those after the first, up to the last."""
    part, section = window.part, window.section
    if isinstance(section.at, AtStop):
        here = part.at(section.at.contact, section.at.stop)
        return int(here[-1 - shape.period]), int(here[-1])
    ends = section.time[[-1 - shape.period, -1]]
    first, last = np.searchsorted(part.time, ends, side="right") - 1
    return int(first), int(last)


def orbit_type(shape: InvariantSet, window: Window) -> OrbitType | None:
    """n-p-q of a periodic motion, None for others; n = 0 if the time is no whole number."""
    if shape.kind is not Kind.PERIODIC:
        return None
    section = window.section
    elapsed = section.time[-1] - section.time[-1 - shape.period]
    periods = float(elapsed) * mechanism_of(section.system).omega / (2.0 * np.pi)
    whole = round(periods) if abs(periods - round(periods)) <= WHOLE_PERIODS * periods else 0
    contact = section.at.contact if isinstance(section.at, AtStop) else 0
    return OrbitType(whole, *_counts(window.part, *loop_of(shape, window), contact))


def orbit_symbol(kind: OrbitType | None, shape: InvariantSet, window: Window) -> str:
    """n-p-q of all contacts of a periodic motion of this type, empty for others."""
    if kind is None:
        return ""
    first, last = loop_of(shape, window)
    contacts = range(len(mechanism_of(window.section.system).elements))
    return symbol_word(kind.n_periods, [_counts(window.part, first, last, c) for c in contacts])


def _counts(part: Impacts, first: int, last: int, contact: int) -> tuple[int, int]:
    """Impacts at stops A and B of a contact in a closed loop."""
    side = part.side[first + 1 : last + 1][part.contact[first + 1 : last + 1] == contact]
    return int((side == 1).sum()), int((side == -1).sum())


def multipliers(motion: Simulator, shape: InvariantSet, window: Window) -> Complexes | None:
    """Floquet multipliers of a periodic motion, largest first.

    By (1). None for other kinds, for orbits with chatter or sticking (where the loop does not start
    from an ordinary impact), with several forcing lines, and for points that are at no stop.
    """
    lines = len(motion.compiled.mechanism.forces)
    if shape.kind is not Kind.PERIODIC or window.part.sticks or lines > 1:
        return None
    at = window.section.at
    return _of_impacts(motion, shape, window, at) if isinstance(at, AtStop) else None


def _of_impacts(
    motion: Simulator, shape: InvariantSet, window: Window, at: AtStop
) -> Complexes | None:
    """Multipliers by (1)."""
    from scipy.linalg import null_space

    mechanism, part = motion.compiled.mechanism, window.part
    first, last = loop_of(shape, window)
    if not np.all(np.isin(part.status[first : last + 1], (Status.IMPACT, Status.ENGAGE))):
        return None
    stop = mechanism.elements[at.contact]
    row = np.array(stop.row)[None, :]
    n, lines = len(row[0]), len(mechanism.forces)
    basis = np.zeros((2 * n + lines, 2 * n + lines - 1))
    basis[:n, : n - 1] = null_space(row)
    basis[n:, n - 1 :] = np.eye(n + lines)
    if stop.motion:  # tangents stay on the stop as it moves
        phase = float(part.phase[first])
        speed = sum(m.sine[0] * np.cos(phase) - m.cosine[0] * np.sin(phase) for m in stop.motion)
        basis = null_space(np.hstack([row, np.zeros((1, n)), [[-speed]]]))
    x, v = part.position[first].tolist(), part.velocity[first].tolist()
    count = last - first
    result = motion.compiled.kernel.tangents(
        x, v, phases_of(mechanism, float(part.phase[first])), basis, math.inf,
        flight_limit_of(motion.compiled), events_for(mechanism, count), count,
    )  # fmt: skip
    if RunEnd(result["why"]) is not RunEnd.IMPACTS:
        return None
    values: Complexes = np.linalg.eigvals(basis.T @ result["columns"]).astype(complex)
    return values[np.argsort(-np.abs(values))]


def is_symmetric(shape: InvariantSet, window: Window, scale: Scale) -> bool | None:
    """Whether an attractor is its own mirror image (2).

    None for chaos, the undecided, and where points are at no stop.
    """
    from scipy.spatial import cKDTree

    part, at = window.part, window.section.at
    decided = shape.kind in (Kind.PERIODIC, Kind.QUASIPERIODIC)
    if not decided or not isinstance(at, AtStop):
        return None
    tail = 2 * shape.period if shape.kind is Kind.PERIODIC else len(part.high)
    a, b = (part.at(at.contact, stop)[-tail:] for stop in ("A", "B"))
    if not a.size or not b.size:
        return False
    here, there = (
        scale.points(part.position[on], part.velocity[on], part.phase[on]) for on in (a, b)
    )
    there = -there
    distance = max(cKDTree(here).query(there)[0].max(), cKDTree(there).query(here)[0].max())
    allowed = MIRROR_GAPS * shape.curve.widest_gap if shape.curve else MIRROR_TOLERANCE
    return bool(distance <= allowed)
