"""Coordinates of the orbits along a branch, by name."""

from __future__ import annotations

import math
import re

import numpy as np

from vibroimpact._core.checks import check_choice
from vibroimpact._core.types import Floats
from vibroimpact.branches.branch import Branch, BranchProfile

ONE_PER_ORBIT = ("speed", "clearance", "period")


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
    symmetry = branch.family.symmetry
    second = symmetry is not None and impact >= solved
    return symmetry.image(states, math.pi * signature.cycles) if symmetry and second else states


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
