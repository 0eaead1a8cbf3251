"""All Lyapunov exponents of a motion, with their errors, beside the exact sum.

Method      D_k, the derivative from just after one impact to just after the next at equal times
            (T33), from the kernel; without forcing modulo the direction f of the flow
            D_k Q_k = Q_k+1 U_k,   Q orthonormal, U upper triangular,   g_ik = log (U_k)_ii      (1)
            lambda_i = sum w_k g_ik / sum w_k T_k,  w_k = exp(-1 / 4s(1 - s)), s = (k + 1/2) / N (2)
            sum_i g_ik + log |f_k+1| / |f_k| = log R_k^2 - T_k tr(M^-1 C), for every k           (3)
            error = max(scatter of (2) over 16 blocks / 4, half of its change from the first half of
            the impacts to the second, rounding)                                                (4)
Assumes     every contact opens now and then, so that flights begin and end in an impact
Accuracy    (3) holds to rounding for any weights, since it holds for every impact.
            The weights let (2) converge faster than any power of N in periodic and quasiperiodic
            motion, where plain means have an error of order 1 / N. In chaos they raise the error by
            a sixth, mean(w^2)^(1/2) / mean(w) = 1.16; the quarter in them keeps that low.
            The scatter of 16 blocks has an error of 18 %, and assumes that correlations are shorter
            than a block. A slow drift (a transient that remains, tangents that still turn) is in
            the second part of (4), which by chance alone raises an error by a sixth on average.
            A flight that would turn all tangents into one direction is cut (`LOST_FOLDS`).
Fails       -inf from an exponent on: chatter that ends in rest, sticking and plastic impacts let
            the motion forget directions. nan: the motion ends, a contact never opens, or an impact
            grazes.
Reference   [benettin1980] for (1), [muller1995] for jumps, [das2017] for (2), [kaplan1979] for the
            dimension
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibroimpact._core.checks import check_count, check_memory, names_arguments, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.progress import Announcement, announce_measured, interruptible
from vibroimpact._core.types import (
    Amounts,
    AnyAmount,
    AnyAmounts,
    AnyFloat,
    AnyFloats,
    Codes,
    Floats,
)
from vibroimpact.compile.modes import closed_from_code
from vibroimpact.compile.piecewise import Piecewise
from vibroimpact.compile.prescribed import compile_prescribed
from vibroimpact.model.mechanism import Mechanism, needs_elements
from vibroimpact.model.state import State
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.results.result import Result, along
from vibroimpact.simulation.derivatives import map_derivative
from vibroimpact.simulation.lyapunov import (
    ALIGNING_DIVISOR,
    ERRORS_OF_CERTAINTY,
    FEWEST_BLOCKS,
    FIRST_BLOCKS,
    errors_of,
    parts_of,
    weighted_ratio,
)
from vibroimpact.simulation.simulate import (
    COUNTED,
    GOES_ON,
    RunEnd,
    Status,
    events_for,
    first_phases,
    flight_limit_of,
    phase_after,
    phases_of,
)
from vibroimpact.simulation.simulator import CHUNK_EVENTS, Simulator

# An exponent that is farther from a rate, relative to it, is no estimate of it.
OWN_RATE_RELATIVE = 1e-6
VANISHED_LENGTH = 2.0**-44  # rounding leaves this of length 1, as in the kernel (growth.hpp)
# Tangents may lose their angles by so many e-folds between two orthonormalisations.
LOST_FOLDS = 8.0
KERNEL_TANGENTS = 6  # the kernel carries so many tangents at once
FREE_CODE = 0  # the mode without closed contacts has this code
NOT_REPEATED = "chatter or sticking could not be repeated"
NEVER_FREE = (
    "no free flight ends in an impact at one contact: a contact stays closed, or all impacts are "
    "simultaneous"
)


@dataclass(frozen=True, eq=False, repr=False)
class LyapunovSpectrum(Result):
    """All Lyapunov exponents of a motion, without the neutral direction of time.

    Attributes
    ----------
    values, errors
        Per unit of time, largest first, each with one standard error; shape (m,).
    per_impact
        Growth per impact instead of per time, shape (m,).
    contraction
        Growth of volumes per unit of time, exactly: the logarithm of restitution^2 over the impacts
        and -trace(M^-1 C) over the flights. -inf where a direction is forgotten; nan after impacts
        of several contacts at once.
    flow
        Growth of the velocity of the flow per unit of time, which tends to 0; 0 with forcing.
    growth, duration, impacts
        Natural logarithms of the growth between impacts, shape (N, m), in the order of ``values``;
        the times between them, and how many impacts each stands for, shape (N,).
    discarded
        Share of the average that was left out because the motion changed after it.
    run_end
        Why the run ended; ``RunEnd.OBSERVER`` where all tangents vanished.
    complete
        Whether these are all exponents.
    reason
        Why there are none, "" where there are.
    system
        The system that moves.
    """

    values: AnyFloats = field(metadata=along("exponent", quantity="rate"))
    errors: AnyAmounts = field(metadata=along("exponent", quantity="rate"))
    per_impact: AnyFloats = field(metadata=along("exponent"))
    contraction: AnyFloat
    flow: AnyFloat
    growth: AnyFloats = field(metadata=along("block", "exponent"), repr=False)
    duration: Amounts = field(metadata=along("block", quantity="time"), repr=False)
    impacts: Amounts = field(metadata=along("block"), repr=False)
    discarded: AnyAmount
    run_end: RunEnd
    complete: bool = field(repr=False)
    reason: str = field(default="", repr=False)
    system: System | None = field(default=None, repr=False)

    @property
    def sum(self) -> float:
        """Sum of the values."""
        return float(self.values.sum())

    @property
    def determinant_error(self) -> float:
        """Error of ``sum + flow`` against ``contraction``, relative to the largest of the terms.

        nan where not all exponents were computed.
        """
        if not self.complete or math.isnan(self.contraction):
            return math.nan
        found = self.sum + self.flow
        if found == self.contraction:  # infinities as well
            return 0.0
        if math.isinf(found) or math.isinf(self.contraction):
            return math.inf
        size = max(abs(self.contraction), float(np.abs(self.values).max(initial=0.0)))
        return abs(found - self.contraction) / size

    @property
    def zero(self) -> NDArray[np.bool_]:
        """Mask of the exponents that are zero within three errors."""
        return np.abs(self.values) <= ERRORS_OF_CERTAINTY * self.errors

    @property
    def positive(self) -> NDArray[np.bool_]:
        """Mask of the exponents that exceed three errors."""
        return self.values > ERRORS_OF_CERTAINTY * self.errors

    @property
    def negative(self) -> NDArray[np.bool_]:
        """Mask of the exponents below minus three errors."""
        return self.values < -ERRORS_OF_CERTAINTY * self.errors

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension of the attractor in the section; the flow's has one more.

        The number of exponents whose sum is not negative, and the share of the next one that brings
        the sum to zero. Exponents that are zero within their errors count as zero. nan where
        the sum stays positive or zero and not all exponents were computed.
        """
        if np.isnan(self.values).any():
            return math.nan
        total = 0.0
        for k, value in enumerate(np.where(self.zero, 0.0, self.values)):
            if total + value < 0.0:
                return k + total / -float(value)
            total += float(value)
        return float(self.values.size) if self.complete else math.nan

    @property
    def statement(self) -> str:
        """Sentence of what the numbers say."""
        if self.reason:
            return self.reason
        words = []
        forgotten = int(np.isneginf(self.values).sum())
        for name, mask in (("positive", self.positive), ("zero", self.zero)):
            if mask.any():
                words.append(f"{int(mask.sum())} {name}")
        if rest := int((self.negative & np.isfinite(self.values)).sum()):
            words.append(f"{rest} negative")
        if forgotten:
            words.append(f"{forgotten} -inf: the motion forgets as many directions of its start")
        text = ", ".join(words)
        if self.discarded:
            text += f"; the first {self.discarded:.0%} left out, where the motion was another one"
        return text

    def __repr__(self) -> str:
        pairs = zip(self.values, self.errors, strict=True)
        shown = ", ".join(f"{value:.6g} +- {error:.1g}" for value, error in pairs)
        lines = [f"LyapunovSpectrum: {self.statement}"]
        if not self.reason:
            lines.append(f"  per unit of time  {shown}")
            known = self.complete and not math.isnan(self.contraction)
            exact = f", exactly {self.contraction - self.flow:.9g}" if known else ""
            lines.append(f"  sum               {self.sum:.9g}{exact}")
            lines.append(f"  dimension         {self.dimension:.6g} in the section")
        return "\n".join(lines)


