"""Periodic orbits from a guess, by Newton's method on their segments.

Method      Newton's method (newton.py) on (1)-(3) of problem.py. The signature is given, or taken
            from a simulated motion (closing_segment.py).
Fails       a status with a sentence: no convergence, a guess that leads to rest, a motion without a
            loop, or with one in which contacts that move each other, or other events, are at one instant;
            an orbit with impacts at one instant at which the map has several derivatives (simultaneous.py);
            a motion that only loses energy.
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vibroimpact._core.checks import check_count, check_flag, names_arguments, numbers, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import interruptible
from vibroimpact._core.types import Floats
from vibroimpact.compile.piecewise import code_of_states
from vibroimpact.compile.prescribed import (
    CHATTER_WATCH,
    FORCE_WATCH,
    GAP_WATCH,
    check_prescribed,
    compile_prescribed,
)
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.symmetries import Symmetry
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.closing_segment import (
    ClosingLoop,
    closing_loop,
    cycles_of,
    eventless_loop,
    summed_from,
)
from vibroimpact.orbits.newton import FOUND, NEWTON_HALVINGS, NEWTON_ITERATIONS, newton, scale_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import (
    Flight,
    OrbitProblem,
    Signature,
    forcing_repeats,
    least_cycles,
    mirrors,
    symmetry_of,
    why_none,
    without_events,
)
from vibroimpact.orbits.simultaneous import between, pairs_at_once, why_not_smooth
from vibroimpact.simulation.simulate import Run, simulate

# An orbit that is found twice, even next to a fold, has states that agree so well.
SAME_ORBIT_RELATIVE = 1e-6
AT_ONCE_OF_CYCLE = 1e-9  # the mode in which a state is shows in so long a part of a forcing cycle
SETTLING_IMPACTS = 2000  # so many impacts are simulated from a state


class Guess(NamedTuple):
    """Start of Newton's method: states after the impacts (m, 2n + 1) and flight times (m,)."""

    states: Floats
    durations: Floats

    def __eq__(self, other: object) -> bool:
        return self is other  # arrays have no truth value

    def __hash__(self) -> int:
        return id(self)


@names_arguments()
@interruptible
def find_orbit(
    system: System,
    guess: Orbit | Run | State | Guess,
    *,
    stops: Sequence[tuple[int, int] | str] | None = None,
    cycles: int | None = None,
    symmetric: bool | Symmetry | None = None,
) -> Orbit:
    """Find a periodic orbit near a guess.

    Parameters
    ----------
    system
        The system.
    guess
        An orbit (of this system or one like it), a simulated run or a state to simulate from, or a
        :class:`Guess`. For a run, its end is used, or with ``stops`` their last occurrence;
        for a state without ``stops``, the motion to which it settles. Whole periods of the phase
        do not matter.
    stops
        The sequence of stops: (contact, side) with side +1 (upper, A) or -1 (lower, B), or "A",
        "B" for contact 0. The orbit's first state is just after the first. By default taken from
        the guess. With elements a run or a state to simulate from is needed, which tells the
        changes of state between the impacts; meeting a soft stop counts as an impact. An empty sequence, "", is
        the motion in which nothing happens: the response of the linear machine that the system is at the end of
        the guess.
    cycles
        Forcing cycles until the orbit closes, an integer. By default taken from the guess.
    symmetric
        Solve for an orbit that is its own image under a symmetry of the machine half of the cycles later: True for
        one that fits the stops, or one of :func:`symmetries`. By default if the guess is such an orbit.

    Returns
    -------
    Orbit
        In a family of orbits (``family_dimension``), the one next to the guess. With ``converged``
        False and a sentence in ``status`` where none was reached, where none exists because every
        impact loses energy, where the motion drifts by its momentum, or has impacts at one instant in every
        period at which its map jumps or has several derivatives. Impacts of contacts that do not feel each
        other are a sequence with a flight time of zero.

    Raises
    ------
    InvalidParameterError
        A signature that no orbit can have, or one that contradicts the guess; a guess of another
        kind, or one with states or times that are not finite, times that are not positive; a system
        with more than 10 coordinates or 6 frequencies.

    Notes
    -----
    Cost: some ten Newton steps, each about 0.2 ms for two impacts of the damper.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> vi.find_orbit(damper, vi.State((0.0, 0.0), (0.0, 1.0))).symbol
    '1-1-1'
    """
    sequence = None if stops is None else stops_of(stops)
    if cycles is not None:
        check_count("cycles", cycles, 0)
    if symmetric is not None and not isinstance(symmetric, Symmetry):
        check_flag("symmetric", symmetric)
    check_prescribed(system, mechanism_of(system))
    if sequence == ():
        return _eventless(system, guess, cycles, symmetric)
    if isinstance(guess, State):
        guess = _run_from(system, guess, sequence)
    if isinstance(guess, Orbit):
        return _from_orbit(system, guess, sequence, cycles, symmetric)
    if isinstance(guess, Run):
        return _from_run(system, guess, sequence, cycles, symmetric)
    guess = _checked(guess)
    if sequence is None:
        raise InvalidParameterError("stops = None: states alone do not determine them. Give stops.")
    whole = cycles if cycles is not None else cycles_of(system, float(np.sum(guess.durations)))
    signature = _named(system, Signature(sequence, whole), symmetric)
    return solve(system, signature, _unwound(guess, whole))


