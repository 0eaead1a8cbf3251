"""Impacts of several contacts at one instant, as a sequence of single ones.

Method      Contacts whose impulses do not change each other's rates may be taken one after the other, with
            flights of no duration between, as separate masses. Of others there is no sequence: a
            motion beside theirs, with impacts at two instants, goes elsewhere.                          (1)
            Motions beside have the impacts a, b of (1) in either order. With f the vector field in y, f_0 before,
            f_a and f_b after one of them, f_ab after both, and J_a, J_b the linear parts of the impacts, the map
            has one derivative if
                J_b J_a f_0 - J_b f_a - J_a f_b + f_ab = 0.                                              (2)
            It holds where a spring is between two masses, not where a dashpot is, through which the impact of
            one changes the acceleration of the other's gap: there the map has a derivative for each order.
Reference   theory.md, "Impacts at one instant"; (2) is (T87)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from vibroimpact._core.types import Flags, Floats, Integers
from vibroimpact.compile.modes import closed_from_code, digit_in_code
from vibroimpact.compile.prescribed import (
    FORCE_WATCH,
    GAP_WATCH,
    End,
    Prescribed,
    compile_prescribed,
)
from vibroimpact.model.stand_ins import stand_ins
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.admissibility import PLAY_OF_AMPLITUDE
from vibroimpact.orbits.problem import OrbitProblem
from vibroimpact.simulation.simulate import Run, Status

# Numbers that are zero but for rounding, relative to their terms: of one contact and another, and of (2).
NOTHING_OF_TERMS = 1e-12
SMOOTH_OF_TERMS = 1e-9
# A flight that changes less over a range of the parameter takes no time all along.
STAYING_OF_PERIOD = 1e-6
ONE_SIDED = (
    "{} are struck at one instant in every period, and the impact at one changes the acceleration at the other: "
    "the map has a derivative for each order of the impacts, and no multipliers"
)


def named_code(code: int, instead: dict[Stop, Stop]) -> int:
    """Code of a mode with the stops that decide in place of others."""
    for stop, other in instead.items():
        if digit_in_code(code, stop.contact) == stop.digit:
            code += other.digit * 3**other.contact - stop.digit * 3**stop.contact
    return code


def struck_at_once(run: Run) -> dict[int, tuple[Stop, ...]]:
    """Stops that are struck at each simultaneous event of a run, in order; none where there is no sequence (1)."""
    at, found = np.flatnonzero(run.status == Status.SIMULTANEOUS), dict[int, tuple[Stop, ...]]()
    if not at.size:
        return found
    m, before = mechanism_of(run.system), np.array(run.all_codes)[at]
    instead = stand_ins(m)
    for code in {*before.tolist()}:
        here = at[before == code]
        compiled = compile_prescribed(run.system, "", (code,))
        struck = [{Stop(int(run.contact[k]), int(run.limit_side[k]))} for k in here]
        for stop, mask in _reached(run, compiled, code, here):
            for k in np.flatnonzero(mask):
                struck[k].add(stop)
        closed = [] if m.impact_law == "moreau" else closed_from_code(code, len(m.rigid_stops))
        for k, stops in zip(here.tolist(), struck, strict=True):
            names = sorted({instead.get(stop, stop) for stop in stops})
            moves = any(
                _moves(compiled, one, other, code)
                for one in names
                for other in (*names, *closed)
                if other.contact != one.contact
            )
            found[k] = () if moves else (*names,)
    return found


def _reached(
    run: Run, compiled: Prescribed, code: int, here: Integers
) -> Iterator[tuple[Stop, Flags]]:
    """Stops of open contacts in a mode, and at which of some events they are reached."""
    mode = compiled.modes[code]
    both = np.column_stack([run.position[here], run.velocity_before[here]])
    y = compiled.embedded(both, run.start.phase + compiled.omega * run.time[here])
    moving, n = y @ mode.b.T + mode.constant, compiled.degrees
    most = np.abs(y).max(axis=0)
    most[0 : 2 * n : 2] += most[1 : 2 * n : 2]  # where all stops are at zero, lengths by the speeds
    for guard in mode.guards:
        if guard.watch != GAP_WATCH:
            continue
        u, rate = y @ guard.row + guard.gain, moving @ guard.row
        terms = most @ np.abs(guard.row) + abs(guard.gain)
        fastest = np.abs(moving) @ np.abs(guard.row)
        for side, limit in ((-1, guard.lower), (1, guard.upper)):
            if not math.isinf(limit):
                touches = np.abs(u - limit) <= PLAY_OF_AMPLITUDE * (terms + abs(limit))
                yield (
                    Stop(guard.contact, side),
                    touches & (side * rate > NOTHING_OF_TERMS * fastest),
                )


def _moves(compiled: Prescribed, one: Stop, other: Stop, code: int) -> bool:
    """Whether the impact at a stop in a mode changes the rate of another's gap."""
    row = np.array(compiled.mechanism.rigid_stops[other.contact].row)
    terms = row * compiled.impulse(End(*one, code))[1 : 2 * compiled.degrees : 2]
    return bool(abs(terms.sum()) > NOTHING_OF_TERMS * np.abs(terms).sum())


def together(run: Run) -> Flags:
    """Mask of the events at which contacts that move each other are struck at one instant."""
    found = np.zeros(len(run), dtype=bool)
    found[[k for k, stops in struck_at_once(run).items() if not stops]] = True
    return found


