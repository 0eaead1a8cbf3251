"""The observer of the section on which attractors are compared: at a stop, or at a phase."""

from __future__ import annotations

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.stop import StopName
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.sections import check_stop
from vibroimpact.simulation.state_sections import check_change
from vibroimpact.sweeps.observers.section import Section
from vibroimpact.sweeps.observers.stroboscopic import Stroboscopic

STROBES = 32  # points at a phase: periods up to half of them are recognised


def section_observer(
    system: System, contact: int, stop: StopName, points: int, strobes: int = STROBES
) -> Section | Stroboscopic:
    """So many ``points`` at a stop; ``strobes`` at phase 0 of the force where there is none.

    The same rule as that of ``classify``; no observer has the points at changes of an element.
    """
    mechanism = mechanism_of(system)
    check_change(system, contact, None, "contact")
    if mechanism.elements[contact].is_stop:
        check_stop(system, contact, stop)
        return Section(points=points, contact=contact, stop=stop)
    if not mechanism.forces:
        kind = mechanism.elements[contact].kind.replace("_", " ")
        raise InvalidParameterError(
            f"contact = {contact}: is {kind}, which has no stop, and the system has no forcing. Take "
            "a contact with a stop, or vi.classify start by start."
        )
    return Stroboscopic(points=strobes)
