"""Flights of orbits, of motions without impacts and of simulated runs, to be measured."""

from __future__ import annotations

import contextlib
import math

import numpy as np

from vibroimpact._core.checks import refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.compile.prescribed import GAP_WATCH, compile_prescribed
from vibroimpact.measures.flights import Flights, Struck, rows_of
from vibroimpact.measures.linear import FreeMotion
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.stop import Stop
from vibroimpact.orbits.newton import rows_of as sizes_of_rows
from vibroimpact.orbits.newton import scale_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import OrbitProblem, impacting
from vibroimpact.simulation.simulate import Run, Status

Motion = Orbit | FreeMotion

MET = (Status.IMPACT, Status.SIMULTANEOUS, Status.ENGAGE)


def flights_of(motion: Motion, parameter: str = "") -> Flights:
    """Flights of a periodic motion over its whole period, with derivatives by a parameter.

    Raises
    ------
    InvalidParameterError
        What is no periodic motion, or one that is not converged.
    """
    if isinstance(motion, FreeMotion):
        return motion.flights(parameter)
    if not isinstance(motion, Orbit):
        raise refusal("orbit", motion, "an Orbit, or a motion without impacts")
    if not motion.converged:
        raise InvalidParameterError(f"orbit: must be converged, and is not: {motion.status}.")
    return _of_orbit(motion, parameter)


def _of_orbit(orbit: Orbit, parameter: str) -> Flights:
    states, durations = orbit.states, orbit.durations
    states_by, durations_by = np.zeros_like(states), np.zeros_like(durations)
    if parameter:
        states_by, durations_by = _variation(orbit, parameter)
    signature = orbit.signature
    compiled = orbit.problem.own
    if parameter not in ("", orbit.parameter):
        compiled = compile_prescribed(orbit.system, parameter, orbit.problem.codes)
    by = states_by, durations_by, float(bool(parameter))
    parts = compiled.explicit(states, durations, signature.ends, by)
    states, durations, ends, states_by, durations_by, whole, _, chatters = parts
    codes = tuple(end.mode for end in ends)
    within = chatters & [end.watch == GAP_WATCH for end in ends]
    if symmetry := orbit.problem.symmetry:
        states = np.vstack([states, symmetry.image(states, math.pi * signature.cycles)])
        states_by = np.vstack([states_by, symmetry.change(states_by)])
        durations, durations_by = np.tile(durations, 2), np.tile(durations_by, 2)
        codes *= 2
        whole, within = np.arange(len(durations)), np.tile(within, 2)
    met = np.roll(impacting(orbit.mechanism, signature), -1)[whole] | within
    stops = [*signature.impacts[1:], signature.impacts[0]]
    numbers = np.flatnonzero(met)
    struck = Struck(numbers, [stops[whole[k]] for k in numbers])
    rows = rows_of(orbit.system, parameter)
    return Flights(rows, states, durations, codes, struck, states_by, durations_by)


def _variation(orbit: Orbit, parameter: str) -> tuple[Floats, Floats]:
    """Derivatives of states and flight times along the branch, by the implicit function theorem."""
    problem = orbit.problem
    if orbit.parameter != parameter:
        problem = OrbitProblem(orbit.system, orbit.signature, parameter)
    z = problem.packed(orbit.states, orbit.durations)
    _, by_z, by_parameter = problem.expanded(z, parameter_value(orbit.system, parameter))
    sizes = scale_of(problem, z)
    rows = sizes_of_rows(problem, sizes)
    moved: Floats = np.full(len(z), math.nan)
    with contextlib.suppress(np.linalg.LinAlgError):  # a fold to the last bit
        moved = np.linalg.solve(by_z / rows[:, None] * sizes, -by_parameter / rows) * sizes
    return problem.unpacked(moved)


def flights_of_run(run: Run, span: float) -> Flights:
    """Flights of a simulated motion from its start to a time that it has reached."""
    rows = rows_of(run.system)
    m = rows.mechanism
    starts = np.concatenate([[0.0], run.time])
    kept = np.flatnonzero(np.diff(np.append(np.minimum(starts, span), span)) > 0.0)
    durations = np.diff(np.append(np.minimum(starts, span), span))[kept]
    first = np.append(np.array([*run.start.position, *run.start.velocity]), run.start.phase)
    phases = run.start.phase + m.omega * run.time
    later = np.column_stack([run.position, run.velocity_after, phases])
    states = np.vstack([first[None], later])[kept]
    every = run.all_codes
    codes = tuple(every[k] for k in kept)
    ends = [k for k in range(len(kept)) if kept[k] < len(run) and run.time[kept[k]] <= span]
    met = [k for k in ends if run.status[kept[k]] in MET]
    stops = [Stop(int(run.contact[kept[k]]), int(run.side[kept[k]])) for k in met]
    struck = Struck(np.array(met, dtype=int), stops)
    still = np.zeros_like(states), np.zeros_like(durations)
    return Flights(rows, states, durations, codes, struck, *still, periodic=False)
