"""Continuation of a curve in one direction, panel by panel, until there is a reason to stop.

Method      try a panel (panel.py); shorten it where it fails, lengthen it where it was easy
            bounds of p: where Newton's iterates leave them, the point F(z, p) = 0 at the bound is
            solved for and the panel rebuilt to end there; likewise where the expansion of a panel
            leaves the bounds between two nodes                                               (1)
            events: the first zero of a terminal test function ends the curve                 (2)
            a rule: the first point at which it gives a reason ends the curve                 (3)
            return: a zero of <t_start, y - y_start> at which y = y_start. Images of the start under
            symmetries of F count as the start: from there the curve is its own image         (4)
            a branch point that is its own image, with the tangent reversed: from there the curve
            is the image of the part before, and ends                                         (5)
Assumes     what panel.py assumes
Fails       the reasons of ``Stopped``, with the curve up to there
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace

import numpy as np

from vibroimpact._core.checks import (
    check_count,
    check_kind,
    check_progress,
    names_arguments,
    positive,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.continuation.curve import End, Stopped
from vibroimpact.continuation.expansion import Expansion, first_zero, positions
from vibroimpact.continuation.newton import Node, correct, relative
from vibroimpact.continuation.panel import BRANCH_POINT, Failure, Panel, Standard, build, growth
from vibroimpact.continuation.problem import Scaled
from vibroimpact.continuation.special import LocatedZero, at_end, at_start, locate

# A test function that is not resolved on a panel this much shorter than the curve itself needs
# has a kink, a pole or noise: it no longer shortens panels until it is resolved again.
EXCUSED_LENGTH_RATIO = 1.0 / 64.0
# |y - y_start| of (4) on return is less: a hundred times the error of the expansions.
CLOSING_DISTANCE = 1e-6
PARALLEL_TANGENTS = 1e-3  # unit tangents of a curve and its image that differ by less are parallel
# A curve may start on a special point, known to rounding: a terminal event there does not stop it,
# and a closed curve does not list it twice.
START_ARCLENGTH = 1e-8
BULGE_OF_BOUNDS = 1e-10  # the expansion may leave the bounds of p (1) by so much, in scaled p

CurveProgress = Callable[[int, float], None]
StopRule = Callable[[Floats, float], str]  # reason to end a curve at (z, p), or empty
BeginRule = Callable[[], StopRule]


@names_arguments()
@dataclass(frozen=True, kw_only=True)
class Steps:
    """Step lengths and tolerances of a continuation; lengths in scaled arclength.

    Parameters
    ----------
    first
        Length of the first panel tried.
    least
        The curve stops with a status where panels would have to be shorter.
    largest
        Longest panel; a panel has 12 points.
    tolerance
        Error of the Chebyshev expansion of the curve relative to the panel's length, and of
        every test function relative to its size on the panel.
    turn
        Largest turn of the tangent within a panel, radians.
    points
        Number of points after which each direction stops.

    Raises
    ------
    InvalidParameterError
        A length, tolerance or turn that is not positive, ``largest`` below ``least``, ``points``
        that is not an integer >= 1.
    """

    first: float = 0.1
    least: float = 1e-6
    largest: float = 1.0
    tolerance: float = 1e-8
    turn: float = 0.7
    points: int = 2000

    def __post_init__(self) -> None:
        for name in ("first", "least", "largest", "tolerance", "turn"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        if self.largest < self.least:
            raise InvalidParameterError(
                f"largest = {self.largest}: must be >= least = {self.least}."
            )
        check_count("points", self.points, 1)


def check_steps(steps: object, progress: object) -> None:
    """Refuse ``steps`` that are no :class:`Steps`, and a ``progress`` that is none."""
    check_kind("steps", steps, (Steps, type(None)), "Steps, or None")
    check_progress(progress)


def no_progress(points: int, parameter: float) -> None:
    """Report nothing."""


def reversed_node(node: Node) -> Node:
    """Node of the curve in the other direction."""
    return replace(node, direction=-node.direction)


@dataclass(frozen=True)
class Stretch:
    """Part of a panel that belongs to the curve."""

    panel: Panel
    stop: float  # place at which the curve ends on it; its length if the curve does not end
    last: Node  # the node at `stop`
    found: tuple[LocatedZero, ...]  # special points up to `stop`
    end: End | None = None  # reason if the curve ends here


@dataclass
class Walk:
    """Result of one direction.

    ``met`` is the walk in the other direction if that stopped early: the curve is closed where it
    reaches the end of that one, else where it returns to the start.
    """

    start: Node
    met: Walk | None = None
    stretches: list[Stretch] = field(default_factory=list)
    end: End | None = None
    rejected: int = 0

    @property
    def stopped_early(self) -> bool:
        """Whether the walk stopped on a curve that can be continued."""
        reason = None if self.end is None else self.end.reason
        return bool(self.stretches) and reason in (Stopped.POINTS, Stopped.STEP)

    @property
    def closed(self) -> bool:
        """Whether the curve is closed."""
        return self.end is not None and self.end.reason is Stopped.CLOSED

    @property
    def final(self) -> bool:
        """Whether nothing is left for the other direction: a closed curve, an interruption."""
        return self.closed or (self.end is not None and self.end.reason is Stopped.INTERRUPTED)

    @property
    def last(self) -> Node:
        """Last node."""
        return self.stretches[-1].last if self.stretches else self.start

    @property
    def goal(self) -> Node:
        """Node at which the curve is closed."""
        return self.start if self.met is None else reversed_node(self.met.last)

    @property
    def listed_at_goal(self) -> set[str]:
        """Names of special points at the goal that are listed already."""
        if self.met is None:
            return {zero.name for zero in self.stretches[0].found if zero.s < START_ARCLENGTH}
        last = self.met.stretches[-1]
        return {zero.name for zero in last.found if zero.s > last.stop - START_ARCLENGTH}

    @property
    def points(self) -> int:
        """Number of points after the start, cut panels counted whole."""
        return sum(len(stretch.panel.nodes) - 1 for stretch in self.stretches)


def walk(
    problem: Scaled,
    start: Node,
    steps: Steps,
    terminal: Collection[str],
    progress: CurveProgress,
    stop_when: BeginRule | None = None,
    other: Walk | None = None,
) -> Walk:
    """Follow the curve from a node along its tangent; ``other`` is the walk in the other direction.

    An interruption (``KeyboardInterrupt``) ends the curve with a status and keeps its panels.
    """
    done = Walk(start, other if other is not None and other.stopped_early else None)
    pace = _Pace(steps, steps.first)
    try:
        rule = stop_when() if stop_when else None
        if rule:
            rule(*problem.solution(start.y))
        while done.end is None:
            _advance(problem, done, pace, terminal, progress, rule)
    except KeyboardInterrupt:
        done.end = End(Stopped.INTERRUPTED)
    if done.stretches and not done.stretches[-1].end:
        last = done.stretches[-1]
        done.stretches[-1] = replace(last, found=(*last.found, *at_end(last.panel)))
    return done


@dataclass
class _Pace:
    """Step control, passed from one panel to the next."""

    steps: Steps
    length: float
    natural: float = 0.0  # longest panel that the curve alone allows, as far as known
    excused: frozenset[str] = frozenset()
    before: dict[str, float] = field(default_factory=dict)

    @property
    def standard(self) -> Standard:
        return Standard(self.steps.turn, self.steps.tolerance, self.excused)

    def shorter(self, length: float, failure: Failure) -> float:
        """Length to try after a failure: the same if test functions are excused instead."""
        shorter = length * failure.factor
        if not failure.tests:
            self.natural = min(self.natural, shorter)
            return shorter
        self.natural = max(self.natural, length)
        if shorter >= max(self.natural * EXCUSED_LENGTH_RATIO, self.steps.least):
            return shorter
        self.excused |= failure.tests
        return length

    def learn(self, panel: Panel, rejections: int) -> None:
        """Choose the next length, and remember signs."""
        longer = panel.length * (growth(panel) if rejections == 0 else min(1.0, growth(panel)))
        self.length = min(self.steps.largest, max(longer, self.steps.least))
        self.natural = max(self.natural, panel.length)
        self.excused &= frozenset(panel.unresolved)
        for name, f in panel.tests.items():
            signed = f.values[np.isfinite(f.values) & (f.values != 0.0)]
            if signed.size:
                self.before[name] = float(signed[-1])


def _advance(
    problem: Scaled,
    done: Walk,
    pace: _Pace,
    terminal: Collection[str],
    progress: CurveProgress,
    rule: StopRule | None,
) -> None:
    """Add one panel to a walk, or set the reason of its end."""
    origin = done.last
    if _leaving(problem, origin):
        done.end = End(Stopped.RANGE, f"{problem.solution(origin.y)[1]!r}")
        return
    rejected = done.rejected
    panel = _next_panel(problem, origin, pace, done)
    if isinstance(panel, End):
        done.end = panel
        return
    stretch = _cut(problem, panel, done, terminal, pace.before)
    if rule:
        stretch = _up_to_rule(problem, stretch, rule)
    pace.learn(panel, done.rejected - rejected)
    done.stretches.append(stretch)
    done.end = stretch.end
    if done.end is None and done.points >= pace.steps.points:
        done.end = End(Stopped.POINTS, f"{done.points}")
    progress(done.points, problem.solution(stretch.last.y)[1])


def _leaving(problem: Scaled, node: Node) -> bool:
    """Whether a node lies on a bound of p and the curve leaves the range there."""
    p = problem.solution(node.y)[1]
    ahead = node.direction[-1]
    return bool((p == problem.high and ahead > 0.0) or (p == problem.low and ahead < 0.0))


def _next_panel(problem: Scaled, origin: Node, pace: _Pace, done: Walk) -> Panel | End:
    """The longest panel, among those tried, that satisfies the standard."""
    length = pace.length
    while True:
        tried = build(problem, origin, length, pace.standard)
        last = _last_inside(problem, origin, tried, length)
        if last is not None:
            length = float(origin.tangent @ (last.y - origin.y))
            tried = build(problem, origin, length, pace.standard, last)
        if isinstance(tried, Panel) and not _leaves_between_nodes(problem, tried):
            return tried
        failure = tried if isinstance(tried, Failure) else Failure("it leaves the range of p")
        done.rejected += 1
        length = pace.shorter(length, failure)
        if length < pace.steps.least:
            p = problem.solution(origin.y)[1]
            return End(Stopped.STEP, f"{failure.reason}, after the parameter {p!r}")


def _last_inside(
    problem: Scaled, origin: Node, tried: Panel | Failure, length: float
) -> Node | None:
    """The node at which a panel that was tried reaches a bound of p (1)."""
    if isinstance(tried, Failure):
        guess = None if tried.outside is None else tried.outside.y
    else:
        guess = _exit_between_nodes(problem, tried)
    if guess is None:
        return None
    along_p = np.zeros_like(guess)
    along_p[-1] = 1.0
    node = correct(problem, guess, along_p, float(guess[-1])).node
    if node is None or not 0.0 < float(origin.tangent @ (node.y - origin.y)) <= length:
        return None
    return node


def _leaves_between_nodes(problem: Scaled, panel: Panel) -> bool:
    return _exit_between_nodes(problem, panel) is not None


def _exit_between_nodes(problem: Scaled, panel: Panel) -> Floats | None:
    """First point between two nodes at which a panel's expansion leaves the bounds of p."""
    p = Expansion(0.0, panel.length, panel.curve.values[:, -1])
    for s in p.extrema():
        y = panel.curve.at(s)
        bound = problem.inside(y)[-1]
        if abs(y[-1] - bound) > BULGE_OF_BOUNDS:
            crossing = first_zero(Expansion(0.0, panel.length, p.values - bound))
            guess: Floats = panel.curve.at(s if crossing is None else crossing)
            guess[-1] = bound
            return guess
    return None


