"""Continuation of a bifurcation in two parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import (
    check_choice,
    check_flag,
    check_kind,
    range_of,
    real,
    refusal,
    vector,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.types import Flags, Floats
from vibroimpact.bifurcations.augmented import BOUND, Augmented, Bounds, Tests
from vibroimpact.bifurcations.conditions import Condition, Level
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.equations import Equations, Pair
from vibroimpact.bifurcations.of_maps import MapPlane
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.special import special_points
from vibroimpact.bifurcations.starting_orbits import solution_at
from vibroimpact.bifurcations.tests_along import (
    COSINE,
    CUBIC,
    condition_of,
    nothing,
    on_multipliers,
)
from vibroimpact.branches.checks import check_parameter
from vibroimpact.branches.family import REST, STICK, OrbitFamily, lossless
from vibroimpact.branches.kinds import BP, EVENTS, GR, LEVEL, NS, ONE, Function, checked_value
from vibroimpact.branches.point import BifurcationPoint, is_motion
from vibroimpact.branches.same_orbit import half_turn
from vibroimpact.continuation import Curve, Steps, Stopped, continue_curve
from vibroimpact.continuation.curve import End, Unresolved
from vibroimpact.continuation.walk import check_steps
from vibroimpact.model.parameters import parameter_value
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.normal_forms.kind import PointKind, PointKinds
from vibroimpact.orbits.find import converged
from vibroimpact.orbits.orbit import Orbit

STEPS = Steps(first=0.02, largest=0.5, points=600)


class Start(NamedTuple):
    """Bifurcation, or a guess of one, from which its curve is followed."""

    kind: PointKind
    equations: Equations
    condition: Condition
    tests: Tests
    z: Floats
    a: Pair


@interruptible
def continue_bifurcation(
    point: BifurcationPoint,
    parameters: tuple[str, str],
    bounds: tuple[Bounds, Bounds],
    *,
    kind: str = "",
    steps: Steps | None = None,
    both: bool = True,
    progress: ProgressOption = True,
) -> BifurcationCurve:
    """Follow a bifurcation in two parameters, with all its points of codimension two.

    Parameters
    ----------
    point
        Where to start: a special point of a branch, of any kind but a branch point of orbits without symmetry; a point
        of another curve; or a :func:`map_bifurcation`.
    parameters
        Names of two different parameters; that of the branch need not be among them.
    bounds
        ((low, high), (low, high)) of both, with the start inside; the curve ends exactly there, or where it closes.
    kind
        From a point of a curve the kind of the curve to follow through it, by its label, such as "NS". Elsewhere it is
        that of the point.
    steps
        Step lengths in scaled arclength, number of points.
    both
        Follow it in both directions.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every panel of points.

    Returns
    -------
    BifurcationCurve
        Also where it could not be followed to the end, with the reason in ``ends``.

    Raises
    ------
    InvalidParameterError
        The same parameter twice, no such parameter, bounds that are empty or without the start, a point without such a
        curve, a start that does not converge; a parameter that the orbit's equations forbid, as in
        :func:`~vibroimpact.continue_orbit`.

    Notes
    -----
    Curves pass folds, points of codimension two, grazing of other stops and stretches of inadmissible orbits. One of
    NS passes R1 and R2 and goes on as a curve of neutral saddles, ``neutral``. Points are nodes of Chebyshev panels on
    which every test function is resolved, so that no zero is skipped (continuation/panel.py). Cost: about 10 ms a
    point for the impact damper.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.0)
    >>> branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (0.9, 1.0))
    >>> curve = vi.continue_bifurcation(branch["NS1"], ("omega", "half_clearance"),
    ...                                 ((0.9, 1.0), (4.5, 5.5)))
    >>> round(curve["R4_1"].parameters["half_clearance"], 7)
    5.071507
    """
    check_steps(steps, progress)
    check_flag("both", both)
    check_kind("kind", kind, str, "the kind of a curve, or empty")
    start = _start(point, parameters, bounds, kind)
    inside = ranges(start.equations.names, start.a, bounds)
    with Reporter(progress, f"curve of {start.kind}") as report:
        told = report.counted("points", start.equations.names[1])
        return followed(start, inside, both=both, steps=steps, progress=told)


@interruptible
def continue_level(
    orbit: Orbit,
    function: Function,
    parameters: tuple[str, str],
    bounds: tuple[Bounds, Bounds],
    *,
    value: float | None = None,
    steps: Steps | None = None,
    both: bool = True,
    progress: ProgressOption = True,
) -> BifurcationCurve:
    """Follow orbits on which a function keeps its value, in two parameters.

    Parameters
    ----------
    orbit
        A converged orbit on the curve, or near it.
    function
        g(states, durations, parameters) of the states (x, v, theta) just after each solved impact, shape (m, 2n + 1),
        the flight times, shape (m,), and the parameters of the system by name. It computes with + - * / ** and numpy
        functions, so that it can be differentiated: numbers may be jets.
    value
        The value that is kept; by default that at the orbit.
    parameters, bounds, steps, both, progress
        As for :func:`continue_bifurcation`.

    Returns
    -------
    BifurcationCurve
        Its kind is "level".

    Raises
    ------
    InvalidParameterError
        As :func:`continue_bifurcation`.

    Examples
    --------
    Orbits whose impacts are equally fast, in the plane of frequency and clearance:

    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.0)
    >>> curve = vi.continue_level(vi.symmetric_orbits(damper)[0],
    ...     lambda states, durations, parameters: states[0, 2] - states[0, 3],
    ...     ("omega", "half_clearance"), ((0.95, 1.0), (4.0, 6.0)))
    >>> curve.kind
    'level'
    """
    check_steps(steps, progress)
    check_flag("both", both)
    if not callable(function):
        raise refusal("function", function, "a function of states, durations and parameters")
    names = names_of_two(parameters)
    plane, z, a = _of_orbit(converged(orbit), names, bounds, EVENTS)
    level = Level(plane, function, 0.0)
    own = checked_value("function", function, level.arguments(z, a))
    level.level = own if value is None else real("value", value)
    start = Start(LEVEL, plane, level, nothing, z, a)
    with Reporter(progress, "curve of a level") as report:
        told = report.counted("points", names[1])
        return followed(start, ranges(names, a, bounds), both=both, steps=steps, progress=told)


def followed(
    start: Start, bounds: tuple[Bounds, Bounds], *, steps: Steps | None = None, **options: Any
) -> BifurcationCurve:
    """Curve from a start; ``options`` are those of ``continue_curve``."""
    problem = Augmented(start.equations, start.condition, start.tests, bounds)
    problem.silent |= _zero_with(start)
    guess = problem.packed(start.z, start.condition.start(start.z, start.a), start.a)
    curve = continue_curve(
        problem, guess, start.a[1], bounds[1], terminal=(BOUND,), steps=steps or STEPS, **options
    )
    return curve_of(start.kind, problem, curve)


def _zero_with(start: Start) -> set[str]:
    """Test functions that are zero all along with that of the condition.

    That of the other half in an orbit that is its own mirror image; where a stick or rest takes no time, the margin
    to the limit at which it would not begin.
    """
    word, _, number = start.condition.own.partition(" ")
    orbit = start.equations.solution(start.z, start.a)
    if not number.isdigit() or not isinstance(orbit, Orbit):
        return set()
    half, k = half_turn(orbit), int(number)
    both = {k, (k + half) % (2 * half)} if half else {k}
    return {f"{w} {i}" for w in {word, STICK if word == REST else word} for i in both}


def curve_of(kind: PointKind, problem: Augmented, curve: Curve) -> BifurcationCurve:
    """Curve of bifurcations from a continued curve."""
    refused = getattr(problem.equations, "refused", "")
    before, after = (_explained(end, problem, refused) for end in curve.ends)
    curve = replace(curve, ends=(before, after))
    places = list(zip(curve.z, curve.parameter.tolist(), strict=True))
    both = [(problem.orbit(Z, p), problem.multipliers(Z, p)) for Z, p in places]
    solutions, multipliers = [solution for solution, _ in both], np.array([mu for _, mu in both])
    found, doubtful = special_points(kind, problem, curve, solutions)
    parts = [problem.parts(Z, p) for Z, p in places]
    neutral = np.zeros(len(curve), dtype=bool)
    if kind.critical == (None,):
        neutral = np.abs(curve.tests[COSINE]) > 1.0
    unresolved = [*_of_pairs(curve, neutral), *doubtful]
    curve = replace(curve, unresolved=tuple(unresolved))
    if isinstance(problem.equations, OrbitPlane):
        problem.equations.forget()
    return BifurcationCurve(
        record=kind,
        names=problem.equations.names,
        bounds=problem.bounds,
        values=np.array([a for _, _, a in parts]),
        multipliers=multipliers,
        admissible=np.array([is_motion(solution, kind) for solution in solutions]),
        neutral=neutral,
        special_points=tuple(found),
        curve=curve,
        problem=problem,
    )


def _of_pairs(curve: Curve, neutral: Flags) -> Iterator[Unresolved]:
    """Unresolved parts of a curve; that of a coefficient which neutral saddles lack is cut to the others."""
    for part in curve.unresolved:
        if part.name != CUBIC:
            yield part
            continue
        inside = np.arange(part.first, part.last + 1)
        inside = inside[~neutral[inside]]
        for run in np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1):
            if run.size:
                first, last = max(int(run[0]) - 1, 0), min(int(run[-1]) + 1, len(curve) - 1)
                yield replace(part, first=first, last=last)


def _explained(end: End, problem: Augmented, refused: str) -> End:
    """End of a curve, in terms of the first parameter or of the reason why there is no system."""
    if end.reason is Stopped.EVENT and end.detail == BOUND:
        return End(Stopped.RANGE, problem.equations.names[0])
    if end.reason is Stopped.RANGE:
        return End(Stopped.RANGE, problem.equations.names[1])
    failed = end.reason is Stopped.STEP and refused
    return End(end.reason, f"{end.detail}; {refused}") if failed else end


# ---- the start -----------------------------------------------------------------------------------


def _start(point: Any, parameters: Any, bounds: Any, kind: str) -> Start:
    check_kind(
        "point",
        point,
        BifurcationPoint,
        "a special point of a branch or a curve, or a map_bifurcation",
    )
    if not isinstance(point.problem, OrbitFamily | Augmented):
        raise refusal("point", point, "a special point of orbits or of a map, not of circles")
    names = names_of_two(parameters)
    if isinstance(point.orbit, Orbit):
        wanted = _kind_at(point, kind)
        _check_flights(wanted, point)
        plane, z, a = _of_orbit(point.orbit, names, bounds, _events_at(point))
        condition, tests = _condition(wanted, point, plane)
        return Start(wanted, plane, condition, tests, z, a)
    wanted = _kind_at(point, kind)
    equations, _, a = solution_at(point)
    if names != equations.names:
        raise InvalidParameterError(
            f"parameters = {names}: those of the map are {equations.names}, in this order."
        )
    return Start(wanted, equations, *on_multipliers(wanted, equations), point.orbit.x, a)


def _events_at(point: BifurcationPoint) -> PointKinds:
    """Kinds with test functions of their own on the branch or curve of a point."""
    equations = getattr(point.problem, "equations", point.problem)
    events: PointKinds = equations.events
    return events


def _kind_at(point: BifurcationPoint, kind: str) -> PointKind:
    """Kind of the curve that is wanted, refused where there is none."""
    own = point.curve or point.record
    if kind and kind != own.label:
        check_choice("kind", kind, ONE if point.curve else (own.label,))
        own = ONE[kind]
    wanted = own.of_map(symmetric=getattr(point.orbit, "symmetric", False))
    if wanted == BP:
        raise InvalidParameterError(
            f"point = {point.label}: two branches cross there, which one more parameter undoes: there is no curve of "
            "such points. Take a point of a symmetric orbit, or follow the folds beside it."
        )
    if (
        wanted == NS
        and isinstance(point.orbit, Orbit)
        and lossless(point.orbit.mechanism, point.orbit.signature)
    ):
        raise InvalidParameterError(
            f"kind = {wanted.label!r}: without loss the products of multipliers are one everywhere. Add damping, or "
            "take restitution < 1."
        )
    return wanted


def _check_flights(kind: PointKind, point: BifurcationPoint) -> None:
    """Refuse a touch at which a flight vanishes, where a singular Jacobian would be taken for that of a family."""
    if (kind == GR or kind.power) and point.curve is None and point.orbit.rateless:
        raise InvalidParameterError(
            f"point = {point.label}: a flight of the orbit vanishes there, and its equations are singular. "
            f"Take the same touch of the orbits without that flight: switch_branch(point), then its {kind.label}."
        )


def _condition(
    kind: PointKind, point: BifurcationPoint, plane: OrbitPlane
) -> tuple[Condition, Tests]:
    found = condition_of(kind, plane, point.nearest, _test_of(kind, point))
    if found is None:
        raise InvalidParameterError(
            f"point = {point.label}: no curve of kind {kind.label} starts there."
        )
    return found


def _test_of(kind: PointKind, point: BifurcationPoint) -> str:
    """Test function that is zero on the curve of a kind through a point; empty where a stop is touched."""
    if kind == point.curve:
        own: str = point.problem.condition.own
        return own
    if kind.test:
        return f"{kind.test} {point.segment}" if point.segment >= 0 else ""
    return "" if point.nearest else point.test


def names_of_two(parameters: Any) -> tuple[str, str]:
    """Two different names."""
    if not isinstance(parameters, tuple | list) or len(parameters) != 2:
        raise refusal("parameters", parameters, "the names of two parameters")
    first, second = parameters
    if first == second:
        raise InvalidParameterError(
            f"parameters = {parameters}: twice the same. Give two different parameters."
        )
    return first, second


def _of_orbit(
    orbit: Orbit, names: tuple[str, str], bounds: Any, events: PointKinds
) -> tuple[OrbitPlane, Floats, Pair]:
    a = (parameter_value(orbit.system, names[0]), parameter_value(orbit.system, names[1]))
    spans = []
    for name, value, pair in zip(names, a, _pairs(bounds), strict=True):
        low, high = range_of(f"bounds of {name}", pair, name, value)
        check_parameter(orbit, name, (low, high))
        spans.append(high - low)
    plane = OrbitPlane.around_orbit(orbit, names, (spans[0], spans[1]), events)
    return plane, plane.packed(orbit.states, orbit.durations), a


def map_bifurcation(
    kind: str, mapping: ExplicitMap, x: ArrayLike, p: tuple[float, float]
) -> BifurcationPoint:
    """Bifurcation of a map with two parameters, given by a formula, from which its curve is followed.

    Parameters
    ----------
    kind
        Label of a smooth kind: "SN", "PD" or "NS".
    mapping
        A map with two parameters.
    x, p
        The fixed point, shape (d,), and both parameters; guesses that Newton's iteration corrects.

    Returns
    -------
    BifurcationPoint
        For :func:`continue_bifurcation`.

    Raises
    ------
    InvalidParameterError
        Another kind, a map that does not have two parameters, arrays of another shape.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> henon = vi.ExplicitMap(lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2], dimension=2,
    ...                        parameters=("alpha", "beta"))
    >>> start = vi.map_bifurcation("NS", henon, (0.5, 0.5), (1.25, 1.0))
    """
    check_kind("mapping", mapping, ExplicitMap, "an ExplicitMap")
    check_choice("kind", kind, [k.label for k in ONE.values() if k.critical and k != BP])
    if len(mapping.parameters) != 2:
        raise InvalidParameterError(
            f"mapping: has the parameters {mapping.parameters}; give one with two, as in "
            'ExplicitMap(function, dimension=2, parameters=("alpha", "beta")).'
        )
    first, second = vector("p", p, 2)
    mapping.forms(x, (first, second))  # checks the shape of x
    plane, z, record = MapPlane(mapping), np.array(x, dtype=float), ONE[kind]
    bounds = (first, first), (second, second)
    problem = Augmented(plane, *on_multipliers(record, plane), bounds)
    Z = problem.packed(z, problem.condition.start(z, (first, second)), (first, second))
    return BifurcationPoint(
        record=record, label=kind, parameters={plane.names[0]: first, plane.names[1]: second}, problem=problem,
        orbit=mapping.point(z, (first, second)), bounds=bounds, curve=record, test=record.test, parameter=second, z=Z,
        tangent=np.zeros(len(Z) + 1), arclength=0.0, error=0.0, crossing=0,
    )  # fmt: skip


def _pairs(bounds: Any) -> tuple[Any, Any]:
    if not isinstance(bounds, tuple | list) or len(bounds) != 2:
        raise refusal("bounds", bounds, "((low, high), (low, high)), one range per parameter")
    return bounds[0], bounds[1]


def ranges(names: tuple[str, str], a: Pair, bounds: Any) -> tuple[Bounds, Bounds]:
    """Ranges of both parameters with a start inside, checked."""
    first, second = (
        range_of(f"bounds of {name}", pair, name, value)
        for name, value, pair in zip(names, a, _pairs(bounds), strict=True)
    )
    return first, second
