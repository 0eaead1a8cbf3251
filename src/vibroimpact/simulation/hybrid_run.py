"""Simulation of hybrid systems given as data: every transition, proved to be the first."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact import _kernel
from vibroimpact._core.checks import (
    check_choice,
    check_count,
    check_kind,
    check_memory,
    numbers,
    real,
    real_or_infinite,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import rounded_down
from vibroimpact._core.types import Codes, Floats
from vibroimpact.compile.coordinates import STEP_ANGLE
from vibroimpact.compile.modes import FASTEST, SLOWEST, STEP_BITS
from vibroimpact.model.hybrid_system import HybridSystem, LinearMode
from vibroimpact.simulation.simulate import RunEnd, Status, flights_at, rounded_times

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class HybridRun:
    """A simulated motion of a :class:`HybridSystem`; arrays are read-only.

    Attributes
    ----------
    time
        Time of each event since the start, shape (n_event,).
    status
        :class:`Status` of each event: CHANGE for a transition, GRAZING where a guard touches its
        level within rounding, HORIZON at the end.
    guard
        Name of the guard at each event, empty at the horizon.
    modes
        Name of the mode at the start, and after each event: n_event + 1 names.
    before, after
        States before and after each event, shape (n_event, n).
    end
        :class:`RunEnd`, why the run ended.
    system, start
        The system, and the state at the start.
    """

    system: HybridSystem
    start: Floats
    time: Floats
    status: Codes
    guard: tuple[str, ...]
    modes: tuple[str, ...]
    before: Floats
    after: Floats
    end: RunEnd
    _kernel: Any = field(repr=False)
    _y: Floats = field(repr=False)
    _mode: Codes = field(repr=False)
    _low: Floats = field(repr=False)

    def __len__(self) -> int:
        return int(self.time.size)

    def __repr__(self) -> str:
        changes = int(np.sum(self.status == Status.CHANGE))
        span = self.time[-1] if len(self) else 0.0
        return f"HybridRun: {changes} transitions up to t = {span:.6g}; {self.end.sentence}"

    def at(self, t: ArrayLike) -> Floats:
        """States at any times of the run, exact to rounding; after an event at its time.

        Parameters
        ----------
        t
            Times in [0, time of the last event].

        Returns
        -------
        state
            Shape ``t.shape + (n,)``.

        Raises
        ------
        InvalidParameterError
            A time outside the run.
        """
        times, flights = flights_at(t, self.time, self._low, self._y, self._mode)
        rows = flights.at(np.ravel(times), self._kernel)
        return _states(rows, self.system.states).reshape(*times.shape, self.system.states)

    def to_dataset(self) -> xr.Dataset:
        """The record as an xarray dataset."""
        import xarray as xr

        both = ("event", "state")
        return xr.Dataset(
            {
                "time": ("event", self.time),
                "status": ("event", self.status),
                "guard": ("event", np.array(self.guard, dtype=str)),
                "mode": ("event", np.array(self.modes[1:], dtype=str)),
                "before": (both, self.before),
                "after": (both, self.after),
            },
            attrs={
                "system": repr(self.system), "end": self.end.name, "end_reason": self.end.sentence,
                "mode_at_start": self.modes[0], "version": _kernel.version(),
            },
        )  # fmt: skip


def simulate_hybrid(
    system: HybridSystem,
    mode: str,
    state: ArrayLike,
    *,
    phase: float = 0.0,
    events: int = 10_000,
    t_max: float = math.inf,
) -> HybridRun:
    """Simulate a hybrid system given as data.

    Parameters
    ----------
    system
        A :class:`HybridSystem`.
    mode
        Name of the mode at the start. A guard that lies beyond its level there is crossed at once.
    state
        Shape (n,).
    phase
        Phase of the first forcing line at the start, in radians.
    events
        Stop after so many events.
    t_max
        Stop at this time.

    Returns
    -------
    HybridRun
        Every transition. The first crossing of every guard is proved, not sampled; what cannot be
        decided is data: see ``run.status`` and ``run.end``.

    Raises
    ------
    InvalidParameterError
        Wrong shapes, a mode that does not exist.

    Notes
    -----
    About ten microseconds per event for a few states.
    """
    check_kind("system", system, HybridSystem, "a HybridSystem")
    check_choice("mode", mode, list(system.modes))
    check_count("events", events, 1)
    if real_or_infinite("t_max", t_max, "a number > 0") <= 0.0:
        raise refusal("t_max", t_max, "> 0")
    if t_max == math.inf:
        check_memory("events", events, 32 * system.states + 96, "Give t_max.")
    y = numbers("state", state)
    if y.shape != (system.states,) or y.dtype != float:
        raise InvalidParameterError(f"state has shape {y.shape}; expected ({system.states},).")
    kernel, step = _compiled(system)
    at = _start(system, kernel, mode, y, real("phase", phase))
    first, first_mode = np.array(at.y), at.mode
    horizon = t_max if t_max < math.inf else 1e9 * step
    part = kernel.simulate(at, float(t_max), horizon, int(events), int(events))
    time, low = rounded_times(part["high"], part["low"])
    names, guards = list(system.modes), list(system.guards)
    n = system.states
    arrays = [time, part["status"], _states(part["before"], n), _states(part["after"], n)]
    for array in arrays:
        array.flags.writeable = False
    return HybridRun(
        system=system,
        start=y,
        time=time,
        status=part["status"],
        guard=tuple(guards[c] if c >= 0 else "" for c in part["contact"].tolist()),
        modes=tuple(names[m] for m in [first_mode, *part["mode"].tolist()]),
        before=arrays[2],
        after=arrays[3],
        end=RunEnd(part["why"]),
        _kernel=kernel,
        _y=np.concatenate([first[None, :], part["y"]]),
        _mode=np.concatenate([[first_mode], part["mode"]]).astype(np.int32),
        _low=low,
    )


def _states(rows: Floats, n: int) -> Floats:
    """States from rows of the kernel: entries with even numbers, then those with odd ones."""
    pairs = rows.shape[1] // 2
    return np.stack([rows[:, :pairs], rows[:, pairs:]], axis=2).reshape(len(rows), 2 * pairs)[:, :n]


def _start(system: HybridSystem, kernel: Any, mode: str, y: Floats, phase: float) -> Any:
    pairs = (system.states + 1) // 2
    whole = np.zeros(2 * pairs)
    whole[: system.states] = y
    phases = [phase * (w / system.omegas[0]) for w in system.omegas]
    at = kernel.start(whole[::2].tolist(), whole[1::2].tolist(), phases)["at"]
    at.mode = at.states = list(system.modes).index(mode)
    kernel.settle(at)
    return at


def _compiled(system: HybridSystem) -> tuple[Any, float]:
    """The system in the kernel: entries of y in pairs, then the forcing pairs."""
    pairs, lines = (system.states + 1) // 2, len(system.omegas)
    size = 2 * (pairs + lines)
    flows = [_flow(mode, system.omegas, size) for mode in system.modes.values()]
    rates = [float(np.abs(b).sum(axis=1).max()) for b, _ in flows]
    rate = max(rates) or 1.0
    if not SLOWEST <= rate <= FASTEST:
        raise InvalidParameterError(
            f"fastest rate = {rate!r}: must be in [{SLOWEST}, {FASTEST}]. Choose another unit of time."
        )
    step = rounded_down(STEP_ANGLE / rate, STEP_BITS)
    kernel = _kernel.System(
        dense=True, mixed=False, dimension=size, degrees=pairs, omegas=list(system.omegas),
        kappas=[1.0] * lines, step=step, laws=[], elements=[(1, False, False)], given=True,
        sequential=False,
    )  # fmt: skip
    names, guards = list(system.modes), list(system.guards)
    to_x, to_v = np.zeros((pairs, size)), np.zeros((pairs, size))
    for i in range(pairs):
        to_x[i, 2 * i] = to_v[i, 2 * i + 1] = 1.0
    for code, (name, (b, constant)) in enumerate(zip(names, flows, strict=True)):
        watches = []
        for t in system.transitions:
            if t.mode != name:
                continue
            guard = system.guards[t.guard]
            row = np.zeros(size)
            row[: system.states], row[2 * pairs :] = guard.row, guard.waves
            limits = (
                (-math.inf, guard.level) if t.direction == "rising" else (guard.level, math.inf)
            )
            reset = _reset(kernel, t.matrix, t.shift, size)
            target = names.index(t.to)
            watches.append(
                (row.tolist(), 0.0, *limits, guards.index(t.guard), False, reset, target)
            )
        kernel.add_mode(
            code=code, flow={"b": b.tolist(), "constant": constant.tolist(), "step": [step]},
            guards=[], watches=watches, to_x=to_x, to_v=to_v, offset=[0.0] * pairs,
            from_x=np.ascontiguousarray(to_x.T), from_v=np.ascontiguousarray(to_v.T),
            particular=np.zeros((size, 2 * lines)), shift=[],
        )  # fmt: skip
    return kernel, step


def _flow(mode: LinearMode, omegas: tuple[float, ...], size: int) -> tuple[Floats, Floats]:
    n, first = len(mode.matrix), size - 2 * len(omegas)
    b, constant = np.zeros((size, size)), np.zeros(size)
    b[:n, :n], b[:n, first:], constant[:n] = mode.matrix, mode.waves, mode.constant
    for line, omega in enumerate(omegas):
        at = first + 2 * line
        b[at, at + 1], b[at + 1, at] = omega, -omega
    return b, constant


def _reset(kernel: Any, matrix: Floats | None, shift: Floats | None, size: int) -> int:
    """Number of the reset in the kernel, -1 for none."""
    assert matrix is not None  # a system fills these in
    assert shift is not None
    n = len(matrix)
    if np.array_equal(matrix, np.eye(n)) and not shift.any():
        return -1
    whole, more = np.eye(size), np.zeros(size)
    whole[:n, :n], more[:n] = matrix, shift
    return int(kernel.add_reset(matrix=whole, shift=more.tolist()))
