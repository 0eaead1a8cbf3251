"""Curves of bifurcations that begin at points of codimension two.

Method      which curves begin is said by the normal form (normal_forms/codimension_two.py). Their orbits are found at
            a small distance from the point, for
            R2, R3, R4     from the normal form (starting_orbits.py)
            GPD, LPPD, PDNS as SN or NS of the doubled orbit of a small amplitude
            GR, ZERO       what grazing_contact.py says: the curve of the touch itself; with one degree of freedom the
            other one of SN and PD; on PD also the touch of the doubled orbits, tangent to PD because their amplitude
            vanishes at the point as the gap does, found beside PD too; a curve of the same kind of the orbits with
            one impact more or fewer only if these are critical too
            and then followed like any other curve (emanating.py). It begins at the point if Newton's method moved its
            start by less than half of its distance |z - z_0|, and if it leads back to half that distance, the
            parameters being nearer there, too                                                               (1)
            Otherwise the next smaller distance is tried.
            R1 and curves of the same orbit through the point: continue_bifurcation with the other kind.
Assumes     what the normal form assumes
Fails       ``NotFound`` with a sentence
Reference   Kuznetsov, Elements of Applied Bifurcation Theory, chapter 9
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.linalg import LinAlgError

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact.bifurcations.augmented import Augmented, Both, is_inside
from vibroimpact.bifurcations.continue_bifurcation import (
    Start,
    continue_bifurcation,
    followed,
)
from vibroimpact.bifurcations.curve import BifurcationCurve
from vibroimpact.bifurcations.emanating import (
    NEAR_BEGINNING,
    checked_bounds,
    emanating,
    width_of,
)
from vibroimpact.bifurcations.equations import Solution
from vibroimpact.bifurcations.grazing_contact import GrazingContact, beside, neighbour, touching
from vibroimpact.bifurcations.starting_orbits import Born, doubled_touch, run_through, solution_at
from vibroimpact.bifurcations.tests_along import on_multipliers
from vibroimpact.branches.kinds import ONE
from vibroimpact.branches.point import BifurcationPoint, NotFound, check_point
from vibroimpact.continuation import Steps, Stopped
from vibroimpact.continuation.walk import check_steps
from vibroimpact.normal_forms.critical import Refusal
from vibroimpact.normal_forms.kind import PointKind
from vibroimpact.normal_forms.special_points import NewCurve

# Distances of a start from the point are tried in this order.
START_DISTANCES = tuple(0.01 * 0.4**k for k in range(10))
# A start that was predicted is moved by no larger share of its distance from the point.
CORRECTION_SHARE = 0.5
TO_THE_POINT = Steps(first=0.02, largest=0.5, points=200)

Starts = Callable[[float], Iterable[Born]]  # of a curve, at a distance


class Options(NamedTuple):
    """Options with which curves are followed."""

    bounds: Both
    steps: Steps | None
    report: Reporter


@interruptible
def switch_curve(
    point: BifurcationPoint,
    bounds: Both | None = None,
    *,
    steps: Steps | None = None,
    progress: ProgressOption = True,
) -> tuple[BifurcationCurve | NotFound, ...] | NotFound:
    """Follow the curves of bifurcations that begin at a point of codimension two.

    Parameters
    ----------
    point
        A special point of a curve at which curves begin: where its ``normal_form.switchable`` names them.
    bounds
        ((low, high), (low, high)) of both parameters; by default those of the curve.
    steps, progress
        As for :func:`~vibroimpact.continue_bifurcation`.

    Returns
    -------
    tuple of BifurcationCurve, or NotFound
        One curve, both folds of period four at R4, at GR and ZERO first the curve of the touch; a :class:`NotFound`
        in the place of one that was not found. Without any, a :class:`NotFound` that states why theory has none, or
        why none was found.

    Raises
    ------
    InvalidParameterError
        Not a point of a curve; bounds that are empty or without the point.

    Notes
    -----
    Starts are looked for at distances from the point that shrink, measured by multipliers or by the size of the orbit,
    and a curve is returned only if it leads back to the point. The bounds limit where it is followed; how wide they
    are, 1e-3 or 1e3 times the part of the plane in which the normal form holds, does not decide what is found.

    Curves of the same orbit through the point, as PD through R2, are followed by
    ``continue_bifurcation(point, names, bounds, kind="PD")``. At GR and ZERO ``point.normal_form`` says how the curves
    meet, on which sides the orbits with one impact more or fewer are motions, and in ``why_not`` why these have no
    curve of the same kind there.
    """
    check_point(point, Augmented, "a special point of a curve")
    check_steps(steps, progress)
    inside = checked_bounds(point, bounds)
    form = point.normal_form
    if isinstance(form, Refusal):
        return NotFound(point, form.reason)
    if not form.switchable:
        return NotFound(point, form.why_not)
    with Reporter(progress, f"curves from {point.label}") as report:
        found = tuple(_until_interrupted(_curves(point, form, Options(inside, steps, report))))
    missing = [curve for curve in found if isinstance(curve, NotFound)]
    return found if len(missing) < len(found) else missing[0]


def _until_interrupted(
    curves: Iterable[BifurcationCurve | NotFound],
) -> Iterator[BifurcationCurve | NotFound]:
    """Curves up to the first that was interrupted, whose ends say so."""
    for one in curves:
        yield one
        if isinstance(one, BifurcationCurve) and one.curve.interrupted:
            return


def _curves(
    point: BifurcationPoint, form: Any, options: Options
) -> Iterator[BifurcationCurve | NotFound]:
    """The curves that the normal form announces; for each that is not found the reason."""
    for k, new in enumerate(form.switchable):
        if isinstance(form, GrazingContact):
            yield _at_touch(point, new, options, is_own=k == 0)
        elif point.record.begins is None:
            others = (kind for kind in point.record.curves if kind != point.curve)
            yield _of_same_orbit(point, next(others).label, options)
        else:
            yield _beginning(point, new, options, _starts(point, k, options.bounds))


def _of_same_orbit(
    point: BifurcationPoint, kind: str, options: Options
) -> BifurcationCurve | NotFound:
    bounds, steps, report = options
    names = point.problem.equations.names
    try:
        return continue_bifurcation(
            point, names, bounds, kind=kind, steps=steps,
            progress=lambda told: report.say(told.text, told.done),
        )  # fmt: skip
    except InvalidParameterError as error:
        return NotFound(point, f"the curve of {kind} could not be followed: {error}")


# ---- curves of orbits of a multiple period -------------------------------------------------------


def _starts(point: BifurcationPoint, k: int, bounds: Both) -> Starts:
    """Starts of the curve number k at a distance."""
    assert point.record.begins is not None
    return partial(point.record.begins, point, k, bounds)


def _beginning(
    point: BifurcationPoint, new: NewCurve, options: Options, starts: Starts
) -> BifurcationCurve | NotFound:
    """The first curve that begins at the point (1)."""
    origin, refused = solution_at(point), Counter[str]()
    for size in START_DISTANCES:
        for born in _without_failure(starts, size, refused):
            curve = _leading_back(origin, ONE[new.kind], born, options)
            if isinstance(curve, BifurcationCurve):
                return curve
            refused[curve] += 1
    return _nothing(point, new, refused)


def _without_failure(starts: Starts, size: float, refused: Counter[str]) -> Iterator[Born]:
    """Starts at a distance; where they cannot be computed the reason is counted."""
    found = False
    try:
        for born in starts(size):
            found = True
            yield born
    except (InvalidParameterError, LinAlgError):
        refused["the equations of a start have no regular solution"] += 1
    else:
        if not found:
            refused["there is no start within the bounds"] += 1


def _nothing(point: BifurcationPoint, new: NewCurve, refused: Counter[str]) -> NotFound:
    why = "; ".join(f"{reason} ({times} times)" for reason, times in refused.most_common())
    within = f"at distances from {START_DISTANCES[0]:g} to {START_DISTANCES[-1]:.1g}"
    return NotFound(point, f"no curve of {new} that begins at the point was found {within}: {why}")


def _leading_back(
    origin: Solution, kind: PointKind, born: Born, options: Options
) -> BifurcationCurve | str:
    """The curve through a start, or why it is none that begins at the point (1)."""
    bounds, steps, report = options
    try:
        curve = emanating(
            kind, origin, born, bounds, steps, report.counted("points", origin.equations.names[1])
        )
        if curve.curve.interrupted:
            return curve
        if not all(is_inside(a, bounds) for a in curve.values.tolist()):
            return "the curve near the start lies outside the bounds"
        start, moved = _start_of(curve, origin, born.solution)
        if moved > CORRECTION_SHARE:
            return "Newton's method leads away from the start"
        if born.condition or _ends_near(curve, origin, start):  # a touch is followed away only
            return curve
        if any(end.reason is Stopped.POINTS for end in curve.ends):
            back = emanating(kind, origin, born, bounds, TO_THE_POINT, None)
            if _ends_near(back, origin, _start_of(back, origin, born.solution)[0]):
                return curve
    except (InvalidParameterError, LinAlgError):
        return "Newton's method does not converge from the start"
    return "the curve through the start does not lead to the point"


def _start_of(curve: BifurcationCurve, origin: Solution, born: Solution) -> tuple[int, float]:
    """Number of the point next to the predicted start, and its distance relative to that of the start."""
    d, sizes = len(born.z), born.equations.sizes
    middle = run_through(origin, born.z)
    moved = np.abs((curve.curve.z[:, :d] - born.z) / sizes).max(axis=1)
    start = int(np.argmin(moved))
    return start, float(moved[start] / np.abs((born.z - middle) / sizes).max())


def _ends_near(curve: BifurcationCurve, origin: Solution, start: int) -> bool:
    """Whether a curve ends near the point, where its parameters are nearer than at the start, too."""
    widths = [width_of(pair) for pair in curve.bounds]
    away = np.abs((curve.values - origin.a) / widths).max(axis=1)
    both = zip((0, -1), curve.ends, strict=True)
    return any(end.detail == NEAR_BEGINNING and away[k] < away[start] for k, end in both)


# ---- GR and ZERO ---------------------------------------------------------------------------------


def _at_touch(
    point: BifurcationPoint, new: NewCurve, options: Options, is_own: bool
) -> BifurcationCurve | NotFound:
    """A curve that begins where an orbit of a curve touches a stop."""
    if is_own:
        return _of_same_orbit(point, new.kind, options)
    if new.period == 2:
        return _beginning(point, new, options, partial(doubled_touch, point))
    bounds, steps, report = options
    try:
        start = _beside_touch(point, ONE[new.kind])
        return followed(
            start, bounds, steps=steps, progress=report.counted("points", start.equations.names[1])
        )
    except (InvalidParameterError, LinAlgError) as error:
        return NotFound(point, f"the curve of {new} could not be followed: {error}")


def _beside_touch(point: BifurcationPoint, kind: PointKind) -> Start:
    """Start of the other one of SN and PD, or of the same kind of orbits with one impact more or fewer."""
    here = touching(point)
    if point.curve and kind.label == point.curve.label:
        kind = point.curve
        other = neighbour(here)
        assert other is not None
        condition, tests = on_multipliers(kind, other.plane)
        return Start(kind, other.plane, condition, tests, other.z, other.a)
    kind = kind.of_map(symmetric=point.orbit.symmetric)
    condition, tests = on_multipliers(kind, here.plane)
    return Start(kind, here.plane, condition, tests, *beside(here, condition))
