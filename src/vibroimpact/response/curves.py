"""A measure along branches of periodic motions: values, exact derivatives, maxima, crossings.

Method      At every point of a branch the measure and its derivative by the parameter are exact.
            Between two points the orbit at a value of the parameter is found by Newton's method from
            the line between them. Where the derivative changes its sign on a stretch without a fold,
            the maximum is the zero of the derivative, by Brent's method on exact orbits.
Accuracy    of maxima, that of the derivative: some 1e-12 of the value
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from vibroimpact._core.labels import numbered
from vibroimpact._core.types import AnyFloats, Counts, Floats, Integers
from vibroimpact.branches.branch import Branch, BranchProfile, profile
from vibroimpact.branches.grazing import TEST
from vibroimpact.branches.kinds import GR
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation import LocatedPoint
from vibroimpact.measures.linear import FreeMotion, flights_of_motions, free_motion, free_motions
from vibroimpact.measures.measure import Measure
from vibroimpact.measures.motions import Motion, flights_along
from vibroimpact.model.parameters import with_parameter
from vibroimpact.model.system import System
from vibroimpact.orbits.find import Guess, solve
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.stability import Stability
from vibroimpact.response.answers import SILENT, Answer, is_silent
from vibroimpact.results.result import sized

EXTREMUM_OF_RANGE = 1e-13  # a zero of the derivative is located so well, relative to the range
TOUCH_RELATIVE = 1e-14  # a zero of the gap is located so well
# A simulated motion that is so near, relative to all values, is on an orbit.
ON_CURVE_OF_VALUES = 1e-3
NEARLY_ON_CURVE_OF_VALUES = 1e-4  # one that is not periodic and so near is on it, too
# Where the parameter's part of the unit tangent is no larger the branch turns, or begins at a pitchfork.
TURNING_OF_SCALE = 1e-7
CONVERGED_RESIDUAL = 1e-12  # a point of a branch whose equations hold so well is converged
ORBITS_AT_ONCE = 64  # so many orbits are measured together: series of all stay in a cache


@dataclass(frozen=True, eq=False)
class ResponseCurve:
    """A measure along one branch of periodic motions.

    Attributes
    ----------
    symbol
        Symbol of its motions.
    name
        Name of the parameter.
    parameter, value, derivative
        Numbers at the points in order along the branch, shape (m,); derivatives of the value by the
        parameter along the branch, NaN where there is none: at folds, and where a branch begins with broken symmetry.
    stability
        :class:`Stability` of the stretch from each point to the next, shape (m - 1,).
    special_points
        :class:`~vibroimpact.BifurcationPoint` of the branch; of the motion without impacts those at which it grazes.
    special_values
        Value of the measure at each.
    branch
        The branch of orbits; None of the motion without impacts.
    """

    symbol: str
    name: str
    parameter: Floats = field(metadata=sized("point"), repr=False)
    value: AnyFloats = field(metadata=sized("point"), repr=False)
    derivative: AnyFloats = field(metadata=sized("point"), repr=False)
    stability: Counts = field(metadata=sized("point-1"), repr=False)
    special_points: tuple[BifurcationPoint, ...] = field(metadata=sized("special"))
    special_values: AnyFloats = field(metadata=sized("special"), repr=False)
    branch: Branch | None = field(repr=False)
    measure: Measure = field(repr=False)
    motion_near: Callable[[int, float], Motion | None] = field(repr=False)

    def stretches(self, value: float) -> Integers:
        """Numbers of the stretches that hold a value of the parameter."""
        p = self.parameter
        inside = (p[:-1] - value) * (p[1:] - value) <= 0.0
        found = np.flatnonzero(inside & (p[:-1] != p[1:]))
        both = found[1:][(np.diff(found) == 1) & (p[found[1:]] == value)]  # a point of its own
        return np.setdiff1d(found, both)

    def at(self, value: float) -> Iterator[Answer]:
        """The orbits at a value of the parameter, measured exactly."""
        for k in self.stretches(value):
            motion = self.motion_near(int(k), value)
            if motion is not None:
                yield self.answer(motion, value, int(k))

    def answer(self, motion: Motion, parameter: float, stretch: int) -> Answer:
        """An orbit on a stretch as an answer."""
        value, by = self.measure.along(motion, self.name)
        return Answer(
            parameter, value, self.symbol, Stability(self.stability[stretch]),
            self.attracting(stretch), derivative=by, orbit=motion,
        )  # fmt: skip

    def between(self, stretch: int, parameter: float) -> float:
        """Value at a place on a stretch, by Hermite's cubic where both derivatives are known."""
        p, y, slope = self.parameter, self.value, self.derivative
        step = p[stretch + 1] - p[stretch]
        t = (parameter - p[stretch]) / step
        line = y[stretch] + t * (y[stretch + 1] - y[stretch])
        left, right = (float(slope[k]) * step for k in (stretch, stretch + 1))
        cubic = (
            (1.0 + 2.0 * t) * (1.0 - t) ** 2 * y[stretch] + t * (1.0 - t) ** 2 * left
            + t * t * (3.0 - 2.0 * t) * y[stretch + 1] + t * t * (t - 1.0) * right
        )  # fmt: skip
        bounded = abs(cubic - line) <= abs(y[stretch + 1] - y[stretch]) + abs(line) * 0.1
        return float(cubic if math.isfinite(cubic) and bounded else line)

    def attracting(self, stretch: int) -> bool:
        """Whether motions on a stretch attract starts of positive measure; of neutral ones by that in the middle."""
        kind = self.stability[stretch]
        if kind != Stability.NEUTRAL:
            return bool(kind == Stability.STABLE)
        motion = self.motion_near(stretch, float(self.parameter[stretch : stretch + 2].mean()))
        return motion is not None and motion.attracting

    def holds(self, answer: Answer, size: float) -> bool:
        """Whether a simulated answer is one of its motions, stable or neutral; ``size`` is that of values."""
        near = likeness(answer.motion, self.symbol) * size
        for k in self.stretches(answer.parameter):
            there = self.stability[k] <= Stability.NEUTRAL
            if there and abs(self.between(int(k), answer.parameter) - answer.value) < near:
                return True
        return False

    def largest(self, reached: Callable[[float], bool]) -> Answer | None:
        """The largest value over what attracts, and over other neutral motions at values where these are reached.

        It is at a maximum, at an end or at a bifurcation.
        """
        best = None
        for k in np.flatnonzero(self.stability <= Stability.NEUTRAL).tolist():
            middle = float(self.parameter[k : k + 2].mean())
            if not (self.attracting(k) or reached(middle)):
                continue
            here = max(self.value[k], self.value[k + 1])
            peaked = _is_peaked(self, k)
            if best is not None and not peaked and not here > best.value:
                continue
            for found in self._candidates(k, peaked=peaked):
                if math.isfinite(found.value) and (best is None or found.value > best.value):
                    best = found
        return best

    def _candidates(self, k: int, *, peaked: bool) -> Iterator[Answer]:
        p = self.parameter
        for j in (k, k + 1):
            yield Answer(
                float(p[j]), float(self.value[j]), self.symbol, Stability(self.stability[k]),
                self.attracting(k), derivative=float(self.derivative[j]),
                orbit=self.motion_near(k, float(p[j])),
            )  # fmt: skip
        if peaked and (place := _summit(self, k)) is not None:
            motion = self.motion_near(k, place)
            if motion is not None:
                yield self.answer(motion, place, k)


