"""Sections at changes of state: friction that sticks or slips, a soft stop that lets go.

Method      the events of the motion, after which one element is in a state in which it was not
            before; every change of it where no state is given                               (1)
Assumes     nothing: what makes the element change, its own guard or an impact elsewhere, does not
            matter
Fails       a motion in which the element keeps its state has no such section: ``end`` says so
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.checks import check_count, refusal
from vibroimpact._core.progress import Announcement
from vibroimpact._core.types import Codes
from vibroimpact.model.mechanism import element_labels
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.sections import (
    IMPACTS_PER_POINT,
    Section,
    SectionPoints,
    StroboscopicSection,
    check_number,
    check_points,
    joined,
    last_of,
)
from vibroimpact.simulation.simulate import (
    GOES_ON,
    RunEnd,
    first_phases,
    rounded_times,
    states_of_modes,
)
from vibroimpact.simulation.simulator import CHUNK, Simulator

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, repr=False)
class StateSection(SectionPoints):
    """States of a motion just after an element has changed its state, read-only.

    Attributes
    ----------
    position, velocity
        Coordinates and velocities just after the event, shape (n_point, n).
    phase
        Phase of the first forcing line in [0, 2 pi); 0 without forcing.
    time
        Time since the start of the motion, settling included.
    end
        Why the motion ended; ``RunEnd.POINTS`` if every requested point is there.
    last
        State of the last point, from which the motion can be continued.
    element, takes
        Number of the contact or element, and the state that it takes; None: every change.
    state
        State of the element after each point, shape (n_point,).
    """

    element: int
    takes: IntEnum | None
    state: Codes = field(repr=False)

    def __repr__(self) -> str:
        label = element_labels(mechanism_of(self.system))[self.element]
        what = f"{label} takes {self.takes.name}" if self.takes is not None else f"{label} changes"
        rare = "fewer than one event in 64 is such a change"
        end = rare if self.end is RunEnd.EVENTS else self.end.sentence
        return f"StateSection: {len(self)} states where {what}; {end}"

    def to_dataset(self) -> xr.Dataset:
        """Return the section as an xarray dataset; attributes say which element and state."""
        takes = self.takes.name if self.takes is not None else "any"
        dataset = self._dataset("change", element=self.element, takes=takes)
        return dataset.assign(state=("change", self.state))


AnySection = Section | StroboscopicSection | StateSection


def state_section(
    system: System,
    state: State,
    *,
    element: int = 0,
    takes: IntEnum | str | None = None,
    points: int = 2000,
    settle: int = 1000,
) -> StateSection:
    """Record the states whenever an element changes its state, as friction that begins to stick.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one.
    state
        Initial state of the motion.
    element
        Number of the contact or element, as in results: rigid stops first, then the others.
    takes
        The state that it takes: a member of :class:`~vibroimpact.FrictionState`,
        :class:`~vibroimpact.SoftStopState`, :class:`~vibroimpact.PhaseSwitchState` or
        :class:`~vibroimpact.RigidStopState`, or its name, such as "stick". Every change where it is
        left out: friction that slips, sticks or turns.
    points
        Changes to record, >= 1.
    settle
        Such changes to discard first, >= 0.

    Returns
    -------
    StateSection
        Fewer points than requested, with the reason in ``end``, if the element stops changing its
        state, and ``RunEnd.EVENTS`` if fewer than one event in 64 is such a change.

    Raises
    ------
    InvalidParameterError
        An element or a state that the system does not have, counts out of range, a bad start.

    Notes
    -----
    It needs neither stops nor forcing: the section of a self-excited machine. A change that an impact
    elsewhere brings about counts as well. The cost is that of the events, some microseconds each.

    Examples
    --------
    A block on a belt begins to slip where its spring pulls with the static level.

    >>> import vibroimpact as vi
    >>> block = vi.Mechanism(mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
    ...                      elements=(vi.Friction((1.0,), 0.1, 0.2, belt_speed=0.05),))
    >>> section = vi.state_section(block, vi.State((0.0,), (0.0,)), takes="backward", points=3)
    >>> [round(x, 9) for x in section.x1.tolist()]
    [0.2, 0.2, 0.2]
    """
    check_count("points", points, 1)
    check_count("settle", settle, 0)
    takes = check_change(system, element, takes)
    check_points("points", points, system)
    return take_changes(Simulator(system, state), points, element, takes, discard=settle)[0]


def check_change(system: System, element: Any, takes: Any, name: str = "element") -> IntEnum | None:
    """Refuse an element that the system does not have, or a state that it does not take."""
    mechanism = mechanism_of(system)
    check_number(
        name, element, len(mechanism.elements), "Numbers are those of results: rigid stops first."
    )
    if takes is None:
        return None
    found = mechanism.elements[element].states
    if isinstance(takes, str):
        takes = {one.name.lower(): one for one in found}.get(takes.lower(), takes)
    if not any(takes is one for one in found):
        names = ", ".join(f'"{one.name.lower()}"' for one in found)
        what = element_labels(mechanism)[element]
        raise refusal(
            "takes", takes, f"a state of {what}: {names}", "Leave it out for all changes."
        )
    chosen: IntEnum = takes
    return chosen


def take_changes(
    motion: Simulator, points: int, element: int, takes: IntEnum | None, *, discard: int = 0
) -> tuple[StateSection, list[Any]]:
    """Take the next changes of an element, after some; also the records that hold the points."""
    parts: list[Any] = []
    rows: list[tuple[Any, NDArray[np.intp], Codes]] = []
    found, spent, end = -discard, 0, RunEnd.EVENTS
    before, announcement = motion.at.mode, Announcement("settle + points", discard + points)
    while found < points and end in GOES_ON:
        announcement.after(found + discard)
        at, missing = motion.at, points - found
        part = motion.next_events(CHUNK)
        chosen, states = changes_in(motion, part, before, element, takes)
        if len(chosen) >= missing:  # again, up to the last of them
            motion.at = at
            part = motion.next_events(int(chosen[missing - 1]) + 1)
            chosen, states = changes_in(motion, part, before, element, takes)
        spent, end = spent + len(part["status"]), RunEnd(part["why"])
        before = motion.at.mode
        skipped = min(max(-found, 0), len(chosen))
        found += len(chosen)
        if found >= 0:
            parts.append(part)
            rows.append((part, chosen[skipped:], states[skipped:]))
        if spent > IMPACTS_PER_POINT * (points + discard) + CHUNK and found < points:
            break
    end = RunEnd.POINTS if found >= points else RunEnd.EVENTS if end in GOES_ON else end
    return _section_of(motion, rows, element, takes, end), parts


def changes_in(
    motion: Simulator, part: Any, before: int, element: int, takes: IntEnum | None
) -> tuple[NDArray[np.intp], Codes]:
    """Events after which an element is in a new state (1), and that state.

    ``before``: the mode before the first event.
    """
    modes = np.concatenate([[before], part["mode"]]).astype(np.int32)
    states = states_of_modes(motion.compiled, modes)[:, element]
    changed = states[1:] != states[:-1]
    if takes is not None:
        changed &= states[1:] == takes
    chosen = np.flatnonzero(changed)
    return chosen, states[1:][chosen]


def _section_of(
    motion: Simulator, rows: list[Any], element: int, takes: IntEnum | None, end: RunEnd
) -> StateSection:
    """The section from events chosen among recorded ones."""
    n = motion.compiled.mechanism.degrees

    def picked(empty: Any, pick: Any) -> Any:
        return joined(empty, [pick(part)[chosen] for part, chosen, _ in rows])

    nothing = np.empty(0)
    after = picked(np.empty((0, 2 * n)), lambda part: part["after"])
    position, velocity = after[:, :n], after[:, n:]
    phase = picked(nothing, lambda part: first_phases(part["phase"]))
    return StateSection(
        system=motion.system, position=position, velocity=velocity, phase=phase,
        time=picked(nothing, lambda part: rounded_times(part["high"], part["low"])[0]), end=end,
        last=last_of(motion, position, velocity, phase), element=element, takes=takes,
        state=joined(np.empty(0, dtype=np.int32), [states for *_, states in rows]),
    )  # fmt: skip
