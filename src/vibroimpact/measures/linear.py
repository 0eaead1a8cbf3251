"""The motion of a machine without impacts, in closed form.

Method      With all stops open a machine is linear: for every forcing line
                (K - omega^2 M + i omega C) X = F,      x(t) = x0 + sum of Re X exp(i omega t).    (1)
            A free mass, along which K and the forces vanish, stands anywhere; it is put where the
            least gap is largest, a linear programme.                                           (2)
Accuracy    rounding, times the condition of (1)
Fails       a sentence: no forcing, an element that acts without being met, a force that nothing
            holds, resonance of an undamped machine
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.pencils import solved
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.compile.piecewise import Piecewise
from vibroimpact.measures.flights import Flights, Rows, Struck, rows_of
from vibroimpact.model.mechanism import Mechanism, accelerations, with_mass
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.problem import forcing_repeats, least_cycles
from vibroimpact.orbits.stability import Stability, stability_of

FREE_MODE = 0  # all stops open, and no element acts
ZERO_RELATIVE = 1e-12  # smaller stiffness and forces vanish but for rounding


class Reach(NamedTuple):
    """Least gap that a motion leaves at a stop, and its place in the motion of the contact."""

    stop: Stop
    gap: float


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """Steady motion of a forced machine without impacts, all stops open."""

    system: System
    # displacement along which nothing holds the machine, shape (n,): a free mass stands anywhere
    offset: Floats = field(repr=False)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the system."""
        return mechanism_of(self.system)

    @cached_property
    def cycles(self) -> int:
        """Forcing periods until it repeats."""
        return least_cycles(self.mechanism)

    @property
    def symbol(self) -> str:
        """Symbol n-0-0."""
        return f"{self.cycles}-0-0"

    @property
    def period(self) -> float:
        """Time until it repeats."""
        return 2.0 * math.pi * self.cycles / self.mechanism.omega

    def flights(self, parameter: str = "") -> Flights:
        """The motion as one flight, with its derivatives by a parameter."""
        return _flights(rows_of(self.system, parameter), self.offset[None], self.cycles)

    @cached_property
    def reaches(self) -> list[Reach]:
        """Least gap at every stop, soft ones included; negative beyond it."""
        return next(_reaches(self.flights(), [self.mechanism]))

    @property
    def touching_factor(self) -> float:
        """Factor by which the force must grow, or the gaps be divided, until a stop is touched.

        NaN for several forces or a constant one.
        """
        m = self.mechanism
        if len(m.forces) != 1 or any(m.constant_force):
            return math.nan
        flights, sizes = self.flights(), {}
        for number, part in enumerate(m.elements):
            if part.is_stop:
                (low, _), (high, _) = flights.signal(
                    partial(flights.rows.gap, part=number)
                ).extremes()
                sizes[number] = float(high[0] - low[0]) / 2.0
        factors = (
            1.0 + reach.gap / size for reach in self.reaches if (size := sizes[reach.stop.contact])
        )
        return min(factors, default=math.inf)

    @property
    def clearance_to_grazing(self) -> float:
        """Least gap; infinite without stops."""
        return min((reach.gap for reach in self.reaches), default=math.inf)

    @property
    def admissible(self) -> bool:
        """Whether no stop is crossed."""
        return self.clearance_to_grazing >= 0.0

    @property
    def stability(self) -> Stability:
        """Whether it is stable, neutral, unstable, or not admissible."""
        return self.stability_opened if self.admissible else Stability.INADMISSIBLE

    @property
    def stability_opened(self) -> Stability:
        """Stability with all stops open: where a mass stands anywhere it is neutral."""
        held, free, _ = self._held
        return max(stability_of(held), Stability.NEUTRAL if free else Stability.STABLE)

    @property
    def stable(self) -> bool:
        """Whether it is admissible and all motions near it settle on it."""
        return self.stability is Stability.STABLE

    @property
    def family_dimension(self) -> int:
        """Number of directions along which no spring holds the machine: in each it stands anywhere."""
        return self._held[1]

    @property
    def attracting(self) -> bool:
        """Whether it, or the family that it is one of, attracts starts of positive measure.

        It does not where a free mass that has any speed drifts until it meets a stop.
        """
        return self.admissible and self.settles and not self._held[2]

    @property
    def settles(self) -> bool:
        """Whether all motions that something holds die out."""
        return stability_of(self._held[0]) is Stability.STABLE

    @cached_property
    def _held(self) -> tuple[Complexes, int, bool]:
        """Multipliers of all that something holds, number of free directions, whether some of them drift.

        Multipliers are those over the slowest time, so that what dies out at all is inside the unit circle.
        """
        m = self.mechanism
        unheld, rates = loose(m), np.linalg.eigvals(_matrix(m))
        drifting = 0
        if len(unheld):  # along directions without a dashpot
            _, sizes, directions = np.linalg.svd(np.array(m.damping) @ unheld.T)
            coasting = directions[sizes <= ZERO_RELATIVE * np.abs(m.damping).max()] @ unheld
            drifting = int(np.linalg.matrix_rank(coasting @ m.mass)) if len(coasting) else 0
        held = rates[np.argsort(np.abs(rates))][len(unheld) + drifting :]
        fastest = float(np.abs(rates).max())
        return np.exp(held.real / (fastest or 1.0)).astype(complex), len(unheld), drifting > 0


