"""Sliding bifurcations: how an orbit gains or loses a stick, a slip or a rest, by the name that theory gives it.

Method      Friction sticks on the part of the surface of no slip to which the slips of both signs accelerate. s is the
            acceleration of a slip that leaves the surface, s < 0 on that part; s' is the rate of s at its border
            s = 0. An orbit meets the border in four ways:
                crossing-sliding   slip reverses there, s' > 0: beyond, it sticks until s = 0 before it goes on      (1)
                switching-sliding  stick begins there, s' < 0: beyond, the slip reverses and comes back before it    (2)
                grazing-sliding    a slip touches it and goes on: beyond, it sticks in between                       (3)
                adding-sliding     s touches 0 from below while friction sticks: beyond, it slips in between         (4)
            Each is met from both sides: as an event of the orbits without the piece, and of those with it, where it
            takes no time. A plastic stop that is rested on has (1), (2) and (4), s being the acceleration of its gap;
            its touch is no sliding bifurcation.
Assumes     static and kinetic level are equal, and what slips has mass
Reference   theory.md, (T80), (T81); di Bernardo, Budd, Champneys, Kowalczyk, Piecewise-smooth Dynamical Systems (2008),
            chapter 8
"""

from __future__ import annotations

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.branches.family import REST, SPEED, STICK, rests_of
from vibroimpact.branches.kinds import ADDING, CROSSING, SLIDING_TOUCH, SWITCHING
from vibroimpact.compile.modes import digit_in_code
from vibroimpact.compile.piecewise import state_in
from vibroimpact.compile.prescribed import FORCE_WATCH, GAP_WATCH, Numbers
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.maps import NO_TIME_OF_PERIOD
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.reversals import far_limit, one_level

# Of a slip in between (4), whose rate vanishes with the square of its time: half of the digits.
SHORTEST_SLIP_OF_PERIOD = 1e-6


def sliding_of(orbit: Orbit, test: str, segment: int, nearest: Nearest | None) -> PointKind | None:
    """Kind of sliding bifurcation at a zero of a test function, or at a touch; None where it is none."""
    if nearest:
        return _at_touch(orbit, nearest)
    if segment < 0:
        return None
    m, word = orbit.mechanism, test.partition(" ")[0]
    number = orbit.signature.impacts[segment].contact
    if number < len(m.rigid_stops):
        return _of_stop(orbit, word, segment) if _is_plastic(m, number) else None
    return _of_friction(orbit, word, segment) if one_level(m, number) else None


def _at_touch(orbit: Orbit, near: Nearest) -> PointKind | None:
    """(3) or (4), by the state in which a limit is touched."""
    m = orbit.mechanism
    if near.contact < len(m.rigid_stops):
        rests = near.watch == FORCE_WATCH and _is_plastic(m, near.contact)
        return ADDING if rests else None
    if not one_level(m, near.contact):
        return None
    element = m.elements[near.contact]
    state = _state(orbit, near.segment, near.contact)
    if state == element.holding:
        return ADDING
    slips = state in element.slipping and near.watch == 0  # another guard is that of the load
    return SLIDING_TOUCH if slips else None


def _of_friction(orbit: Orbit, word: str, k: int) -> PointKind | None:
    """(1) to (4) at the start of flight k, or where it takes no time."""
    m, number = orbit.mechanism, orbit.signature.impacts[k].contact
    element = m.elements[number]
    before, here, after = (_state(orbit, i, number) for i in (k - 1, k, k + 1))
    if word == STICK:
        return _by_rate(here == element.holding, _rate_of_slip(orbit, k, before, here))
    if word == REST and here == element.holding and {before, after} <= element.slipping:
        return SLIDING_TOUCH if before == after else CROSSING
    if word != SPEED:
        return None
    if here in element.slipping and before == after == element.holding:
        return ADDING if _takes_no_time(orbit, k, SHORTEST_SLIP_OF_PERIOD) else None
    back = {before, here} == element.slipping and after == element.holding
    return SWITCHING if back and _takes_no_time(orbit, k) else None


def _of_stop(orbit: Orbit, word: str, k: int) -> PointKind | None:
    """(1) or (2) of a plastic stop."""
    if word == STICK:
        rests = bool(digit_in_code(orbit.problem.modes[k], orbit.signature.impacts[k].contact))
        return _by_rate(rests, _rate_of_gap(orbit, k))
    rests = word == REST and k in rests_of(orbit.mechanism, orbit.signature)
    return CROSSING if rests and orbit.signature.begun[k] == GAP_WATCH else None


def _by_rate(holds: bool, rate: float) -> PointKind:
    """(1) or (2), by the rate of s, or of the margin -s where something holds."""
    return SWITCHING if (rate > 0.0) == holds else CROSSING


def _rate_of_slip(orbit: Orbit, k: int, before: int, here: int) -> float:
    """Rate of s at the start of flight k, or of the margin to s = 0 where friction sticks in it."""
    number, side = orbit.signature.impacts[k]
    mode, moved = _at_start(orbit, k)
    if here == orbit.mechanism.elements[number].holding:
        _, row, _ = far_limit(orbit.problem.own, orbit.problem.modes[k], number, before)
        return float(row @ moved)
    slip = next(guard for guard in mode.guards if guard.contact == number)
    return side * float(slip.row @ mode.b @ moved)


def _rate_of_gap(orbit: Orbit, k: int) -> float:
    """Rate of the acceleration of a gap at the start of flight k, or of the force on a stop that is closed."""
    number, side = orbit.signature.impacts[k]
    mode, moved = _at_start(orbit, k)
    guard = next(guard for guard in mode.guards if guard.contact == number)
    if guard.watch == FORCE_WATCH:
        return float(guard.row @ moved)
    return -side * float(guard.row @ mode.b @ mode.b @ moved)


def _at_start(orbit: Orbit, k: int) -> tuple[Numbers, Floats]:
    """The mode of flight k, and y' at its start."""
    compiled = orbit.problem.own
    mode = compiled.modes[orbit.problem.modes[k]]
    y = compiled.embedded(orbit.states[k, :-1], orbit.states[k, -1])
    return mode, mode.b @ y + mode.constant


def _takes_no_time(orbit: Orbit, k: int, share: float = NO_TIME_OF_PERIOD) -> bool:
    """Whether flight k takes no time."""
    whole = float(np.abs(orbit.durations).sum())
    return bool(abs(orbit.durations[k]) <= share * whole)


def _is_plastic(m: Mechanism, contact: int) -> bool:
    """Whether a rigid stop has no rebound."""
    return m.rigid_stops[contact].restitutions == (0.0, 0.0)


def _state(orbit: Orbit, k: int, contact: int) -> int:
    """State of an element in flight k, counted around the orbit."""
    flights = orbit.signature.flights
    return state_in(orbit.mechanism, flights[k % len(flights)].mode, contact)
