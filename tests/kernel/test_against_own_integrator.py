"""Random machines of every element against an integrator that shares no code (witness/grid.py).

Events with their element, times, positions and the states of all elements after them are compared while
a change of the machine by CHANGE moves the events of the witness by less than GAIN times as much, and
until the witness says that two answers are within its rounding. Chatter is summed by one and followed
impact by impact by the other: its last impacts are compared as the one event that they are. Where two
contacts chatter at once, rounding decides which is first: there the comparison ends.
"""

from __future__ import annotations

import math
import zlib
from typing import NamedTuple

import numpy as np
import pytest
from support.random_machines import CHANGE, KINDS, changed, random_machine, random_start
from witness.grid import CrowdedError, Event, Machine, UndecidedError

import vibroimpact as vi

QUICK, MANY = 1, 13  # of 27 kinds: some 300
IMPACTS = 150
CLOSE = 1e3 * CHANGE  # of the scale of the motion
AT_ONCE = 1e-10  # relative: events of one instant are one group
Status = vi.Status
WORDS = {
    Status.IMPACT: "impact", Status.SIMULTANEOUS: "impact", Status.CHATTER: "rest",
    Status.STICK: "stick", Status.RELEASE: "release", Status.ENGAGE: "change",
    Status.CHANGE: "change", Status.NON_UNIQUE: "change",
}  # fmt: skip
WITH_MASS = [kind for kind in KINDS if kind not in ("massless", "slider")]


class Found(NamedTuple):
    """What was compared: events, what is different, and whether the witness could not decide."""

    events: int
    rests: int
    wrong: str
    undecided: str


def grouped(events: list[Event]) -> list[Event]:
    """The first event of each instant after the start, with position and states after the last."""
    out: list[Event] = []
    for e in events:
        if out and e.time - out[-1].time <= AT_ONCE * e.time:
            out[-1] = out[-1]._replace(position=e.position, states=e.states)
        elif e.time > 0.0:
            out.append(e)
    return out


def of_run(run: vi.Run) -> list[Event]:
    return grouped([
        Event(float(run.time[i]), WORDS[Status(s)], int(run.contact[i]), run.position[i],
              tuple(map(int, run.states[i])))
        for i, s in enumerate(run.status) if s in WORDS
    ])  # fmt: skip


def of_witness(m: vi.Mechanism, state: vi.State, t_max: float) -> tuple[list[Event], str]:
    """Events of the witness, and why it stopped before the end."""
    witness = Machine(m, state.position, state.velocity, state.phase)
    try:
        witness.run(t_max)
    except CrowdedError:
        return grouped(witness.events), "crowded"
    except UndecidedError as why:
        return grouped(witness.events), str(why)
    return grouped(witness.events), ""


def chattering(events: list[Event], i: int, contact: int) -> int:
    """Number of the event that ends the impacts of a contact from i on: its rest."""
    while i < len(events) and events[i].kind == "impact" and events[i].number == contact:
        if events[i].states[contact]:
            return i  # too weak to leave
        i += 1
    return i


def apart(a: Event, b: Event, span: float, size: float) -> float:
    return max(abs(a.time - b.time) / span, float(np.abs(a.position - b.position).max()) / size)


def compare(kind: str, seed: int, periods: float = 6.0) -> Found:
    rng = np.random.default_rng([zlib.crc32(kind.encode()), seed, 1])
    m = random_machine(rng, KINDS[kind])
    state, t_max = random_start(rng, m), periods * 2.0 * math.pi / m.omega
    run = vi.simulate(m, state, impacts=IMPACTS, t_max=t_max)
    ours = of_run(run)
    true, undecided = of_witness(m, state, t_max)
    near, _ = of_witness(*changed(m, state), t_max)
    size = max([1e-3, *(float(np.abs(e.position).max()) for e in true)])
    i = j = k = rests = 0
    while j < len(true):
        if i < len(ours) and "rest" in (ours[i].kind, true[j].kind):
            contact = (ours[i] if ours[i].kind == "rest" else true[j]).number
            i, j, k = (chattering(e, at, contact) for e, at in ((ours, i), (true, j), (near, k)))
            rests += 1
            if j == len(true) or i == len(ours):
                return Found(i, rests, "", undecided)
            if any(e.number != contact or not e.states[contact] for e in (ours[i], true[j])):
                return Found(i, rests, "", "crowded")
        if k == len(near) or near[k][1:3] != true[j][1:3] or near[k].states != true[j].states:
            return Found(i, rests, "", "")
        if apart(near[k], true[j], t_max, size) > CLOSE:
            return Found(i, rests, "", "")
        if i == len(ours):
            if run.end is vi.RunEnd.IMPACTS:
                return Found(i, rests, "", "")
            return Found(i, rests, f"{true[j]} is missing: {run.end.name}", "")
        a, b = ours[i], true[j]
        both = {a.kind, b.kind}
        same = len(both) == 1 or both <= {"rest", "impact", "stick"}
        if not same or (a.number, a.states) != (b.number, b.states):
            return Found(i, rests, f"event {i} is {a}, not {b}", "")
        if (found := apart(a, b, t_max, size)) > CLOSE:
            return Found(i, rests, f"event {i}, {a}, is {found:.1e} from {b}", "")
        i, j, k = i + 1, j + 1, k + 1
    if i < len(ours) and not undecided and len(near) == len(true):
        return Found(i, rests, f"{ours[i]} is too much", "")
    return Found(i, rests, "", undecided)


SLOW = pytest.mark.slow


@pytest.mark.parametrize("kind", WITH_MASS)
@pytest.mark.parametrize(
    ("first", "last", "periods"),
    [
        pytest.param(0, QUICK, 4.0, id="quick"),
        pytest.param(QUICK, MANY, 6.0, id="many", marks=SLOW),
    ],
)
@pytest.mark.one_in(2)
def test_events_are_those_of_another_integrator(
    kind: str, first: int, last: int, periods: float
) -> None:
    found = [compare(kind, seed, periods) for seed in range(first, last)]
    wrong = [f"seed {first + i}: {one.wrong}" for i, one in enumerate(found) if one.wrong]
    assert not wrong, f"{len(wrong)} of {last - first}:\n" + "\n".join(wrong)
    undecided = [one.undecided for one in found if one.undecided not in ("", "crowded")]
    assert len(undecided) <= (0.4 if kind == "heavy on stops" else 0.1) * MANY, undecided
    assert last == QUICK or sum(one.events for one in found) > len(found)
