"""Points of sections: states, phases and times."""

from __future__ import annotations

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import (
    COORDINATE,
    QUANTITIES,
    Observer,
    Variable,
    Variables,
    labelled,
    real,
)

POINT, STROBE = "point", "strobe"  # dimensions of impact sections, of stroboscopic ones


def points_of(
    observer: Observer, points: int, dim: str, where: str, mechanism: Mechanism
) -> Variables:
    """Position, velocity, phase and time of the points of a section."""
    along = labelled(dim, observer.label)

    def of(kind: str, units: str) -> Variable:
        dims, shape = ((along, COORDINATE), (points, mechanism.degrees))
        of_state = kind in ("position", "velocity")
        return real(
            kind, f"{kind} {where}", units=units, quantity=QUANTITIES.get(kind, ""),
            dims=dims if of_state else dims[:1], shape=shape if of_state else shape[:1],
        )  # fmt: skip

    units = {"position": "", "velocity": "", "phase": "rad", "time": ""}
    name = labelled(observer.name, observer.label)
    return {f"{name}_{kind}": of(kind, unit) for kind, unit in units.items()}