@names_arguments()
@interruptible
def lyapunov_spectrum(
    system: System,
    start: State,
    *,
    impacts: int = 20_000,
    settle_impacts: int = 1000,
    exponents: int | None = None,
) -> LyapunovSpectrum:
    """Estimate all Lyapunov exponents of a motion, or the largest of them.

    Parameters
    ----------
    system
        A :class:`~vibroimpact.Mechanism`, or anything with one.
    start
        Initial state.
    impacts
        Length of the average, >= 1024. The errors fall as 1 / sqrt(impacts) in chaos.
    settle_impacts
        Impacts (at all stops) to discard first, >= 0; the first sixteenth of ``impacts`` is
        discarded besides, while the tangents turn.
    exponents
        Number of exponents, the largest, 1 to m; default: all m.

    Returns
    -------
    LyapunovSpectrum
        Of a machine with soft stops, friction, moving stops or matrices that are not symmetric, and where
        chatter or rest cannot be repeated, the largest six, from event to event, without ``contraction``.

        With n coordinates and L forcing lines m = 2n + L - 1 exponents, 2n - 1 without forcing, and
        one less for every coordinate without mass:
        those of the impact map over time, as :func:`vibroimpact.lyapunov_exponent` counts them. A
        shift in time, which has the exponent 0, is not among them; differences of phase between
        several lines are, each with an exact 0. Exponents nan with the reason in ``statement`` if
        the motion stops impacting or a contact never opens, -inf where directions are forgotten.

    Raises
    ------
    InvalidParameterError
        Counts out of range, a bad start.

    Notes
    -----
    The motion is simulated once; the kernel gives the derivative of every flight with its impact,
    and that of chatter, sticking and release (theory.md, T42d to T42g). QR decompositions
    from impact to impact give the exponents, and means with smooth weights converge to rounding in
    periodic motion. For two coordinates some 60 microseconds per impact. Unreliable where chaos
    ends later, and near grazing, where single impacts stretch without bound.

    References
    ----------
    [benettin1980], [muller1995], [das2017]

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.01)
    >>> found = vi.lyapunov_spectrum(damper, vi.State((0.0, 0.0), (0.0, 1.0)), impacts=4000)
    >>> found.values.shape, found.determinant_error < 1e-12
    ((4,), True)
    """
    check_count("impacts", impacts, FIRST_BLOCKS)
    check_count("settle_impacts", settle_impacts, 0)
    mechanism = mechanism_of(system)
    lines = max(len(mechanism.forces) - 1, 0)
    carried = 2 * mechanism.degrees - len(mechanism.massless) - (not mechanism.forces)
    if exponents is not None:
        check_count("exponents", exponents, 1, carried + lines)
    wanted = carried + lines if exponents is None else int(exponents)
    check_memory("impacts", impacts, 8 * (carried + 4), "Take fewer.")
    motion = Simulator(system, start)
    end = motion.settle(settle_impacts)
    if end not in GOES_ON:
        found = _without(wanted, end, end.sentence)
    elif needs_elements(mechanism):
        found = _from_events(motion, int(impacts), wanted, carried + lines, exponents)
    else:
        found = _of_impacts(motion, int(impacts), (wanted, carried, lines), exponents)
    return replace(found, system=system)


