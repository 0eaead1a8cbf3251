"""Phase switches: forces and impulses that change at given phases of a forcing line."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from vibroimpact._core.checks import names_arguments, positive, refusal, vector
from vibroimpact._core.codes import NamedCode
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.elements.element import Element, Look
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
    """Forces and impulses that change at given phases of a forcing line: square waves, kicks.

    From phase ``phases[k]`` on, to the next one, the constant force ``forces[k]`` acts; at
    ``phases[k]`` itself the impulse ``impulses[k]``.

    Parameters
    ----------
    omega
        Angular frequency of the line.
    phases
        Rising, in [0, 2 pi), 1 to 5 of them. An arc longer than pi counts as two.
    forces
        One vector of shape (n,) for each arc.
    impulses
        One vector of shape (n,) for the beginning of each arc; no impulses where left out.
    """

    kind: ClassVar[str] = "phase_switch"
    State = PhaseSwitchState
    looks: ClassVar[Mapping[int, Look]] = {
        state: Look(f"arc {state.value}", "black", 0.2 * state)
        for state in PhaseSwitchState
        if state
    }
    by_time = True
    row = ()
    motion = ()

    omega: float
    phases: tuple[float, ...]
    forces: tuple[tuple[float, ...], ...]
    impulses: tuple[tuple[float, ...], ...] = ()

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
            if len(rows) != len(phases) and (rows or name == "forces"):
                raise InvalidParameterError(
                    f"{name}: {len(rows)} are given; must be one for each of {len(phases)} phases."
                )
            object.__setattr__(self, name, rows)
        if len(self.arcs) > MOST_ARCS:
            raise InvalidParameterError(
                f"phases: {len(self.arcs)} arcs up to pi long; must be at most {MOST_ARCS}."
            )

    @property
    def arcs(self) -> tuple[tuple[float, float, int], ...]:
        """Begin, end and number of every arc; one longer than pi comes in two pieces."""
        out = []
        ends = (*self.phases[1:], self.phases[0] + 2.0 * math.pi)
        for k, (begin, end) in enumerate(zip(self.phases, ends, strict=True)):
            pieces = max(1, math.ceil((end - begin) / math.pi - HALF_TURN_RELATIVE))
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

    def check_massless(self, light: Sequence[int], name: str) -> None:
        """Refuse a coordinate without mass, whose speed an impulse would make infinite."""
        for i in light:
            if any(impulse[i] for impulse in self.impulses):
                raise InvalidParameterError(
                    f"{name}.impulses: one acts on coordinate {i}, which has no mass. Give it a mass."
                )

    def widened(self) -> PhaseSwitch:
        """Copy whose forces and impulses have one more entry, which is zero."""
        forces, impulses = (
            tuple((*row, 0.0) for row in rows) for rows in (self.forces, self.impulses)
        )
        return replace(self, forces=forces, impulses=impulses)

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
        return "forces that switch at phases"
