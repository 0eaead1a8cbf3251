"""Classification of the attractor of a motion, by stated tests.

Method      windows of section points (windows.py) after 1, 8, 64 ... times the shortest settling are
            classified (point_sets.py); the first periodic window decides, otherwise the last; where that is
            undecided, all are repeated with more points and settling; where chaos ends while
            its exponent is measured, one more window is classified from there on
            transient: the settling before the first window from which all windows agree
Fails       undecided, with the reason
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.checks import check_count, names_arguments
from vibroimpact._core.progress import interruptible
from vibroimpact._core.types import Amount, Count, Floats, Symbol
from vibroimpact.attractors.orbit_type import (
    OrbitType,
    is_symmetric,
    multipliers,
    orbit_symbol,
    orbit_type,
)
from vibroimpact.attractors.point_sets import (
    FEWEST_POINTS,
    RETURN_TOLERANCE,
    InvariantSet,
    Kind,
    classify_points,
)
from vibroimpact.attractors.rotation import Rotation, weighted_average
from vibroimpact.attractors.windows import EXPONENT_IMPACTS, Sampler, Window
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.model.translations import Translations
from vibroimpact.results.result import INSIDE, Result, along
from vibroimpact.simulation.lyapunov import LyapunovEstimate, no_exponent
from vibroimpact.simulation.places import At, AtStop, place_in, place_without_stops
from vibroimpact.simulation.sections import Section, check_points, scale_of
from vibroimpact.simulation.simulate import ENDS_QUIETLY, RunEnd, Status
from vibroimpact.simulation.simulator import Simulator

# A window begins so many times later than the last: a transient is known within this factor.
SETTLING_FACTOR = 8
# A stop and a state on it agree within so much of their size.
ON_STOP_RELATIVE = 64.0 * np.finfo(float).eps
# Where nothing decides, all is repeated with four times the points (near a locked motion a curve
# is visible only after many turns) and four times the longest settling, twice.
MOST_ATTEMPTS = 3
ATTEMPT_FACTOR = 4
# The motion may change so often while exponents are measured, with a new window each time.
MOST_CHANGES = 3


@dataclass(frozen=True, eq=False)
class Attractor(Result):
    """Attractor of a motion.

    Attributes
    ----------
    shape
        Invariant set of the section points: kind, period, pieces, curve, return distance, reason.
    type
        n-p-q of a periodic motion at the contact of the section, else None; completed chatter
        counts as one impact.
    symbol
        n-p-q with a pair p-q for every contact that impacts, as of
        :attr:`~vibroimpact.Orbit.symbol`; without forcing there is no n: p-q. 3-0-0 is a motion
        without impacts that repeats after three forcing periods. Empty for other kinds.
    multipliers
        Floquet multipliers of a periodic motion, largest first; None for other kinds, for orbits
        that chatter or stick, and where the points are at no stop: take
        :func:`~vibroimpact.find_orbit`.
    symmetric
        Whether the attractor is its own mirror image; None where not decided (chaos).
    exponent
        Largest Lyapunov exponent after the section points; that of the last part where the motion
        changes meanwhile.
    progress
        Drift of the coordinates per forcing period, without forcing per unit of time, shape (n,):
        of a machine that nothing holds in its place, as a pile or a capsule. Its points are
        compared relative to one of its bodies, and a motion that repeats but for the drift is
        periodic. Zero for other machines.
    periods_per_point
        Forcing periods per section point, on average; 0 without forcing.
    impacts, chatters, sticks
        Recorded on the attractor: impacts at all stops, completed chatter, rests on a stop.
    transient
        Impacts (forcing periods, changes) before the first window from which all windows agree; 0 if
        all do.
    windows
        (impacts settled, label) of every window.
    rest
        "at rest on stop A" (or B, or several) of a motion that ends at rest there; else empty.
    section
        The points of the last window.
    """

    shape: InvariantSet
    type: OrbitType | None
    symbol: Symbol
    multipliers: NDArray[np.complex128] | None = field(metadata=along("multiplier"))
    symmetric: bool | None
    exponent: LyapunovEstimate
    periods_per_point: Amount
    impacts: Count
    chatters: Count
    sticks: Count
    section: Section = field(metadata=INSIDE, repr=False)
    progress: Floats = field(metadata=along("coordinate"), repr=False)
    transient: Count = 0
    windows: tuple[tuple[Count, str], ...] = ()
    rest: str = ""

    @property
    def kind(self) -> Kind:
        """Kind of the attractor."""
        return self.shape.kind

    @property
    def reason(self) -> str:
        """Reason if it is undecided; else empty."""
        return self.shape.reason

    @property
    def rotation(self) -> Rotation | None:
        """Rotation number of quasiperiodic motion: angle / 2 pi per return to its closed curve.

        The angle is about the centre of the curve, averaged over all ``shape.pieces``-th section
        points, folded to [0, 1/2]. With one curve and one section point per forcing period it is
        the angle per forcing cycle, comparable with that of a Neimark-Sacker multiplier.
        """
        if self.kind is not Kind.QUASIPERIODIC or self.shape.curve is None:
            return None
        return self.shape.curve.rotation

    @property
    def name(self) -> str:
        """Kind with n-p-q, number of curves or of pieces."""
        shape = self.shape
        if shape.kind is Kind.PERIODIC:
            return f"{self.symbol} periodic"
        if shape.kind is Kind.QUASIPERIODIC and shape.curve:
            turns = f" of {shape.curve.turns} turns" if shape.curve.turns > 1 else ""
            plural = "s" if shape.pieces > 1 else ""
            return f"quasiperiodic, {shape.pieces} closed curve{plural}{turns}"
        if shape.kind is Kind.CHAOTIC and shape.pieces > 1:
            return f"chaotic in {shape.pieces} pieces"
        return self.rest or str(shape.kind)

    @property
    def label(self) -> str:
        """Name, symmetry, chatter, sticking and preceding transient chaos in one line."""
        words = [self.name]
        if self.symmetric is not None:
            words.append("symmetric" if self.symmetric else "not symmetric")
        words += ["with chatter"] if self.chatters else []
        words += ["with sticking"] if self.sticks and not self.rest else []
        words += ["advancing"] if self.progress.any() else []
        chaos = self.transient_name.startswith(Kind.CHAOTIC) and self.kind is not Kind.CHAOTIC
        words += ["after transient chaos"] if chaos else []
        return ", ".join(words)

    def __repr__(self) -> str:
        words = [f"Attractor: {self.label}"]
        if self.multipliers is not None and len(self.multipliers):
            words.append(f"largest multiplier {abs(self.multipliers[0]):.6g}")
        if math.isfinite(self.exponent.value):
            words.append(f"exponent {self.exponent.value:.4g} +- {self.exponent.error:.1g}")
        words += [f"settled after {self.transient}"] if self.transient else []
        words += [one for one in (self.reason, self.section.reach) if one]
        return "; ".join(words)

    @property
    def transient_name(self) -> str:
        """Name of the motion before it settled; empty if it settled at once."""
        before = [name for settled, name in self.windows if settled < self.transient]
        return before[-1] if before else ""


@names_arguments()
@interruptible
def classify(
    system: System,
    start: State,
    *,
    settle_events: int = 1000,
    points: int = 4000,
    most_settle_events: int = 64_000,
    at: At | None = None,
) -> Attractor:
    """Classify the attractor on which a motion settles.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one.
    start
        Initial state.
    settle_events
        Impacts (at all stops) discarded before the first window, >= 1, or forcing periods, or
        changes, whatever the section has; every next window waits 8 times longer.
    points
        Section points per window, >= 64; chaos with k bands or k closed curves needs 64 k.
    most_settle_events
        Longest settling; chaos that lasts as long is called chaotic. Where nothing decides, all is
        repeated with 4, then 16 times ``points`` and ``most_settle_events``.
    at
        Where the points are, as in :func:`~vibroimpact.section`. Where a stop is so seldom met that
        other events fill the record, they are taken at phase 0 of the force, and without forcing at
        the changes of the first friction.

    Returns
    -------
    Attractor
        With :attr:`Attractor.label`, and :attr:`Attractor.reason` where it is undecided.

    Raises
    ------
    InvalidParameterError
        A bad start, counts out of range, no such place.

    Notes
    -----
    A quarter of a second for the impact damper, less for periodic motion, some seconds where all
    is repeated; the tests are those of :func:`~vibroimpact.classify_points`. Unreliable:
    chaos that ends after ``most_settle_events`` impacts; motion within 1e-6 of a bifurcation in its
    multiplier; several forcing lines of incommensurate frequencies (only the phase of the first is
    used).

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> classify(damper, vi.State((0.0, 0.0), (0.0, 1.0))).label
    '1-1-1 periodic, symmetric'
    """
    check_count("settle_events", settle_events, 1)
    check_count("points", points, FEWEST_POINTS)
    check_count("most_settle_events", most_settle_events, settle_events)
    at = place_in(system, at)
    check_points(system, at, points)
    motion = partial(Simulator, system, start)
    found = _decided(lambda: Sampler(motion(), at), settle_events, most_settle_events, points)
    few = len(found.section) < FEWEST_POINTS
    if few and found.section.end is RunEnd.EVENTS and isinstance(at, AtStop):
        other = place_without_stops(mechanism_of(system), at.contact)
        found = _decided(
            lambda: Sampler(motion(), other), settle_events, most_settle_events, points
        )
    return found


def _decided(
    sampler: Callable[[], Sampler], settle_events: int, most_settle_events: int, points: int
) -> Attractor:
    """Classify a motion, with more points and settling where nothing decides."""
    for attempt in range(MOST_ATTEMPTS):
        more = ATTEMPT_FACTOR**attempt
        found = _with_history(
            list(_windows(sampler(), settle_events, more * most_settle_events, more * points))
        )
        if found.kind is not Kind.UNDECIDED or len(found.section) < FEWEST_POINTS:
            break  # without section points, more settling cannot decide
    return found


def _windows(
    sampler: Sampler, settle_events: int, most_settle_events: int, points: int
) -> Iterator[tuple[int, Attractor]]:
    """Impacts, periods or changes discarded and the window after them, until a window decides."""
    spent = changes = 0
    while settle_events <= most_settle_events:
        sampler.settle(max(settle_events - spent, 0))
        spent = max(settle_events, spent)
        taken = sampler.take(points)
        window = _classified(sampler, taken)
        yield spent, window
        if window.kind in (Kind.PERIODIC, Kind.SILENT, Kind.DIVERGED):
            return
        if isinstance(sampler.at, AtStop) and taken.end is RunEnd.EVENTS:
            return  # other events fill the record: another section is needed
        spent, settle_events = spent + taken.length, settle_events * SETTLING_FACTOR
        if window.exponent.earlier and changes < MOST_CHANGES:
            changes += 1
            settle_events = min(settle_events, spent + EXPONENT_IMPACTS)
            most_settle_events = max(most_settle_events, settle_events)


def _with_history(windows: list[tuple[int, Attractor]]) -> Attractor:
    """Return the last window, with the transient and rare events of the earlier ones."""
    last = windows[-1][1]
    agreeing = len(windows)
    while agreeing and windows[agreeing - 1][1].name == last.name:
        agreeing -= 1
    kept = windows[agreeing:]
    return dataclasses.replace(
        last,
        impacts=sum(window.impacts for _, window in kept),
        chatters=sum(window.chatters for _, window in kept),
        sticks=sum(window.sticks for _, window in kept),
        transient=kept[0][0] if agreeing else 0,
        windows=tuple((settled, window.name) for settled, window in windows),
    )


def _classified(sampler: Sampler, window: Window) -> Attractor:
    """Classify a window of a motion, which is at its end."""
    motion, part, section = sampler.motion, window.part, window.section
    at_stop = isinstance(sampler.at, AtStop)
    points = part if at_stop else section  # all impacts, at other stops, too
    before, time = part.velocity_before, section.time
    scale = scale_of(points.position, points.velocity, before, time, motion.system)
    full = at_stop and window.end is RunEnd.EVENTS  # impacts are too seldom
    exponent = no_exponent(window.end) if full else sampler.exponent()
    rest = ""
    if window.end is RunEnd.POINTS and len(section) < FEWEST_POINTS:
        shape = InvariantSet(Kind.UNDECIDED, reason=window.found)
    elif window.end is RunEnd.POINTS:
        iterates = scale.points(section.position, section.velocity, section.phase)
        first = (*exponent.earlier, exponent)[0]  # the points come before the exponent
        shape = classify_points(iterates, first)
    else:
        if window.end in ENDS_QUIETLY:
            rest = rest_on_stops(motion.system, motion.position[None])[0]
        kinds = {RunEnd.DIVERGED: Kind.DIVERGED} | dict.fromkeys(ENDS_QUIETLY, Kind.SILENT)
        shape = InvariantSet(kinds.get(window.end, Kind.UNDECIDED), reason=window.end.sentence)
    omega = mechanism_of(section.system).omega
    elapsed = np.diff(section.time) * (omega / (2.0 * np.pi))
    kind = orbit_type(shape, window)
    return Attractor(
        shape=shape,
        type=kind,
        symbol=orbit_symbol(kind, shape, window),
        multipliers=multipliers(motion, shape, window),
        symmetric=is_symmetric(shape, window, scale),
        exponent=exponent,
        progress=_progress(section, shape, scale.translations),
        periods_per_point=float(weighted_average(elapsed)) if len(elapsed) else 0.0,
        impacts=len(part.high),
        chatters=int((part.status == Status.CHATTER).sum()),
        sticks=part.sticks,
        rest=rest,
        section=section,
    )


def _progress(section: Section, shape: InvariantSet, translations: Translations) -> Floats:
    """Drift per forcing period, or per time without forcing: over a loop, or all points."""
    n = section.position.shape[1]
    first = -1 - shape.period if shape.period else 0
    if not translations.references or len(section) < 2 or shape.kind is Kind.UNDECIDED:
        return np.zeros(n)
    step = section.position[-1] - section.position[first]
    step -= translations.removed(step)  # what is left of a loop of the other coordinates
    omega = mechanism_of(section.system).omega
    time = section.time[-1] - section.time[first]
    step[np.abs(step) <= RETURN_TOLERANCE * _size(section, translations)] = 0.0
    drift: Floats = step / (time * omega / (2.0 * np.pi) if omega else time)
    return drift


def _size(section: Section, translations: Translations) -> float:
    """Size of the motion without its drift: at its section points, or how far its speed carries it."""
    place = np.abs(translations.removed(section.position)).max()
    way = np.abs(section.velocity).max() * np.median(np.diff(section.time))
    return float(max(place, way))


def rest_on_stops(system: System, position: Floats) -> list[str]:
    """Name the stops on which motions without impacts rest at these positions, shape (k, n).

    "at rest on stop A", with the number of the contact ("A1 and B2") where there are several; empty
    for motions in flight.
    """
    words = [""] * len(position)
    for name, rests in _stops(system, position):
        joined = (f"{word} and {name}" if word else f"at rest on stop {name}" for word in words)
        words = [new if r else old for new, old, r in zip(joined, words, rests, strict=True)]
    return words


def _stops(system: System, position: Floats) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Name of every stop, and the mask of the positions (k, n) that lie on it."""
    contacts = mechanism_of(system).rigid_stops
    for number, law in enumerate(contacts):
        row = np.array(law.row)
        u, size = position @ row, np.abs(position) @ np.abs(row)
        for name, limit in (("A", law.upper), ("B", law.lower)):
            if np.isfinite(limit):
                on = np.abs(u - limit) <= ON_STOP_RELATIVE * (size + abs(limit))
                yield (name if len(contacts) == 1 else f"{name}{number}"), on