def _eventless(
    system: System, guess: Any, cycles: int | None, symmetric: bool | Symmetry | None
) -> Orbit:
    """Orbit without events, in the mode in which a motion is at its end."""
    m = mechanism_of(system)
    if not m.forces:
        raise InvalidParameterError(
            'stops = "": without forcing a motion without events is a free vibration or rest. Give stops.'
        )
    start = guess.state if isinstance(guess, Orbit) else guess
    if isinstance(start, State):
        guess = simulate(system, start, impacts=1, t_max=AT_ONCE_OF_CYCLE * 2.0 * math.pi / m.omega)
    if not isinstance(guess, Run):
        raise refusal("guess", guess, 'an Orbit, Run or State for stops = ""')
    found = eventless_loop(guess, cycles)
    if isinstance(found, str):
        return _nothing(system, None, cycles, found)
    return of_loop(system, found, symmetric)


def of_loop(system: System, loop: ClosingLoop, symmetric: bool | Symmetry | None) -> Orbit:
    """Orbit from a loop, symmetric only if it is said to be."""
    signature = loop.signature
    guess = Guess(loop.states, loop.durations)
    if signature.eventless:
        signature = without_events(
            mechanism_of(system),
            loop.flights[0].mode,
            loop.cycles,
            None if symmetric is None else bool(symmetric),
        )
        guess = Guess(guess.states, guess.durations / len(signature.impacts))
    else:
        signature = _named(system, signature, symmetric)
    return solve(system, signature, _unwound(guess, loop.cycles))


def stops_of(stops: Any) -> tuple[Stop, ...]:
    """Stops of a sequence that the user gives as ``stops``."""
    if not isinstance(stops, Sequence) and not (isinstance(stops, np.ndarray) and stops.ndim):
        raise refusal("stops", stops, "a sequence of stops")
    return tuple(impact_of("stops", given) for given in stops)


def impact_of(name: str, given: Any) -> Stop:
    """A stop as (contact, side), or an error that names the argument."""
    if isinstance(given, str) and given in ("A", "B"):
        return Stop.at(given)
    listed = isinstance(given, Sequence) or (isinstance(given, np.ndarray) and given.ndim)
    pair = tuple(given) if listed else ()
    if len(pair) != 2 or not all(isinstance(part, int | np.integer) for part in pair):
        raise refusal(name, given, '"A", "B" or (contact, side), two integers')
    return Stop(int(pair[0]), int(pair[1]))


def _checked(guess: Any) -> Guess:
    """A guess as arrays of finite numbers, with positive times."""
    if not isinstance(guess, Guess):
        raise refusal("guess", guess, "an Orbit, Run, State or Guess")
    states, durations = guess
    whole = Guess(numbers("guess.states", states), numbers("guess.durations", durations))
    if whole.states.ndim != 2 or not whole.states.size:
        raise InvalidParameterError(
            f"guess.states has shape {whole.states.shape}; expected (m, 2n + 1), m >= 1."
        )
    if whole.durations.ndim != 1 or not (whole.durations > 0.0).all():
        raise refusal("guess.durations", whole.durations, "times > 0, shape (m,)")
    return whole


def _unwound(guess: Guess, cycles: int) -> Guess:
    """Guess without whole periods in its phase, which then keeps most digits."""
    around = 2.0 * math.pi * max(cycles, 1)
    states = guess.states.copy()
    states[:, -1] -= around * math.floor(states[0, -1] / around)
    return Guess(states, guess.durations)


