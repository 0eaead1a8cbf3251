"""Special points on a panel: zeros of its test functions, on the true curve.

Method      intervals with one change of sign each: expansion.py
            there, on the function itself at points corrected by Newton, from the zero of the expansion:
            steps by the slope of the expansion, to rounding; where they do not settle, Brent's method (1)
            at a branch point Newton's matrix is singular: the curve is expanded once more on an
            interval around it with no node close to it, and the zero of that expansion taken  (2)
Assumes     what expansion.py assumes; branch points are simple
Accuracy    rounding of the test function; the estimate is in ``LocatedZero.error``
Fails       where Newton's iteration cannot be repeated the panel's expansion is used, and the
            error estimate is larger; a change of sign at a pole or a jump is not a zero
Reference   [kuznetsov2004] sec. 10.2 on branch points; [trefethen2013] ch. 18
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.continuation.expansion import (
    Edge,
    Expansion,
    Function,
    brent,
    edges,
    positions,
    sign_changes,
    zero_between,
)
from vibroimpact.continuation.newton import Node, correct
from vibroimpact.continuation.panel import BRANCH_POINT, FOLD, NOT_FINITE, Panel, test_values
from vibroimpact.continuation.problem import Scaled

EPS = float(np.finfo(float).eps)
# A fold and a branch point this close in scaled arclength are one point: on the arm of a pitchfork
# that is tangent to it, p turns back at the branch point, and rounding there is sqrt(eps).
SAME_POINT_ARCLENGTH = 1e-6
# (2): the interval relative to the panel, where the tail falls by 20^K; not symmetric, so that the
# point lies between two nodes.
INTERVAL_OF_PANEL = 0.05
SHARE_BELOW_POINT = 1.15
SHARE_ABOVE_POINT = 0.85
# |f| at a zero is smaller, relative to the ends of its bracket; a pole or jump has more.
ZERO_OF_CHANGE = 1e-3
MOST_STEPS = 4  # by the slope of the expansion, whose error is squared by the first one
# Steps that no longer halve are rounding where they are smaller than so many of that of the values.
ROUNDED_STEPS = 8.0
WIDENING_FACTOR = 16.0  # a bracket in which the sign does not change is widened by this factor


@dataclass(frozen=True)
class LocatedZero:
    """A zero of a test function on a panel."""

    name: str  # the test function
    s: float  # projected arclength on the panel
    # the point and dy/ds
    y: Floats
    direction: Floats
    crossing: int  # +1 where the function rises along the curve, -1 where it falls
    error: float  # estimated error of s
    # error of the scaled parameter that remains where the curve turns and dp/ds = 0
    floor: float = 0.0


class Sampler:
    """The curve and its test functions at any s of a panel, corrected to rounding."""

    def __init__(self, problem: Scaled, panel: Panel) -> None:
        self.problem, self.panel = problem, panel
        self.used_expansion = False  # whether an expansion was used in place of a value
        self._known: dict[float, tuple[Node, Mapping[str, float]] | None] = {}

    def node(self, s: float) -> Node | None:
        """Node at s, or None where Newton's iteration fails."""
        known = self._at(s)
        return None if known is None else known[0]

    def value(self, name: str, s: float) -> float:
        """Value of a test function at s, from the panel's expansion where it cannot be evaluated."""
        known = self._at(s)
        value = np.nan if known is None else known[1].get(name, np.nan)
        if np.isfinite(value):
            return float(value)
        self.used_expansion = True
        return float(self.panel.tests[name].at(s))

    def _at(self, s: float) -> tuple[Node, Mapping[str, float]] | None:
        if s not in self._known:
            self._known[s] = self._evaluate(s)
        return self._known[s]

    def _evaluate(self, s: float) -> tuple[Node, Mapping[str, float]] | None:
        panel = self.panel
        target = float(panel.row @ panel.nodes[0].y) + s
        node = correct(self.problem, panel.curve.at(s), panel.row, target, tolerance=0.0).node
        if node is None:
            return None
        values = test_values(self.problem, [node], [panel.determinant(node)])
        return node, {name: float(of_node[0]) for name, of_node in values.items()}


def locate(problem: Scaled, panel: Panel, before: Mapping[str, float]) -> list[LocatedZero]:
    """All zeros of all test functions on a panel, in order.

    Parameters
    ----------
    problem, panel
        The curve.
    before
        For each test function a value that has the sign it had before the panel.
    """
    sampler = Sampler(problem, panel)
    found: list[LocatedZero] = []
    for name, f in panel.tests.items():
        if np.any(f.values):
            found += _zeros(sampler, name, before.get(name, 0.0))
    branch_points = [zero.s for zero in found if zero.name == BRANCH_POINT]
    kept = [
        zero
        for zero in found
        if zero.name != FOLD or all(abs(zero.s - s) > SAME_POINT_ARCLENGTH for s in branch_points)
    ]
    return sorted(kept, key=lambda zero: zero.s)


def at_start(panel: Panel) -> list[LocatedZero]:
    """Test functions that are exactly zero at the panel's first node.

    ``locate`` assigns these to the previous panel, which the start of a curve does not have.
    """
    return _exact(panel, 0, 1)


def at_end(panel: Panel) -> list[LocatedZero]:
    """Test functions that are exactly zero at the panel's last node; for the end of a curve."""
    return _exact(panel, -1, -1)


def _exact(panel: Panel, index: int, sense: int) -> list[LocatedZero]:
    node, s = panel.nodes[index], 0.0 if index == 0 else panel.length
    found = []
    for name, f in panel.tests.items():
        signed = f.values[::sense][np.isfinite(f.values[::sense])]
        others = signed[signed != 0.0]
        if f.values[index] == 0.0 and others.size:
            crossing = sense if others[0] > 0.0 else -sense
            found.append(LocatedZero(name, s, node.y, node.direction, crossing, node.step))
    return found


