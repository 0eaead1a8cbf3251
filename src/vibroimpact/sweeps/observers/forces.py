"""Forces: the range of the force of every contact and element."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import PART, Observer, Variables, real


@dataclass(frozen=True)
class Forces(Observer):
    """Smallest and largest force of every contact and element over the observed time.

    Signs and numbers are those of ``Run.forces``: a force f acts on the coordinates as f row, so
    that the largest contact force at an upper stop is the smallest f. A soft stop has its contact
    force, friction its force, a rigid stop the force at rest; where none of them acts it is 0.
    Impulses of impacts are not forces: see :class:`Impulse`.
    """

    name: ClassVar[str] = "forces"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``force_smallest``, ``force_largest`` (..., part)."""
        parts = len(mechanism.elements)
        return {
            f"force_{kind}": real(
                "ranges", f"{kind} force of a contact or element", slice(i, 2 * parts, 2),
                dims=(PART,), shape=(parts,), quantity="force",
            )
            for i, kind in enumerate(("smallest", "largest"))
        }  # fmt: skip
