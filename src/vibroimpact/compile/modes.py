"""Modes for the kernel, by their codes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from vibroimpact._core.linear import Matrix, Vector, product, transpose
from vibroimpact.compile.coordinates import ModeCoordinates, columns_by
from vibroimpact.compile.reduction import Closed
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import Stop

STEP_BITS = 20  # binary digits of the step of the march, so that multiples of it are exact
# Seven derivatives at these rates, of 2^256 of the machine's size, stay within range: 256 + 7 * 108 < 1024.
SLOWEST_RATE = 2.0**-108
FASTEST_RATE = 2.0**108


class Guard(NamedTuple):
    """Condition that ends a mode at a rigid stop: on the gap while it is open, the force while it is closed.

    ``lower <= row . y + gain <= upper``; ``side`` is that of a closed stop, 0 of an open one.
    """

    row: Vector
    gain: float
    lower: float
    upper: float
    side: int = 0


class Watch(NamedTuple):
    """Condition that ends the state of an element: ``lower <= row . y + gain <= upper`` holds while it lasts."""

    row: Vector
    gain: float
    lower: float
    upper: float
    element: int  # its number among the elements that switch
    held: bool = False  # whether the mode keeps the row at zero: slip, while friction sticks
    reset: int = -1  # number of the map of y that acts where a limit is reached; -1 for none
    target: int = -1  # code of the mode that follows; -1 where the kernel decides


class Jump(NamedTuple):
    """Map y <- matrix y + shift where a watch reaches its limit.

    An impulse adds to velocities alone: its matrix is the unit matrix, and the guard that is reached stays as it is.
    Where a state is kept, only the unused entries of y return to 1, so that tangents lose their part along them.
    """

    matrix: Matrix
    shift: Vector
    kind: Literal["impulse", "reset", "kept"]


class Law(NamedTuple):
    """Jump at a rigid stop: impulse and shift in free coordinates, mobilities, restitutions."""

    impulse: Vector
    mobilities: Vector
    shift: Vector
    restitution_lower: float
    restitution_upper: float


class Work(NamedTuple):
    """Force of an element along its row, and the speed at which it works, as rows on (y, 1).

    The speed is zero where the force does no work on the motion, as that of friction that sticks.
    """

    force: Vector
    speed: Vector


class ElementOfKernel(NamedTuple):
    """Numbers that the kernel has of an element.

    A bit for each state that it may have, whether it is a stop, whether it acts on a coordinate without mass.
    """

    states: int
    soft: bool
    joint: bool


def code_of(closed: Closed) -> int:
    """Number of a closed set in the kernel: digits 1 (upper), 2 (lower) in base 3."""
    return sum(stop.digit * 3**stop.contact for stop in closed)


def digit_in_code(code: int, contact: int) -> int:
    """Digit of a contact in the code of a mode: 0 where it is open."""
    return int(code // 3**contact % 3)


def closed_from_code(code: int, contacts: int) -> Closed:
    """Inverse of :func:`code_of`; states of elements, which count in 3^contacts, are left out."""
    digits = [(i, digit_in_code(code, i)) for i in range(contacts)]
    return tuple(Stop(i, 1 if digit == 1 else -1) for i, digit in digits if digit)


@dataclass(frozen=True)
class Mode:
    """Mode for the kernel: its code, coordinates with their flow, guards, watches and work of elements."""

    code: int
    coordinates: ModeCoordinates
    guards: list[Guard]
    watches: list[Watch]
    work: list[Work]

    def rows_in(self, units: Vector) -> Mode:
        """The mode with its rows on coordinates in these units, which its flow is in already."""

        def moved(row: Vector) -> Vector:
            return columns_by(units, [row])[0]

        return replace(
            self,
            guards=[guard._replace(row=moved(guard.row)) for guard in self.guards],
            watches=[watch._replace(row=moved(watch.row)) for watch in self.watches],
            work=[Work(moved(force), moved(speed)) for force, speed in self.work],
        )


def contact_laws(
    m: Mechanism, free: ModeCoordinates, accelerations: Callable[[Matrix], Matrix]
) -> list[Law]:
    """Jumps at the contacts of a mechanism, from its free mode and the accelerations by forces, M^-1."""
    if not m.rigid_stops:
        return []
    rows = [list(contact.row) for contact in m.rigid_stops]
    lift = accelerations(transpose(rows))
    mobility = product(rows, lift)
    impulses, shifts = (transpose(product(a, lift)) for a in (free.from_v, free.from_x))
    return [
        Law(impulses[i], mobility[i], shifts[i], *contact.restitutions)
        for i, contact in enumerate(m.rigid_stops)
    ]