def _cut(
    problem: Scaled,
    panel: Panel,
    done: Walk,
    terminal: Collection[str],
    before: dict[str, float],
) -> Stretch:
    """The part of a panel up to an event (2), (5) or the return to the start (4)."""
    found = locate(problem, panel, before)
    first = not done.stretches
    if first:
        found = [*at_start(panel), *found]
    later = (zero for zero in found if not (first and zero.s < START_ARCLENGTH))
    events = ((zero, _event(problem, zero, terminal)) for zero in later)
    event, end = next((found for found in events if found[1]), (None, None))
    back = None if first else _return(problem, done.goal, panel)
    if back is not None and (event is None or back[0] < event.s):
        kept = _before_return(found, back[0], done.listed_at_goal)
        return Stretch(panel, *back, kept, End(Stopped.CLOSED))
    if event is not None:
        kept = tuple(zero for zero in found if zero.s <= event.s)
        return Stretch(panel, event.s, _node_at(problem, event), kept, end)
    return Stretch(panel, panel.length, panel.nodes[-1], tuple(found))


def _event(problem: Scaled, zero: LocatedZero, terminal: Collection[str]) -> End | None:
    """Reason if a special point ends the curve, else None."""
    if zero.name in terminal:
        return End(Stopped.EVENT, zero.name)
    if zero.name == BRANCH_POINT and turns_back(problem, zero.y, zero.direction):
        return End(Stopped.REPEATED)
    return None


