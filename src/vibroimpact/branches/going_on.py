"""Branches that follow what exists: up to where their orbits end to be motions, and on with those that follow.

Method      A branch keeps the points around its start at which its orbits are admissible, up to the first
            special point at which a gap, a speed or a time vanishes. There begin
                GR, ZERO of a rigid stop   the orbits with an impact more or fewer
                all others                 those that a motion a little beyond closes to        (1)
            (beginning.py), which are followed in the same way, and so on from their own other end. (2)
Assumes     beyond such a point orbits with the same sequence are no motions
Fails       ``End`` of the curve says why it goes on no further: nothing was found, or the limit of branches
Reference   theory.md, "Branches"
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.labels import numbered
from vibroimpact.branches.beginning import BranchStart, begins_at
from vibroimpact.branches.branch import Branch, Reached
from vibroimpact.branches.junctions import KNOWN, NEW, Junctions, named
from vibroimpact.branches.point import BifurcationPoint, NotFound
from vibroimpact.branches.same_orbit import same_branch
from vibroimpact.continuation import Curve, End, Stopped
from vibroimpact.results.result import DIMS

MOST_BRANCHES = 8  # so many branches, each of another sequence, are followed at most
SAME_ARCLENGTH = 1e-6  # points of a branch that are so near, in scaled arclength, are one
# Parameters of one point, located from both sides, are so near, relative to the range.
SAME_PLACE_OF_RANGE = 1e-6


class Border(NamedTuple):
    """End of a branch at which its orbits end to be motions, before (0) or after (1) its start."""

    side: int
    point: BifurcationPoint | None  # None where no special point is there
    why: str  # why the orbits beyond are no motions


def trimmed(branch: Branch) -> tuple[Branch, list[Border]]:
    """Part of a branch around its start whose orbits are motions, and its ends that are no ends of the curve.

    A branch without any is left as it is.
    """
    curve, admissible, count = branch.curve, branch.admissible, len(branch)
    start = next((k for k in _around(curve.start, count) if admissible[k]), None)
    if start is None:
        return branch, []
    limits, borders, first = [-np.inf, np.inf], [], float(curve.arclength[start])
    for side, sense in ((0, -1), (1, 1)):
        k = start
        while 0 <= k < count and admissible[k]:
            k += sense
        beyond = float(curve.arclength[k]) if 0 <= k < count else sense * np.inf
        point = _first_touch(branch, first, beyond, at_once=abs(k - start) == 1)
        if point:
            borders.append(Border(side, point, ""))
            limits[side] = point.arclength
            if (
                abs(point.arclength) <= SAME_ARCLENGTH
            ):  # the start, on whichever side rounding puts it
                limits[side] = sense * max(sense * point.arclength, 0.0)
        elif np.isfinite(beyond):
            borders.append(Border(side, None, branch.orbit(k).inadmissible_reason))
            limits[side] = float(curve.arclength[k - sense])
    low, high = limits
    bordering = {id(border.point) for border in borders}
    kept = [
        point
        for point in branch.special_points
        if low <= point.arclength <= high or id(point) in bordering
    ]
    labels = numbered(point.kind for point in kept)
    points = tuple(replace(p, label=label) for p, label in zip(kept, labels, strict=True))
    ends = [*curve.ends]
    for i, border in enumerate(borders):
        named = border.point and points[kept.index(border.point)]
        borders[i] = border._replace(point=named)
        reason = curve.ends[border.side].reason
        if reason is not Stopped.INTERRUPTED:
            reason = Stopped.NO_MOTION
        ends[border.side] = End(reason, named.label if named else border.why)
    inside = np.flatnonzero((curve.arclength >= low) & (curve.arclength <= high) & admissible)
    here = slice(int(inside[0]), int(inside[-1]) + 1)
    part = replace(
        branch,
        **_points(branch, here),
        special_points=points,
        curve=_part(curve, here, (low, high), (ends[0], ends[1])),
    )
    return part, borders


def _around(start: int, count: int) -> list[int]:
    """The start of a branch, which may be a touch known to rounding, and the points beside it."""
    return [k for k in (start, start + 1, start - 1) if 0 <= k < count]


def _first_touch(
    branch: Branch, start: float, beyond: float, *, at_once: bool
) -> BifurcationPoint | None:
    """The first point from the start at which a gap, a speed or a time vanishes: none are motions on both sides.

    The start itself is one where orbits are no motions at once on this side.
    """
    low, high = sorted((start, beyond))
    if at_once:
        low, high = low - SAME_ARCLENGTH, high + SAME_ARCLENGTH
    found = [
        point
        for point in branch.special_points
        if low <= point.arclength <= high
        and point.record.touch
        and (at_once or abs(point.arclength) > SAME_ARCLENGTH)
    ]
    return min(found, key=lambda point: abs(point.arclength - start), default=None)


def _points(record: Branch | Curve, here: slice) -> dict[str, Any]:
    """Arrays along the points of a branch or curve, of a slice of them."""
    along = [f.name for f in fields(record) if f.metadata.get(DIMS, ("",))[0] == "point"]
    return {name: getattr(record, name)[here] for name in along}


def _part(
    curve: Curve, here: slice, arclengths: tuple[float, float], ends: tuple[End, End]
) -> Curve:
    """Part of a curve: the points of a slice, and what lies between two arclengths."""
    low, high = arclengths
    first, last = here.start, here.stop - 1
    left = [
        replace(piece, first=max(piece.first - first, 0), last=min(piece.last, last) - first)
        for piece in curve.unresolved
        if piece.first <= last and piece.last >= first
    ]
    return replace(
        curve,
        **_points(curve, here),
        parameter=curve.parameter[here],
        tests={name: values[here] for name, values in curve.tests.items()},
        special=tuple(zero for zero in curve.special if low <= zero.arclength <= high),
        ends=ends,
        start=min(max(curve.start - here.start, 0), here.stop - here.start - 1),
        unresolved=tuple(left),
    )


Follow = Callable[[BranchStart], Branch]


def going_on(branch: Branch, borders: list[Border], follow: Follow) -> Branch:
    """The branch with those of other sequences with which it goes on (1), (2)."""
    (first, *others), reached = every_part(branch, borders, follow, Junctions(branch.bounds))
    return replace(first, others=tuple(others), reached=tuple(reached))


def every_part(
    branch: Branch,
    borders: list[Border],
    follow: Follow,
    junctions: Junctions,
    *,
    known: Sequence[Branch] = (),
    most: int = MOST_BRANCHES,
) -> tuple[list[Branch], list[Reached]]:
    """The branch and those with which it goes on (1), (2), and what was reached at each border.

    Numbers of branches count on from those that are known; points that were not tried are not among what was reached.
    """
    every, reached = [*known, branch], list[Reached]()
    open_ends = [(len(known), border) for border in borders]
    while open_ends:
        number, border = open_ends.pop(0)
        what = _why_left(border, every, most)
        if not what:
            assert border.point is not None
            result, borders = _beyond(number, border.point, follow, every, junctions)
            reached.append(result)
            if result.how == NEW:
                others, back = parted(borders, border.point)
                reached += [Reached(len(every) - 1, label, number, KNOWN) for label in back]
                open_ends += [(len(every) - 1, other) for other in others]
            what = _words(result, every)
        every[number] = _with_end(every[number], border.side, what)
    return every[len(known) :], reached


def _why_left(border: Border, every: list[Branch], most: int) -> str:
    """Reason why nothing is followed from a border; "" where something is."""
    if every[-1].curve.interrupted:
        return "it was interrupted"
    if border.point is None:
        return "no special point is there"
    return f"{most} branches are the most that are followed" if len(every) >= most else ""


def _beyond(
    number: int,
    point: BifurcationPoint,
    follow: Follow,
    every: list[Branch],
    junctions: Junctions,
) -> tuple[Reached, list[Border]]:
    """What is reached at an end of a branch; a new branch is added, and its own other ends are returned."""
    known = junctions.find(number, point)
    if known and known.result:
        return known.result, []
    result, borders = _followed(number, point, follow, every)
    junctions.add(point, result)
    return result, borders


def _followed(
    number: int, point: BifurcationPoint, follow: Follow, every: list[Branch]
) -> tuple[Reached, list[Border]]:
    """Branch that begins at an end of another one, up to its own other ends."""
    begins = begins_at(point)
    assert begins is not None
    none = Reached(number, point.label, None, "")
    start = begins(point, every[number].bounds)  # (1)
    if isinstance(start, NotFound):
        return none._replace(how=start.reason), []
    try:
        found, borders = trimmed(follow(start))
    except InvalidParameterError as error:  # the start does not converge
        return none._replace(how=str(error)), []
    if not found.admissible.any():
        return none._replace(how=no_motions(found)), []
    for k, other in enumerate(every):
        if how := same_branch(found, other):
            return none._replace(to=k, how=named(how)), []
    every.append(found)
    return none._replace(to=len(every) - 1, how=NEW), borders


def _words(result: Reached, every: list[Branch]) -> str:
    """What follows an end, in words."""
    if result.to is None:
        return result.how
    symbol = every[result.to].symbol
    return f"it goes on as {symbol}" if result.how == NEW else f"it meets the branch of {symbol}"


def no_motions(branch: Branch) -> str:
    """Reason why a branch of orbits that are no motions of the machine is not one that follows."""
    return f"orbits with the sequence of {branch.symbol} begin there, which are no motions"


def parted(borders: list[Border], point: BifurcationPoint) -> tuple[list[Border], list[str]]:
    """Borders of a branch other than the special point at which it begins, and the labels of that one."""
    near = SAME_PLACE_OF_RANGE * (point.bounds[1] - point.bounds[0])
    others, back = list[Border](), list[str]()
    for border in borders:
        if border.point and abs(border.point.parameter - point.parameter) <= near:
            back.append(border.point.label)
        else:
            others.append(border)
    return others, back


def _with_end(branch: Branch, side: int, what: str) -> Branch:
    """Branch of which one end says what follows."""
    ends = [*branch.curve.ends]
    ends[side] = replace(ends[side], detail=f"{ends[side].detail}; {what}")
    return replace(branch, curve=replace(branch.curve, ends=(ends[0], ends[1])))
