"""find_orbit: Newton's method on the segments of a periodic orbit.

Method      Newton steps on (1)-(3) of problem.py, scaled by the size of each unknown; a step is
            halved until the residual falls and every flight time stays positive. The signature is
            given, or read off a simulated motion: over the last impacts, the shortest loop that
            closes nearly, in whole forcing cycles.
Fails       a status with a sentence: no convergence, a flight time that shrinks to nothing.
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact.errors import InvalidParameterError
from vibroimpact.orbits import SymmetricOrbit
from vibroimpact.periodic.orbit import CONVERGED, Orbit
from vibroimpact.periodic.prescribed import Impact
from vibroimpact.periodic.problem import OrbitProblem, Signature, asymmetry, forcing_repeats
from vibroimpact.simulate import Run, Status, System, mechanism_of, simulate
from vibroimpact.state import State

Floats = NDArray[np.float64]

ITERATIONS = 40
HALVINGS = 12
NEARLY_CLOSED = 0.25  # of the spread of a motion: a loop of a run that Newton may close
CLOSED = 1e-5  # the same for a settled periodic motion
SAME = 1e-6  # of their size: states of one orbit, found twice, even next to a fold
SETTLING = 2000  # impacts simulated from a state
LONGEST = 60  # impacts of a loop that is looked for


class Guess(NamedTuple):
    """Where Newton's method starts: states after the impacts (m, 2n + 1) and flight times (m,)."""

    states: Floats
    durations: Floats