def _flights(rows: Rows, offsets: Floats, cycles: int) -> Flights:
    """The motions of systems as one flight each, displaced by offsets, shape (k, n)."""
    state, by = _states(rows, offsets)
    none = Struck(np.array([], dtype=np.int64), [])
    period = 2.0 * math.pi * cycles / rows.omega
    of = np.arange(rows.count)
    return Flights(rows, state, period.value, (FREE_MODE,) * rows.count, none, by, period.by, of)


def _states(rows: Rows, offsets: Floats) -> tuple[Floats, Floats]:
    """(x, v, theta) at phase zero of each system, by (1), and its derivative, shape (k, 2n + 1)."""
    n = rows.mechanism.degrees
    every = rows.numbers("linear", _equations)
    mass, damping, stiffness = (every[:, at : at + n] for at in (0, n, 2 * n))
    inverse, constant = np.linalg.pinv(stiffness.value), every[:, 3 * n]
    x0 = _times(inverse, constant.value)
    state, by = np.zeros((rows.count, 2 * n + 1)), np.zeros((rows.count, 2 * n + 1))
    state[:, :n] = x0 + offsets
    by[:, :n] = _times(inverse, constant.by - _times(stiffness.by, x0))
    for line in range(len(rows.mechanism.forces)):
        sine, cosine = (every[:, 3 * n + 1 + 2 * line + k] for k in (0, 1))
        w, w_by = (part[:, line, None, None] for part in rows.omegas)
        matrix = stiffness.value + 1j * w * damping.value - w * w * mass.value
        moved = stiffness.by + 1j * (w_by * damping.value + w * damping.by)
        moved = moved - 2.0 * w * w_by * mass.value - w * w * mass.by
        x = solved(matrix, (cosine.value - 1j * sine.value)[..., None])[..., 0]
        driven = cosine.by - 1j * sine.by - _times(moved, x)
        x_by = solved(matrix, driven[..., None])[..., 0]
        w, w_by = w[:, 0], w_by[:, 0]
        state[:, :n] += x.real
        by[:, :n] += x_by.real
        state[:, n : 2 * n] += (1j * w * x).real
        by[:, n : 2 * n] += (1j * (w_by * x + w * x_by)).real
    return state, by


def _equations(pieces: Piecewise) -> list[list[float]]:
    """Mass, damping, stiffness, constant force, sine and cosine of each line, one below the other."""
    m = pieces.mechanism
    rows = [*m.mass, *m.damping, *m.stiffness, m.constant_force]
    return [
        [*row] for row in (*rows, *(x for force in m.forces for x in (force.sine, force.cosine)))
    ]


def _times(matrices: Any, vectors: Any) -> Any:
    """Matrices (k, n, n) times vectors (k, n)."""
    return np.einsum("kij,kj->ki", matrices, vectors)


def _reaches(flights: Flights, machines: Sequence[Mechanism]) -> Iterator[list[Reach]]:
    """Least gaps of the motion of each machine at every stop, negative beyond it."""
    stops = [number for number, part in enumerate(machines[0].elements) if part.is_stop]
    ranges = [
        [end.value for end in flights.signal(partial(flights.rows.gap, part=number)).extremes()]
        for number in stops
    ]
    for k, machine in enumerate(machines):
        found = []
        for number, (low, high) in zip(stops, ranges, strict=True):
            part = machine.elements[number]
            found.append(Reach(Stop(number, 1), part.limit_at(1) - float(high[k])))
            found.append(Reach(Stop(number, -1), float(low[k]) - part.limit_at(-1)))
        yield [reach for reach in found if math.isfinite(reach.gap)]


def _matrix(m: Mechanism) -> Floats:
    """A of s' = A s, s = (x, v), all stops open, without the speeds of massless coordinates: they are rows on s."""
    n, light, heavy = m.degrees, m.massless, with_mass(m)
    damping = np.array(m.damping)
    speeds, pull = np.zeros((n, n + len(heavy))), np.zeros((n, n + len(heavy)))
    speeds[heavy, n:] = np.eye(len(heavy))
    pull[:, :n] = -np.array(m.stiffness)
    if light:
        rest = pull[light] - damping[light] @ speeds
        speeds[light] = np.linalg.solve(damping[np.ix_(light, light)], rest)
    found: Floats = np.vstack([speeds, accelerations(m, pull - damping @ speeds)[heavy]])
    return found


def natural_frequencies(m: Mechanism) -> Floats:
    """Angular frequencies at which the machine vibrates with all stops open, rising."""
    turning = np.linalg.eigvals(_matrix(m)).imag
    found: Floats = np.sort(turning[turning > 0.0])
    return found


