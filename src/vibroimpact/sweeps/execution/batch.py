"""Batch of systems of one kind, and the run of its members.

Method      Systems are compiled together (compile/many_systems.py) and handed to the kernel in parts of one
            structure; each part runs its members. Members whose pace sets their step
            (compile/pace.py) run apart, on systems compiled for it. Where members close a set of contacts, or their
            elements take states, whose mode their systems do not have yet, these run once more from
            their start with that mode.
Accuracy    Every member has the bits of running it alone.
Fails       A member that comes into a mode whose forces are not determined ends as MISSING.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact import _kernel
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Arrays, Floats, Rows
from vibroimpact.compile.hybrid import Compiled
from vibroimpact.compile.many_systems import Compilation, Part, Values, compile_together
from vibroimpact.compile.tables import Stacks
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.phases import phases_at
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import RunEnd, begin, events_for
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.observers.selection import kernel_observers, results, rounds, variables_of


@dataclass(frozen=True, eq=False)
class Members:
    """Trajectories to run: one entry per member."""

    system: NDArray[np.int32]  # number of its system in the batch, shape (N,)
    # where it starts, shape (N, n)
    position: Floats
    velocity: Floats
    phase: Floats  # phase of the first forcing line, radians, shape (N,)
    # lengths of the window in units of time, shape (N,)
    settle: Floats
    observe: Floats
    most_impacts: int  # a member ends after so many

    def of(self, rows: Rows, system: NDArray[Any]) -> Members:
        """Some of the members, with other numbers for their systems."""
        return Members(
            system.astype(np.int32), self.position[rows], self.velocity[rows], self.phase[rows],
            self.settle[rows], self.observe[rows], self.most_impacts,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Batch:
    """Compiled systems."""

    system: System
    values: Values = field(repr=False)
    # of `system`; every system has as many coordinates, contacts and lines
    mechanism: Mechanism = field(repr=False)
    omegas: Floats = field(repr=False)  # frequencies of the forcing lines, shape (S, L)
    # which kernel runs each system, and as which of its own, shape (S,)
    part: Rows = field(repr=False)
    number: Rows = field(repr=False)
    # the kernels, and the numbers of their systems
    kernels: tuple[_kernel.Batch, ...] = field(repr=False)
    stacks: tuple[Stacks, ...] = field(repr=False)
    pace: float = 0.0  # pace that the systems are compiled for, zero for their own rates

    @property
    def count(self) -> int:
        """Number of systems."""
        return len(self.omegas)

    @property
    def lines(self) -> int:
        """Forcing lines of every system."""
        return int(self.omegas.shape[1])

    @property
    def omega(self) -> Floats:
        """Angular frequency of the first line, 0 where there is none, shape (S,)."""
        return self.omegas[:, 0] if self.lines else np.zeros(self.count)


def batch_of(system: System, values: Mapping[str, ArrayLike]) -> Batch:
    """Compile a system with other values of some parameters, all at once.

    Parameters
    ----------
    system
        Anything with a mechanism. One whose ``mechanism`` computes with + - * / ** and numpy's
        elementary functions is compiled with columns; any other one by one, at about a thousand
        times the cost.
    values
        Arrays of shape (S,) by name of a parameter (parameters.py); without any, S is 1.

    Raises
    ------
    InvalidParameterError
        No such parameter; arrays of several lengths; a system that is refused, or that has other
        numbers of coordinates, contacts or lines than the rest. The message names the system.

    Notes
    -----
    About a microsecond per damper where thousands are compiled together, half of that in a grid.
    """
    compilation = compile_together(system, _checked(values))
    return batch_from(compilation, slice(0, compilation.count))


def _checked(values: Mapping[str, ArrayLike]) -> Values:
    arrays = {name: np.array(x, dtype=float) for name, x in values.items()}
    for name, x in arrays.items():
        if x.ndim != 1 or x.shape != next(iter(arrays.values())).shape or not x.size:
            raise InvalidParameterError(
                f"{name} has shape {x.shape}; expected (S,), S >= 1, as every parameter."
            )
    return arrays


def batch_from(compilation: Compilation, place: slice) -> Batch:
    """Some of the systems that were compiled together, numbered from the first of them.

    Raises
    ------
    InvalidParameterError
        As :func:`batch_of`.
    """
    m, count = compilation.mechanism, place.stop - place.start
    sizes = m.degrees, len(m.rigid_stops), len(m.forces)
    part, number = np.zeros(count, dtype=np.intp), np.zeros(count, dtype=np.intp)
    omegas, parts = np.zeros((count, len(m.forces))), list[Part]()
    for found, where in compilation.inside(place):
        if found.stacks.sizes != sizes:
            raise InvalidParameterError(
                f"system = {compilation.system!r}: within the ranges of the parameters its "
                "mechanisms have different numbers of coordinates, contacts or lines. Study them "
                "apart."
            )
        systems = found.systems[where] - place.start
        part[systems], number[systems] = len(parts), np.arange(where.start, where.stop)
        omegas[systems] = found.omegas[where]
        parts.append(found)
    values = {name: x[place] for name, x in compilation.values.items()}
    kernels, stacks = tuple(one.kernel for one in parts), tuple(one.stacks for one in parts)
    return Batch(
        compilation.system, values, m, omegas, part, number, kernels, stacks, compilation.pace
    )


def run_members(batch: Batch, members: Members, observers: Sequence[Observer]) -> Arrays:
    """Run every member through its window.

    Parameters
    ----------
    batch, members
        Systems and trajectories.
    observers
        What to compute on the way. Members are run as often as there are sections,
        or rotation numbers, whichever are more.

    Returns
    -------
    dict
        By name: ``end`` (:class:`MemberStatus`), ``time`` reached, and the outputs of the observers,
        leading axis the members.
    """
    paces = _paces(batch, members)
    if not paces.any():
        return _run_rounds(batch, members, observers)
    out: Arrays = {}
    for pace in np.unique(paces):
        rows = np.flatnonzero(paces == pace)
        systems, number = np.unique(members.system[rows], return_inverse=True)
        own = batch if pace == 0.0 else _again(batch, systems, (), float(pace))
        some = members.of(rows, members.system[rows] if own is batch else number)
        for name, values in _run_rounds(own, some, observers).items():
            whole = out.setdefault(name, np.empty((len(paces), *values.shape[1:]), values.dtype))
            whole[rows] = values
    return out


def _run_rounds(batch: Batch, members: Members, observers: Sequence[Observer]) -> Arrays:
    out: Arrays = {}
    for some in rounds(observers):
        out |= _run_once(batch, members, some)
    return out


def _paces(batch: Batch, members: Members) -> Floats:
    """Pace that sets the step of each member, zero where the own rates of its system serve, shape (N,)."""
    paces, part = np.zeros(len(members.system)), batch.part[members.system]
    for i, stacks in enumerate(batch.stacks):
        rows = np.flatnonzero(part == i)
        number = batch.number[members.system[rows]]
        run = members.settle[rows] + members.observe[rows]
        paces[rows] = stacks.paces(number, members.position[rows], members.velocity[rows], run)
    return paces


def _run_once(batch: Batch, members: Members, observers: Sequence[Observer]) -> Arrays:
    out = _run(batch, members, observers)
    _finish(batch, members, observers, np.flatnonzero(out["end"] == MemberStatus.MISSING), out)
    return out


def _run(batch: Batch, members: Members, observers: Sequence[Observer]) -> Arrays:
    """Run the members of each part of the batch."""
    part, count = batch.part[members.system], len(members.system)
    if count and np.all(part == part[0]):
        return _run_part(batch, part[0], members, observers)
    out: Arrays = {
        name: np.full((count, *output.shape), output.fill, output.dtype)
        for name, output in variables_of(observers, batch.mechanism).items()
    }
    for i in range(len(batch.kernels)):
        rows = np.flatnonzero(part == i)
        if rows.size:
            some = members.of(rows, members.system[rows])
            for name, values in _run_part(batch, i, some, observers).items():
                out[name][rows] = values
    return out


def _run_part(batch: Batch, part: int, members: Members, observers: Sequence[Observer]) -> Arrays:
    """Run members whose systems are all of one part."""
    ratios = (batch.omegas / batch.omegas[:, :1])[members.system]
    raw = batch.kernels[part].run(
        system=batch.number[members.system].astype(np.int32),
        position=members.position, velocity=members.velocity,
        phases=phases_at(members.phase[:, None], ratios),
        settle=members.settle, observe=members.observe,
        most_impacts=members.most_impacts, observers=kernel_observers(observers),
    )  # fmt: skip
    return results(observers, batch.mechanism, raw)


def _finish(
    batch: Batch, members: Members, observers: Sequence[Observer], rows: Rows, out: Arrays
) -> None:
    """Run members again that ended as MISSING, with the modes that they want.

    One of them is run alone to find these, and then of its system twice as many each time.
    """
    codes: tuple[int, ...] = ()
    known, system, most_asked = set[int](), -1, 1
    while rows.size:
        if system != members.system[rows[0]]:
            system = int(members.system[rows[0]])
            compiled = _compiled_alone(batch, system)
            known.update(compiled.codes)  # every system begins with these
        asked = rows[members.system[rows] == system][:most_asked]
        for row in asked:
            _add_modes_wanted(compiled, members, int(row))
        wanted = [code for code in compiled.codes if code not in known]
        if not wanted:  # there is no such mode
            rows = np.setdiff1d(rows, asked)
            continue
        known.update(wanted)
        codes, most_asked = (*codes, *wanted), 2 * most_asked
        systems, number = np.unique(members.system[rows], return_inverse=True)
        more = _with_modes(batch, systems, codes, batch.pace)
        if more is None:
            for k in range(len(systems)):
                _finish(batch, members, observers, rows[number == k], out)
            return
        for name, values in _run(more, members.of(rows, number), observers).items():
            out[name][rows] = values
        rows = rows[out["end"][rows] == MemberStatus.MISSING]


def _with_modes(
    batch: Batch, systems: NDArray[Any], codes: tuple[int, ...], pace: float
) -> Batch | None:
    """Some of the systems with more modes; None where not every one has them."""
    try:
        return _again(batch, systems, codes, pace)
    except InvalidParameterError:
        return None


def _again(batch: Batch, systems: NDArray[Any], codes: tuple[int, ...], pace: float) -> Batch:
    """Some of the systems compiled with more modes, or for a pace."""
    values = {name: x[systems] for name, x in batch.values.items()}
    compilation = compile_together(batch.system, values, codes, pace)
    return batch_from(compilation, slice(0, len(systems)))


def _compiled_alone(batch: Batch, k: int) -> Compiled:
    """System k of a batch with the modes that every system begins with."""
    system = with_parameters(batch.system, {name: x[k].item() for name, x in batch.values.items()})
    return Compiled(mechanism_of(system), batch.pace)


def _add_modes_wanted(compiled: Compiled, members: Members, row: int) -> None:
    """Compile the modes that a member asks for on its way, as far as they can be compiled."""
    state = State(tuple(members.position[row]), tuple(members.velocity[row]), members.phase[row])
    at, end = begin(compiled, state), members.settle[row] + members.observe[row]
    most = members.most_impacts
    while True:
        why, code, _ = compiled.kernel.advance(
            at, end, math.inf, events_for(compiled.mechanism, most), most
        )
        if why != RunEnd.MISSING or not compiled.add_code(code):
            return
