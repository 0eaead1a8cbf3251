"""Points of codimension two on a continued curve: verified, named, in order.

Method      a zero of a test function of tests_along.py is a point where the multipliers that it stands for are critical
            within CRITICAL; functions that are also zero at a point of another name are silent there. Zeros with a
            real pair of product one (neutral saddles) are no bifurcation and left out
            functions of the multipliers that vanish with a closing rate, where a multiplier is infinite and, with one
            degree of freedom, others are not determined, are silent at that touch
            folds of the curve itself, in the second parameter, are none either
Fails       ``Unresolved``: a zero whose orbit does not converge or that has no such multipliers
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.labels import numbered
from vibroimpact._core.types import Complexes
from vibroimpact.bifurcations.augmented import BOUND, Augmented
from vibroimpact.bifurcations.conditions import Graze, critical_pair
from vibroimpact.bifurcations.curve import CodimensionTwoPoint
from vibroimpact.bifurcations.tests_along import (
    CUBIC,
    CUSP,
    FLIP,
    FOLD,
    RESONANCES,
)
from vibroimpact.branches.family import FLIGHT, SPEED, STICK
from vibroimpact.branches.grazing import Grazing, grazings
from vibroimpact.branches.verify import CRITICAL
from vibroimpact.continuation import Curve, SpecialPoint, Unresolved
from vibroimpact.orbits.orbit import Orbit

AT_TOUCH = 1e-6  # of the closing rates over their saturation: zeros are located to 1e-10, double ones to 1e-8
MET = 1e-4  # of kappa, or a multiplier: double ones are known to half of the digits
STRONG = {"R1": (1, 1), "R2": (1, 2), "R3": (1, 3), "R4": (1, 4)}
TOUCH = {SPEED: "ZERO", FLIGHT: "SIM", STICK: "STICK"}


class _Found(NamedTuple):
    arclength: float
    kind: str
    resonance: tuple[int, int] | None
    point: SpecialPoint | Grazing
    segment: int = -1


def special_points(
    kind: str, problem: Augmented, curve: Curve, orbits: list[Any]
) -> tuple[list[CodimensionTwoPoint], list[Unresolved]]:
    """Special points of a curve in order, and parts that may hide one."""
    found: list[_Found] = []
    doubtful: list[Unresolved] = []
    for item in (*_zeros(kind, problem, curve), *_touches(problem, curve, orbits)):
        if isinstance(item, _Found):
            found.append(item)
        else:
            doubtful.append(item)
    found.sort(key=lambda item: item.arclength)
    words = [
        "{}/{}".format(*item.resonance) if item.kind == "WEAK" and item.resonance else item.kind
        for item in found
    ]
    labels = numbered(words, "_")
    points = [_point(kind, problem, item, label) for item, label in zip(found, labels, strict=True)]
    return points, doubtful


def _point(kind: str, problem: Augmented, item: _Found, label: str) -> CodimensionTwoPoint:
    place = item.point
    if isinstance(place, Grazing):
        Z, nearest = place.z, place.nearest
    else:
        Z, nearest = place.z, None
    z, _, a = problem.parts(Z, place.parameter)
    return CodimensionTwoPoint(
        kind=item.kind, label=label, parameters=dict(zip(problem.equations.names, a, strict=True)),
        error=place.error, orbit=problem.orbit(Z, place.parameter), curve_kind=kind,
        multipliers=problem.equations.multipliers(z, a), resonance=item.resonance, nearest=nearest,
        arclength=item.arclength, z=Z, tangent=place.tangent, problem=problem,
        segment=item.segment,
    )  # fmt: skip


def _zeros(kind: str, problem: Augmented, curve: Curve) -> Iterator[_Found | Unresolved]:
    for point in curve.special:
        if point.name in (BOUND, "SN"):
            continue
        z, _, a = problem.parts(point.z, point.parameter)
        solution = problem.orbit(point.z, point.parameter)
        named = None
        word, _, number = point.name.partition(" ")
        if word not in TOUCH and abs(problem.equations.weight(z, a)) <= AT_TOUCH:
            continue
        if isinstance(solution, Orbit) and not solution.converged:
            why = f"the orbit there is not solved for: {solution.status}"
        else:
            named, why = _named(kind, point.name, problem.equations.multipliers(z, a))
        if named:
            yield _Found(point.arclength, *named, point, int(number) if word in TOUCH else -1)
        elif why:
            after = int(np.searchsorted(curve.arclength, point.arclength).clip(1, len(curve) - 1))
            yield Unresolved(point.name, after - 1, after, why)


Named = tuple[str, tuple[int, int] | None]


def _named(kind: str, name: str, mu: Complexes) -> tuple[Named | None, str]:
    """(kind, resonance) of a zero, or None with the reason, which is empty where it is no bifurcation."""
    word = name.partition(" ")[0]
    if word in TOUCH:
        return (TOUCH[word], None), ""
    if name == "BP":
        return ("BP", None), ""
    if kind == "NS":
        return _on_torus(name, mu)
    critical = 1.0 if kind == "SN" else -1.0
    if not _near(mu, critical):
        return None, f"no multiplier is {critical:g} there"
    if name == CUSP:
        return ("CP", None), ""
    if name == CUBIC:
        return ("GPD", None), ""
    if name in (FLIP, FOLD):
        near = _near(mu, -critical)
        return (("LPPD", None), "") if near else (None, f"no multiplier is {-critical:g} there")
    rest = np.delete(mu, int(np.argmin(np.abs(mu - critical))))
    if np.abs(rest - critical).min() <= MET:
        q = 1 if kind == "SN" else 2
        return (f"R{q}", (1, q)), ""
    i, j = critical_pair(rest)
    if abs(rest[i] * rest[j] - 1.0) > CRITICAL:
        return None, f"no pair has the product 1 there: nearest {rest[i]:.6g}, {rest[j]:.6g}"
    both = "LPNS" if kind == "SN" else "PDNS"
    return ((both, None), "") if rest[i].imag else (None, "")


def _on_torus(name: str, mu: Complexes) -> tuple[Named | None, str]:
    i, j = critical_pair(mu)
    kappa = float((mu[i] + mu[j]).real) / 2.0
    if abs(mu[i] * mu[j] - 1.0) > CRITICAL:
        return None, f"no pair has the product 1 there: nearest {mu[i]:.6g}, {mu[j]:.6g}"
    if name in STRONG:
        return (name, STRONG[name]), ""
    if name in RESONANCES:
        p, q = map(int, name.split("/"))
        return ("WEAK", (p, q)), ""
    if abs(abs(kappa) - 1.0) <= MET or abs(kappa) > 1.0:
        return None, ""  # R1 and R2 have their own function; a neutral saddle
    if name == CUBIC:
        return ("CH", None), ""
    if name == FOLD:
        return (("LPNS", None), "") if _near(mu, 1.0) else (None, "no multiplier is 1 there")
    if name == FLIP:
        return (("PDNS", None), "") if _near(mu, -1.0) else (None, "no multiplier is -1 there")
    rest = np.delete(mu, [i, j])
    k, m = critical_pair(rest)
    if abs(rest[k] * rest[m] - 1.0) > CRITICAL:
        return None, ""  # a product across the pairs
    return (("NSNS", None), "") if rest[k].imag else (None, "")


def _near(mu: Complexes, value: float) -> bool:
    return bool(np.abs(mu - value).min() <= MET)


def _touches(problem: Augmented, curve: Curve, orbits: list[Any]) -> Iterator[_Found | Unresolved]:
    """Orbits of the curve that touch a stop between their impacts."""
    if not orbits or not isinstance(orbits[0], Orbit):
        return
    own = problem.condition.touch.place if isinstance(problem.condition, Graze) else None
    gaps = [{place: near for place, near in orbit.gaps.items() if place != own} for orbit in orbits]
    for item in grazings(problem, curve, gaps, problem.bounds[1]):
        if isinstance(item, Unresolved):
            yield item
        else:
            yield _Found(item.arclength, "GR", None, item)
