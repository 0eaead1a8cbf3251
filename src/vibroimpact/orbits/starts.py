"""Random starts on the stops of any mechanism.

Method      Every stop k has a face, row_k . x = limit_k with all other gaps open; its centre is the
            place on it with the largest least gap (a linear programme).
            Short motions leave the centres with velocities up to (largest rate) x (size of the
            mechanism); the box spans their states at impacts, BOX_FACTOR about its middle.         (1)
            A start is a random place of the box, moved along row_k onto the face and from there
            towards its centre until no gap is negative, with a random velocity of the box,
            reflected where it would enter the stop, at a random phase.                         (2)
Assumes     nothing: a stop that others hide has no face and is left out
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Floats
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism, accelerations, stop_sizes
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import simulate

BOX_IMPACTS = 32  # a motion that finds the box has so many impacts
# These motions start with such shares of the largest speed in (1).
BOX_SPEED_SHARES = (0.03, 0.1, 0.3, 1.0)
ROUNDING_OF_LENGTH = 1e-12  # a width that is smaller is none: one coordinate on one stop
BOX_FACTOR = 1.5  # the box is so many times as wide as the span of the short motions


@dataclass(frozen=True)
class Face:
    """Stop that can be reached: its number and sides, and the centre of its face."""

    impact: Stop
    row: Floats
    limit: float
    centre: Floats


@dataclass(frozen=True)
class Starts:
    """Possible starts of motions of a system."""

    mechanism: Mechanism
    faces: tuple[Face, ...]  # the stops that can be reached
    # the box (1) of positions and velocities, shape (2n,)
    low: Floats
    high: Floats

    @property
    def widths(self) -> Floats:
        """Units of distances: the box's largest width of positions, and of velocities."""
        return widths_of(self.low, self.high, _size(self.mechanism))

    def draw(self, rng: np.random.Generator, number: int) -> State:
        """Draw a random start (2) on a stop; the stops are taken in turn."""
        face = self.faces[number % len(self.faces)]
        n = self.mechanism.degrees
        y = rng.uniform(self.low, self.high)
        place = y[:n] + face.row * ((face.limit - face.row @ y[:n]) / (face.row @ face.row))
        rows, limits, _ = gaps_of(self.mechanism)
        share = share_of(rows, limits, face.centre, place)
        phase = rng.uniform(0.0, 2.0 * math.pi)
        place = face.centre + share * (place - face.centre)
        return State(tuple(place), tuple(_leaving(face, y[n:])), phase)


def starts_of(system: System) -> Starts:
    """The faces and the box (1) of a system."""
    m = mechanism_of(system)
    faces = tuple(face for impact in _stops(m) if (face := _face(m, impact)))
    if not faces:
        raise InvalidParameterError("contacts: no stop can be reached; each is behind another one.")
    compiled = compile_prescribed(system)
    fastest = compiled.rate * _size(m)
    visited = [
        _visited(system, face, share * fastest) for face in faces for share in BOX_SPEED_SHARES
    ]
    points = np.vstack(visited)
    middle = (points.max(axis=0) + points.min(axis=0)) / 2.0
    half = BOX_FACTOR * np.ptp(points, axis=0) / 2.0
    return Starts(m, faces, middle - half, middle + half)


def _stops(m: Mechanism) -> list[Stop]:
    return [
        Stop(i, side)
        for i, contact in enumerate(m.rigid_stops)
        for side, limit in ((1, contact.upper), (-1, contact.lower))
        if not is_infinite(limit)
    ]


def _size(m: Mechanism) -> float:
    """A length of the mechanism: its largest limit or its largest forced displacement."""
    forced = [
        np.abs(accelerations(m, part)).max() / line.omega**2
        for line in m.forces
        for part in (line.sine, line.cosine)
    ]
    return float(max([*stop_sizes(m), *forced])) or 1.0


def widths_of(low: Floats, high: Floats, length: float) -> Floats:
    """Units of distances in a box of (x, v): its largest widths; a length where its width is rounding."""
    width, n = high - low, len(low) // 2
    place = width[:n].max()
    return np.repeat([place if place > ROUNDING_OF_LENGTH * length else length, width[n:].max()], n)


Moved = tuple[int, tuple[Harmonic, ...]]


def gaps_of(m: Mechanism) -> tuple[Floats, Floats, list[Moved]]:
    """(G, g) with G x <= g where no gap is negative, stops at rest; side and motion of each stop."""
    stops = _stops(m)
    rows = [stop.side * np.array(m.rigid_stops[stop.contact].row) for stop in stops]
    limits = [stop.side * stop.limit(m.rigid_stops) for stop in stops]
    moved = [(stop.side, m.rigid_stops[stop.contact].motion) for stop in stops]
    return np.array(rows).reshape(-1, m.degrees), np.array(limits), moved


def _face(m: Mechanism, impact: Stop) -> Face | None:
    """The face of a stop; None where other stops hide it."""
    contact = m.rigid_stops[impact[0]]
    row, limit = np.array(contact.row), contact.upper if impact[1] > 0 else contact.lower
    others = [k for k, stop in enumerate(_stops(m)) if stop[0] != impact[0]]
    rows, limits, _ = gaps_of(m)
    centre = centre_of(rows[others], limits[others], _size(m), (row, limit))
    return None if centre is None else Face(impact, row, limit, centre)


def centre_of(
    rows: Floats, limits: Floats, size: float, face: tuple[Floats, float] | None = None
) -> Floats | None:
    """The place with the largest least gap, at most a size, on row . x = limit if a face is given.

    None where there is no place without negative gap.
    """
    from scipy.optimize import linprog

    n = rows.shape[1]
    found = linprog(
        c=np.append(np.zeros(n), -1.0),  # the largest least gap t: G x + t <= g
        A_ub=np.concatenate([rows, np.ones((len(rows), 1))], axis=1) if len(rows) else None,
        b_ub=limits if len(rows) else None,
        A_eq=np.append(face[0], 0.0)[None, :] if face else None,
        b_eq=[face[1]] if face else None,
        bounds=[(None, None)] * n + [(0.0, size)],
    )
    return np.asarray(found.x[:n]) if found.status == 0 else None


def share_of(rows: Floats, limits: Floats, centre: Floats, place: Floats) -> float:
    """Largest share, at most 1, of the way from a centre to a place without negative gap."""
    room, used = limits - rows @ centre, rows @ (place - centre)
    # along the face itself the step changes nothing but rounding
    ahead = used > 1e-12 * np.abs(limits).max(initial=np.abs(used).max(initial=0.0))
    return float(np.min(room[ahead] / used[ahead], initial=1.0)) if ahead.any() else 1.0


def _leaving(face: Face, velocity: Floats) -> Floats:
    """A velocity that leaves the stop: its normal part reflected where it would enter."""
    normal = face.row * (face.row @ velocity) / (face.row @ face.row)
    return velocity - 2.0 * normal if face.impact[1] * (face.row @ velocity) > 0.0 else velocity


def _visited(system: System, face: Face, speed: float) -> Floats:
    """Positions and velocities at the start and the impacts of a short motion from a face."""
    m = mechanism_of(system)
    away = -face.impact[1] * face.row / np.linalg.norm(face.row)
    start = State(tuple(face.centre), tuple(speed * away))
    horizon = BOX_IMPACTS * 2.0 * math.pi / m.omega if m.omega else math.inf
    run = simulate(system, start, impacts=BOX_IMPACTS, t_max=horizon)
    points = np.column_stack([run.position, run.velocity_after])
    return np.vstack([[*start.position, *start.velocity], points])
