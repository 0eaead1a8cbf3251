"""Starts of the other branches of orbits through a special point.

Method      PD      the doubled sequence, twice the cycles: a branch point of its equations
            BP      of a symmetric orbit: the full sequence without the symmetry; of another orbit
                    the same sequence. Both are branch points of those equations
            GR      the sequence with the touched stop inserted where it is touched, at speed zero:
                    an ordinary point of its equations, since flight times are unknowns       (1)
            ZERO    the sequence without the impact whose speed vanishes: ordinary as well    (2)
            In (1) the orbits that leave towards a positive closing speed are followed, in (2) both
            sides.
            GR, ZERO, SIM, STICK of an element: the motion a little beyond, on either side, from the
            orbit's state: where it has another sequence that closes nearly, Newton's method starts
            there; orbits that are no motions are passed over                                     (3)
Fails       ``NotFound`` with a sentence: no start converges
Reference   theory.md, "Branches"; square-root law: Nordmark (1991)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.point import BifurcationPoint, NotFound
from vibroimpact.compile.prescribed import CHATTER_WATCH
from vibroimpact.continuation import switch
from vibroimpact.continuation.problem import Problem
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.stop import Stop
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.closing_segment import closing_loop
from vibroimpact.orbits.find import (
    Guess,
    find_orbit,
    repeated,
    rotated,
    unfolded,
    with_image,
)
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import Flight, OrbitProblem, Signature, without_events
from vibroimpact.simulation.simulate import before_stops, simulate

Bounds = tuple[float, float]
Begins = Callable[[BifurcationPoint, Bounds], "BranchStart | NotFound"]

# Equations with rows of length 1 and a larger least singular value have a single tangent.
LEAST_REGULAR_SINGULAR_VALUE = 1e-9
# These are the steps of (3) beyond a touch, in ranges of the parameter.
STEPS_BEYOND_TOUCH = (1e-4, 1e-3, 1e-2)
# (3) simulates so many periods: near an unstable orbit a motion stays for a few, to a stable one it settles.
SIMULATED_PERIODS = (3.5, 20.5)
# A step of this length along a scaled tangent finds the side on which the touching impact closes.
NUDGE_ALONG_TANGENT = 1e-4


class BranchStart(NamedTuple):
    """Solution on the other branch and the direction to follow."""

    family: OrbitFamily
    z: Floats
    parameter: float
    tangent: Floats | None
    both: bool


def _packed(point: BifurcationPoint, signature: Signature, segments: Guess) -> Floats:
    """Unknowns of a signature's equations from states and flight times."""
    problem = OrbitProblem(point.orbit.system, signature, "")
    count = len(problem.impacts)
    return problem.packed(segments.states[:count], segments.durations[:count])


def _family(
    point: BifurcationPoint, signature: Signature, guess: Guess, bounds: Bounds
) -> tuple[OrbitFamily, Floats]:
    """Equations of a signature, and the unknowns of a guess in them."""
    z = _packed(point, signature, guess)
    span = bounds[1] - bounds[0]
    events = point.problem.events
    return OrbitFamily.around(point.orbit.system, signature, point.name, z, span, events), z


def _through(
    point: BifurcationPoint, signature: Signature, guess: Guess, along: Guess, bounds: Bounds
) -> BranchStart | NotFound:
    """Start on the other branch of a branch point; ``along`` is the known tangent."""
    family, z = _family(point, signature, guess, bounds)
    tangent = np.append(_packed(point, signature, along), point.tangent[-1])
    found = switch(family, z, point.parameter, tangent, bounds)
    if not found.found:
        return NotFound(point, found.status)
    return BranchStart(family, found.z, found.parameter, found.tangent, both=True)


def _tangent_of(point: BifurcationPoint) -> Guess:
    """Tangent of the branch as changes of states and flight times of all segments."""
    problem = point.orbit.problem
    half = Guess(*problem.unpacked(point.tangent[:-1]))
    symmetry = point.orbit.problem.symmetry
    return with_image(half, symmetry.change(half.states)) if symmetry else half


def doubled(point: BifurcationPoint, bounds: Bounds) -> BranchStart | NotFound:
    """Start on the branch of the orbits of twice the period."""
    once = point.orbit.signature
    twice = once.repeated(2)
    guess = repeated(unfolded(point.orbit), once.cycles, 2, point.orbit.progress)
    return _through(point, twice, guess, repeated(_tangent_of(point), 0, 2), bounds)


