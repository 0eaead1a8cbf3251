"""Sweep of a parameter along an attractor: every step starts from the last state of the former."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core import linear
from vibroimpact._core.checks import check_choice, check_count, check_kind, vector
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop, StopName
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.sections import Section, check_stop, impact_section

SystemOf = Callable[[float], System]


class Step(NamedTuple):
    """Value of the parameter, section at this value, and last state, the start of the next step."""

    value: float
    section: Section
    last: State


def sweep_attractor(
    system: System | SystemOf,
    parameter: str | None,
    values: Iterable[float],
    state: State,
    *,
    settle: int = 1000,
    keep: int = 500,
    stop: StopName = "A",
    contact: int = 0,
) -> list[Step]:
    """Follow an attractor along values of a parameter, in the given order.

    Parameters
    ----------
    system, parameter
        A frozen dataclass and the name of the field to vary, as ``sweep_attractor(damper, "omega", ...)``;
        or a function from the value to the system, and None.
    values
        The values, in order: going down and going up may end on different attractors.
    state
        Start at the first value.
    settle
        Impacts (at all stops) discarded at every value.
    keep
        Section points kept at every value, >= 1.
    stop, contact
        The section, as in :func:`~vibroimpact.impact_section`.

    Returns
    -------
    list of Step
        (value, section, last state). A motion that stops impacting has a short section, with
        the reason in ``section.end``; the next value then starts from the same state.

    Raises
    ------
    InvalidParameterError
        No such field or stop, a value out of its range, a bad start.

    Notes
    -----
    A state behind or on the section's stop is placed on the stop of the next system: the
    positions move along M^-1 row, which keeps the momentum-weighted mean of the positions. When
    the stop has not moved, nothing changes, bit for bit. The cost is that of ``settle`` impacts
    and ``keep`` section points per value. Near a bifurcation motions settle slowly, and a step in
    the parameter may leave a narrow basin: compare with half the step and twice ``settle``.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> steps = sweep_attractor(damper, "omega", [1.2, 1.19], vi.State((0.0, 0.0), (0.0, 1.0)), keep=3)
    >>> [len(step.section) for step in steps]
    [3, 3]
    """
    check_count("settle", settle, 0)
    check_count("keep", keep, 1)
    check_kind("state", state, State, "a State")
    make = _maker(system, parameter)
    steps: list[Step] = []
    on_stop = False
    whole = isinstance(values, np.ndarray) or not isinstance(values, Iterable)
    for value in vector("values", cast(ArrayLike, values if whole else list(values))):
        here = make(value)
        check_stop(here, contact, stop)
        state = carried(mechanism_of(here), state, contact, stop, on_stop=on_stop)
        section = impact_section(
            here, state, points=keep, settle=settle, stop=stop, contact=contact
        )
        if len(section):
            state, on_stop = section.last, True
        steps.append(Step(value, section, state))
    return steps


def _maker(system: System | SystemOf, parameter: str | None) -> SystemOf:
    if parameter is None:
        if not callable(system):
            raise InvalidParameterError("parameter = None: give the name of the field to vary.")
        return system
    names = {f.name for f in dataclasses.fields(cast(Any, system))} if _is_record(system) else set()
    check_choice(
        "parameter", parameter, sorted(names),
        "Or give a function from the value to the system, and parameter=None.",
    )  # fmt: skip
    return lambda value: cast(System, dataclasses.replace(cast(Any, system), **{parameter: value}))


def _is_record(system: object) -> bool:
    return dataclasses.is_dataclass(system) and not isinstance(system, type)


def carried(
    mechanism: Mechanism, state: State, contact: int, stop: StopName, *, on_stop: bool
) -> State:
    """Place a state where a system allows it: on its stop, if it was on one.

    Parameters
    ----------
    mechanism
        The next system.
    state
        The state to carry over.
    contact, stop
        The stop of the section.
    on_stop
        Whether the state is on that stop; otherwise it is moved only if it lies behind one.
    """
    if not mechanism.elements[contact].rigid:  # a soft stop keeps no position out
        return state
    law = mechanism.rigid_stops[contact]
    u = float(np.dot(law.row, state.position)) - _moved(mechanism, law, state.phase)
    target = _nearest(law, u)
    if on_stop:
        target = Stop.at(stop, contact).limit(mechanism.rigid_stops)
    if abs(target - u) <= _rounding(law, state):
        return state
    lift = np.array(linear.solve_definite(mechanism.mass, [[x] for x in law.row]))[:, 0]
    shift = (target - u) / float(np.dot(law.row, lift)) * lift
    return State(tuple(np.add(state.position, shift)), state.velocity, state.phase)


def _moved(mechanism: Mechanism, law: RigidStop, phase: float) -> float:
    """How far the stops have moved at this phase of the first line."""
    angles = [(line, phase * (line.omega / mechanism.omega)) for line in law.motion]
    return sum(line.sine[0] * math.sin(a) + line.cosine[0] * math.cos(a) for line, a in angles)


def _nearest(law: RigidStop, u: float) -> float:
    return min(max(u, law.lower), law.upper)


def _rounding(law: RigidStop, state: State) -> float:
    """Bound the rounding of row . position: one ulp of each product and of the stop."""
    terms = sum(abs(r * x) for r, x in zip(law.row, state.position, strict=True))
    limits = sum(abs(x) for x in (law.lower, law.upper) if math.isfinite(x))
    return float(np.finfo(float).eps) * (len(law.row) * terms + limits)
