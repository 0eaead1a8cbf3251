"""Normal form at a touch of an orbit: its coefficients from the flight and the law of the stop.

Method      h is the gap of the stop that is touched, r its row by the positions, a = h'' > 0, M the mass matrix. A
            motion that would pass the stop by delta changes at once, to leading order, by (theory.md, "At a touch")
                rigid, restitution R       (1 + R) v (2 a delta)^(1/2),  v = M^-1 r' / (r M^-1 r')          (1)
                spring k                   (4/3) (2 / a)^(1/2) k w delta^(3/2),  w = M^-1 r'                (2)
                and a dashpot c that acts until the gap opens: w k -> w k + c A w, A the rates of the flight   (3)
                and a dashpot c that never pulls: c w delta; if it is limited by the spring, (2)            (4)
            v and w being velocities. L is the map from the phase of the touch over the period, by exact derivatives
            (orbits/maps.py), as is its derivative b by the parameter; with C and h_p those of the gap
                opening = C (I - L)^-1 b + h_p                                                            (5)
            At ZERO the impact without speed is the touch, and left out of L.
Assumes     forcing, and a stop that is touched from outside
Accuracy    that of the derivatives
Fails       a Refusal with a sentence
Reference   theory.md, "At a touch"
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.branches.grazing import belongs_to_impact
from vibroimpact.branches.point import TOUCH_RELATIVE, BifurcationPoint
from vibroimpact.compile.piecewise import states_from_code
from vibroimpact.compile.prescribed import GAP_WATCH, End, Prescribed
from vibroimpact.model.elements.soft_stop import SoftStop
from vibroimpact.model.mechanism import Mechanism, accelerations
from vibroimpact.model.stop import Stop
from vibroimpact.normal_forms.critical import HALF_OF_THE_DIGITS, Refusal, Status
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.touch import ContactLaw, Touch
from vibroimpact.orbits.maps import map_from
from vibroimpact.orbits.orbit import Orbit

SINGULAR = 1e-9  # I - L is singular below this least singular value, relative to the largest


class _Place(NamedTuple):
    """Where an orbit touches: the end of a part of a flight."""

    segment: int
    time: float
    end: End


def touch(kind: PointKind, point: BifurcationPoint) -> Touch | Refusal:
    """Compute the normal form of a point at which an orbit touches a stop.

    Cost: d + 1 first derivatives of the map.
    """
    orbit = point.orbit
    place = _place(point)
    if isinstance(place, str):
        return _refused(kind, place, orbit)
    mechanism = orbit.problem.mechanism
    if not mechanism.forces:
        return _refused(kind, "without forcing the touch has no phase of its own", orbit)
    if why := _another(point):
        return _refused(kind, why, orbit)
    solved = map_from(orbit, place.segment, place.time, point.name)
    kept, compiled = list(solved.kept_in), solved.compiled
    state = _touching_state(compiled, orbit, place)
    gap, by_parameter, acceleration = _gap(compiled, state, place.end)
    law = jump_at(compiled, mechanism, place.end, acceleration)
    if isinstance(law, str):
        return _refused(kind, law, orbit)
    L = solved.jacobian()
    direction = np.zeros(len(kept) + 1)
    direction[-1] = 1.0
    off = np.eye(len(L)) - L
    values = np.linalg.svd(off, compute_uv=False)
    if not (np.all(np.isfinite(L)) and values[-1] > SINGULAR * values[0]):
        why = "1 is a multiplier of the touching orbit: a fold at the touch, of codimension two"
        return _refused(kind, why, orbit, Status.OTHERS_CRITICAL)
    moved = np.linalg.solve(off, solved.derivative(direction))
    parts = gap[kept] * moved
    opening = float(parts.sum()) + by_parameter  # (5)
    size = float(np.abs(parts).sum()) + abs(by_parameter)
    if not abs(opening) > HALF_OF_THE_DIGITS * size:
        why = f"{point.name} does not move the touching orbit across the stop"
        return _refused(kind, why, orbit, Status.NOT_TRANSVERSAL)
    names = [f"{letter}{i + 1}" for letter in "xv" for i in range(compiled.degrees)]
    return Touch(
        kind=kind.label,
        parameter=point.name,
        at=point.parameters[point.name],
        stop=Stop(place.end.contact, place.end.side).words,
        law=law[0],
        acceleration=acceleration,
        opening=opening,
        coordinates=tuple(names[i] for i in kept),
        linear=L,
        jump=law[1][kept],
        gap=gap[kept],
    )


def _refused(
    kind: PointKind, why: str, orbit: Orbit, status: Status = Status.NOT_SMOOTH
) -> Refusal:
    multipliers: Complexes = orbit.multipliers
    return Refusal(kind.label, status, f"{kind.label}: {why}.", multipliers)


def _place(point: BifurcationPoint) -> _Place | str:
    """Flight, time and guard of a touch; or why there is none that has a normal form."""
    problem, near = point.orbit.problem, point.nearest
    if near is not None:
        end = End(near.contact, near.side, problem.modes[near.segment], near.watch)
        return _Place(near.segment, near.time, end)
    end = problem.ends[point.segment]
    if end.watch != GAP_WATCH:
        return "the touch of an element from within has no normal form here"
    return _Place(point.segment, float(point.orbit.durations[point.segment]), end)


def _another(point: BifurcationPoint) -> str:
    """Reason why there is no normal form where the orbit touches another stop, too, or the same once more."""
    orbit, own = point.orbit, point.nearest.place if point.nearest else None
    for k, (end, rate) in enumerate(zip(orbit.problem.ends, orbit.linearised.rate, strict=True)):
        if end.watch != GAP_WATCH or (own is None and k == point.segment):
            continue
        least = orbit.amplitudes[end.contact, end.watch] / float(np.abs(orbit.durations).sum())
        if abs(rate) <= TOUCH_RELATIVE * least:
            return f"two touches at once: impact {k} is one, too"
    for at, near in orbit.gaps.items():
        if at == own or near.own or belongs_to_impact(orbit, near):
            continue
        if abs(near.gap) <= TOUCH_RELATIVE * orbit.amplitudes[at.contact, at.watch]:
            return f"two touches at once: {near}"
    return ""


def _touching_state(compiled: Prescribed, orbit: Orbit, place: _Place) -> Floats:
    """(x, v, theta) at the touch."""
    return compiled.after(orbit.states[place.segment], place.time, place.end.mode)


def _gap(compiled: Prescribed, state: Floats, end: End) -> tuple[Floats, float, float]:
    """Derivatives of the gap by (x, v, theta) and by the parameter, and its acceleration, at the touch."""
    here, at_once = state[None, :], np.zeros(1)
    parts = compiled.linearise(here, at_once, [end])
    in_time = np.zeros((1, compiled.size + 1))
    in_time[0, -1] = 1.0
    second = compiled.second(here, at_once, [end], in_time)[1][0, compiled.size]
    by = -end.side * parts.gap_by[0]
    return by[: compiled.size], float(by[-1]), -end.side * float(second)


def jump_at(
    compiled: Prescribed, m: Mechanism, end: End, acceleration: float
) -> tuple[ContactLaw, Floats] | str:
    """Law of a stop, and E over (x, v, theta); or why there is none."""
    if not acceleration > 0.0:
        return f"the gap has no minimum there (its acceleration is {acceleration:.6g})"
    rigid, n = m.rigid_stops, compiled.degrees
    contact = (
        rigid[end.contact] if end.watch == GAP_WATCH else m.switching[end.contact - len(rigid)]
    )
    row = -end.side * np.array(contact.row)
    lift = accelerations(m, row)
    pushed = np.zeros(compiled.size)
    if any(row[i] for i in m.massless):
        return "the stop is touched by a coordinate without mass"
    if end.watch == GAP_WATCH:
        restitution = Stop(end.contact, end.side).restitution(rigid)
        pushed[n : 2 * n] = lift / (row @ lift)
        return ContactLaw.RIGID, (1.0 + restitution) * math.sqrt(2.0 * acceleration) * pushed  # (1)
    if not isinstance(contact, SoftStop):
        return "what is touched is no stop: of friction and switches no normal form is known here"
    state = states_from_code(end.mode, len(rigid), len(m.switching))[end.contact - len(rigid)]
    if state:
        return "the soft stop is touched from within"
    pushed[n : 2 * n] = lift
    spring = contact.spring_at(end.side)
    share = 4.0 / 3.0 * math.sqrt(2.0 / acceleration)
    if spring.damping and contact.law == "unilateral":
        return ContactLaw.PRESSING, spring.damping * pushed  # (4)
    if spring.damping and contact.law == "linear":
        moved = spring.stiffness * pushed + spring.damping * _rates(compiled, end.mode, pushed)
        return ContactLaw.PULLING, share * moved  # (3)
    return ContactLaw.SPRING, share * spring.stiffness * pushed  # (2)


def _rates(compiled: Prescribed, mode: int, change: Floats) -> Floats:
    """A times a change of (x, v, theta) in the flight of a mode."""
    n, b = compiled.degrees, compiled.modes[mode].b
    y = np.zeros(len(b))
    y[0 : 2 * n : 2], y[1 : 2 * n : 2] = change[:n], change[n : 2 * n] / compiled.scale
    y = b @ y
    out = np.zeros_like(change)
    out[:n], out[n : 2 * n] = y[0 : 2 * n : 2], y[1 : 2 * n : 2] * compiled.scale
    return out