def find_orbit(
    system: System,
    guess: Orbit | SymmetricOrbit | Run | State | Guess,
    *,
    impacts: Sequence[Impact | str] | None = None,
    cycles: int | None = None,
    symmetric: bool | None = None,
) -> Orbit:
    """Find a periodic orbit near a guess.

    Parameters
    ----------
    system
        The system.
    guess
        An orbit (of this system or one like it), a simulated run or a state to simulate from, or a
        :class:`Guess`. Of a run the end is used; of a state without ``impacts`` what it settles to.
    impacts
        The sequence of stops: (contact, side) with side +1 (upper, A) or -1 (lower, B), or "A",
        "B" for contact 0. The orbit's first state is just after the first. By default read off.
    cycles
        Forcing cycles until the orbit closes. By default read off.
    symmetric
        Solve for an orbit that is its own mirror image. By default where the guess is one.

    Returns
    -------
    Orbit
        With ``converged`` False and a sentence in ``status`` where none was reached.

    Raises
    ------
    InvalidParameterError
        A signature that no orbit can have, or one that contradicts the guess.

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
    sequence = None if impacts is None else tuple(_impact(i) for i in impacts)
    if isinstance(guess, SymmetricOrbit):
        guess = of_symmetric(guess)
    if isinstance(guess, State):
        guess = _run_from(system, guess, sequence)
    if isinstance(guess, Orbit):
        wanted = guess.signature.impacts if sequence is None else sequence
        signature = Signature(
            wanted,
            guess.signature.cycles if cycles is None else cycles,
            guess.symmetric if symmetric is None else symmetric,
        )
        return solve(system, signature, unfolded(guess))
    if isinstance(guess, Run):
        return _from_run(system, guess, sequence, cycles, symmetric)
    if sequence is None:
        raise InvalidParameterError(
            "impacts = None: states alone do not say which stops; give them."
        )
    whole = cycles if cycles is not None else _cycles_of(system, float(np.sum(guess.durations)))
    return solve(system, Signature(sequence, whole, bool(symmetric)), guess)


def _impact(given: Impact | str) -> Impact:
    if isinstance(given, str):
        if given not in ("A", "B"):
            raise InvalidParameterError(f'impacts: {given!r} must be "A", "B" or (contact, side).')
        return 0, 1 if given == "A" else -1
    contact, side = given
    return int(contact), int(side)


def of_symmetric(orbit: SymmetricOrbit) -> Orbit:
    """The closed-form orbit of the damper as an :class:`Orbit`."""
    s = orbit.state
    states = np.array([[*s.position, *s.velocity, s.phase]])
    durations = np.array([math.pi / orbit.damper.omega])
    return solve(orbit.damper, Signature(((0, 1), (0, -1)), 1, True), Guess(states, durations))


def unfolded(orbit: Orbit) -> Guess:
    """All segments of an orbit, of a symmetric one its second half too."""
    if not orbit.symmetric:
        return Guess(orbit.states, orbit.durations)
    mirrored = orbit.states * np.append(np.full(orbit.states.shape[1] - 1, -1.0), 1.0)
    mirrored[:, -1] += math.pi * orbit.signature.cycles
    return Guess(np.vstack([orbit.states, mirrored]), np.tile(orbit.durations, 2))


def rotated(orbit: Orbit, count: int) -> Orbit:
    """The same orbit with a later impact as its first."""
    whole, m = unfolded(orbit), len(orbit.durations)
    signature, turn = orbit.signature, np.zeros(orbit.states.shape[1])
    turn[-1] = 2.0 * math.pi * signature.cycles
    states = np.vstack([whole.states[count:], whole.states[:count] + turn])
    durations = np.roll(whole.durations, -count)
    impacts = (*signature.impacts[count:], *signature.impacts[:count])
    moved = replace(signature, impacts=impacts)
    return replace(orbit, signature=moved, states=states[:m], durations=durations[:m])


def solve(
    system: System,
    signature: Signature,
    guess: Guess,
    *,
    iterations: int = ITERATIONS,
    halvings: int = HALVINGS,
) -> Orbit:
    """Newton's method from a guess with all the signature's impacts, or those solved for."""
    problem = OrbitProblem(system, signature, "")
    m = len(problem.impacts)
    states = np.array(guess.states, dtype=float)[:m]
    durations = np.array(guess.durations, dtype=float)[:m]
    if states.shape != (m, 2 * problem.mechanism.degrees + 1) or durations.shape != (m,):
        raise InvalidParameterError(
            f"guess has states {states.shape} and durations {durations.shape}; expected "
            f"{(m, 2 * problem.mechanism.degrees + 1)} and {(m,)}."
        )
    z, residual, status = newton(problem, problem.packed(states, durations), iterations, halvings)
    states, durations = problem.unpacked(z)
    return Orbit(system, signature, states, durations, residual, status)


def scale_of(problem: OrbitProblem, z: Floats) -> Floats:
    """The size of each unknown: of positions, velocities, phase and time."""
    n, q = problem.mechanism.degrees, problem.size
    rows = np.abs(np.reshape(z, (-1, q + 1)))
    stops = [
        abs(x) for c in problem.mechanism.contacts for x in (c.lower, c.upper) if math.isfinite(x)
    ]
    sizes = np.ones(q + 1)
    sizes[q] = rows[:, q].max()
    sizes[n : 2 * n] = rows[:, n : 2 * n].max()
    sizes[:n] = max(rows[:, :n].max(), *stops, sizes[n] * sizes[q]) or 1.0
    sizes[n : 2 * n] = sizes[n] or sizes[0] / sizes[q]
    return np.tile(sizes, len(rows))


def newton(
    problem: OrbitProblem, z: Floats, iterations: int = ITERATIONS, halvings: int = HALVINGS
) -> tuple[Floats, float, str]:
    """(unknowns, relative residual, status)."""
    sizes = scale_of(problem, z)
    error = math.inf
    for _ in range(iterations):
        residual, matrix, _p = problem.expanded(z, 0.0)
        error = float(np.abs(residual / sizes).max())
        try:
            step = np.linalg.solve(matrix / sizes[:, None] * sizes, -residual / sizes)
        except np.linalg.LinAlgError:
            return z, error, "the Jacobian is singular: a fold or a branch point is at the guess"
        if np.abs(step).max() <= CONVERGED and error <= CONVERGED:
            return z + step * sizes, error, "converged"
        z, shorter = _damped(problem, z, step * sizes, sizes, error, halvings)
        if not shorter:
            return z, error, f"no convergence: relative residual {error:.1e} would not fall further"
    return z, error, f"no convergence in {iterations} steps: relative residual {error:.1e}"


def _damped(
    problem: OrbitProblem, z: Floats, step: Floats, sizes: Floats, error: float, halvings: int
) -> tuple[Floats, bool]:
    """A step, halved until it helps; whether one did."""
    times = slice(problem.size, None, problem.size + 1)
    for _ in range(halvings):
        there = z + step
        if np.all(there[times] > 0.0):
            residual = float(np.abs(problem.residual(there, 0.0) / sizes).max())
            if residual < error or residual <= CONVERGED:
                return there, True
        step = step / 2.0
    return z, False


# ---- one orbit, described in several ways -------------------------------------------------------


def primitive(orbit: Orbit) -> Orbit:
    """The same orbit without repetition, and solved as symmetric where it is its mirror image.

    An orbit that goes k times around a shorter one is that shorter one; states that agree within
    SAME of their size count as equal.
    """
    if not orbit.converged:
        return orbit
    signature, guess = orbit.signature, unfolded(orbit)
    count = len(signature.impacts)
    turns = [k for k in range(count, 1, -1) if _repeats(orbit, guess, k)]
    if turns:
        part, cycles = count // turns[0], signature.cycles // turns[0]
        shorter = Signature(signature.impacts[:part], cycles)
        orbit = solve(orbit.system, shorter, Guess(guess.states[:part], guess.durations[:part]))
        signature, guess = shorter, unfolded(orbit)
    if orbit.symmetric or mirror_distance(orbit.system, signature, guess) > SAME:
        return orbit
    found = solve(orbit.system, replace(signature, symmetric=True), guess)
    return found if found.converged else orbit


def _repeats(orbit: Orbit, guess: Guess, k: int) -> bool:
    """Whether an orbit goes k times around a shorter one."""
    impacts, cycles = orbit.signature.impacts, orbit.signature.cycles
    part = len(impacts) // k
    if len(impacts) % k or cycles % k or impacts != impacts[:part] * k:
        return False
    if not forcing_repeats(orbit.mechanism, cycles // k):
        return False
    states, q = guess.states, orbit.problem.size
    drift = np.append(np.zeros(states.shape[1] - 1), 2.0 * math.pi * cycles / k)
    change = np.abs(states[part:] - states[:-part] - drift)[:, :q]
    sizes = scale_of(orbit.problem, orbit.problem.packed(orbit.states, orbit.durations))[:q]
    return bool(np.all(change <= SAME * sizes))


# ---- signatures read off a motion ----------------------------------------------------------------


def _run_from(system: System, state: State, sequence: tuple[Impact, ...] | None) -> Run:
    if sequence is not None:
        return simulate(system, state, impacts=len(sequence) + 1)
    return simulate(system, state, impacts=SETTLING)


def _cycles_of(system: System, span: float) -> int:
    omega = mechanism_of(system).omega
    return max(1, round(span * omega / (2.0 * math.pi))) if omega else 0


def segments_of(run: Run) -> tuple[Floats, Floats, list[Impact]]:
    """States after the impacts (m, 2n + 1) with growing phase, times, stops of a run's impacts."""
    at = np.flatnonzero(run.status == Status.IMPACT)
    omega = mechanism_of(run.system).omega
    phase = run.start.phase + omega * run.time[at]
    states = np.column_stack([run.position[at], run.velocity_after[at], phase])
    sides = np.where(run.stop[at] == 0, 1, -1)
    return states, run.time[at], list(zip(run.contact[at].tolist(), sides.tolist(), strict=True))


