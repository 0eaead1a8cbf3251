"""Continuation of a bifurcation in two parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
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
    shown,
    vector,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import ProgressOption, Reporter
from vibroimpact._core.types import Flags, Floats
from vibroimpact.bifurcations.augmented import BOUND, Augmented, Bounds, Tests
from vibroimpact.bifurcations.conditions import (
    CRITICAL,
    ClosingRate,
    Condition,
    CriticalMultiplier,
    CriticalPair,
    FlightTime,
    Function,
    Graze,
    Level,
)
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint, is_motion
from vibroimpact.bifurcations.equations import Equations, Pair
from vibroimpact.bifurcations.of_maps import MapPlane
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.special import special_points
from vibroimpact.bifurcations.tests_along import CUBIC, AtMultiplier, AtPair, nothing
from vibroimpact.branches.branch import BifurcationPoint
from vibroimpact.branches.checks import check_parameter
from vibroimpact.branches.family import lossless
from vibroimpact.continuation import Curve, Steps, Stopped, continue_curve
from vibroimpact.continuation.curve import End, Unresolved
from vibroimpact.continuation.walk import check_steps
from vibroimpact.model.parameters import parameter_value
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.orbits.admissibility import Nearest
from vibroimpact.orbits.find import converged
from vibroimpact.orbits.orbit import Orbit

STEPS = Steps(first=0.02, largest=0.5, points=600)
ON_MULTIPLIERS = (*CRITICAL, "NS")


@dataclass(frozen=True)
class MapPoint:
    """Bifurcation of a map with two parameters, given by a formula, from which its curve is followed.

    Parameters
    ----------
    kind
        "SN", "PD" or "NS".
    map
        A map with two parameters.
    x, p
        The fixed point, shape (d,), and both parameters; guesses that Newton's iteration corrects.

    Raises
    ------
    InvalidParameterError
        Another kind, a map that does not have two parameters, arrays of another shape.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> henon = vi.ExplicitMap(lambda x, p: [x[1], p[0] - p[1] * x[0] - x[1] ** 2], dimension=2,
    ...                        parameters=("alpha", "beta"))
    >>> start = vi.MapPoint("NS", henon, (0.5, 0.5), (1.25, 1.0))
    """

    kind: str
    map: ExplicitMap
    x: ArrayLike
    p: tuple[float, float]

    def __post_init__(self) -> None:
        check_kind("map", self.map, ExplicitMap, "an ExplicitMap")
        check_choice("kind", self.kind, ("SN", "PD", "NS"))
        if len(self.map.parameters) != 2:
            raise InvalidParameterError(
                f"map: has the parameters {self.map.parameters}; give one with two, as in "
                'ExplicitMap(function, dimension=2, parameters=("alpha", "beta")).'
            )
        first, second = vector("p", self.p, 2)
        object.__setattr__(self, "p", (first, second))
        self.map.forms(self.x, self.p)


class Start(NamedTuple):
    """Bifurcation, or a guess of one, from which its curve is followed."""

    kind: str
    equations: Equations
    condition: Condition
    tests: Tests
    z: Floats
    a: Pair


def continue_bifurcation(
    point: BifurcationPoint | CodimensionTwoPoint | MapPoint,
    parameters: tuple[str, str],
    bounds: tuple[Bounds, Bounds],
    *,
    kind: str = "",
    steps: Steps | None = None,
    both: bool = True,
    progress: ProgressOption = False,
) -> BifurcationCurve:
    """Follow a bifurcation in two parameters, with all its points of codimension two.

    Parameters
    ----------
    point
        Where to start: a special point of a branch ("SN", "PD", "NS", "GR", "ZERO", "SIM", or "BP" of symmetric
        orbits), a point of another curve, or a :class:`MapPoint`.
    parameters
        Names of two different parameters; that of the branch need not be among them.
    bounds
        ((low, high), (low, high)) of both, with the start inside; the curve ends exactly there, or where it closes.
    kind
        From a point of codimension two the kind of the curve to follow through it: "SN", "PD" (of symmetric orbits
        "BP") or "NS". Elsewhere it is that of the point.
    steps
        Step lengths in scaled arclength, number of points.
    both
        Follow it in both directions.
    progress
        True shows it on standard error; a function is called with a :class:`~vibroimpact.ProgressReport` after
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


