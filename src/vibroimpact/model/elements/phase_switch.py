"""Phase switches: forces, springs, dashpots and impulses that change at given phases of a forcing line."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from vibroimpact._core.checks import names_arguments, positive, refusal, vector
from vibroimpact._core.codes import NamedCode
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.elements.element import (
    Element,
    Look,
    nonzero_row,
    numbered_looks,
    symbols_of,
)
from vibroimpact.model.harmonic import Harmonic

HALF_TURN_RELATIVE = 2.0**-50  # arcs that are so near to pi, relative to it, are pi long
MOST_ARCS = 5


class PhaseSwitchState(NamedCode):
    """States of a phase switch: its arcs of phase; one longer than a half turn counts as two."""

    ARC_0 = 0
    ARC_1 = 1
    ARC_2 = 2
    ARC_3 = 3
    ARC_4 = 4


@names_arguments(
    period="Give omega, the angular frequency of the line whose phase switches.",
    force="Give forces, one vector for each arc.",
)
@dataclass(frozen=True, slots=True)
class PhaseSwitch(Element):
    """Forces, springs, dashpots and impulses that change at given phases: square waves, kicks, meshing teeth.

    From phase ``phases[k]`` on, to the next one, the constant force ``forces[k]`` acts, and along ``row`` the spring
    ``stiffness[k]`` and the dashpot ``damping[k]``; at ``phases[k]`` itself the impulse ``impulses[k]``.

    Parameters
    ----------
    omega
        Angular frequency of the line.
    phases
        Rising, in [0, 2 pi), 1 to 5 of them. An arc longer than pi counts as two.
    forces
        One vector of shape (n,) for each arc; no forces where left out.
    impulses
        One vector of shape (n,) for the beginning of each arc; no impulses where left out.
    row
        Shape (n,): the spring is as long as u = row . x, its force on the machine -(k u + c u') row. Of a mesh of
        gears u is the transmission error, without backlash.
    stiffness, damping
        k and c, a number for each arc, of any sign; none where left out.

    Raises
    ------
    InvalidParameterError
        Phases that do not rise, other numbers of forces, springs, ... than of phases, springs without a row.

    Notes
    -----
    A spring that changes while it is pressed takes up, or gives off, energy (k' - k) u^2 / 2: it is not conservative.
    """

    kind: ClassVar[str] = "phase_switch"
    State = PhaseSwitchState
    looks: ClassVar[Mapping[int, Look]] = numbered_looks(PhaseSwitchState, "arc", 0.2)
    by_time = True
    motion = ()

    omega: float
    phases: tuple[float, ...]
    forces: tuple[tuple[float, ...], ...] = ()
    impulses: tuple[tuple[float, ...], ...] = ()
    row: tuple[float, ...] = ()
    stiffness: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "omega", positive("omega", self.omega))
        phases = vector("phases", self.phases)
        rising = all(a < b for a, b in itertools.pairwise(phases))
        if not phases or not rising or phases[0] < 0.0 or phases[-1] >= 2.0 * math.pi:
            raise refusal("phases", self.phases, "rising, in [0, 2 pi), one at least")
        object.__setattr__(self, "phases", phases)
        for name in ("forces", "impulses"):
            given = getattr(self, name)
            if not isinstance(given, tuple | list):
                raise refusal(name, given, "a tuple of vectors, one for each phase")
            rows = tuple(vector(name, row) for row in given)
            self._check_count(name, rows)
            object.__setattr__(self, name, rows)
        self._set_springs()
        if len(self.arcs) > MOST_ARCS:
            raise InvalidParameterError(
                f"phases: {len(self.arcs)} arcs up to pi long; must be at most {MOST_ARCS}."
            )

    def _check_count(self, name: str, given: Sequence[object]) -> None:
        """Refuse another number than that of phases, or none."""
        if given and len(given) != len(self.phases):
            raise InvalidParameterError(
                f"{name}: {len(given)} are given; must be one for each of {len(self.phases)} phases."
            )

    def _set_springs(self) -> None:
        """Take springs and dashpots as numbers, and refuse those without a row, or a row without them."""
        for name in ("stiffness", "damping"):
            values = vector(name, getattr(self, name))
            self._check_count(name, values)
            object.__setattr__(self, name, values)
        pressed = bool(self.stiffness or self.damping)
        row = nonzero_row(self.row, "a spring") if len(vector("row", self.row)) else ()
        object.__setattr__(self, "row", row)
        if pressed != bool(row):
            raise InvalidParameterError(
                f"row = {row}, stiffness = {self.stiffness}, damping = {self.damping}: springs and dashpots act along "
                "a row. Give it with them, or neither."
            )
        if not (self.forces or self.impulses or pressed):
            raise InvalidParameterError(
                "forces = (): nothing changes at the phases. Give forces, impulses, or stiffness with a row."
            )

    @property
    def arcs(self) -> tuple[tuple[float, float, int], ...]:
        """Begin, end and number of every arc; one longer than pi comes in two pieces."""
        out = []
        ends = (*self.phases[1:], self.phases[0] + 2.0 * math.pi)
        for k, (begin, end) in enumerate(zip(self.phases, ends, strict=True)):
            pieces = 2 if end - begin > math.pi * (1.0 + HALF_TURN_RELATIVE) else 1
            cuts = [begin + (end - begin) * i / pieces for i in range(pieces)]
            out += [(a, b, k) for a, b in zip(cuts, [*cuts[1:], end], strict=True)]
        return tuple(out)

    def is_half_turn(self, state: int) -> bool:
        """Whether the arc of a state is pi long: it ends where the sine of its begin vanishes, too."""
        begin, end, _ = self.arcs[state]
        return abs((end - begin) / math.pi - 1.0) <= HALF_TURN_RELATIVE

    @property
    def states(self) -> tuple[PhaseSwitchState, ...]:
        """Pieces of its arcs."""
        return tuple(PhaseSwitchState(i) for i in range(len(self.arcs)))

    @property
    def lines(self) -> tuple[Harmonic, ...]:
        """The line whose phase switches, without amplitude."""
        return (Harmonic(self.omega, (0.0,)),)

    def check_size(self, n: int, name: str) -> None:
        """Refuse vectors that do not have n entries; the element has this name."""
        for part in ("forces", "impulses"):
            for row in getattr(self, part):
                vector(f"{name}.{part}", row, n)
        if self.row:
            vector(f"{name}.row", self.row, n)

    def check_massless(self, light: Sequence[int], name: str) -> None:
        """Refuse a coordinate without mass, whose speed an impulse would make infinite."""
        for i in light:
            if any(impulse[i] for impulse in self.impulses):
                raise InvalidParameterError(
                    f"{name}.impulses: one acts on coordinate {i}, which has no mass. Give it a mass."
                )

    def widened(self) -> PhaseSwitch:
        """Copy whose forces, impulses and row have one more entry, which is zero."""
        forces, impulses = (
            tuple((*row, 0.0) for row in rows) for rows in (self.forces, self.impulses)
        )
        row = (*self.row, 0.0) if self.row else ()
        return replace(self, forces=forces, impulses=impulses, row=row)

    def spring_of(self, state: int) -> tuple[float, float]:
        """Stiffness and damping along its row in a state."""
        number = self.arcs[state][2]
        return (
            self.stiffness[number] if self.stiffness else 0.0,
            self.damping[number] if self.damping else 0.0,
        )

    @property
    def stiffest(self) -> list[tuple[float, float]]:
        """Stiffness and damping of each arc."""
        return [self.spring_of(state) for state in self.states] if self.row else []

    @property
    def positions(self) -> list[tuple[float, ...]]:
        """The row of its springs."""
        return [self.row] if self.stiffness else []

    @property
    def own_forces(self) -> tuple[tuple[float, ...], ...]:
        """Forces of the arcs."""
        return self.forces

    @property
    def own_impulses(self) -> tuple[tuple[float, ...], ...]:
        """Impulses at the beginnings of the arcs."""
        return self.impulses

    def caption(self, *sides: int) -> str:
        """Caption of the element in the picture of a machine."""
        if not self.stiffness:
            return "forces that switch at phases"
        return f"{symbols_of(k=self.stiffness)} by turns"
