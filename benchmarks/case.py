"""What every method simulates: set A of the impact damper and seeded random starts."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

START_COLUMNS = ("x1", "x2", "v1", "v2", "phase", "contact")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """Parameters of the nondimensional impact damper, in the order the C++ programs read them."""

    mass_ratio: float
    omega_n: float
    zeta: float
    restitution: float
    half_clearance: float
    omega: float
    force: float = 1.0

    def as_array(self) -> Floats:
        """Return the parameters as one vector."""
        return np.array(astuple(self))

    @property
    def period(self) -> float:
        """Forcing period."""
        return 2 * math.pi / self.omega


SET_A = Parameters(
    mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8, half_clearance=5.0, omega=1.2
)


def random_starts(parameters: Parameters, count: int, rng: np.random.Generator) -> Floats:
    """Draw states on stop A that leave it.

    Parameters
    ----------
    parameters : Parameters
        The damper; only its half clearance is used.
    count : int
        Number of starts.
    rng : numpy.random.Generator
        Source of the draws: uniform in position and velocity of the main mass (-2 to 2, a few
        forced amplitudes), departing speed (0.5 to 4) and phase.

    Returns
    -------
    ndarray, shape (count, 6)
        Columns as in `START_COLUMNS`; ``contact`` is +1 (stop A).
    """
    x1, v1 = rng.uniform(-2, 2, (2, count))
    departing = rng.uniform(0.5, 4, count)
    phase = rng.uniform(0, 2 * math.pi, count)
    columns = (x1, x1 + parameters.half_clearance, v1, v1 - departing, phase, np.ones(count))
    return np.column_stack(columns)