def _of_impacts(
    motion: Simulator, impacts: int, counts: tuple[int, int, int], exponents: int | None
) -> LyapunovSpectrum:
    """Exponents of a machine with rigid stops, by tangents that the kernel carries."""
    wanted, carried, lines = counts
    settled = motion.at
    found = _Growth(motion, min(wanted, carried))
    end = found.record(impacts)
    if found.reason == NOT_REPEATED:
        motion.at = settled
        return _from_events(motion, impacts, wanted, carried + lines, None)
    if found.reason:
        return _without(wanted, end, found.reason)
    return _estimated(found.arrays(), end, lines, wanted, exponents is None)


def _from_events(
    motion: Simulator, impacts: int, wanted: int, most: int, count: int | None
) -> LyapunovSpectrum:
    """Growth of tangents from event to event, as the kernel has it; of any machine."""
    if count is not None and count > KERNEL_TANGENTS:
        raise refusal(
            "count", count, f"at most {KERNEL_TANGENTS}",
            "Of a machine with elements the kernel carries so many tangents.",
        )  # fmt: skip
    m = motion.compiled.mechanism
    wanted, events = min(wanted, KERNEL_TANGENTS), events_for(m, impacts)
    tangents = min(wanted + len(m.massless), KERNEL_TANGENTS)
    kernel, limit = motion.compiled.kernel, flight_limit_of(motion.compiled)

    def through(count: int, every: int) -> Any:
        part = kernel.spectrum(motion.at, math.inf, limit, events, count, every, tangents)
        while RunEnd(part["why"]) is RunEnd.MISSING and motion.compiled.add_code(part["code"]):
            part = kernel.spectrum(motion.at, math.inf, limit, events, count, every, tangents)
        return part

    announce_measured("impacts", impacts, lambda n: through(n, n))
    part = through(impacts, 1)
    end = RunEnd(part["why"])
    if end not in (*GOES_ON, RunEnd.OBSERVER):
        return _without(wanted, end, end.sentence)
    if end is RunEnd.OBSERVER:  # the first tangent has vanished, or is no number
        return _forgotten(wanted, end)
    with np.errstate(invalid="ignore"):
        growth = np.diff(part["growth"], axis=0)
    growth[np.isneginf(part["growth"][1:])] = -math.inf
    duration = np.diff(part["time"])
    moved = duration > 0.0  # events at one time are one
    rows = np.append(0, np.flatnonzero(moved)[:-1] + 1) if moved.any() else np.arange(0)
    growth = np.add.reduceat(growth, rows, axis=0)
    duration = np.add.reduceat(duration, rows)
    counted = impacts if end is RunEnd.IMPACTS else part["events"]
    between = counted / max(part["events"], 1) * len(moved)  # from the first event to the last
    each = np.full(len(duration), between / max(len(duration), 1))
    unknown = np.full(len(duration), math.nan)
    columns = growth, duration, each, unknown, np.zeros(len(duration))
    found = _estimated(columns, end, 0, tangents, wanted == most)
    return _of_states(found, m, wanted)


