"""Maps of a periodic orbit, with their derivatives as multilinear forms.

Full map P, half map H of a symmetric orbit (its symmetry included), the impact map from one impact
to the next, and the stroboscopic map: each is given by its Jacobian and the forms D^2 F [u, v],
D^3 F [u, v, w] in its own coordinates, exactly, by mixed jets through the kernel's flight and
impact, with event times by the implicit function theorem (theory.md, "Higher derivatives").

Coordinates of an impact section are the positions but one, the velocities after the impact and the
phase theta; the position left out is the last with the largest entry of the contact's row. (Where an
orbit begins with a change of state its guard may leave out a velocity instead.) For the
impact damper that is (x1, v1+, v2+, theta), the paper's (10) in another order. Those of the
stroboscopic map are positions and velocities. Velocities of massless coordinates are no states: they are
not among them; while a slider slips its place is tied to the others, and derivatives off that tie,
where no motion is, are those of an analytic continuation. A direction of d + 1 entries ends in the parameter's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_index, check_kind, numbers, refusal, share
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats, Integers
from vibroimpact._kernel import Jet
from vibroimpact.compile.piecewise import held_in
from vibroimpact.compile.prescribed import (
    COASTING_STOP,
    NONE_LEFT_OUT,
    End,
    Prescribed,
    compile_prescribed,
)
from vibroimpact.model.parameters import parameter_value
from vibroimpact.orbits.find import converged, later, unfolded
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import OrbitProblem

HIGHEST_ORDER = 3  # the forms have derivatives up to this order
NO_TIME_OF_PERIOD = 1e-9  # a segment that is shorter, relative to all of them, has no duration


@dataclass(frozen=True, eq=False)
class SegmentMap:
    """Map over segments of an orbit and its derivatives there.

    Attributes
    ----------
    dimension
        Number d of its coordinates.
    parameter
        Name of the parameter, "" for none.
    kept_in, kept_out
        Entries of (x, v, theta) that are the coordinates at the start and at the end.
    """

    compiled: Prescribed = field(repr=False)
    states: Floats = field(repr=False)
    durations: Floats = field(repr=False)
    ends: tuple[int, ...] = field(repr=False)  # stop numbers, COASTING_STOP last for a whole time
    start: tuple[int, int]  # stop number and the coordinate solved for, (COASTING_STOP, 0) inside
    kept_in: tuple[int, ...]
    kept_out: tuple[int, ...]
    signs: Floats = field(repr=False)  # of the coordinates at the end
    period: Floats = field(repr=False)  # whole time, with derivatives by the parameter
    last: int = 0  # number of the mode in which it coasts
    relative: Floats | None = field(
        default=None, repr=False
    )  # takes out what drifts, of (x, v, theta)

    @property
    def dimension(self) -> int:
        """Number of coordinates."""
        return len(self.kept_in)

    @property
    def parameter(self) -> str:
        """Name of the parameter, "" for none."""
        return self.compiled.parameter

    def derivative(self, *directions: Floats) -> Floats:
        """Return D^k F [u_1, .., u_k], k = 1, 2 or 3.

        Parameters
        ----------
        *directions
            Real, shape (d,), or (d + 1,) with the parameter's part last.

        Returns
        -------
        ndarray of shape (d,)

        Raises
        ------
        InvalidParameterError
            Wrong shapes or number; a parameter's part where the map has no parameter.

        Notes
        -----
        Cost: 3^k times a flight's matrix-vector products; with a parameter's part those of its
        matrix exponential. For the damper some 20 microseconds.
        """
        if not 1 <= len(directions) <= HIGHEST_ORDER:
            raise InvalidParameterError(
                f"directions: {len(directions)} given; need 1 to {HIGHEST_ORDER}."
            )
        seeds = np.zeros((len(directions), self.compiled.size + 1))
        for seed, u in zip(seeds, directions, strict=True):
            self._sow(seed, u)
        ends, kept, _ = self._places
        all_orders = self.compiled.kernel.forms(
            self.states, self.durations, ends, *self.start, self.period, self.last, seeds
        )
        highest: Floats = all_orders[-1]
        if self.relative is not None:
            highest = self.relative @ highest[: len(self.relative)]
        return self.signs * highest[kept]

    @cached_property
    def _places(self) -> tuple[list[int], Integers, Integers]:
        """Stop numbers, and places of the coordinates at the end and at the start."""
        return [*self.ends], np.array(self.kept_out), np.array(self.kept_in)

    def jacobian(self) -> Floats:
        """Return the Jacobian DF, shape (d, d)."""
        return np.column_stack([self.derivative(e) for e in np.eye(self.dimension)])

    def _sow(self, seed: Floats, direction: Floats) -> None:
        """Write a direction by the entries of (x, v, theta) and the parameter."""
        u: Any = direction  # lists are allowed
        if not isinstance(u, np.ndarray):
            u = numbers("direction", u)
        d = self.dimension
        if u.shape not in ((d,), (d + 1,)):
            raise InvalidParameterError(
                f"direction has shape {u.shape}; expected ({d},) or ({d + 1},)."
            )
        seed[self._places[2]] = u[:d]
        if u.size > d and u[d]:
            if not self.parameter:
                raise InvalidParameterError("direction: the map has no parameter. Name one.")
            seed[-1] = u[d]


def full_map(orbit: Orbit, parameter: str = "") -> SegmentMap:
    """Return the full map P, over one period from just after the first impact."""
    orbit = converged(orbit)
    if not orbit.symmetric:
        return solved_map(orbit, parameter)
    kept = _section(orbit, orbit.signature.first)
    ends = replace(orbit.signature, symmetric=False).ends
    return _map(orbit, parameter, *unfolded(orbit), ends, (kept, kept), np.ones(len(kept)))


def half_map(orbit: Orbit, parameter: str = "") -> SegmentMap:
    """Return the half map H of a symmetric orbit: half a period, then the symmetry; P = H H."""
    orbit = converged(orbit)
    if not orbit.symmetric:
        raise refusal("orbit", orbit, "symmetric: no other orbit has a half map")
    return solved_map(orbit, parameter)


def solved_map(orbit: Orbit, parameter: str = "") -> SegmentMap:
    """Half map H if the orbit was solved as symmetric, else P."""
    return map_of(orbit.problem, _compiled(orbit, parameter), orbit.states, orbit.durations)


def map_of(
    problem: OrbitProblem, compiled: Prescribed, states: Floats, durations: Floats
) -> SegmentMap:
    """Half map H of orbits that are solved as symmetric, else P, from solved segments."""
    first = problem.signature.first
    left_out = compiled.solved_coordinate(first)
    kept = tuple(i for i in _measured(problem) if i != left_out)
    return SegmentMap(
        compiled, np.ascontiguousarray(states), np.ascontiguousarray(durations),
        tuple(compiled.stop_numbers(problem.ends)), _begin(compiled, first),
        kept, *_image_of(problem, kept), np.zeros(4), relative=_relative(problem),
    )  # fmt: skip


def _image_of(problem: OrbitProblem, kept: tuple[int, ...]) -> tuple[tuple[int, ...], Floats]:
    """Entries of (x, v, theta) at the end of the solved map whose images are those that are kept, and their signs."""
    at = [problem.kept.index(i) for i in kept]
    return tuple(problem.kept[j] for j in problem.source[at]), problem.signs[at]


def impact_map(orbit: Orbit, impact: int = 0, parameter: str = "") -> SegmentMap:
    """Return the map from one impact of an orbit to the next, in the section of each."""
    orbit = converged(orbit)
    check_index("impact", impact, len(orbit.signature.impacts))
    states, durations = unfolded(orbit)
    ends = replace(orbit.signature, symmetric=False).ends
    k = impact % len(ends)
    kept = _section(orbit, ends[k - 1]), _section(orbit, ends[k])
    return _map(
        orbit, parameter, states[k : k + 1], durations[k : k + 1], ends[k : k + 1], kept,
        np.ones(len(kept[1])), ends[k - 1],
    )  # fmt: skip


def stroboscopic_map(orbit: Orbit, after: float = 0.5, parameter: str = "") -> SegmentMap:
    """Return the map over a period from a fixed phase in a flight, in positions and velocities.

    Parameters
    ----------
    orbit
        A forced orbit.
    after
        Start of the map: share of the first flight, in (0, 1).
    parameter
        Name of the parameter, if its derivatives are needed. The phase stays fixed; the period
        follows the forcing frequency.

    Raises
    ------
    InvalidParameterError
        A system without forcing, ``after`` outside (0, 1).
    """
    orbit = converged(orbit)
    if not orbit.mechanism.forces:
        raise InvalidParameterError(
            "orbit: its system has no forcing, hence no phase. Take full_map."
        )
    after = share("after", after)
    states, durations = unfolded(orbit)
    signature = replace(orbit.signature, symmetric=False)
    whole = replace(orbit, signature=signature, states=states, durations=durations)
    return map_from(whole, 0, after * float(durations[0]), parameter)


def map_from(orbit: Orbit, segment: int, time: float, parameter: str = "") -> SegmentMap:
    """Return the solved map from a fixed phase: a time after the start of one of its solved segments.

    The half map of a symmetric orbit, over half a period. Left out are segments of elements that take no time,
    where one is only touched, and the event at the end of the first segment where it begins there.
    """
    compiled, problem = _compiled(orbit, parameter), orbit.problem
    turn = float(problem.turn[-1])
    image = problem.symmetry.image if problem.symmetry else later
    states = np.vstack([orbit.states, image(orbit.states, turn)])
    durations = np.tile(orbit.durations, 2)
    ends = (replace(orbit.signature, symmetric=False).ends * 2)[: len(durations)]
    last = segment + len(orbit.durations)
    states[segment] = compiled.after(states[segment], time, ends[segment].mode)
    durations[segment] -= time
    least = NO_TIME_OF_PERIOD * float(orbit.durations.sum())
    rigid = len(orbit.mechanism.rigid_stops)
    none = [
        durations[k] == 0.0 and k == segment if end.contact < rigid else abs(durations[k]) <= least
        for k, end in enumerate(ends)
    ]
    flown = [k for k in range(segment, last) if not none[k]]
    kept = tuple(i for i in _measured(problem) if i < 2 * compiled.degrees)
    omega = Jet.of(compiled.omega_orders[0], _as_coefficients(compiled.omega_orders))
    c = (turn / omega).coefficients
    return SegmentMap(
        compiled, np.ascontiguousarray(states[[*flown, last]]), np.append(durations[flown], time),
        (*compiled.stop_numbers(ends[k] for k in flown), COASTING_STOP), (COASTING_STOP, 0), kept,
        *_image_of(problem, kept), np.array([c[0], c[1], c[3], c[7]]),
        compiled.mode_number(ends[segment].mode), _relative(problem),
    )  # fmt: skip


def _as_coefficients(orders: Floats) -> list[float]:
    """Coefficients of a jet seeded in all three directions from f, f', f'', f'''."""
    f, d1, d2, d3 = (float(x) for x in orders)
    return [f, d1, d1, d2, d1, d2, d2, d3]


def _compiled(orbit: Orbit, parameter: str) -> Prescribed:
    """Equations of an orbit's system, differentiated by a parameter if one is named."""
    check_kind("parameter", parameter, str, 'the name of a parameter, or ""')
    if parameter:
        parameter_value(orbit.system, parameter)
    if parameter == orbit.parameter:
        return orbit.problem.own
    return compile_prescribed(orbit.system, parameter, orbit.problem.codes)


