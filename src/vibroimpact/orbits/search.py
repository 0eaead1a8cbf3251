"""Search for periodic orbits with few impacts, from random starts.

Method      From random starts, on every stop (starts.py), or between them where stops move or there
            are elements (starts_between.py), motions are simulated, transients included. Every part
            of a motion that ends on the stop of its beginning, after at most ``most_impacts`` impacts and
            ``most_cycles`` forcing cycles, with
                |states at its ends apart| <= GUESS_GAP_OF_BOX of the box,   |cycles - whole| <= GUESS_GAP_OF_BOX   (1)
            is a guess: motions pass near unstable orbits, and chaos follows them. Guesses closer
            than SAME_GUESS_OF_BOX of the box to an earlier one, or to an orbit, with the same sequence are
            skipped. Newton's method (find.py) solves for a symmetric orbit first where the
            sequence is its own mirror image, then for any. Its result is reduced to the primitive
            orbit, left out if an impact is slower than TOUCH_SPEED_OF_BOX of the box (a motion that only
            touches a stop solves the equations too), and compared with the list: orbits are equal
            if their sequences are, up to rotation, and their states agree within SAME_ORBIT_RELATIVE of the box;
            of a family of orbits with the same sequence one is listed. In a symmetric system the
            mirror image of an orbit is an orbit too (mirror_images.py).                    (2)
            With elements, or rest on stops, the sequence has the changes of states, and parts without impacts begin
            and end with one; orbits are solved as a whole, not as symmetric.
            Symmetric orbits that are known in closed form are guesses as well.
Accuracy    of each orbit, that of find_orbit. The list need not be complete; the evidence is a list
            that more starts and another seed leave unchanged.
Fails       never; guesses without convergence are counted
Reference   theory.md, "Periodic orbits"
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from vibroimpact._core.checks import LARGEST_SEED, check_count, check_progress, names_arguments
from vibroimpact._core.progress import ProgressOption, Reporter, counting, interruptible
from vibroimpact.compile.prescribed import check_prescribed
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.orbits.closing_segment import DRIFTS, ClosingLoop, closing_loop
from vibroimpact.orbits.find import (
    SAME_ORBIT_RELATIVE,
    Guess,
    halved,
    nearest_symmetry,
    of_loop,
    primitive,
    rolled,
    solve,
    unfolded,
)
from vibroimpact.orbits.mirror_images import image_of, symmetries_tried
from vibroimpact.orbits.near_returns import KnownLoops, beginnings, loops_of, unprescribed
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import MOST_CYCLES, Signature, impacting, resisted_translations
from vibroimpact.orbits.search_result import GuessEnd, MotionEnd, OrbitSearch
from vibroimpact.orbits.simultaneous import why_not_smooth
from vibroimpact.orbits.starts import Starts, starts_of
from vibroimpact.orbits.starts_between import StartsBetween, starts_between
from vibroimpact.orbits.symmetric_damper import known_orbits
from vibroimpact.simulation.simulate import COUNTED, ENDS_QUIETLY, Run, RunEnd, Status, simulate

CHANGE_STATUSES = (Status.CHANGE, Status.NON_UNIQUE)
BEYOND = "it settled on an orbit of more than {self.cycles} cycles or {self.impacts} impacts"
LATE_SHARE_OF_MOTION = 0.9  # what happens after this share of the duration of a motion goes on
MOTION_IMPACTS = 200  # each motion is simulated over so many impacts
# The ends of a guess are so near, relative to the box and to a forcing cycle.
GUESS_GAP_OF_BOX = 0.4
SAME_GUESS_OF_BOX = 0.1  # guesses that are nearer, relative to the box, count as equal
NEWTON_ITERATIONS = 12  # 99 of 100 runs of Newton's method that converge need fewer
NEWTON_HALVINGS = 4  # a Newton step is halved so often at most: 99 of 100 need fewer halvings
TOUCH_SPEED_OF_BOX = 1e-6  # an impact that is slower, relative to the box, counts as a touch


@names_arguments()
@interruptible
def find_orbits(
    system: System,
    *,
    most_cycles: int = 2,
    most_impacts: int = 4,
    starts: int = 100,
    seed: int = 0,
    progress: ProgressOption = True,
) -> OrbitSearch:
    """Find periodic orbits with few impacts from random starts.

    Parameters
    ----------
    system
        The system.
    most_cycles
        Largest number of forcing cycles of an orbit, 1 to 1000; ignored without forcing.
    most_impacts
        Largest number of impacts per period, at all stops, >= 1; meeting a soft stop counts as one.
        Those of chatter count until what is left of it is summed.
        Of orbits without impacts it bounds the changes of state of one kind: of one element, at
        one limit, to one state.
    starts
        Motions to simulate, >= 1; they start on the stops in turn, at random places of a box that
        short motions span, with random velocities and phases. Where stops move, or there are
        soft stops, friction or phase switches, they start anywhere in the box between rigid stops.
    seed
        Seed of the random numbers, >= 0: the same seed gives the same list.
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every motion.

    Returns
    -------
    OrbitSearch
        Orbits of any stability, primitive and without repetition, those that are not admissible
        marked with the reason, mirror images marked; and counts of the ends of motions and guesses,
        with the reasons why motions ended on no orbit.

    Raises
    ------
    InvalidParameterError
        Counts out of range; no stop that can be reached, or no place between stops;
        more than 10 coordinates or 6 frequencies.

    Notes
    -----
    Cost: 1 ms per motion and some 5 ms per guess; for the damper five seconds with the defaults,
    ten with ``most_cycles=4, most_impacts=8, starts=50``; with elements 20 to 100 ms per motion. Chaotic
    motions give most guesses. Ctrl-C ends the search without a result; fewer starts give the first
    part of the same list.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> found = find_orbits(damper, most_cycles=1, most_impacts=2, starts=20)
    >>> [(orbit.symbol, orbit.stable) for orbit in found.orbits if orbit.admissible]
    [('1-1-1', False), ('1-1-1', True)]
    """
    check_prescribed(system, mechanism_of(system))
    check_count("most_cycles", most_cycles, 1, MOST_CYCLES)
    for name, value in (("most_impacts", most_impacts), ("starts", starts)):
        check_count(name, value, 1)
    check_count("seed", seed, 0, LARGEST_SEED)
    check_progress(progress)
    sweep = _Sweep(system, most_cycles, most_impacts, _starts_of(system))
    order = range(starts) if progress else counting("starts", starts)
    sweep.try_closed_forms()
    with Reporter(progress, "searching from random starts") as report:
        for number in report.track(order, starts, "motions"):
            sweep.try_motion(np.random.default_rng([seed, number]), number)
    orbits, mirror_of = _sorted(sweep.orbits, sweep.mirror_of)
    return OrbitSearch(
        system, most_cycles, most_impacts, starts, seed, orbits, mirror_of,
        {end: sweep.motions[end] for end in MotionEnd},
        {end: sweep.guesses[end] for end in GuessEnd}, sweep.repeated,
        dict(sorted(sweep.unresolved.items())),
    )  # fmt: skip


@dataclass
class _Sweep:
    """State of a running search."""

    system: System
    cycles: int
    impacts: int
    starts: Starts | StartsBetween
    orbits: list[Orbit] = field(default_factory=list)
    mirror_of: list[int | None] = field(default_factory=list)
    motions: Counter[MotionEnd] = field(default_factory=Counter)
    guesses: Counter[GuessEnd] = field(default_factory=Counter)
    unresolved: Counter[str] = field(default_factory=Counter)
    repeated: int = 0
    eventless: set[int] = field(
        default_factory=set
    )  # modes of which the motion without events is known

    def __post_init__(self) -> None:
        drifts = resisted_translations(mechanism_of(self.system))
        self.tried, self.known = (KnownLoops(self.starts.widths, drifts) for _ in range(2))
        self.symmetries = symmetries_tried(self.system, self.cycles)

    def try_closed_forms(self) -> None:
        """Add the symmetric orbits that have closed forms, admissible or not."""
        if self.impacts >= 2:  # at A and at B
            for closed in known_orbits(self.system):
                self._enter(closed)

    def try_motion(self, rng: np.random.Generator, number: int) -> None:
        """Simulate from a random start and try all loops."""
        m = self.starts.mechanism
        horizon = MOTION_IMPACTS * self.cycles * 2.0 * math.pi / m.omega if m.omega else math.inf
        run = simulate(
            self.system, self.starts.draw(rng, number), impacts=MOTION_IMPACTS, t_max=horizon
        )
        self.motions[_end_of(run)] += 1
        loop = closing_loop(run, None, None)
        if why := self._why_unresolved(loop):
            self.unresolved[why] += 1
        widths = self.starts.widths
        for signature, guess in loops_of(run, self.cycles, self.impacts, widths, GUESS_GAP_OF_BOX):
            if self.tried.has(signature, guess.states, SAME_GUESS_OF_BOX):
                self.repeated += 1
                continue
            self.tried.add(signature, guess.states)
            for wanted in self._signatures(signature, guess):
                found = solve(
                    self.system,
                    wanted,
                    guess,
                    iterations=NEWTON_ITERATIONS,
                    halvings=NEWTON_HALVINGS,
                )
                self._enter(found)
        if not isinstance(loop, str):
            self._try_without_events(loop)

    def _try_without_events(self, loop: ClosingLoop) -> None:
        """Solve for the motion without events where a motion ends with it."""
        if not loop.signature.eventless or loop.cycles > self.cycles:
            return
        mode = loop.flights[0].mode
        if mode not in self.eventless:
            self.eventless.add(mode)
            self._enter(of_loop(self.system, loop, None))

    def _why_unresolved(self, loop: ClosingLoop | str) -> str:
        """Reason of find_orbit for a motion without a loop at its end, or with one beyond the bounds or not smooth.

        "" where the end of the motion nearly closes within the bounds, settled or not.
        """
        if isinstance(loop, str):  # one reason, however far each motion drifts
            return DRIFTS if loop.startswith(DRIFTS) else loop
        struck = sum(impacting(mechanism_of(self.system), loop.signature))
        beyond = loop.cycles > self.cycles or struck > self.impacts
        if beyond and loop.settled:
            return BEYOND.format(self=self)
        return why_not_smooth(self.system, loop.states, loop.durations, loop.signature.ends)

    def _signatures(self, signature: Signature, guess: Guess) -> Iterator[Signature]:
        """Signatures to solve for: a symmetric one where it is possible, then the general one."""
        _, symmetry = nearest_symmetry(self.system, signature, guess)
        if symmetry is not None:
            yield halved(signature, symmetry)
        yield signature

    def _enter(self, orbit: Orbit) -> None:
        """Count the end of a guess; list a new orbit, and its mirror image (2)."""
        orbit = primitive(orbit)
        if not orbit.converged:
            self.guesses[GuessEnd.NOWHERE] += 1
        elif orbit.least_impact_speed <= TOUCH_SPEED_OF_BOX * self.starts.widths[-1]:
            self.guesses[GuessEnd.SPEEDLESS] += 1
        elif self._is_known(orbit):
            self.guesses[GuessEnd.KNOWN] += 1
        else:
            orbit = _from_its_beginning(orbit)
            self._list(orbit, None)
            end = GuessEnd.NEW if orbit.admissible else GuessEnd.INADMISSIBLE
            self.guesses[end] += 1
            self._list_image(orbit)

    def _list_image(self, orbit: Orbit) -> None:
        number = len(self.orbits) - 1
        for symmetry in self.symmetries:
            image = image_of(orbit, symmetry)
            if image is not None and not self._is_known(image):
                self._list(_from_its_beginning(image), number)

    def _is_known(self, orbit: Orbit) -> bool:
        """Whether an orbit is listed, or another one of its family with the same impacts."""
        within = math.inf if orbit.family_dimension else SAME_ORBIT_RELATIVE
        return self.known.has(orbit.signature, unfolded(orbit).states, within)

    def _list(self, orbit: Orbit, mirror_of: int | None) -> None:
        states = unfolded(orbit).states
        self.tried.add(orbit.signature, states)
        self.known.add(orbit.signature, states)
        self.orbits.append(orbit)
        self.mirror_of.append(mirror_of)


def _starts_of(system: System) -> Starts | StartsBetween:
    """Starts on the stops, or between them where these move or there are elements."""
    m = mechanism_of(system)
    moving = any(contact.motion for contact in m.rigid_stops)
    return starts_between(system) if m.switching or moving or m.massless else starts_of(system)


def _end_of(run: Run) -> MotionEnd:
    if run.end is RunEnd.DIVERGED:
        return MotionEnd.DIVERGED
    if unprescribed(run).any():
        return MotionEnd.UNPRESCRIBED
    if run.end is RunEnd.IMPACTS:
        return MotionEnd.IMPACTS
    if run.end in (RunEnd.HORIZON, RunEnd.EVENTS) and len(run):
        late = run.status[run.time > LATE_SHARE_OF_MOTION * run.time[-1]]
        if np.isin(late, COUNTED).any():
            return MotionEnd.IMPACTS
        if np.isin(late, CHANGE_STATUSES).any():
            return MotionEnd.CHANGING
    silent = run.end in (RunEnd.HORIZON, *ENDS_QUIETLY)
    return MotionEnd.SILENT if silent else MotionEnd.BROKEN


def _from_its_beginning(orbit: Orbit) -> Orbit:
    """Rotate an orbit to the first rotation of its sequence, with the least phase."""
    guess, signature = unfolded(orbit), orbit.signature
    phases = guess.states[:, -1] % (2.0 * math.pi)
    first = min(beginnings(signature.impacts, signature.flights), key=lambda k: phases[k])
    states, durations = rolled(guess, signature.cycles, first, orbit.progress)
    around = 2.0 * math.pi * max(signature.cycles, 1)
    states[:, -1] -= around * math.floor(states[0, -1] / around)
    return solve(orbit.system, signature.rolled(first), Guess(states, durations))


def _sorted(
    orbits: list[Orbit], mirror_of: list[int | None]
) -> tuple[tuple[Orbit, ...], tuple[int | None, ...]]:
    """Orbits in the order of OrbitSearch, and the indices of mirror images in that order."""

    def rank(k: int) -> tuple[int, int, str, bool, bool, float]:
        o = orbits[k]
        struck, phase = sum(impacting(o.mechanism, o.signature)), float(o.states[0, -1])
        return (o.signature.cycles, struck, o.symbol, not o.symmetric, not o.admissible, phase)

    order = sorted(range(len(orbits)), key=rank)
    place = {k: new for new, k in enumerate(order)}
    images = [mirror_of[k] for k in order]
    return tuple(orbits[k] for k in order), tuple(None if k is None else place[k] for k in images)