def _zeros(sampler: Sampler, name: str, before: float) -> list[LocatedZero]:
    panel = sampler.panel
    f = panel.tests[name]

    def true(s: float) -> float:
        return sampler.value(name, s)

    if name in panel.unresolved:
        known: list[Edge] = [
            (float(s), float(value))
            for s, value in zip(positions(f.low, f.high), f.values, strict=True)
            if np.isfinite(value)
        ]
    else:
        known = edges(f, true)
    zeros = [_polished(sampler, name, a, b) for a, b in sign_changes(known, before)]
    return [zero for zero in zeros if zero is not None]


def _polished(sampler: Sampler, name: str, a: float, b: float) -> LocatedZero | None:
    if name == BRANCH_POINT:
        return _branch_point(sampler, a, b)
    f, sampler.used_expansion = sampler.panel.tests[name], False

    def true(s: float) -> float:
        return sampler.value(name, s)

    s, rate = _stepped(true, f, a, b)
    if not np.isfinite(s):
        low, high = _narrowed(true, f, a, b)
        s = low if true(low) == 0.0 else brent(true, low, high)
        # an end of both signs, by the expansion and by f itself, is noise: no rate is known there
        rate = abs(true(high) - true(low)) / (high - low) if high > low else 0.0
    if not np.isfinite(s):
        sampler.panel.unresolved.setdefault(name, NOT_FINITE)
    at_a, at_b = (true(x) if name in sampler.panel.unresolved else float(f.at(x)) for x in (a, b))
    size = max(abs(at_a), abs(at_b))
    if not (np.isfinite(s) and abs(true(s)) <= ZERO_OF_CHANGE * size):
        return None
    error = _uncertainty(sampler, name, s, rate)
    crossing = 1 if at_b > 0.0 else -1
    node = sampler.node(s)
    if node is None:
        return LocatedZero(
            name, s, sampler.panel.curve.at(s), sampler.panel.curve.slope(s), crossing, error
        )
    return LocatedZero(name, s, node.y, node.direction, crossing, error)


def _uncertainty(sampler: Sampler, name: str, s: float, rate: float) -> float:
    """Error of a zero s: rounding of f and of s, the last Newton step, or the expansion's tail."""
    f, node = sampler.panel.tests[name], sampler.node(s)
    value = EPS * float(np.nanmax(np.abs(f.values)))
    if sampler.used_expansion:
        value += float(f.tail)
    return EPS * f.high + (node.step if node else 0.0) + (value / rate if rate > 0.0 else np.inf)


def _stepped(true: Function, f: Expansion, a: float, b: float) -> tuple[float, float]:
    """The zero in [a, b] by steps with the slope of the expansion, and that slope; NaN where they do not settle."""
    if not float(f.at(a)) * float(f.at(b)) < 0.0:
        return math.nan, 0.0
    s = zero_between(f, a, b)
    slope = float(f.slope(s))
    rounding = EPS * (f.high + float(np.abs(f.values).max()) / abs(slope)) if slope else 0.0
    last = math.inf
    for _ in range(MOST_STEPS if slope else 0):
        step = true(s) / slope
        done = abs(step) <= rounding or last / 2.0 < abs(step) <= ROUNDED_STEPS * rounding
        s, last = s - step, abs(step)
        if not a <= s <= b:
            break
        if done:
            return s, abs(slope)
    return math.nan, 0.0


def _narrowed(true: Function, f: Expansion, a: float, b: float) -> tuple[float, float]:
    """A smaller bracket than [a, b], around the zero of the expansion."""
    if not float(f.at(a)) * float(f.at(b)) < 0.0:
        return a, b
    s = zero_between(f, a, b)
    slope = abs(float(f.slope(s)))
    width = max(4.0 * float(f.tail) / slope if slope else b - a, EPS**0.75 * f.high)
    while True:
        low, high = max(a, s - width), min(b, s + width)
        if (low, high) == (a, b) or true(low) * true(high) <= 0.0:
            return low, high
        width *= WIDENING_FACTOR


def _branch_point(sampler: Sampler, a: float, b: float) -> LocatedZero:
    """A zero of the branch-point function in [a, b], from an expansion about it (2)."""
    panel = sampler.panel
    first = panel.tests[BRANCH_POINT]
    s = zero_between(first, a, b)
    width = INTERVAL_OF_PANEL * panel.length
    low, high = max(a, s - SHARE_BELOW_POINT * width), min(b, s + SHARE_ABOVE_POINT * width)
    nodes = [sampler.node(float(at)) for at in positions(low, high)]
    solved = [node for node in nodes if node is not None]
    curve, determinant = panel.curve, first
    if len(solved) == len(nodes):
        curve = Expansion(low, high, np.array([node.y for node in solved]))
        determinant = Expansion(low, high, np.array([panel.determinant(node) for node in solved]))
        s = zero_between(determinant, low, high)
    noise = float(determinant.tail) + EPS * float(np.abs(determinant.values).max())
    rate = float(determinant.slope(s))
    error = noise / abs(rate) if rate else np.inf
    aside = [curve.at(min(max(s + e, low), high))[-1] for e in (-error, error)]
    moved = np.median([node.step for node in solved]) if solved else 0.0
    floor = float(moved + np.max(curve.tail) + np.abs(np.array(aside) - curve.at(s)[-1]).max())
    return LocatedZero(
        BRANCH_POINT, s, curve.at(s), curve.slope(s), 1 if rate > 0.0 else -1, error, floor
    )
