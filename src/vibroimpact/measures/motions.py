"""Flights of orbits, of motions without impacts and of simulated runs, to be measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vibroimpact._core.checks import refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.pencils import solved
from vibroimpact._core.types import Floats, Integers
from vibroimpact.compile.prescribed import GAP_WATCH, Prescribed, compile_prescribed
from vibroimpact.measures.flights import Flights, Rows, Struck, rows_of
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


def flights_along(problem: OrbitProblem, values: Floats, z: Floats, moved: Floats) -> Flights:
    """Flights of periodic orbits of one signature along a parameter, with derivatives by it.

    Parameters
    ----------
    problem
        The equations of the orbits.
    values
        Values of the parameter, shape (k,).
    z, moved
        Unknowns of each orbit, shape (k, d), and their derivatives.
    """
    rows = Rows(problem.system, problem.parameter, values)
    orbits = [
        _Whole(problem.compiled(float(p)), *problem.unpacked(one), *problem.unpacked(by))
        for p, one, by in zip(values, z, moved, strict=True)
    ]
    return _joined(problem, rows, orbits, 1.0)


def _of_orbit(orbit: Orbit, parameter: str) -> Flights:
    states, durations = orbit.states, orbit.durations
    still = np.zeros_like(states), np.zeros_like(durations)
    by = _variation(orbit, parameter) if parameter else still
    compiled = orbit.problem.own
    if parameter not in ("", orbit.parameter):
        compiled = compile_prescribed(orbit.system, parameter, orbit.problem.codes)
    whole = _Whole(compiled, states, durations, *by)
    return _joined(orbit.problem, rows_of(orbit.system, parameter), [whole], float(bool(parameter)))


class _Whole(NamedTuple):
    """Segments of an orbit and their derivatives."""

    compiled: Prescribed
    states: Floats
    durations: Floats
    states_by: Floats
    durations_by: Floats


def _joined(problem: OrbitProblem, rows: Rows, orbits: Sequence[_Whole], by: float) -> Flights:
    """Flights of orbits of the same signature, those of each one after the other; ``by`` is the derivative of p."""
    signature, symmetry = problem.signature, problem.symmetry
    hits = np.roll(impacting(problem.mechanism, signature), -1)
    stops = [*signature.impacts[1:], signature.impacts[0]]
    parts, codes, numbers, struck, of = [], list[int](), list[Integers](), list[Stop](), list[int]()
    for number, one in enumerate(orbits):
        states, durations, ends, states_by, durations_by, whole, _, chatters = (
            one.compiled.explicit(
                one.states, one.durations, signature.ends, (one.states_by, one.durations_by, by)
            )
        )
        within = chatters & [end.watch == GAP_WATCH for end in ends]
        modes = [end.mode for end in ends]
        if symmetry:
            states = np.vstack([states, symmetry.image(states, math.pi * signature.cycles)])
            states_by = np.vstack([states_by, symmetry.change(states_by)])
            durations, durations_by = np.tile(durations, 2), np.tile(durations_by, 2)
            modes *= 2
            whole, within = np.arange(len(durations)), np.tile(within, 2)
        met = np.flatnonzero(hits[whole] | within)
        struck += [stops[whole[k]] for k in met]
        numbers.append(len(codes) + met)
        parts.append((states, durations, states_by, durations_by))
        codes += modes
        of += [number] * len(modes)
    states, durations, states_by, durations_by = (
        np.concatenate(part) for part in zip(*parts, strict=True)
    )
    hit = Struck(np.concatenate(numbers), struck)
    return Flights(
        rows, states, durations, tuple(codes), hit, states_by, durations_by, np.array(of)
    )


def _variation(orbit: Orbit, parameter: str) -> tuple[Floats, Floats]:
    """Derivatives of states and flight times along the branch, by the implicit function theorem."""
    problem = orbit.problem
    if orbit.parameter != parameter:
        problem = OrbitProblem(orbit.system, orbit.signature, parameter)
    z = problem.packed(orbit.states, orbit.durations)
    by_z, by_parameter = problem.jacobian(z, parameter_value(orbit.system, parameter))
    sizes = scale_of(problem, z)
    rows = sizes_of_rows(problem, sizes)
    moved: Floats = solved(by_z / rows[:, None] * sizes, -by_parameter / rows) * sizes
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
    still = np.zeros_like(states), np.zeros_like(durations), np.zeros(len(kept), dtype=np.int64)
    return Flights(rows, states, durations, codes, struck, *still, periodic=False)
