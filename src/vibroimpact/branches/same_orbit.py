"""Comparison of orbits, independent of the first impact and up to the mirror image.

Method      A loop is the sequence of an orbit's impacts with the states after them. Two loops are
            equal if a cyclic shift maps sequences onto each other and states within a tolerance,
            relative to the largest position and the largest velocity; phases count modulo 2 pi.
            Where the system has the symmetry of problem.py (3) the mirror image is tried as well.
            A loop that repeats a shorter one is replaced by that.
Accuracy    the tolerance given
Fails       never
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.kinds import ZERO
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.stop import Stop
from vibroimpact.model.symmetries import Symmetry, symmetries_of
from vibroimpact.model.system import mechanism_of
from vibroimpact.orbits.find import SAME_ORBIT_RELATIVE, Guess, solve, unfolded
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import images_of, resisted_translations

PROBE_SHARES = (0.5, 0.25, 0.75)  # a branch is probed at these shares of its points


class Loop(NamedTuple):
    """Impacts of an orbit and the states (x, v, theta) after them, less the drift, shape (m, 2n + 1)."""

    impacts: tuple[Stop, ...]
    states: Floats
    rate: float  # velocities are of the size of positions times this


def loop_of(orbit: Orbit) -> Loop:
    """All impacts of an orbit."""
    drifts = resisted_translations(orbit.mechanism)
    states = drifts.relative(unfolded(orbit).states)
    return Loop(orbit.signature.impacts, states, orbit.problem.own.rate)


def without(loop: Loop, numbers: set[int]) -> Loop:
    """Loop without some of its impacts."""
    kept = [k for k in range(len(loop.impacts)) if k not in numbers]
    return Loop(tuple(loop.impacts[k] for k in kept), loop.states[kept], loop.rate)


def junction_of(point: BifurcationPoint, tolerance: float) -> Loop:
    """Loop that all branches through a special point share.

    At zero speed the impact that vanishes is left out (it is the touch of a grazing orbit), and an
    orbit that repeats a shorter one, as at a period doubling, is replaced by the shorter one.
    """
    loop = loop_of(point.orbit)
    if point.record == ZERO:
        solved = len(point.orbit.durations)
        vanishing = (point.segment + 1) % solved
        loop = without(loop, set(range(vanishing, len(loop.impacts), solved)))
    return primitive_loop(loop, tolerance)


def primitive_loop(loop: Loop, tolerance: float) -> Loop:
    """Shortest loop that a loop repeats."""
    count = len(loop.impacts)
    for part in range(1, count):
        repeated = count % part == 0 and loop.impacts == loop.impacts[:part] * (count // part)
        later = np.roll(loop.states, -part, axis=0)
        if repeated and _distance(loop.states, later, loop.rate) <= tolerance:
            return Loop(loop.impacts[:part], loop.states[:part], loop.rate)
    return loop


def same_loop(first: Loop, second: Loop, mechanism: Mechanism, tolerance: float) -> str:
    """Compare two loops: "same", "mirror image" or "" for different ones."""
    if _shifted(first, second, tolerance):
        return "same"
    images = (image(second, symmetry) for symmetry in images_of(mechanism))
    return "mirror image" if any(_shifted(first, one, tolerance) for one in images) else ""


def image(loop: Loop, symmetry: Symmetry) -> Loop:
    """Image of a loop under a symmetry."""
    states = symmetry.image(loop.states, symmetry.turn)
    return Loop(tuple(map(symmetry.stop, loop.impacts)), states, loop.rate)


def _shifted(first: Loop, second: Loop, tolerance: float) -> bool:
    count = len(first.impacts)
    if count != len(second.impacts):
        return False
    return any(
        first.impacts == second.impacts[k:] + second.impacts[:k]
        and _distance(first.states, np.roll(second.states, -k, axis=0), first.rate) <= tolerance
        for k in range(count)
    )


def _distance(first: Floats, second: Floats, rate: float) -> float:
    """Largest difference of states, relative to the size of positions and of velocities.

    Either may vanish at all impacts, but for rounding: it is of the size that the other and the rate give, at least.
    """
    if not len(first):
        return 0.0
    n = first.shape[1] // 2
    apart, size = np.abs(first - second), np.maximum(np.abs(first), np.abs(second))
    place, speed = float(size[:, :n].max()), float(size[:, n:-1].max())
    length = max(place, speed / rate) or 1.0
    turn = 2.0 * math.pi
    phase = np.abs((apart[:, -1] + math.pi) % turn - math.pi)
    parts = (phase, apart[:, :n] / length, apart[:, n:-1] / (length * rate))
    return max(float(part.max()) for part in parts)


def half_turn(orbit: Orbit) -> int:
    """Number of events after which an orbit repeats as its own mirror image; 0 where it does not, or was solved so."""
    half = len(orbit.durations) // 2
    if orbit.symmetric or 2 * half != len(orbit.durations):
        return 0
    sizes = np.abs(orbit.states[:, :-1]).max(axis=0)
    within = SAME_ORBIT_RELATIVE * np.append(np.maximum(sizes, sizes.max()), 2.0 * math.pi)
    for symmetry in symmetries_of(orbit.mechanism):
        later = symmetry.image(orbit.states[:half], math.pi * orbit.signature.cycles)
        if symmetry.is_involution and np.all(np.abs(later - orbit.states[half:]) <= within):
            return half
    return 0


def orbits_at(branch: Branch, value: float) -> Iterator[Orbit]:
    """Orbits of a branch at a value of its parameter."""
    family, values, z = branch.family, branch.values, branch.curve.z
    system = with_parameter(family.system, branch.parameter, value)
    for i in np.flatnonzero((values[:-1] - value) * (values[1:] - value) <= 0.0):
        step = values[i + 1] - values[i]
        share = (value - values[i]) / step if step else 0.0
        guess = Guess(*family.unpacked(z[i] + share * (z[i + 1] - z[i])))
        orbit = solve(system, family.signature, guess)
        if orbit.converged:
            yield orbit


def same_branch(found: Branch, known: Branch) -> str:
    """Whether a branch holds the orbits of a known one: "same", "mirror image" or "" for no.

    Its own may repeat those of the known one several times.
    """
    mechanism = mechanism_of(found.family.system)
    count = len(known.family.signature.impacts)
    for share in PROBE_SHARES:
        index = int(share * (len(found) - 1))
        here = primitive_loop(loop_of(found.orbit(index)), SAME_ORBIT_RELATIVE)
        if len(here.impacts) != count:
            continue
        for orbit in orbits_at(known, float(found.values[index])):
            how = same_loop(here, loop_of(orbit), mechanism, SAME_ORBIT_RELATIVE)
            if how:
                return how
    return ""