def _of_states(found: LyapunovSpectrum, m: Mechanism, wanted: int) -> LyapunovSpectrum:
    """Largest ``wanted`` exponents of a machine, without those of velocities that are no states.

    The kernel has a velocity for every coordinate. Of one without mass it decays at the rate of the
    mode's scale (compile/piecewise.py), or is forgotten where a mode begins.
    """
    own = -float(Piecewise(m).scale) if m.massless else 0.0
    kept = list(range(len(found.values)))
    for _ in m.massless:
        far = np.abs(found.values - own) > OWN_RATE_RELATIVE * abs(own) + 4.0 * found.errors
        fictitious = [k for k in kept if not far[k]] or [
            k for k in kept if np.isneginf(found.values[k])
        ]
        if fictitious:
            kept.remove(fictitious[-1])
    kept = kept[:wanted]
    return replace(
        found, values=found.values[kept], errors=found.errors[kept],
        per_impact=found.per_impact[kept], growth=found.growth[:, kept],
    )  # fmt: skip


def _forgotten(count: int, end: RunEnd) -> LyapunovSpectrum:
    """Return exponents of -inf: the motion does not depend on its start."""
    gone, none = np.full(count, -math.inf), np.empty(0)
    return LyapunovSpectrum(
        gone, np.zeros(count), gone, math.nan, math.nan, np.empty((0, count)), none, none, 0.0, end,
        complete=False,
    )  # fmt: skip


