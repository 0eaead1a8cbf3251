"""Machines without their own forces, and machines that a record drives.

Method      A force f(t) b that is linear in time is a coordinate of its own, with mass 1, that nothing
            moves:
                M x'' + C x' + K x - (b / c) s = f0,    s'' = 0,    s = c f                     (1)
            so flights, contacts and states of elements stay those of a linear machine: exact, and
            proved. c makes s as large as the displacements that f causes, c = |M^-1 b| / rate^2:
            rounding is relative to the largest coordinate.
Reference   theory.md, "Flight"
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.compile.piecewise import Piecewise
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism, accelerations


def unforced(m: Mechanism) -> Mechanism:
    """Return the mechanism without harmonic forces and phase switches; stops and belts still move."""
    elements = tuple(e for e in m.elements if not e.by_time)
    return replace(m, forces=(), elements=elements or (_out_of_reach(m),))


def linear(m: Mechanism) -> Mechanism:
    """Return masses, dashpots and springs alone, as they move while no stop is met."""
    return replace(m, forces=(), elements=(_out_of_reach(m),))


def _out_of_reach(m: Mechanism) -> RigidStop:
    """A stop that no motion meets, since a mechanism has one at least."""
    heavy = next(i for i in range(m.degrees) if m.mass[i][i])
    return RigidStop(tuple(float(i == heavy) for i in range(m.degrees)), upper=1e300)


def driven(m: Mechanism, row: Floats, slowest: float) -> tuple[Mechanism, float]:
    """Mechanism (1), whose last coordinate is s, and the factor c.

    Parameters
    ----------
    m
        The mechanism.
    row
        b: force on each coordinate per unit of f, shape (n,).
    slowest
        Rate that counts where the mechanism has no faster one: one over the duration of the record.
    """
    n = m.degrees
    pulled = np.array(row)
    lifted = accelerations(m, pulled)
    rate = max(float(Piecewise(m).rate), slowest)
    size = float(np.abs(lifted).max()) or float(np.abs(pulled).max())
    factor = size / rate**2
    stiffness = _bordered(m.stiffness, 0.0)
    stiffness[:n, n] = -pulled / factor
    wider = replace(
        m,
        mass=_bordered(m.mass, 1.0).tolist(),
        damping=_bordered(m.damping, 0.0).tolist(),
        stiffness=stiffness.tolist(),
        forces=tuple(_line(line) for line in m.forces),
        elements=tuple(e.widened() for e in m.elements),
        constant_force=(*m.constant_force, 0.0),
    )
    return wider, factor


def _bordered(matrix: list[list[float]], corner: float) -> Floats:
    out = np.zeros((len(matrix) + 1, len(matrix) + 1))
    out[:-1, :-1], out[-1, -1] = matrix, corner
    return out


def _line(line: Harmonic) -> Harmonic:
    return replace(line, sine=(*line.sine, 0.0), cosine=(*line.cosine, 0.0))
