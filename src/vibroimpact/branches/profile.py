"""Profile of a branch: its orbits and special points in order, and their coordinates by name."""

from __future__ import annotations

import math
import re
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from vibroimpact._core.checks import check_choice
from vibroimpact._core.types import Flags, Floats, Integers
from vibroimpact.branches.branch import Branch
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.orbits.find import mirrored as mirror_of

ONE_PER_ORBIT = ("speed", "clearance", "period")


class Stability(IntEnum):
    """Stability of the orbits of a part of a branch, from stable to inadmissible."""

    STABLE = 0
    UNSTABLE = 1
    INADMISSIBLE = 2


class BranchProfile(NamedTuple):
    """Points and special points of a branch in the order of its arclength.

    Attributes
    ----------
    parameter
        Shape (m,).
    z
        Unknowns, shape (m, d).
    special
        Number of the special point, -1 for others, shape (m,).
    stability
        :class:`Stability` of the stretch from each point to the next, shape (m - 1,).
    """

    parameter: Floats
    z: Floats
    special: Integers
    stability: Integers


def place_of(branch: Branch, point: BifurcationPoint) -> tuple[int, float]:
    """(index of the nearest point of the branch, arclength) of a special point.

    The arclength is that of the projection onto the tangent there, right to second order of the
    distance between points.
    """
    sizes = branch.family.scale()
    points = np.column_stack([branch.curve.z, branch.values]) / sizes
    away = np.append(point.z, point.parameter) / sizes - points
    nearest = int(np.argmin(np.linalg.norm(away, axis=1)))
    tangent = branch.curve.tangent[nearest] / sizes
    step = float(away[nearest] @ tangent) / float(tangent @ tangent)
    return nearest, float(branch.curve.arclength[nearest]) + step


def profile(branch: Branch) -> BranchProfile:
    """Points and special points of a branch in order."""
    found = branch.special_points
    places = [place_of(branch, point)[1] for point in found]
    order = np.argsort(np.concatenate([branch.curve.arclength, places]), kind="stable")
    special = np.concatenate([np.full(len(branch), -1), np.arange(len(found))]).astype(np.int64)
    own = np.where(branch.stable, Stability.STABLE, Stability.UNSTABLE)
    own = np.where(branch.admissible, own, Stability.INADMISSIBLE)
    stability = np.concatenate([own, np.full(len(found), -1)]).astype(np.int64)[order]
    parameter = np.concatenate([branch.values, [p.parameter for p in found]])[order]
    z = np.vstack([branch.curve.z, *(point.z[None] for point in found)])[order]
    moves: Flags = np.any(np.diff(np.column_stack([z, parameter]), axis=0), axis=1)
    return BranchProfile(parameter, z, special[order], _with_short_ends(_between(stability), moves))


def stable_share(branch: Branch) -> float:
    """Share of the extent of a branch in its parameter at which one of its orbits is stable."""
    points = profile(branch)
    stretches = np.sort(np.column_stack([points.parameter[:-1], points.parameter[1:]]), axis=1)
    covered, reached = 0.0, -math.inf
    for low, high in sorted(map(tuple, stretches[points.stability == Stability.STABLE])):
        covered += max(0.0, high - max(low, reached))
        reached = max(reached, high)
    low, high = branch.extent
    return covered / (high - low) if low < high else float(branch.stable.all())


def _between(stability: Integers) -> Integers:
    """Stability between points: the worse of both ends; special points (-1) do not count."""
    first, second = stability[:-1], stability[1:]
    stretches = np.maximum(first, second)
    unknown = np.flatnonzero(stretches < 0)  # between two special points
    known = np.flatnonzero(stability >= 0)
    for i in unknown:
        near = stability[known[np.argmin(np.abs(known - i))]]
        stretches[i] = max(near, Stability.UNSTABLE)
    return stretches


def _with_short_ends(stretches: Integers, moves: Flags) -> Integers:
    """Give parts of no length, to a special point at an end, the stability of their neighbours."""
    beside = np.where(np.arange(len(stretches)) > 0, -1, 1) + np.arange(len(stretches))
    return np.where(moves, stretches, stretches[np.minimum(beside, len(stretches) - 1)])


def impacts_at(branch: Branch, stop: tuple[int, int]) -> list[int]:
    """Numbers of the impacts of a period that are at a stop (contact, side)."""
    return [k for k, impact in enumerate(branch.family.signature.impacts) if impact == stop]


def coordinate(branch: Branch, points: BranchProfile, name: str, impact: int = 0) -> Floats:
    """Coordinate of the orbits along a branch.

    Parameters
    ----------
    branch, points
        The branch, and :func:`profile` of it.
    name
        "x1", "x2", ... and "v1", "v2", ...: places and velocities just after an impact; "phase"
        in [0, 2 pi) there; "speed": smallest closing speed of an impact; "clearance": least gap
        between the impacts; "period".
    impact
        Number of the impact in the period.

    Raises
    ------
    InvalidParameterError
        No such coordinate.
    """
    degrees = branch.family.mechanism.degrees
    every = [f"{kind}{i + 1}" for kind in "xv" for i in range(degrees)]
    check_choice("variable", name, [*every, "phase", *ONE_PER_ORBIT])
    if numbered := re.fullmatch(r"([xv])(\d+)", name):
        column = int(numbered[2]) - 1 + (degrees if numbered[1] == "v" else 0)
        return _state(branch, points, impact)[:, column]
    if name == "phase":
        phase: Floats = _state(branch, points, impact)[:, -1] % (2.0 * math.pi)
        return phase
    if name == "period":
        turns = 2.0 if branch.family.signature.symmetric else 1.0
        return turns * np.array([branch.family.unpacked(z)[1].sum() for z in points.z])
    return _of_orbits(branch, points, name)


def mirrored(values: Floats, name: str) -> Floats:
    """Coordinate of the mirror image after the opposite impact, from that after an impact."""
    return (values + math.pi) % (2.0 * math.pi) if name == "phase" else -values


def _state(branch: Branch, points: BranchProfile, impact: int) -> Floats:
    """State (x, v, theta) after an impact; for the second half of symmetric orbits, mirrored."""
    signature = branch.family.signature
    solved = len(branch.family.impacts)
    states = np.array([
        branch.family.states_at(z, float(p))[impact % solved]
        for z, p in zip(points.z, points.parameter, strict=True)
    ])  # fmt: skip
    second = signature.symmetric and impact >= solved
    return mirror_of(states, math.pi * signature.cycles) if second else states


def _of_orbits(branch: Branch, points: BranchProfile, name: str) -> Floats:
    own = {"speed": branch.impact_speed, "clearance": branch.clearance}[name]
    orbits = [point.orbit for point in branch.special_points]
    theirs = {
        "speed": [orbit.least_impact_speed for orbit in orbits],
        "clearance": [orbit.clearance_to_grazing for orbit in orbits],
    }[name]
    values = np.empty(len(points.parameter))
    values[points.special < 0] = own
    at = points.special >= 0
    values[at] = np.array(theirs)[points.special[at]] if at.any() else []
    return values
