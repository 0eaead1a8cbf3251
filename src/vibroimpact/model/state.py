"""States of a mechanism: positions, velocities, phase."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields

from vibroimpact._core.checks import names_arguments, real, shown, vector
from vibroimpact._core.errors import InvalidParameterError

COORDINATE = re.compile(r"[xv]\d+|phase")  # a name of a coordinate of a state


@names_arguments()
@dataclass(frozen=True, slots=True)
class State:
    """State of a motion at one instant.

    Parameters
    ----------
    position, velocity
        Coordinates and their rates, shape (n,).
    phase
        Phase theta of the first forcing line, radians, any finite value; other lines have the
        phase they reach at the time phase / omega of the first.

    Notes
    -----
    A state on a stop within rounding starts exactly on it; a state behind a stop is refused by
    :func:`vibroimpact.simulate`.
    """

    position: tuple[float, ...]
    velocity: tuple[float, ...]
    phase: float = 0.0

    def __post_init__(self) -> None:
        position = vector("position", self.position)
        velocity = vector("velocity", self.velocity)
        if len(position) != len(velocity):
            raise InvalidParameterError(
                f"position = {shown(position)}, velocity = {shown(velocity)}: must be as long as each other, a number "
                "for each coordinate."
            )
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "velocity", velocity)
        object.__setattr__(self, "phase", real("phase", self.phase))

    def perturbed(self, amount: float) -> State:
        """The state with ``amount`` added to its phase.

        A shift of phase keeps a state on its stop and excites every direction of the section.
        """
        return State(self.position, self.velocity, self.phase + real("amount", amount))


STATE = tuple(field.name for field in fields(State))  # also the names in datasets of many states


def names_of_state(degrees: int) -> list[str]:
    """Names of the coordinates of a state: x1, ..., v1, ..., phase."""
    return [f"{kind}{i + 1}" for kind in "xv" for i in range(degrees)] + ["phase"]