def _without(count: int, end: RunEnd, reason: str) -> LyapunovSpectrum:
    """Return exponents of NaN, with the reason."""
    nothing = np.full(count, math.nan)
    return LyapunovSpectrum(
        nothing, nothing, nothing, math.nan, math.nan, np.empty((0, count)), np.empty(0),
        np.empty(0), 0.0, end, complete=False, reason=reason,
    )  # fmt: skip


# ---- means and errors ----------------------------------------------------------------------------


def _last_part(growth: Floats, duration: Floats) -> int:
    """Index from which on the motion is the last one (parts_of)."""
    size = max(1, len(duration) // FIRST_BLOCKS)
    starts = np.arange(0, len(duration) // size * size, size)
    blocks = np.add.reduceat(growth, starts), np.add.reduceat(duration, starts)
    return int(starts[parts_of(*blocks)[-1].start])


def _contraction(exact: Floats, duration: Floats) -> float:
    """Weighted mean per unit of time; -inf and nan of a single term are those of the whole."""
    if np.isneginf(exact).any():
        return -math.inf
    return float(weighted_ratio(exact, duration))


def _estimated(
    columns: tuple[Floats, ...], end: RunEnd, lines: int, wanted: int, complete: bool
) -> LyapunovSpectrum:
    growth, duration, impacts, exact, flow = columns
    if np.isnan(growth).any():
        return _without(wanted, end, "an impact grazes: derivatives are infinite there")
    used, first = len(duration), 0
    if end is not RunEnd.OBSERVER:
        first = used // ALIGNING_DIVISOR
        used -= first
        if used < FEWEST_BLOCKS:
            return _without(wanted, end, end.sentence)
        if np.isfinite(growth[first:, 0]).all():
            first += _last_part(growth[first:, 0], duration[first:])
    last = slice(first, None)
    growth, duration, impacts = growth[last], duration[last], impacts[last]
    exact, flow = exact[last], flow[last]
    gone = np.any(np.isneginf(growth), axis=0)
    values, errors, per_impact = np.full((3, len(gone)), -math.inf)
    values[~gone] = weighted_ratio(growth[:, ~gone], duration)
    per_impact[~gone] = weighted_ratio(growth[:, ~gone], impacts)
    errors[gone] = 0.0
    if not gone.all():
        errors[~gone] = errors_of(growth[:, ~gone], duration)
    zeros = np.zeros(lines)
    values, errors, per_impact = (np.append(a, zeros) for a in (values, errors, per_impact))
    growth = np.hstack([growth, np.zeros((len(growth), lines))])
    order = np.argsort(-values, kind="stable")[:wanted]
    return LyapunovSpectrum(
        values[order], errors[order], per_impact[order],
        _contraction(exact, duration), _contraction(flow, duration),
        growth[:, order], duration, impacts, 1.0 - len(duration) / used, end, complete,
    )  # fmt: skip


# ---- tangents ------------------------------------------------------------------------------------


class _Events(NamedTuple):
    """Consecutive events of a motion, as the kernel records them."""

    high: Floats
    low: Floats
    y: Floats
    mode: Codes
    status: Codes
    contact: Codes
    side: Codes
    after: Floats
    phase: Floats  # of the first line, (k,)


def _since(events: _Events, first: int) -> _Events:
    """Events from one of them on."""
    arrays: tuple[Any, ...] = events
    return _Events(*(array[first:] for array in arrays))


def _joined(*parts: _Events) -> _Events:
    """Events of consecutive parts of a motion."""
    return _Events(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


class _Rows(NamedTuple):
    """Intervals from one impact to the next, K of them, with what comes before the last flight of each."""

    first: NDArray[np.intp]  # event at the start
    last: NDArray[np.intp]  # event at the end
    base: NDArray[np.intp]  # event after which the last flight begins
    offset: Floats  # time after it from which the derivative of that flight is taken
    leads: dict[int, list[Floats]]  # by row: derivatives of what comes before


class _Growth:
    """Growth of tangents (1) along a motion, from impact to impact.

    Tangents are (dx, scale dv) at equal times, ``scale`` being the median of the first flights.
    """

    def __init__(self, motion: Simulator, count: int) -> None:
        self.motion, self.count = motion, count
        self.kernel = motion.compiled.kernel
        self.mechanism: Mechanism = motion.compiled.mechanism
        self.prescribed = compile_prescribed(motion.system)
        self.forced = bool(self.mechanism.forces)
        self.size = 2 * self.mechanism.degrees
        self.carried = self.size - (not self.forced)
        self.trace, self.longest = _rates_of(self.mechanism)
        self.scale = np.ones(self.size)
        self.frame = np.empty((0, 0))
        self.reason = ""
        self.parts: list[tuple[Floats, ...]] = []

    def arrays(self) -> tuple[Floats, ...]:
        """Growth, duration, impacts, right side of (3), growth of the flow; a row per flight."""
        return tuple(np.concatenate(column) for column in zip(*self.parts, strict=True))

    def record(self, impacts: int) -> RunEnd:
        """Follow the tangents through so many impacts; why that ended."""
        events: _Events | None = None
        left, room = impacts, events_for(self.mechanism, impacts)
        announcement = Announcement("impacts", impacts)
        while left > 0 and room > 0:
            announcement.after(impacts - left)
            part = self.motion.events(min(left, CHUNK_EVENTS))
            end = RunEnd(part["why"])
            if end not in GOES_ON:
                self.reason = end.sentence
                return end
            new = self._events(part)
            left -= int(np.isin(new.status, COUNTED).sum())
            room -= len(new.status)
            events = _joined(events, new) if events else new
            rows = self._rows_of(events)
            if self.reason:
                return RunEnd.UNDECIDED
            if len(rows.first):
                if not self._grow(events, rows):
                    return RunEnd.OBSERVER
                events = _since(events, int(rows.last[-1]) - 1)
        if not self.parts:
            self.reason = NEVER_FREE
        return RunEnd.IMPACTS if left <= 0 else RunEnd.EVENTS

    def _events(self, part: Any) -> _Events:
        m, high, low = self.mechanism, part["high"], part["low"]
        phase = phase_after(m, first_phases(part["phase"]), self.motion.start.phase, high + low)
        return _Events(
            high, low, part["y"], part["mode"], part["status"], part["contact"], part["side"],
            part["after"], phase,
        )  # fmt: skip

    def _rows_of(self, events: _Events) -> _Rows:
        """Parts of the motion from one impact between free flights to the next."""
        free = events.mode == FREE_CODE
        impact = (events.status == Status.IMPACT) & free
        impact[1:] &= free[:-1]
        impact[:1] = False
        nodes = np.flatnonzero(impact)
        first, last = nodes[:-1], nodes[1:]
        between = np.cumsum((events.status != Status.GRAZING) & ~impact)
        base, offset, leads = first.copy(), np.zeros(len(first)), {}
        for k in np.flatnonzero(between[last] - between[first]):
            base[k], offset[k], leads[int(k)] = self._led(events, int(first[k]), int(last[k]))
        flights = _time(events, base, last) - offset
        for k in np.flatnonzero(flights > self.longest):
            pieces = math.ceil(flights[k] / self.longest)
            passed = flights[k] * (1.0 - 1.0 / pieces)
            offset[k] += passed
            leads[int(k)] = leads.get(int(k), []) + self._coasting(passed)
        return _Rows(first, last, base, offset, leads)

    def _led(self, events: _Events, a: int, b: int) -> tuple[int, float, list[Floats]]:
        """Lead from impact a, through chatter, sticking or several contacts at once, to the flight to b.

        The derivatives before and after begin and end in free flights, at most at the middle of each.
        """
        other = np.flatnonzero(events.status[a + 1 : b] != Status.GRAZING) + a + 1
        begun, over = int(other[0]), int(other[-1])
        arrival, departure = _time(events, a, begun), _time(events, over, b)
        before = arrival - 0.5 * min(arrival, self.longest)
        after = 0.5 * min(departure, self.longest)
        start = self._states(events, np.array([a]), np.array([before]))[0]
        n, size = self.mechanism.degrees, self.size
        try:
            found = map_derivative(
                self.motion.system,
                State(tuple(start[:n]), tuple(start[n:size]), float(start[size])),
                impacts=events_for(self.mechanism, b - a),
                t_max=_time(events, a, over) - before + after,
                directions=np.eye(size + len(self.mechanism.forces), size),
            )
        except InvalidParameterError:  # so near the stop that its rounding lies behind
            self.reason = NOT_REPEATED
            return over, after, []
        if found.end is not RunEnd.HORIZON:
            self.reason = NOT_REPEATED
        return over, after, [*self._coasting(before), found.matrix[:size]]

    def _grow(self, events: _Events, rows: _Rows) -> bool:
        """Carry the tangents through these rows; False once all of them have vanished."""
        ends = np.concatenate([rows.first[:1], rows.last])
        flows = np.array([self._flow(z) for z in self._states(events, ends, np.zeros(len(ends)))])
        stops = [Stop(int(events.contact[b]), int(events.side[b])) for b in rows.last]
        jumps, first = self._jumps(events, rows, stops, flows[1:])
        if not self.parts:
            self.scale = np.repeat([1.0, first], self.mechanism.degrees)
            self.frame = _generic(self.size, self.count, flows[0] * self.scale, self.forced)
        losses = self._losses(stops)
        lost = np.isneginf(losses).astype(int)  # a plastic impact leaves no rate of its gap
        for k in rows.leads:  # a contact that rests has neither gap nor rate
            modes = set(events.mode[rows.first[k] : rows.last[k]].tolist())
            closed = [
                len(closed_from_code(mode, len(self.mechanism.rigid_stops))) for mode in modes
            ]
            lost[k] = min(max(lost[k], 2 * max(closed)), self.carried)
        growth = self._carried(jumps, rows.leads, flows * self.scale, lost)
        spans = _time(events, rows.first, rows.last)
        exact = losses - self.trace * spans
        for k in rows.leads:
            exact[k] += _beyond(events, int(rows.first[k]), int(rows.last[k]))
        counted = np.cumsum(np.isin(events.status, COUNTED).astype(float))
        numbers = counted[rows.last] - counted[rows.first]
        sizes = np.zeros(len(flows)) if self.forced else np.log(_norms(flows * self.scale))
        columns = [growth, spans, numbers, exact, np.diff(sizes)]
        self.parts.append(tuple(column[: len(growth)] for column in columns))
        return not np.isneginf(growth[-1]).all()

    def _jumps(
        self, events: _Events, rows: _Rows, stops: list[Stop], flows: Floats
    ) -> tuple[Floats, float]:
        """Derivatives of the last flight of every row with its impact, and the median flight."""
        size = self.size
        states = self._states(events, rows.base, rows.offset)
        flights = _time(events, rows.base, rows.last) - rows.offset
        part = self.prescribed.linearise(states, flights, stops)
        # An impact that comes later by dt takes place after dt at the old, not the new rate (T33).
        with np.errstate(divide="ignore", invalid="ignore"):
            later = -part.gap_by[:, :size] / part.gap_by[:, size + 1, None]
            turned = part.after_by[:, :size, size + 1] - flows
            jumps = part.after_by[:, :size, :size] + turned[:, :, None] * later[:, None, :]
        return jumps, float(np.median(flights))

    def _carried(
        self, jumps: Floats, leads: dict[int, list[Floats]], flows: Floats, lost: Codes
    ) -> Floats:
        """Logarithms of the growth of the tangents in each row; the frame moves on.

        Shape (K, count), or fewer rows where all tangents have vanished.
        """
        growth = np.zeros((len(jumps), self.count))
        normal = flows[1:] / _norms(flows[1:])[:, None]
        change = self.scale[:, None] / self.scale
        jumps, frame = jumps * change, self.frame
        for k, jump in enumerate(jumps):
            for lead in leads.get(k, ()):
                frame = _orthonormal((lead * change) @ frame, growth[k])
            moved = jump @ frame
            if not self.forced:
                moved -= np.outer(normal[k], normal[k] @ moved)
            frame = _orthonormal(moved, growth[k])
            growth[k, self.carried - lost[k] :] = -math.inf
            if np.isneginf(growth[k]).all():
                growth = growth[: k + 1]
                break
        self.frame = frame
        return growth

    def _losses(self, stops: list[Stop]) -> Floats:
        """Logarithms of R^2 of impacts at these stops."""
        contacts = self.mechanism.rigid_stops
        with np.errstate(divide="ignore"):
            losses: Floats = 2.0 * np.log([stop.restitution(contacts) for stop in stops])
        return losses

    def _states(self, events: _Events, which: NDArray[np.intp], offsets: Floats) -> Floats:
        """(x, v, theta) some time after these events, in the free flight that follows, (K, 2n+1)."""
        states = self.kernel.evaluate(
            [FREE_CODE] * len(which), np.ascontiguousarray(events.y[which]), offsets
        )
        exact = offsets == 0.0  # positions after an impact lie on its stop, to the last bit
        states[exact] = events.after[which[exact]]
        return np.column_stack([states, events.phase[which] + self.mechanism.omega * offsets])

    def _flow(self, state: Floats) -> Floats:
        """(v, a) of free flight at (x, v, theta)."""
        *both, phase = state.tolist()
        x, v = both[: self.size // 2], both[self.size // 2 :]
        a = self.kernel.acceleration(x, v, phases_of(self.mechanism, phase))
        return np.concatenate([v, a])

    def _coasting(self, time: float) -> list[Floats]:
        """Derivatives of the pieces of a free flight of this length."""
        pieces = math.ceil(time / self.longest) or 1
        piece = np.asarray(self.kernel.flow_matrix(time / pieces))[:, : self.size]
        return [piece] * pieces


def _rates_of(m: Mechanism) -> tuple[float, float]:
    """Trace of M^-1 C, and the longest flight after which tangents still differ in direction."""
    inverse, n = np.linalg.inv(np.array(m.mass)), m.degrees
    decay, stiff = inverse @ np.array(m.damping), inverse @ np.array(m.stiffness)
    rates = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-stiff, -decay]])).real
    spread = float(rates.max() - rates.min())
    return float(np.trace(decay)), LOST_FOLDS / spread if spread > 0.0 else math.inf


