"""Modes for the kernel, by their codes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from vibroimpact._core.linear import Matrix, Vector, product, transpose
from vibroimpact.compile.coordinates import ModeCoordinates, columns_by
from vibroimpact.compile.reduction import Closed
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import Stop

STEP_BITS = 20  # binary digits of the step of the march, so that multiples of it are exact
# Seven derivatives at these rates, of 2^256 of the machine's size, stay within range: 256 + 7 * 108 < 1024.
SLOWEST, FASTEST = 2.0**-108, 2.0**108

Guard = tuple[Vector, float, float, float, int]  # row, gain, lower, upper, side closed
# row, gain, lower, upper, element, held, number of a reset and code of the next mode (-1: none)
Watch = tuple[Vector, float, float, float, int, bool, int, int]
# impulse and shift in free coordinates, mobilities, restitutions
Law = tuple[Vector, Vector, Vector, float, float]


def code_of(closed: Closed) -> int:
    """Number of a closed set in the kernel: digits 1 (upper), 2 (lower) in base 3."""
    return sum(stop.digit * 3**stop.contact for stop in closed)


def closed_from_code(code: int, contacts: int) -> Closed:
    """Inverse of :func:`code_of`; states of elements, which count in 3^contacts, are left out."""
    digits = [(i, code // 3**i % 3) for i in range(contacts)]
    return tuple(Stop(i, 1 if digit == 1 else -1) for i, digit in digits if digit)


@dataclass(frozen=True)
class Mode:
    """Mode for the kernel: its code, coordinates with their flow, guards, watches of elements.

    ``elements`` has the force of each along its row, and the speed at which it works on the motion:
    zero where it does no work, as friction that sticks.
    """

    code: int
    coordinates: ModeCoordinates
    guards: list[Guard]
    watches: list[Watch]
    elements: list[tuple[Vector, Vector]]  # rows on (y, 1)

    def rows_in(self, units: Vector) -> Mode:
        """The mode with its rows on coordinates in these units, which its flow is in already."""

        def moved(row: Vector) -> Vector:
            return columns_by(units, [row])[0]

        return replace(
            self,
            guards=[(moved(guard[0]), *guard[1:]) for guard in self.guards],
            watches=[(moved(watch[0]), *watch[1:]) for watch in self.watches],
            elements=[(moved(force), moved(speed)) for force, speed in self.elements],
        )


def contact_laws(
    m: Mechanism, free: ModeCoordinates, accelerations: Callable[[Matrix], Matrix]
) -> list[Law]:
    """Jumps at the contacts of a mechanism, from its free mode and the accelerations by forces, M^-1."""
    if not m.contacts:
        return []
    rows = [list(contact.row) for contact in m.contacts]
    lift = accelerations(transpose(rows))
    mobility = product(rows, lift)
    impulses, shifts = (transpose(product(a, lift)) for a in (free.from_v, free.from_x))
    return [
        (impulses[i], mobility[i], shifts[i], *contact.restitutions)
        for i, contact in enumerate(m.contacts)
    ]
