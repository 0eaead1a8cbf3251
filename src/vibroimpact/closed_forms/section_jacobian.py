"""Jacobian of the damper's impact map in the section coordinates of the paper."""

from __future__ import annotations

import numpy as np

from vibroimpact._core.checks import check_kind
from vibroimpact._core.types import Floats
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.state import State
from vibroimpact.simulation.derivatives import map_derivative

# d(x1, x2, v1, v2, theta) by (v1, x1, v2, theta) on a stop, where x2 - x1 is fixed.
ON_STOP = np.array(
    [[0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=float
)
SECTION_ROWS = [2, 0, 3, 4]  # v1, x1, v2, theta of (x1, x2, v1, v2, theta)


def section_jacobian(damper: ImpactDamper, state: State, *, impacts: int = 2) -> Floats:
    """Compute the Jacobian of the damper's impact map in section coordinates (v1+, x1, v2+, theta).

    Parameters
    ----------
    damper
        The system.
    state
        State on a stop, leaving it.
    impacts
        Number of impacts of the map; 2 is the paper's full map near a 1-1-1 orbit, 1 leads from
        one stop to the next event.

    Returns
    -------
    ndarray of shape (4, 4)
        Its determinant over a closed 1-1-1 orbit is R^4 exp(-4 pi zeta omega_n / omega).
    """
    check_kind("damper", damper, ImpactDamper, "an ImpactDamper")
    derivative = map_derivative(damper, state, impacts=impacts, directions=ON_STOP)
    return derivative.matrix[SECTION_ROWS]
