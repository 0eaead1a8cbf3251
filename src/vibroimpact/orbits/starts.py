"""Random starts on the stops of any mechanism.

Method      Every stop k has a face, row_k . x = limit_k with all other gaps open; its centre is the
            place on it with the largest least gap (a linear programme).
            Short motions leave the centres with velocities up to (largest rate) x (size of the
            mechanism); the box spans their states at impacts, WIDER about its middle.          (1)
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
from scipy.optimize import linprog

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.model.mechanism import Mechanism, infinite, stop_sizes
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import simulate

SHORT = 32  # impacts of a motion that finds the box
SPEEDS = (0.03, 0.1, 0.3, 1.0)  # of these motions, as shares of the largest in (1)
WIDER = 1.5  # size of the box, relative to the span of the short motions


@dataclass(frozen=True)
class Face:
    """Stop that can be reached: its number and sides, and the centre of its face."""

    impact: Stop
    row: Floats
    limit: float
    centre: Floats


@dataclass(frozen=True)
class Starts:
    """Possible starts of motions of a system.

    Attributes
    ----------
    faces
        The stops that can be reached.
    low, high
        The box (1) of positions and velocities, shape (2n,).
    """

    mechanism: Mechanism
    faces: tuple[Face, ...]
    low: Floats
    high: Floats

    @property
    def widths(self) -> Floats:
        """Units of distances: the box's largest width of positions, and of velocities."""
        n = self.mechanism.degrees
        width = self.high - self.low
        place = width[:n].max() or _size(self.mechanism)
        return np.repeat([place, width[n:].max()], n)

    def draw(self, rng: np.random.Generator, number: int) -> State:
        """Draw a random start (2) on a stop; the stops are taken in turn."""
        face = self.faces[number % len(self.faces)]
        n = self.mechanism.degrees
        y = rng.uniform(self.low, self.high)
        place = y[:n] + face.row * ((face.limit - face.row @ y[:n]) / (face.row @ face.row))
        share = _share(self.mechanism, face, place)
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
    visited = [_visited(system, face, share * fastest) for face in faces for share in SPEEDS]
    points = np.vstack(visited)
    middle = (points.max(axis=0) + points.min(axis=0)) / 2.0
    half = WIDER * np.ptp(points, axis=0) / 2.0
    return Starts(m, faces, middle - half, middle + half)


def _stops(m: Mechanism) -> list[Stop]:
    return [
        Stop(i, side)
        for i, contact in enumerate(m.contacts)
        for side, limit in ((1, contact.upper), (-1, contact.lower))
        if not infinite(limit)
    ]


def _size(m: Mechanism) -> float:
    """A length of the mechanism: its largest limit or its largest forced displacement."""
    forced = [
        np.abs(np.linalg.solve(m.mass, part)).max() / line.omega**2
        for line in m.forces
        for part in (line.sine, line.cosine)
    ]
    return float(max([*stop_sizes(m), *forced])) or 1.0


def _gaps(m: Mechanism) -> tuple[Floats, Floats]:
    """(G, g) with G x <= g where no gap is negative."""
    rows, limits = [], []
    for stop in _stops(m):
        rows.append(stop.side * np.array(m.contacts[stop.contact].row))
        limits.append(stop.side * stop.limit(m.contacts))
    return np.array(rows), np.array(limits)


def _face(m: Mechanism, impact: Stop) -> Face | None:
    """The face of a stop; None where other stops hide it."""
    contact = m.contacts[impact[0]]
    row, limit = np.array(contact.row), contact.upper if impact[1] > 0 else contact.lower
    others = [k for k, stop in enumerate(_stops(m)) if stop[0] != impact[0]]
    rows, limits = _gaps(m)
    n, size = m.degrees, _size(m)
    least = np.concatenate([rows[others], np.ones((len(others), 1))], axis=1)
    found = linprog(
        c=np.append(np.zeros(n), -1.0),  # the largest least gap t: G x + t <= g
        A_ub=least if others else None,
        b_ub=limits[others] if others else None,
        A_eq=np.append(row, 0.0)[None, :],
        b_eq=[limit],
        bounds=[(None, None)] * n + [(0.0, size)],
    )
    return Face(impact, row, limit, found.x[:n]) if found.status == 0 else None


def _share(m: Mechanism, face: Face, place: Floats) -> float:
    """Largest share, at most 1, of the way from a face's centre to a place without negative gap."""
    rows, limits = _gaps(m)
    room, used = limits - rows @ face.centre, rows @ (place - face.centre)
    # along the face itself the step changes nothing but rounding
    ahead = used > 1e-12 * np.abs(limits).max(initial=np.abs(used).max())
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
    horizon = SHORT * 2.0 * math.pi / m.omega if m.omega else math.inf
    run = simulate(system, start, impacts=SHORT, t_max=horizon)
    points = np.column_stack([run.position, run.velocity_after])
    return np.vstack([[*start.position, *start.velocity], points])
