"""Assembly of a curve from the walks in its two directions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.continuation.curve import Curve, End, LocatedPoint, Stopped, Unresolved
from vibroimpact.continuation.expansion import Expansion, positions
from vibroimpact.continuation.newton import Node, determinants, largest_of
from vibroimpact.continuation.panel import BRANCH_POINT, BUILT_IN, FOLD, Panel
from vibroimpact.continuation.problem import Scaled
from vibroimpact.continuation.special import LocatedZero
from vibroimpact.continuation.walk import START_ARCLENGTH, Stretch, Walk

# A node that is nearer to the cut of the curve, relative to its panel, is left out.
DISTINCT_OF_PANEL = 1e-9


@dataclass(frozen=True)
class _Point:
    """Node with its place on the curve; sense is -1 on the part before the start."""

    node: Node
    sense: int
    arclength: float
    panel: int
    watched: Mapping[str, float]


def assemble(problem: Scaled, forward: Walk, backward: Walk | None) -> Curve:
    """Join both directions, in order of the arclength."""
    if backward is not None and forward.stretches and backward.stretches:
        _drop_start(forward, backward)
    walks = [(forward, 1)] + ([] if backward is None else [(backward, -1)])
    watched = problem.watched(forward.start.y[None])
    start = _Point(forward.start, 1, 0.0, 0, {name: float(f[0]) for name, f in watched.items()})
    before = [] if backward is None else list(_points(backward, -1))
    points = [*reversed(before), start, *_points(forward, 1)]
    special = [point for walk, sense in walks for point in _special(problem, walk, sense)]
    unresolved = [piece for walk, sense in walks for piece in _unresolved(walk, sense)]
    ends = End(Stopped.NOT_FOLLOWED) if backward is None else _end(backward), _end(forward)
    return Curve(
        parameter=np.array([problem.solution(point.node.y)[1] for point in points]),
        z=np.array([problem.solution(point.node.y)[0] for point in points]),
        tangent=np.array([point.sense * point.node.tangent for point in points]) * problem.sizes,
        arclength=np.array([point.arclength for point in points]),
        residual=np.array([point.node.residual for point in points]),
        steps=np.array([point.node.steps for point in points]),
        panel=np.array([point.panel for point in points]) - points[0].panel,
        tests=_tests(problem, points),
        special=tuple(sorted(special, key=lambda point: point.arclength)),
        ends=ends,
        start=len(before),
        unresolved=tuple(_merged(unresolved, len(before))),
        rejected=sum(walk.rejected for walk, _ in walks),
    )


def _drop_start(forward: Walk, backward: Walk) -> None:
    """Remove special points at the common start which the other direction lists, too.

    Rounding of the function there decides which of them finds a change of its sign.
    """
    listed = {zero.name for zero in forward.stretches[0].found if zero.s < START_ARCLENGTH}
    first = backward.stretches[0]
    kept = tuple(z for z in first.found if z.s >= START_ARCLENGTH or z.name not in listed)
    backward.stretches[0] = replace(first, found=kept)


def _end(walk: Walk) -> End:
    assert walk.end is not None
    return walk.end


def _arclength(panel: Panel) -> Expansion:
    """Arclength from the panel's start, as a function of s: d sigma / ds = |dy/ds|."""
    speed = np.array([float(np.linalg.norm(node.direction)) for node in panel.nodes])
    values = Expansion(0.0, panel.length, speed).integral()
    return Expansion(0.0, panel.length, values)


def _placed(walk: Walk) -> Iterator[tuple[int, Stretch, float, Expansion]]:
    """Number, stretch, arclength at its start, and arclength on it."""
    begin = 0.0
    for number, stretch in enumerate(walk.stretches):
        along = _arclength(stretch.panel)
        yield number, stretch, begin, along
        begin += float(along.at(stretch.stop))