def _is_peaked(curve: ResponseCurve, k: int) -> bool:
    """Whether a stretch has a maximum inside, by the signs of the derivative."""
    step = curve.parameter[k + 1] - curve.parameter[k]
    return bool(curve.derivative[k] * step > 0.0 > curve.derivative[k + 1] * step)


def _summit(curve: ResponseCurve, k: int) -> float | None:
    """Zero of the derivative on a stretch."""
    from scipy.optimize import brentq

    def slope(value: float) -> float:
        motion = curve.motion_near(k, value)
        if motion is None:
            raise ArithmeticError
        return curve.measure.derivative(motion, curve.name)

    low, high = sorted((float(curve.parameter[k]), float(curve.parameter[k + 1])))
    try:
        return float(
            brentq(slope, low, high, xtol=EXTREMUM_OF_RANGE * (high - low), rtol=EXTREMUM_OF_RANGE)
        )
    except (ArithmeticError, ValueError):
        return None


def likeness(motion: str, symbol: str) -> float:
    """Distance, relative to all values, within which a simulated motion counts as an orbit; 0 for never.

    One that is not periodic may be on its way to the orbit.
    """
    if any(re.fullmatch(name, motion) for name in names_of(symbol)):
        return ON_CURVE_OF_VALUES
    return NEARLY_ON_CURVE_OF_VALUES if motion == "not periodic" else 0.0


def names_of(symbol: str) -> tuple[str, ...]:
    """Patterns of names of the motions that an orbit with a symbol stands for: itself and its mirror image.

    Of completed chatter a simulation counts the impacts until the rest of it is summed.
    """
    cycles, _, counts = symbol.partition("-")
    pairs = re.sub(r"(\w+)-(\w+)", r"\2-\1", counts)
    own = (symbol, f"{cycles}-{pairs}", *((SILENT,) if is_silent(symbol) else ()))
    return tuple(re.escape(name).replace("inf", r"(\d+|inf)") for name in own)


