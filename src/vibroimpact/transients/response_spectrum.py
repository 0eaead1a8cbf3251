"""Response spectra: the largest response to a record over the natural frequency of an oscillator.

Method      x'' + 2 zeta w x' + w^2 x = f(t), f linear in each piece of length h, s = zeta w,
            d^2 = w^2 - s^2. In a piece every response is
                u = exp(-s t) (p cos(d t) + q sin(d t)) + l + k t,                              (1)
            so u'' is a decaying sinusoid alone, whose zeros are known in closed form. Between two of
            them u' is monotone and has one zero at most, which a bracket holds: every extremum of
            u is found. After the record u vibrates freely: its first period has the largest.
            With stops each oscillator is simulated (record_response.py).
Assumes     0 <= zeta < 1
Accuracy    some 1e-13 of the largest response per thousand pieces where an oscillator turns a radian
            or more in the record; 1e-10 at 0.1 radians, 1e-8 at 0.01 (40 digits); slower: refused
Reference   Nigam and Jennings, Bull. Seismol. Soc. Am. 59 (1969) 909: the recursion; Biggs,
            Introduction to Structural Dynamics (1964), ch. 2: spectra of pulses
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import (
    check_choice,
    check_kind,
    check_progress,
    fraction,
    nonnegative,
    numbers,
    refusal,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, Reporter, interruptible
from vibroimpact._core.quantities import with_unit
from vibroimpact._core.types import (
    Amount,
    Amounts,
    AnyAmount,
    AnyAmounts,
    Counts,
    Flags,
    Floats,
)
from vibroimpact.machines.units import units_of
from vibroimpact.model.elements.rigid_stop import RigidStop
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.results.result import Result, along
from vibroimpact.transients.force_record import ForceRecord, Pieces
from vibroimpact.transients.record_response import RecordResponse, simulate_record

Unit = Literal["rad/s", "Hz"]
TURN = {"rad/s": 1.0, "Hz": 2.0 * math.pi}
RESPONSES_PER_BLOCK = 2**18  # so many responses are examined together
BRACKET_HALVINGS = 60  # a bracket is halved so often, to the last bit
CYCLE = 2.0 * math.pi
HIGHEST_FREQUENCY = 1e50  # its square and cube stay finite
LEAST_RADIANS = 0.01  # with fewer in the record, terms over omega^3 cancel to less than 8 digits
KEPT_LENGTHS = 256  # so many lengths of pieces are kept


@dataclass(frozen=True, eq=False)
class ResponseSpectrum(Result):
    """Largest responses to a record over the natural frequency; arrays of shape (k,).

    Attributes
    ----------
    record
        The record.
    frequency, unit
        Natural frequencies, in rad/s or Hz.
    zeta
        Damping ratio.
    displacement
        Largest modulus of the coordinate; relative to the base for a record of its acceleration.
    acceleration
        Largest modulus of the acceleration between impacts; absolute for a record of the base.
    impacts, impulse
        Number of impacts, and the largest impulse of one; zeros without stops.
    complete
        Whether each oscillator could be simulated to the end; its values are NaN otherwise.
    clearance
        Distance of the stops, infinite without.
    """

    record: ForceRecord
    frequency: Amounts = field(metadata=along("frequency"))
    unit: Unit
    zeta: Amount
    displacement: AnyAmounts = field(metadata=along("frequency", quantity="length"))
    acceleration: AnyAmounts = field(metadata=along("frequency", quantity="acceleration"))
    impacts: Counts = field(metadata=along("frequency"))
    impulse: AnyAmounts = field(metadata=along("frequency", quantity="impulse"))
    complete: Flags = field(metadata=along("frequency"))
    clearance: AnyAmount

    @property
    def omega(self) -> Floats:
        """Natural frequencies in radians per unit of time."""
        omega: Floats = self.frequency * TURN[self.unit]
        return omega

    @property
    def pseudo_velocity(self) -> Floats:
        """Natural frequency times displacement."""
        found: Floats = self.omega * self.displacement
        return found

    @property
    def pseudo_acceleration(self) -> Floats:
        """Square of the natural frequency times displacement."""
        found: Floats = self.omega**2 * self.displacement
        return found

    def __repr__(self) -> str:
        k = int(np.argmax(np.nan_to_num(self.pseudo_acceleration, nan=-1.0)))
        ends = with_unit(self.frequency.min(), self.frequency.max(), unit=self.unit)
        largest = units_of(self.record).text(self.pseudo_acceleration[k], quantity="acceleration")
        return (
            f"ResponseSpectrum: {self.frequency.size} oscillators from {ends}, "
            f"zeta = {self.zeta:g}; largest pseudo-acceleration "
            f"{largest} at {self.frequency[k]:.6g} {self.unit}"
        )

    def to_dataset(self) -> xr.Dataset:
        """Convert all spectra to an xarray dataset."""
        of_displacement = ("pseudo_velocity", "pseudo_acceleration")
        more = {name: ("frequency", getattr(self, name)) for name in of_displacement}
        data = super().to_dataset().assign(more)
        data.variables["frequency"].attrs["units"] = self.unit
        known = {"pseudo_velocity": "velocity", "pseudo_acceleration": "acceleration"}
        return units_of(self.record).of_variables(data, known)


@interruptible
def response_spectrum(
    record: ForceRecord,
    over: ArrayLike,
    zeta: float = 0.05,
    *,
    unit: Unit = "rad/s",
    clearance: float = math.inf,
    lower_clearance: float | None = None,
    restitution: float = 0.8,
    progress: ProgressOption = True,
) -> ResponseSpectrum:
    """Compute the largest response to a record over the natural frequency of an oscillator.

    The oscillator starts at rest, has the mass 1, and vibrates on for one period after the record:
    its largest values are in it; impacts later than that are not counted.

    Parameters
    ----------
    record
        A force, or the acceleration of the base: the coordinate is relative to the base then. Its
        row is of no account.
    over
        Natural frequencies, > 0, shape (k,), that turn 0.01 radians or more while the record lasts.
    zeta
        Damping ratio, in [0, 1).
    unit
        "rad/s" or "Hz", of the frequencies; a record in seconds.
    clearance, lower_clearance
        Distance from rest up to a stop and down to another one, >= 0; without stops infinite. The
        lower one is the same where left out.
    restitution
        Restitution of the stops, in [0, 1].
    progress
        True shows it on standard error after 2 s; a function gets a :class:`~vibroimpact.ProgressReport` after
        every oscillator that is simulated, with stops.

    Returns
    -------
    ResponseSpectrum
        Displacement, pseudo-velocity, pseudo-acceleration, acceleration; impacts and impulses.

    Raises
    ------
    InvalidParameterError
        Frequencies that are not > 0, zeta outside [0, 1), a negative clearance.

    Notes
    -----
    Without stops in closed form, 200 oscillators over 20 000 samples in some seconds; with stops
    each is simulated, some 60 microseconds per sample.

    Examples
    --------
    The largest response to a rectangular pulse is twice the static one where the pulse is long:

    >>> import vibroimpact as vi
    >>> pulse = vi.ForceRecord([0.0, 1e-9, 1.0, 1.0 + 1e-9], [0.0, 1.0, 1.0, 0.0])
    >>> found = vi.response_spectrum(pulse, [1.0, 4.0], zeta=0.0)
    >>> found.pseudo_acceleration.round(6).tolist()
    [0.958851, 2.0]
    """
    check_kind("record", record, ForceRecord, "a ForceRecord")
    check_choice("unit", unit, list(TURN))
    check_progress(progress)
    given = np.atleast_1d(numbers("over", over))
    if given.ndim != 1 or not given.size or np.any((given <= 0.0) | (given > HIGHEST_FREQUENCY)):
        raise refusal("over", over, f"numbers > 0, at most {HIGHEST_FREQUENCY:g}, shape (k,)")
    ratio = nonnegative("zeta", zeta)
    if ratio >= 1.0:
        raise refusal("zeta", zeta, "in [0, 1)", "An overdamped oscillator has no frequency.")
    upper, lower = _clearances(clearance, lower_clearance)
    omega = given * TURN[unit]
    lowest = LEAST_RADIANS / (record.time[-1] - record.time[0]) / TURN[unit]
    if np.any(given < lowest):
        raise refusal(
            "over", over, f"at least {lowest:.3g}, {LEAST_RADIANS} radians in the record",
            "Slower oscillators stand still while the base moves.",
        )  # fmt: skip
    nothing = np.zeros(given.size)
    if math.isinf(upper) and math.isinf(lower):
        moved, shaken = _linear(record, omega, ratio)
        hits, impulse, done = nothing.astype(np.int64), nothing, np.ones(given.size, dtype=bool)
    else:
        stop = RigidStop((1.0,), -lower, upper, fraction("restitution", restitution))
        with Reporter(progress, "spectrum") as report:
            found = [
                _largest_of(_simulated(record, float(w), ratio, stop))
                for w in report.track(omega, given.size, "oscillators")
            ]
        moved, shaken, impulse, hits, done = (np.array(part) for part in zip(*found, strict=True))
    return ResponseSpectrum(
        record, given, unit, ratio, moved, shaken, hits, impulse, done, min(upper, lower)
    )


def _clearances(upper: object, lower: object) -> tuple[float, float]:
    found = []
    for name, value in (
        ("clearance", upper),
        ("lower_clearance", upper if lower is None else lower),
    ):
        infinite = isinstance(value, float) and value == math.inf
        found.append(math.inf if infinite else nonnegative(name, value))
    if not sum(found) > 0.0:
        raise InvalidParameterError(
            "clearance = 0, lower_clearance = 0: their sum must be > 0. The mass moves between the stops."
        )
    return found[0], found[1]


# ---- with stops ----------------------------------------------------------------------------------


def _simulated(record: ForceRecord, omega: float, zeta: float, stop: RigidStop) -> RecordResponse:
    oscillator = Mechanism(
        mass=[[1.0]], damping=[[2.0 * zeta * omega]], stiffness=[[omega * omega]], elements=(stop,)
    )
    plain = replace(record, row=None)
    return simulate_record(oscillator, plain, after=CYCLE / omega)


def _largest_of(response: RecordResponse) -> tuple[float, float, float, int, bool]:
    hits = int(response.run.impacts.sum())
    if not response.complete:
        return math.nan, math.nan, math.nan, hits, False
    shaken = response.peak_acceleration("a1")
    return response.peak("x1"), shaken, response.largest_impulse, hits, True


# ---- without stops, in closed form ---------------------------------------------------------------


class _Wave(NamedTuple):
    """The motion (1) in pieces: shape (k, pieces) each, or what broadcasts to it."""

    s: Floats
    d: Floats
    p: Floats
    q: Floats
    level: Floats
    slope: Floats

    def at(self, t: Floats) -> Floats:
        """Values."""
        swing = self.p * np.cos(self.d * t) + self.q * np.sin(self.d * t)
        found: Floats = np.exp(-self.s * t) * swing + self.level + self.slope * t
        return found

    def rate(self) -> _Wave:
        """The derivative by time."""
        p = self.d * self.q - self.s * self.p
        q = -self.d * self.p - self.s * self.q
        return _Wave(self.s, self.d, p, q, self.slope, np.zeros_like(self.slope))

    def plus(self, other: _Wave, mine: Floats, its: Floats) -> _Wave:
        """Sum of ``mine`` times this wave and ``its`` times the other."""
        pairs = zip(self[2:], other[2:], strict=True)
        return _Wave(self.s, self.d, *(mine * a + its * b for a, b in pairs))

    def flat(self, shape: tuple[int, ...]) -> _Wave:
        """Return a wave with all pieces in one row."""
        return _Wave(*(np.broadcast_to(part, shape).ravel() for part in self))

    def some(self, which: Any) -> _Wave:
        """Some pieces of a row."""
        return _Wave(*(part[which] for part in self))


def _linear(record: ForceRecord, omega: Floats, zeta: float) -> tuple[Floats, Floats]:
    """Largest displacement and acceleration of each oscillator."""
    w = omega[:, None]
    sign = -1.0 if record.kind == "base" else 1.0
    moved, shaken = np.zeros(omega.size), np.zeros(omega.size)
    for value, slope, length, x, v in _stretches(record.pieces(), w, zeta, sign):
        wave = _wave(w, zeta, sign * value, sign * slope, x, v)
        rate = wave.rate()
        base = record.kind == "base"  # x'' - f = -(2 zeta w x' + w^2 x)
        total = rate.plus(wave, 2.0 * zeta * w, w * w) if base else rate.rate()
        np.maximum(moved, _largest(wave, length), out=moved)
        np.maximum(shaken, _largest(total, length), out=shaken)
    return moved, shaken


def _wave(w: Floats, zeta: float, f: Floats, slope: Floats, x: Floats, v: Floats) -> _Wave:
    """The displacement from the force, its slope, and the state where a piece begins."""
    s = zeta * w
    d = w * math.sqrt((1.0 - zeta) * (1.0 + zeta))
    k = slope / w**2
    level = f / w**2 - 2.0 * zeta * k / w
    p = x - level
    return _Wave(s, d, p, (v - k + s * p) / d, level, np.broadcast_to(k, p.shape))


Stretch = tuple[Floats, Floats, Floats, Floats, Floats]


def _stretches(pieces: Pieces, w: Floats, zeta: float, sign: float) -> Iterator[Stretch]:
    """Force, slope and length of blocks of pieces, and the state where each begins.

    The last block is the free vibration after the record, over one period.
    """
    count = max(1, RESPONSES_PER_BLOCK // len(w))
    x, v = np.zeros_like(w), np.zeros_like(w)
    flow = _Flow(w, zeta)
    for first in range(0, len(pieces.begin), count):
        value, slope, length = (part[first : first + count] for part in pieces[1:])
        states = np.empty((2, len(w), len(value)))
        for i, (f, k, h) in enumerate(
            zip(value.tolist(), slope.tolist(), length.tolist(), strict=True)
        ):
            states[0, :, i], states[1, :, i] = x[:, 0], v[:, 0]
            x, v = flow(x, v, sign * f, sign * k, h)
        yield value, slope, np.broadcast_to(length, states[0].shape), states[0], states[1]
    nothing = np.zeros(1)
    yield nothing, nothing, CYCLE / w, x, v


class _Flow:
    """The state at the end of a piece from that at its beginning; kept by length."""

    def __init__(self, w: Floats, zeta: float) -> None:
        self.w, self.zeta = w, zeta
        self._known: dict[float, tuple[Floats, ...]] = {}

    def __call__(self, x: Floats, v: Floats, f: float, k: float, h: float) -> tuple[Floats, Floats]:
        """State after a time h under the force f + k t."""
        if h not in self._known:
            if len(self._known) == KEPT_LENGTHS:  # lengths of an uneven record do not come again
                self._known.clear()
            self._known[h] = self._matrix(h)
        a, b, c, e, by_f, by_k, rate_f, rate_k = self._known[h]
        return a * x + b * v + by_f * f + by_k * k, c * x + e * v + rate_f * f + rate_k * k

    def _matrix(self, h: float) -> tuple[Floats, ...]:
        one, nothing = np.ones_like(self.w), np.zeros_like(self.w)
        columns = []
        for f, k, x, v in ((0, 0, 1, 0), (0, 0, 0, 1), (1, 0, 0, 0), (0, 1, 0, 0)):
            wave = _wave(self.w, self.zeta, f * one, k * one, x * one, v * one)
            columns.append((wave.at(nothing + h), wave.rate().at(nothing + h)))
        (a, c), (b, e), (by_f, rate_f), (by_k, rate_k) = columns
        return a, b, c, e, by_f, by_k, rate_f, rate_k


def _largest(wave: _Wave, length: Floats) -> Floats:
    """Largest modulus over all pieces, of each oscillator."""
    largest = np.maximum(np.abs(wave.at(np.zeros_like(length))), np.abs(wave.at(length))).max(
        axis=1
    )
    rows = np.repeat(np.arange(len(length)), length.shape[1])
    wave, ends = wave.flat(length.shape), length.ravel()
    rate, begin = wave.rate(), np.zeros(ends.size)
    bend, value = rate.rate(), rate.at(begin)
    turn = np.mod(np.arctan2(-bend.p, bend.q), math.pi) / bend.d  # zeros of u''
    while rows.size:
        until = np.minimum(turn, ends)
        then = rate.at(until)
        hit = np.flatnonzero(value * then < 0.0)
        at = _zero(rate.some(hit), begin[hit], until[hit], value[hit])
        np.maximum.at(largest, rows[hit], np.abs(wave.some(hit).at(at)))
        more = np.flatnonzero(until < ends)
        rows, ends, begin, value = rows[more], ends[more], until[more], then[more]
        wave, rate, turn = wave.some(more), rate.some(more), turn[more] + math.pi / wave.d[more]
    return np.asarray(largest)


def _zero(rate: _Wave, low: Floats, high: Floats, at_low: Floats) -> Floats:
    """The zero between two ends of different sign, by bisection."""
    for _ in range(BRACKET_HALVINGS):
        middle = low + (high - low) / 2.0
        same = (rate.at(middle) > 0.0) == (at_low > 0.0)
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low
