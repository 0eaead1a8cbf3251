"""Response of a machine to a record: exact flights through every straight piece of it.

Method      The record is a coordinate of the machine (driven.py). At each corner of it the motion is
            handed over: positions and velocities as they are, the slope of the record anew. A contact
            at rest and friction that sticks are found again there, since both follow from
            positions, velocities and forces; the search for impacts proves each one as always.
Assumes     states of elements that positions and velocities determine: all but those of friction
            between which its law does not decide (theory.md, section 18)
Accuracy    rounding; a hand-over adds some units in the last place of the largest coordinate
Fails       as simulate does; the response then ends there, and says why
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import check_flag, check_kind, nonnegative, numbers, refusal
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import interruptible
from vibroimpact._core.types import Flags, Floats
from vibroimpact._kernel import MAX_DEGREES
from vibroimpact.machines.units import units_of
from vibroimpact.measures.energy import Energies, energies_of
from vibroimpact.measures.flights import Dual, Flights, rows_of
from vibroimpact.measures.instants import check_span, largest_modulus
from vibroimpact.measures.measure import Measure, Peak, Rms, Row, measure_of
from vibroimpact.measures.motions import flights_of_run
from vibroimpact.model.mechanism import Mechanism, accelerations, element_labels
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.results.result import Result
from vibroimpact.simulation.simulate import Run, RunEnd, Status, latest
from vibroimpact.transients.driven import Lines, driven, simulate_driven, unforced
from vibroimpact.transients.force_record import ForceRecord

RECORD_ROOM = 1  # a coordinate of its own


@dataclass(frozen=True, eq=False)
class RecordResponse(Result):
    """Motion of a machine that a record drives.

    Attributes
    ----------
    system, record
        The machine and the record.
    end
        :class:`RunEnd`, why the simulation ended: HORIZON at the end of the record.
    run
        The motion as a :class:`Run` of the machine with one coordinate more, the last, which is
        the record on a scale of its own, with an event HORIZON at every corner of the record.
    """

    system: System
    record: ForceRecord
    run: Run = field(repr=False)
    _m: Mechanism = field(repr=False)
    _factor: float = field(repr=False)
    _row: Floats = field(repr=False)

    def __repr__(self) -> str:
        n = self._m.degrees
        units = units_of(self.system)
        peaks = ", ".join(
            f"x{i + 1} {units.text(self.peak(f'x{i + 1}'), quantity='length')}" for i in range(n)
        )
        span = units.text(self.duration, quantity="time")
        return (
            f"RecordResponse: {int(self.run.impacts.sum())} impacts over {span}, peaks "
            f"{peaks}; {'the record ended' if self.complete else self.end.sentence}"
        )

    @property
    def end(self) -> RunEnd:
        """Reason why the simulation ended."""
        return self.run.end

    @property
    def complete(self) -> bool:
        """Whether the whole record was simulated."""
        return self.end is RunEnd.HORIZON

    @property
    def duration(self) -> float:
        """Time that was simulated."""
        return float(self.run.time[-1]) if len(self.run) else 0.0

    # ---- events ----------------------------------------------------------------------------------

    @cached_property
    def events(self) -> Flags:
        """Mask of the events of ``run`` that are the machine's own: none at corners of the record."""
        run = self.run
        corner = run.status == Status.HORIZON
        first = np.append(True, corner)[:-1] & (np.diff(run.time, prepend=0.0) == 0.0)
        held = run.all_states[np.maximum(np.arange(len(run)) - 1, 0)]  # before the corner
        contact = np.maximum(run.contact, 0)
        again = first & (run.status == Status.STICK) & (held[np.arange(len(run)), contact] != 0)
        return np.asarray(~corner & ~again)

    @property
    def impact_times(self) -> Floats:
        """Time of each impact, on the clock of the record."""
        return self._clock(self.run.time[self.run.impacts])

    def _clock(self, time: Floats) -> Floats:
        clock: Floats = self.record.time[0] + time
        return clock

    # ---- the motion ------------------------------------------------------------------------------

    def at(self, t: ArrayLike) -> tuple[Floats, Floats]:
        """Positions and velocities at any times of the record, exact to rounding.

        Parameters
        ----------
        t
            Times on the clock of the record, from its first sample to the end of the simulation.

        Returns
        -------
        position, velocity
            Shape ``t.shape + (n,)``.

        Raises
        ------
        InvalidParameterError
            A time outside.
        """
        given = numbers("t", t, "times")
        times = given - self.record.time[0]
        first, last = self.record.time[0], float(self._clock(np.array(self.duration)))
        room = 4.0 * np.spacing(max(abs(first), abs(last)))
        if np.any((given < first - room) | (given > last + room)):
            raise InvalidParameterError(
                f"t = {given.min()} to {given.max()}: must be in [{first}, {last}], which was simulated."
            )
        position, velocity = self.run.at(np.clip(times, 0.0, self.duration))
        n = self._m.degrees
        return position[..., :n], velocity[..., :n]

    def row_at(self, row: Row, t: ArrayLike) -> Floats:
        """A row of positions or velocities at any times, as :meth:`at`.

        Parameters
        ----------
        row
            "x1", "v1", a sum such as "x2 - x1", or coefficients of coordinates.
        t
            Times on the clock of the record.
        """
        measure = Peak(row)
        if measure.derivatives > 1:
            raise refusal("row", row, 'a row of coordinates or velocities, such as "x1" or "v1"')
        found: Floats = self.at(t)[measure.derivatives] @ measure.coefficients(self._m)
        return found

    @cached_property
    def _flights(self) -> Flights:
        return flights_of_run(self.run, self.duration)

    # ---- response quantities ---------------------------------------------------------------------

    def measure(self, measure: Measure | str) -> float:
        """Return any measure of the motion, from the first sample to the end.

        Parameters
        ----------
        measure
            As :func:`~vibroimpact.measure_of` takes it: "peak x1", "rms v1", "peak x2 - x1",
            "impulse", "contact force 0", ...; powers are means over the duration. Rows as numbers
            have one entry for each coordinate of the machine.
        """
        found = measure_of(self._m, measure)
        row = getattr(found, "row", "")
        if not isinstance(row, str):  # the record has no part in it
            found = replace(found, row=(*row, 0.0))  # type: ignore[call-arg]
        found = measure_of(self.run.system, found)
        return float(found._of(self._flights).value[0])

    def peak(self, row: Row = "x1") -> float:
        """Largest modulus of a row, such as "x1", "v1", "a1" or "x2 - x1", between impacts, too."""
        measure = Peak(row)
        chosen = np.append(measure.coefficients(self._m), 0.0)
        rows, order = self._flights.rows, measure.derivatives
        signal = self._flights.signal(lambda code: rows.moved(code, chosen, order))
        return largest_modulus(signal)

    def rms(self, row: Row = "x1") -> float:
        """Root mean square of a row over the duration."""
        return self.measure(Rms(row))

    def peak_acceleration(self, row: str = "a1") -> float:
        """Largest modulus of an acceleration between impacts, of a record of the base the absolute one.

        Parameters
        ----------
        row
            A row of accelerations, such as "a1" or "a2 - a1".
        """
        measure = Peak(row)
        if measure.derivatives != 2:
            raise refusal("row", row, 'a row of accelerations, such as "a1"')
        chosen = measure.coefficients(self._m)
        carried = 0.0
        if self.record.kind == "base":  # the base adds its own
            carried = -float(chosen @ accelerations(self._m, self._row))
        size = self._m.degrees
        record, whole = np.eye(size + 1)[size], np.append(chosen, 0.0)

        def absolute(code: int) -> Dual:
            moved = self._flights.rows.moved(code, whole, 2)
            base = self._flights.rows.moved(code, record * (carried / self._factor), 0)
            return moved + base

        return largest_modulus(self._flights.signal(absolute))

    @cached_property
    def energies(self) -> Energies:
        """Work of the record, energy taken by dashpots, contacts and elements, energy stored."""
        n = self._m.degrees
        force = np.zeros(n + RECORD_ROOM)
        force[n] = 1.0 / self._factor
        along = np.append(self._row, 0.0)
        return energies_of(self.run, self._flights, self._m, [(force, along)])

    @property
    def largest_impulse(self) -> float:
        """Largest impulse of an impact at a rigid stop; 0 without any."""
        return self.measure("impulse") if self._m.rigid_stops else 0.0

    # ---- as a dataset, as a picture --------------------------------------------------------------

    def to_dataset(self, t: ArrayLike | None = None) -> xr.Dataset:
        """Histories, impacts and response quantities as an xarray dataset.

        Parameters
        ----------
        t
            Times of the histories; those of the record where left out.
        """
        last = float(self._clock(np.array(self.duration)))
        if t is None:
            known = self.record.time[self.record.time <= latest(last)]
            times = np.minimum(known, last)
        else:
            times = np.atleast_1d(numbers("t", t, "times"))
            if times.ndim != 1:
                raise refusal("t", t, "times, shape (k,)")
        position, velocity = self.at(times)
        n, hit = self._m.degrees, self.run.impacts
        names = [f"x{i + 1}" for i in range(n)]
        energies, both = self.energies, ("time", "coordinate")
        data = xr.Dataset(
            {
                "record": ("time", self.record.at(times)),
                "position": (both, position),
                "velocity": (both, velocity),
                "impact_time": ("impact", self.impact_times),
                "impact_contact": ("impact", self.run.contact[hit]),
                "impact_side": ("impact", self.run.side[hit]),
                "impact_speed": ("impact", -self.run.rate_before[hit]),
                "peak": ("coordinate", [self.peak(name) for name in names]),
                "rms": ("coordinate", [self.rms(name) for name in names]),
                "energy_input": energies.input,
                "energy_dashpots": energies.dashpots,
                "energy_taken": ("part", list(energies.parts)),
                "energy_change": energies.end - energies.start,
                "largest_impulse": self.largest_impulse,
            },
            coords={"time": times, "coordinate": names, "part": element_labels(self._m)},
            attrs={
                "system": repr(self.system), "record": repr(self.record), "end": self.end.name,
                "end_reason": self.end.sentence,
            },
        )  # fmt: skip
        quantities = {
            "record": "acceleration" if self.record.kind == "base" else "force", "position": "length",
            "velocity": "velocity", "impact_speed": "velocity", "peak": "length", "rms": "length",
            "largest_impulse": "impulse",
        }  # fmt: skip
        quantities |= dict.fromkeys(("time", "impact_time"), "time")
        quantities |= {str(n): "energy" for n in data.variables if str(n).startswith("energy")}
        return units_of(self.system).of_variables(data, quantities)


