"""Continuation of an invariant circle in one parameter, its rotation number free.

Method      predict    along the unit tangent (du, drho, dp) of the family, the curve in the mean
                       square and in units of its sizes, p in units of its range                 (1)
            correct    on the plane perpendicular to it (solve.py), with as many nodes as the circle
                       needs; the step is halved where that fails or the tangent turns too far   (2)
            detect     between neighbours: a normal exponent changes its sign (fold, doubling, or
                       with a pair second Neimark-Sacker), the least clearance does (grazing)    (3)
            locate     by regula falsi (Illinois) on circles between the neighbours              (4)
            end        where the curve has passed its centre, <u - mean, u_1 - mean_1> < 0, the
                       circle has shrunk to a point: p there from p = p_0 + a radius^2           (5)
Assumes     rotation numbers for which smooth circles exist; families have gaps at resonances, over
            which steps pass where the gaps are narrower than the tolerance resolves
Accuracy    every circle to its tolerance; events to 1e-9 of the range
Fails       the reasons of ``Stopped``, with the family up to there
Reference   [schilder2005]; theory.md, "Invariant circles"
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vibroimpact._core.checks import (
    check_count,
    check_flag,
    check_kind,
    range_of,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.labels import numbered
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact.branches.kinds import GR
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.continuation.curve import End, Stopped
from vibroimpact.continuation.walk import CurveProgress, Steps, check_steps
from vibroimpact.model.parameters import parameter_value
from vibroimpact.normal_forms.explicit import ExplicitMap
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.orbits.problem import asymmetry
from vibroimpact.tori.branch import BREAKING, OF_CIRCLES, CircleBranch
from vibroimpact.tori.circle import Circle
from vibroimpact.tori.find import circle_of
from vibroimpact.tori.fourier import resampled
from vibroimpact.tori.maps import CircleMap, SignatureMap
from vibroimpact.tori.normal import Bundle
from vibroimpact.tori.solve import (
    FEWEST_NODES,
    FOUND,
    MOST_NODES,
    TOLERANCE,
    Direction,
    Solved,
    Trial,
    matrix_of,
    nodes_needed,
    radius,
    solve,
    tangent,
)

STEP_GROWTH = 1.6  # a step that succeeds is followed by one that is longer by this factor
STEP_REDUCTION = 0.5  # a step that fails is multiplied by this factor
LOCATED_OF_RANGE = 1e-9  # (4) is located so well, relative to the range of the parameter
MOST_TRIED_CIRCLES = 40  # (4) tries so many circles at most
STEPS = Steps(first=0.02, least=1e-4, largest=0.1, tolerance=TOLERANCE, turn=0.6435, points=100)


@interruptible
def continue_circle(
    circle: Circle,
    parameter: str,
    bounds: tuple[float, float],
    *,
    steps: Steps | None = None,
    both: bool = True,
    most_nodes: int = MOST_NODES,
    progress: ProgressOption = True,
) -> CircleBranch:
    """Follow an invariant circle in a parameter, with its bifurcations and where it grazes.

    Parameters
    ----------
    circle
        A converged circle, of a system or of a formula.
    parameter
        Name of the parameter; "p" for a formula.
    bounds
        (low, high) of the parameter, with the circle's own value between.
    steps
        By default ``Steps(first=0.02, least=1e-4, largest=0.1, tolerance=1e-10, turn=0.6435,
        points=100)``: lengths in units of the circle's sizes and of the range, the tolerance of
        :func:`find_circle`, the largest turn from one circle to the next, and their number.
    both
        Follow it in both directions; else towards larger values only.
    most_nodes
        As of :func:`find_circle`.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every circle.

    Returns
    -------
    CircleBranch
        Also where it could not be followed to the end, with the reasons in ``ends``.
        ``KeyboardInterrupt`` is such a reason, and is not raised further.

    Raises
    ------
    InvalidParameterError
        A circle that is not converged, no such parameter, a range without the circle, a parameter
        that breaks the symmetry of a circle of the half map; numbers out of range.

    Notes
    -----
    Circles of any stability are followed, through folds, admissible or not. Cost: three Newton
    steps and the normal exponents per circle, 0.1 to 1 s for the damper with 50 to 200 nodes; each
    event some ten circles.

    Examples
    --------
    >>> import numpy as np, vibroimpact as vi
    >>> logistic = vi.ExplicitMap(lambda x, p: [p * x[0] * (1.0 - x[1]), x[0]], dimension=2)
    >>> circle = vi.find_circle(logistic, (0.5, 0.4), p=2.02)
    >>> family = vi.continue_circle(circle, "p", (1.99, 2.03))
    >>> family.ends[0].reason.name, round(family.ends[0].parameter, 4)
    ('BORN', 2.0)
    """
    check_kind("circle", circle, Circle, "a Circle, as find_circle gives")
    if not circle.converged:
        raise refusal("circle", circle, "converged")
    check_flag("both", both)
    check_count("most_nodes", most_nodes, FEWEST_NODES)
    check_steps(steps, progress)
    steps = steps or STEPS
    value = _value(circle, parameter)
    low, high = range_of("bounds", bounds, parameter, value)
    circle_map = _map_along(circle, parameter, (low, high))
    family = _Family(circle_map, parameter, (low, high), steps, int(most_nodes))
    begin = family.solved(replace(circle.trial, p=value), None)
    if begin.status != FOUND:
        raise refusal(
            "circle", circle, f"a solution at the tolerance {steps.tolerance}", begin.status
        )
    start = family.circle(begin)
    backward = _Walked([start], [], End(Stopped.NOT_FOLLOWED))
    with Reporter(progress, "circles") as report:
        told = report.counted("circles", parameter)
        forward = _walk(family, start, 1.0, told)
        if both and forward.end.reason is not Stopped.INTERRUPTED:
            backward = _walk(family, start, -1.0, told)
    found = [*reversed(backward.events), *forward.events]
    labels = numbered(event.kind for event in found)
    return CircleBranch(
        parameter,
        (low, high),
        (*reversed(backward.circles[1:]), *forward.circles),
        tuple(replace(event, label=label) for event, label in zip(found, labels, strict=True)),
        (backward.end, forward.end),
        len(backward.circles) - 1,
    )


def _value(circle: Circle, parameter: str) -> float:
    """Value of the parameter at the circle."""
    check_kind("parameter", parameter, str, "the name of a parameter")
    if isinstance(circle.system, ExplicitMap):
        if parameter != "p":
            raise refusal("parameter", parameter, '"p" for a formula')
        return circle.value
    value = parameter_value(circle.system, parameter)
    return circle.value if circle.parameter == parameter else value


def _map_along(circle: Circle, parameter: str, bounds: tuple[float, float]) -> CircleMap:
    """The map of a circle with its derivative by the parameter, which must keep its symmetry."""
    circle_map, system = circle.map, circle.system
    if isinstance(system, ExplicitMap) or not isinstance(circle_map, SignatureMap):
        return circle_map
    circle_map = replace(circle_map, system=system, parameter=parameter)
    circle_map.problem.compiled(parameter_value(system, parameter))
    if circle_map.signature.symmetric:
        m = circle_map.problem.compiled(sum(bounds) / 2.0).mechanism
        if why := asymmetry(m, circle_map.signature.cycles):
            raise InvalidParameterError(
                f"parameter = {parameter!r}: breaks the symmetry of the circle: {why}. Find it "
                "with find_circle(..., symmetric=False)."
            )
    return circle_map


@dataclass(frozen=True)
class _Family:
    """The equations along the parameter, and circles made from their solutions."""

    map: CircleMap
    parameter: str
    bounds: tuple[float, float]
    steps: Steps
    most_nodes: int

    @property
    def unit(self) -> float:
        """Unit of the parameter: the length of its range."""
        return self.bounds[1] - self.bounds[0]

    def solved(self, guess: Trial, along: Direction | None) -> Solved:
        """Circle near a guess."""
        return solve(
            self.map, guess, along=along, tolerance=self.steps.tolerance,
            most_nodes=self.most_nodes,
        )  # fmt: skip

    def circle(self, found: Solved) -> Circle:
        """Circle from a solution."""
        return circle_of(self.map, found.trial, found.residual, found.status)

    def tangent(self, found: Solved, previous: Direction) -> Direction:
        """Unit tangent at a solution."""
        trial, sizes = found.trial, self.map.sizes
        matrix = matrix_of(found.images, trial, trial, sizes, self.unit)
        return tangent(matrix, self.unit, trial.points.shape, previous)


@dataclass
class _Walked:
    """Circles, events and the end in one direction."""

    circles: list[Circle]
    events: list[BifurcationPoint]
    end: End


def _walk(family: _Family, start: Circle, sense: float, report: CurveProgress) -> _Walked:
    """Follow the family in one direction from a circle."""
    done, trial = _Walked([start], [], End(Stopped.POINTS)), start.trial
    images = family.map.images(trial.points, trial.p, trial.times)
    found = Solved(trial, start.residual, FOUND, images)
    zero = np.zeros_like(trial.points)
    along = family.tangent(found, Direction(zero, 0.0, sense, family.unit))
    length = min(max(family.steps.first, family.steps.least), family.steps.largest)
    try:
        while len(done.circles) < family.steps.points:
            step = _step(family, found, along, length)
            if isinstance(step, str):
                done.end = _ended(family, done.circles[-1], step)
                break
            after, along, taken, at_bound = step
            if _passed_centre(found.trial, after.trial):
                done.end = _birth(family, done.circles, after.trial)
                break
            done.circles.append(family.circle(after))
            done.events += _events(family, *done.circles[-2:])
            report(len(done.circles), after.trial.p)
            if at_bound:
                done.end = End(Stopped.RANGE, f"{after.trial.p:.9g}")
                break
            found, length = after, min(STEP_GROWTH * taken, family.steps.largest)
    except KeyboardInterrupt:
        done.end = End(Stopped.INTERRUPTED)
    return done


# ---- one step ------------------------------------------------------------------------------------


def _step(
    family: _Family, found: Solved, along: Direction, length: float
) -> tuple[Solved, Direction, float, bool] | str:
    """Predict and correct (1), (2): the next circle, its tangent, the step taken, at a bound.

    Or the reason why even the shortest step fails.
    """
    sizes, why = family.map.sizes, ""
    most = family.most_nodes
    count = min(nodes_needed(found.trial.points, sizes, family.steps.tolerance), most)
    origin = found.trial.at_nodes(count)
    while length >= family.steps.least:
        guess = _moved(origin, along, length, family)
        low, high = family.bounds
        at_bound = not low < guess.p < high
        if at_bound:
            bound = high if guess.p >= high else low
            length *= (bound - origin.p) / (guess.p - origin.p)
            guess = replace(_moved(origin, along, length, family), p=bound)
            after = family.solved(guess, None)
        else:
            after = family.solved(guess, along)
        if after.status == FOUND:
            there = family.tangent(after, along)
            if _cosine(along, there) > math.cos(family.steps.turn) or _passed_centre(
                found.trial, after.trial
            ):
                return after, there, max(length, family.steps.least), at_bound
            why = "the family turns"
        else:
            why = after.status
        # Circles of so many nodes are dear, and about to end.
        length *= STEP_REDUCTION**3 if count > most / 2 else STEP_REDUCTION
    return why


def _moved(trial: Trial, along: Direction, length: float, family: _Family) -> Trial:
    """Prediction (1)."""
    points = resampled(along.points, len(trial.points)) * family.map.sizes
    return replace(
        trial,
        points=trial.points + length * points,
        rotation=trial.rotation + length * along.rotation,
        p=trial.p + length * along.parameter * family.unit,
    )


def _cosine(a: Direction, b: Direction) -> float:
    count = max(len(a.points), len(b.points))
    one, other = resampled(a.points, count), resampled(b.points, count)
    product = float((one * other).sum()) / count
    return product + a.rotation * b.rotation + a.parameter * b.parameter


def _passed_centre(before: Trial, after: Trial) -> bool:
    """Whether the circle has turned inside out (5)."""
    count = max(len(before.points), len(after.points))
    one, other = (resampled(trial.points, count) for trial in (before, after))
    return float(((one - one.mean(axis=0)) * (other - other.mean(axis=0))).sum()) < 0.0


def _birth(family: _Family, circles: list[Circle], after: Trial) -> End:
    """End (5), with the parameter of the Neimark-Sacker point."""
    r1, p1 = circles[-1].radius ** 2, circles[-1].value
    r2, p2 = radius(after.points, family.map.sizes) ** 2, after.p
    if len(circles) > 1 and abs(r1 - r2) < 0.1 * max(r1, r2):
        r2, p2 = circles[-2].radius ** 2, circles[-2].value
    p = p1 - r1 * (p2 - p1) / (r2 - r1) if r1 != r2 else p1
    return End(Stopped.BORN, f"{family.parameter} = {p:.9g}", p)


def _ended(family: _Family, last: Circle, why: str) -> End:
    """End where the step became too short: the circle breaks, or the iteration fails."""
    p, q = last.resonance
    detail = (
        f"{family.parameter} = {last.value:.9g}, {why}; rotation number {last.rotation_number:.9g} "
        f"next to {p}/{q}, decay {last.decay:.3g}, roughness {last.roughness:.3g}, least angle "
        f"{last.least_angle:.2g}, clearance {last.clearance_to_grazing:.3g}, impact speed "
        f"{last.least_impact_speed:.3g}"
    )
    rough = last.nodes > family.most_nodes / 4 or "nodes" in why
    return End(Stopped.BREAKING if rough else Stopped.STEP, detail)


# ---- events --------------------------------------------------------------------------------------


def _events(family: _Family, before: Circle, after: Circle) -> list[BifurcationPoint]:
    """Events (3) between two neighbours, in order along the family."""
    found = []
    one, other = (int((c.normal_exponents > 0.0).sum()) for c in (before, after))
    if one != other:
        i = min(one, other)
        pair = abs(one - other) == 2

        def exponent(circle: Circle) -> float:
            values = circle.normal_exponents
            return float(values[i : i + 2].mean() if pair else values[i])

        located = _located(family, before, after, exponent)
        found.append((_kind(located[1], None if pair else i), other - one, located))
    if before.clearance_to_grazing * after.clearance_to_grazing < 0.0:
        opened = after.clearance_to_grazing > 0.0
        located = _located(family, before, after, lambda c: c.clearance_to_grazing)
        found.append((GR, 1 if opened else -1, located))
    return [
        BifurcationPoint(
            record=kind, label=kind.label, parameters={family.parameter: circle.value}, orbit=circle,
            problem=family.map, bounds=family.bounds, test="clearance" if kind == GR else "normal exponent",
            parameter=circle.value, z=circle.points.ravel(), tangent=np.empty(0), arclength=share, error=error,
            crossing=1 if crossing > 0 else -1,
        )
        for kind, crossing, (share, circle, error) in sorted(found, key=lambda item: item[2][0])
    ]  # fmt: skip


def _kind(circle: Circle, number: int | None) -> PointKind:
    """Kind where a normal exponent vanishes, or those of a pair."""
    bundle = Bundle.PAIR if number is None else circle.bundles[number]
    kind = OF_CIRCLES[{Bundle.POSITIVE: 1.0, Bundle.PAIR: None}.get(bundle, -1.0)]
    mirrored = circle.symmetric and Bundle.NEGATIVE in circle.bundles
    return BREAKING if kind == BREAKING and mirrored else kind


def _located(
    family: _Family, before: Circle, after: Circle, test: Callable[[Circle], float]
) -> tuple[float, Circle, float]:
    """Zero (4) of a test function: share of the way, circle, and last change of the parameter."""
    a, b, fa, fb = 0.0, 1.0, test(before), test(after)
    share, best = (0.0, before) if abs(fa) < abs(fb) else (1.0, after)
    error = abs(after.value - before.value)
    for _ in range(MOST_TRIED_CIRCLES):
        c = b - fb * (b - a) / (fb - fa) if np.isfinite(fb - fa) else (a + b) / 2.0
        circle = _between(family, before, after, c)
        if circle is None:
            break
        fc, error = test(circle), abs(circle.value - best.value)
        share, best = c, circle
        if fc == 0.0 or (error <= LOCATED_OF_RANGE * family.unit and abs(b - a) < 1.0):
            break
        if fc * fb < 0.0:
            a, fa = b, fb
        else:
            fa /= 2.0  # Illinois
        b, fb = c, fc
    return share, best, error


def _between(family: _Family, before: Circle, after: Circle, share: float) -> Circle | None:
    """Circle at a share of the way, in the plane perpendicular to the chord; None where it fails."""
    count = max(before.nodes, after.nodes)
    one, other = (c.trial.at_nodes(count) for c in (before, after))
    chord = Direction(
        (other.points - one.points) / family.map.sizes, other.rotation - one.rotation,
        (other.p - one.p) / family.unit, family.unit,
    )  # fmt: skip
    guess = _moved(one, chord, share, family)
    found = family.solved(guess, chord.scaled(1.0 / chord.norm()))
    return family.circle(found) if found.status == FOUND else None
