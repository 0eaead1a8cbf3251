"""Machines without their own forces, and machines that a record drives.

Method      A force f(t) b that is linear in time is a coordinate of its own, with mass 1, that nothing
            moves:
                M x'' + C x' + K x - (b / c) s = f0,    s'' = 0,    s = c f                     (1)
            so flights, contacts and states of elements stay those of a linear machine: exact, and
            proved. c makes s as large as the displacements that f causes, c = |M^-1 b| / rate^2:
            rounding is relative to the largest coordinate. At given times s is put on the next line.
Reference   theory.md, "Flight"
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.compile.hybrid import Compiled, compile_mechanism
from vibroimpact.compile.piecewise import Piecewise
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.mechanism import Mechanism, accelerations
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import Run, RunEnd, assembled, begin, phases_of, settled
from vibroimpact.simulation.simulator import ENDLESS_EVENTS


def unforced(m: Mechanism) -> Mechanism:
    """Return the mechanism without harmonic forces and phase switches; stops and belts still move."""
    elements = tuple(e for e in m.elements if not e.by_time)
    return replace(m, forces=(), elements=elements or (_out_of_reach(m),))


def linear(m: Mechanism) -> Mechanism:
    """Return masses, dashpots and springs alone, as they move while no stop is met."""
    return replace(m, forces=(), elements=(_out_of_reach(m),))


def _out_of_reach(m: Mechanism) -> RigidStop:
    """A stop that no motion meets, since a mechanism has one at least."""
    heavy = next(i for i in range(m.degrees) if m.mass[i][i])
    return RigidStop(tuple(float(i == heavy) for i in range(m.degrees)), upper=1e300)


def driven(m: Mechanism, row: Floats, slowest: float) -> tuple[Mechanism, float]:
    """Mechanism (1), whose last coordinate is s, and the factor c.

    Parameters
    ----------
    m
        The mechanism.
    row
        b: force on each coordinate per unit of f, shape (n,).
    slowest
        Rate that counts where the mechanism has no faster one: one over the duration of the record.
    """
    n = m.degrees
    pulled = np.array(row)
    lifted = accelerations(m, pulled)
    rate = max(float(Piecewise(m).rate), slowest)
    size = float(np.abs(lifted).max()) or float(np.abs(pulled).max())
    factor = size / rate**2
    stiffness = _bordered(m.stiffness, 0.0)
    stiffness[:n, n] = -pulled / factor
    wider = replace(
        m,
        mass=_bordered(m.mass, 1.0).tolist(),
        damping=_bordered(m.damping, 0.0).tolist(),
        stiffness=stiffness.tolist(),
        forces=tuple(_line(line) for line in m.forces),
        elements=tuple(e.widened() for e in m.elements),
        constant_force=(*m.constant_force, 0.0),
    )
    return wider, factor


def _bordered(matrix: list[list[float]], corner: float) -> Floats:
    out = np.zeros((len(matrix) + 1, len(matrix) + 1))
    out[:-1, :-1], out[-1, -1] = matrix, corner
    return out


def _line(line: Harmonic) -> Harmonic:
    return replace(line, sine=(*line.sine, 0.0), cosine=(*line.cosine, 0.0))


# ---- the run ---------------------------------------------------------------------------------------


class Lines(NamedTuple):
    """Lines that a coordinate follows: where each begins, its value and slope there, its length.

    All of shape (k,); times are since the start of the run.
    """

    begin: Floats
    value: Floats
    slope: Floats
    length: Floats


def simulate_driven(system: System, state: State, lines: Lines) -> Run:
    """Simulate a motion whose last coordinate follows given lines.

    Parameters
    ----------
    system
        Its last coordinate is free of forces.
    state
        The state at the start, but for the last coordinate and velocity, which the first line
        gives.
    lines
        One at least; each begins where the one before ends.

    Returns
    -------
    Run
        With an event HORIZON at the end of each line. It ends with the last one, or before for a
        reason other than HORIZON.
    """
    m = mechanism_of(system)
    n = m.degrees - 1
    position, velocity = state.position[:n], state.velocity[:n]
    parts: list[Any] = []
    starts: list[tuple[list[float], int]] = []
    first = State((*position, lines.value[0]), (*velocity, lines.slope[0]), state.phase)
    compiled = compile_mechanism(m, first)
    at, why = begin(compiled, first), RunEnd.HORIZON
    for time, value, slope, length in zip(*(part.tolist() for part in lines), strict=True):
        if parts:
            phases = phases_of(m, state.phase + m.omega * time)
            after = parts[-1]["after"][-1].tolist()
            place, speed = [*after[:n], value], [*after[n + 1 : 2 * n + 1], slope]
            at = settled(compiled, compiled.kernel.start(place, speed, phases)["at"])
        starts.append((at.y, at.mode))
        why = _piece(compiled, at, time, length, parts)
        if why is not RunEnd.HORIZON:
            break
    _hand_over(parts, starts, lines)
    y, mode = starts[0]
    return assembled(system, first, compiled, np.array(y), mode, parts, why)


def _piece(compiled: Compiled, at: Any, time: float, length: float, parts: list[Any]) -> RunEnd:
    """Run along one line, and put its times on the clock of the run."""
    while True:
        part = compiled.kernel.simulate(at, length, math.inf, ENDLESS_EVENTS, ENDLESS_EVENTS)
        high = part["high"] + time
        rest = high - time  # two-sum: what the clock loses goes to its lower part
        part["low"] = part["low"] + ((time - (high - rest)) + (part["high"] - rest))
        part["high"] = high
        parts.append(part)
        why = RunEnd(part["why"])
        if why is not RunEnd.MISSING or not compiled.add_code(part["code"]):
            return why


def _hand_over(parts: list[Any], starts: list[tuple[list[float], int]], lines: Lines) -> None:
    """Hand the motion after the event at the end of each line over to the beginning of the next."""
    ends = [part for part in parts if part["why"] == RunEnd.HORIZON]
    followed = zip(ends, starts[1:], lines.value[1:], lines.slope[1:], strict=False)
    for part, (y, mode), value, slope in followed:
        degrees = part["after"].shape[1] // 2
        part["y"][-1], part["mode"][-1] = y, mode
        part["after"][-1, degrees - 1], part["after"][-1, -1] = value, slope
