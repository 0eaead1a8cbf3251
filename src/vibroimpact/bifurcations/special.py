"""Points of codimension two on a continued curve: verified, named, in order.

Method      a zero of a test function of tests_along.py is a point where the multipliers that it stands for are critical
            within CRITICAL_DISTANCE; functions that are also zero at a point of another name are silent there. Zeros
            with a real pair of product one (neutral saddles) are no bifurcation and left out
            functions of the multipliers that vanish with a closing rate, where a multiplier is infinite and, with one
            degree of freedom, others are not determined, are silent at that touch
            folds of the curve itself, in the second parameter, are none either
Fails       ``Unresolved``: a zero whose orbit does not converge or that has no such multipliers
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from vibroimpact._core.labels import numbered
from vibroimpact._core.types import Complexes
from vibroimpact.bifurcations.augmented import BOUND, Augmented
from vibroimpact.bifurcations.conditions import Graze, critical_pair
from vibroimpact.bifurcations.kinds import (
    AT_TOUCH,
    CHANGE,
    CROSSING,
    RESONANT,
    TWO,
    WEAK,
    with_multipliers,
)
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.tests_along import (
    CUBIC,
    CUSP,
    FLIP,
    FOLD,
    PUSH,
    RESONANCES,
    SIDE,
)
from vibroimpact.branches.family import CHATTER, EVENT, FLIGHT, REST, SPEED, STICK
from vibroimpact.branches.grazing import grazings
from vibroimpact.branches.kinds import GR, NS, PD, SN, kind_of_test
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.branches.verify import CRITICAL_DISTANCE
from vibroimpact.continuation import Curve, LocatedPoint, Unresolved
from vibroimpact.continuation.panel import BRANCH_POINT
from vibroimpact.continuation.panel import FOLD as TURN
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.orbit import Orbit

# Closing rates over their saturation are smaller: zeros are located to 1e-10, double ones to 1e-8.
TOUCH_RATE = 1e-6
# Kappa, or a multiplier, agrees so well: double ones are known to half of the digits.
SAME_MULTIPLIER = 1e-4
OF_TOUCH = {PUSH: RESONANT, SIDE: CHANGE}  # by the test function
CRITICAL = {FOLD: (SN, 1.0), FLIP: (PD, -1.0)}
NO_MULTIPLIERS = (SPEED, FLIGHT, STICK, REST, CHATTER, EVENT)  # words of test functions

_Fields = dict[str, Any]  # of a special point; its place is that of a located point


def special_points(
    kind: PointKind, problem: Augmented, curve: Curve, orbits: list[Any]
) -> tuple[list[BifurcationPoint], list[Unresolved]]:
    """Special points of a curve in order, and parts that may hide one."""
    found: list[_Fields] = []
    doubtful: list[Unresolved] = []
    for item in (*_zeros(kind, problem, curve), *_touches(problem, curve, orbits)):
        (doubtful if isinstance(item, Unresolved) else found).append(item)  # type: ignore[arg-type]
    found.sort(key=lambda fields: fields["arclength"])
    words = [at["test"] if at["record"] == WEAK else at["record"].label for at in found]
    labels = numbered(words, "_")
    points = [
        point_on_curve(kind, problem, fields | {"label": label})
        for fields, label in zip(found, labels, strict=True)
    ]
    return points, doubtful


def point_on_curve(kind: PointKind, problem: Augmented, fields: _Fields) -> BifurcationPoint:
    """Special point of a curve of a kind, from the fields that are its own."""
    _, _, a = problem.parts(fields["z"], fields["parameter"])
    return BifurcationPoint(
        parameters=dict(zip(problem.equations.names, a, strict=True)), problem=problem, bounds=problem.bounds,
        orbit=problem.orbit(fields["z"], fields["parameter"]), curve=kind, **fields,
    )  # fmt: skip


def _zeros(kind: PointKind, problem: Augmented, curve: Curve) -> Iterator[_Fields | Unresolved]:
    for point in curve.special:
        if point.test in (BOUND, TURN):
            continue
        z, _, a = problem.parts(point.z, point.parameter)
        of_orbit, segment = point.test.partition(" ")[0] in NO_MULTIPLIERS, -1
        if point.test in OF_TOUCH:
            if not (point.test == SIDE and _vanishes_too(problem, curve, point)):
                yield vars(point) | {"record": OF_TOUCH[point.test], **_touched(problem, point)}
            continue
        if not of_orbit and abs(problem.equations.weight(z, a)) <= TOUCH_RATE:
            continue
        solution = problem.orbit(point.z, point.parameter)
        named: PointKind | str = ""
        if isinstance(solution, Orbit) and not solution.converged:
            named = f"the orbit there is not solved for: {solution.status}"
        elif of_orbit:
            named, segment = _of_orbit(problem, point.test)
        else:
            named = _named(kind, point.test, problem.equations.multipliers(z, a))
        if isinstance(named, PointKind):
            fields = vars(point) | {"record": named, "segment": segment}
            yield fields | ({} if of_orbit or kind.critical else _touched(problem, point))
        elif named:
            after = int(np.searchsorted(curve.arclength, point.arclength).clip(1, len(curve) - 1))
            yield Unresolved(point.test, after - 1, after, named)


def _touched(problem: Augmented, point: LocatedPoint) -> _Fields:
    """Stop that is touched all along a curve of touches, at a point of it."""
    condition = problem.condition
    if isinstance(condition, Graze):
        place = condition.place(problem.parts(point.z, point.parameter)[1])
        return {"nearest": condition.touch._replace(gap=0.0, time=place.time)}
    return {"segment": getattr(condition, "segment", -1)}


def _vanishes_too(problem: Augmented, curve: Curve, point: LocatedPoint) -> bool:
    """Whether an impact does not move the gap there, of which the change of side is a consequence."""
    value = float(problem.watch(point.z[None], np.array([point.parameter]))[PUSH][0])
    return abs(value) <= TOUCH_RATE * float(np.nanmax(np.abs(curve.tests[PUSH])))


def _of_orbit(problem: Augmented, name: str) -> tuple[PointKind, int]:
    """Kind of a zero of a test function of the orbit itself, and the number of its segment."""
    assert isinstance(problem.equations, OrbitPlane)
    met, segment = kind_of_test(problem.equations, name)
    return TWO.get(met.label, met), segment


def _named(kind: PointKind, name: str, mu: Complexes) -> PointKind | str:
    """Kind of a zero, or the reason why it is none of a curve; empty where it is no bifurcation."""
    if name == BRANCH_POINT:
        return CROSSING
    if not kind.critical:
        return _on_touch(name, mu)
    (critical,) = kind.critical
    if critical is None:
        return _on_torus(name, mu)
    if not _near(mu, critical):
        return f"no multiplier is {critical:g} there"
    if name in (CUSP, CUBIC):
        return with_multipliers(critical)
    if name in (FLIP, FOLD):
        return _also(mu, -critical, critical)
    rest = np.delete(mu, int(np.argmin(np.abs(mu - critical))))
    if np.abs(rest - critical).min() <= SAME_MULTIPLIER:
        return with_multipliers(critical, critical)
    i, j = critical_pair(rest)
    if abs(rest[i] * rest[j] - 1.0) > CRITICAL_DISTANCE:
        return f"no pair has the product 1 there: nearest {rest[i]:.6g}, {rest[j]:.6g}"
    return with_multipliers(critical, None) if rest[i].imag else ""


def _on_touch(name: str, mu: Complexes) -> PointKind | str:
    """Kind of a zero along a touch: a fold, a flip, or a pair that is not real."""
    if name in CRITICAL:
        critical, value = CRITICAL[name]
        return AT_TOUCH[critical.label] if _near(mu, value) else f"no multiplier is {value:g} there"
    i, j = critical_pair(mu)
    if abs(mu[i] * mu[j] - 1.0) > CRITICAL_DISTANCE:
        return f"no pair has the product 1 there: nearest {mu[i]:.6g}, {mu[j]:.6g}"
    return AT_TOUCH[NS.label] if mu[i].imag else ""


def _on_torus(name: str, mu: Complexes) -> PointKind | str:
    i, j = critical_pair(mu)
    kappa = float((mu[i] + mu[j]).real) / 2.0
    if abs(mu[i] * mu[j] - 1.0) > CRITICAL_DISTANCE:
        return f"no pair has the product 1 there: nearest {mu[i]:.6g}, {mu[j]:.6g}"
    if name in RESONANCES:
        return TWO.get(name, WEAK)
    if abs(abs(kappa) - 1.0) <= SAME_MULTIPLIER or abs(kappa) > 1.0:
        return ""  # R1 and R2 have their own function; a neutral saddle
    if name == CUBIC:
        return with_multipliers(None)
    if name in (FOLD, FLIP):
        return _also(mu, 1.0 if name == FOLD else -1.0, None)
    rest = np.delete(mu, [i, j])
    k, m = critical_pair(rest)
    if abs(rest[k] * rest[m] - 1.0) > CRITICAL_DISTANCE:
        return ""  # a product across the pairs
    return with_multipliers(None, None) if rest[k].imag else ""


def _also(mu: Complexes, value: float, critical: float | None) -> PointKind | str:
    """Kind where another multiplier is critical, too, if one is."""
    return (
        with_multipliers(critical, value)
        if _near(mu, value)
        else f"no multiplier is {value:g} there"
    )


def _near(mu: Complexes, value: float) -> bool:
    return bool(np.abs(mu - value).min() <= SAME_MULTIPLIER)


def _touches(problem: Augmented, curve: Curve, orbits: list[Any]) -> Iterator[_Fields | Unresolved]:
    """Orbits of the curve that touch a stop between their impacts."""
    if not orbits or not isinstance(orbits[0], Orbit):
        return
    own = problem.condition.touch.place if isinstance(problem.condition, Graze) else None
    gaps = [{place: near for place, near in orbit.gaps.items() if place != own} for orbit in orbits]
    for item in grazings(problem, curve, gaps, problem.bounds[1]):
        if isinstance(item, Unresolved):
            yield item
        else:
            yield vars(item.point) | {"record": TWO[GR.label], "nearest": item.nearest}
