"""Places of the points of a section: impacts at one stop, one phase, changes of state."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from vibroimpact._core.checks import check_stop_name, real, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Count
from vibroimpact.model.mechanism import Mechanism, element_labels
from vibroimpact.model.stop import Stop, StopName
from vibroimpact.model.system import System, mechanism_of


@dataclass(frozen=True)
class AtStop:
    """Place just after the impacts at one stop; completed chatter is one of them, at rest on the stop.

    Parameters
    ----------
    stop
        "A", the upper stop, or "B", the lower.
    contact
        Number of the contact, or of a soft stop, which counts where it is met.
    """

    stop: StopName = "A"
    contact: Count = 0

    def words(self, _: Mechanism) -> str:
        """Text of the place: "at stop A of contact 0"."""
        return f"at stop {self.stop} of contact {self.contact}"


@dataclass(frozen=True)
class AtPhase:
    """Place at one phase of the force, with impacts or without; after an event at that time.

    Parameters
    ----------
    phase
        Phase of the first forcing line, radians.
    """

    phase: float = 0.0

    def words(self, _: Mechanism) -> str:
        """Text of the place: "at phase 0 of the force"."""
        return f"at phase {self.phase:.6g} of the force"


@dataclass(frozen=True)
class AtChange:
    """Place just after an element has changed its state, as friction that begins to stick.

    What makes it change, its own guard or an impact elsewhere, does not matter.

    Parameters
    ----------
    element
        Number of the contact or element, as in results: rigid stops first, then the others.
    takes
        The state that it takes: a member of :class:`~vibroimpact.FrictionState`,
        :class:`~vibroimpact.SoftStopState`, :class:`~vibroimpact.PhaseSwitchState` or
        :class:`~vibroimpact.RigidStopState`, or its name, such as "stick". Every change where it is
        left out: friction that slips, sticks or turns.
    """

    element: int = 0
    takes: IntEnum | str | None = None

    def words(self, mechanism: Mechanism) -> str:
        """Text of the place: "where soft stop 1 changes"."""
        label, takes = element_labels(mechanism)[self.element], self.takes
        state = takes.name if isinstance(takes, IntEnum) else takes
        return f"where {label} changes" if state is None else f"where {label} takes {state}"


At = AtStop | AtPhase | AtChange


def place_in(system: System, at: At | None) -> At:
    """The place if the system has it, states by their members; the usual one of the system for None."""
    mechanism = mechanism_of(system)
    match at:
        case None:
            return usual_place(mechanism)
        case AtStop():
            check_stop(mechanism, at)
        case AtPhase():
            at = AtPhase(real("phase", at.phase))
            if not mechanism.forces:
                raise InvalidParameterError(
                    "system: has no forcing, so that no phase repeats. Take "
                    + "vi.AtStop(), or " * any(x.is_stop for x in mechanism.elements)
                    + "vi.AtChange(), where an element changes its state."
                )
        case AtChange():
            return _checked_change(mechanism, at)
        case _:
            raise refusal("at", at, "vi.AtStop(...), vi.AtPhase(...) or vi.AtChange(...)")
    return at


def usual_place(mechanism: Mechanism) -> At:
    """The first stop if contact or element 0 has one; else as without stops."""
    first = mechanism.elements[0]
    if first.is_stop:
        return AtStop("B" if math.isinf(first.limit_at(1)) else "A")
    return place_without_stops(mechanism, 0)


def place_without_stops(mechanism: Mechanism, element: int) -> At:
    """Phase 0 of the force; without forcing the changes of an element.

    Of this element, or of the first friction if it is a stop.
    """
    if mechanism.forces:
        return AtPhase()
    if mechanism.elements[element].is_stop:
        rubs = [i for i, part in enumerate(mechanism.elements) if part.slipping]
        element = (*rubs, element)[0]
    return AtChange(element)


def check_stop(system: System, at: AtStop) -> None:
    """Refuse a stop that the system does not have: those of contacts, and soft ones."""
    mechanism, contact = mechanism_of(system), at.contact
    contacts = mechanism.elements
    _check_number("contact", contact, len(contacts))
    check_stop_name(at.stop)
    if not contacts[contact].is_stop:
        stops = [str(i) for i, one in enumerate(contacts) if one.is_stop]
        kind = contacts[contact].kind.replace("_", " ")
        ways = [*stops, f"vi.AtChange({contact}), where it changes its state"]
        if mechanism.forces:
            ways.append("vi.AtPhase()")
        raise InvalidParameterError(
            f"contact = {contact}: is {kind}, which has no stop. Take {', or '.join(ways)}."
        )
    if math.isinf(Stop.at(at.stop, contact).limit(contacts)):
        raise InvalidParameterError(
            f"stop = {at.stop!r}: contact {contact} has no such stop; use the other one."
        )


def _checked_change(mechanism: Mechanism, at: AtChange) -> AtChange:
    """Refuse an element that the system does not have, or a state that it does not take."""
    element, takes = at.element, at.takes
    _check_number(
        "element",
        element,
        len(mechanism.elements),
        "Numbers are those of results: rigid stops first.",
    )
    if takes is None:
        return at
    states = mechanism.elements[element].states
    if isinstance(takes, str):
        takes = {one.name.lower(): one for one in states}.get(takes.lower(), takes)
    if not any(takes is one for one in states):
        names = ", ".join(f'"{one.name.lower()}"' for one in states)
        what = element_labels(mechanism)[element]
        raise refusal(
            "takes", takes, f"a state of {what}: {names}", "Leave it out for all changes."
        )
    return replace(at, takes=takes)


def _check_number(name: str, value: Any, count: int, advice: str = "") -> None:
    """Refuse a number that none of so many contacts, or contacts and elements, has."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not 0 <= value < count:
        raise refusal(name, value, " to ".join(dict.fromkeys(("0", str(count - 1)))), advice)
