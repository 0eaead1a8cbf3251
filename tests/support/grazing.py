"""Flights of the impact damper built to graze: an extremum of u at a chosen distance from a stop.

Inside the clearance the place of the free mass shifts u without changing its shape; on a stop its
velocity tilts u. So one motion with one clear extremum gives a flight for every wanted distance.
What was built is measured at 50 digits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from witness import damper as reference
from witness.precision import exact, mp

import vibroimpact as vi
from support.kernel import fly
from support.systems import damper_witness

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.random import Generator

GRID = 400  # samples of a motion
CLEAR = 0.5  # the rest of the motion keeps at least this far from the stop


@dataclass(frozen=True)
class Graze:
    """A start, and the exact extremum of its gap."""

    damper: vi.ImpactDamper
    state: vi.State
    side: int  # of the stop: +1 is A
    left: bool  # the start stands on that stop
    time: Any  # of the extremum
    gap: Any  # at the extremum
    root: Any  # of the gap before the extremum, where that is negative
    t_max: float  # before which nothing else happens


def motion(d: vi.ImpactDamper, state: vi.State) -> tuple[Any, Any, Any]:
    """A grid of times, u and its rate, from the start on."""
    t = np.linspace(0.0, 2.0 * d.period, GRID + 1)
    x, v = fly(d, state, t)
    return t, x[:, 1] - x[:, 0], v[:, 1] - v[:, 0]


def interior(d: vi.ImpactDamper, rng: Generator) -> tuple[vi.State, int, int]:
    """A start inside the clearance whose u just reaches a stop; side, grid index."""
    x1, v1, v2 = rng.normal(size=3) * (2.0, 2.0, 1.0)
    side = int(rng.choice([-1, 1]))
    start = vi.State((x1, 0.0), (v1, v2), rng.uniform(0.0, 2.0 * np.pi))
    _, u, _ = motion(d, start)
    top = int(np.argmax(side * u))
    return vi.State((x1, side * d.half_clearance - u[top]), (v1, v2), start.phase), side, top


def departing(d: vi.ImpactDamper, rng: Generator) -> tuple[vi.State, int, int]:
    """A start on a stop that departs and just comes back to it.

    With x2 = x1 + side delta the gap is side ((x1(t) - x1(0)) - v2 t): it touches zero where the
    chord slope (x1(t) - x1(0)) / t has its extremum.
    """
    x1, v1 = rng.normal(size=2) * 2.0
    side = int(rng.choice([-1, 1]))
    phase = rng.uniform(0.0, 2.0 * np.pi)
    x2 = x1 + side * d.half_clearance
    t, u, _ = motion(d, vi.State((x1, x2), (v1, 0.0), phase))
    slope = (d.half_clearance - side * u[1:]) / t[1:]
    at = int(np.argmin(slope))
    return vi.State((x1, x2), (v1, side * slope[at]), phase), side, at + 1


def rest_is_clear(d: vi.ImpactDamper, state: vi.State, side: int, top: int, *, left: bool) -> bool:
    """The motion meets no stop but at the extremum, by a wide margin."""
    if not 8 < top < GRID - 8 or (left and side * (state.velocity[0] - state.velocity[1]) < 0.1):
        return False
    _, u, rate = motion(d, state)
    far, near = d.half_clearance + side * u, d.half_clearance - side * u
    peaks = [i for i in range(1, GRID) if near[i] < near[i - 1] and near[i] <= near[i + 1]]
    others = [near[i] for i in peaks if abs(i - top) > 3]
    ends = [near[-1]] if left else [near[0], near[-1]]
    sharp = abs(rate[top + 1] - rate[top - 1]) > 0.02  # an extremum, not an inflection
    return bool(far.min() > CLEAR and min([*others, *ends]) > CLEAR and sharp)


def newton(step: Callable[[Any], Any], t: Any) -> Any:
    """Repeat t -= step(t) until it no longer moves at 45 digits."""
    moved = mp.mpf(1)
    while abs(moved) > mp.mpf(10) ** -23:  # the error after a step is its square
        moved = step(t)
        t -= moved
    return t


def measured(g: Graze) -> Graze:
    """The same flight with its exact extremum, and the root before it."""
    w, x, v = damper_witness(g.damper), g.state.position, g.state.velocity
    z = reference.state(x[0], v[0], x[1], v[1], phase=g.state.phase)
    z = reference.on_stop(w, z, "A" if g.side > 0 else "B") if g.left else z
    start = reference.start(w.apart, z.x1, z.v1, z.s, z.c)

    def at(t: Any) -> tuple[Any, Any, Any]:
        m = start.at(t)
        u, rate = z.x2 + z.v2 * t - m.derivative(0), z.v2 - m.derivative(1)
        return w.half_clearance - g.side * u, -g.side * rate, g.side * m.derivative(2)

    def to_extremum(t: Any) -> Any:
        _, rate, curvature = at(t)
        return rate / curvature

    def to_root(t: Any) -> Any:
        gap, rate, _ = at(t)
        return gap / rate

    t = newton(to_extremum, exact(g.time))
    gap, _, curvature = at(t)
    root = newton(to_root, t - mp.sqrt(-2 * gap / curvature)) if gap < 0 else None
    return replace(g, time=t, gap=gap, root=root)


def moved(g: Graze, gap: float) -> Graze:
    """The flight whose extremum lies at this gap, up to rounding of the start."""
    (x1, x2), (v1, v2) = g.state.position, g.state.velocity
    shift = g.side * (gap - g.gap)
    if g.left:
        v2 = float(v2 - shift / g.time)
    else:
        x2 = float(x2 - shift)
    return measured(replace(g, state=vi.State((x1, x2), (v1, v2), g.state.phase)))


def grazes(
    d: vi.ImpactDamper, rng: Generator, shapes: int, gaps: Sequence[float], *, left: bool
) -> Iterator[Graze]:
    """Flights of several shapes, each with the wanted gaps at its extremum."""
    build = departing if left else interior
    for _ in range(shapes):
        found = build(d, rng)
        while not rest_is_clear(d, *found, left=left):
            found = build(d, rng)
        state, side, top = found
        t, _, _ = motion(d, state)
        shape = measured(Graze(d, state, side, left, float(t[top]), 0, None, float(t[-1])))
        for gap in gaps:
            yield moved(shape, gap)
