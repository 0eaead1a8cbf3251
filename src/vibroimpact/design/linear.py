"""Linear machines in closed form: the motion without impacts, and the tuned mass damper."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.design.flights import Dual, dual
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.problem import least_cycles


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """Steady motion of a forced machine without impacts, all stops open.

    Attributes
    ----------
    system
        The system.
    offset
        What is added to the coordinates along which nothing holds the machine, shape (n,): a free
        mass stands anywhere.
    """

    system: System
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
    def period(self) -> float:
        """Time until it repeats."""
        return 2.0 * math.pi * self.cycles / self.mechanism.omega

    def state_by(self, varied: Mechanism) -> tuple[Floats, Floats, Dual]:
        """(x, v, theta) at phase zero, its derivative, and the period, from a mechanism with jets."""
        n = self.mechanism.degrees
        mass, damping, stiffness = (
            dual(x) for x in (varied.mass, varied.damping, varied.stiffness)
        )
        inverse = np.linalg.pinv(stiffness.value)
        constant = dual(varied.constant_force)
        x0 = inverse @ constant.value
        state, by = np.zeros(2 * n + 1), np.zeros(2 * n + 1)
        state[:n] = x0 + self.offset
        by[:n] = inverse @ (constant.by - stiffness.by @ x0)
        for force in varied.forces:
            omega = dual(force.omega)
            w, w_by = float(omega.value), float(omega.by)
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
        first = dual(varied.omega)
        period = 2.0 * math.pi * self.cycles / float(first.value)
        return state, by, Dual(period, -period * float(first.by) / float(first.value))