def _generic(size: int, count: int, flow: Floats, forced: bool) -> Floats:
    """Generic directions, orthonormal, the same for any count; without forcing normal to the flow."""
    frame = np.random.default_rng(1).standard_normal((size, size))[:, :count]
    if not forced:
        frame -= np.outer(flow, flow @ frame) / (flow @ flow)
    return np.linalg.qr(frame)[0]


def _orthonormal(moved: Floats, growth: Floats) -> Floats:
    """Orthonormal columns of moved tangents; logarithms of their lengths are added to growth."""
    from scipy.linalg.lapack import dgeqrf, dorgqr  # as numpy's qr, without its 0.1 ms around them

    if not np.isfinite(moved).all():
        growth[:] = math.nan
        return np.zeros_like(moved)
    factors, reflections, *_ = dgeqrf(moved)
    left = np.abs(factors.diagonal())
    whole = np.sqrt((moved * moved).sum(axis=0))
    gone = left <= VANISHED_LENGTH * np.maximum(whole, 1.0)
    growth += np.log(np.where(gone, 1.0, left))
    growth[gone] = -math.inf
    # In place of what is gone, any direction that completes the frame.
    frame: Floats = dorgqr(factors, reflections)[0]
    return frame


def _beyond(events: _Events, a: int, b: int) -> float:
    """Add up what the events between two impacts add to the right side of (3)."""
    between = slice(a + 1, b)
    kinds = events.status[between]
    if np.any(events.mode[between] != FREE_CODE) or np.any(kinds == Status.CHATTER):
        return -math.inf
    return math.nan if np.any(kinds == Status.SIMULTANEOUS) else 0.0


def _time(events: _Events, a: Any, b: Any) -> Any:
    """Time from event a to event b."""
    return (events.high[b] - events.high[a]) + (events.low[b] - events.low[a])


def _norms(rows: Floats) -> Floats:
    norms: Floats = np.sqrt((rows * rows).sum(axis=1))
    return norms
