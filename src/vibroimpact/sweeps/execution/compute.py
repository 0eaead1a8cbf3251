"""The work on one tile: compile its systems, run its members, observe.

Method      systems of the tile x starts are the members; along a followed axis one value after the
            other, each member starting where it ended at the value before                      (1)
            a followed state that has come to lie behind a stop, because the stop moved, is placed
            on it by x += k M^-1 r, r the row of the contact: no body moves that the stop does not
            push                                                                                (2)
Assumes     the window is settle + observe times 2 pi / omega, omega of the first forcing line;
            without forcing it is in units of time
Accuracy    that of the kernel; the same bits in any tile
Fails       what ends a member before its window is over is in ``end``; a followed motion that is
            told to stop does so after a value, with CancelledError
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core import linear
from vibroimpact._core.types import Arrays, Rows
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.state import State
from vibroimpact.model.system import mechanism_of
from vibroimpact.sweeps.execution.batch import Batch, Members, batch_of, run_members
from vibroimpact.sweeps.execution.tiles import Tile
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.final import Final
from vibroimpact.sweeps.plan import Plan
from vibroimpact.sweeps.starts import States

Done = tuple[Tile, Arrays]


def _never() -> bool:
    return False


class _Work(NamedTuple):
    """A plan with its systems compiled, and whether it is to stop."""

    plan: Plan
    batch: Batch
    stopped: Callable[[], bool] = _never


def compute(plan: Plan) -> Arrays:
    """Run every member of a plan.

    Parameters
    ----------
    plan
        A sweep, or a tile of one.

    Returns
    -------
    dict
        By name of a variable; the leading dimensions are those of the grid.
    """
    return compute_with(plan, batch_of(plan.system, columns_of(plan)))


def columns_of(plan: Plan) -> dict[str, NDArray[np.float64]]:
    """Parameters of every system of a plan, shape (S,)."""
    mesh = np.meshgrid(*plan.axes.values(), indexing="ij")
    return {name: part.ravel() for name, part in zip(plan.axes, mesh, strict=True)}


def compute_with(plan: Plan, batch: Batch, stopped: Callable[[], bool] = _never) -> Arrays:
    """Run every member of a plan whose systems are compiled already."""
    work = _Work(plan, batch, stopped)
    if plan.followed is None:
        return _in_grid(_run(work, *_members(work, _systems(plan).ravel())), plan.shape)
    axis = plan.followed
    moved = (plan.shape[axis], *plan.shape[:axis], *plan.shape[axis + 1 :])
    along = _stacked(_follow(work, axis), plan.order)
    return {name: np.moveaxis(x, 0, axis) for name, x in _in_grid(along, moved, lead=2).items()}


def _systems(plan: Plan) -> Rows:
    """Numbers of the systems in the grid of the parameters."""
    sizes = [axis.size for axis in plan.axes.values()]
    return np.arange(math.prod(sizes)).reshape(sizes)


def _members(work: _Work, systems: Rows) -> tuple[Rows, States]:
    """Each of these systems from every start: system and state of each member."""
    starts = work.plan.starts.states()
    count = len(starts.phase)
    rows = np.tile(np.arange(count), len(systems))
    return np.repeat(systems, count), starts.of(rows)


def _run(work: _Work, systems: Rows, states: States) -> Arrays:
    """Run members; for a followed motion also to their final states."""
    window, omega = work.plan.window, work.batch.omega[systems]
    unit = np.divide(2.0 * math.pi, omega, out=np.ones_like(omega), where=omega > 0.0)
    observers = work.plan.observers
    if work.plan.follow and Final() not in observers:
        observers = (*observers, Final())
    members = Members(
        system=systems.astype(np.int32),
        position=states.position,
        velocity=states.velocity,
        phase=states.phase,
        settle=window.settle_periods * unit,
        observe=window.periods * unit,
        most_impacts=window.most_impacts,
    )
    return run_members(work.batch, members, observers)


def _in_grid(arrays: Arrays, shape: tuple[int, ...], lead: int = 1) -> Arrays:
    """Replace the leading dimensions by those of the grid."""
    return {name: x.reshape(*shape, *x.shape[lead:]) for name, x in arrays.items()}


# ---- following (1) -------------------------------------------------------------------------------


def _follow(work: _Work, axis: int) -> Iterator[Arrays]:
    """Results at every value of the followed axis, in the order of the motion."""
    along = np.moveaxis(_systems(work.plan), axis, 0)
    along = along.reshape(len(along), -1)
    _, states = _members(work, along[0])
    count = len(states.phase) // along.shape[1]
    begun = np.zeros(len(states.phase), dtype=bool)
    for i in work.plan.order:
        if work.stopped():
            raise CancelledError
        systems = np.repeat(along[i], count)
        out = _run(work, systems, states)
        behind = np.flatnonzero(begun & (out["end"] == MemberStatus.INITIAL_PENETRATION))
        if behind.size:
            states = _placed(work, systems, states, behind)
            again = _run(work, systems[behind], states.of(behind))
            for name, values in again.items():
                out[name][behind] = values
        begun |= _ran(out)
        yield out
        states = _next(work, systems, states, out)


def _stacked(parts: Iterator[Arrays], order: Rows) -> Arrays:
    """Results in the order of the axis."""
    listed = list(parts)
    back = np.argsort(order)
    return {name: np.stack([listed[i][name] for i in back]) for name in listed[0]}


def _placed(work: _Work, systems: Rows, states: States, behind: Rows) -> States:
    """Put states that lie behind a stop on it (2)."""
    position = states.position.copy()
    for i in behind:
        values = {name: float(column[systems[i]]) for name, column in work.batch.values.items()}
        mechanism = mechanism_of(with_parameters(work.plan.system, values))
        position[i] = placed(mechanism, states.state(i)).position
    return states._replace(position=position)


def placed(mechanism: Mechanism, state: State) -> State:
    """A state on the stops that it lies behind (2), one contact after the other; others as they are."""
    for law in mechanism.rigid_stops:
        u = float(np.dot(law.row, state.position)) - _moved(mechanism, law, state.phase)
        target = min(max(u, law.lower), law.upper)
        if abs(target - u) <= _rounding(law, state):
            continue
        lift = np.array(linear.solve_definite(mechanism.mass, [[x] for x in law.row]))[:, 0]
        shift = (target - u) / float(np.dot(law.row, lift)) * lift
        state = State(tuple(np.add(state.position, shift)), state.velocity, state.phase)
    return state


def _moved(mechanism: Mechanism, law: RigidStop, phase: float) -> float:
    """Displacement of the stops at this phase of the first line."""
    angles = [(line, phase * (line.omega / mechanism.omega)) for line in law.motion]
    return sum(line.sine[0] * math.sin(a) + line.cosine[0] * math.cos(a) for line, a in angles)


def _rounding(law: RigidStop, state: State) -> float:
    """Bound the rounding of row . position: one ulp of each product and of the stop."""
    terms = sum(abs(r * x) for r, x in zip(law.row, state.position, strict=True))
    limits = sum(abs(x) for x in (law.lower, law.upper) if math.isfinite(x))
    return float(np.finfo(float).eps) * (len(law.row) * terms + limits)


def _next(work: _Work, systems: Rows, states: States, out: Arrays) -> States:
    """States from which the next value starts: the final state, or the same start where there is none."""
    position, velocity = out["final_position"], out["final_velocity"]
    forces = work.plan.mechanism.forces
    phase = out["final_phase"]
    if any((line.omega / forces[0].omega) % 1.0 for line in forces):  # 2 pi is no period then
        phase = states.phase + work.batch.omega[systems] * out["time"]
    both = zip(States(position, velocity, phase), states, strict=True)
    ran = _ran(out)
    return States(*(np.where(ran[:, None] if x.ndim > 1 else ran, x, old) for x, old in both))


def _ran(out: Arrays) -> NDArray[np.bool_]:
    """Mask of the members that moved at all."""
    ran: NDArray[np.bool_] = out["end"] != MemberStatus.INITIAL_PENETRATION
    return ran
