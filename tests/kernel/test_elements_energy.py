"""Energy of random machines: input = change + what dashpots, friction and impacts take."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from support import UNIT
from support.event_reference import (
    BEHIND_LOWER,
    BEHIND_UPPER,
    FORWARD,
    LIMITED_LOWER,
    LIMITED_UPPER,
    LOWER,
    OPEN,
    STICK,
    UPPER,
    Reference,
)
from support.random_elements import KINDS, machine, start

import vibroimpact as vi

Array = NDArray[np.float64]
SPAN, MACHINES = 20.0, 10
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PIECE = (
    0.1  # a power of frequencies up to 40 is integrated to (40 / 2 * PIECE / 2)^24 / 24! < 1e-23
)


def waves(r: Reference, state: vi.State, t: Array) -> Array:
    """Columns z of a reference at times t, but for x and v."""
    first = r.m.forces[0].omega if r.m.forces else 1.0
    z = np.zeros((r.size, t.size))
    for i, w in enumerate(r.omegas):
        angle = state.phase * w / first + w * t
        z[2 * r.n + 2 * i], z[2 * r.n + 2 * i + 1] = np.sin(angle), np.cos(angle)
    z[-1] = 1.0
    return z


def stored(r: Reference, z: Array) -> Array:
    """Energy of masses, springs (the symmetric part of K), and compressed soft stops."""
    x, v = z[: r.n], z[r.n : 2 * r.n]
    k = np.array(r.m.stiffness)
    total = 0.5 * np.sum(v * (r.mass @ v), axis=0) + 0.25 * np.sum(x * ((k + k.T) @ x), axis=0)
    for e in r.m.switching:
        if isinstance(e, vi.SoftStop):
            for side, limit in ((1, e.upper), (-1, e.lower)):
                if np.isfinite(limit):
                    depth = np.maximum(-(r.within(e, side) @ z), 0.0)
                    total = total + 0.5 * e.spring_at(side).stiffness * depth**2
    return np.asarray(total)


def powers(r: Reference, states: tuple[int, ...], z: Array) -> list[Array]:
    """Power into the machine of all that does not come from stored energy."""
    n, m = r.n, r.m
    x, v, w = z[:n], z[n : 2 * n], z[2 * n :]
    k = np.array(m.stiffness)
    forces = np.array(m.constant_force)[:, None] - 0.5 * (k - k.T) @ x - np.array(m.damping) @ v
    for line in m.forces:
        at = 2 * r.omegas.index(line.omega)
        forces = forces + np.outer(line.sine, w[at]) + np.outer(line.cosine, w[at + 1])
    out = [np.sum(forces * v, axis=0)]
    margins = r.mode(states)[1]
    for i, (e, q) in enumerate(zip(m.elements, states, strict=True)):
        if isinstance(e, vi.RigidStop):
            if q != OPEN:  # a stop that moves pushes what rests on it
                force = next(g.row for g in margins if g.number == i and g.resting) @ z
                out.append((-1 if q == UPPER else 1) * force * (r.motion(e.motion, 1) @ z))
        elif isinstance(e, vi.SoftStop):
            for side, pressed, behind, limited in (
                (1, UPPER, BEHIND_UPPER, LIMITED_UPPER), (-1, LOWER, BEHIND_LOWER, LIMITED_LOWER),
            ):  # fmt: skip
                depth, rate = -(r.within(e, side) @ z), side * (r.gap(e, 1) @ z)
                if q == pressed:
                    moved = -side * (r.press(e, side) @ z) * (r.motion(e.motion, 1) @ z)
                    out += [-e.spring_at(side).damping * rate**2, moved]
                elif q == limited:  # the dashpot takes as much as the spring
                    spring = e.spring_at(side).stiffness * depth
                    moved = -side * 2.0 * spring * (r.motion(e.motion, 1) @ z)
                    out += [-spring * rate, moved]
                elif q == behind:  # the spring is let go: the dashpot of the stop takes it
                    out.append(e.spring_at(side).stiffness * depth * rate)
        else:
            belt = r.one(e.row, True) @ z - r.slip(e) @ z
            if q == STICK:
                force = 0.5 * np.subtract(*[g.row for g in margins if g.number == i][:0:-1]) @ z
            else:
                force = (-1.0 if q == FORWARD else 1.0) * e.kinetic * np.ones(z.shape[1])
                out.append(force * (r.slip(e) @ z))
            out.append(force * belt)
    return out


def struck(r: Reference, contact: int, before: Array, after: Array) -> float:
    """What an impact takes, less what a moving stop gives."""
    c = r.m.rigid_stops[contact]
    row = np.array(c.row)
    wall = r.motion(c.motion, 1) @ before
    speed = r.gap(c, 1) @ before
    mass = 1.0 / float(row @ np.linalg.solve(r.mass, row))
    e = c.restitutions[1 if speed > 0.0 else 0]
    impulse = mass * float(row @ (after - before)[r.n : 2 * r.n])
    return float(0.5 * mass * (1.0 - e * e) * speed**2 - impulse * wall)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.one_in(3)
def test_the_work_done_is_what_is_stored_and_what_is_dissipated(kind: str) -> None:
    for seed in range(100, 100 + MACHINES):
        rng = np.random.default_rng(seed)
        m = machine(rng, KINDS[kind])
        state = start(rng, m)
        run = vi.simulate(m, state, impacts=400, t_max=SPAN)
        assert run.end in (vi.RunEnd.HORIZON, vi.RunEnd.IMPACTS)
        assert check(Reference(m, state), run, state) > 0


def check(r: Reference, run: vi.Run, state: vi.State) -> int:
    """Balance of every segment and impact; how many there were."""
    n, times = r.n, np.concatenate([[0.0], run.time])
    count = 0
    for i, (a, b) in enumerate(itertools.pairwise(times)):
        ends = waves(r, state, np.array([a, b]))
        x0, v0 = (run.position[i - 1], run.velocity_after[i - 1]) if i else state_of(state)
        ends[: 2 * n, 0] = [*x0, *v0]
        ends[: 2 * n, 1] = [*run.position[i], *run.velocity_before[i]]
        if b - a > 1e-6:  # the shortest flights: of chatter, which tests of rigid stops follow
            pieces = int(np.ceil((b - a) / PIECE))
            width = (b - a) / pieces
            t = a + width * (np.arange(pieces)[:, None] + (1.0 + NODES) / 2.0).ravel()
            z = waves(r, state, t)
            z[:n], z[n : 2 * n] = (part.T for part in run.at(t))
            parts = powers(r, r.states_between(z), z)
            weights = np.tile(0.5 * width * WEIGHTS, pieces)
            change = float(np.diff(stored(r, ends))[0])
            height = np.abs(np.array(r.m.constant_force)[:, None] * ends[:n]).max()
            size = float(sum(np.abs(p) @ weights for p in parts) + stored(r, ends).max() + height)
            # each step leaves some 4 u; it is 0.7 over the fastest rate, 40 at most: some 60 in a
            # unit of time. The times of both ends are rounded, too
            allowed = 4.0 * (16.0 + 60.0 * (b - a)) * UNIT * size
            allowed += 2.0 * UNIT * b * max(float(np.abs(p).max()) for p in parts)
            assert abs(change - float(sum(p @ weights for p in parts))) <= allowed
            count += 1
        if run.status[i] == vi.Status.IMPACT:
            after = ends[:, 1].copy()
            after[n : 2 * n] = run.velocity_after[i]
            energy = stored(r, np.column_stack([ends[:, 1], after]))
            lost = struck(r, int(run.contact[i]), ends[:, 1], after)
            assert abs(energy[0] - energy[1] - lost) <= 256.0 * UNIT * energy.max()
            count += 1
    return count


def state_of(s: vi.State) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(s.position), tuple(s.velocity)
