"""Search for an invariant circle from a motion, a normal form, a guess, or a neighbouring circle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.checks import (
    check_count,
    check_flag,
    check_memory,
    names_arguments,
    numbers,
    positive,
    real,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import interruptible
from vibroimpact._core.types import Floats
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.branches.kinds import NS
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.model.parameters import parameter_value, with_parameter
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.normal_forms.neimark_sacker import NeimarkSacker
from vibroimpact.orbits.find import stops_of
from vibroimpact.orbits.newton import scale_of
from vibroimpact.orbits.problem import Signature, check_signature
from vibroimpact.simulation.sections import Section
from vibroimpact.tori.circle import Circle
from vibroimpact.tori.fourier import shifted
from vibroimpact.tori.maps import CircleMap, FormulaMap, SignatureMap, impact_map
from vibroimpact.tori.motion import Started, from_iterates, from_motion, nothing
from vibroimpact.tori.solve import (
    FEWEST_NODES,
    FOUND,
    MOST_NODES,
    TOLERANCE,
    Trial,
    nodes_needed,
    solve,
)

BYTES_PER_ITERATE = 4096  # an iterate takes so many in a record of some impacts
PREDICTED_NODES = 31  # the prediction of a normal form has so many nodes
FEWER_NODES_SHARE = 0.8  # a circle that needs a smaller share of its nodes is solved with fewer


class CircleGuess(NamedTuple):
    """Start of Newton's method for a formula.

    ``points`` at equal phases, shape (n, d), and the turns per iterate.
    """

    points: Floats
    rotation_number: float

    def __eq__(self, other: object) -> bool:
        return self is other  # arrays have no truth value

    def __hash__(self) -> int:
        return id(self)


@names_arguments()
@interruptible
def find_circle(
    system: System | ExplicitMap,
    start: State | Section | BifurcationPoint | Circle | CircleGuess | Sequence[float],
    *,
    p: float | None = None,
    stops: Sequence[tuple[int, int] | str] | None = None,
    cycles: int | None = None,
    symmetric: bool | None = None,
    settle_iterates: int = 4000,
    points: int = 4000,
    tolerance: float = TOLERANCE,
    most_nodes: int = MOST_NODES,
) -> Circle:
    """Find an invariant circle (torus) as a smooth curve u with F(u(phi)) = u(phi + rho).

    Parameters
    ----------
    system
        A system, whose map from the section of an event is meant: the half map H of motion that its symmetry maps
        to itself, else the full map P; or a map given by a formula.
    start
        For a system: a :class:`State` to simulate from, or a section, from whose last state; the
        circle is that on which the motion settles. Or a Neimark-Sacker point of a branch,
        ``branch["NS1"]``: the circle that its normal form predicts at the system's value of the
        branch's parameter, stable or not. Or a circle of a system like it.
        For a formula: a point, shape (d,), to iterate from; a :class:`CircleGuess`; a circle.
    p
        Parameter of a formula; by default that of the circle, or 0.
    stops, cycles, symmetric
        Signature, as of :func:`find_orbit`; by default that of the motion, which of a machine with elements has all
        events and must not be given. ``symmetric=False`` solves on the full map.
    settle_iterates
        Iterates of the motion to discard first, >= 0; four times as many if it has not settled
        then, up to three times.
    points
        Iterates of the motion from which the first guess is made, at least 64.
    tolerance
        Largest residual, coordinates in units of their sizes, > 0.
    most_nodes
        Largest number of nodes, at least 15.

    Returns
    -------
    Circle
        With ``converged`` False and a sentence in ``status`` where the motion is periodic, chaotic
        or does not settle, where the order of its events changes, where the forcing frequencies have no common
        period, where there is no circle on this side of a Neimark-Sacker point, where Newton's method fails or the
        circle needs more nodes.

    Raises
    ------
    InvalidParameterError
        A start of another kind, or one that does not go with the system; a signature that no
        motion can have; a point of a branch that is not a Neimark-Sacker point.

    Notes
    -----
    The solution is a trigonometric polynomial with an exact Jacobian (tori/solve.py); circles that
    wind around the phase of the forcing are not found. Cost: the motion, some 10 ms, and about
    five Newton steps, each O((N d)^3): 10 ms for N = 100 nodes of the damper, 0.5 s for 500.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.00734)
    >>> circle = vi.find_circle(damper, vi.State((0.0, 0.0), (0.0, 1.0)))
    >>> circle.stable, circle.residual < 1e-10
    (True, True)
    """
    for name, count, least in (("settle_iterates", settle_iterates, 0), ("points", points, 64)):
        check_count(name, count, least)
    check_memory("points", points, BYTES_PER_ITERATE, "Take fewer.")
    check_count("most_nodes", most_nodes, FEWEST_NODES)
    tolerance = positive("tolerance", tolerance)
    if isinstance(system, ExplicitMap):
        for name, given in (("stops", stops), ("cycles", cycles), ("symmetric", symmetric)):
            if given is not None:
                raise refusal(name, given, "left out for a formula")
        started = _of_formula(system, start, p, settle_iterates, points)
    else:
        if p is not None:
            raise refusal("p", p, "left out for a system", "Its fields are its parameters.")
        mechanism_of(system)
        signature = _signature(system, stops, cycles, symmetric)
        started = _of_system(system, start, signature, symmetric, settle_iterates, points)
    if started.trial is None or started.map is None:
        return _missing(system, started)
    circle = _solved(started.map, started.trial, tolerance, most_nodes)
    if isinstance(start, BifurcationPoint) and not circle.converged:
        advice = f"find one nearer to {start.label} at {start.parameter:.9g}, and continue_circle"
        return replace(circle, status=f"{circle.status}; {advice}")
    return circle


def _solved(circle_map: CircleMap, guess: Trial, tolerance: float, most_nodes: int) -> Circle:
    """Circle from a guess, with no more nodes than it needs."""
    found = solve(circle_map, guess, tolerance=tolerance, most_nodes=most_nodes)
    count = nodes_needed(found.trial.points, circle_map.sizes, tolerance)
    if found.status == FOUND and count < FEWER_NODES_SHARE * len(found.trial.points):
        fewer = found.trial.at_nodes(count)
        found = solve(circle_map, fewer, tolerance=tolerance, most_nodes=most_nodes)
    return oriented(circle_of(circle_map, found.trial, found.residual, found.status))


def circle_of(circle_map: CircleMap, trial: Trial, residual: float, status: str) -> Circle:
    """Circle from the solution of its equations."""
    impacting = circle_map if isinstance(circle_map, SignatureMap) else None
    arrays = trial.points.copy(), trial.times.copy()
    for array in arrays:
        array.flags.writeable = False
    return Circle(
        circle_map.system_at(trial.p), impacting.signature if impacting else None,
        impacting.parameter if impacting else "", float(trial.p), *arrays,
        float(trial.rotation) % 1.0, float(residual), status, circle_map,
    )  # fmt: skip


def oriented(circle: Circle) -> Circle:
    """The circle passed in the sense in which rho <= 1/2."""
    if circle.rotation_number <= 0.5:
        return circle
    back = -np.arange(circle.nodes) % circle.nodes
    return replace(
        circle, points=circle.points[back], times=circle.times[back],
        rotation_number=1.0 - circle.rotation_number,
    )  # fmt: skip


def _missing(system: System | ExplicitMap, started: Started) -> Circle:
    """Return a circle that is not converged, with the reason."""
    if isinstance(system, ExplicitMap):
        nowhere: CircleMap = FormulaMap(system)
        d, m = system.dimension, 0
    else:
        d, m = 2 * mechanism_of(system).degrees, 1
        signature = started.signature or Signature((Stop(0, 1),), 1)
        nowhere = SignatureMap(system, signature, "", np.ones(d))
        if started.signature:
            d, m = len(nowhere.kept), len(nowhere.problem.ends)
            nowhere = replace(nowhere, sizes=np.ones(d))
    trial = Trial(np.full((FEWEST_NODES, d), np.nan), np.nan, 0.0, np.ones((FEWEST_NODES, m)))
    circle = circle_of(nowhere, trial, np.inf, started.status)
    return replace(circle, signature=started.signature)


# ---- second iterates -----------------------------------------------------------------------------


def second_iterate(circle: Circle) -> CircleMap:
    """Map of the second iterate; that of the half map is the full map."""
    if isinstance(circle.system, ExplicitMap):
        return FormulaMap(replace(circle.system, iterate=2 * circle.system.iterate))
    assert isinstance(circle.map, SignatureMap)
    return replace(circle.map, signature=_twice(circle.map.signature))


def _twice(known: Signature) -> Signature:
    if known.symmetric:
        return replace(known, symmetric=False)
    return known.repeated(2)


def of_second_iterate(circle: Circle, count: int) -> Trial:
    """The circle as one of the second iterate."""
    trial, rho = circle.trial.at_nodes(count), circle.rotation_number
    times = np.column_stack([trial.times, shifted(trial.times, rho)])
    return replace(trial, rotation=2.0 * rho, times=times)


# ---- starts of formulas --------------------------------------------------------------------------


def _of_formula(
    formula: ExplicitMap, start: Any, p: float | None, settle_iterates: int, points: int
) -> Started:
    if isinstance(start, Circle):
        if not isinstance(start.system, ExplicitMap):
            raise refusal("start", start, "a circle of a formula")
        value = start.value if p is None else real("p", p)
        return Started(FormulaMap(formula), None, replace(start.trial, p=value))
    value = 0.0 if p is None else real("p", p)
    if isinstance(start, CircleGuess):
        curve = numbers("start.points", start.points)
        rho = real("start.rotation_number", start.rotation_number) % 1.0
        if curve.ndim != 2 or curve.shape[1] != formula.dimension or len(curve) < 3:
            raise InvalidParameterError(
                f"start.points has shape {curve.shape}; expected (n, {formula.dimension}), n >= 3."
            )
        trial = Trial(curve, rho, value, np.empty((len(curve), 0)))
        return Started(FormulaMap(formula), None, trial.at_nodes(_odd(len(curve))))
    if isinstance(start, State | Section | BifurcationPoint):
        raise refusal("start", start, "a point, a CircleGuess or a Circle for a formula")
    x = numbers("start", start)
    if x.shape != (formula.dimension,):
        raise InvalidParameterError(
            f"start has shape {x.shape}; expected ({formula.dimension},). Give a CircleGuess for "
            "points on a curve."
        )
    return from_iterates(formula, x, value, settle_iterates, points)


def _odd(count: int) -> int:
    return max(FEWEST_NODES, count + 1 - count % 2)


# ---- starts of systems ---------------------------------------------------------------------------


def _signature(
    system: System, stops: Any, cycles: int | None, symmetric: bool | None
) -> Signature | None:
    if symmetric is not None:
        check_flag("symmetric", symmetric)
    if stops is None:
        if cycles is not None:
            raise refusal("cycles", cycles, "given together with stops")
        return None
    if cycles is None:
        raise InvalidParameterError("cycles = None: must be given together with stops.")
    check_count("cycles", cycles, 0)
    signature = Signature(stops_of(stops), cycles, bool(symmetric))
    check_signature(mechanism_of(system), signature)
    return signature


def _of_system(
    system: System,
    start: Any,
    signature: Signature | None,
    symmetric: bool | None,
    settle_iterates: int,
    points: int,
) -> Started:
    if isinstance(start, Section):
        start = start.last
    if isinstance(start, State):
        return from_motion(system, start, signature, symmetric, settle_iterates, points)
    if signature is not None:
        raise refusal("stops", signature.impacts, "left out: the start has its own signature")
    if isinstance(start, BifurcationPoint):
        return _from_point(system, start)
    if isinstance(start, Circle) and isinstance(start.map, SignatureMap):
        signature, guess = start.map.signature, start.trial
        if symmetric is False and start.symmetric:
            signature, guess = _twice(signature), of_second_iterate(start, start.nodes)
        here = replace(start.map, system=system, signature=signature, parameter="")
        return Started(here, signature, guess)
    raise refusal("start", start, "a State, a section, a Neimark-Sacker point or a circle")


def _from_point(system: System, point: BifurcationPoint) -> Started:
    """Guess from the normal form of a Neimark-Sacker point."""
    if point.record != NS or not isinstance(point.problem, OrbitFamily):
        raise refusal("start", point, "a Neimark-Sacker point", 'Take branch["NS1"].')
    signature, form = point.orbit.signature, point.normal_form
    if isinstance(form, Refusal) or not isinstance(form, NeimarkSacker):
        why = form.reason if isinstance(form, Refusal) else form.kind
        return nothing(f"no normal form at {point.label}: {why}", signature)
    value = parameter_value(system, point.name)
    if with_parameter(point.orbit.system, point.name, value) != system:
        raise InvalidParameterError(
            f"start = {point!r}: must be of this system, apart from {point.name}."
        )
    dp = value - point.parameter
    if not form.radius(dp) > 0.0:
        side = "above" if form.side > 0 else "below"
        status = f"no circle here: {point.label} at {point.parameter:.9g} has its circles {side}"
        return nothing(status, signature)
    orbit = point.orbit
    z = orbit.problem.packed(orbit.states, orbit.durations)
    scale = np.ones(orbit.states.shape[1])
    scale[orbit.problem.kept] = scale_of(orbit.problem, z)[: orbit.problem.size]
    circle_map = impact_map(system, signature, scale, orbit.states[0])
    curve = circle_map.coordinates(orbit.states[:1]) + form.circle(dp, PREDICTED_NODES)
    times = np.tile(orbit.durations, (PREDICTED_NODES, 1))
    return Started(circle_map, signature, Trial(curve, form.rotation_number(dp), 0.0, times))
