"""Closing loop of a motion: the impacts that repeat at its end, and their forcing cycles.

Method      Over the last impacts, the shortest part that ends where it began: within GAP_OF_SETTLED of
            the motion's spread, of up to MOST_SETTLED_IMPACTS impacts; else the nearest within GAP_OF_GUESS, of
            up to MOST_GUESSED_IMPACTS. Where the sequence is given, its last occurrence in the motion,
            closed or not. With elements the changes of their states between the impacts belong to
            the loop; a motion without impacts, or after its last one, has loops of these changes.
            A part with rests on rigid stops begins after the release from one.
            A forced motion that has become silent, for a period and longer than between its events before,
            has the loop without events.
Fails       a sentence: no such part; the motion drifts; in its last period contacts that move each other are
            struck at one instant (simultaneous.py), or other events coincide, or the law leaves the state of an
            element open
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibroimpact._core.types import Codes, Flags, Floats, Integers
from vibroimpact.compile.prescribed import (
    CHATTER_WATCH,
    FORCE_WATCH,
    GAP_WATCH,
    Prescribed,
    compile_prescribed,
)
from vibroimpact.model.stand_ins import stand_ins
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.model.translations import translations_of
from vibroimpact.orbits.admissibility import PLAY_OF_AMPLITUDE
from vibroimpact.orbits.problem import (
    Flight,
    Signature,
    forcing_repeats,
    least_cycles,
    resisted_translations,
    without_events,
)
from vibroimpact.orbits.simultaneous import (
    between,
    named_code,
    released_at_once,
    struck_at_once,
    together,
)
from vibroimpact.simulation.reach import reach_in_words
from vibroimpact.simulation.simulate import ENDS_QUIETLY, Run, Status

# A loop with a smaller gap, relative to the spread of the motion, Newton's method may close.
GAP_OF_GUESS = 0.25
GAP_OF_SETTLED = 1e-5  # a loop with a smaller gap is that of a settled periodic motion
MOST_SETTLED_IMPACTS = 512  # a settled loop has so many impacts at most
MOST_GUESSED_IMPACTS = 60  # a loop that is nearly closed has so many at most
# A motion without events for this multiple of the longest time between those before has become silent.
LONGER_THAN_BETWEEN_EVENTS = 2.0
# A coordinate that moves less, relative to the size of the motion, stands still.
STILL_OF_MOTION = 1e-9
TOUCHING_OF_TERMS = 1e-6  # a guard that is so near to its limit, relative to its terms, is at it
IMPACTS = (Status.IMPACT, Status.SIMULTANEOUS)  # the latter moves other contacts that touch, too
ENDS_OF_FLIGHTS = (*IMPACTS, Status.CHATTER, Status.RELEASE, Status.ENGAGE, Status.CHANGE)
WITH_ANOTHER = (Status.STICK, Status.CHANGE)  # belong to an event at the same time
STRUCK = (*IMPACTS, Status.ENGAGE)
WATCH_OF_STATUS = {Status.CHATTER: CHATTER_WATCH, Status.RELEASE: FORCE_WATCH}
TOGETHER = (
    "contacts that move each other are struck at one instant in every period: the motions beside jump, and such orbits "
    "have no signature"
)
AT_ONCE = "several events are at one instant in every period: such orbits have no signature"
UNSAID = "the motion rests on a stop in every period, which impacts do not say: leave them out"
ALONE = "rest on a stop begins without an impact in every period: such orbits have no signature"
DRIFTS = "the motion drifts"
OPEN = "the law leaves the state of an element open in every period: such orbits have no signature"


class ClosingLoop(NamedTuple):
    """Events of a loop, forcing cycles, states after them (m, 2n + 1), flight times (m,), flights.

    ``settled`` says whether it closes within GAP_OF_SETTLED; a given sequence is not judged.
    """

    impacts: tuple[Stop, ...]
    cycles: int
    states: Floats
    durations: Floats
    flights: tuple[Flight, ...]
    settled: bool

    @property
    def signature(self) -> Signature:
        """Its signature, solved as a whole."""
        return Signature(self.impacts, self.cycles, False, self.flights)


class Events(NamedTuple):
    """Events of a run that end flights.

    An impact with what follows it at its instant is one; of contacts that are struck together there is one each.
    """

    # numbers in the run, shape (m,): of the event, and of the last one at the same instant
    first: Integers
    last: Integers
    status: Codes  # of the first, shape (m,)
    states: Floats  # (x, v, theta) after the last one, with growing phase, shape (m, 2n + 1)
    # times, contacts or elements with the side, and codes of the modes after them
    times: Floats
    stops: list[Stop]
    codes: list[int]
    counted: Integers  # which count as impacts; all where none does


def events_of(run: Run) -> Events:
    """Events of a run that end flights; of chatter its beginning and its end."""
    ends = np.isin(run.status, (*ENDS_OF_FLIGHTS, Status.STICK)) & ~_within_chatter(run)
    at = np.flatnonzero(ends)
    begins = np.ones(len(at), dtype=bool)
    begins[1:] = (np.diff(run.time[at]) > 0.0) | ~np.isin(run.status[at[1:]], WITH_ANOTHER)
    first, last = at[begins], at[np.append(begins[1:], True)] if at.size else at
    m, instead = mechanism_of(run.system), stand_ins(mechanism_of(run.system))
    phase = run.start.phase + m.omega * run.time[last]
    states = np.column_stack([run.position[last], run.velocity_after[last], phase])
    sides = np.where((run.limit_side[first] > 0) & (run.status[first] != Status.RELEASE), 1, -1)
    stops = list(map(Stop, run.contact[first].tolist(), sides.tolist()))
    stops = [instead.get(stop, stop) for stop in stops]
    every = run.all_codes
    if instead:
        every = [named_code(code, instead) for code in every]
    codes = [every[k + 1] for k in last]
    number = np.arange(len(first))
    together = struck_at_once(run) | released_at_once(run, every)
    for j in reversed(np.flatnonzero(np.isin(first, [*together])).tolist()):
        k = int(first[j])
        if len(names := together[k]) > 1:
            before = np.concatenate([run.position[k], run.velocity_before[k], phase[j : j + 1]])
            watch = WATCH_OF_STATUS.get(Status(run.status[k]), GAP_WATCH)
            parts = [*between(run.system, before, (every[k], codes[j]), names, watch)]
            stops[j : j + 1], codes[j:j] = names, [code for _, code in parts]
            states = np.insert(states, j, [state for state, _ in parts], axis=0)
            number = np.insert(number, j, np.full(len(parts), j))
    first, last = first[number], last[number]
    counted = np.flatnonzero(np.isin(run.status[first], STRUCK))
    return Events(
        first, last, run.status[first], states, run.time[last], stops, codes,
        counted if counted.size else np.arange(len(first)),
    )  # fmt: skip


def _within_chatter(run: Run) -> Flags:
    """Mask of the impacts that are part of completed chatter, but for the first.

    It begins as soon as what is left of it is no longer than a step of its mode.
    """
    within = np.zeros(len(run.status), dtype=bool)
    ends = np.flatnonzero(run.status == Status.CHATTER).tolist()
    if not ends:
        return within
    codes, instead = run.codes, stand_ins(mechanism_of(run.system))
    stops = map(Stop, run.contact.tolist(), run.limit_side.tolist())
    names = np.array([instead.get(stop, stop) for stop in stops])
    for end in ends:
        code = codes[end - 1]
        longest = compile_prescribed(run.system, "", (code,)).step(code)
        here = (names == names[end]).all(axis=1) & np.isin(run.status, IMPACTS)
        first = summed_from(end, run.time, here, longest)
        within[first + 1 : end] = True
    return within


def summed_from(end: int, times: Floats, struck: Flags, longest: float) -> int:
    """Number of the impact from which chatter is summed, which is over with an event.

    Parameters
    ----------
    end
        Number of that event.
    times, struck
        Times of the events, and which of them are impacts of the contact.
    longest
        Longest time to that event.
    """
    first = end
    while first > 0 and struck[first - 1] and times[end] - times[first - 1] <= longest:
        first -= 1
    return first


def cycles_of(system: System, span: float) -> int:
    """Whole periods of all forcing lines nearest to a time, in forcing cycles, at least one; 0 without forcing."""
    m = mechanism_of(system)
    least = least_cycles(m)
    return least * max(1, round(span * m.omega / (2.0 * math.pi * least))) if least else 0


def closing_loop(
    run: Run, sequence: tuple[Stop, ...] | None, cycles: int | None
) -> ClosingLoop | str:
    """Find the loop at the end of a run; return a sentence if there is none.

    Parameters
    ----------
    run
        A simulated motion.
    sequence
        Required impacts; None for any.
    cycles
        Required forcing cycles; None for any.
    """
    events = events_of(run)
    if sequence is None and run.end in ENDS_QUIETLY and (silent := eventless_loop(run, cycles)):
        return silent
    found = _settled_loop(run, events, cycles) if sequence is None else None
    if sequence is None and not (found and found[2]):
        changes = _since_last_impact(events)
        later = changes and _settled_loop(run, changes, cycles)
        if changes and (found is None or (later and later[2])):
            events, found = changes, later
    closed = found is not None and found[2]
    if not closed and (drifts := _drift(run, events, cycles)):
        return drifts
    if sequence is None and not closed and _is_silent(run, events.times):
        return eventless_loop(run, cycles) or "no loop"
    stops = [events.stops[k] for k in events.counted]
    times = events.times[events.counted]
    if sequence is not None:
        found = _last_time(stops, sequence)
    if found is None:
        wanted = f"with the impacts {sequence}" if sequence else "that closes nearly"
        since = times[-MOST_GUESSED_IMPACTS - 1] if len(times) > MOST_GUESSED_IMPACTS else 0.0
        why = "" if run.end in ENDS_QUIETLY else _without_signature(run, since, math.inf)
        reach = reach_in_words(run) if run.end in ENDS_QUIETLY else ""
        return why or f"the run has no loop {wanted}: {run.end.sentence}{reach and '; ' + reach}"
    first, last, settled = found
    whole = cycles_of(run.system, times[last] - times[first]) if cycles is None else cycles
    omega = mechanism_of(run.system).omega
    period = 2.0 * math.pi * whole / omega if omega else 0.0
    since = min(times[first], times[last] - period)
    why = _without_signature(run, since, times[last])
    if why:
        return why
    passed = events.status[(events.times > since) & (events.times <= times[last])]
    if sequence is not None and np.isin(passed, tuple(WATCH_OF_STATUS)).any():
        return UNSAID
    here = slice(events.counted[first], events.counted[last])
    flights = _flights(run, events, here)
    if isinstance(flights, str):
        return flights
    durations = np.diff(events.times[here.start : here.stop + 1])
    if not in_order(events, here.start, here.stop):
        return AT_ONCE
    impacts, states = tuple(events.stops[here]), events.states[here]
    return ClosingLoop(impacts, whole, states, durations, flights, settled)


def _is_silent(run: Run, times: Floats) -> bool:
    """Whether nothing happens at the end of a run, for a period and for longer than between its events before."""
    m = mechanism_of(run.system)
    if not m.forces:
        return False
    ended, last = float(run.time[-1]), float(times[-1]) if len(times) else 0.0
    before = float(np.diff(times[-MOST_GUESSED_IMPACTS:]).max(initial=0.0))
    period = 2.0 * math.pi * least_cycles(m) / m.omega
    return ended - last > max(period, LONGER_THAN_BETWEEN_EVENTS * before)


def eventless_loop(run: Run, cycles: int | None) -> ClosingLoop | str:
    """The loop without events of the mode in which a run ends; "" without forcing that repeats."""
    m = mechanism_of(run.system)
    whole = cycles or least_cycles(m)
    if not whole or not forcing_repeats(m, whole):
        return ""
    code = run.all_codes[-1]
    signature = without_events(m, code, whole, symmetric=False)
    here = np.concatenate([run.last.position, run.last.velocity, [run.last.phase]])
    left = (
        -here[-1] % (2.0 * math.pi) / m.omega
    )  # the motion goes on to the phase at which it is cut
    states = compile_prescribed(run.system, "", (code,)).after(here, left, code)[None]
    durations = np.array([2.0 * math.pi * whole / m.omega])
    return ClosingLoop(signature.impacts, whole, states, durations, signature.flights, True)


def _flights(run: Run, events: Events, here: slice) -> tuple[Flight, ...] | str:
    """Mode of every flight of a loop and the guard that ends it; empty without elements and rest."""
    m = mechanism_of(run.system)
    if not m.switching and not any(events.codes[here]):
        return ()
    if (events.status[here] == Status.STICK).any():
        return ALONE
    flights = flights_of(run, events, here)
    return AT_ONCE if None in flights else tuple(flight for flight in flights if flight)


def _since_last_impact(events: Events) -> Events | None:
    """The changes of state after the last impact, all counted; None where the last event is one."""
    if not events.counted.size:
        return None
    later = np.arange(events.counted[-1] + 1, len(events.times))
    return events._replace(counted=later) if later.size else None


def in_order(events: Events, first: int, last: int) -> bool:
    """Whether flights between events take time, but for those between several impacts, or releases, at one instant.

    They do not where two contacts chatter at once: of one the sum is a flight, of the other it is not.
    """
    here = slice(first, last + 1)
    times, status, stops = events.times[here], events.status[here], events.stops[here]
    released, numbers = status == Status.RELEASE, np.array([stop.contact for stop in stops])
    at_once = (np.diff(events.first[here]) == 0) | (released[1:] & released[:-1])
    if not (at_once | (np.diff(times) > 0.0)).all():
        return False
    struck, shortest = np.isin(status, IMPACTS), PLAY_OF_AMPLITUDE * (times[-1] - times[0])
    return all(
        (np.diff(times[struck & (numbers == one)]) > shortest).all() for one in {*numbers.tolist()}
    )


def flights_of(run: Run, events: Events, here: slice) -> list[Flight | None]:
    """Flight after each event of a part of a run; None where no guard ends it.

    ``here`` leaves out the last event of the run, after which no flight ends.
    """
    m, codes = mechanism_of(run.system), events.codes[here]
    compiled = compile_prescribed(run.system, "", tuple(sorted({*codes})))
    found: list[Flight | None] = []
    for k, code in enumerate(codes, here.start + 1):
        stop, status = events.stops[k], Status(events.status[k])
        if stop.contact < len(m.rigid_stops):
            found.append(Flight(code, WATCH_OF_STATUS.get(status, GAP_WATCH)))
        else:
            at = int(events.first[k])
            both = np.concatenate([run.position[at], run.velocity_before[at]])
            if m.switching[0].whole:  # which may have reset the state
                span = float(run.time[at] - events.times[k - 1])
                both = compiled.after(events.states[k - 1], span, code)[:-1]
            watch = _watch_at(run, compiled, code, stop, at, both)
            found.append(None if watch == GAP_WATCH else Flight(code, watch))
    return found


def _watch_at(run: Run, compiled: Prescribed, code: int, stop: Stop, at: int, both: Floats) -> int:
    """Watch of an element whose limit on a side is nearest at an event, (x, v) being ``both``; GAP_WATCH for none."""
    theta = run.start.phase + compiled.omega * run.time[at]
    y = compiled.embedded(both, theta)
    found = [(TOUCHING_OF_TERMS, GAP_WATCH)]
    for guard in compiled.modes[code].guards:
        limit = guard.upper if stop.side > 0 else guard.lower
        if guard.contact == stop.contact and not math.isinf(limit):
            terms = np.abs(guard.row).sum() * np.abs(y).max() + abs(guard.gain) + abs(limit)
            found.append((abs(guard.row @ y + guard.gain - limit) / terms, guard.watch))
    return min(found)[1]


def _without_signature(run: Run, since: float, until: float) -> str:
    """Reason why a part of a run has no signature: an open law, or contacts that move each other struck at once."""
    here = (run.time >= since) & (run.time <= until)
    if (run.status[here] == Status.NON_UNIQUE).any():
        return OPEN
    return TOGETHER if together(run)[here].any() else ""


# first and last impact of a loop, and whether it closes within GAP_OF_SETTLED
Found = tuple[int, int, bool]


def _drift(run: Run, events: Events, cycles: int | None) -> str:
    """Sentence about a settled motion that closes but for a shift that nothing resists; "" for others."""
    m = mechanism_of(run.system)
    translations = translations_of(m)
    if not translations.references:
        return ""
    states = events.states[events.counted]
    found = _nearest_loop(run, translations.relative(states), events, cycles, 0.0)
    if found is None:
        return ""
    first, last, _ = found
    begun, ended = events.times[events.counted][[first, last]]
    span, loop = float(ended - begun), states[first : last + 1]
    # the way that its speeds cover: all its events may be at one place
    way = span * float(np.abs(loop[:, m.degrees : 2 * m.degrees]).max())
    return _drift_words(
        loop[-1, : m.degrees] - loop[0, : m.degrees],
        GAP_OF_SETTLED * way,
        cycles_of(run.system, span),
    )


def _drift_words(advance: Floats, least: float, cycles: int) -> str:
    """Sentence about a motion that advances in every period; "" where it does by no more than ``least``.

    The period has so many forcing cycles, 0 without forcing.
    """
    moving = np.flatnonzero(np.abs(advance) > least)
    if not moving.size:
        return ""
    which = ", ".join(f"coordinate {i} by {advance[i]:.6g}" for i in moving)
    period = "period" if cycles < 2 else f"period of {cycles} forcing cycles"
    return (
        f"{DRIFTS}: in every {period} it advances, {which}, so that it does not close and is no orbit. "
        "classify takes it without the drift"
    )


def _settled_loop(run: Run, events: Events, cycles: int | None) -> Found | None:
    drifts = resisted_translations(mechanism_of(run.system))
    return _nearest_loop(run, drifts.relative(events.states[events.counted]), events, cycles)


def _nearest_loop(
    run: Run, states: Floats, events: Events, cycles: int | None, nearly: float = GAP_OF_GUESS
) -> Found | None:
    """The shortest good loop at the end of a run, by the states after its counted events.

    Where the motion rests on stops, at the last event after a release: the run may end within chatter.
    """
    plain = _loop_to(len(events.counted) - 1, run, states, events, cycles, nearly)
    releases = np.flatnonzero(events.status == Status.RELEASE)
    after = np.searchsorted(events.counted, releases)
    in_order = int(max(after[after < len(events.counted)], default=0))
    if plain and plain[2] and not (releases > events.counted[plain[0]]).any():
        return plain
    found = _loop_to(in_order, run, states, events, cycles, nearly)
    return found if found and (found[2] or not plain) else plain


def _loop_to(
    last: int, run: Run, states: Floats, events: Events, cycles: int | None, nearly: float
) -> Found | None:
    """The shortest good loop that ends with this one of the counted events."""
    if last < 1:
        return None
    times = events.times[events.counted]
    stops = [events.stops[k] for k in events.counted]
    omega = mechanism_of(run.system).omega
    rate = omega or 1.0 / float(times[last] - times[0])
    met = np.abs(run.velocity_before[events.first]).max(axis=0, initial=0.0)
    moved = np.vstack([np.abs(states[:, :-1]), np.append(np.zeros(len(met)), met)])
    spread = np.ptp(states[:, :-1], axis=0) + STILL_OF_MOTION * _sizes(moved, rate)
    best: tuple[float, int] | None = None
    for first in range(last - 1, max(-1, last - MOST_SETTLED_IMPACTS - 1), -1):
        if stops[first] != stops[last]:
            continue
        away = np.abs((states[last] - states[first])[:-1])
        distance = float(np.divide(away, spread, out=np.zeros_like(away), where=away > 0.0).max())
        span = float(times[last] - times[first])
        whole = cycles_of(run.system, span) if cycles is None else cycles
        distance = max(distance, abs(span * omega / (2.0 * math.pi) - whole)) if omega else distance
        if distance < GAP_OF_SETTLED:
            return first, last, True  # longer loops repeat this one
        near = distance < nearly and last - first <= MOST_GUESSED_IMPACTS
        if near and (best is None or distance < best[0]):
            best = distance, first
    return (best[1], last, False) if best else None


def _sizes(states: Floats, rate: float) -> Floats:
    """Size of the motion by coordinate of (x, v): one length, and the speed that it has at this rate."""
    places, speeds = np.split(np.abs(states), 2, axis=1)
    length = max(float(places.max()), float(speeds.max()) / rate)
    return np.repeat([length, rate * length], places.shape[1])


def _last_time(stops: list[Stop], sequence: tuple[Stop, ...]) -> Found | None:
    """The last occurrence of a sequence followed by its first stop."""
    count, wanted = len(sequence), [*sequence, *sequence[:1]]
    begins = [k for k in range(len(stops) - count) if stops[k : k + count + 1] == wanted]
    return (begins[-1], begins[-1] + count, False) if begins else None
