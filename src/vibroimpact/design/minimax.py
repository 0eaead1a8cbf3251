"""The last steps to a minimax: linear programmes of exact gradients, where motions are periodic.

Method      The worst of the measure is the largest of its values f_i at places of the band. Where each
            of the largest is that of a stable periodic orbit, or of a motion without impacts, it has
            an exact gradient g_i by the parameters, and the step d to the least worst is a linear
            programme in a trust region [madsen1975]:
                min t,   f_i + g_i . d <= t,   |d_j| <= r w_j,   low <= p + d <= high             (1)
            with w the widths of the bounds. A step is taken where the objective itself, of all
            members, becomes less; r grows after a good step, and shrinks after others.
Fails       ends where a motion among the worst is not periodic: another method goes on from there
Reference   [madsen1975]
"""

from __future__ import annotations

import math

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.design.objective import Judge, Member
from vibroimpact.design.search import Search
from vibroimpact.measures.linear import FreeMotion, free_motion
from vibroimpact.measures.motions import Motion
from vibroimpact.orbits.find import find_orbit
from vibroimpact.orbits.stability import Stability

NEAR_WORST_RELATIVE = 0.02  # values that are so near to the worst are linearised
LOCAL_MAXIMUM_RELATIVE = 0.2  # local maxima that are so near to the worst are linearised, too
MOST_LINEAR_VALUES = 16  # so many values are linearised at most
FIRST_RADIUS_OF_BOUNDS = 0.02  # the trust region begins with this radius, relative to the bounds
LEAST_RADIUS_OF_BOUNDS = 1e-5  # the method ends at this radius of the trust region
SAME_MEASURE_RELATIVE = 1e-3  # the measures of a simulated motion and of its orbit agree so well


def motion_of(member: Member, judge: Judge) -> Motion | None:
    """The stable periodic motion on which a member is, if it has the same measure."""
    motions: list[Motion] = []
    free = free_motion(member.system)
    if isinstance(free, FreeMotion) and free.stability <= Stability.NEUTRAL:
        motions.append(free)
    for motion in motions:
        if _alike(judge.measure.of_orbit(motion), member.value):
            return motion
    try:
        orbit = find_orbit(member.system, member.state)
    except InvalidParameterError:
        return None
    return orbit if orbit.stable and _alike(judge.measure.of_orbit(orbit), member.value) else None


def _alike(value: float, other: float) -> bool:
    return abs(value - other) <= SAME_MEASURE_RELATIVE * abs(other)


def gradient(member: Member, motion: Motion, judge: Judge) -> Floats:
    """Exact derivatives of the measure of a member by the parameters that vary."""
    return np.array(
        [
            judge.measure.derivative(motion, name) * member.factors.get(name, 1.0)
            for name in judge.names
        ]
    )


def descend(search: Search, budget: int) -> tuple[int, bool]:
    """Steps (1) from the best machine.

    Returns
    -------
    steps
        Number of steps that were tried, at most ``budget``.
    converged
        Whether the trust region became small; else a motion is not periodic, or they were too many.
    """
    judge, radius, tried = search.judge, FIRST_RADIUS_OF_BOUNDS, 0
    width = search.variables.high - search.variables.low
    model = _linear(judge, search.best)
    while tried < budget and radius >= LEAST_RADIUS_OF_BOUNDS:
        if model is None:
            return tried, False
        row, least = search.best, judge.objective.sign * search.best_value
        moved = _step(search, row, model, radius)
        tried += 1
        if float(search(moved[None])[0]) < least:
            longest = float(np.max(np.abs(moved - row) / width))
            radius = max(radius, min(2.0 * longest, 2.0 * radius))
            model = _linear(judge, moved)
        else:
            radius /= 3.0
    return tried, radius < LEAST_RADIUS_OF_BOUNDS


def _linear(judge: Judge, row: Floats) -> tuple[Floats, Floats] | None:
    """Values and gradients of the worst motions, less being better; None where one is not periodic."""
    values, gradients = [], []
    for member in _largest(judge, row):
        motion = motion_of(member, judge)
        if motion is None:
            return None
        values.append(judge.objective.sign * member.value)
        gradients.append(judge.objective.sign * gradient(member, motion, judge))
    table = np.array(gradients)
    return (np.array(values), table) if np.isfinite(table).all() else None


def _largest(judge: Judge, row: Floats) -> list[Member]:
    """The worst members along the band: those near the worst of all, and local maxima."""
    each = judge.worst_each(row)
    signed = np.array([[judge.objective.sign * one.value for one in corner] for corner in each])
    signed[np.isnan(signed)] = -math.inf
    top = float(signed.max())
    beside = np.pad(signed, ((0, 0), (1, 1)), constant_values=-math.inf)
    local = (signed >= beside[:, :-2]) & (signed >= beside[:, 2:])
    chosen = (signed >= top - NEAR_WORST_RELATIVE * abs(top)) | (
        local & (signed >= top - LOCAL_MAXIMUM_RELATIVE * abs(top))
    )
    places = sorted(np.argwhere(chosen).tolist(), key=lambda at: -signed[at[0], at[1]])
    return [each[i][k] for i, k in places[:MOST_LINEAR_VALUES]]


def _step(search: Search, row: Floats, model: tuple[Floats, Floats], radius: float) -> Floats:
    """The programme (1): in units of the widths, and of the worst value."""
    from scipy.optimize import linprog

    low, high = search.variables.low, search.variables.high
    width = high - low
    values, gradients = model
    size = float(np.abs(values).max()) or 1.0
    across = np.column_stack([gradients * width / size, -np.ones(len(values))])
    ends = [
        (max(-radius, a), min(radius, b))
        for a, b in zip((low - row) / width, (high - row) / width, strict=True)
    ]
    found = linprog(
        np.append(np.zeros(len(row)), 1.0), across, -values / size, bounds=[*ends, (None, None)]
    )
    step = found.x[:-1] if found.success else np.zeros(len(row))
    return np.asarray(np.clip(row + width * step, low, high))
