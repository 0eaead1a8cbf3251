"""Final: the state at the end of the run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import (
    ANY,
    COORDINATE,
    QUANTITIES,
    Observer,
    Variable,
    Variables,
    real,
)


@dataclass(frozen=True)
class Final(Observer):
    """Position, velocity and phase at the end of the run."""

    name: ClassVar[str] = "final"

    def variables(self, mechanism: Mechanism) -> Variables:
        """``final_position``, ``final_velocity`` (..., coordinate), ``final_phase``."""
        dims, shape = (COORDINATE,), (mechanism.degrees,)

        def of(kind: str) -> Variable:
            return real(
                kind,
                f"{kind} at the end",
                dims=dims,
                shape=shape,
                quantity=QUANTITIES[kind],
                within=ANY,
            )

        states = {f"final_{kind}": of(kind) for kind in ("position", "velocity")}
        return states | {"final_phase": real("phase", "phase at the end", units="rad", within=ANY)}
