"""Curves of bifurcations that begin at points of codimension two.

Method      which curves begin is said by the normal form (normal_forms/codimension_two.py). Their orbits are found at
            a small distance from the point,
            R4             the orbits of period four of the normal form, inside the half-lines of their folds    (1)
            R3             the saddle of period three where Re log(nu / nu_0) = 0:  mu zeta = -b conj(nu) conj(zeta)^2
                                                                                                                 (2)
            R2             the doubled orbit w = +-sqrt(e1 / |c|) of w'' = e1 w + e2 w' + c w^3 + D w^2 w', D = -d-3c,
                           where it loses its stability, e2 = -D e1 / |c|; e1 = -mu_1 mu_2 and e2 = mu_1 + mu_2
                           belong to the pair -exp(mu), and e1 is a part of (c / D)^2, the unit of the series   (4)
            GPD, LPPD,     on the curve of PD through the point, at points on both sides of it: the doubled orbits
            PDNS           that branch off there, followed along one parameter to their own SN or NS             (3)
            and then followed like any other curve (emanating.py), one that begins there.
            GR, ZERO    what grazing_contact.py says: the curve of the touch itself; with one degree of freedom the
            other one of SN and PD; on PD also the touch of the doubled orbits, tangent to PD because their amplitude
            vanishes at the point as the gap does, found as in (3); a curve of the same kind of the orbits with one
            impact more or fewer only if these are critical too
            R1 and curves of the same orbit through the point: continue_bifurcation with the other kind.
Assumes     what the normal form assumes
Fails       ``NoCurve`` with a sentence
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, chapter 9
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.checks import check_kind
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.bifurcations.augmented import Bounds
from vibroimpact.bifurcations.conditions import (
    ClosingRate,
    Condition,
    CriticalPair,
    Graze,
    critical_pair,
)
from vibroimpact.bifurcations.continue_bifurcation import (
    Start,
    continue_bifurcation,
    followed,
    of_solved_map,
    on_multipliers,
)
from vibroimpact.bifurcations.curve import (
    BifurcationCurve,
    CodimensionTwoPoint,
    is_motion,
    touching,
)
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
from vibroimpact.bifurcations.grazing_contact import GrazingContact, beside, neighbour
from vibroimpact.bifurcations.of_orbits import OrbitPlane
from vibroimpact.bifurcations.unfold import Centre, centre
from vibroimpact.branches.branch import NotFound
from vibroimpact.branches.family import SPEED
from vibroimpact.branches.grazing import Grazing, grazings
from vibroimpact.continuation import Curve, Steps, switch
from vibroimpact.continuation.walk import CurveProgress, check_steps
from vibroimpact.model.stop import Stop
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.strong_resonance import OneToFour, OneToThree, OneToTwo
from vibroimpact.orbits.admissibility import Place
from vibroimpact.orbits.orbit import Orbit

DISTANCES = (0.003, 0.01, 0.03)  # from the point, relative to the ranges of the parameters
INSIDE = 0.1  # of the angle between a half-line of folds and the middle of its sector
OF_UNIT = (0.25, 0.06, 0.015)  # of the unit of e1 in (4)
LARGEST_RATES = 0.01, 0.1  # of e1 and e2
SETTLES = 8  # iterations of Newton's method
REACHED, DIFFERENCE = 1e-3, 1e-7  # of e1 and e2; of the ranges of the parameters
CORRECTED = 0.5  # of the distance from the point: by more a start that was predicted is not moved
SPAN = 0.05  # of the range: size of the parameter on a slice
ASIDE = 0.5  # of the distance from the point: greatest distance from the tangent of a curve of PD
ALONG = Steps(first=0.02, largest=0.5, points=200)
NEARBY = Steps(first=0.02, largest=0.5, points=60)  # along doubled orbits to their touch
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
        A special point of a curve: "R1" to "R4", "GPD", "LPPD", "PDNS", or of orbits "GR" or "ZERO".
    bounds
        ((low, high), (low, high)) of both parameters; by default those of the curve.
    steps, progress
        As for :func:`~vibroimpact.continue_bifurcation`.

    Returns
    -------
    tuple of BifurcationCurve, or NoCurve
        One curve, both folds of period four at R4, at GR and ZERO first the curve of the touch;
        :class:`NoCurve` states the reason where theory has no curve, or where none was found.

    Raises
    ------
    InvalidParameterError
        Not a point of a curve; bounds that are empty or without the point.

    Notes
    -----
    Curves of the same orbit through the point, as PD through R2, are followed by
    ``continue_bifurcation(point, names, bounds, kind="PD")``. At GR and ZERO ``point.normal_form`` says how the curves
    meet, on which sides the orbits with one impact more or fewer are motions, and in ``why_not`` why these have no
    curve of the same kind there.
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
    if not found and isinstance(form, GrazingContact):
        return NoCurve(point, "the curve of the touch could not be followed")
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
    if isinstance(form, GrazingContact):
        return tuple(_at_touch(point, form, bounds, steps, progress))
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
    elif isinstance(form, OneToTwo):
        tries = _doubled_at_two(origin, form, bounds)
        found = [_first(origin, tries, "NS", bounds, steps, progress)]
    else:
        kind = form.switchable[0].kind
        born = _doubled(point, partial(_Watched, kind), bounds)
        tries = (found.solution for found in born)
        found = [_first(origin, tries, kind, bounds, steps, progress)]
    return tuple(curve for curve in found if curve is not None)


def _first(
    origin: Solution, tries: Iterator[Solution], kind: str,
    bounds: tuple[Bounds, Bounds], steps: Steps | None, progress: CurveProgress | None,
) -> BifurcationCurve | None:  # fmt: skip
    """The first curve that can be followed, and begins at the point."""
    for born in tries:
        with suppress(InvalidParameterError):  # the start does not converge
            curve = emanating(kind, origin, born, bounds, steps, progress)
            if _begins_at(curve, origin, born):
                return curve
    return None


def _begins_at(curve: BifurcationCurve, origin: Solution, born: Solution) -> bool:
    """Whether a curve passes its predicted start, measured with the distance of that from the point."""
    d = len(born.z)
    middle = origin.equations.unrolled(origin.z, np.zeros((d // len(origin.z), len(origin.z))))
    away = np.abs((born.z - middle) / born.equations.sizes).max()
    moved = np.abs((curve.curve.z[:, :d] - born.z) / born.equations.sizes).max(axis=1)
    return bool(moved.min() <= CORRECTED * away)


# ---- GR and ZERO ---------------------------------------------------------------------------------


def _at_touch(
    point: CodimensionTwoPoint, form: GrazingContact, bounds: tuple[Bounds, Bounds],
    steps: Steps | None, progress: CurveProgress | None,
) -> Iterator[BifurcationCurve]:  # fmt: skip
    """Curves that begin where an orbit of a curve touches a stop."""
    names = point.problem.equations.names
    for k, new in enumerate(form.switchable):
        with suppress(InvalidParameterError):  # the start does not converge
            if k == 0:
                yield continue_bifurcation(
                    point, names, bounds, kind=new.kind, steps=steps, progress=progress
                )
            elif new.period == 2:
                yield from _doubled_touch(point, new.kind, bounds, steps, progress)
            else:
                yield followed(_beginning(point, new.kind), bounds, steps=steps, progress=progress)


def _beginning(point: CodimensionTwoPoint, kind: str) -> Start:
    """Start of the other one of SN and PD, or of the same kind of orbits with one impact more or fewer."""
    here = touching(point)
    if kind == point.curve_kind:
        other = neighbour(here)
        assert other is not None
        condition, tests = on_multipliers(kind, other.plane)
        return Start(kind, other.plane, condition, tests, other.z, other.a)
    kind = of_solved_map(kind, point.orbit)
    condition, tests = on_multipliers(kind, here.plane)
    return Start(kind, here.plane, condition, tests, *beside(here, condition))


def _doubled_touch(
    point: CodimensionTwoPoint, kind: str, bounds: tuple[Bounds, Bounds],
    steps: Steps | None, progress: CurveProgress | None,
) -> Iterator[BifurcationCurve]:  # fmt: skip
    """Curve on which the doubled orbits touch, of motions if there are such near the point."""
    found = None
    for born in _doubled(point, partial(_Touched, point), bounds):
        solution = born.solution
        if not _beside(point, solution.a, bounds):
            continue
        found = found or born
        if is_motion(solution.equations.solution(solution.z, solution.a), kind):
            found = born
            break
    if found:
        yield emanating(
            kind, solution_at(point), found.solution, bounds, steps, progress,
            touch=found.condition,
        )  # fmt: skip


def _beside(point: CodimensionTwoPoint, a: Pair, bounds: tuple[Bounds, Bounds]) -> bool:
    """Whether parameters lie near the point, next to the tangent of its curve."""
    names = point.problem.equations.names
    widths = np.array([width_of(pair) for pair in bounds])
    da = (np.array(a) - [point.parameters[name] for name in names]) / widths
    ahead = point.tangent[-2:] / widths / np.linalg.norm(point.tangent[-2:] / widths)
    along = abs(float(da @ ahead))
    aside = abs(float(da[0] * ahead[1] - da[1] * ahead[0]))
    return along <= BOX and aside <= ASIDE * along


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


def _doubled_at_two(
    origin: Solution, form: OneToTwo, bounds: tuple[Bounds, Bounds]
) -> Iterator[Solution]:
    """Doubled orbits (4) that lose their stability."""
    equations = origin.equations
    manifold = centre(*origin, -1.0)
    c, pull = form.c, -form.d - 3.0 * form.c
    ratio = abs(c / pull)
    unit = min(ratio**2, LARGEST_RATES[0], LARGEST_RATES[1] * ratio)
    for share in OF_UNIT:
        e1 = share * unit
        solved = _at_rates(origin, (e1, -pull * e1 / abs(c)), bounds)
        if solved is None:
            continue
        w = math.sqrt(e1 / abs(c))
        points = 0.5 * w * np.array([1.0, -1.0], dtype=np.complex128)
        changes = manifold.moved(points, np.zeros(2))
        yield Solution(equations.repeated(2), equations.unrolled(solved.z, changes), solved.a)


def _at_rates(
    origin: Solution, wanted: Pair, bounds: tuple[Bounds, Bounds]
) -> Solution | None:  # fmt: skip
    """The solution at which e1 and e2 of (4) are given; None where it is not found within the bounds."""
    equations, z, a = origin
    widths = np.array([width_of(pair) for pair in bounds])

    def rates(at: Floats, guess: Floats) -> tuple[Floats, Floats]:
        pair = float(at[0]), float(at[1])
        for _ in range(SETTLES):
            by_z, _ = equations.by_both(guess, pair)
            guess = guess - np.linalg.solve(by_z, equations.residual(guess, pair))
        mu = equations.multipliers(guess, pair)
        two = np.log(-mu[np.argsort(np.abs(mu + 1.0))[:2]].astype(np.complex128))
        return guess, np.array([-(two[0] * two[1]).real, two.sum().real])

    at, scale = np.array(a), np.abs(wanted)
    for _ in range(SETTLES):
        z, here = rates(at, z)
        if np.all(np.abs(here - wanted) <= REACHED * scale):
            pair = float(at[0]), float(at[1])
            return Solution(equations, z, pair) if is_inside(pair, bounds) else None
        steps = DIFFERENCE * widths
        slopes = np.column_stack(
            [(rates(at + step, z)[1] - here) / step.sum() for step in np.diag(steps)]
        )
        at = at + np.linalg.solve(slopes, wanted - here)
    return None


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


class _Born(NamedTuple):
    """Bifurcation or touch found on a slice, the latter with its condition."""

    solution: Solution
    condition: Condition | None


class _Watched(Slice):
    """Slice that also looks for NS."""

    steps = ALONG

    def __init__(self, kind: str, equations: Any, along: int, held: float, span: float) -> None:
        super().__init__(equations, along, held, span)
        self.name = "SN" if kind == "SN" else "torus"
        self._pair = CriticalPair(equations)

    def watch(self, z: Floats, p: float) -> dict[str, float]:
        """Product over pairs of multipliers, for NS."""
        if self.name == "SN":
            return {}
        return {self.name: self._pair.tau(z, self.at(p))}

    def on(self, curve: Curve, _bounds: Bounds) -> Iterator[_Born]:
        """Bifurcations on a curve of the slice: a neutral saddle is none."""
        for zero in curve.named(self.name):
            mu = self.equations.multipliers(zero.z, self.at(zero.parameter))
            if self.name == "SN" or mu[critical_pair(mu)[0]].imag:
                yield _Born(self.solution(zero), None)


class _Touched(Slice):
    """Slice of doubled orbits that looks for the touch of a point in either of their turns."""

    steps = NEARBY

    def __init__(
        self, point: CodimensionTwoPoint, equations: Any, along: int, held: float, span: float
    ) -> None:
        super().__init__(equations, along, held, span)
        self.plane: OrbitPlane = equations
        orbit, turn = point.orbit, len(point.orbit.durations)
        self.touches: list[Place] = []
        if point.nearest is None:
            self.impacts = [point.segment, point.segment + turn]
            return
        self.impacts = []
        stop, k = Stop(point.nearest.contact, point.nearest.side), point.nearest.segment
        again = stop.opposite if orbit.symmetric else stop
        watch = point.nearest.watch
        self.touches = [Place(*stop, k, False, watch), Place(*again, k + turn, False, watch)]

    def watch(self, z: Floats, p: float) -> dict[str, float]:
        """Closing rates of both turns, for ZERO."""
        touches = self.plane.touches(z, self.at(p)) if self.impacts else {}
        return {name: touches[name] for k in self.impacts if (name := f"{SPEED} {k}") in touches}

    def orbit(self, z: Floats, p: float) -> Orbit:
        """Orbit at a point of the slice."""
        return self.plane.solution(z, self.at(p))

    def on(self, curve: Curve, bounds: Bounds) -> Iterator[_Born]:
        """Touches on a curve of the slice."""
        for k in self.impacts:
            for zero in curve.named(f"{SPEED} {k}"):
                yield _Born(self.solution(zero), ClosingRate(self.plane, k))
        if not self.touches:
            return
        orbits = map(self.orbit, curve.z, curve.parameter.tolist())
        gaps = [{at: near for at, near in o.gaps.items() if at in self.touches} for o in orbits]
        for found in grazings(self, curve, gaps, bounds):
            if isinstance(found, Grazing):
                solution = Solution(self.equations, found.z, self.at(found.parameter))
                yield _Born(solution, Graze(self.plane, found.nearest))


# ---- doubled orbits ------------------------------------------------------------------------------

Search = Callable[[Any, int, float, float], _Watched | _Touched]  # as a Slice is made


def _doubled(
    point: CodimensionTwoPoint, search: Search, bounds: tuple[Bounds, Bounds]
) -> Iterator[_Born]:
    """Bifurcations of doubled orbits (3), from points on the curve of PD on both sides."""
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
            yield from _branching(flips, k, twice, search, bounds, at)


def _branching(
    flips: BifurcationCurve,
    k: int,
    twice: Any,
    search: Search,
    bounds: tuple[Bounds, Bounds],
    at: Floats,
) -> Iterator[_Born]:
    """Bifurcations on the doubled branch at a point of the curve of PD."""
    equations = flips.problem.equations
    z, _, a = flips.problem.parts(flips.curve.z[k], float(flips.values[k, 1]))
    for along in flattest(flips.values[k] - at, bounds):
        piece = search(twice, along, a[1 - along], SPAN * width_of(bounds[along]))
        yield from _along_branch(equations, piece, z, a, bounds)


def _along_branch(
    equations: Any, piece: _Watched | _Touched, z: Floats, a: Pair, bounds: tuple[Bounds, Bounds]
) -> Iterator[_Born]:
    """Bifurcations on the doubled branch along one parameter, nearest first."""
    along = piece.along
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
            steps=piece.steps,
        )  # fmt: skip
        yield from piece.on(curve, bounds[along])
