"""Reversals of slip at which friction would stick, so that an orbit with them is no motion.

Method      Where the static level is above the kinetic one, both states may be possible at slip speed
            zero, and friction sticks (theory.md, "Elements"). A flight that ends with the reversal of
            a slip is compared with the mode in which that friction sticks: the reversal is no motion
            if the force that holds it is within the static level.
Accuracy    a force within LIMIT_OF_AMPLITUDE of the level counts as beyond it
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Floats
from vibroimpact.compile.piecewise import code_of_states, state_in, states_from_code
from vibroimpact.compile.prescribed import End, Prescribed, compile_prescribed
from vibroimpact.model.elements.friction import FrictionState
from vibroimpact.model.friction_lines import friction_lines
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.admissibility import LIMIT_OF_AMPLITUDE


def held_reversal(system: System, states: Floats, ends: Sequence[End]) -> str:
    """Sentence about the first reversal at which friction would stick; "" where there is none.

    ``states`` (m, 2n + 1) begin the flights that have these ends.
    """
    m = mechanism_of(system)

    def compiled_in(code: int) -> Prescribed:
        return compile_prescribed(system, "", (code,))

    for k, end in enumerate(ends):
        following = (k + 1) % len(ends)
        mode = ends[following].mode
        if end.contact < len(m.rigid_stops):
            continue
        both = {state_in(m, code, end.contact) for code in (end.mode, mode)}
        if both != m.elements[end.contact].slipping:
            continue
        beyond = beyond_static(
            m, compiled_in, mode, end.contact, states[following], LIMIT_OF_AMPLITUDE
        )
        if beyond is not None and beyond < 0.0:
            return f"friction {end.contact} would stick at the end of flight {k}, where it reverses"
    return ""


def one_level(m: Mechanism, contact: int) -> bool:
    """Whether a contact is friction of one level, on something with mass: a surface on which motions slide."""
    contacts, number = len(m.rigid_stops), contact - len(m.rigid_stops)
    if contact < contacts or m.switching[number].holding is None or number in m.sliders:
        return False
    return all(m.switching[i].grip.static == m.switching[i].grip.kinetic for i in _line(m, number))


def far_limit(
    compiled: Prescribed, mode: int, contact: int, before: int
) -> tuple[End, Floats, float]:
    """Limit at which friction that sticks lets a slip go on through zero, and the margin to it.

    Parameters
    ----------
    compiled
        Equations of the orbit.
    mode
        Code of the mode in which it sticks.
    contact
        Number of the friction among contacts and elements.
    before
        State in which it slipped before.

    Returns
    -------
    tuple
        The limit; the row r and the constant g of its margin r . y + g, positive inside.
    """
    guards = [guard for guard in compiled.modes[mode].guards if guard.contact == contact]
    limits = [  # the force that ends a stick in BACKWARD first
        (End(contact, side, mode, guard.watch), -side * guard.row, side * (limit - guard.gain))
        for guard in guards
        for side, limit in ((1, guard.upper), (-1, guard.lower))
        if not is_infinite(limit)
    ]
    return limits[1 if before == FrictionState.BACKWARD else 0]


def _line(m: Mechanism, number: int) -> Mapping[int, float]:
    """Frictions that stick together with one, by number, and the factors of their rows."""
    return friction_lines(m.switching, [*m.sliders]).get(number, {number: 1.0})


def held_code(m: Mechanism, mode: int, contact: int) -> int:
    """Code of the mode in which a friction sticks, and with it all that are on its line."""
    contacts, number = len(m.rigid_stops), contact - len(m.rigid_stops)
    line = _line(m, number)
    held, after = m.switching[number].holding, states_from_code(mode, contacts, len(m.switching))
    stuck = tuple(held if held is not None and i in line else s for i, s in enumerate(after))
    return code_of_states(stuck, contacts)


def beyond_static(
    m: Mechanism,
    compiled_in: Callable[[int], Prescribed],
    mode: int,
    contact: int,
    state: Floats,
    play: float = 0.0,
) -> float | None:
    """Force that would hold friction at a reversal, less its static level; None where that is the kinetic one.

    Negative where friction would stick.

    Parameters
    ----------
    m
        The mechanism.
    compiled_in
        Compiles it in the mode of a code.
    mode
        Code of the mode after the reversal.
    contact
        Number of the friction among contacts and elements.
    state
        (x, v, theta) at the reversal.
    play
        What is added, relative to the terms of the force.
    """
    number = contact - len(m.rigid_stops)
    grips = [m.switching[i].grip for i in _line(m, number)]
    if all(grip.static == grip.kinetic for grip in grips):
        return None
    code = held_code(m, mode, contact)
    compiled = compiled_in(code)
    y = compiled.embedded(state[:-1], np.array(state[-1]))
    beyond = []
    for guard in compiled.modes[code].guards:
        if guard.contact == contact:
            u = guard.row @ y + guard.gain
            size = np.abs(guard.row) @ np.abs(y) + abs(guard.gain)
            beyond.append(float(max(u - guard.upper, guard.lower - u) + play * size))
    return max(beyond) if beyond else None
