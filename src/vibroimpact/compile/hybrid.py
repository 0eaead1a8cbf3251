"""Compile a mechanism to the hybrid system that the kernel runs: modes, guards, jumps.

Each mode is written in second-order blocks (kernel flow ``modal``): vibration modes where damping
is classical, otherwise the blocks of decoupling.py. Where it finds none, all are written in physical
coordinates (flow ``dense``). With more than two contacts modes are built when they are needed, so
the existence of all blocks is checked at first; with more than four, blocks are used only with
Rayleigh damping (rayleigh.py), for which they always exist.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core import linear
from vibroimpact._core.errors import InvalidParameterError, ResonanceError
from vibroimpact._core.linear import Matrix
from vibroimpact._core.scalars import greatest, is_infinite, least, rounded_down, square_root
from vibroimpact._core.types import Amount, Count, Floats
from vibroimpact.compile.coordinates import (
    STEP_ANGLE,
    Blocks,
    ModeCoordinates,
    blocks_of_modes,
    blocks_of_pairs,
    dense,
    dense_rate,
    force_rows,
    guard_row,
    modal,
    units_of,
    with_energy,
)
from vibroimpact.compile.decoupling import Decoupled, decoupled
from vibroimpact.compile.modes import (
    FASTEST_RATE,
    STEP_BITS,
    ElementOfKernel,
    Guard,
    Jump,
    Law,
    Mode,
    closed_from_code,
    code_of,
    contact_laws,
)
from vibroimpact.compile.pace import (
    PACE_RATIO,
    most_by_forces,
    paced_parts,
    paced_rate,
    paces_of,
)
from vibroimpact.compile.piecewise import Piecewise
from vibroimpact.compile.rayleigh import proportion
from vibroimpact.compile.reduction import Closed, Reduced, reduce
from vibroimpact.compile.vibrations import Vibrations, normal_form, rayleigh_modes, vibration_modes
from vibroimpact.model.mechanism import Mechanism, needs_elements
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop

MOST_CONTACTS_ALL_SETS = 2  # up to this number of contacts, all closed sets are built at first
# Up to this number of contacts, the blocks of all closed sets are found at first.
MOST_CONTACTS_ALL_BLOCKS = 4


FIRST = np.zeros(1, dtype=np.intp)  # number of the system, of one

BlockForm = Vibrations | Decoupled | None  # of a reduced system; None: without blocks


class Hybrid:
    """A mechanism as modes, guards and jumps, in numbers of any kind (scalars.py).

    ``pace`` is that of the motions (pace.py), zero where it is not known. Up to ``most_pace`` nothing
    depends on it.
    """

    given = False  # no element says which mode follows

    def __init__(self, mechanism: Mechanism, pace: float = 0.0) -> None:
        self.mechanism = mechanism
        n, lines = mechanism.degrees, len(mechanism.forces)
        self.size = 2 * (n + lines)
        self._shapes: dict[Closed, tuple[Reduced, BlockForm] | None] = {}
        self._built: dict[Closed, ModeCoordinates] = {}
        self.stops = mechanism.rigid_stops
        few = len(self.stops) <= MOST_CONTACTS_ALL_SETS
        self.proportion = None if few else proportion(mechanism)
        self.closed = self._possible(self._sides()) if few else []
        self.units = list[float]()
        self.omegas = [force.omega for force in mechanism.forces]
        self.dense = False
        modal = self._is_modal()
        by_forces = self._most_by_forces() if modal else []
        self.dense = not modal or pace > least(by_forces, math.inf)
        self.mixed = not self.dense and isinstance(self._block_forms()[0], Decoupled)
        self.own = greatest([self._rate(), *self.omegas])
        self.most_pace = least([PACE_RATIO * self.own, *by_forces])
        self.rate = paced_rate(self.own, pace)
        self.step = rounded_down(STEP_ANGLE / self.rate, STEP_BITS)
        self.kappas = [1.0] * lines if self.dense else self.omegas
        if self.dense:
            self._built.clear()
        self.free = self._coordinates(())

    @property
    def codes(self) -> list[int]:
        """Modes that are built at first; the free one begins."""
        return [code_of(closed) for closed in ((), *self.closed)]

    @property
    def resets(self) -> list[Jump]:
        """Return no resets: rigid stops give no impulses of their own."""
        return []

    @property
    def elements(self) -> list[ElementOfKernel]:
        """Return no elements: rigid stops have no states beside open and closed."""
        return []

    def mode(self, code: int) -> Mode:
        """Compile the mode of a closed set."""
        closed = closed_from_code(code, len(self.stops))
        c = self._coordinates(closed)
        forces = force_rows(self.mechanism, c, closed, self.kappas) if closed else []
        held = {contact: row for (contact, _), row in zip(closed, forces, strict=True)}
        sides = dict(closed)
        rows = [list(self.stops[i].row) for i in sides]
        guards = []
        for i, contact in enumerate(self.stops):
            if i in held:
                row, gain, limits = held[i][:-1], held[i][-1], (0.0, math.inf)
            else:
                row, gain = guard_row(c, contact)
                limits = (contact.lower, contact.upper)
                if closed and linear.null_space([*rows, list(contact.row)]) is None:
                    limits = (-math.inf, math.inf)  # the closed contacts determine its gap, too
            guards.append(Guard(row, gain, *limits, sides.get(i, 0)))
        return Mode(code, c, guards, [], [])

    def _shape(self, closed: Closed) -> tuple[Reduced, BlockForm] | None:
        """Reduced system and blocks of a closed set, computed once."""
        if closed not in self._shapes:
            reduced = reduce(self.mechanism, closed)
            self._shapes[closed] = (reduced, self._block_form(reduced)) if reduced else None
        return self._shapes[closed]

    def _block_form(self, r: Reduced) -> BlockForm:
        if not r.mass:
            return Vibrations([], [], [])
        if self.proportion:
            return rayleigh_modes(r, self.proportion)
        form = normal_form(r)
        return vibration_modes(r, form) or decoupled(r, form)

    def _sides(self) -> list[list[int]]:
        """Sides on which each contact has a stop."""
        contacts = self.stops
        return [
            [s for s in (1, -1) if not is_infinite(Stop(i, s).limit(contacts))]
            for i in range(len(contacts))
        ]

    def _possible(self, sides: list[list[int]]) -> list[Closed]:
        """Sets of contacts that can be closed together, on these sides."""
        sets = [
            tuple(Stop(i, s) for i, s in enumerate(choice) if s)
            for choice in itertools.product(*([0, *some] for some in sides))
        ]
        return [s for s in sets if s and self._shape(s) is not None]

    def _known(self) -> list[Closed]:
        """Closed sets whose blocks are to be found at first.

        The side on which a contact is closed does not matter: a stop exerts no force on a block
        without stiffness.
        """
        count = len(self.stops)
        if self.proportion or not MOST_CONTACTS_ALL_SETS < count <= MOST_CONTACTS_ALL_BLOCKS:
            return self.closed
        return self._on_one_side()

    def _on_one_side(self) -> list[Closed]:
        """Every set of contacts that can be closed together, each on its first side."""
        return self._possible([some[:1] for some in self._sides()])

    def _block_forms(self) -> list[BlockForm]:
        """Block form of every mode whose blocks are found at first."""
        return [(self._shape(closed) or (None, None))[1] for closed in ((), *self._known())]

    def _is_modal(self) -> bool:
        """Whether every mode has blocks, without negative stiffness or damping, and no resonance."""
        if len(self.stops) > MOST_CONTACTS_ALL_BLOCKS and not self.proportion:
            return False
        motions = self._block_forms()
        if not all(v is not None and least([*v.k, *v.c]) >= 0.0 for v in motions):
            return False
        return self._responds()

    def _responds(self) -> bool:
        """Whether the forcing is at no resonance; at one, the full matrix serves."""
        few = len(self.stops) <= MOST_CONTACTS_ALL_BLOCKS
        sets = self._on_one_side() if few else self._known()
        try:
            for closed in ((), *sets):
                self._coordinates(closed)
        except ResonanceError:
            return False
        return True

    def _most_by_forces(self) -> list[float]:
        """Paces up to which the responses to forces are split off."""
        reduced, motion = self._shape(()) or (None, None)
        assert reduced is not None  # the free mode has blocks, being modal
        assert motion is not None
        balanced = motion.balanced if isinstance(motion, Decoupled) else ()
        held = [k for k, force in zip(motion.k, balanced, strict=False) if k > 0.0 and force != 0.0]
        return most_by_forces(_blocks(reduced, motion), self.omegas, held)

    def _rate(self) -> float:
        """Upper estimate of the fastest rate of the mechanical part."""
        if self.dense:
            return 2.0 * dense_rate(self.mechanism)
        found = [v for v in self._block_forms() if v]
        roots = [square_root(x) for v in found for x in v.k]
        return greatest([*roots, *(x for v in found for x in v.c)])

    def _coordinates(self, closed: Closed) -> ModeCoordinates:
        if closed not in self._built:
            self._built[closed] = self._build(closed)
        return self._built[closed]

    def _build(self, closed: Closed) -> ModeCoordinates:
        shape = self._shape(closed)
        if shape is None:
            raise InvalidParameterError(
                f"contacts {closed}: closed together they constrain the same coordinate twice, so "
                "the contact forces are not determined. Remove one of them."
            )
        reduced, motion = shape
        if self.dense:
            c = dense(self.mechanism, reduced, self.size, self.rate / 2.0)
            c = with_energy(c, reduced, self.rate / 2.0)
            self.units = self.units or units_of(self.mechanism, c.flow, self.rate)
            return c.in_units(self.units)
        if motion is None:
            raise ArithmeticError(
                f"contacts {closed}: no blocks, though others of this set had them"
            )
        return modal(self.mechanism, _blocks(reduced, motion), self.size)

    def laws(self) -> list[Law]:
        """Jump at every contact."""
        solve = linear.solver_of_definite(self.mechanism.mass)
        return contact_laws(self.mechanism, self.free, solve)


def _blocks(r: Reduced, motion: Vibrations | Decoupled) -> Blocks:
    if isinstance(motion, Decoupled):
        return blocks_of_pairs(r, motion)
    return blocks_of_modes(r, motion)


def hybrid_of(mechanism: Mechanism, pace: float = 0.0) -> Hybrid | Piecewise:
    """The compiler for a mechanism, for motions of a pace (pace.py)."""
    found = (
        Piecewise(mechanism, searched=True, pace=pace)
        if needs_elements(mechanism)
        else Hybrid(mechanism, pace)
    )
    if not found.rate <= FASTEST_RATE:
        raise InvalidParameterError(
            f"fastest rate = {found.rate!r} per unit of time: must be at most {FASTEST_RATE:.1e}, whose "
            "seventh power is within the range of numbers. Choose another unit of time."
        )
    return found


def _key(m: Mechanism) -> tuple[object, ...]:
    def flat(a: Matrix) -> tuple[float, ...]:
        return tuple(x for row in a for x in row)

    return (
        flat(m.mass), flat(m.damping), flat(m.stiffness), m.forces, m.constant_force,
        m.elements, m.impact_law,
    )  # fmt: skip


class _Keyed:
    """A mechanism as a dictionary key."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.key = mechanism, _key(mechanism)

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Keyed) and self.key == other.key