def _from_run(
    system: System,
    run: Run,
    sequence: tuple[Impact, ...] | None,
    cycles: int | None,
    symmetric: bool | None,
) -> Orbit:
    states, times, stops = segments_of(run)
    loop = _loop(system, states, times, stops, sequence, cycles)
    if loop is None:
        wanted = f"with the impacts {sequence}" if sequence else "that closes nearly"
        signature = Signature(sequence or ((0, 1),), cycles or 1)
        size = (1, 2 * mechanism_of(system).degrees + 1)
        return Orbit(system, signature, np.zeros(size), np.ones(1), math.inf,
                     f"the run has no loop {wanted}: {run.end.sentence}")  # fmt: skip
    first, count = loop
    durations = np.diff(times[first : first + count + 1])
    impacts = tuple(stops[first : first + count])
    whole = _cycles_of(system, float(durations.sum())) if cycles is None else cycles
    start, around = states[first : first + count].copy(), 2.0 * math.pi * max(whole, 1)
    start[:, -1] -= around * math.floor(start[0, -1] / around)  # as many digits as there can be
    guess = Guess(start, durations)
    found = solve(system, Signature(impacts, whole, bool(symmetric)), guess)
    free = sequence is None and cycles is None and symmetric is None
    return primitive(found) if free else found


def _loop(
    system: System,
    states: Floats,
    times: Floats,
    stops: list[Impact],
    sequence: tuple[Impact, ...] | None,
    cycles: int | None,
) -> tuple[int, int] | None:
    """(first impact, number of impacts) of the shortest good loop at the end of a run."""
    if len(stops) < 2:
        return None
    spread = np.ptp(states[:, :-1], axis=0) + np.abs(states[:, :-1]).max(initial=0.0) * 1e-9
    best: tuple[float, int, int] | None = None
    counts = range(1, min(len(stops), LONGEST + 1)) if sequence is None else [len(sequence)]
    for count in counts:
        first = len(stops) - 1 - count
        if first < 0 or stops[first] != stops[-1]:
            continue
        if sequence is not None and tuple(stops[first : first + count]) != sequence:
            continue
        distance = float(np.abs((states[-1] - states[first])[:-1] / spread).max())
        turns = (times[-1] - times[first]) * mechanism_of(system).omega / (2.0 * math.pi)
        whole = cycles if cycles is not None else round(turns)
        distance = max(distance, abs(turns - whole)) if mechanism_of(system).omega else distance
        if sequence is not None:
            return first, count
        if distance < NEARLY_CLOSED and (best is None or distance < best[0]):
            best = (distance, first, count)
        if best and best[0] < CLOSED:
            break  # longer loops repeat this one
    return best[1:] if best else None


def mirror_distance(system: System, signature: Signature, guess: Guess) -> float:
    """How far a loop is from its mirror image, relative to its size; infinite where it has none."""
    half = len(signature.impacts) // 2
    first, second = signature.impacts[:half], signature.impacts[half:]
    m = mechanism_of(system)
    if not half or second != tuple((c, -s) for c, s in first) or asymmetry(m, signature.cycles):
        return math.inf
    here, there = guess.states[:half, :-1], guess.states[half : 2 * half, :-1]
    return float(
        (np.abs(here + there).max(axis=0) / np.abs(guess.states[:, :-1]).max(axis=0)).max()
    )


def guess_of(states: ArrayLike, durations: ArrayLike) -> Guess:
    """A :class:`Guess` from anything like arrays."""
    return Guess(np.array(states, dtype=float), np.array(durations, dtype=float))
