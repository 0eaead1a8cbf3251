"""Equations of a periodic orbit with a prescribed sequence of impacts and changes of state.

Method      Unknowns are, for every segment k, the state zeta_k = (x, v, theta) just after an event
            and the flight time t_k to the next; with the parameter p, and F the flight of a segment
            in its mode and the impact at its end, if it is one (theory.md, "Periodic orbits"),
                F(zeta_k, t_k, p) - zeta_(k+1) = 0,    row . y - limit = 0 at its end,          (1)
                zeta_m = zeta_0 + (0, 0, 2 pi cycles)                                           (2)
            or, for orbits that a symmetry S: x -> G x + c, theta -> theta + pi cycles of the machine maps to
            themselves, G a signed permutation and S S the identity (model/symmetries.py), half of the segments and
                zeta_m = S zeta_0.                                                              (3)
            Along a displacement d that changes nothing (translations.py) and that friction or a dashpot to the
            ground resists, the orbit need not close: with j an entry of d that is 1, in place of (2)
                (zeta_m - zeta_0)_i - d_i (zeta_m - zeta_0)_j = 0, i other than j;   x_j of zeta_0 = 0;  (4)
            (zeta_m - zeta_0)_j is the progress. The multiplier 1 along d is left out.
            What is held in every mode, a stop that is rested on or friction that sticks, closes whatever its
            place and speed are. In place of one entry each of (2) stand
                row . x = limit of a stop that is rested on,   row . v = speed of the stop or belt;    (5)
            friction sticks anywhere: the guess gives its place, and there is an orbit for each. The
            multipliers are 0 along what (5) gives, and 1 along these places.
            Times being unknowns, the equations stay regular where an impact grazes.
            Without forcing theta and its equation are left out; the period is free.
Accuracy    Jacobians by jets through the same flight; no differences.
Reference   theory.md, "Periodic orbits"; the paper's (11) is (1), (2) for the impact damper.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from itertools import compress
from typing import NamedTuple, TypeVar

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Count, Flags, Floats
from vibroimpact._kernel import Closing
from vibroimpact.compile.along import Along
from vibroimpact.compile.modes import closed_from_code
from vibroimpact.compile.piecewise import held_in, state_in
from vibroimpact.compile.prescribed import (
    CHATTER_WATCH,
    FORCE_WATCH,
    GAP_WATCH,
    NONE_LEFT_OUT,
    PHASE,
    PHASE_WATCH,
    PLACE_WATCH,
    SPEED_WATCH,
    End,
    Linearised,
    Prescribed,
    compile_prescribed,
)
from vibroimpact.model.mechanism import Mechanism, as_array, symmetric
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.stop import Stop
from vibroimpact.model.symmetries import Symmetry, symmetries_of
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.model.translations import Translations, translations_of

Value = float | tuple[float, ...]  # of the parameter, or of several
Key = TypeVar("Key")
Made = TypeVar("Made")

SAME_AT_ALL_VALUES = (  # of the parameter, among the attributes of equations
    "signature", "parameter", "impacts", "ends", "modes", "codes", "degrees", "massless", "kept", "size", "turn",
    "symmetry", "source", "signs", "drifts", "pivots", "relative", "held", "common_sizes", "struck",
    "closing_equations", "at_once",
)  # fmt: skip
# So many of the latest evaluations are kept, those of some panels of a branch.
KEPT_EVALUATIONS = 64
WHOLE_RATIO_WITHIN = 1e-9  # a ratio of forcing frequencies that is so near to a whole number is one
RESTS_WHOLE = "orbits that rest on a stop are solved as a whole"
MOST_CYCLES = 1000  # forcing frequencies may be commensurate over so many cycles at most


class Held(NamedTuple):
    """What every mode of an orbit holds, as equations (5) on the first state."""

    ends: tuple[End, ...]  # limits at which it is: places and speeds
    places: Floats  # rows, by the unknowns of a state, of places that stay as they are in the guess
    entries: list[
        int
    ]  # of the unknowns of a state, one for each of these: their equations (2) are replaced


class Keeping(NamedTuple):
    """Left sides of (5), and their derivatives by the first state and, last, by the parameter."""

    values: Floats
    rows: Floats


class Flight(NamedTuple):
    """A flight: the code of its mode, and which of its guards ends it, as in :class:`End`."""

    mode: Count
    watch: int = GAP_WATCH


@dataclass(frozen=True)
class Signature:
    """Sequence of impacts over a number of forcing cycles; with elements, of changes of state, too.

    Parameters
    ----------
    impacts
        (contact, side) of every impact of the period, side +1 for the upper stop (A) and -1 for
        the lower (B); the orbit's first state is just after the first of them. With elements, every
        event: a rigid stop, or the number of an element and the side of the limit that is reached.
    cycles
        Periods of the first forcing line until the orbit closes; 0 where there is no forcing.
    symmetric
        Whether the second half is the image of the first under a symmetry.
    exchange
        Coordinates of the :class:`~vibroimpact.Symmetry`; empty for that which changes the sign of each.
    flights
        :class:`Flight` after each impact; empty for a machine without elements that rests on no
        stop. Where it does, the events are its impacts, the end of chatter and the release, with
        the contact; of the release the side is -1. A motion without events has one in their place,
        which is a phase (:func:`without_events`).
    """

    impacts: tuple[Stop, ...]
    cycles: Count
    symmetric: bool = False
    flights: tuple[Flight, ...] = ()
    exchange: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for name, kind in (("impacts", Stop), ("flights", Flight)):
            given = getattr(self, name)
            if type(given) is not tuple or not all(type(part) is kind for part in given):
                object.__setattr__(self, name, tuple(kind(*part) for part in given))

    @property
    def eventless(self) -> bool:
        """Whether nothing happens in its orbits but that the phase goes round."""
        return bool(self.flights) and self.flights[0].watch == PHASE_WATCH

    @property
    def solved(self) -> tuple[Stop, ...]:
        """Impacts at the ends of the segments that are solved for."""
        count = len(self.impacts) // 2 if self.symmetric else len(self.impacts)
        around = (*self.impacts, self.impacts[0])
        return around[1 : count + 1]

    @property
    def ends(self) -> tuple[End, ...]:
        """Ends of the flights of the segments that are solved for, with the modes of the flights."""
        flights = self.flights or (Flight(0),) * len(self.impacts)
        return tuple(
            End(*stop, *flight) for stop, flight in zip(self.solved, flights, strict=False)
        )

    @property
    def first(self) -> End:
        """The first impact, at the end of the last flight."""
        return End(*self.impacts[0], *(self.flights or (Flight(0),))[-1])

    @property
    def begun(self) -> tuple[int, ...]:
        """Watch of the guard with which each entry of the impacts begins its flight."""
        watches = [flight.watch for flight in self.flights or (Flight(0),) * len(self.impacts)]
        return (*watches[-1:], *watches[:-1])

    def image(self, symmetry: Symmetry) -> Signature:
        """Signature of the image under a symmetry, of a machine without elements."""
        return replace(self, impacts=tuple(symmetry.stop(s) for s in self.impacts))

    def rolled(self, count: int) -> Signature:
        """Signature that begins so many impacts later."""
        impacts, flights = self.impacts, self.flights
        return replace(
            self,
            impacts=impacts[count:] + impacts[:count],
            flights=flights[count:] + flights[:count],
        )

    def repeated(self, times: int) -> Signature:
        """Signature of several periods, not solved as symmetric."""
        return Signature(self.impacts * times, self.cycles * times, False, self.flights * times)

    def part(self, times: int) -> Signature:
        """Signature of which this one is the repetition."""
        count = len(self.impacts) // times
        return Signature(self.impacts[:count], self.cycles // times, False, self.flights[:count])

    def repeats(self, times: int) -> bool:
        """Whether it is the repetition of a shorter one."""
        whole = len(self.impacts) % times == 0 and self.cycles % times == 0
        return whole and replace(self, symmetric=False) == self.part(times).repeated(times)


def without_events(m: Mechanism, mode: int, cycles: int, symmetric: bool | None) -> Signature:
    """Signature of the motion in which a forced machine stays in a mode: that of a linear machine.

    It is cut where the phase is a multiple of 2 pi, and, where it is its own mirror image, of pi.
    By default (``symmetric`` None) it is one where the machine has the symmetry and the mode has no elements.
    """
    if symmetric is None:
        symmetric = not mode and any(symmetry.is_mirror for symmetry in mirrors(m, cycles))
    sides = (1, -1) if symmetric else (1,)
    flights = tuple(Flight(mode, PHASE_WATCH) for _ in sides)
    return Signature(tuple(Stop(PHASE, side) for side in sides), cycles, symmetric, flights)


def resisted_translations(m: Mechanism) -> Translations:
    """Displacements that change nothing, but for forces against their speed: orbits need not close along them.

    Those that nothing resists keep their momentum: a family of orbits, of which those are solved for that close.
    """
    every = translations_of(m)
    rows = [np.array(element.row) for element in m.elements if element.row]
    damping = as_array(m.damping)
    seen = [
        bool(np.abs(damping @ d).max() > 0.0 or any(abs(row @ d) > 0.0 for row in rows))
        for d in every.directions.T
    ]
    return Translations(every.directions[:, seen], tuple(compress(every.references, seen)))


def pivots_of(directions: Floats, *others: int) -> list[int]:
    """Entries by which displacements are measured: one of each, the largest that are left, and others than some."""
    left, found = directions.copy(), list[int]()
    for k in range(left.shape[1]):
        sizes = np.abs(left[:, k])
        sizes[[*others, *found]] = 0.0
        j = int(np.argmax(sizes))
        found.append(j)
        left = left - np.outer(left[:, k] / left[j, k], left[j]) * (np.arange(left.shape[1]) > k)
    return found


def check_signature(m: Mechanism, signature: Signature) -> None:
    """Refuse a signature that no orbit of the mechanism can have."""
    impacts, cycles = signature.impacts, signature.cycles
    given = len(signature.flights)
    if given not in (0, len(impacts)) or (m.switching and not given):
        raise InvalidParameterError(
            f"stops: of a machine with {len(m.switching)} elements, {given} flights "
            f"are given for {len(impacts)} impacts; must be one for each, of a machine without "
            "elements none. Give a run, a state or an orbit, which know them."
        )
    limits = [(c.lower, c.upper) for c in m.rigid_stops]
    for (contact, side), watch in zip(impacts, signature.begun, strict=True):
        if (contact >= len(limits) and m.switching) or watch in (FORCE_WATCH, PHASE_WATCH):
            continue
        if not 0 <= contact < len(limits) or side not in (-1, 1):
            raise InvalidParameterError(
                f"stops: ({contact}, {side}) is not a stop. Contacts are 0 to {len(limits) - 1}, "
                "sides +1 (upper, A) and -1 (lower, B)."
            )
        if math.isinf(limits[contact][side > 0]):
            raise InvalidParameterError(f"stops: contact {contact} has no stop on side {side}.")
    if not impacts:
        raise InvalidParameterError(
            "impacts = (): give a phase in their place, as without_events does."
        )
    if (cycles < 1) if m.forces else (cycles != 0):
        allowed = "at least 1" if m.forces else "0: there is no forcing"
        raise InvalidParameterError(f"cycles = {cycles}: must be {allowed}.")
    if not forcing_repeats(m, cycles):
        ratios = [force.omega / m.omega for force in m.forces]
        raise InvalidParameterError(
            f"cycles = {cycles}: the forcing, with frequency ratios {ratios}, is not periodic then."
        )
    if signature.symmetric:
        _check_symmetry(m, signature)


def impacting(m: Mechanism, signature: Signature) -> list[bool]:
    """Return which entries of a signature are impacts: at rigid stops, and where soft stops are met."""
    contacts, flights, begun = len(m.rigid_stops), signature.flights, signature.begun
    out = []
    for k, (number, _) in enumerate(signature.impacts):
        if number < contacts:
            out.append(begun[k] == GAP_WATCH)
            continue
        before, after = (state_in(m, flights[i].mode, number) for i in (k - 1, k))
        out.append(m.elements[number].is_met(before, after))
    return out


def forcing_repeats(m: Mechanism, cycles: int) -> bool:
    """Whether so many cycles of the first line are whole periods of every line."""
    turns = [cycles * force.omega / m.omega for force in m.forces]
    return all(abs(t - round(t)) <= WHOLE_RATIO_WITHIN * t for t in turns)


def least_cycles(m: Mechanism) -> int:
    """Cycles of the first line in the common period of all lines; 0 without forcing.

    For incommensurable lines, those of their nearest fractions, which are no common period.
    """
    ratios = [Fraction(f.omega / m.omega).limit_denominator(MOST_CYCLES) for f in m.forces]
    return math.lcm(*(ratio.denominator for ratio in ratios)) if ratios else 0


def _check_symmetry(m: Mechanism, signature: Signature) -> None:
    half = len(signature.impacts) // 2
    first, second = signature.impacts[:half], signature.impacts[half:]
    rests = any(flight.watch in (FORCE_WATCH, CHATTER_WATCH) for flight in signature.flights)
    why = asymmetry(m, signature.cycles) or (rests and RESTS_WHOLE)
    opposite = second == tuple(stop.opposite for stop in first)
    if symmetry_of(m, signature) is None and not (why and opposite):
        exchanged = "stops and sides exchanged" if signature.exchange else "the sides exchanged"
        raise InvalidParameterError(
            f"stops = {signature.impacts}: not symmetric; the second half must be the first with "
            f"{exchanged}."
        )
    if why:
        raise InvalidParameterError(f"symmetric = True: {why}.")


def symmetry_of(m: Mechanism, signature: Signature) -> Symmetry | None:
    """The symmetry that maps the first half of a sequence to the second one; None where none does."""
    half = len(signature.impacts) // 2
    first, second = signature.impacts[:half], signature.impacts[half:]
    for symmetry in mirrors(m, signature.cycles):
        named = (
            symmetry.is_mirror
            if not signature.exchange
            else symmetry.coordinates == signature.exchange
        )
        if named and second == tuple(map(symmetry.stop, first)):
            return symmetry
    return None


def images_of(m: Mechanism) -> tuple[Symmetry, ...]:
    """Symmetries under which orbits of a forced machine have images; none with soft stops and friction."""
    return symmetries_of(m) if m.forces and not m.switching else ()


def mirrors(m: Mechanism, cycles: int) -> tuple[Symmetry, ...]:
    """Symmetries (3) of a machine without soft stops and friction, that are later by half of the cycles."""
    ratios = np.array([force.omega / m.omega for force in m.forces])
    return tuple(
        symmetry
        for symmetry in images_of(m)
        if symmetry.is_involution
        and np.all(np.cos(ratios * (symmetry.turn - math.pi * cycles)) > 1.0 - WHOLE_RATIO_WITHIN)
    )


def asymmetry(m: Mechanism, cycles: int) -> str:
    """Reason why no symmetry is later by half of the cycles; "" if one is."""
    if mirrors(m, cycles):
        return ""
    return oddness(m, cycles) or "no symmetry of the machine is later by half of the cycles"


def oddness(m: Mechanism, cycles: int) -> str:
    """Reason why (x, v) -> (-x, -v) over half of the cycles is no symmetry; "" if it is one."""
    if m.switching and not any(m.constant_force):
        return "orbits of soft stops and friction are solved as a whole"
    return asymmetry_without_elements(m, cycles)


def asymmetry_without_elements(m: Mechanism, cycles: int) -> str:
    """Reason why (x, v) -> (-x, -v) is no symmetry of the stops and forces alone; "" if it is one."""
    if any(m.constant_force):
        return "a constant force has no mirror image"
    for i, contact in enumerate(m.rigid_stops):
        if (
            contact.motion
            or contact.lower != -contact.upper
            or contact.restitutions[0] != contact.restitutions[1]
        ):
            return f"the stops of contact {i} are not mirror images of each other"
    if not m.forces:
        return "an orbit without forcing has no half cycle to compare with"
    for force in m.forces:
        turns = cycles * force.omega / m.omega
        if abs(turns - round(turns)) > WHOLE_RATIO_WITHIN * turns or round(turns) % 2 == 0:
            return (
                f"the force of frequency {force.omega} does not change sign after half the period"
            )
    return ""


def why_none(m: Mechanism, impacts: Iterable[Stop]) -> str:
    """Reason why no motion with these impacts is periodic (energy is lost); "" if one may be."""
    damping = np.array(m.damping)
    driven = m.forces or m.switching or not symmetric(m.stiffness)
    if driven or np.linalg.eigvalsh(damping + damping.T).min() < 0.0:
        return ""
    if all(stop.restitution(m.rigid_stops) == 1.0 for stop in impacts):
        return ""
    return "no orbit: without forcing every impact loses energy, so that no motion is periodic"


def latest(
    kept: dict[Key, Made], key: Key, make: Callable[[Key], Made], most: int = KEPT_EVALUATIONS
) -> Made:
    """Value kept for a key, made if it is missing; the oldest of so many is then dropped."""
    found = kept.get(key)
    if found is None:
        if len(kept) >= most:
            del kept[next(iter(kept))]
        found = kept[key] = make(key)
    return found


@dataclass
class OrbitProblem:
    """Equations (1)-(3) as functions of the unknowns z and the parameter p.

    Parameters
    ----------
    system
        The system; its own value of the parameter is not used.
    signature
        Impacts and cycles of the orbit.
    parameter
        Name of the parameter.

    Attributes
    ----------
    impacts, ends
        Stops at the ends of the segments, and the same with their modes and guards.
    modes
        Mode of each segment; ``codes`` are the different ones.
    kept
        Entries of zeta that are unknowns: without forcing not theta, and of massless coordinates not
        the velocities, which follow from the others; ``size`` is their number.
    drifts
        d of (4), shape (size, k) by the unknowns of a state; ``pivots`` are the numbers j.
    symmetry, source, signs
        S of (3), None for other orbits; entry k of the image of a change of a state is signs[k] times entry source[k].
    common_sizes
        Sizes of the changes of the unknowns, the same for all orbits of a branch; None where each orbit has its own.
    held
        What all modes hold (5).
    at_once
        Numbers of the segments that take no time in all orbits of a branch (simultaneous.py).
    """

    system: System
    signature: Signature
    parameter: str
    impacts: tuple[Stop, ...] = field(init=False)
    ends: tuple[End, ...] = field(init=False)
    _systems: dict[Value, System] = field(default_factory=dict, init=False, repr=False)
    _compiled: dict[Value, Prescribed] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        check_signature(self.mechanism, self.signature)
        if self.parameter:
            parameter_value(self.system, self.parameter)
        self.impacts, self.ends = self.signature.solved, self.signature.ends
        self.modes = tuple(end.mode for end in self.ends)
        self.codes = tuple(sorted({*self.modes}))
        self.common_sizes: Floats | None = None
        self.at_once: frozenset[int] = frozenset()
        self.degrees, self.massless = self.mechanism.degrees, self.mechanism.massless
        n, massless = self.degrees, self.massless
        entries = range(2 * n + (1 if self.mechanism.forces else 0))
        self.kept = [i for i in entries if i - n not in massless]
        self.size = len(self.kept)
        self.turn = np.zeros(self.size)
        self.symmetry, self.source, self.signs = None, np.arange(self.size), np.ones(self.size)
        if self.signature.symmetric:
            self.symmetry = symmetry_of(self.mechanism, self.signature)
            assert self.symmetry is not None
            self.turn[:n] = self.symmetry.shift
            numbers = np.arange(1, 2 * n + 2)  # of (x, v, theta)
            image = self.symmetry.change(numbers[None].astype(float))[0, self.kept]
            self.source = np.searchsorted(self.kept, np.abs(image).astype(int) - 1)
            self.signs = np.sign(image)
        if self.mechanism.forces:
            share = 0.5 if self.signature.symmetric else 1.0
            self.turn[-1] = 2.0 * math.pi * self.signature.cycles * share
        self.drifts, self.pivots = np.zeros((self.size, 0)), []
        self.held = Held((), np.zeros((0, self.size)), [])
        resisted = resisted_translations(self.mechanism).directions
        if resisted.size and not self.signature.symmetric:
            self.drifts = np.zeros((self.size, resisted.shape[1]))
            self.drifts[:n] = resisted
            self.pivots = pivots_of(self.drifts, self.left_out(self.own))
            self.drifts = self.drifts @ np.linalg.inv(self.drifts[self.pivots])
        self.relative = np.eye(self.size)  # of (4)
        self.relative[:, self.pivots] -= self.drifts
        self.relative[self.pivots] = 0.0
        self.held = self._held()

    def _held(self) -> Held:
        """What all modes hold; of constraints that follow from others one is taken."""
        m, none = self.mechanism, self.held
        held = held_in(m, self.codes)
        if not held:
            return none
        ends = [
            end
            for end in self.own.ends
            if end.watch in (PLACE_WATCH, SPEED_WATCH) and end.mode == self.modes[0]
        ]
        states = np.zeros((len(ends), 2 * m.degrees + 1))
        rows = self.own.linearise(states, np.zeros(len(ends)), ends).gap_by[:, self.kept]
        places = none.places
        for contact, _ in held[len(closed_from_code(self.modes[0], len(m.rigid_stops))) :]:
            place = np.append(m.elements[contact].row, np.zeros(self.size - m.degrees))
            if not (place @ self.drifts).any():  # else the drift says where
                places = np.vstack([places, place])
        every = np.vstack([rows, places])
        if m.forces:
            every[:, -1] = 0.0
        rank = np.linalg.matrix_rank
        kept = [k for k in range(len(every)) if rank(every[: k + 1]) > rank(every[:k])]
        first = sum(k < len(ends) for k in kept)
        fixed = every[kept[first:]]
        left_out = self.left_out(self.own)
        others = np.delete(every[kept], left_out, axis=1)
        barred = [left_out] if others.any(axis=1).all() else []
        entries = pivots_of(every[kept].T, *self.pivots, *barred)
        return Held(tuple(ends[k] for k in kept[:first]), fixed, entries)

    def _keeping(self, z: Floats, p: Value) -> Keeping | None:
        """Left sides of (5) and their derivatives; None where nothing is held in all modes."""
        return self.keeping(z, self.compiled(p)) if self.held.entries else None

    def keeping(self, z: Floats, compiled: Prescribed) -> Keeping:
        """Left sides of (5), with derivatives by the parameter for which the system is compiled."""
        ends, places, _ = self.held
        state = np.repeat(self.unpacked(z)[0][:1], len(ends), axis=0)
        parts = compiled.linearise(state, np.zeros(len(ends)), ends)
        rows = np.vstack([parts.gap_by[:, [*self.kept, -1]], np.pad(places, ((0, 0), (0, 1)))])
        return Keeping(np.append(parts.gap, np.zeros(len(places))), rows)

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism of the system."""
        return mechanism_of(self.system)

    @cached_property
    def along(self) -> Along:
        """The system compiled along the parameter."""
        return Along(self.system, (self.parameter,) if self.parameter else (), self.codes)

    @cached_property
    def struck(self) -> Flags:
        """Which of the segments end with an impact, shape (m,)."""
        every = impacting(self.mechanism, self.signature)
        return np.roll(every, -1)[: len(self.impacts)]

    def system_at(self, p: Value) -> System:
        """System at the value p of the parameter; the latest ones, with their mechanisms, are kept."""
        return latest(self._systems, p, self._system)

    def _system(self, p: Value) -> System:
        return self.along.system_at(self._values(p))

    def _values(self, p: Value) -> tuple[float, ...]:
        """Values of the parameters, of which there may be none."""
        return p if isinstance(p, tuple) else (p,) if self.parameter else ()

    @cached_property
    def own(self) -> Prescribed:
        """The system itself, compiled."""
        return compile_prescribed(self.system, self.parameter, self.codes)

    def at(self, p: Value) -> OrbitProblem:
        """The equations of the system at the value p of the parameter, which is compiled."""
        problem = OrbitProblem.__new__(OrbitProblem)
        same = {name: getattr(self, name) for name in SAME_AT_ALL_VALUES}
        vars(problem).update(
            same, system=self.system_at(p), own=self.compiled(p), _systems={}, _compiled={}
        )
        return problem

    def compiled(self, p: Value) -> Prescribed:
        """System at the value p of the parameter, compiled; the latest ones are kept."""
        return latest(self._compiled, p, self._compile)

    def _compile(self, p: Value) -> Prescribed:
        return self.along.at(self._values(p))

    def packed(self, states: Floats, durations: Floats) -> Floats:
        """Unknowns z from states (m, 2n + 1) and flight times (m,)."""
        return np.column_stack([states[:, self.kept], durations]).ravel()

    def unpacked(self, z: Floats) -> tuple[Floats, Floats]:
        """States (m, 2n + 1) and flight times (m,) from z; zero where zeta has no unknown."""
        return self.closing_equations.unpacked(z)

    def states_at(self, z: Floats, p: Value) -> Floats:
        """States (m, 2n + 1) from z, with the velocities of massless coordinates."""
        states = self.unpacked(z)[0]
        if not self.massless:
            return states
        return self.compiled(p).with_speeds(states, self.modes)

    def linearised(self, z: Floats, p: Value) -> Linearised:
        """Every segment with its derivatives."""
        states, durations = self.unpacked(z)
        return self.compiled(p).linearise(states, durations, self.ends)

    def residual(self, z: Floats, p: Value) -> Floats:
        """Left sides of (1) and (2) or (3), shape of z."""
        return self.expanded(z, p)[0]

    @cached_property
    def closing_equations(self) -> Closing:
        """Equations (1)-(4), in the kernel."""
        return Closing(
            entries=2 * self.degrees + 1, segments=len(self.impacts), kept=self.kept, source=self.source.tolist(),
            signs=self.signs.tolist(), turn=self.turn.tolist(), relative=self.relative.ravel().tolist(),
            pivots=self.pivots,
        )  # fmt: skip

    def expanded(self, z: Floats, p: Value) -> tuple[Floats, Floats]:
        """Residual, and its derivatives by z and, last, by p, shape (d, d + 1)."""
        parts = self.linearised(z, p)
        left, by = self.closing_equations.equations(
            z, parts.after, parts.gap, parts.after_by, parts.gap_by
        )
        if keeping := self._keeping(z, p):
            at = (len(self.impacts) - 1) * (self.size + 1) + np.array(self.held.entries)
            left[at], by[at] = keeping.values, 0.0
            by[at, : self.size], by[at, -1] = keeping.rows[:, :-1], keeping.rows[:, -1]
        return left, by

    def progress(self, z: Floats, p: Value) -> Floats:
        """Progress of (4) along each displacement, shape (k,)."""
        first = np.reshape(z, (len(self.impacts), self.size + 1))[0, : self.size]
        return (self.linearised(z, p).after[-1, self.kept] - first)[self.pivots]

    def progress_by(self, z: Floats, p: Value) -> Floats:
        """Derivatives of the progress by z and, last, by p, shape (k, d + 1)."""
        parts, q = self.linearised(z, p), self.size
        columns = [*self.kept, 2 * self.degrees + 1]
        entries = [self.kept[j] for j in self.pivots]
        out = np.zeros((len(self.pivots), len(z) + 1))
        last = (len(self.impacts) - 1) * (q + 1)
        out[:, last : last + q + 1] = parts.after_by[-1][np.ix_(entries, columns)]
        out[range(len(self.pivots)), self.pivots] -= 1.0
        out[:, -1] = parts.after_by[-1][entries, -1]
        return out

    def centred(self, states: Floats) -> Floats:
        """States (m, 2n + 1) displaced so that the first fulfils (4)."""
        if not self.pivots:
            return states
        out = states.copy()
        first = states[0, [self.kept[j] for j in self.pivots]]
        out[:, self.kept] -= self.drifts @ first
        return out

    def jacobian(self, z: Floats, p: Value) -> tuple[Floats, Floats]:
        """Derivatives of the residual by z, shape (d, d), and by p, shape (d,)."""
        by = self.expanded(z, p)[1]
        return by[:, :-1], by[:, -1]

    def reflected(self, changes: Floats) -> Floats:
        """Images under G of changes of a state, its unknowns along the first axis."""
        signs = self.signs if changes.ndim == 1 else self.signs[:, None]
        return signs * changes[self.source]

    def left_out(self, compiled: Prescribed, end: End | None = None) -> int:
        """Number, among the unknowns of a state, of the one that the section of an event leaves out."""
        first = end or self.signature.first
        found = compiled.solved_coordinate(first)
        if found == NONE_LEFT_OUT:
            return found
        number = self.kept.index(found)
        if number in self.held.entries:
            slopes = np.abs(compiled.slopes(first, np.zeros(compiled.size))[self.kept])
            slopes[self.held.entries] = 0.0
            number = int(np.argmax(slopes))
        return number
