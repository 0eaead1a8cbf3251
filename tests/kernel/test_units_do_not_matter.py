"""The same machine in other units, mirrored, or numbered otherwise moves in the same way.

Units that are powers of two multiply every number exactly, and so must every result be, to the last
bit. Other changes round the numbers of the machine: what is compared then is what a change of the
machine by CHANGE moves by less than a thousand times as much.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from support.random_machines import (
    CHANGE,
    KINDS,
    changed,
    mirrored,
    random_machine,
    random_start,
    renumbered,
    reordered,
    scaled,
)

import vibroimpact as vi

QUICK, MANY = 7, 45  # machines of each kind: some 200, some 1000
OF_BITS = 20  # whose bits are compared: no rounding decides, the first one that differs is a fault
IMPACTS, PERIODS = 150, 6.0
GAIN = 1e3
CLOSE = CHANGE * GAIN  # of the scale of the motion; rounding, 1e-16 a step, is far below CHANGE
SLOW = pytest.mark.slow
COUNTS = [pytest.param(0, QUICK, id="quick"), pytest.param(QUICK, OF_BITS, id="many", marks=SLOW)]
KIND = pytest.mark.parametrize("kind", KINDS)
OF_A_STATE = (vi.Status.CHANGE, vi.Status.NON_UNIQUE)  # of others ``stop`` is a stop, or none
OF_FORCES = (*OF_A_STATE, vi.Status.RELEASE)  # rates are those of forces, or of slip speeds
Case = tuple[int, np.random.Generator, vi.Mechanism, vi.State, float]


def cases(kind: str, first: int, last: int) -> Iterator[Case]:
    """Machines, starts, and lengths of runs."""
    for seed in range(first, last):
        rng = np.random.default_rng([zlib.crc32(kind.encode()), seed])
        m = random_machine(rng, KINDS[kind])
        yield seed, rng, m, random_start(rng, m), PERIODS * 2.0 * math.pi / m.omega


def simulated(m: vi.Mechanism, state: vi.State, t_max: float) -> vi.Run:
    return vi.simulate(m, state, impacts=IMPACTS, t_max=t_max)


def said(run: vi.Run, i: int) -> str:
    if i >= len(run):
        return f"end, {run.end.name}"
    return f"{vi.Status(run.status[i]).name} {run.contact[i]}.{run.side[i]} at {run.time[i]:.17g}"


def _first_apart(*pairs: tuple[Any, Any]) -> int | None:
    """First event at which arrays with an entry for each are not the same bits."""
    length = min(len(a) for pair in pairs for a in pair)
    apart = [
        (a[:length] != b[:length]).reshape(length, -1).any(axis=1).nonzero()[0] for a, b in pairs
    ]
    found = min((int(one[0]) for one in apart if one.size), default=length)
    return None if found == length and all(len(a) == len(b) for a, b in pairs) else found


def apart_in_bits(run: vi.Run, other: vi.Run, length: float, time: float) -> str:
    """What is different in other units, if anything."""
    speed = length / time
    at = _first_apart(
        (run.status, other.status), (run.contact, other.contact), (run.side, other.side),
        (run.states, other.states), (run.time * time, other.time), (run.phase, other.phase),
        (run.position * length, other.position),
        (run.velocity_before * speed, other.velocity_before),
        (run.velocity_after * speed, other.velocity_after),
    )  # fmt: skip
    if at is None and run.end == other.end:
        same = ~np.isin(run.status, OF_FORCES)
        for name in ("rate_before", "rate_after"):
            own, there = getattr(run, name)[same] * speed, getattr(other, name)[same]
            if not np.array_equal(own, there):
                return f"{name} {own[own != there][0]}, not {there[own != there][0]}"
        return ""
    if at is None:
        return f"{run.end.name}, not {other.end.name}"
    units = f"length 2^{math.log2(length):.0f}, time 2^{math.log2(time):.0f}"
    there = said(other, at)
    if at < min(len(run), len(other)):
        there += f" = {other.time[at] / time:.17g}, |x| apart by " + format(
            float(np.abs(other.position[at] / length - run.position[at]).max()), ".1e"
        )
    return f"{units}: event {at} is {said(run, at)}, or {there}"


@KIND
@pytest.mark.parametrize(("first", "last"), COUNTS)
def test_units_that_are_powers_of_two_change_no_bit(kind: str, first: int, last: int) -> None:
    wrong = []
    for seed, rng, m, state, t_max in cases(kind, first, last):
        # rates up to 2^8 stay below 2^108, and forces below 2^256
        length, time, mass = (2.0 ** int(rng.integers(-k, k + 1)) for k in (60, 60, 60))
        if seed % 3 != 2:  # one unit alone tells which
            alone = seed // 3 % 3
            length, time, mass = (
                u if k == alone else 1.0 for k, u in enumerate((length, time, mass))
            )
        run = simulated(m, state, t_max)
        units = length, time, mass
        other = simulated(scaled(m, *units), scaled(state, *units), t_max * time)
        if what := apart_in_bits(run, other, length, time):
            wrong.append(f"seed {seed}, mass 2^{math.log2(mass):.0f}, {what}")
    assert not wrong, f"{len(wrong)} of {last - first}:\n" + "\n".join(wrong)


@pytest.mark.parametrize("time", [2.0**-100, 2.0**-40, 2.0**40, 2.0**100])
@pytest.mark.parametrize("what", ["springs", "dashpots that couple", "elements"])
def test_any_unit_of_time_serves(what: str, time: float) -> None:
    elements = (vi.SoftStop((1.0, -0.5), upper=0.3, stiffness=9.0, damping=0.3, law="limited"),
                vi.Friction((0.0, 1.0), 0.1))  # fmt: skip
    m = vi.Mechanism(
        mass=[[1.0, 0.0], [0.0, 0.6]],
        damping=[[0.12, -0.02], [-0.02, 0.03]] if what != "springs" else np.zeros((2, 2)),
        stiffness=[[2.0, -0.8], [-0.8, 1.2]], forces=(vi.Harmonic(0.8, (1.0, 0.3)),),
        elements=(vi.RigidStop((0.0, 1.0), -0.5, 0.5, 0.7), *(elements if what == "elements" else ())),
    )  # fmt: skip
    start = vi.State((0.1, 0.0), (0.3, -0.2), 0.4)
    run = vi.simulate(m, start, impacts=200)
    other = vi.simulate(scaled(m, time=time), scaled(start, time=time), impacts=200)
    assert len(run) >= 200
    assert not apart_in_bits(run, other, 1.0, time)


@pytest.mark.parametrize("omega", [2e12 * math.pi, 1e15, 1e-15, 1e-25])
@pytest.mark.parametrize("soft", [False, True])
def test_an_oscillator_of_any_frequency_meets_its_stop_when_its_cosine_does(
    omega: float, soft: bool
) -> None:
    elements = (vi.SoftStop((1.0,), upper=9.0, stiffness=1.0),) if soft else ()  # never met
    m = vi.Mechanism(
        mass=[[1.0 / omega**2]], damping=[[0.0]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), lower=-0.5, restitution=1.0), *elements),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((1.0,), (0.0,)), impacts=3)
    third = 2.0 * math.pi / 3.0  # to the stop, and from it over the top back to it
    assert run.time[:3] * omega == pytest.approx([third, 3.0 * third, 5.0 * third], rel=1e-14)


@pytest.mark.parametrize("length", [2.0**-90, 2.0**90, 2.0**200])
@pytest.mark.parametrize("far", [2.0**200, 2.0**257])
def test_how_far_is_too_far_is_counted_from_the_stops(far: float, length: float) -> None:
    m = vi.Mechanism(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        elements=(vi.RigidStop((1.0,), lower=-1.0, restitution=0.5),),
    )  # fmt: skip
    run = vi.simulate(m, vi.State((far,), (0.0,)), impacts=3)
    assert (run.end is vi.RunEnd.DIVERGED) == (far > 2.0**256)
    other = vi.simulate(scaled(m, length), vi.State((far * length,), (0.0,)), impacts=3)
    assert not apart_in_bits(run, other, length, 1.0)


# ---- to rounding ------------------------------------------------------------------------------------


Told = tuple[int, int, int]
Name = Callable[[int, int, int], Told]
SIDES = {vi.SoftStop: {1: 2, 2: 1, 3: 4, 4: 3}, vi.Friction: {0: 1, 1: 0}}  # states in a mirror


def told(run: vi.Run, name: Name = lambda *event: event) -> list[Told]:
    """Kind, element, and stop or new state of each event, as ``name`` says; HORIZON is none."""
    return [
        name(int(s), int(c), int(states[c] if s in OF_A_STATE else side))
        for s, c, side, states in zip(run.status, run.contact, run.side, run.states, strict=True)
        if s != vi.Status.HORIZON
    ]


def apart(
    run: vi.Run, near: vi.Run, other: vi.Run, events: list[Told], time: Any, position: Any
) -> tuple[str, int]:
    """What is different, if anything, while ``near`` tells that it can be compared; events compared.

    ``events``, ``time`` and ``position`` are those of ``other`` as the machine itself would have them.
    """
    own, nearby = told(run), told(near)
    span = float(run.time[-1]) if len(run) and run.time[-1] else 1.0
    size = float(np.abs(run.position).max()) if len(run) else 1.0
    for i, event in enumerate(own):
        if i >= len(nearby) or nearby[i] != event:
            return "", i
        gain = max(
            abs(near.time[i] - run.time[i]) / span,
            float(np.abs(near.position[i] - run.position[i]).max()) / size,
        )
        if gain > CLOSE:
            return "", i
        if i >= len(events) or events[i] != event:
            return f"event {i} is {said(run, i)}, or {said(other, i)} = {events[i : i + 1]}", i
        found = max(
            abs(time[i] - run.time[i]) / span,
            float(np.abs(position[i] - run.position[i]).max()) / size,
        )
        if not found <= CLOSE:
            return f"event {i}, {said(run, i)}, is {found:.1e} away", i
    if len(nearby) == len(own) and len(events) > len(own) and near.end == run.end:
        return f"{said(other, len(own))} is too much", len(own)
    if near.end == run.end != other.end:
        return f"{run.end.name}, not {other.end.name}", len(own)
    return "", len(own)


# Of many machines some meet a threshold within rounding: chatter is summed one bounce sooner or later, and of several
# contacts that strike at once the event has the number of the first in order.
AT_A_THRESHOLD = 0.08


# Another run; its events, times, positions as ``apart`` takes them.
Seen = tuple[vi.Run, list[Told], Any, Any]
Otherwise = Callable[[np.random.Generator, vi.Mechanism, vi.State, float], Seen]
SMALL = {"length": 1e-9, "time": 1e-6, "mass": 1e-15}


def small(_: np.random.Generator, m: vi.Mechanism, state: vi.State, t_max: float) -> Seen:
    other = simulated(scaled(m, **SMALL), scaled(state, **SMALL), t_max * SMALL["time"])
    return other, told(other), other.time / SMALL["time"], other.position / SMALL["length"]


def in_mirror(m: vi.Mechanism) -> Name:
    """Names of events of the mirrored machine: stops change places, and so do states."""

    def name(status: int, contact: int, which: int) -> Told:
        if status not in OF_A_STATE:
            return status, contact, -which
        return status, contact, SIDES.get(type(m.elements[contact]), {}).get(which, which)

    return name


def mirror(_: np.random.Generator, m: vi.Mechanism, state: vi.State, t_max: float) -> Seen:
    other = simulated(mirrored(m), mirrored(state), t_max)
    return other, told(other, in_mirror(m)), other.time, -other.position


def turned(rng: np.random.Generator, m: vi.Mechanism, state: vi.State, t_max: float) -> Seen:
    order = rng.permutation(m.degrees)
    contacts, elements = (rng.permutation(len(part)) for part in (m.rigid_stops, m.switching))
    other = simulated(
        reordered(renumbered(m, order), contacts, elements), renumbered(state, order), t_max
    )
    back = [*map(int, contacts), *(len(contacts) + int(i) for i in elements), -1]
    position = np.empty_like(other.position)
    position[:, order] = other.position
    seen = told(other, lambda status, contact, which: (status, back[contact], which))
    return other, seen, other.time, position


def compared(kind: str, first: int, last: int, *ways: Otherwise) -> None:
    """Runs of machines beside what other descriptions of each give."""
    wrong: dict[str, list[str]] = {way.__name__: [] for way in ways}
    events = dict.fromkeys(wrong, 0)
    for seed, rng, m, state, t_max in cases(kind, first, last):
        run, near = simulated(m, state, t_max), simulated(*changed(m, state), t_max)
        for way in ways:
            what, count = apart(run, near, *way(rng, m, state, t_max))
            events[way.__name__] += count
            if what:
                wrong[way.__name__].append(f"seed {seed}: {what}")
    machines = last - first
    for way, found in wrong.items():
        assert len(found) <= math.floor(AT_A_THRESHOLD * machines), "\n".join([way, *found])
        assert events[way] > machines  # friction that sticks, or a stop out of reach, has few


@KIND
@pytest.mark.one_in(3)
def test_nanometres_and_microseconds_change_rounding_only(kind: str) -> None:
    compared(kind, 0, QUICK, small)


@KIND
@pytest.mark.one_in(3)
def test_a_mirrored_machine_moves_as_a_mirror_image(kind: str) -> None:
    compared(kind, 0, QUICK, mirror)


@KIND
@pytest.mark.one_in(3)
def test_coordinates_contacts_and_elements_have_no_order(kind: str) -> None:
    compared(kind, 0, QUICK, turned)


@SLOW
@KIND
def test_many_machines_move_alike_in_small_units_in_a_mirror_and_in_another_order(
    kind: str,
) -> None:
    compared(kind, QUICK, MANY, small, mirror, turned)
