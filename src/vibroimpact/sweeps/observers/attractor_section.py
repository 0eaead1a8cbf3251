"""The section on which attractors of many motions are compared, and its observer."""

from __future__ import annotations

from vibroimpact._core.checks import refusal
from vibroimpact.model.system import System
from vibroimpact.simulation.places import AtChange, AtPhase, AtStop, place_in
from vibroimpact.sweeps.observers.section import Section
from vibroimpact.sweeps.observers.stroboscopic import Stroboscopic

# A section has so many points at a phase: periods up to half of them are recognised.
STROBE_POINTS = 32


def observed_place(system: System, at: AtStop | AtPhase | None) -> AtStop | AtPhase:
    """Place of ``place_in``, which must be one that observers have: no change of an element."""
    place = place_in(system, at)
    if isinstance(place, AtChange):
        raise refusal(
            "at", place, "vi.AtStop(...), or vi.AtPhase(...) of a system with forcing",
            "At changes of state take vi.classify start by start.",
        )  # fmt: skip
    return place


def section_observer(
    at: AtStop | AtPhase, points: int, strobes: int = STROBE_POINTS
) -> Section | Stroboscopic:
    """Observer of so many ``points`` at a stop; ``strobes`` at a phase of the force."""
    if isinstance(at, AtStop):
        return Section(points=points, contact=at.contact, stop=at.stop)
    return Stroboscopic(points=strobes, phase=at.phase)