def _from_orbit(
    system: System,
    guess: Orbit,
    sequence: tuple[Stop, ...] | None,
    cycles: int | None,
    symmetric: bool | Symmetry | None,
) -> Orbit:
    known = guess.signature
    impacts = known.impacts if sequence is None else sequence
    if len(impacts) > len(known.impacts):
        raise InvalidParameterError(
            f"stops: the sequence has {len(impacts)} impacts and the guess {len(known.impacts)}. "
            "Give a guess with as many."
        )
    signature = replace(
        known,
        impacts=impacts,
        cycles=known.cycles if cycles is None else cycles,
    )
    if symmetric is not None:
        signature = _named(system, replace(signature, symmetric=False, exchange=()), symmetric)
    return solve(system, signature, unfolded(guess))


def converged(orbit: Any) -> Orbit:
    """Return an orbit for a map or a branch if it is converged.

    Raises
    ------
    InvalidParameterError
        Something else, or an orbit that is not converged.
    """
    if not isinstance(orbit, Orbit) or not orbit.converged:
        raise refusal("orbit", orbit, "a converged orbit, as find_orbit gives")
    return orbit


def unfolded(orbit: Orbit) -> Guess:
    """All segments of an orbit, including the second half of a symmetric one."""
    half, symmetry = Guess(orbit.states, orbit.durations), orbit.problem.symmetry
    if symmetry is None:
        return half
    return with_image(half, symmetry.image(half.states, math.pi * orbit.signature.cycles))


def with_image(half: Guess, image: Floats) -> Guess:
    """The first half of a symmetric loop, or changes of it, and its image."""
    return Guess(np.vstack([half.states, image]), np.tile(half.durations, 2))