def continue_level(
    orbit: Orbit,
    function: Function,
    parameters: tuple[str, str],
    bounds: tuple[Bounds, Bounds],
    *,
    value: float | None = None,
    steps: Steps | None = None,
    both: bool = True,
    progress: ProgressOption = False,
) -> BifurcationCurve:
    """Follow orbits on which a function keeps its value, in two parameters.

    Parameters
    ----------
    orbit
        A converged orbit on the curve, or near it.
    function
        g(states, durations, parameters) of the states (x, v, theta) just after each solved impact, shape (m, 2n + 1),
        the flight times, shape (m,), and both parameters. It computes with + - * / ** and numpy functions, so that it
        can be differentiated: numbers may be jets.
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
    plane, z, a = _of_orbit(converged(orbit), names, bounds)
    level = Level(plane, function, 0.0)
    own = _value_at(level, z, a)
    level.level = own if value is None else real("value", value)
    start = Start("level", plane, level, nothing, z, a)
    with Reporter(progress, "curve of a level") as report:
        told = report.counted("points", names[1])
        return followed(start, ranges(names, a, bounds), both=both, steps=steps, progress=told)


def _value_at(level: Level, z: Floats, a: Pair) -> float:
    """Value of a user's function at the start, which must be a number."""
    try:
        value = float(level.value(z, np.empty(0), a)[0])
    except (TypeError, ValueError, IndexError, AttributeError) as error:
        raise InvalidParameterError(
            f"function = {shown(level.function)}: failed ({error}). It takes states, durations, parameters and returns "
            "a number."
        ) from error
    if not math.isfinite(value):
        raise InvalidParameterError(
            f"function = {shown(level.function)}: is {value} at the start; it must be finite there."
        )
    return value


def followed(
    start: Start, bounds: tuple[Bounds, Bounds], *, steps: Steps | None = None, **options: Any
) -> BifurcationCurve:
    """Curve from a start; ``options`` are those of ``continue_curve``."""
    problem = Augmented(start.equations, start.condition, start.tests, bounds)
    guess = problem.packed(start.z, start.condition.start(start.z, start.a), start.a)
    curve = continue_curve(
        problem, guess, start.a[1], bounds[1], terminal=(BOUND,), steps=steps or STEPS, **options
    )
    return curve_of(start.kind, problem, curve)