def _points(walk: Walk, sense: int) -> Iterator[_Point]:
    """The points after the start, away from it."""
    for number, stretch, begin, along in _placed(walk):
        panel = stretch.panel
        for s, node in zip(positions(0.0, panel.length), panel.nodes, strict=True):
            if 0.0 < s < stretch.stop - DISTINCT_OF_PANEL * panel.length:
                yield _point(stretch, node, float(s), sense, number, begin, along)
        yield _point(stretch, stretch.last, stretch.stop, sense, number, begin, along)


def _point(
    stretch: Stretch,
    node: Node,
    s: float,
    sense: int,
    number: int,
    begin: float,
    along: Expansion,
) -> _Point:
    own = {n: float(f.at(s)) for n, f in stretch.panel.tests.items() if n not in BUILT_IN}
    at = sense * (begin + float(along.at(s)))
    return _Point(node, sense, at, number if sense > 0 else -1 - number, own)


def _tests(problem: Scaled, points: list[_Point]) -> dict[str, Floats]:
    """Values of all test functions along the curve.

    SN is the parameter's component of the tangent; BP the signed geometric mean of the singular
    values of [J; t] relative to their largest along the curve, whose sign is that of the determinant.
    """
    values = {
        FOLD: np.array([point.sense * float(point.node.tangent[-1]) for point in points])
        * problem.sizes[-1],
        BRANCH_POINT: _mean_singular_values(points),
    }
    names = points[0].watched.keys()
    own = {name: np.array([p.watched.get(name, math.nan) for p in points]) for name in names}
    return values | own


def _mean_singular_values(points: list[_Point]) -> Floats:
    rows = [point.sense * point.node.tangent for point in points]
    found = determinants([point.node for point in points], rows)
    reference, count = largest_of(found), len(points[0].node.y)
    return np.array([at.over(reference, count) for at in found])


def _special(problem: Scaled, walk: Walk, sense: int) -> Iterator[LocatedPoint]:
    for _, stretch, begin, along in _placed(walk):
        for zero in stretch.found:
            arclength = sense * (begin + float(along.at(zero.s)))
            yield _special_point(problem, zero, sense, arclength)


def _special_point(
    problem: Scaled, zero: LocatedZero, sense: int, arclength: float
) -> LocatedPoint:
    z, p = problem.solution(zero.y)
    tangent = sense * zero.direction / np.linalg.norm(zero.direction) * problem.sizes
    # Against the walk's direction dp/ds and the determinant change sign as s does.
    crossing = zero.crossing if zero.name in BUILT_IN else sense * zero.crossing
    moved = zero.error * float(np.abs(zero.direction[-1])) + zero.floor
    error = moved * float(problem.sizes[-1])
    rounding = float(np.finfo(float).eps) * max(abs(p), float(problem.sizes[-1]))
    return LocatedPoint(
        test=zero.name, parameter=p, z=z, tangent=tangent, arclength=arclength,
        error=error + rounding, crossing=crossing,
    )  # fmt: skip


def _unresolved(walk: Walk, sense: int) -> Iterator[Unresolved]:
    """Stretches, with points counted from the start."""
    count = 0
    for stretch in walk.stretches:
        before, panel = count, stretch.panel
        inner = positions(0.0, panel.length) < stretch.stop - DISTINCT_OF_PANEL * panel.length
        count += int(inner.sum())
        first, last = sorted((sense * before, sense * count))
        for name, reason in panel.unresolved.items():
            yield Unresolved(name, first, last, reason)


def _merged(pieces: list[Unresolved], start: int) -> Iterator[Unresolved]:
    """Neighbouring pieces of one function joined, points counted from the first of the curve."""
    ordered = sorted(pieces, key=lambda piece: (piece.name, piece.reason, piece.first))
    for _, group in itertools.groupby(ordered, key=lambda piece: (piece.name, piece.reason)):
        held: Unresolved | None = None
        for piece in group:
            if held is not None and held.last == piece.first:
                held = replace(held, last=piece.last)
                continue
            if held is not None:
                yield replace(held, first=held.first + start, last=held.last + start)
            held = piece
        if held is not None:
            yield replace(held, first=held.first + start, last=held.last + start)
