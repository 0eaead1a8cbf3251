"""Drift of a motion: a machine that advances by the same way in every period has no orbit.

Method      Directions n in which a machine can be shifted as a whole without changing a force are
            the null space of its stiffness and of the rows of stops and of loads,
                K n = 0,  r . n = 0.                                                           (1)
            A motion that closes but for a shift along them drifts.
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import null_space

from vibroimpact._core.types import Floats
from vibroimpact.model.elements import Friction, SoftStop
from vibroimpact.model.mechanism import Mechanism

DEPENDENT = 1e-12  # singular values below, of rows of length one, are rounding


def shifts_of(m: Mechanism) -> Floats:
    """Directions (1), orthonormal columns, shape (n, number of them)."""
    rows = [*m.stiffness, *(contact.row for contact in m.contacts)]
    rows += [e.row for e in m.elements if isinstance(e, SoftStop)]
    rows += [e.load.position for e in m.elements if isinstance(e, Friction) and e.load]
    every = np.array([row for row in rows if np.any(row)]).reshape(-1, m.degrees)
    lengths = np.linalg.norm(every, axis=1, keepdims=True)
    return np.asarray(null_space(every / lengths, rcond=DEPENDENT))


def without_shift(states: Floats, shifts: Floats) -> Floats:
    """States (x, v, theta) in rows, their positions without the parts along the directions (1)."""
    out, n = states.copy(), len(shifts)
    out[:, :n] -= out[:, :n] @ shifts @ shifts.T
    return out


def drift_words(advance: Floats, least: float, cycles: int) -> str:
    """Sentence about a motion that advances in every period; "" where it does by no more than ``least``.

    The period has so many forcing cycles, 0 without forcing.
    """
    moving = np.flatnonzero(np.abs(advance) > least)
    if not moving.size:
        return ""
    which = ", ".join(f"coordinate {i} by {advance[i]:.6g}" for i in moving)
    period = "period" if cycles < 2 else f"period of {cycles} forcing cycles"
    return (
        f"the motion drifts: in every {period} it advances, {which}, so that it does not close and is "
        'no orbit. A sweep with observe="progress" gives the drift'
    )