def curve_of(kind: str, problem: Augmented, curve: Curve) -> BifurcationCurve:
    """Curve of bifurcations from a continued curve."""
    refused = getattr(problem.equations, "refused", "")
    before, after = (_explained(end, problem, refused) for end in curve.ends)
    curve = replace(curve, ends=(before, after))
    places = list(zip(curve.z, curve.parameter.tolist(), strict=True))
    solutions = [problem.orbit(Z, p) for Z, p in places]
    found, doubtful = special_points(kind, problem, curve, solutions)
    parts = [problem.parts(Z, p) for Z, p in places]
    multipliers = np.array([problem.equations.multipliers(z, a) for z, _, a in parts])
    neutral = np.zeros(len(curve), dtype=bool)
    if kind == "NS":
        neutral = np.abs(curve.tests["R4"]) > 1.0
    unresolved = [*_of_pairs(curve, neutral), *doubtful]
    curve = replace(curve, unresolved=tuple(unresolved))
    return BifurcationCurve(
        kind=kind,
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
    allowed = (BifurcationPoint, CodimensionTwoPoint, MapPoint)
    check_kind("point", point, allowed, "a special point of a branch or a curve, or a MapPoint")
    names = names_of_two(parameters)
    if isinstance(point, MapPoint):
        return _of_map(point, names)
    if isinstance(point, CodimensionTwoPoint) and not isinstance(point.orbit, Orbit):
        wanted = kind or point.curve_kind
        equations = point.problem.equations
        assert isinstance(equations, MapPlane)
        p = (point.parameters[equations.names[0]], point.parameters[equations.names[1]])
        return _of_map(MapPoint(wanted, equations.map, point.orbit.x, p), names)
    wanted = _kind_at(point, kind)
    plane, z, a = _of_orbit(point.orbit, names, bounds)
    condition, tests = _condition(wanted, point, plane)
    return Start(wanted, plane, condition, tests, z, a)


def _kind_at(point: BifurcationPoint | CodimensionTwoPoint, kind: str) -> str:
    """Kind of the curve that is wanted, refused where there is none."""
    own = point.curve_kind if isinstance(point, CodimensionTwoPoint) else point.kind
    wanted = kind or own
    if isinstance(point, BifurcationPoint):
        check_choice("kind", wanted, (own,))
    check_choice("kind", wanted, ("SN", "PD", "BP", "NS", "GR", "ZERO", "SIM"))
    if wanted == "BP" and not point.orbit.symmetric:
        raise InvalidParameterError(
            f"point = {point.label}: two branches cross there, which one more parameter undoes: there is no curve of "
            "such points. Take a point of a symmetric orbit, or follow the folds beside it."
        )
    if wanted == "NS" and lossless(point.orbit.mechanism):
        raise InvalidParameterError(
            "kind = 'NS': without loss the products of multipliers are one everywhere. Add damping, or take "
            "restitution < 1."
        )
    return of_solved_map(wanted, point.orbit)


def of_solved_map(kind: str, orbit: Orbit) -> str:
    """Name of a kind for an orbit: period doubling of a half map is symmetry breaking."""
    return "BP" if kind == "PD" and orbit.symmetric else kind


def _condition(
    kind: str, point: BifurcationPoint | CodimensionTwoPoint, plane: OrbitPlane
) -> tuple[Condition, Tests]:
    if kind == "GR" and isinstance(point, BifurcationPoint) and point.orbit.rateless:
        raise InvalidParameterError(
            f"point = {point.label}: a flight of the orbit vanishes there, and its equations are singular. "
            "Take the same touch of the orbits without that flight: switch_branch(point), then its GR."
        )
    found = condition_of(kind, plane, point.nearest, getattr(point, "segment", -1))
    if found is None:
        raise InvalidParameterError(f"point = {point.label}: no curve of kind {kind} starts there.")
    return found


def on_multipliers(kind: str, equations: Equations) -> tuple[Condition, Tests]:
    """Condition and test functions of SN, PD, BP and NS."""
    if kind == "NS":
        pair = CriticalPair(equations)
        return pair, AtPair(pair)
    condition = CriticalMultiplier(equations, CRITICAL[kind])
    return condition, AtMultiplier(condition)


def condition_of(
    kind: str, plane: OrbitPlane, touch: Nearest | None, segment: int
) -> tuple[Condition, Tests] | None:
    """Condition and test functions of a kind; for GR with the touch, for ZERO and SIM with the segment."""
    if kind in ON_MULTIPLIERS:
        return on_multipliers(kind, plane)
    if kind == "GR" and touch is not None:
        return Graze(plane, touch), nothing
    if kind == "ZERO" and segment >= 0:
        return ClosingRate(plane, segment), nothing
    if kind == "SIM" and segment >= 0:
        return FlightTime(plane, segment), nothing
    return None


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


def _of_orbit(orbit: Orbit, names: tuple[str, str], bounds: Any) -> tuple[OrbitPlane, Floats, Pair]:
    a = (parameter_value(orbit.system, names[0]), parameter_value(orbit.system, names[1]))
    for name, value, pair in zip(names, a, _pairs(bounds), strict=True):
        check_parameter(orbit, name, range_of(f"bounds of {name}", pair, name, value))
    plane = OrbitPlane.around_orbit(orbit, names)
    return plane, plane.packed(orbit.states, orbit.durations), a


def _of_map(point: MapPoint, names: tuple[str, str]) -> Start:
    if names != point.map.parameters:
        raise InvalidParameterError(
            f"parameters = {names}: those of the map are {point.map.parameters}, in this order."
        )
    plane, z = MapPlane(point.map), np.array(point.x, dtype=float)
    return Start(point.kind, plane, *on_multipliers(point.kind, plane), z, point.p)


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
