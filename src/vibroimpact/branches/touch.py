"""Normal form at a touch of an orbit: its coefficients from the flight and the law of the stop.

Method      h is the gap of the stop that is touched, r its row by the positions, a = h'' > 0, M the mass matrix. A
            motion that would pass the stop by delta changes at once, to leading order, by (theory.md, "At a touch")
                rigid, restitution R       (1 + R) v (2 a delta)^(1/2),  v = M^-1 r' / (r M^-1 r')          (1)
                and in the next order, with A the rates of the flight, h1 and h2 the derivatives of h' and h'' by the
                state, j the third one of h by time, y = delta^(1/2)
                    (1 + R) y ((2 / a)^(1/2) [(h1 xi) A v + (h2 - (j / a) h1) xi v / 2]
                    + y [2 A v - (2 j / 3 a) v])                                                         (1a)
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
Reference   theory.md, (T57b) to (T57f)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.branches.grazing import belongs_to_impact
from vibroimpact.branches.point import TOUCH_RELATIVE, BifurcationPoint
from vibroimpact.compile.piecewise import state_in
from vibroimpact.compile.prescribed import GAP_WATCH, End, Prescribed
from vibroimpact.model.mechanism import Mechanism, accelerations
from vibroimpact.model.stop import Stop
from vibroimpact.normal_forms.critical import HALF_OF_THE_DIGITS, Refusal, Status
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.touch import ContactLaw, Touch
from vibroimpact.orbits.maps import SegmentMap, map_from
from vibroimpact.orbits.orbit import Orbit

SINGULAR = 1e-9  # I - L is singular below this least singular value, relative to the largest


class Place(NamedTuple):
    """Where an orbit touches: a time after the start of a flight, and the guard."""

    segment: int
    time: float
    end: End


class TouchedMap(NamedTuple):
    """Map of an orbit from the phase of its touch, and the gap there."""

    solved: SegmentMap
    linear: Floats  # L
    gap: Floats  # C over (x, v, theta)
    by_parameter: float  # h_p
    acceleration: float  # a
    push: Floats  # over (x, v, theta): speeds that a unit impulse gives, M^-1 r'
    lift: float  # r M^-1 r'

    @property
    def kept(self) -> list[int]:
        """Entries of (x, v, theta) that are coordinates of the map."""
        return list(self.solved.kept_in)

    def conditions(self, sizes: Floats) -> tuple[float, float]:
        """gamma_1 and kappa_1 of a unit impulse, the latter times D / (1 + D^2)^(1/2), D = det(I - L): no pole.

        Determinants are those of rows and columns of size one: neither pivots nor rounding depend on units.
        """
        linear = self.linear * sizes / sizes[:, None]
        moved, gap = linear @ (self.push[self.kept] / sizes), self.gap[self.kept] * sizes
        off = np.eye(len(moved)) - linear
        row, column = (float(np.abs(part).max()) or 1.0 for part in (gap, moved))
        bordered = np.block([[off, moved[:, None] / column], [gap[None] / row, np.zeros((1, 1))]])
        whole = math.hypot(1.0, float(np.linalg.det(off)))
        return float(gap @ moved), -float(np.linalg.det(bordered)) / whole * row * column


def touched_map(orbit: Orbit, place: Place, parameter: str = "") -> TouchedMap:
    """Map from a touch of an orbit. Cost: d first derivatives of the map."""
    solved, end = map_from(orbit, place.segment, place.time, parameter), place.end
    compiled = solved.compiled
    state = compiled.after(orbit.states[place.segment], place.time, end.mode)
    here, at_once = state[None, :], np.zeros(1)
    in_time = np.zeros((1, compiled.size + 1))
    in_time[0, -1] = 1.0
    by = -end.side * compiled.linearise(here, at_once, [end]).gap_by[0]
    second = compiled.second(here, at_once, [end], in_time)[1][0, compiled.size]
    mechanism = compiled.mechanism
    row = -end.side * np.array(mechanism.elements[end.contact].row)
    lift, n = accelerations(mechanism, row), compiled.degrees
    push = np.zeros(compiled.size)
    push[n : 2 * n] = lift
    return TouchedMap(
        solved, solved.jacobian(), by[: compiled.size], float(by[-1]), -end.side * float(second), push,
        float(row @ lift),
    )  # fmt: skip


def touch(kind: PointKind, point: BifurcationPoint) -> Touch | Refusal:
    """Compute the normal form of a point at which an orbit touches a stop.

    Cost: d + 1 first derivatives of the map.
    """
    orbit = point.orbit
    place = _place(point)
    if isinstance(place, str):
        return _refused(kind, place, orbit)
    if not orbit.problem.mechanism.forces:
        return _refused(kind, "without forcing the touch has no phase of its own", orbit)
    if why := _another(point) or why_no_law(orbit.problem.mechanism, place.end):
        return _refused(kind, why, orbit)
    at = touched_map(orbit, place, point.name)
    if not at.acceleration > 0.0:
        why = f"the gap has no minimum there (its acceleration is {at.acceleration:.6g})"
        return _refused(kind, why, orbit, Status.DEGENERATE)
    law, jump = jump_at(at, place.end)
    direction = np.zeros(len(at.kept) + 1)
    direction[-1] = 1.0
    off = np.eye(len(at.linear)) - at.linear
    values = np.linalg.svd(off, compute_uv=False)
    if not (np.all(np.isfinite(off)) and values[-1] > SINGULAR * values[0]):
        why = "1 is a multiplier of the touching orbit: a fold at the touch, of codimension two"
        return _refused(kind, why, orbit, Status.OTHERS_CRITICAL)
    parts = at.gap[at.kept] * np.linalg.solve(off, at.solved.derivative(direction))
    opening = float(parts.sum()) + at.by_parameter  # (5)
    size = float(np.abs(parts).sum()) + abs(at.by_parameter)
    if not abs(opening) > HALF_OF_THE_DIGITS * size:
        why = f"{point.name} does not move the touching orbit across the stop"
        return _refused(kind, why, orbit, Status.NOT_TRANSVERSAL)
    rate, bend, jerk = _next_of_gap(at, place, orbit)
    cross, second = np.zeros((len(rate), len(rate))), np.zeros(len(rate))
    if law is ContactLaw.RIGID:
        cross, second = _next_of_jump(at, place.end, rate, bend, jerk)
    names = [f"{letter}{i + 1}" for letter in "xv" for i in range(at.solved.compiled.degrees)]
    return Touch(
        kind=kind.label,
        parameter=point.name,
        at=point.parameters[point.name],
        stop=Stop(place.end.contact, place.end.side).words,
        law=law,
        acceleration=at.acceleration,
        opening=opening,
        coordinates=tuple(names[i] for i in at.kept),
        linear=at.linear,
        jump=jump[at.kept],
        gap=at.gap[at.kept],
        rate=rate[at.kept],
        bend=bend[at.kept],
        jerk=jerk,
        cross=cross[np.ix_(at.kept, at.kept)],
        second=second[at.kept],
    )


def _refused(
    kind: PointKind, why: str, orbit: Orbit, status: Status = Status.NOT_SMOOTH
) -> Refusal:
    multipliers: Complexes = orbit.multipliers
    return Refusal(kind.label, status, f"{kind.label}: {why}.", multipliers)


def _place(point: BifurcationPoint) -> Place | str:
    """Flight, time and guard of a touch; or why there is none that has a normal form."""
    problem, near = point.orbit.problem, point.nearest
    if near is not None:
        end = End(near.contact, near.side, problem.modes[near.segment], near.watch)
        return Place(near.segment, near.time, end)
    end = problem.ends[point.segment]
    if end.watch != GAP_WATCH:
        return "the touch of an element from within has no normal form here"
    return Place(point.segment, float(point.orbit.durations[point.segment]), end)


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


def why_no_law(m: Mechanism, end: End) -> str:
    """Reason why the touch of a guard has no law here; "" where it has one."""
    element = m.elements[end.contact]
    if not element.is_stop:
        return "what is touched is no stop: of friction and switches no normal form is known here"
    if any(element.row[i] for i in m.massless):
        return "the stop is touched by a coordinate without mass"
    inside = not element.rigid and state_in(m, end.mode, end.contact)  # open is 0
    return "the soft stop is touched from within" if inside else ""


def jump_at(at: TouchedMap, end: End) -> tuple[ContactLaw, Floats]:
    """Law of a stop that is touched from outside, and E over (x, v, theta)."""
    m, a = at.solved.compiled.mechanism, at.acceleration
    element = m.elements[end.contact]
    if element.rigid:
        restitution = Stop(end.contact, end.side).restitution(m.rigid_stops)
        return ContactLaw.RIGID, (1.0 + restitution) * math.sqrt(2.0 * a) * at.push / at.lift  # (1)
    spring = element.spring_at(end.side)
    assert spring is not None
    share = 4.0 / 3.0 * math.sqrt(2.0 / a)
    if spring.damping and element.damping_law == "unilateral":
        return ContactLaw.PRESSING, spring.damping * at.push  # (4)
    if spring.damping and element.damping_law == "linear":
        rates = _rates(at.solved.compiled, end.mode, at.push)
        return ContactLaw.PULLING, share * (
            spring.stiffness * at.push + spring.damping * rates
        )  # (3)
    return ContactLaw.SPRING, share * spring.stiffness * at.push  # (2)


def _next_of_gap(at: TouchedMap, place: Place, orbit: Orbit) -> tuple[Floats, Floats, float]:
    """Derivatives of h' and h'' over (x, v, theta), at a fixed phase, and the third one of h by time."""
    compiled, end = at.solved.compiled, place.end
    mode = compiled.modes[end.mode]
    state = compiled.after(orbit.states[place.segment], place.time, end.mode)
    moved = mode.b @ compiled.embedded(state[:-1], state[-1]) + mode.constant
    first = -end.side * compiled.guard(end).row @ mode.b
    jerk = float(first @ mode.b @ moved)
    return _over_state(compiled, first), _over_state(compiled, first @ mode.b), jerk


