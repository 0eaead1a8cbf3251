"""Reversals of slip at which friction would stick, so that an orbit with them is no motion.

Method      Where the static level is above the kinetic one, both states may be possible at slip speed
            zero, and friction sticks (theory.md, "Elements"). A flight that ends with the reversal of
            a slip is compared with the mode in which that friction sticks: the reversal is no motion
            if the force that holds it is within the static level.
Accuracy    a force within LIMIT_OF_AMPLITUDE of the level counts as beyond it
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibroimpact._core.types import Floats
from vibroimpact.compile.piecewise import code_of_states, states_from_code
from vibroimpact.compile.prescribed import End, compile_prescribed
from vibroimpact.model.friction_lines import friction_lines
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.admissibility import LIMIT_OF_AMPLITUDE


def held_reversal(system: System, states: Floats, ends: Sequence[End]) -> str:
    """Sentence about the first reversal at which friction would stick; "" where there is none.

    ``states`` (m, 2n + 1) begin the flights that have these ends.
    """
    m = mechanism_of(system)
    contacts, count = len(m.rigid_stops), len(m.switching)
    lines = friction_lines(m.switching, [*m.sliders])
    for k, end in enumerate(ends):
        number, following = end.contact - contacts, (k + 1) % len(ends)
        line = lines.get(number, {number: 1.0})  # all on it stick together
        if number < 0 or not any(
            grip.static != grip.kinetic for grip in (m.switching[i].grip for i in line)
        ):
            continue
        before, after = (
            states_from_code(mode, contacts, count) for mode in (end.mode, ends[following].mode)
        )
        if {before[number], after[number]} != m.switching[number].slipping:
            continue
        held = m.switching[number].holding
        stuck = tuple(held if held is not None and i in line else s for i, s in enumerate(after))
        if _lasts(system, code_of_states(stuck, contacts), end.contact, states[following]):
            return f"friction {end.contact} would stick at the end of flight {k}, where it reverses"
    return ""


def _lasts(system: System, code: int, number: int, state: Floats) -> bool:
    """Whether the guards of an element hold in a mode at a state."""
    compiled = compile_prescribed(system, "", (code,))
    y = compiled.embedded(state[:-1], np.array(state[-1]))
    margins = []
    for guard in compiled.modes[code].guards:
        if guard.contact == number:
            size = np.abs(guard.row) @ np.abs(y) + abs(guard.gain)
            u = guard.row @ y + guard.gain
            margins.append(min(guard.upper - u, u - guard.lower) - LIMIT_OF_AMPLITUDE * size)
    return bool(margins) and bool(min(margins) > 0.0)
