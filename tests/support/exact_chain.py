"""The motion of a run at 50 digits: the same flights, to the root of the guard that ends each.

A flight is z' = A z, by its Taylor series; numbers of few binary digits make A exact. Which guards
end the flights is taken from the run; when they do is found anew.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf

import vibroimpact as vi
from support.event_reference import Reference

DIGITS = 50
NO_TRANSITION = (vi.Status.GRAZING, vi.Status.HORIZON)


def row_times(row: Any, z: list[mpf]) -> mpf:
    return mp.fsum(mpf(float(x)) * y for x, y in zip(row, z, strict=True) if x)


def flown(a: Any, z: list[mpf], t: mpf) -> list[mpf]:
    """exp(A t) z."""
    rows = [[(j, mpf(float(x))) for j, x in enumerate(row) if x] for row in a]
    term, out = list(z), list(z)
    for k in range(1, 400):
        term = [mp.fsum(x * term[j] for j, x in row) * t / k for row in rows]
        out = [x + y for x, y in zip(out, term, strict=True)]
        if max(map(abs, term)) < mpf(10) ** (-DIGITS - 10):
            return out
    raise RuntimeError("the series does not end")


class Flight(NamedTuple):
    states: tuple[int, ...]
    number: int  # whose margin ends it, -1: none
    row: Any  # that margin
    struck: bool
    duration: float


def flights(run: vi.Run, reference: Reference) -> list[Flight]:
    """Flights of a run of positive duration, but grazes count as nothing."""
    out, begin = [], 0.0
    n = reference.n
    for i in range(len(run)):
        last = i == len(run) - 1
        if (run.status[i] in NO_TRANSITION and not last) or run.time[i] == begin:
            continue
        t = np.linspace(begin, run.time[i], 9)[1:-1]
        first = reference.m.forces[0].omega if reference.m.forces else 1.0
        z = np.zeros((reference.size, t.size))
        z[:n], z[n : 2 * n] = (part.T for part in run.at(t))
        for k, w in enumerate(reference.omegas):
            angle = run.start.phase * w / first + w * t
            z[2 * n + 2 * k], z[2 * n + 2 * k + 1] = np.sin(angle), np.cos(angle)
        z[-1] = 1.0
        states = reference.states_between(z)
        number = -1 if run.status[i] in NO_TRANSITION else int(run.contact[i])
        end = np.concatenate([run.position[i], run.velocity_before[i], z[2 * n :, -1]])
        end[2 * n : -1] = [
            f(run.start.phase * w / first + w * run.time[i])
            for w in reference.omegas for f in (np.sin, np.cos)
        ]  # fmt: skip
        margins = [m for m in reference.mode(states)[1] if m.number == number and not m.held]
        row = min(margins, key=lambda m: abs(m.row @ end)).row if margins else None
        out.append(
            Flight(states, number, row, run.status[i] == vi.Status.IMPACT, run.time[i] - begin)
        )
        begin = run.time[i]
    return out


def start_of(reference: Reference, state: vi.State) -> list[mpf]:
    """z at the start; position, velocity and phase may be given at 50 digits."""
    first = mpf(reference.m.forces[0].omega if reference.m.forces else 1.0)
    z = [mpf(x) for x in (*state.position, *state.velocity)]
    for w in reference.omegas:
        angle = mpf(state.phase) * mpf(w) / first
        z += [mp.sin(angle), mp.cos(angle)]
    return [*z, mpf(1)]


def follow(
    reference: Reference, z: list[mpf], chain: list[Flight], t_max: Any = None
) -> tuple[list[mpf], list[mpf]]:
    """Times of the events, and z at the end: after the last event, or at t_max."""
    times, now = [], mpf(0)
    n = reference.n
    for flight in chain:
        a, _ = reference.mode(flight.states)
        if flight.number < 0:
            break
        t, row = mpf(flight.duration), flight.row
        slope = [mp.fsum(mpf(float(r)) * mpf(float(x)) for r, x in zip(row, column, strict=True))
                 for column in zip(*a, strict=True)]  # fmt: skip
        for _ in range(9):
            there = flown(a, z, t)
            step = row_times(row, there) / mp.fsum(x * y for x, y in zip(slope, there, strict=True))
            t -= step
            if abs(step) < mpf(10) ** (-DIGITS + 5):
                break
        z = flown(a, z, t)
        now += t
        times.append(now)
        if flight.struck:
            z = struck(reference, flight.number, z)
    if t_max is not None:
        a, _ = reference.mode(chain[-1].states)
        z = flown(a, z, mpf(t_max) - now)
    assert len(z) == reference.size
    assert n > 0
    return times, z


def struck(reference: Reference, number: int, z: list[mpf]) -> list[mpf]:
    """After an impact."""
    c, n = reference.m.rigid_stops[number], reference.n
    rate = row_times(reference.gap(c, 1), z)
    r = mpf(c.restitutions[1 if rate > 0 else 0])
    lift = list(mp.lu_solve(mp.matrix(reference.m.mass), mp.matrix([mpf(x) for x in c.row])))
    impulse = (1 + r) * rate / mp.fsum(mpf(x) * y for x, y in zip(c.row, lift, strict=True))
    after = [v - impulse * y for v, y in zip(z[n : 2 * n], lift, strict=True)]
    return [*z[:n], *after, *z[2 * n :]]