def loose(m: Mechanism) -> Floats:
    """Directions along which no spring holds the machine, shape (k, n)."""
    _, sizes, directions = np.linalg.svd(np.array(m.stiffness))
    found: Floats = directions[sizes <= ZERO_RELATIVE * sizes.max()]
    return found


def free_motion(system: System, *, opened: bool = False) -> FreeMotion | str:
    """Return the steady motion without impacts, admissible or not; a sentence where there is none.

    Parameters
    ----------
    system
        The system.
    opened
        Leave all elements out, friction and phase switches too: the linear machine.
    """
    if why := _why_none(mechanism_of(system), opened=opened):
        return why
    return _placed([system], rows_of(system))[0]


def free_motions(
    system: System, name: str, values: Floats, *, opened: bool = False
) -> list[FreeMotion | str]:
    """Return the steady motions without impacts, as :func:`free_motion`, at values of a parameter."""
    systems = [with_parameter(system, name, value) for value in values.tolist()]
    found: list[FreeMotion | str] = [_why_none(mechanism_of(one), opened=opened) for one in systems]
    some = [k for k, why in enumerate(found) if not why]
    if some:
        placed = _placed([systems[k] for k in some], Rows(systems[some[0]], name, values[some]))
        for k, motion in zip(some, placed, strict=True):
            found[k] = motion
    return found


def flights_of_motions(motions: Sequence[FreeMotion], name: str, values: Floats) -> Flights:
    """Flights of motions of a machine at values of a parameter, with derivatives by it."""
    offsets = np.array([motion.offset for motion in motions])
    return _flights(Rows(motions[0].system, name, values), offsets, motions[0].cycles)


def _why_none(m: Mechanism, *, opened: bool = False) -> str:
    """Reason why there is no steady motion without impacts; "" if there may be one."""
    if not m.forces:
        return "there is no forcing"
    if m.sliders:
        at = next(iter(m.sliders.values()))
        return f"friction alone gives the motion of coordinate {at}, which has no mass"
    if not opened and not all(e.is_stop for e in m.elements):
        return "friction or a phase switch acts all the time"
    if not forcing_repeats(m, least_cycles(m)):
        return "the forcing frequencies have no common period"
    free, constant = loose(m), np.array(m.constant_force)
    if np.any(np.abs(free @ constant) > ZERO_RELATIVE * np.abs(constant).max(initial=0.0)):
        return "a constant force acts on a mass that no spring holds"
    return ""


def _placed(systems: Sequence[System], rows: Rows) -> list[FreeMotion | str]:
    """Motions of systems of the same shape, whose rows these are; free masses are put by (2)."""
    motions = [FreeMotion(one, np.zeros(rows.mechanism.degrees)) for one in systems]
    flights = _flights(rows, np.array([one.offset for one in motions]), motions[0].cycles)
    held = np.isfinite(flights.states).all(axis=1)
    if not held.all() and len(systems) > 1:  # those that resonate spoil no other
        return [_placed([one], rows_of(one))[0] for one in systems]
    if not held.all():
        return ["it resonates without damping"]
    found: list[FreeMotion | str] = []
    every = _reaches(flights, [one.mechanism for one in motions])
    for motion, reaches in zip(motions, every, strict=True):
        free = loose(motion.mechanism)
        offset = _centred(motion.mechanism, reaches, free) if len(free) else motion.offset
        if offset.any():
            motion = FreeMotion(motion.system, offset)
            rows_of_stops = (motion.mechanism.elements[reach.stop.contact].row for reach in reaches)
            reaches = [
                Reach(reach.stop, reach.gap - reach.stop.side * float(np.dot(row, offset)))
                for reach, row in zip(reaches, rows_of_stops, strict=True)
            ]
        vars(motion)["reaches"] = reaches  # known, in place of the cached property
        found.append(motion)
    return found


def _centred(m: Mechanism, reaches: list[Reach], free: Floats) -> Floats:
    """Offset along free directions with the largest least gap, (2)."""
    from scipy.optimize import linprog

    rows = [np.array(m.elements[reach.stop.contact].row) for reach in reaches]
    across = np.array(
        [reach.stop.side * (row @ free.T) for reach, row in zip(reaches, rows, strict=True)]
    )
    gaps = np.array([reach.gap for reach in reaches])
    if not gaps.size or not across.any():
        return np.zeros(m.degrees)
    k = len(free)
    limits = [abs(reach.stop.limit(m.elements)) for reach in reaches]
    least = across[gaps <= gaps.min() + ZERO_RELATIVE * max(*limits, np.abs(gaps).max())]
    if k == 1 and least.min() < 0.0 < least.max():  # it is in the middle
        return np.zeros(m.degrees)
    size = float(np.abs(gaps).max())
    if not size:
        return np.zeros(m.degrees)
    found = linprog(
        np.append(np.zeros(k), -1.0), A_ub=np.column_stack([across, np.ones(len(gaps))]),
        b_ub=gaps / size, bounds=[(None, None)] * k + [(None, 2.0)],
    )  # fmt: skip
    return np.asarray(found.x[:k] * size @ free) if found.success else np.zeros(m.degrees)