def branching(point: BifurcationPoint, bounds: Bounds) -> BranchStart | NotFound:
    """Start on the branch that crosses, of orbits without the symmetry."""
    signature = replace(point.orbit.signature, symmetric=False)
    return _through(point, signature, unfolded(point.orbit), _tangent_of(point), bounds)


def grown(point: BifurcationPoint, bounds: Bounds) -> BranchStart | NotFound:
    """Start (1) on the branch of the orbits with an impact more."""
    assert point.nearest is not None
    start = _ordinary(point, *with_touch(point.orbit, point.nearest), bounds)
    return start if isinstance(start, NotFound) else _closing(start, point.nearest.segment)


def neighbouring(point: BifurcationPoint, bounds: Bounds) -> BranchStart | NotFound:
    """Start (3) on the branch of the orbits with an event more, or fewer."""
    why = set[str]()
    for periods in SIMULATED_PERIODS:
        for step in STEPS_BEYOND_TOUCH:
            for sense in (1.0, -1.0):
                p = point.parameter + step * (bounds[1] - bounds[0]) * sense
                found = (
                    _closing_beyond(point, bounds, p, periods) if bounds[0] < p < bounds[1] else ""
                )
                if isinstance(found, BranchStart):
                    return found
                why.add(found)
    none = "no orbit with another sequence was found next to it"
    return NotFound(point, "; ".join([none, *sorted(filter(None, why))]))


def _closing_beyond(
    point: BifurcationPoint, bounds: Bounds, p: float, periods: float
) -> BranchStart | str:
    """Start (3) from the motion at a value of the parameter; or why there is none, "" where it has the same events."""
    known, name = point.orbit.signature, point.name
    system = with_parameter(point.orbit.system, name, p)
    start = before_stops(system, point.orbit.state)  # stops may move with the parameter
    try:
        run = simulate(system, start, t_max=periods * point.orbit.period)
    except InvalidParameterError as error:  # there is no place between the stops
        return str(error)
    loop = closing_loop(run, None, known.cycles)
    if isinstance(loop, str):
        return loop
    found = find_orbit(system, run, cycles=known.cycles)
    if not found.admissible or _same_events(found.signature, known):
        return ""  # Newton's method may lead to an orbit with the motion's sequence that is none
    z = found.problem.packed(found.states, found.durations)
    family = OrbitFamily.around(
        system, found.signature, name, z, bounds[1] - bounds[0], point.problem.events
    )
    tangent = single_tangent(family, z, p)
    return "" if tangent is None else BranchStart(family, z, p, tangent, both=True)


def _same_events(one: Signature, other: Signature) -> bool:
    """Whether two sequences have as many events of each stop or element; with chatter in both, the same kinds.

    How many impacts are before the sum of chatter is no property of the motion.
    """
    if all(CHATTER_WATCH in signature.begun for signature in (one, other)):
        kinds = [{*zip(each.impacts, each.begun, strict=True)} for each in (one, other)]
        return kinds[0] == kinds[1]
    return sorted(one.impacts) == sorted(other.impacts)


def with_touch(orbit: Orbit, touch: Nearest) -> tuple[Signature, Guess]:
    """Orbit (1) with an impact more, of speed zero, at the end of the flight that touches a stop."""
    if orbit.signature.eventless:
        return _with_first_touch(orbit, touch)
    half, k, mode = orbit.states, touch.segment, orbit.problem.modes[touch.segment]
    inside = orbit.problem.compiled(orbit.parameter_value).after(half[k], touch.time, mode)
    guess = Guess(np.insert(half, k + 1, inside, axis=0), np.insert(orbit.durations, k, touch.time))
    guess.durations[k + 1] -= touch.time
    impacts = list(orbit.signature.impacts[: len(half)])
    impacts.insert(k + 1, Stop(touch.contact, touch.side))
    flights = list(orbit.signature.flights)
    if flights:
        flights.insert(k, Flight(mode))
    return _with_image(orbit, impacts, flights), guess


def _with_first_touch(orbit: Orbit, touch: Nearest) -> tuple[Signature, Guess]:
    """Orbit without events as one with a single impact, or a pair of mirror images, of speed zero."""
    mode = orbit.problem.modes[0]
    compiled = orbit.problem.compiled(orbit.parameter_value)
    inside = compiled.after(orbit.states[0], touch.time, mode)[None]
    flights = [Flight(mode)] if orbit.mechanism.switching else []
    impacts = [Stop(touch.contact, touch.side)]
    return _with_image(orbit, impacts, flights), Guess(inside, orbit.durations)


