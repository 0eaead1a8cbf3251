"""Spectrum: all Lyapunov exponents."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism, check_all_have_mass
from vibroimpact.sweeps.observers.observer import EXPONENT, EXPONENTS, Observer, Variables, real


@dataclass(frozen=True)
class Spectrum(Observer):
    """All Lyapunov exponents per unit of time, as :class:`Lyapunov`.

    In the order of the tangent vectors: the longer the window, the surer the largest is first. The last are
    -inf where directions are forgotten: two for a contact that rests on its stop, one for a plastic impact.
    """

    name: ClassVar[str] = "spectrum"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``spectrum`` with dim ``exponent``: 2 n + (lines) - 1."""
        check_all_have_mass(mechanism)
        count = 2 * mechanism.degrees + len(mechanism.forces) - 1
        text = "Lyapunov exponents per unit of time"
        found = real(
            "exponents", text, dims=(EXPONENT,), shape=(count,), quantity="rate", within=EXPONENTS
        )
        return {"spectrum": found}