@lru_cache(maxsize=64)
def _hybrid(keyed: _Keyed, pace: float) -> Hybrid | Piecewise:
    return hybrid_of(keyed.mechanism, pace)


def hybrid_of_numbers(mechanism: Mechanism, pace: float = 0.0) -> Hybrid | Piecewise:
    """Compile a mechanism of floats; equal ones are the same, with the modes that were built since."""
    return _hybrid(_Keyed(mechanism), pace)


class Compiled:
    """Mechanism compiled for the kernel. Modes of closed sets, by ``codes``, are added when first needed."""

    def __init__(
        self, mechanism: Mechanism, pace: Amount = 0.0, codes: Sequence[Count] = ()
    ) -> None:
        self.mechanism, self.pace = mechanism, pace
        self._hybrid = h = hybrid_of_numbers(mechanism, pace)
        self.dense, self.size, self.free = h.dense, h.size, h.free
        self.rate, self.step, self.most_pace, self.units = h.rate, h.step, h.most_pace, h.units
        self.kernel = _kernel.System(
            dense=h.dense,
            mixed=h.mixed,
            dimension=h.size,
            degrees=mechanism.degrees,
            omegas=h.omegas,
            kappas=h.kappas,
            step=h.step,
            laws=[*h.laws()],
            elements=[*h.elements],
            given=h.given,
            sequential=mechanism.impact_law == "sequential",
        )
        for jump in h.resets:
            self.kernel.add_reset(matrix=np.array(jump.matrix), shift=jump.shift)
        self.codes = list[int]()
        for code in (*h.codes, *codes):
            if code not in self.codes:
                self._add_mode(code)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies, in other processes too, are compiled again: with the same modes in the same order."""
        return Compiled, (self.mechanism, self.pace, tuple(self.codes))

    @cached_property
    def _paced(self) -> Floats:
        """Parts of the machine for the pace of its motions, shape (1, P, n + 5)."""
        n = self.mechanism.degrees
        return np.array(paced_parts(self.mechanism), dtype=float).reshape(1, -1, n + 5)

    def pace_of(self, start: State, run: float) -> float:
        """The pace of a run of some length from a start; zero where own rates serve, or it is refused later."""
        if len(start.position) != self.mechanism.degrees:
            return 0.0
        own, most = np.array([self._hybrid.own]), np.array([self.most_pace])
        elements = isinstance(self._hybrid, Piecewise)
        start_and_run = (np.array([x]) for x in (start.position, start.velocity, run))
        return float(paces_of(self._paced, own, most, FIRST, *start_and_run, elements=elements)[0])

    @cached_property
    def piecewise(self) -> Piecewise:
        """Modes with these states and numbers in coordinates of the mechanism."""
        h = self._hybrid
        return h if isinstance(h, Piecewise) else Piecewise(self.mechanism)

    def waves(self, y: Floats, dt: Floats) -> Floats:
        """Waves sin theta, cos theta of every line at times after states, shape (len(dt), 2 lines)."""
        lines = len(self.mechanism.forces)
        pairs = y[:, self.size - 2 * lines :].reshape(len(dt), lines, 2)
        sine, cosine = pairs[:, :, 0], pairs[:, :, 1] / self._hybrid.kappas
        turn = dt[:, None] * [force.omega for force in self.mechanism.forces]
        both = (
            sine * np.cos(turn) + cosine * np.sin(turn),
            cosine * np.cos(turn) - sine * np.sin(turn),
        )
        return np.stack(both, axis=-1).reshape(len(dt), 2 * lines)

    def add_code(self, code: int) -> bool:
        """Compile the mode that the kernel needs; False if it does not exist."""
        if code < 0:
            return False
        try:
            self._add_mode(code)
        except InvalidParameterError:
            return False
        return True

    def _add_mode(self, code: int) -> None:
        opened = code - code % 3 ** len(self.mechanism.rigid_stops)
        if code != opened and opened not in self.codes:  # the kernel comes from it
            self._add_mode(opened)
        mode = self._hybrid.mode(code)
        c = mode.coordinates
        self.kernel.add_mode(
            code=mode.code,
            flow=c.flow,
            guards=[*mode.guards],
            watches=[*mode.watches],
            to_x=np.array(c.to_x),
            to_v=np.array(c.to_v),
            offset=c.offset,
            from_x=np.array(c.from_x),
            from_v=np.array(c.from_v),
            particular=np.array(c.particular).reshape(self.size, -1),
            shift=c.shift,
        )
        self.codes.append(code)


@lru_cache(maxsize=64)
def _compiled(keyed: _Keyed, pace: float) -> Compiled:
    return Compiled(keyed.mechanism, pace)


def compile_mechanism(
    mechanism: Mechanism, start: State | None = None, t_max: float = math.inf
) -> Compiled:
    """Compile, or return the earlier result for equal parameters; for the run from a start, if one is given."""
    keyed = _Keyed(mechanism)
    compiled = _compiled(keyed, 0.0)
    pace = compiled.pace_of(start, t_max) if isinstance(start, State) else 0.0
    return _compiled(keyed, pace) if pace else compiled
