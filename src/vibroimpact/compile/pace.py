"""The pace of a motion, and where the step of its search follows it instead of the machine's own rates.

Method      A machine says how fast it moves by the rates of its vibrations, dashpots and forces. A ball that
            falls has none, and with a force as slow as the tides it still has none that matters: how
            fast it meets its stop is said by where and how fast it starts. The kernel computes that
            pace p (system/pace.hpp). It sets the step of the search where it is more than PACE_RATIO
            times the fastest rate of the machine. A force is not split off as a particular motion where
            that would be SPLIT_RESPONSE times what the force moves within 1 / p,

                p^2 > SPLIT_RESPONSE |k - omega^2 + i c omega|,                                     (1)

            k and c those of a block that it pushes: the start would be lost in its rounding. A constant force that
            is split off as an equilibrium, where damping is not classical, counts as one of omega = 0. Then the
            flow is written without blocks. So it is next to a resonance, where (1) holds with k + omega^2 for p^2.
Accuracy    a particular motion costs the digits of SPLIT_RESPONSE, four; velocities v / rate those of PACE_RATIO, three
Reference   theory.md, "Flight"
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core import linear
from vibroimpact._core.scalars import (
    ROUNDING_PER_TERM,
    above,
    choose,
    cleared,
    greatest,
    square_root,
)
from vibroimpact._core.types import Floats, Rows
from vibroimpact.compile.coordinates import SPLIT_RESPONSE, Blocks
from vibroimpact.compile.modes import FASTEST_RATE, SLOWEST_RATE
from vibroimpact.model.mechanism import Mechanism, with_mass

PACE_RATIO = 2.0**10


def paced_parts(m: Mechanism) -> list[list[Any]]:
    """Row, lower, upper, pull, that of lines and belt speed of every stop and friction, as the kernel takes them.

    The pull is the largest acceleration along the row of a stop by constant and harmonic forces, and along
    that of friction by friction alone.
    """
    heavy = with_mass(m)
    solve = linear.solver_of_definite([[m.mass[i][j] for j in heavy] for i in heavy])
    forces = [m.constant_force, *(part for f in m.forces for part in (f.sine, f.cosine))]
    lifts = linear.transpose(solve([[force[i] for force in forces] for i in heavy]))
    out = []
    for e in m.elements:
        if not (e.is_stop or e.slipping):
            continue
        row, grip = [e.row[i] for i in heavy], e.grip
        still, *driving = (_along(row, lift) for lift in lifts)
        lines = sum(driving)
        pull = still + lines
        if e.slipping:
            (push,) = linear.transpose(solve([[x] for x in row]))
            # where a force pushes, too, it is this that says how far
            pull = choose(
                above(pull, 0.0), 0.0, grip.kinetic * abs(grip.load) * linear.dot(row, push)
            )
            lines = 0.0
        out.append([*e.row, e.limit_at(-1), e.limit_at(1), pull, lines, grip.speed])
    return out


def _along(row: list[float], lift: list[float]) -> float:
    """Size of row . lift; zero where it is rounding, as of two bodies that fall alike."""
    size = sum(abs(x * y) for x, y in zip(row, lift, strict=True))
    return cleared(abs(linear.dot(row, lift)), ROUNDING_PER_TERM * size)


def paced_rate(own: float, pace: float) -> float:
    """The rate that sets the step of the search, of a machine with this rate of its own."""
    found = choose(above(pace, PACE_RATIO * own), pace, own)
    return choose(above(found, 0.0), greatest([found, SLOWEST_RATE]), 1.0)


def paces_of(
    parts: Floats,
    own: Floats,
    most: Floats,
    system: Rows,
    position: Floats,
    velocity: Floats,
    run: Floats,
    *,
    elements: bool = False,
) -> Floats:
    """Paces of N motions from their starts in runs of these lengths, zero where own rates serve.

    ``parts`` of S systems have shape (S, P, n + 5), their fastest rates ``own`` and the paces ``most`` up to which
    these serve (S,). With elements the length of the run counts beside own rates, too: states are decided relative
    to the pace.
    """
    which = system.astype(np.int32)
    return _kernel.pace(
        parts, own, most, which, position, velocity, run, elements, SLOWEST_RATE, FASTEST_RATE
    )


def most_by_forces(blocks: Blocks, omegas: list[float], stiffnesses: list[float]) -> list[float]:
    """Solve (1) for p: for blocks that a line pushes, and those of which an equilibrium was split off."""
    found = [square_root(SPLIT_RESPONSE * k) for k in stiffnesses]
    for omega, pushes in zip(omegas, blocks.pushes, strict=True):
        for j, (k, c) in enumerate(zip(blocks.k, blocks.c, strict=True)):
            if any(x != 0.0 for row in pushes[2 * j : 2 * j + 2] for x in row):
                spring, dash = k - omega * omega, c * omega
                size = square_root(spring * spring + dash * dash)
                found.append(square_root(SPLIT_RESPONSE * size))
    return found
