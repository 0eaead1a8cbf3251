"""Pseudo-arclength continuation of solutions of F(z, p) = 0, with all special points."""

from __future__ import annotations

from vibroimpact.continuation.continue_curve import continue_curve
from vibroimpact.continuation.curve import Curve, End, LocatedPoint, Stopped, Unresolved
from vibroimpact.continuation.problem import Problem
from vibroimpact.continuation.switching import Switch, switch
from vibroimpact.continuation.walk import Steps

__all__ = [
    "Curve",
    "End",
    "LocatedPoint",
    "Problem",
    "Steps",
    "Stopped",
    "Switch",
    "Unresolved",
    "continue_curve",
    "switch",
]
