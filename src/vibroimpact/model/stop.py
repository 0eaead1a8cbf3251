"""Stops, by the number of the contact and one of its two ends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from vibroimpact._core.types import Index, Sign
from vibroimpact.model.elements.element import Element
from vibroimpact.model.elements.rigid_stop import RigidStop

StopName = Literal["A", "B"]  # of a given contact: A is the upper stop, B the lower


class Stop(NamedTuple):
    """Stop of a mechanism."""

    contact: Index  # number of the contact
    side: Sign  # +1 for its upper stop, A; -1 for its lower stop, B

    def __repr__(self) -> str:
        return repr(tuple(self))

    @classmethod
    def at(cls, name: str, contact: int = 0) -> Stop:
        """The stop "A" or "B" of a contact."""
        return cls(contact, 1 if name == "A" else -1)

    @property
    def upper(self) -> bool:
        """Whether this is the upper stop."""
        return self.side > 0

    @property
    def name(self) -> StopName:
        """A or B."""
        return "A" if self.upper else "B"

    @property
    def label(self) -> str:
        """A or B, followed by the number of the contact, except for the first contact."""
        return self.name + (str(self.contact) if self.contact else "")

    @property
    def digit(self) -> int:
        """1 for A, 2 for B: the digit of its contact in the code of a closed set."""
        return 1 if self.upper else 2

    @property
    def opposite(self) -> Stop:
        """The other stop of its contact."""
        return Stop(self.contact, -self.side)

    @property
    def words(self) -> str:
        """Description in words, as in "the upper stop of contact 0"."""
        return f"the {'upper' if self.upper else 'lower'} stop of contact {self.contact}"

    def limit(self, elements: Sequence[Element]) -> float:
        """Position of the stop; infinite if there is none."""
        return elements[self.contact].limit_at(self.side)

    def restitution(self, stops: Sequence[RigidStop]) -> float:
        """Coefficient of restitution of the stop."""
        return stops[self.contact].restitutions[self.upper]