def turns_back(problem: Scaled, y: Floats, direction: Floats) -> bool:
    """Whether the curve after a point is the image of the part before it (5)."""
    unit = direction / np.linalg.norm(direction)
    return any(
        np.linalg.norm(image - y) <= CLOSING_DISTANCE
        and np.linalg.norm(along + unit) <= PARALLEL_TANGENTS
        for image, along in problem.images(y, unit, y)
    )


def _up_to_rule(problem: Scaled, stretch: Stretch, rule: StopRule) -> Stretch:
    """Part of a stretch up to the first point at which the rule gives a reason (3)."""
    panel = stretch.panel
    for s, node in zip(positions(0.0, panel.length)[1:], panel.nodes[1:], strict=True):
        if s > stretch.stop:
            break
        reason = rule(*problem.solution(node.y))
        if reason:
            kept = tuple(zero for zero in stretch.found if zero.s <= s)
            return Stretch(panel, float(s), node, kept, End(Stopped.RULE, reason))
    return stretch


def _before_return(
    found: list[LocatedZero], back: float, listed: set[str]
) -> tuple[LocatedZero, ...]:
    """Special points up to the return; one at the start itself is not listed twice."""
    return tuple(
        zero
        for zero in found
        if zero.s < back - START_ARCLENGTH
        or (zero.s < back + START_ARCLENGTH and zero.name not in listed)
    )


