"""Listed starts for the members of a sweep."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import numbers
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.model.state import State, names_of_state
from vibroimpact.sweeps.states import States


@dataclass(frozen=True, eq=False)
class ListedStarts:
    """List of starts, such as the final states of the members of another sweep.

    Parameters
    ----------
    position, velocity
        Coordinates and their rates, shape (k, n).
    phase
        Phase of the first forcing line [rad], shape (k,); 0 if not given. With several lines whole
        turns count, as for :class:`~vibroimpact.State`: 2 pi need not be a period of the others.

    Raises
    ------
    InvalidParameterError
        Other shapes, no starts, values that are not finite.

    Notes
    -----
    One dimension, start. A start behind a stop is not moved: the member ends with the status
    INITIAL_PENETRATION.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> starts = vi.ListedStarts([[0.0, 0.0], [0.1, 0.2]], [[0.0, 1.0], [0.0, 0.5]])
    >>> starts.dims
    {'start': 2}
    """

    position: ArrayLike
    velocity: ArrayLike
    phase: ArrayLike | None = None

    def __post_init__(self) -> None:
        position = _finite("position", self.position)
        if position.ndim != 2 or not position.size:
            raise InvalidParameterError(
                f"position has shape {position.shape}; expected (k, n), k starts of n coordinates."
            )
        phase = np.zeros(len(position)) if self.phase is None else self.phase
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "velocity", _finite("velocity", self.velocity, position.shape))
        object.__setattr__(self, "phase", _finite("phase", phase, position.shape[:1]))

    @property
    def base(self) -> State:
        """The first start."""
        return self.states().state(0)

    @property
    def dims(self) -> dict[str, int]:
        """One dimension: start."""
        return {"start": len(self.states().phase)}

    @property
    def coords(self) -> dict[str, tuple[str, Floats]]:
        """All coordinates, by name."""
        position, velocity, phase = self.states()
        names = names_of_state(position.shape[1])
        columns = (*position.T, *velocity.T, phase)
        return {name: ("start", values) for name, values in zip(names, columns, strict=True)}

    def block(self, place: tuple[slice, ...]) -> ListedStarts:
        """Starts of a range of numbers."""
        return ListedStarts(*self.states().of(place[0]))

    def states(self) -> States:
        """States of all starts."""
        return States(*map(np.asarray, (self.position, self.velocity, self.phase)))

    def describe(self) -> dict[str, Any]:
        """Number of starts and a digest of their values."""
        digest = hashlib.sha256(b"".join(part.tobytes() for part in self.states()))
        return {"kind": "listed", "count": self.dims["start"], "sha256": digest.hexdigest()}


def _finite(name: str, values: ArrayLike, shape: tuple[int, ...] | None = None) -> Floats:
    """Copy of an array of finite numbers."""
    copy = np.ascontiguousarray(numbers(name, values, "an array of numbers"))
    if shape not in (None, copy.shape):
        raise InvalidParameterError(f"{name} has shape {copy.shape}; expected {shape}.")
    return copy
