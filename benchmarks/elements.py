"""Soft stops and friction in lanes, beside a rigid stop and other programs.

Three oscillators x'' + 0.1 x' + x = cos omega t: between two soft stops, with friction, and before a rigid
stop. Asserted before anything is timed: the events of members in lanes end where `simulate` does, bit by bit, and
the first events of every other program agree with `simulate` to 1e-9. Then a plane of soft oscillators, on two cores,
and how the cost of an event grows with the number of soft stops of a chain.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

import vibroimpact as vi
from benchmarks import machine
from benchmarks.case import Floats
from benchmarks.peers.method import UnavailableError, require
from benchmarks.peers.numba_sampled import compiled, njit
from vibroimpact.sweeps.execution.batch import Members, batch_of, run_members
from vibroimpact.sweeps.observers import Final

OMEGA, DAMPING = 0.9, 0.1
STIFFNESS, LIMIT, FRICTION, RESTITUTION = 29.0, 1.0, 0.1, 0.8
MEMBERS, PERIODS, ROUNDS = 2048, 300, 5
COMPARED, FEW = 8, 40  # events that are compared, starts of programs that take one after another
TOLERANCE = 1e-9
SAMPLES = 64  # per forcing period
SIDE = 300  # points along each side of the plane
CHAIN = ((1, 1), (2, 2), (3, 3), (4, 4), (10, 4))  # masses, and soft stops at the first of them


def oscillator(*elements: Any) -> vi.Mechanism:
    """One mass on a spring, forced."""
    return vi.Mechanism(
        mass=[[1.0]], damping=[[DAMPING]], stiffness=[[1.0]],
        forces=(vi.Harmonic(OMEGA, (0.0,), (1.0,)),), elements=elements,
    )  # fmt: skip


MACHINES: dict[str, Callable[[], vi.Mechanism]] = {
    "two soft stops": lambda: oscillator(vi.SoftStop((1.0,), -LIMIT, LIMIT, stiffness=STIFFNESS)),
    "friction": lambda: oscillator(vi.Friction((1.0,), FRICTION)),
    "a rigid stop": lambda: oscillator(vi.RigidStop((1.0,), upper=LIMIT, restitution=RESTITUTION)),
}


@dataclass(slots=True)
class Row:
    """One line of the table."""

    machine: str
    method: str
    nanoseconds: float  # per event


def starts(count: int) -> Floats:
    """Positions and velocities, shape (count, 2)."""
    rng = np.random.default_rng(20)
    return np.column_stack([rng.uniform(-0.6, 0.6, count), rng.uniform(-1.0, 1.0, count)])


def run_of(system: vi.Mechanism, start: Floats, length: float) -> vi.Run:
    """Simulate one start."""
    state = vi.State((float(start[0]),), (float(start[1]),))
    return vi.simulate(system, state, t_max=length, impacts=10**6)


# ---- members in lanes ------------------------------------------------------------------------------


def lanes(name: str, rows: Floats) -> Row:
    """Members of one call on one thread: nanoseconds per event, the median of some rounds."""
    system, length = MACHINES[name](), PERIODS * 2.0 * math.pi / OMEGA
    n = len(rows)
    members = Members(np.zeros(n, dtype=np.int32), rows[:, :1].copy(), rows[:, 1:].copy(),
                      np.zeros(n), np.full(n, length), np.zeros(n), 10**6)  # fmt: skip
    batch = batch_of(system, {"stiffness[0][0]": np.array([1.0])})
    out = run_members(batch, members, (Final(),))
    events = 0
    for i, start in enumerate(rows):
        run = run_of(system, start, length)
        same = run.position[-1].tobytes() == out["final_position"][i].tobytes()
        assert same, f"{name}: member {i} is not the run alone"
        events += len(run) - 1  # the end is none
    took = sorted(_seconds(lambda: run_members(batch, members, ())) for _ in range(ROUNDS))
    return Row(name, "vibroimpact, lanes", 1e9 * took[ROUNDS // 2] / events)


def _seconds(call: Callable[[], object]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


# ---- other programs: times of the events of every start --------------------------------------------


def heyoka_times(name: str, rows: Floats, length: float) -> tuple[float, list[list[float]]]:
    """heyoka with terminal events; the callback changes the force."""
    heyoka = require("heyoka", "heyoka")
    x, v, s, c = heyoka.make_vars("x", "v", "s", "c")
    force = heyoka.par[0] * (x - heyoka.par[1]) + heyoka.par[2]
    times: list[float] = []

    def change(integrator: Any, _sign: int) -> bool:
        times.append(integrator.time)
        at, speed = integrator.state[:2]
        if name == "friction":  # an event of the velocity: the sign that it takes
            integrator.pars[2] = -integrator.pars[2]
        else:
            pressed = abs(at + math.copysign(1e-9, at * speed) * at) > LIMIT
            integrator.pars[0] = STIFFNESS if pressed else 0.0
            integrator.pars[1] = math.copysign(LIMIT, at)
        return True

    class Shared:
        """heyoka copies callbacks; this one stays shared."""

        def __call__(self, integrator: Any, sign: int) -> bool:
            return change(integrator, sign)

        def __deepcopy__(self, _memo: object) -> Shared:
            return self

    guards = [v] if name == "friction" else [x - LIMIT, x + LIMIT]
    integrator = heyoka.taylor_adaptive(
        [(x, v), (v, c - DAMPING * v - x - force), (s, OMEGA * c), (c, -OMEGA * s)],
        state=[0.0] * 4, pars=[0.0] * 3,
        t_events=[heyoka.t_event(guard, callback=Shared()) for guard in guards],
    )  # fmt: skip
    found, took = [], 0.0
    for at, speed in rows.tolist():
        integrator.state[:] = [at, speed, 0.0, 1.0]
        integrator.pars[:] = [0.0, 0.0, math.copysign(FRICTION, speed) * (name == "friction")]
        integrator.time = 0.0
        integrator.reset_cooldowns()
        times.clear()
        took += _seconds(lambda: integrator.propagate_until(length))
        found.append(list(times))
    return took, found


@compiled
def _sampled(
    x: float, v: float, friction: bool, length: float, times: Floats
) -> int:  # pragma: no cover - compiled
    """Flights in closed form, sampled, with bisection at a change of sign; the number of events."""
    t, count, pressed = 0.0, 0, 0.0
    level = FRICTION if v > 0.0 else -FRICTION
    step = 2.0 * math.pi / OMEGA / SAMPLES
    while True:
        k = 1.0 + STIFFNESS * abs(pressed)
        rest = (STIFFNESS * LIMIT * pressed - (level if friction else 0.0)) / k
        down = DAMPING / 2.0
        w = math.sqrt(k - down * down)
        a, b = k - OMEGA * OMEGA, DAMPING * OMEGA
        fc, fs = a / (a * a + b * b), b / (a * a + b * b)
        c0, s0 = math.cos(OMEGA * t), math.sin(OMEGA * t)
        p = x - rest - (fc * c0 + fs * s0)
        q = (v - OMEGA * (fs * c0 - fc * s0) + down * p) / w
        low, high, side = 0.0, 0.0, 0.0
        i = 0
        while side == 0.0:
            i += 1
            if t + i * step > length:
                return count
            low, high = high, i * step
            side = _beyond(_state(high, t, p, q, w, rest, fc, fs), pressed, friction, level)
        for _ in range(60):
            middle = 0.5 * (low + high)
            if _beyond(_state(middle, t, p, q, w, rest, fc, fs), pressed, friction, level) != 0.0:
                high = middle
            else:
                low = middle
        x, v = _state(high, t, p, q, w, rest, fc, fs)
        t += high
        times[count] = t
        count += 1
        if friction:
            level = -level
        elif pressed != 0.0:
            pressed = 0.0
        else:
            pressed = side


@compiled
def _state(
    t: float, begin: float, p: float, q: float, w: float, rest: float, fc: float, fs: float
) -> tuple[float, float]:
    e, c, s = math.exp(-0.5 * DAMPING * t), math.cos(w * t), math.sin(w * t)
    fade = e * (p * c + q * s)
    at, turn = OMEGA * (begin + t), e * w * (q * c - p * s)
    x = rest + fade + fc * math.cos(at) + fs * math.sin(at)
    v = turn - 0.5 * DAMPING * fade + OMEGA * (fs * math.cos(at) - fc * math.sin(at))
    return x, v


@compiled
def _beyond(state: tuple[float, float], pressed: float, friction: bool, level: float) -> float:
    x, v = state
    if friction:
        return 1.0 if v * level < 0.0 else 0.0
    if pressed != 0.0:
        return 1.0 if x * pressed < LIMIT else 0.0
    return math.copysign(1.0, x) if abs(x) > LIMIT else 0.0


def numba_times(name: str, rows: Floats, length: float) -> tuple[float, list[list[float]]]:
    """The sampled closed form in numba."""
    if njit is None:
        raise UnavailableError("numba is not installed: pip install numba")
    times = np.empty(100_000)
    _sampled(0.3, 0.2, name == "friction", 20.0, times)  # compiled now
    found, took = [], 0.0
    for x, v in rows.tolist():
        begin = time.perf_counter()
        count = _sampled(x, v, name == "friction", length, times)
        took += time.perf_counter() - begin
        found.append(times[:count].tolist())
    return took, found


PEERS = {"heyoka, terminal events": heyoka_times, "closed form, sampled, numba": numba_times}


def others(name: str, rows: Floats) -> Iterator[Row]:
    """Other programs, after their first events have been compared."""
    length = PERIODS * 2.0 * math.pi / OMEGA
    for method, call in PEERS.items():
        try:
            took, found = call(name, rows, length)
        except UnavailableError as missing:
            print(f"{method}: {missing}")
            continue
        for start, times in zip(rows, found, strict=True):
            run = run_of(MACHINES[name](), start, 40.0)
            expected = run.time[run.status != vi.Status.HORIZON][:COMPARED]
            wrong = np.abs(np.array(times[: len(expected)]) - expected).max()
            assert wrong < TOLERANCE, f"{method}, {name}: an event differs by {wrong:g}"
        yield Row(name, method, 1e9 * took / sum(map(len, found)))


# ---- a plane, and chains -------------------------------------------------------------------------


def plane(side: int, workers: int) -> float:
    """Seconds of a plane of soft oscillators: 250 periods settle, 50 are observed."""
    over = {"omega": np.linspace(0.5, 1.5, side), "damping[0][0]": np.linspace(0.02, 0.2, side)}
    begin = time.perf_counter()
    vi.plane(
        MACHINES["two soft stops"](), over=over, start=vi.State((0.3,), (0.2,)), settle_periods=250,
        periods=50, workers=workers, progress=False,
    )  # fmt: skip
    return time.perf_counter() - begin


def chain(sizes: tuple[int, int]) -> Row:
    """A chain of masses with soft stops: nanoseconds per event of one run."""
    count, stops = sizes
    links = 2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    rows = np.eye(count)
    system = vi.Mechanism(
        mass=np.eye(count), damping=0.1 * links, stiffness=links,
        forces=(vi.Harmonic(OMEGA, tuple(np.ones(count))),),
        elements=tuple(vi.SoftStop(tuple(row), upper=0.5, stiffness=STIFFNESS) for row in rows[:stops]),
    )  # fmt: skip
    start = vi.State((0.0,) * count, (0.1,) * count)
    vi.simulate(system, start, t_max=100.0, impacts=10**6)  # compiled now
    took = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        run = vi.simulate(system, start, t_max=5000.0, impacts=10**6)
        took.append((time.perf_counter() - begin) / len(run))
    return Row(
        f"chain of {count} with {stops} soft stops", "simulate", 1e9 * sorted(took)[ROUNDS // 2]
    )


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Time elements in lanes, beside other programs, and a plane."""
    rows = starts(16 if options.quick else MEMBERS)
    found: list[Row] = []
    with machine.one_core():
        found += [lanes(name, rows) for name in MACHINES]
        for name in list(MACHINES)[:2]:
            found += others(name, rows[: 2 if options.quick else FEW])
        found += map(chain, CHAIN[:1] if options.quick else CHAIN)
    for row in found:
        print(f"{row.machine:32} {row.method:30} {row.nanoseconds:10.4g} ns per event")
    side = 4 if options.quick else SIDE
    for workers in (1, 2):
        print(f"plane of {side} x {side} on {workers} threads: {plane(side, workers):.3g} s")
    return {"rows": found}