def later(states: Floats, turn: float, advance: Floats | float = 0.0) -> Floats:
    """States (x + advance, v, theta + turn) of states (x, v, theta) in rows."""
    moved = states.copy()
    moved[:, : states.shape[1] // 2] += advance
    moved[:, -1] += turn
    return moved


def repeated(once: Guess, cycles: int, times: int, advance: Floats | float = 0.0) -> Guess:
    """Loop of so many forcing cycles, in which coordinates advance, repeated several times."""
    turn = 2.0 * math.pi * cycles
    states = np.vstack([later(once.states, turn * k, advance * k) for k in range(times)])
    return Guess(states, np.tile(once.durations, times))


def rolled(once: Guess, cycles: int, first: int, advance: Floats | float = 0.0) -> Guess:
    """Loop of so many forcing cycles, in which coordinates advance, begun at a later segment."""
    passed = later(once.states[:first], 2.0 * math.pi * cycles, advance)
    return Guess(np.vstack([once.states[first:], passed]), np.roll(once.durations, -first))


def rotated(orbit: Orbit, count: int) -> Orbit:
    """Rotate an orbit, so that a later impact is its first."""
    moved, m = orbit.signature.rolled(count), len(orbit.durations)
    states, durations = rolled(unfolded(orbit), moved.cycles, count, orbit.progress)
    turned = OrbitProblem(orbit.system, moved, orbit.parameter)
    return replace(
        orbit, signature=moved, states=turned.centred(states[:m]), durations=durations[:m]
    )


def solve(
    system: System,
    signature: Signature,
    guess: Guess,
    *,
    iterations: int = NEWTON_ITERATIONS,
    halvings: int = NEWTON_HALVINGS,
) -> Orbit:
    """Solve by Newton's method, from a guess with all impacts of the signature or its solved ones."""
    problem = OrbitProblem(system, signature, "")
    m = len(problem.impacts)
    states = np.array(guess.states, dtype=float)[:m]
    durations = np.array(guess.durations, dtype=float)[:m]
    if states.shape != (m, 2 * problem.mechanism.degrees + 1) or durations.shape != (m,):
        raise InvalidParameterError(
            f"guess has states {states.shape} and durations {durations.shape}; expected "
            f"{(m, 2 * problem.mechanism.degrees + 1)} and {(m,)} for the {m} impacts to solve for."
        )
    start = problem.packed(problem.centred(states), durations)
    z, residual, status = newton(problem, start, iterations, halvings)
    if status != FOUND:
        status = why_none(problem.mechanism, signature.impacts) or status
    states, durations = problem.unpacked(z)
    orbit = Orbit(system, signature, states, durations, residual, status)
    ends = replace(signature, symmetric=False).ends
    why = orbit.converged and why_not_smooth(system, *unfolded(orbit), ends)
    return replace(orbit, status=why) if why else orbit


# ---- one orbit, described in several ways -------------------------------------------------------


def primitive(orbit: Orbit) -> Orbit:
    """Reduce an orbit to its shortest period, and to its half if it is its own mirror image.

    States that agree within SAME_ORBIT_RELATIVE of their size count as equal.
    """
    if not orbit.converged:
        return orbit
    orbit = _in_order(_chatter_summed(orbit))
    signature, guess = orbit.signature, unfolded(orbit)
    count = len(signature.impacts)
    turns = [k for k in range(count, 1, -1) if _repeats(orbit, guess, k)]
    if turns:
        part, shorter = count // turns[0], signature.part(turns[0])
        orbit = solve(orbit.system, shorter, Guess(guess.states[:part], guess.durations[:part]))
        signature, guess = shorter, unfolded(orbit)
    apart, symmetry = nearest_symmetry(orbit.system, signature, guess)
    if orbit.symmetric or symmetry is None or apart > SAME_ORBIT_RELATIVE:
        return orbit
    found = solve(orbit.system, halved(signature, symmetry), guess)
    return found if found.converged else orbit


def _chatter_summed(orbit: Orbit) -> Orbit:
    """Reduce the impacts of chatter to one segment, from where what is left is no longer than a step.

    It begins with the event after a release, so that no chatter goes on from its end to its beginning.
    """
    watches = [end.watch for end in orbit.signature.ends]
    if CHATTER_WATCH not in watches:
        return orbit
    if FORCE_WATCH in watches:
        orbit = rotated(orbit, (watches.index(FORCE_WATCH) + 2) % len(watches))
    signature, compiled = orbit.signature, orbit.problem.own
    parts = compiled.explicit(orbit.states, orbit.durations, signature.ends)
    ends, durations = [*parts.ends], parts.durations.copy()
    times = np.append(0.0, np.cumsum(durations))  # of the events that begin flights, and the last
    kept = np.ones(len(ends), dtype=bool)
    for last in [k for k, end in enumerate(ends) if end.watch == CHATTER_WATCH]:
        impact = ends[last]._replace(watch=GAP_WATCH)
        struck = np.array([  # events that begin flights
            before._replace(mode=impact.mode) == impact and end.mode == impact.mode
            for before, end in zip((parts.ends[-1], *parts.ends), parts.ends, strict=False)
        ])  # fmt: skip
        first = summed_from(last + 1, times, struck, compiled.step(impact.mode))
        ends[first], durations[first] = ends[last], durations[first : last + 1].sum()
        kept[first + 1 : last + 1] = False
    if kept.sum() == len(orbit.durations):
        return orbit
    ends = [end for end, left in zip(ends, kept, strict=True) if left]
    impacts = tuple(Stop(end.contact, end.side) for end in (ends[-1], *ends[:-1]))
    flights = tuple(Flight(end.mode, end.watch) for end in ends)
    regrouped = Signature(impacts, signature.cycles, False, flights)
    return solve(orbit.system, regrouped, Guess(parts.states[kept], durations[kept]))


def _in_order(orbit: Orbit) -> Orbit:
    """Put impacts, or releases, of several contacts at one instant in the order of the contacts; begin after all."""
    ends = orbit.problem.ends
    pairs = [(k, j) for k, j in pairs_at_once(orbit.durations, ends) if j == (k + 1) % len(ends)]
    if orbit.symmetric or not pairs:
        return orbit
    wrong = [k for k, j in pairs if ends[k].contact > ends[j].contact]
    if not wrong:
        within = {j for _, j in pairs}
        return rotated(orbit, min({*range(len(ends))} - within))
    orbit = rotated(orbit, wrong[0])
    impacts, flights, (one, other, *_) = [*orbit.signature.impacts], [], orbit.problem.ends
    after, third = orbit.problem.modes[2 % len(ends)], 2 % len(ends)
    before = orbit.problem.own.after(orbit.states[0], orbit.durations[0], one.mode)
    stops = Stop(*other[:2]), Stop(*one[:2])
    ((state, code),) = between(orbit.system, before, (one.mode, after), stops, one.watch)
    impacts[1], impacts[third] = stops
    if orbit.signature.flights:
        flights = [*orbit.signature.flights]
        flights[1] = Flight(code, one.watch)
    states = orbit.states.copy()
    states[1] = state
    signature = replace(orbit.signature, impacts=tuple(impacts), flights=tuple(flights))
    return _in_order(solve(orbit.system, signature, Guess(states, orbit.durations)))


def _repeats(orbit: Orbit, guess: Guess, k: int) -> bool:
    """Whether an orbit is k repetitions of a shorter one."""
    cycles, part = orbit.signature.cycles, len(orbit.signature.impacts) // k
    if not orbit.signature.repeats(k):
        return False
    if not forcing_repeats(orbit.mechanism, cycles // k):
        return False
    states, kept = guess.states, orbit.problem.kept
    drift = np.append(np.zeros(states.shape[1] - 1), 2.0 * math.pi * cycles / k)
    drift[: orbit.mechanism.degrees] = orbit.progress / k
    change = np.abs(states[part:] - states[:-part] - drift)[:, kept]
    sizes = scale_of(orbit.problem, orbit.problem.packed(orbit.states, orbit.durations))
    return bool(np.all(change <= SAME_ORBIT_RELATIVE * sizes[: len(kept)]))


# ---- signatures of motions -----------------------------------------------------------------------


def _run_from(system: System, state: State, sequence: tuple[Stop, ...] | None) -> Run:
    if sequence is not None:
        return simulate(system, state, impacts=2 * len(sequence) + 1)
    return simulate(system, state, impacts=SETTLING_IMPACTS)


def _from_run(
    system: System,
    run: Run,
    sequence: tuple[Stop, ...] | None,
    cycles: int | None,
    symmetric: bool | Symmetry | None,
) -> Orbit:
    loop = closing_loop(run, sequence, cycles)
    if isinstance(loop, str):
        return _nothing(system, sequence, cycles, loop)
    found = of_loop(system, loop, symmetric)
    free = sequence is None and cycles is None and symmetric is None
    return primitive(found) if free else found


def _nothing(
    system: System, sequence: tuple[Stop, ...] | None, cycles: int | None, status: str
) -> Orbit:
    """Result without an orbit: the requested signature, or else some stop and a whole period."""
    m = mechanism_of(system)
    least = least_cycles(m)
    taken = tuple((e.holding or 0) if i in m.sliders else 0 for i, e in enumerate(m.switching))
    at_rest = code_of_states(taken, len(m.rigid_stops))
    ends = compile_prescribed(system, "", (at_rest,)).ends
    contact, side, *flight = max(end for end in ends if end.contact == 0)  # its upper stop
    flights = (Flight(*flight),) if m.switching else ()
    impacts = (Stop(contact, side),) if sequence is None or m.switching else sequence
    if not forcing_repeats(m, least):
        raise InvalidParameterError(
            f"forces: {[f.omega for f in m.forces]} have no common period: no motion is periodic."
        )
    signature = Signature(impacts, least if cycles is None else cycles, False, flights)
    count = len(OrbitProblem(system, signature, "").impacts)
    states = np.zeros((count, 2 * m.degrees + 1))
    status = why_none(m, impacts) or status
    return Orbit(system, signature, states, np.ones(count), math.inf, status)


def nearest_symmetry(
    system: System, signature: Signature, guess: Guess
) -> tuple[float, Symmetry | None]:
    """Relative distance of a loop from its image half of the cycles later, and under which symmetry it is least.

    Infinite where it has none.
    """
    half = len(signature.impacts) // 2
    found: tuple[float, Symmetry | None] = math.inf, None
    if not half or signature.flights:
        return found
    there = guess.states[half : 2 * half, :-1]
    sizes = np.abs(guess.states[:, :-1]).max(axis=0)
    sizes[sizes == 0.0] = 1.0  # of a coordinate that is zero at every impact, as its image is
    first, second = signature.impacts[:half], signature.impacts[half:]
    for symmetry in mirrors(mechanism_of(system), signature.cycles):
        if second == tuple(map(symmetry.stop, first)):
            image = symmetry.image(guess.states[:half], 0.0)[:, :-1]
            apart = float((np.abs(image - there).max(axis=0) / sizes).max())
            found = min(found, (apart, symmetry), key=lambda pair: pair[0])
    return found


def _named(system: System, signature: Signature, symmetric: bool | Symmetry | None) -> Signature:
    """Signature that is solved under a symmetry: the one that is named, or one that fits its impacts."""
    if not symmetric:
        return signature
    if isinstance(symmetric, Symmetry):
        return halved(signature, symmetric)
    fits = (
        found
        for symmetry in mirrors(mechanism_of(system), signature.cycles)
        if symmetry_of(mechanism_of(system), found := halved(signature, symmetry))
    )
    return next(fits, replace(signature, symmetric=True))


def halved(signature: Signature, symmetry: Symmetry) -> Signature:
    """Signature that is solved as symmetric under a symmetry."""
    exchange = () if symmetry.is_mirror else symmetry.coordinates
    return replace(signature, symmetric=True, exchange=exchange)