@interruptible
def simulate_record(
    system: System,
    record: ForceRecord,
    start: State | None = None,
    *,
    after: float = 0.0,
    own_forces: bool = False,
) -> RecordResponse:
    """Simulate the response of a machine to a record of a force, or of the motion of its base.

    Parameters
    ----------
    system
        A :class:`Mechanism`, or anything with a ``mechanism``.
    record
        The record.
    start
        State at the first sample; by default at rest with all
        coordinates zero.
    after
        Time to go on after the last sample, without force.
    own_forces
        Whether the harmonic forces and phase switches of the machine act, too. Stops and belts
        move in any case.

    Returns
    -------
    RecordResponse
        Motion, impacts, peaks, root mean squares, energies. Its ``end`` says whether the whole record
        was simulated.

    Raises
    ------
    InvalidParameterError
        A start behind a stop, a row that does not fit; a machine of 20 coordinates, the most that
        there can be: the record takes one.

    Notes
    -----
    The record is not sampled again: within each straight piece the flight is exact, and every
    contact is proved to be the first. Samples on a common line cost nothing; each other piece some
    50 microseconds, 20 000 about a second.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=1.0, zeta=0.02, restitution=0.6,
    ...                          half_clearance=0.5, omega=1.0)
    >>> pulse = vi.ForceRecord([0.0, 1.0, 2.0], [0.0, 1.0, 0.0])
    >>> response = vi.simulate_record(damper, pulse, after=60.0)
    >>> response.complete, bool(response.energies.parts[0] > response.energies.dashpots)
    (True, True)
    """
    check_kind("record", record, ForceRecord, "a ForceRecord")
    check_flag("own_forces", own_forces)
    whole = mechanism_of(system)
    if whole.degrees + RECORD_ROOM > MAX_DEGREES:
        raise InvalidParameterError(
            f"system: has {whole.degrees} coordinates; must be at most {MAX_DEGREES - RECORD_ROOM}, as "
            "the record takes one. Remove a coordinate."
        )
    m = whole if own_forces else unforced(whole)
    row = record.influence(m)
    pieces = record.pieces(nonnegative("after", after))
    begin = pieces.begin - record.time[0]
    span = float(begin[-1] + pieces.length[-1])
    wider, factor = driven(m, row, 1.0 / span)
    check_span("after", after, rows_of(wider), span)
    if start is None:
        start = State((0.0,) * m.degrees, (0.0,) * m.degrees)
    check_kind("start", start, State, "a State, or None for rest")
    if len(start.position) != m.degrees:
        raise InvalidParameterError(
            f"start: position has shape ({len(start.position)},); expected ({m.degrees},)."
        )
    lines = Lines(begin, factor * pieces.value, factor * pieces.slope, pieces.length)
    wide = State((*start.position, 0.0), (*start.velocity, 0.0), start.phase)
    return RecordResponse(system, record, simulate_driven(wider, wide, lines), m, factor, row)
