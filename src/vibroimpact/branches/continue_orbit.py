"""Continuation of a periodic orbit in one parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_flag, names_arguments, range_of, vector
from vibroimpact._core.labels import numbered
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.types import Floats
from vibroimpact.branches.beginning import BranchStart
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.chatter import distance_left
from vibroimpact.branches.checks import check_parameter
from vibroimpact.branches.family import CHATTER, REST, OrbitFamily
from vibroimpact.branches.going_on import SAME_ARCLENGTH, Follow, going_on, trimmed
from vibroimpact.branches.grazing import grazings
from vibroimpact.branches.kinds import (
    CHATTERING,
    GR,
    Function,
    checked_value,
    events_of,
    kind_of_test,
)
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.branches.same_orbit import half_turn
from vibroimpact.branches.sliding import sliding_of
from vibroimpact.branches.stop_rules import AT_ONCE, StopWhen, stop_rule
from vibroimpact.branches.vanishing import passed_over, rest_at, touch_at
from vibroimpact.branches.verify import is_neutral, why_none
from vibroimpact.continuation import Curve, End, Steps, Stopped, Unresolved, continue_curve
from vibroimpact.continuation.walk import START_ARCLENGTH, CurveProgress, check_steps
from vibroimpact.model.parameters import parameter_value
from vibroimpact.orbits.find import converged
from vibroimpact.orbits.orbit import Orbit

# The sum of chatter stops at this share of its first speed (orbit/prescribed.hpp), with an error of it where the
# force that ends it vanishes.
CHATTER_RELATIVE = 2.0**-27
STEPS = Steps(first=0.02, largest=0.5, points=600)


@names_arguments()
@interruptible
def continue_orbit(
    orbit: Orbit,
    parameter: str,
    bounds: tuple[float, float],
    *,
    steps: Steps | None = None,
    both: bool = True,
    tangent: Floats | None = None,
    test_functions: Mapping[str, Function] | None = None,
    stop_when: StopWhen | None = None,
    inadmissible: bool = False,
    progress: ProgressOption = True,
) -> Branch:
    """Follow the branch of a periodic orbit in a parameter, with all its bifurcations.

    Parameters
    ----------
    orbit
        A converged orbit; the branch starts at its system's value of the parameter.
    parameter
        Name of the parameter: a field of the system, a keyword of a :class:`Family`, or a path
        into a mechanism (parameters.py).
    bounds
        (low, high) of the parameter; the branch ends exactly there, or where it closes.
    steps
        Step lengths in scaled arclength, number of points.
    both
        Follow it in both directions.
    tangent
        Direction to start in; by default towards larger values.
    test_functions
        Test functions of your own by their labels, words of letters: the zeros of each along the branch are special
        points of that kind, which :func:`~vibroimpact.continue_bifurcation` follows. A function
        g(states, durations, parameters) takes the states (x, v, theta) just after each solved impact, shape
        (m, 2n + 1), the flight times, shape (m,), and the parameters of the system by name. It is analytic, and
        computes with + - * / ** and numpy functions, so that it can be differentiated: numbers may be jets.
    stop_when
        A function of an orbit, or several, called at every point after the start: where one returns
        True, or the reason as a text, the branch ends in this direction, with the reason in
        ``branch.curve.ends``. Ready-made are ``vi.stop.inadmissible(beyond=...)`` and
        ``vi.stop.unstable(multipliers=...)``.
    inadmissible
        By default the branch follows what exists: it ends where its orbits end to be motions of the machine, and
        goes on with the orbits of other sequences that begin there, ``branch.others``. True follows the orbits of
        its own sequence alone, motions or not. A start that is no motion is followed so in any case.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every panel of points.

    Returns
    -------
    Branch
        Also where it could not be followed to the end, with the reason in ``branch.curve.ends``.

    Raises
    ------
    InvalidParameterError
        No such parameter, an orbit that is not converged or one of a family, a range that is
        empty, without the orbit or no wider than rounding; a parameter that breaks the symmetry of
        a symmetric orbit or changes the ratios of the forcing frequencies; a ``stop_when`` that is
        not a rule; test functions that are no functions by labels.

    Notes
    -----
    Orbits of any stability, admissible or not, are followed through folds, grazing and all other
    bifurcations. Each orbit occurs once, up to its first impact and mirror images: a branch is
    closed where it returns to its start in this sense, and ends at the branch point at which its
    orbits begin. A zero of a test function without the critical multiplier or touch that it stands
    for is in ``branch.curve.unresolved``. Points are nodes of Chebyshev panels on which every test
    function is resolved, so that no zero is skipped
    (continuation/panel.py). Cost: about 1.5 ms a point for the impact damper.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.1)
    >>> branch = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (1.0, 1.15))
    >>> [point.label for point in branch.special_points]
    ['NS1']

    Where do the impacts of both stops have the speed 1?

    >>> fast = vi.continue_orbit(vi.symmetric_orbits(damper)[0], "omega", (1.0, 1.15),
    ...                          test_functions={"FAST": lambda states, durations, parameters: states[0, 3] + 1.0})
    >>> [point.label for point in fast.special_points]
    ['NS1']
    """
    start = converged(orbit)
    value = parameter_value(start.system, parameter)
    low, high = range_of("bounds", bounds, parameter, value)
    check_steps(steps, progress)
    check_flag("both", both)
    check_flag("inadmissible", inadmissible)
    inadmissible = inadmissible or not start.admissible
    check_parameter(start, parameter, (low, high))
    z = start.problem.packed(start.states, start.durations)
    if tangent is not None:
        tangent = np.array(vector("tangent", tangent, z.size + 1))
    family = OrbitFamily.around(
        start.system, start.signature, parameter, z, high - low, events_of(test_functions)
    )
    for label, kind in family.events.items():
        checked_value(f"test_functions[{label!r}]", kind.function, family.arguments(z, value))
    with Reporter(progress, "branch") as report:
        told = report.counted("points", parameter)
        follow = following((low, high), steps, stop_when, told, inadmissible=inadmissible)
        branch = follow(BranchStart(family, z, value, tangent, both))
        return branch if inadmissible else going_on(*trimmed(branch), follow)


def following(
    bounds: tuple[float, float],
    steps: Steps | None,
    stop_when: StopWhen | None,
    progress: CurveProgress,
    *,
    inadmissible: bool,
) -> Follow:
    """Function that follows the branch from a start: all of it, or up to orbits that are no motions."""
    more = () if inadmissible else (AT_ONCE,)

    def follow(start: BranchStart) -> Branch:
        curve = continue_curve(
            start.family, start.z, start.parameter, bounds, tangent=start.tangent,
            both=start.both, steps=steps or STEPS,
            stop_when=stop_rule(stop_when, start.family, bounds, *more), progress=progress,
        )  # fmt: skip
        return branch_of(start.family, curve, bounds)

    return follow


def branch_of(family: OrbitFamily, curve: Curve, bounds: tuple[float, float]) -> Branch:
    """Branch of orbits from a continued curve."""
    orbits = [family.orbit(z, p) for z, p in zip(curve.z, curve.parameter, strict=True)]
    before, after = (
        _explained(end, family.refused, orbits[at])
        for end, at in zip(curve.ends, (0, -1), strict=True)
    )
    curve = replace(curve, ends=(before, after))
    located = [
        *_bifurcations(family, curve),
        *_touches(family, curve, orbits, bounds),
        *_ends_of_chatter(curve, orbits),
    ]
    doubtful = [item for item in located if isinstance(item, Unresolved)]
    found = sorted(
        (item for item in located if isinstance(item, dict)), key=lambda at: at["arclength"]
    )
    found = _once(found)
    labels = numbered(at["record"].label for at in found)
    curve = replace(curve, unresolved=(*curve.unresolved, *doubtful))
    family.forget()
    return Branch(
        parameter=family.parameter,
        bounds=bounds,
        values=curve.parameter,
        multipliers=np.array([o.multipliers for o in orbits]),
        stability=np.array([o.stability for o in orbits], dtype=np.int8),
        clearance=np.array([o.clearance_to_grazing for o in orbits]),
        impact_speed=np.array([o.least_impact_speed for o in orbits]),
        special_points=tuple(
            BifurcationPoint(
                label=label,
                parameters={family.parameter: at["parameter"]},
                problem=family,
                bounds=bounds,
                **at,
            )
            for at, label in zip(found, labels, strict=True)
        ),
        curve=curve,
        family=family,
        progress=np.array([o.progress for o in orbits]),
    )


def _once(found: list[_Fields]) -> list[_Fields]:
    """Points of which mirror images are one, those of an orbit that is its own mirror image."""
    kept: list[_Fields] = []
    for at in found:
        twin = next((known for known in kept if _is_image(at, known)), None)
        if twin is None:
            kept.append(at)
        else:
            twin["images"] = 2
    return kept


def _is_image(one: _Fields, other: _Fields) -> bool:
    """Whether two points at one place are half a period apart in an orbit that is its own mirror image."""
    if one["record"] != other["record"] or one["record"].critical:
        return False
    if abs(one["arclength"] - other["arclength"]) > SAME_ARCLENGTH:
        return False
    half = half_turn(one["orbit"])
    first, second = (_flight_of(at) for at in (one, other))
    return bool(half) and first >= 0 and abs(first - second) == half


def _flight_of(at: _Fields) -> int:
    """Number of the flight to which a point belongs; -1 for none."""
    nearest = at.get("nearest")
    return int(nearest.segment if nearest else at.get("segment", -1))


def _explained(end: End, refused: str, orbit: Orbit) -> End:
    """End of a curve at an orbit, with the reason why there are none beyond it."""
    if end.reason is Stopped.RULE and (why := passed_over(orbit)):
        return End(Stopped.EVENT, why)
    failed = end.reason is Stopped.STEP and refused
    return End(end.reason, f"{end.detail}; {refused}") if failed else end


_Fields = dict[str, Any]  # of a special point; its place is that of a located point


def _bifurcations(family: OrbitFamily, curve: Curve) -> Iterator[_Fields | Unresolved]:
    touched: list[float] = []  # arclengths
    for point in curve.special:
        record, segment = kind_of_test(family, point.test)
        orbit = family.orbit(point.z, point.parameter)
        fields = vars(point) | {"orbit": orbit}
        if touch := touch_at(orbit):
            if not touched or abs(point.arclength - touched[-1]) > SAME_ARCLENGTH:
                touched.append(point.arclength)
                yield _named(fields | {"record": GR, "nearest": touch})
            continue
        if rest_at(orbit) and record.test not in (REST, CHATTER):
            continue  # a rate that vanishes with the time of a rest
        if not (record.touch or record.function) and orbit.rateless:
            continue  # the map has a limit there, the functions of its equations vanish
        if record.touch and abs(point.arclength) < START_ARCLENGTH:
            continue  # the touch at the start of the branch: its sign there is rounding
        if is_neutral(curve, point, orbit):
            continue
        if why := why_none(family, curve, point, orbit):
            after = int(np.searchsorted(curve.arclength, point.arclength).clip(1, len(curve) - 1))
            reason = f"{record.label} at {family.parameter} = {point.parameter:.9g}: {why}"
            yield Unresolved(point.test, after - 1, after, reason)
        else:
            if record == CHATTERING:
                fields["error"] = max(point.error, CHATTER_RELATIVE * abs(point.parameter))
            yield _named(fields | {"record": record, "segment": segment})


def _named(at: _Fields) -> _Fields:
    """Special point, as the sliding bifurcation that it is, if it is one."""
    found = sliding_of(at["orbit"], at["test"], at.get("segment", -1), at.get("nearest"))
    return at | {"record": found or at["record"]}


def _ends_of_chatter(curve: Curve, orbits: list[Orbit]) -> Iterator[_Fields]:
    """Ends of a curve at which chatter ceases to be completed.

    The rest after it vanishes there as a power of the distance, so that the curve ends a little before; the law of the
    last two points gives the place, and how far it is from the last point is the error.
    """
    for at, before in ((-1, -2), (0, 1)):
        if len(curve) < 2 or curve.ends[at].reason is not Stopped.STEP:
            continue
        if found := distance_left(orbits[at], orbits[before]):
            k, beyond = found
            last = float(curve.parameter[at])
            left = float(np.diff(curve.parameter[[before, at]])[0]) * beyond
            yield {
                "test": f"{CHATTER} {k}", "parameter": last + left, "z": curve.z[at], "tangent": curve.tangent[at],
                "arclength": float(curve.arclength[at]),
                "error": max(abs(left), CHATTER_RELATIVE * abs(last)), "crossing": 1 if at == 0 else -1,
                "orbit": orbits[at], "record": CHATTERING, "segment": k,
            }  # fmt: skip


def _touches(
    family: OrbitFamily, curve: Curve, orbits: list[Orbit], bounds: tuple[float, float]
) -> Iterator[_Fields | Unresolved]:
    for grazing in grazings(family, curve, [orbit.gaps for orbit in orbits], bounds):
        if isinstance(grazing, Unresolved):
            yield grazing
        elif not touch_at(grazing.orbit):  # else it is a zero of the equations, too
            yield _named(vars(grazing.point) | {
                "record": GR, "orbit": grazing.orbit, "nearest": grazing.nearest,
            })  # fmt: skip