def _section(orbit: Orbit, impact: End) -> tuple[int, ...]:
    left_out = orbit.problem.own.solved_coordinate(impact)
    return tuple(i for i in _measured(orbit.problem) if i != left_out)


def _measured(problem: OrbitProblem) -> list[int]:
    """Entries of (x, v, theta) that are states, without those of a drift and of what is held all the time."""
    if why := why_no_map(problem):
        raise InvalidParameterError(f"orbit: {why}. Take its multipliers.")
    left_out = *problem.pivots, *problem.held.entries
    return [i for k, i in enumerate(problem.kept) if k not in left_out]


def why_no_map(problem: OrbitProblem) -> str:
    """Why what an orbit holds all the time leaves no coordinates for a map of the rest; "" where it does."""
    m = problem.mechanism
    for contact, _ in held_in(m, problem.codes):
        element = m.elements[contact]
        if len(np.flatnonzero(element.row)) > 1 or element.motion:
            return (
                f"what element {contact} holds all the time is no single coordinate that stands still, so that "
                "there is no map of the others"
            )
    return ""


def _relative(problem: OrbitProblem) -> Floats | None:
    """Matrix that takes the drift out of changes of (x, v, theta); None where nothing drifts."""
    if not problem.pivots:
        return None
    whole = np.eye(2 * problem.mechanism.degrees + 1)
    whole[np.ix_(problem.kept, problem.kept)] = problem.relative
    return whole


def _begin(compiled: Prescribed, first: End) -> tuple[int, int]:
    """Start of a map after an event: its stop number, and the coordinate solved for."""
    left_out = compiled.solved_coordinate(first)
    if left_out == NONE_LEFT_OUT:
        return COASTING_STOP, 0
    return compiled.stop_numbers([first])[0], left_out


def _map(
    orbit: Orbit,
    parameter: str,
    states: Floats,
    durations: Floats,
    ends: Sequence[End],
    kept: tuple[tuple[int, ...], tuple[int, ...]],
    signs: Floats,
    begun: End | None = None,
) -> SegmentMap:
    compiled = _compiled(orbit, parameter)
    start = _begin(compiled, begun or orbit.signature.first)
    return SegmentMap(
        compiled, np.ascontiguousarray(states), np.ascontiguousarray(durations),
        tuple(compiled.stop_numbers(ends)), start, *kept, signs, np.zeros(4), relative=_relative(orbit.problem),
    )  # fmt: skip
