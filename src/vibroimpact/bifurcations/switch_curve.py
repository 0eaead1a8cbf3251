"""Curves of bifurcations that begin at points of codimension two.

Method      which curves begin is said by the normal form (normal_forms/codimension_two.py). Their orbits are found at
            a small distance from the point,
            R4             the orbits of period four of the normal form, inside the half-lines of their folds    (1)
            R3             the saddle of period three where Re log(nu / nu_0) = 0:  mu zeta = -b conj(nu) conj(zeta)^2
                                                                                                                 (2)
            GPD, R2,       on the curve of PD through the point, at points on both sides of it: the doubled orbits
            LPPD, PDNS     that branch off there, followed along one parameter to their own SN or NS             (3)
            and then followed like any other curve (emanating.py).
            R1 and curves of the same orbit through the point: continue_bifurcation with the other kind.
Assumes     what the normal form assumes
Fails       ``NoCurve`` with a sentence
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, chapter 9
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_kind
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.augmented import Bounds
from vibroimpact.bifurcations.conditions import CriticalPair, critical_pair
from vibroimpact.bifurcations.continue_bifurcation import continue_bifurcation
from vibroimpact.bifurcations.curve import BifurcationCurve, CodimensionTwoPoint
from vibroimpact.bifurcations.emanating import (
    Slice,
    Solution,
    checked_bounds,
    emanating,
    flattest,
    is_inside,
    on_slice,
    solution_at,
    uninterrupted,
    width_of,
)
from vibroimpact.bifurcations.equations import Pair
from vibroimpact.bifurcations.unfold import Centre, centre
from vibroimpact.branches.branch import NotFound
from vibroimpact.continuation import SpecialPoint, Steps, switch
from vibroimpact.continuation.walk import CurveProgress, check_steps
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.strong_resonance import OneToFour, OneToThree

DISTANCES = (0.003, 0.01, 0.03)  # from the point, relative to the ranges of the parameters
INSIDE = 0.1  # of the angle between a half-line of folds and the middle of its sector
SPAN = 0.05  # of the range: size of the parameter on a slice
ALONG = Steps(first=0.02, largest=0.5, points=200)
BOX = 0.1  # of the ranges: part of the curve of PD that is looked at


@dataclass(frozen=True, repr=False)
class NoCurve(NotFound):
    """Reason why no other curve was found at a point of codimension two."""

    point: CodimensionTwoPoint


def switch_curve(
    point: CodimensionTwoPoint,
    bounds: tuple[Bounds, Bounds] | None = None,
    *,
    steps: Steps | None = None,
    progress: CurveProgress | None = None,
) -> tuple[BifurcationCurve, ...] | NoCurve:
    """Follow the curves of bifurcations that begin at a point of codimension two.

    Parameters
    ----------
    point
        A special point of a curve: "R1" to "R4", "GPD", "LPPD" or "PDNS".
    bounds
        ((low, high), (low, high)) of both parameters; by default those of the curve.
    steps, progress
        As for :func:`~vibroimpact.continue_bifurcation`.

    Returns
    -------
    tuple of BifurcationCurve, or NoCurve
        One curve, or both folds of period four at R4; :class:`NoCurve` states the reason where theory has no curve, or
        where none was found.

    Raises
    ------
    InvalidParameterError
        Not a point of a curve; bounds that are empty or without the point.

    Notes
    -----
    Curves of the same orbit through the point, as PD through R2, are followed by
    ``continue_bifurcation(point, names, bounds, kind="PD")``.
    """
    check_kind("point", point, CodimensionTwoPoint, "a special point of a curve")
    check_steps(steps, progress)
    inside = checked_bounds(point, bounds)
    form = point.normal_form
    if isinstance(form, Refusal):
        return NoCurve(point, form.reason)
    if not form.switchable:
        return NoCurve(point, form.why_not)
    found = _curves(point, form, inside, steps, progress)
    if not found:
        return NoCurve(point, f"no orbit on {form.switchable[0]} was found near the point")
    return found


def _curves(
    point: CodimensionTwoPoint, form: Any, bounds: tuple[Bounds, Bounds],
    steps: Steps | None, progress: CurveProgress | None,
) -> tuple[BifurcationCurve, ...]:  # fmt: skip
    names = point.problem.equations.names
    if point.kind == "R1":
        other = "SN" if point.curve_kind == "NS" else "NS"
        return (
            continue_bifurcation(point, names, bounds, kind=other, steps=steps, progress=progress),
        )
    origin = solution_at(point)
    found = []
    if isinstance(form, OneToFour):
        manifold = centre(*origin, 1j)
        found = [
            _first(origin, tries, "SN", bounds, steps, progress)
            for tries in (_folds_of_four(manifold, form, k, bounds) for k in (0, 1))
        ]
    elif isinstance(form, OneToThree):
        manifold = centre(*origin, cmath.exp(2j * math.pi / 3.0))
        tries = _saddles_of_three(manifold, form, bounds)
        found = [_first(origin, tries, "NS", bounds, steps, progress)]
    else:
        kind = form.switchable[0].kind
        tries = _doubled(point, kind, bounds)
        found = [_first(origin, tries, kind, bounds, steps, progress)]
    return tuple(curve for curve in found if curve is not None)


def _first(
    origin: Solution, tries: Iterator[Solution], kind: str,
    bounds: tuple[Bounds, Bounds], steps: Steps | None, progress: CurveProgress | None,
) -> BifurcationCurve | None:  # fmt: skip
    """The first curve that can be followed."""
    for born in tries:
        with suppress(InvalidParameterError):  # the start does not converge
            return emanating(kind, origin, born, bounds, steps, progress)
    return None


# ---- R4 and R3 -----------------------------------------------------------------------------------


def _offsets(
    manifold: Centre, direction: complex, bounds: tuple[Bounds, Bounds]
) -> Iterator[Floats]:
    """Changes da of the parameters that move log nu in a direction, at the distances to try."""
    da = manifold.offset(direction)
    unit = float(np.max(np.abs(da) / [width_of(pair) for pair in bounds]))
    for distance in DISTANCES:
        moved: Floats = da * (distance / unit)
        if is_inside(manifold.at(moved), bounds):
            yield moved


def _folds_of_four(
    manifold: Centre, form: OneToFour, which: int, bounds: tuple[Bounds, Bounds]
) -> Iterator[Solution]:
    """Folds of the orbits of (1), from inside their sector across the half-line."""
    edges = form.fold_directions
    turn = cmath.phase(edges[1 - which] / edges[which])
    direction = edges[which] * cmath.exp(1j * INSIDE * turn / 2.0)
    equations = manifold.equations.repeated(4)
    for da in _offsets(manifold, direction, bounds):
        mu = complex(manifold.slopes @ da) / manifold.nu
        for zeta in form.period_four(mu)[::4]:
            points = np.asarray(zeta * 1j ** np.arange(4), dtype=np.complex128)
            start = manifold.equations.unrolled(manifold.z, manifold.moved(points, da))
            yield from _folds_near(equations, start, manifold.at(da), da, bounds)


def _saddles_of_three(
    manifold: Centre, form: OneToThree, bounds: tuple[Bounds, Bounds]
) -> Iterator[Solution]:
    """Saddles (2) of period three on the tangent of the curve of NS."""
    equations = manifold.equations.repeated(3)
    for direction in (1j, -1j):
        for da in _offsets(manifold, direction, bounds):
            mu = complex(manifold.slopes @ da) / manifold.nu
            push = -form.b / manifold.nu / mu  # zeta = push conj(zeta)^2
            zeta = cmath.rect(1.0 / abs(push), cmath.phase(push) / 3.0)
            points = np.asarray(zeta * manifold.nu ** np.arange(3), dtype=np.complex128)
            start = manifold.equations.unrolled(manifold.z, manifold.moved(points, da))
            yield Solution(equations, start, manifold.at(da))


def _folds_near(
    equations: Any, start: Floats, a: Pair, da: Floats, bounds: tuple[Bounds, Bounds]
) -> Iterator[Solution]:
    """Folds on the slice through a start, nearest first."""
    along = flattest(da, bounds)[0]
    piece = Slice(equations, along, a[1 - along], SPAN * width_of(bounds[along]))
    with suppress(InvalidParameterError):
        curve = on_slice(piece, start, a[along], bounds[along], terminal=("SN",), steps=ALONG)
        for fold in sorted(curve.named("SN"), key=lambda fold: abs(fold.parameter - a[along])):
            yield piece.solution(fold)


class _Watched(Slice):
    """Slice that also looks for NS."""

    def __init__(self, equations: Any, along: int, held: float, span: float, kind: str) -> None:
        super().__init__(equations, along, held, span)
        self.name = "SN" if kind == "SN" else "torus"
        self._pair = CriticalPair(equations)

    def watch(self, z: Floats, p: float) -> dict[str, float]:
        """Product over pairs of multipliers, for NS."""
        if self.name == "SN":
            return {}
        return {self.name: self._pair.tau(z, self.at(p))}

    def found(self, zero: SpecialPoint) -> bool:
        """Whether a zero is a bifurcation of the kind: a neutral saddle is none."""
        if self.name == "SN":
            return True
        mu = self.equations.multipliers(zero.z, self.at(zero.parameter))
        return bool(mu[critical_pair(mu)[0]].imag)


# ---- doubled orbits ------------------------------------------------------------------------------


def _doubled(
    point: CodimensionTwoPoint, kind: str, bounds: tuple[Bounds, Bounds]
) -> Iterator[Solution]:
    """SN or NS of doubled orbits (3), from points on the curve of PD on both sides."""
    equations = point.problem.equations
    names = equations.names
    at = np.array([point.parameters[name] for name in names])
    widths = np.array([width_of(pair) for pair in bounds])
    box = tuple(
        (max(low, x - BOX * w), min(high, x + BOX * w))
        for x, w, (low, high) in zip(at, widths, bounds, strict=True)
    )
    flips = continue_bifurcation(point, names, (box[0], box[1]), kind="PD")
    uninterrupted(flips.curve)
    away = np.max(np.abs(flips.values - at) / widths, axis=1)
    middle = int(np.argmin(away))
    twice = equations.repeated(2)
    for distance in DISTANCES:
        for side in (slice(middle + 1, None), slice(None, middle)):
            there = np.flatnonzero(away[side] > distance)
            if not there.size:
                continue
            first = there[0] if side.start is not None else there[-1]
            k = int(first + (side.start or 0))
            yield from _branching(flips, k, twice, kind, bounds, at)


def _branching(
    flips: BifurcationCurve,
    k: int,
    twice: Any,
    kind: str,
    bounds: tuple[Bounds, Bounds],
    at: Floats,
) -> Iterator[Solution]:
    """Bifurcations on the doubled branch at a point of the curve of PD."""
    equations = flips.problem.equations
    z, _, a = flips.problem.parts(flips.curve.z[k], float(flips.values[k, 1]))
    for along in flattest(flips.values[k] - at, bounds):
        yield from _along_branch(equations, twice, z, a, along, kind, bounds)


def _along_branch(
    equations: Any, twice: Any, z: Floats, a: Pair, along: int, kind: str,
    bounds: tuple[Bounds, Bounds],
) -> Iterator[Solution]:  # fmt: skip
    """Bifurcations on the doubled branch along one parameter, nearest first."""
    piece = _Watched(twice, along, a[1 - along], SPAN * width_of(bounds[along]), kind)
    by_z, by_a = equations.by_both(z, a)
    drift = np.linalg.solve(by_z, -by_a[:, along])
    still = np.zeros((2, len(z)))
    double = equations.unrolled(z, still)
    moved = equations.unrolled(z, still + drift) - double
    found = switch(piece, double, a[along], np.append(moved, 1.0), bounds[along])
    if not found.found:
        return
    with suppress(InvalidParameterError):
        curve = on_slice(
            piece, found.z, found.parameter, bounds[along], tangent=found.tangent, both=False,
            steps=ALONG,
        )  # fmt: skip
        yield from (piece.solution(zero) for zero in curve.named(piece.name) if piece.found(zero))