def _return(problem: Scaled, goal: Node, panel: Panel) -> tuple[float, Node] | None:
    """Place on a panel at which the curve returns to a node or its image (4), or None."""
    for y, along in problem.images(goal.y, goal.tangent, panel.nodes[0].y):
        s = _passes(panel, y, along)
        if s is not None:
            return s, goal if np.array_equal(y, goal.y) else _image(problem, goal, y, along)
    return None


def _passes(panel: Panel, y: Floats, tangent: Floats) -> float | None:
    """Place at which a panel's curve passes a point along a unit tangent, or None."""
    apart = panel.curve.values - y
    if float(np.linalg.norm(apart, axis=1).min()) > panel.length:
        return None
    ahead = Expansion(0.0, panel.length, apart @ tangent)
    s = first_zero(ahead) if ahead.values[0] < 0.0 else None
    if s is None or float(np.linalg.norm(panel.curve.at(s) - y)) > CLOSING_DISTANCE:
        return None
    slope = panel.curve.slope(s)
    return (
        s if np.linalg.norm(slope / np.linalg.norm(slope) - tangent) <= PARALLEL_TANGENTS else None
    )


def _image(problem: Scaled, node: Node, y: Floats, direction: Floats) -> Node:
    """The image of a node."""
    jacobian = problem.linearised(y)[1]
    return Node(y, jacobian, direction, node.residual, node.steps, node.step, y)


def _node_at(problem: Scaled, zero: LocatedZero) -> Node:
    """A special point as a node."""
    residual, jacobian = problem.linearised(zero.y)
    return Node(
        zero.y, jacobian, zero.direction, relative(residual, jacobian), 0, zero.error, zero.y
    )
