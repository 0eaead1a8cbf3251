"""Random starts between the stops, of machines whose stops move or that have elements.

Method      Lengths of the machine are those of its stops and their motions, and the displacements
            |M^-1 f| / rate^2 by its forces, loads and friction; speeds are (length) x (rate), with
            the fastest rate of the machine without its elements, or of its lines.          (1)
            Short motions leave the centre, the place with the largest least gap to the rigid stops, with
            velocities along every coordinate up to that speed; the box spans them, BOX_FACTOR about its
            middle. Those that diverge do not count.                                        (2)
            A start is a random state of the box at a random phase, moved towards the centre of that
            phase until no gap of a rigid stop is negative. It may be beyond a soft stop. With sliders
            it is halved until none of them is pulled beyond its level, where no motion begins. (3)
Assumes     at every phase there is a place between the rigid stops
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism, accelerations, stop_sizes
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.starts import (
    BOX_FACTOR,
    BOX_IMPACTS,
    BOX_SPEED_SHARES,
    centre_of,
    gaps_of,
    share_of,
    widths_of,
)
from vibroimpact.simulation.simulate import Run, RunEnd, simulate

MOTION_SAMPLES = 256  # each short motion is sampled so often
SAME_TIME = 1e-9  # events that are so near, in units of time, are at once
HALVINGS = 20
# A start goes this share of the way to a stop: rounding leaves no gap negative.
INSIDE_SHARE = 1.0 - 1e-9


@dataclass(frozen=True)
class StartsBetween:
    """Possible starts of motions of a system."""

    mechanism: Mechanism
    length: float  # the largest of the lengths (1)
    # the box (2) of positions and velocities, shape (2n,)
    low: Floats
    high: Floats

    @property
    def widths(self) -> Floats:
        """Units of distances: the box's largest width of positions, and of velocities."""
        return widths_of(self.low, self.high, self.length)

    def draw(self, rng: np.random.Generator, number: int) -> State:
        """Draw a random start (3); all numbers are alike."""
        del number
        m, n = self.mechanism, self.mechanism.degrees
        y, phase = rng.uniform(self.low, self.high), rng.uniform(0.0, 2.0 * math.pi)
        centre = _centre(m, phase, self.length)
        rows, limits = _gaps_at(m, phase)
        share = INSIDE_SHARE * share_of(rows, limits, centre, y[:n])
        place, speed = share * (y[:n] - centre), y[n:]
        for halvings in range(HALVINGS + 1):
            part = 0.5**halvings
            start = State(tuple(centre + part * place), tuple(part * speed), phase)
            if not m.sliders or not _undecided(m, start):
                break
        return start


def _undecided(m: Mechanism, start: State) -> bool:
    """Whether no motion begins at a state: a slider is pulled beyond its level."""
    return simulate(m, start, impacts=1, t_max=SAME_TIME).end is RunEnd.UNDECIDED


def starts_between(system: System) -> StartsBetween:
    """The box (2) of a system.

    Raises
    ------
    InvalidParameterError
        Rigid stops that leave no place between them.
    """
    m = mechanism_of(system)
    length, rate = _sizes(m, compile_prescribed(system).rate)
    centre = _centre(m, 0.0, length)
    ways = [sign * along for along in np.eye(m.degrees) for sign in (1.0, -1.0)]
    visited = [
        _visited(system, State(tuple(centre), tuple(share * length * rate * way)), rate)
        for way in ways
        for share in BOX_SPEED_SHARES
    ]
    points = np.vstack(visited)
    middle = (points.max(axis=0) + points.min(axis=0)) / 2.0
    half = BOX_FACTOR * np.ptp(points, axis=0) / 2.0
    return StartsBetween(m, length, middle - half, middle + half)


def _sizes(m: Mechanism, stiffest: float) -> tuple[float, float]:
    """Largest length and rate (1); the rate with all elements pressed where it has no other."""
    modes = np.linalg.eigvals(accelerations(m, m.stiffness))
    rate = max([math.sqrt(np.abs(modes).max()), *(line.omega for line in m.forces)]) or stiffest
    moved = [amplitude for e in m.elements for amplitude in _amplitudes(e.motion)]
    forces: list[tuple[float, ...]] = [m.constant_force]
    impulses: list[tuple[float, ...]] = []
    for line in m.forces:
        forces += [line.sine, line.cosine]
    for e in m.switching:
        forces += e.own_forces
        impulses += e.own_impulses
        moved.append(abs(e.grip.speed) / rate)
    for given, unit in ((forces, rate**2), (impulses, rate)):
        moved += [float(np.abs(accelerations(m, f)).max()) / unit for f in given]
    return float(max([*stop_sizes(m), *moved])) or 1.0, rate


def _amplitudes(lines: tuple[Harmonic, ...]) -> list[float]:
    return [abs(part) for line in lines for part in (*line.sine, *line.cosine)]


def _gaps_at(m: Mechanism, phase: float) -> tuple[Floats, Floats]:
    """(G, g) with G x <= g where no gap of a rigid stop is negative at a phase."""
    rows, limits, moved = gaps_of(m)
    return rows, limits + [side * _place(m, lines, phase) for side, lines in moved]


def _place(m: Mechanism, lines: tuple[Harmonic, ...], phase: float) -> float:
    """Place of a motion at a phase of the first line."""
    turns = [phase * line.omega / m.omega for line in lines]
    return sum(
        line.sine[0] * math.sin(t) + line.cosine[0] * math.cos(t)
        for line, t in zip(lines, turns, strict=True)
    )


def _centre(m: Mechanism, phase: float, length: float) -> Floats:
    """The place with the largest least gap to the rigid stops at a phase, of at most a length."""
    rows, limits = _gaps_at(m, phase)
    if not len(rows):
        return np.zeros(m.degrees)
    centre = centre_of(rows, limits, length)
    if centre is None:
        raise InvalidParameterError(
            f"contacts: at the phase {phase:.6g} there is no place between the stops. Move them apart."
        )
    return centre


def _visited(system: System, start: State, rate: float) -> Floats:
    """Positions and velocities of a short motion; its start where it diverges."""
    m = mechanism_of(system)
    run = simulate(
        system, start, impacts=BOX_IMPACTS, t_max=BOX_IMPACTS * 2.0 * math.pi / (m.omega or rate)
    )
    begun = np.array([[*start.position, *start.velocity]])
    if run.end is RunEnd.DIVERGED or not len(run):
        return begun
    return np.vstack([begun, _sampled(run)])


def _sampled(run: Run) -> Floats:
    return np.column_stack(run.at(np.linspace(0.0, run.time[-1], MOTION_SAMPLES)))