def curve_of_branch(branch: Branch, measure: Measure) -> ResponseCurve:
    """Measure a branch of orbits at all its points and special points."""
    points = profile(branch)
    values, slopes = _along(branch, points, measure)
    at = np.flatnonzero(points.special >= 0)
    special = tuple(branch.special_points[points.special[k]] for k in at)

    return ResponseCurve(
        branch.symbol, branch.parameter, points.parameter, values, slopes, points.stability, special, values[at],
        branch, measure, OnBranch(points, branch),
    )  # fmt: skip


def _along(branch: Branch, points: BranchProfile, measure: Measure) -> tuple[Floats, Floats]:
    """Measure and derivative at the points of a branch, NaN where an orbit is not converged."""
    regular, curve = points.special < 0, branch.curve
    found = [branch.special_points[k] for k in points.special[~regular]]
    tangent = np.empty((len(points.z), points.z.shape[1] + 1))
    tangent[regular], tangent[~regular] = curve.tangent, [point.tangent for point in found] or 0.0
    good = np.ones(len(points.z), dtype=bool)
    good[~regular] = [point.orbit.converged for point in found]
    doubtful = np.flatnonzero(~(curve.residual <= CONVERGED_RESIDUAL))
    good[np.flatnonzero(regular)[doubtful]] = [branch.orbit(int(k)).converged for k in doubtful]
    turns = np.abs(tangent[:, -1:]) <= TURNING_OF_SCALE * branch.family.scale()[-1]
    moved = np.where(turns, 0.0, tangent[:, :-1] / np.where(turns, 1.0, tangent[:, -1:]))
    value, by = (np.full(len(good), math.nan) for _ in range(2))
    for some in _batches(np.flatnonzero(good)):
        flights = flights_along(branch.family, points.parameter[some], points.z[some], moved[some])
        value[some], by[some] = measure._of(flights)
    by[turns[:, 0]] = math.nan
    return value, by


@dataclass(frozen=True, eq=False)
class OnBranch:
    """Orbits of a branch near a stretch of it."""

    points: BranchProfile
    branch: Branch

    def __call__(self, stretch: int, value: float, /) -> Orbit | None:
        """The orbit at a value of the parameter, None where it is not found."""
        points, family, k = self.points, self.branch.family, stretch
        step = points.parameter[k + 1] - points.parameter[k]
        share = (value - points.parameter[k]) / step if step else 0.0
        z = points.z[k] + share * (points.z[k + 1] - points.z[k])
        system = with_parameter(family.system, self.branch.parameter, value)
        found = solve(system, family.signature, Guess(*family.unpacked(z)))
        return found if found.converged else None


@dataclass(frozen=True)
class WithoutImpacts:
    """Motions without impacts at values of a parameter, and a measure of them."""

    system: System
    parameter: str
    measure: Measure
    opened: bool = False  # as for free_motion

    def __call__(self, _: int, value: float, /) -> FreeMotion | None:
        """The motion at a value; None where there is none."""
        found = self.motion(value)
        return None if isinstance(found, str) else found

    def motion(self, value: float) -> FreeMotion | str:
        """The motion, or why there is none; kept."""
        if value not in self._kept:
            there = with_parameter(self.system, self.parameter, value)
            self._kept[value] = free_motion(there, opened=self.opened)
        return self._kept[value]

    def motions(self, values: Floats) -> list[FreeMotion | str]:
        """The motion at each value, or why there is none; kept."""
        new = np.array([value for value in values.tolist() if value not in self._kept])
        for some in _batches(new):
            found = free_motions(self.system, self.parameter, some, opened=self.opened)
            self._kept.update(zip(some.tolist(), found, strict=True))
        return [self._kept[value] for value in values.tolist()]

    def measured(self, values: Floats) -> tuple[Floats, Floats]:
        """Measure and derivative at each value, NaN where there is no motion; kept."""
        motions = zip(values.tolist(), self.motions(values), strict=True)
        there = {p: one for p, one in motions if not isinstance(one, str)}
        new = np.array([value for value in there if value not in self._measured])
        for some in _batches(new):
            flights = flights_of_motions([there[p] for p in some.tolist()], self.parameter, some)
            found = zip(*self.measure._of(flights), strict=True)
            self._measured.update(zip(some.tolist(), found, strict=True))
        none = math.nan, math.nan
        every = np.array([self._measured.get(value, none) for value in values.tolist()])
        return every[:, 0], every[:, 1]

    @cached_property
    def _kept(self) -> dict[float, FreeMotion | str]:
        return {}

    @cached_property
    def _measured(self) -> dict[float, tuple[float, float]]:
        return {}


def _batches(places: Any) -> list[Any]:
    """Entries of an array, ORBITS_AT_ONCE at most in each part."""
    return np.array_split(places, math.ceil(len(places) / ORBITS_AT_ONCE)) if len(places) else []


