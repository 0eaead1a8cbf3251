"""Derivatives of impact maps, exact through every event.

Jets run through the kernel's own flight, impact, chatter and release (theory.md, "Saltation"): the
result is the derivative of the map from the start to the state after the last event, or at t_max.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vibroimpact._core.checks import numbers
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import announce_measured, interruptible
from vibroimpact._core.types import Amount, Count, Floats
from vibroimpact.compile.hybrid import compile_mechanism
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import (
    RunEnd,
    begin,
    check_counts,
    events_for,
    flight_limit_of,
    phases_of,
)


@dataclass(frozen=True, eq=False)
class MapDerivative:
    """Derivative of the map from a start to the state after its last event, or at ``t_max``.

    Attributes
    ----------
    matrix
        d(x, v, theta_1, ...) at the end / d(x, v, theta_1, ...) before, shape (2n + L, columns).
    duration
        Derivative of the time of the end, shape (columns,): of the last event; zero at ``t_max``.
    events
        Number of events passed.
    end
        Why the run ended.
    """

    matrix: Floats = field(repr=False)
    duration: Amount = field(repr=False)
    events: Count
    end: RunEnd


@interruptible
def map_derivative(
    system: System,
    start: State,
    *,
    impacts: int = 1,
    t_max: float = math.inf,
    directions: Floats | None = None,
) -> MapDerivative:
    """Differentiate the motion from a state through a number of impacts, or up to a time.

    Parameters
    ----------
    system, start, impacts, t_max
        As for :func:`vibroimpact.simulate`. Where ``t_max`` ends the run, the derivative is that of
        the state at this time, however the events before it move.
    directions
        Columns of (dx, dv, dtheta_1, ...), shape (2n + L, columns); default: unit vectors. A
        direction that leaves the stop of a start is taken as it is: keep it on the stop, where
        the map is meant between impacts.

    Returns
    -------
    MapDerivative
        After chatter or sticking the matrix has lost rank.

    Raises
    ------
    InvalidParameterError
        As :func:`vibroimpact.simulate`, or directions of another shape.

    Notes
    -----
    Cost: that of simulating, times about 7 for every six directions.
    """
    check_counts(impacts, t_max)
    mechanism = mechanism_of(system)
    compiled = compile_mechanism(mechanism, start, t_max)
    begin(compiled, start)  # refuses the same states as simulate
    rows = 2 * mechanism.degrees + len(mechanism.forces)
    seeds = np.eye(rows) if directions is None else numbers("directions", directions)
    if seeds.ndim != 2 or seeds.shape[0] != rows:
        raise InvalidParameterError(
            f"directions has shape {seeds.shape}; expected ({rows}, columns)."
        )

    def derivative(impacts: int) -> Any:
        return compiled.kernel.tangents(
            list(start.position), list(start.velocity), phases_of(mechanism, start.phase),
            np.ascontiguousarray(seeds), t_max, flight_limit_of(compiled),
            events_for(mechanism, impacts), impacts,
        )  # fmt: skip

    announce_measured("impacts", int(impacts), derivative)
    while True:
        out = derivative(int(impacts))
        end = RunEnd(out["why"])
        if end is not RunEnd.MISSING or not compiled.add_code(out["code"]):
            return MapDerivative(out["columns"], out["durations"], out["events"], end)