def _next_of_jump(
    at: TouchedMap, end: End, rate: Floats, bend: Floats, jerk: float
) -> tuple[Floats, Floats]:
    """G and H of (1a) over (x, v, theta)."""
    compiled, a = at.solved.compiled, at.acceleration
    kept = 1.0 + Stop(end.contact, end.side).restitution(compiled.mechanism.rigid_stops)
    v = at.push / at.lift
    turned = _rates(compiled, end.mode, v)
    cross = np.outer(turned, rate) + np.outer(v, bend - rate * (jerk / a)) / 2.0
    second = 2.0 * turned - 2.0 * jerk / (3.0 * a) * v
    return kept * math.sqrt(2.0 / a) * cross, kept * second


def _over_state(compiled: Prescribed, row: Floats) -> Floats:
    """A row over y as one over (x, v, theta), at a fixed phase."""
    n, out = compiled.degrees, np.zeros(compiled.size)
    out[:n], out[n : 2 * n] = row[0 : 2 * n : 2], row[1 : 2 * n : 2] / compiled.scale
    return out


def _rates(compiled: Prescribed, mode: int, change: Floats) -> Floats:
    """A times a change of (x, v, theta) in the flight of a mode."""
    n, b = compiled.degrees, compiled.modes[mode].b
    y = np.zeros(len(b))
    y[0 : 2 * n : 2], y[1 : 2 * n : 2] = change[:n], change[n : 2 * n] / compiled.scale
    y = b @ y
    out = np.zeros_like(change)
    out[:n], out[n : 2 * n] = y[0 : 2 * n : 2], y[1 : 2 * n : 2] * compiled.scale
    return out
