"""Images of orbits under the symmetries of their machine.

Method      Without elements the image has the images of the stops, and is solved for from those of the states
            (find.py). With elements its flights are read off the motion from the image of a state, over
            MIRRORED_PERIODS; the orbit found must have that state, within SAME_ORBIT_RELATIVE. Where elements are not
            understood (model/symmetries.py), (x, v) -> (-x, -v) is tried if stops and forces have it.
Fails       None, where the image is no orbit, or the motion leaves it within a period
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.model.state import State
from vibroimpact.model.symmetries import Symmetry, symmetries_of
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.closing_segment import closing_loop
from vibroimpact.orbits.find import SAME_ORBIT_RELATIVE, Guess, primitive, solve, unfolded
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import asymmetry_without_elements
from vibroimpact.simulation.simulate import simulate

# A motion from a mirrored state takes so many: its first whole loop and what closes it.
MIRRORED_PERIODS = 2.5


def symmetries_tried(system: System, cycles: int) -> tuple[Symmetry, ...]:
    """Symmetries of a forced system under which images are looked for."""
    m = mechanism_of(system)
    found = symmetries_of(m) if m.forces else ()
    halves = [k for k in range(1, cycles + 1, 2) if not asymmetry_without_elements(m, k)]
    if halves and not any(symmetry.is_mirror for symmetry in found):
        coordinates, elements = (
            tuple(-(i + 1) for i in range(count)) for count in (m.degrees, len(m.elements))
        )
        mirror = Symmetry(coordinates, (0.0,) * m.degrees, elements, math.pi * halves[0])
        return (*found, mirror)
    return found


def image_of(orbit: Orbit, symmetry: Symmetry) -> Orbit | None:
    """Image of an orbit, solved once more."""
    whole = unfolded(orbit)
    states = symmetry.image(whole.states, symmetry.turn)
    if orbit.signature.flights:
        return _image_by_motion(orbit, states[:1])
    signature = replace(orbit.signature.image(symmetry), symmetric=False, exchange=())
    found = primitive(solve(orbit.system, signature, Guess(states, whole.durations)))
    return found if found.converged else None


def _image_by_motion(orbit: Orbit, start_of_image: Floats) -> Orbit | None:
    if not orbit.admissible:
        return None  # no motion follows it
    (x_v_theta,), n = start_of_image, orbit.mechanism.degrees
    start = State(tuple(x_v_theta[:n]), tuple(x_v_theta[n:-1]), float(x_v_theta[-1]))
    many = math.ceil(MIRRORED_PERIODS) * (len(orbit.durations) + 1)
    run = simulate(orbit.system, start, impacts=many, t_max=MIRRORED_PERIODS * orbit.period)
    loop = closing_loop(run, None, orbit.signature.cycles)
    if isinstance(loop, str):
        return None
    found = solve(orbit.system, loop.signature, Guess(loop.states, loop.durations))
    if not found.converged:
        return None
    sizes = np.abs(orbit.states[:, :-1]).max(axis=0)
    apart = np.abs(found.states[:, :-1] - x_v_theta[:-1]).max(axis=1)
    return found if apart.min() <= SAME_ORBIT_RELATIVE * sizes.max() else None
