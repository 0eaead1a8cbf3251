"""Mirror images of orbits of systems with the symmetry (x, v) -> (-x, -v), theta -> theta + turn.

Method      Without elements the image has the opposite stops, and is solved for from the mirrored states
            (find.py). With elements its flights are read off the motion from a mirrored state, over
            MIRRORED_PERIODS; whether the elements have the symmetry is not checked: the orbit found must have
            the mirrored state, within SAME_ORBIT_RELATIVE.
Fails       None, where the image is no orbit, or the motion leaves it within a period
"""

from __future__ import annotations

import math

import numpy as np

from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.closing_segment import closing_loop
from vibroimpact.orbits.find import SAME_ORBIT_RELATIVE, Guess, mirrored, solve
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import Signature, asymmetry_without_elements
from vibroimpact.simulation.simulate import simulate

# A motion from a mirrored state takes so many: its first whole loop and what closes it.
MIRRORED_PERIODS = 2.5


def mirror_turn(system: System, cycles: int) -> float | None:
    """Phase shift of the symmetry; None for a system whose stops and forces do not have it."""
    m = mechanism_of(system)
    halves = [k for k in range(1, cycles + 1, 2) if not asymmetry_without_elements(m, k)]
    return math.pi * halves[0] if halves else None


def mirror_image(orbit: Orbit, turn: float) -> Orbit | None:
    """Mirror image (-x, -v, theta + turn) of an orbit, solved once more."""
    if orbit.signature.flights:
        return _image_by_motion(orbit, turn)
    image = Guess(mirrored(orbit.states, turn), orbit.durations)
    found = solve(orbit.system, orbit.signature.mirrored, image)
    return found if found.converged else None


def _image_by_motion(orbit: Orbit, turn: float) -> Orbit | None:
    if not orbit.admissible:
        return None  # no motion follows it
    (x_v_theta,), n = mirrored(orbit.states[:1], turn), orbit.mechanism.degrees
    start = State(tuple(x_v_theta[:n]), tuple(x_v_theta[n:-1]), float(x_v_theta[-1]))
    many = math.ceil(MIRRORED_PERIODS) * (len(orbit.durations) + 1)
    run = simulate(orbit.system, start, impacts=many, t_max=MIRRORED_PERIODS * orbit.period)
    loop = closing_loop(run, None, orbit.signature.cycles)
    if isinstance(loop, str):
        return None
    signature = Signature(loop.impacts, loop.cycles, False, loop.flights)
    found = solve(orbit.system, signature, Guess(loop.states, loop.durations))
    if not found.converged:
        return None
    sizes = np.abs(orbit.states[:, :-1]).max(axis=0)
    apart = np.abs(found.states[:, :-1] - x_v_theta[:-1]).max(axis=1)
    return found if apart.min() <= SAME_ORBIT_RELATIVE * sizes.max() else None
