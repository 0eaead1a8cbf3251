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
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact._kernel import Jet
from vibroimpact.measures.flights import Flights, Struck, derivative, dual, jet, rows_of
from vibroimpact.model.mechanism import Mechanism, accelerations, with_mass
from vibroimpact.model.parameters import expanded
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.problem import forcing_repeats, least_cycles
from vibroimpact.orbits.stability import Stability, stability_of

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
        rows = rows_of(self.system, parameter)
        state, by, duration = self._state(
            expanded(self.system, parameter) if parameter else self.mechanism
        )
        none = Struck(np.array([], dtype=np.int64), [])
        times = np.array([[duration.value], [derivative(duration)]])
        return Flights(rows, state[None], times[0], (0,), none, by[None], times[1])

    @cached_property
    def reaches(self) -> list[Reach]:
        """Least gap at every stop, soft ones included; negative beyond it."""
        flights = self.flights()
        found = []
        for number, part in enumerate(self.mechanism.elements):
            if part.is_stop:
                (low, _), (high, _) = flights.signal(
                    partial(flights.rows.gap, part=number)
                ).extremes()
                found.append(Reach(Stop(number, 1), part.limit_at(1) - float(high[0])))
                found.append(Reach(Stop(number, -1), float(low[0]) - part.limit_at(-1)))
        return [reach for reach in found if math.isfinite(reach.gap)]

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

    def _state(self, varied: Mechanism) -> tuple[Floats, Floats, Jet]:
        """(x, v, theta) at phase zero, its derivative, and the period, from numbers or jets."""
        n = self.mechanism.degrees
        mass, damping, stiffness = map(dual, (varied.mass, varied.damping, varied.stiffness))
        inverse, constant = np.linalg.pinv(stiffness.value), dual(varied.constant_force)
        x0 = inverse @ constant.value
        state, by = np.zeros(2 * n + 1), np.zeros(2 * n + 1)
        state[:n] = x0 + self.offset
        by[:n] = inverse @ (constant.by - stiffness.by @ x0)
        for force in varied.forces:
            w, w_by = jet(force.omega).coefficients[:2]
            sine, cosine = dual(force.sine), dual(force.cosine)
            matrix = stiffness.value + 1j * w * damping.value - w * w * mass.value
            moved = stiffness.by + 1j * (w_by * damping.value + w * damping.by)
            moved = moved - 2.0 * w * w_by * mass.value - w * w * mass.by
            x = np.linalg.solve(matrix, cosine.value - 1j * sine.value)
            x_by = np.linalg.solve(matrix, cosine.by - 1j * sine.by - moved @ x)
            state[:n] += x.real
            by[:n] += x_by.real
            state[n : 2 * n] += (1j * w * x).real
            by[n : 2 * n] += (1j * (w_by * x + w * x_by)).real
        return state, by, 2.0 * math.pi * self.cycles / jet(varied.omega)


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
    m = mechanism_of(system)
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
    try:
        motion = FreeMotion(system, np.zeros(m.degrees))
        state = motion.flights().states
        if not np.isfinite(state).all():
            return "it resonates without damping"
        offset = _centred(motion, free) if len(free) else motion.offset
        return FreeMotion(system, offset) if offset.any() else motion
    except np.linalg.LinAlgError:
        return "it resonates without damping"


def _centred(motion: FreeMotion, free: Floats) -> Floats:
    """Offset along free directions with the largest least gap, (2)."""
    from scipy.optimize import linprog

    m, reaches = motion.mechanism, motion.reaches
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