def _without_events(orbit: Orbit) -> tuple[Signature, Guess, Nearest] | None:
    """Orbit with a single impact of speed zero, or a pair, as one without events."""
    m, mode, known = orbit.mechanism, orbit.problem.modes[0], orbit.signature
    if not m.forces:
        return None
    signature = without_events(m, mode, known.cycles, known.symmetric)
    period = float(orbit.durations[0])
    late = -float(orbit.states[0, -1]) % (2.0 * math.pi) / m.omega  # from the impact to the phase 0
    state = orbit.problem.compiled(orbit.parameter_value).after(orbit.states[0], late, mode)
    touched = known.impacts[0]
    if (
        orbit.problem.symmetry and late <= period
    ):  # it is in the second half, its image in the first
        touched = orbit.problem.symmetry.stop(touched)
    state[-1] = 0.0
    touch = Nearest(0.0, *touched, 0, -late % period)
    return signature, Guess(state[None], orbit.durations), touch


def without_impact(orbit: Orbit, segment: int) -> tuple[Signature, Guess, Nearest] | None:
    """Orbit (2) without the impact of speed zero that ends a segment, and the touch left of it.

    None where it is the only impact of a motion without forcing.
    """
    if len(orbit.durations) == 1:
        return _without_events(orbit)
    lost = (segment + 1) % len(orbit.durations)
    turned = rotated(orbit, 1) if lost == 0 else orbit
    lost = lost or len(turned.durations) - 1
    durations = turned.durations.copy()
    time = float(durations[lost - 1])
    durations[lost - 1] += durations[lost]
    guess = Guess(np.delete(turned.states, lost, axis=0), np.delete(durations, lost))
    impacts = list(turned.signature.impacts[: len(durations)])
    touched = impacts.pop(lost)
    flights = list(turned.signature.flights)
    if flights:
        del flights[lost - 1]
    touch = Nearest(0.0, touched.contact, touched.side, lost - 1, time)
    return _with_image(turned, impacts, flights), guess, touch


def _with_image(like: Orbit, impacts: list[Stop], flights: list[Flight]) -> Signature:
    """Signature with these solved impacts, symmetric if that of an orbit is."""
    symmetry = like.problem.symmetry
    second = map(symmetry.stop, impacts) if symmetry else ()
    return replace(like.signature, impacts=(*impacts, *second), flights=tuple(flights))


def _ordinary(
    point: BifurcationPoint, signature: Signature, guess: Guess, bounds: Bounds
) -> BranchStart | NotFound:
    """Start at an ordinary point of a signature's equations, in both directions."""
    family, z = _family(point, signature, guess, bounds)
    tangent = single_tangent(family, z, point.parameter)
    if tangent is None:
        count = len(signature.impacts)
        return NotFound(point, f"the equations with {count} impacts have no single tangent there")
    return BranchStart(family, z, point.parameter, tangent, both=True)


def _closing(start: BranchStart, k: int) -> BranchStart:
    """Direction of (1) only: towards a positive closing speed of impact k."""
    assert start.tangent is not None
    there = start.z + NUDGE_ALONG_TANGENT * start.tangent[:-1]
    rate = start.family.linearised(there, start.parameter).rate[k]
    forward = np.copysign(1.0, start.family.impacts[k][1] * rate)
    return start._replace(tangent=forward * start.tangent, both=False)


def single_tangent(problem: Problem, z: Floats, p: float) -> Floats | None:
    """Tangent of the curve through a regular point; None where there are several."""
    sizes = problem.scale()
    by_z, by_p = problem.jacobian(z, p)
    matrix = np.column_stack([by_z, by_p]) * sizes
    lengths = np.linalg.norm(matrix, axis=1)
    if not np.all(np.isfinite(matrix)) or not lengths.all():
        return (
            None  # an equation that nothing changes, as of a ball that rests anywhere in its slot
        )
    _, values, rows = np.linalg.svd(matrix / lengths[:, None])
    return rows[-1] * sizes if values[-1] > LEAST_REGULAR_SINGULAR_VALUE else None


def shrunk(point: BifurcationPoint, bounds: Bounds) -> BranchStart | NotFound:
    """Start (2) on the branch of the orbits with an impact fewer."""
    found = without_impact(point.orbit, point.segment)
    if found is None:
        return NotFound(point, "without its only impact and without forcing there is no orbit")
    return _ordinary(point, *found[:2], bounds)


def begins_at(point: BifurcationPoint) -> Begins | None:
    """Function that gives the start on the branch that begins at a point; None where the same orbits go on."""
    own = point.record.begins
    return neighbouring if point.of_element or (point.record.touch and not own) else own