def released_at_once(run: Run, codes: Sequence[int]) -> dict[int, tuple[Stop, ...]]:
    """Contacts that are released at one event of a run where they are several, as stops of a release.

    ``codes`` are those of the modes at the start and after each event.
    """
    contacts, found = len(mechanism_of(run.system).rigid_stops), dict[int, tuple[Stop, ...]]()
    for k in np.flatnonzero(run.status == Status.RELEASE).tolist():
        left = [one.contact for one in closed_from_code(codes[k + 1], contacts)]
        closed = closed_from_code(codes[k], contacts)
        found[k] = tuple(Stop(one.contact, -1) for one in closed if one.contact not in left)
    return found


def between(
    system: System, state: Floats, codes: tuple[int, int], stops: Sequence[Stop], watch: int
) -> Iterator[tuple[Floats, int]]:
    """(x, v, theta), and the code of the mode, after each but the last of the events at one instant.

    ``state`` is that before them, ``codes`` are those before and after them; ``watch`` is that of impacts or releases.
    """
    code, after = codes
    for stop in stops[:-1]:
        compiled = compile_prescribed(system, "", (code,))
        state = compiled.linearise(state[None], np.zeros(1), [End(*stop, code, watch)]).after[0]
        taken, left = (digit_in_code(one, stop.contact) for one in (after, code))
        code += (taken - left) * 3**stop.contact
        yield state, code


def pairs_at_once(durations: Floats, ends: Sequence[End]) -> list[tuple[int, int]]:
    """Pairs of ends of flights, the first before the second, between which an orbit takes no time.

    Those of impacts of different contacts, or of releases.
    """
    shortest, count, found = PLAY_OF_AMPLITUDE * float(durations.sum()), len(ends), []
    for k, end in enumerate(ends):
        j = (k + 1) % count
        while j != k and abs(durations[j]) <= shortest:
            if end.watch == ends[j].watch and end.watch in (GAP_WATCH, FORCE_WATCH):
                found.append((k, j))
            j = (j + 1) % count
    return [(k, j) for k, j in found if ends[k].contact != ends[j].contact]


def why_not_smooth(system: System, states: Floats, durations: Floats, ends: Sequence[End]) -> str:
    """Sentence about impacts at one instant that have a derivative for each order; "" where (2) holds.

    States (m, 2n + 1) after the events of an orbit, flight times, and the ends of the flights.
    """
    for k, j in pairs_at_once(durations, ends):
        changes = [ends[(i + 1) % len(ends)].mode - ends[i].mode for i in (k, j)]
        before = compile_prescribed(system, "", (ends[k].mode,))
        state = before.after(states[k], durations[k], ends[k].mode)
        y = before.embedded(state[:-1], state[-1])
        if not _smooth(system, y, (ends[k], ends[j]), (changes[0], changes[1])):
            names = " and ".join(Stop(*ends[i][:2]).words for i in (k, j))
            return ONE_SIDED.format(names)
    return ""


def staying_at_once(
    problem: OrbitProblem,
    z: Floats,
    derivatives: Callable[[], tuple[Floats, Floats]],
    spans: Sequence[float],
) -> frozenset[int]:
    """Segments of an orbit that take no time, nor do, to first order, over spans of the parameters.

    ``derivatives`` gives those of the residual by the unknowns z and by the parameters, shape (d, k).
    """
    times = slice(problem.size, None, problem.size + 1)
    whole = float(z[times].sum())
    none = np.flatnonzero(np.abs(z[times]) <= PLAY_OF_AMPLITUDE * whole)
    if not none.size:
        return frozenset()
    by_z, by_parameters = derivatives()
    tangents = np.linalg.lstsq(by_z, -by_parameters, rcond=None)[0]
    moved = np.abs(tangents[times][none]) @ np.array(spans)
    return frozenset(none[moved <= STAYING_OF_PERIOD * whole].tolist())


def _smooth(system: System, y: Floats, ends: tuple[End, End], changes: tuple[int, int]) -> bool:
    """Whether (2) holds of two events at one instant, with these changes of the code of the mode, from y before."""
    code = ends[0].mode
    codes = code, code + changes[0], code + changes[1], code + sum(changes)
    compiled = compile_prescribed(system, "", tuple(sorted({*codes})))

    def field(code: int, y: Floats) -> Floats:
        mode = compiled.modes[code]
        return mode.b @ y + mode.constant

    jumps, here = [], field(code, y)
    for end in ends:
        own = end._replace(mode=code)
        share = 1.0 + Stop(*end[:2]).restitution(compiled.mechanism.rigid_stops)
        impulse, row = share * compiled.impulse(own), compiled.guard(own).row
        jumps.append(
            (
                np.eye(len(y)) - np.outer(impulse, row @ compiled.modes[code].b),
                -impulse * (row @ here),
            )
        )
    (a, by_a), (b, by_b) = jumps
    terms = [
        b @ a @ here,
        -b @ field(codes[1], y + by_a),
        -a @ field(codes[2], y + by_b),
        field(codes[3], y + by_a + by_b),
    ]
    return bool(np.abs(sum(terms)).max() <= SMOOTH_OF_TERMS * np.abs(terms).max())