def curve_without_impacts(
    system: System, name: str, values: Floats, measure: Measure
) -> ResponseCurve | str:
    """Measure the motion without impacts at values of the parameter, at its maxima, and where it grazes."""
    free = WithoutImpacts(system, name, measure)
    first = free.motion(float(values[0]))
    if isinstance(first, str):
        return first

    def gap(value: float) -> float:
        found = free.motion(value)
        return -math.inf if isinstance(found, str) else found.clearance_to_grazing

    def through(places: Floats) -> ResponseCurve:
        return _without_impacts(free, places, grazes)

    free.motions(values)
    grazes = _touches(gap, values)
    curve = through(np.unique(values))
    summits = [_summit(curve, k) for k in range(len(curve.value) - 1) if _is_peaked(curve, k)]
    found = [place for place in summits if place is not None]
    return through(np.union1d(values, found)) if found else curve


def existing(curve: ResponseCurve) -> list[ResponseCurve]:
    """Parts of the curve of motions without impacts that cross no stop."""
    real = np.concatenate([[False], curve.stability != Stability.INADMISSIBLE, [False]])
    edges = np.flatnonzero(np.diff(real.astype(int)))
    parts = []
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        low, high = curve.parameter[[first, last]]
        inside = [k for k, p in enumerate(curve.special_points) if low <= p.parameter <= high]
        here = slice(first, last + 1)
        labels = numbered(curve.special_points[k].kind for k in inside)
        parts.append(replace(
            curve, parameter=curve.parameter[here], value=curve.value[here], derivative=curve.derivative[here],
            stability=curve.stability[first:last],
            special_points=tuple(
                replace(curve.special_points[k], label=label) for k, label in zip(inside, labels, strict=True)
            ),
            special_values=curve.special_values[np.array(inside, dtype=np.int64)],
        ))  # fmt: skip
    return parts


def _without_impacts(
    free: WithoutImpacts, values: Floats, grazes: list[LocatedPoint]
) -> ResponseCurve:
    """The curve through motions without impacts at values of the parameter, and where these graze."""
    name, motion, touches = free.parameter, free.motion, [graze.parameter for graze in grazes]
    first = cast(FreeMotion, motion(float(values[0])))
    p = np.unique(np.append(values, touches))
    least, opened = np.empty(len(p)), np.empty(len(p), dtype=np.int64)
    for k, value in enumerate(p.tolist()):
        found = motion(value)
        if isinstance(found, str):
            least[k], opened[k] = -math.inf, Stability.UNSTABLE
        else:
            least[k], opened[k] = found.clearance_to_grazing, found.stability_opened
    least[np.isin(p, touches)] = 0.0
    y, slopes = free.measured(p)
    open_ = least[:-1] + least[1:] > 0.0
    kinds = np.maximum(opened[:-1], opened[1:])
    special = tuple(
        BifurcationPoint(
            record=GR, label=label, parameters={name: graze.parameter}, orbit=motion(graze.parameter), problem=None,
            bounds=(float(values[0]), float(values[-1])), **vars(graze),
        )
        for graze, label in zip(grazes, numbered([GR.label] * len(grazes)), strict=True)
    )  # fmt: skip

    return ResponseCurve(
        first.symbol, name, p, y, slopes,
        np.where(open_, kinds, Stability.INADMISSIBLE).astype(np.int64), special,
        y[np.searchsorted(p, touches)], None, free.measure, free,
    )  # fmt: skip


def _touches(gap: Callable[[float], float], values: Floats) -> list[LocatedPoint]:
    """Zeros of the least gap, also where it is crossed and comes back between two values; without unknowns."""
    from scipy.optimize import brentq, minimize_scalar

    p = values.tolist()
    g = [gap(value) for value in p]
    pairs = list(zip(p, g, strict=True))
    for k in range(1, len(p) - 1):
        if 0.0 < g[k] <= min(g[k - 1], g[k + 1]):
            found = minimize_scalar(gap, bounds=(p[k - 1], p[k + 1]), method="bounded")
            pairs.append((float(found.x), float(found.fun)))
    pairs.sort()
    found_at = []
    for (a, low), (b, high) in itertools.pairwise(pairs):
        if low * high < 0.0 and math.isfinite(low) and math.isfinite(high):
            value = float(brentq(gap, a, b, xtol=TOUCH_RELATIVE * (b - a), rtol=TOUCH_RELATIVE))
            found_at.append(LocatedPoint(
                test=TEST, parameter=value, z=np.empty(0), tangent=np.ones(1), arclength=value,
                error=TOUCH_RELATIVE * (b - a), crossing=1 if high > 0.0 else -1,
            ))  # fmt: skip
    return found_at
