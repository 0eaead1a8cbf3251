"""Measures: one number about a steady motion.

A measure is taken of a sweep, whatever the motion is, by observers that run with it; of a periodic
orbit exactly, with its derivative along the branch of the orbit (flights.py, where the method is).
"""

from __future__ import annotations

import itertools
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np

from vibroimpact._core.checks import check_choice, check_kind, positive, real, refusal, vector
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.linear import Vector
from vibroimpact._core.types import Floats, Integers
from vibroimpact.compile.piecewise import Piecewise
from vibroimpact.machines.json_text import system_of
from vibroimpact.measures.flights import Dual, Flights, Rows, Signal
from vibroimpact.measures.motions import Motion, flights_of, flights_of_run
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.simulation.simulate import Run
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.dashpots import Dashpots
from vibroimpact.sweeps.observers.dissipation import Dissipation
from vibroimpact.sweeps.observers.extremes import Extremes
from vibroimpact.sweeps.observers.forces import Forces
from vibroimpact.sweeps.observers.harmonic import Harmonic as HarmonicObserver
from vibroimpact.sweeps.observers.impacts import Impacts
from vibroimpact.sweeps.observers.impulse import Impulse as ImpulseObserver
from vibroimpact.sweeps.observers.observer import ELEMENT, PART, Observer
from vibroimpact.sweeps.observers.power import Power
from vibroimpact.sweeps.observers.rms import Rms as RmsObserver
from vibroimpact.sweeps.observers.speeds import Speeds

Row = str | Sequence[float]
Speed = Literal["largest", "mean", "rms", "smallest"]

LETTERS = "xva"  # coordinate, velocity, acceleration: orders 0, 1, 2
DIMENSIONS = ("length", "velocity", "acceleration")
TERM = re.compile(r"([+-]?)\s*(?:(\d+\.?\d*|\.\d+)\s*\*?\s*)?([xva])(\d+)\s*")
DASHPOTS = "dashpots"
SIGNS = (("+", "_plus_"), ("-", "_minus_"), ("*", "_times_"), (".", "_point_"))
ROWS = '"x1", "v1" or "a1", a difference such as "x2 - x1", or a number for each coordinate'


@dataclass(frozen=True)
class Measure(ABC):
    """One number about a steady motion.

    Parameters
    ----------
    system
        The system that it is for, by :func:`measure_of`; orbits and most sweeps know theirs.

    Attributes
    ----------
    label
        Its name for axes and reports, as in "amplitude of x1".
    dimension
        Quantity by which it has a unit: a key of machines/units.py, "" for a plain number.
    observers
        Observers of :func:`~vibroimpact.sweep` that hold it.
    """

    system: System | None = field(default=None, kw_only=True, repr=False, compare=False)

    DIMENSION: ClassVar[str] = ""
    OBSERVERS: ClassVar[tuple[Observer, ...]] = ()

    @property
    @abstractmethod
    def label(self) -> str:
        """Name of the measure, for axes and reports."""

    @property
    def dimension(self) -> str:
        """Quantity that gives its unit: "length", "power"; "" for a plain number."""
        return self.DIMENSION

    @property
    def observers(self) -> tuple[Observer, ...]:
        """Observers of a sweep that hold it."""
        return self.OBSERVERS

    @abstractmethod
    def _of(self, flights: Flights) -> Dual:
        """Value of the measure with its derivative, of each motion that flights are of, shape (k,)."""

    def _check(self, m: Mechanism) -> None:  # noqa: B027 - most have nothing to refuse
        """Refuse a mechanism that has no such row or part."""

    @abstractmethod
    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:
        """Measure each member of a sweep by what the observers hold."""

    def of_sweep(self, members: xr.Dataset) -> xr.DataArray:
        """Measure each member of a sweep that has these observers, whatever its motion.

        Parameters
        ----------
        members
            Result of :func:`~vibroimpact.sweep` and its like, with ``observe`` at least
            :attr:`observers`.

        Returns
        -------
        DataArray
            NaN for members that did not reach the end of their window.

        Raises
        ------
        InvalidParameterError
            A dataset without these observers; a system that is code, which no dataset holds: bind
            the measure to it by :func:`measure_of`.
        """
        check_kind("members", members, xr.Dataset, "a Dataset, as vi.sweep gives")
        missing = [one for one in self._variables(members) if one not in members]
        if missing:
            raise InvalidParameterError(
                f"members: has no variable {', '.join(missing)}. Give a sweep with observe = "
                "measure.observers."
            )
        system = self.system if self.system is not None else _system_of(members)
        self._check(mechanism_of(system))
        found = self._members(members, system).where(members["end"] == MemberStatus.OK)
        attrs = {"long_name": self.label}
        if self.dimension:
            attrs["quantity"] = self.dimension
        return found.rename(self.label).assign_attrs(attrs)

    def _variables(self, members: xr.Dataset) -> list[str]:
        system = self.system if self.system is not None else _system_of(members)
        m = mechanism_of(system)
        bound = replace(self, system=system)
        return [name for one in bound.observers for name in one.variables(m)]

    def of_orbit(self, orbit: Motion) -> float:
        """Measure a periodic orbit, exact to rounding: extrema are located, integrals in closed form.

        Parameters
        ----------
        orbit
            A converged :class:`Orbit`, or a motion without impacts, of any stability.
        """
        return self.along(orbit, "")[0]

    def derivative(self, orbit: Motion, parameter: str) -> float:
        """Total derivative of the measure along the branch of an orbit, exact to rounding.

        By the implicit function theorem for the orbit, variations for its flights and the envelope
        theorem for extrema; no differences. NaN where there is none: at a fold, of an rms that is
        zero.
        """
        return self.along(orbit, parameter)[1]

    def along(self, orbit: Motion, parameter: str) -> tuple[float, float]:
        """Value and derivative at once; no derivative, NaN, where ``parameter`` is ""."""
        check_kind("parameter", parameter, str, 'the name of a parameter, or ""')
        flights = flights_of(orbit, parameter)
        self._check(flights.rows.mechanism)
        value, by = self._of(flights)
        return float(value[0]), float(by[0]) if parameter else math.nan

    def of_run(self, run: Run, span: float) -> float:
        """Measure a simulated motion from its start to a time that it has reached."""
        return float(self._of(flights_of_run(run, span)).value[0])

    @property
    def _bound(self) -> Mechanism:
        if self.system is None:
            raise InvalidParameterError(
                "observers: depend on the system. Bind the measure: vi.measure_of(system, measure)."
            )
        return mechanism_of(self.system)


# ---- of a row ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _OfRow(Measure):
    """A measure of a row: positions, velocities or accelerations, by its order."""

    row: Row
    order: int | None = field(default=None, kw_only=True)

    KIND: ClassVar[str] = ""

    def __post_init__(self) -> None:
        order = self.order
        known = "0 (coordinate), 1 (velocity) or 2 (acceleration)"
        check_kind("order", order, (int, type(None)), known)
        if order is not None and order not in (0, 1, 2):
            raise refusal("order", order, known)
        if isinstance(self.row, str):
            _parsed(self.row)
            if order is not None:
                raise refusal("order", order, "left out", "The letter of the row tells it.")
            return
        row = vector("row", self.row)
        if not any(row):
            raise refusal("row", self.row, "not all zero")
        object.__setattr__(self, "row", row)

    @property
    def derivatives(self) -> int:
        """0 of coordinates, 1 of velocities, 2 of accelerations."""
        return _parsed(self.row)[1] if isinstance(self.row, str) else self.order or 0

    @property
    def text(self) -> str:
        """The row in letters, such as "x2 - x1"."""
        return self.row.strip() if isinstance(self.row, str) else _text(self.row, self.derivatives)

    @property
    def label(self) -> str:
        """Name of the measure, for axes and reports."""
        return f"{self.KIND} of {self.text}"

    @property
    def dimension(self) -> str:
        """Length, velocity or acceleration."""
        return DIMENSIONS[self.derivatives]

    def _check(self, m: Mechanism) -> None:
        self.coefficients(m)

    def coefficients(self, m: Mechanism) -> Floats:
        """Coefficients of the coordinates of a mechanism, shape (n,)."""
        row, n = self.row, m.degrees
        if not isinstance(row, str):
            return np.array(vector("row", row, n))
        out = np.zeros(n)
        for i, x in _parsed(row)[0]:
            if not 1 <= i <= n:
                raise refusal("row", row, f"of coordinates 1 to {n}, {ROWS}")
            out[i - 1] += x
        if not out.any():
            raise refusal("row", row, "not all zero")
        return out

    @property
    def observers(self) -> tuple[Observer, ...]:
        """Observer of the row."""
        row = self.coefficients(self._bound)
        behind = (0.0,) * (len(row) * self.derivatives)  # (x), (x, v) or (x, v, a)
        return (self._observer((*behind, *row.tolist())),)

    @abstractmethod
    def _observer(self, row: tuple[float, ...]) -> Observer:
        """Observer of a row on the state and the accelerations."""

    @property
    def _name(self) -> str:
        """The row as a name of variables of a sweep."""
        text = _in_words(self.text.replace(" ", ""))
        return text if text.isidentifier() else f"row{text}"

    def _signal(self, flights: Flights) -> Signal:
        rows, order = flights.rows, self.derivatives
        return flights.signal(partial(_moved, rows, self.coefficients(rows.mechanism), order))


def of_same_row(measure: Measure, kind: type[Rms | Peak]) -> Measure | None:
    """A measure of another kind of the same row; None for measures of no row."""
    return kind(measure.row, order=measure.order) if isinstance(measure, _OfRow) else None


def coefficients_of(measure: Measure, m: Mechanism) -> Floats | None:
    """Coefficients of the row of a measure, shape (n,); None for a measure of no row."""
    return measure.coefficients(m) if isinstance(measure, _OfRow) else None


def with_row(measure: Measure, row: Sequence[float]) -> Measure:
    """A measure of a row, of another one of the same order; other measures as they are."""
    if not isinstance(measure, _OfRow):
        return measure
    return replace(measure, row=tuple(row), order=measure.derivatives, system=None)


def _moved(rows: Rows, row: Floats, order: int, code: int) -> Dual:
    return rows.moved(code, row, order)


@dataclass(frozen=True)
class Amplitude(_OfRow):
    """Half of the range of a row: (largest - smallest) / 2 over the steady motion.

    Parameters
    ----------
    row
        "x1", "v1", "a1" or a sum such as "x2 - x1"; or coefficients, one for each coordinate.
    order
        With coefficients: 0 of coordinates, 1 of velocities, 2 of accelerations between impacts.
    """

    KIND: ClassVar[str] = "amplitude"

    def _observer(self, row: tuple[float, ...]) -> Observer:
        return Extremes(row=row, label=self._name)

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:  # noqa: ARG002
        return (members[f"{self._name}_largest"] - members[f"{self._name}_smallest"]) / 2.0

    def _of(self, flights: Flights) -> Dual:
        low, high = self._signal(flights).extremes()
        return (high - low) / 2.0


@dataclass(frozen=True)
class Peak(_OfRow):
    """Largest modulus of a row over the steady motion; with a mean, more than its amplitude."""

    KIND: ClassVar[str] = "peak"

    def _observer(self, row: tuple[float, ...]) -> Observer:
        return Extremes(row=row, label=self._name)

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:  # noqa: ARG002
        low, high = (members[f"{self._name}_{end}"] for end in ("smallest", "largest"))
        return abs(low).where(abs(low) > abs(high), abs(high))

    def _of(self, flights: Flights) -> Dual:
        return _largest_modulus(self._signal(flights))


def _largest_modulus(signal: Signal) -> Dual:
    low, high = signal.extremes()
    return high.where(high.value >= -low.value, -low)


@dataclass(frozen=True)
class Rms(_OfRow):
    """Root mean square of a row over the steady motion, its mean included."""

    KIND: ClassVar[str] = "rms"

    def _observer(self, row: tuple[float, ...]) -> Observer:
        return RmsObserver(row=row, label=self._name)

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:  # noqa: ARG002
        return members[f"{self._name}_rms"]

    def _of(self, flights: Flights) -> Dual:
        signal = self._signal(flights)
        return signal.mean_product(signal).sqrt()


@dataclass(frozen=True)
class Harmonic(_OfRow):
    """Amplitude of the part of a row at a multiple of the forcing frequency.

    Parameters
    ----------
    row, order
        As for :class:`Amplitude`.
    harmonic
        Multiple of the frequency of the first line, > 0; fractions are subharmonics. Of motions that
        are simulated, ``periods`` should hold a whole number of its turns: 51 for a third, not 50.
    """

    harmonic: float = field(default=1.0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "harmonic", positive("harmonic", self.harmonic))

    @property
    def label(self) -> str:
        """Name of the measure, for axes and reports."""
        return f"harmonic {self.harmonic:g} of {self.text}"

    def _check(self, m: Mechanism) -> None:
        super()._check(m)
        if not m.forces:
            raise InvalidParameterError(
                "harmonic: is a multiple of the forcing frequency, and there is no forcing."
            )

    @property
    def _name(self) -> str:
        return f"{super()._name}_at_{_in_words(repr(self.harmonic))}"

    def _observer(self, row: tuple[float, ...]) -> Observer:
        return HarmonicObserver(row=row, label=self._name, harmonic=self.harmonic)

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:  # noqa: ARG002
        return members[f"{self._name}_harmonic"]

    def _of(self, flights: Flights) -> Dual:
        return self._signal(flights).harmonic(self.harmonic)


@dataclass(frozen=True)
class Transmissibility(Amplitude):
    """Amplitude of a row over that of the base's motion, or over the static deflection.

    Parameters
    ----------
    row
        As for :class:`Amplitude`.
    base
        Amplitude of the motion of the base, > 0, in the unit of the row; where it is left out, the
        deflection of the row under static forces of the same amplitude, F / k of an oscillator.
    """

    base: float | None = None

    KIND: ClassVar[str] = "transmissibility"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.base is not None:
            object.__setattr__(self, "base", positive("base", self.base))

    @property
    def dimension(self) -> str:
        """No quantity: a plain number."""
        return ""

    def _check(self, m: Mechanism) -> None:
        super()._check(m)
        if self.base is not None:
            return
        if self.derivatives:
            raise InvalidParameterError(
                f"row = {self.text}: velocities and accelerations have no static deflection. Give "
                "base, that of the base's motion."
            )
        if len(m.forces) != 1:
            raise InvalidParameterError(
                f"base = None: the static deflection is that of one forcing line, and there are "
                f"{len(m.forces)}. Give base."
            )
        self._reference(m)

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:
        if self.base is not None:
            return super()._members(members, system) / self.base
        return super()._members(members, system) / _per_system(members, system, self._reference)

    def _reference(self, system: System) -> float:
        m = mechanism_of(system)
        force = m.forces[0]
        loads = np.array([*m.stiffness, force.sine, force.cosine])
        return _static_deflection(
            m, (loads, np.zeros_like(loads)), self.coefficients(m), self.text
        )[0]

    def _of(self, flights: Flights) -> Dual:
        amplitude, rows = super()._of(flights), flights.rows
        if self.base is not None:
            return amplitude / self.base
        row = self.coefficients(rows.mechanism)
        loads = rows.numbers("loads", _loads)
        parts = (
            _static_deflection(rows.mechanism, one, row, self.text)
            for one in zip(*loads, strict=True)
        )
        value, by = np.transpose([*parts])
        return amplitude / Dual(value, by)


def _loads(pieces: Piecewise) -> list[Vector]:
    """Stiffness matrix, and amplitudes of sine and cosine of the first force, one below the other."""
    m, force = pieces.mechanism, pieces.mechanism.forces[0]
    return [*map(list, m.stiffness), [*force.sine], [*force.cosine]]


def _static_deflection(
    m: Mechanism, loads: tuple[Floats, Floats], row: Floats, text: str
) -> tuple[float, float]:
    """Amplitude of row . x under static forces, of the coordinates that springs hold, and its derivative."""
    (*stiffness, sine, cosine), (*stiffness_by, sine_by, cosine_by) = loads
    inverse = np.linalg.pinv(np.array(stiffness))
    value, by = 0.0, 0.0
    for f, f_by in ((sine, sine_by), (cosine, cosine_by)):
        x = inverse @ f
        part = float(row @ x)
        value = math.hypot(value, part)
        by += part * float(row @ inverse @ (f_by - np.array(stiffness_by) @ x))
    largest = max(float(np.abs(f).max()) for f in (sine, cosine))
    if value <= 1e-12 * largest * float(np.abs(row).sum()) * float(np.abs(inverse).max()):
        raise InvalidParameterError(
            f"row = {text}: has no static deflection under the forces of {m.degrees} coordinates. "
            "Give base, the amplitude of the base's motion, or take another row."
        )
    return value, by / value


# ---- of parts ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _OfPart(Measure):
    """A measure of one contact or element, by its number in ``run.contact``; of all for None."""

    part: int | None = None

    def _check(self, m: Mechanism) -> None:
        _check_part(self.part, m)

    @property
    def _whose(self) -> str:
        return "" if self.part is None else f" of part {self.part}"


def _check_part(part: Any, m: Mechanism) -> None:
    """Refuse what is not the number of a stop or friction."""
    if part is None:
        return
    count = len(m.elements)
    if not isinstance(part, int | np.integer) or isinstance(part, bool):
        raise refusal("part", part, "the number of a contact or element")
    if not 0 <= part < count:
        raise refusal("part", part, f"0 to {count - 1}", "Contacts come first.")
    if not m.elements[part].row:
        raise refusal("part", part, "a stop or friction", "A phase switch has no row.")


@dataclass(frozen=True)
class DissipatedPower(Measure):
    """Mean power that stops and elements take from the motion.

    Parameters
    ----------
    part
        Number of a contact or element, as in ``run.contact``: impacts at a rigid stop, work on a
        soft stop's dashpot, on friction. By default all of them together; ``"dashpots"`` are those
        of the damping matrix.
    """

    part: int | str | None = None

    DIMENSION: ClassVar[str] = "power"

    @property
    def label(self) -> str:
        """Name of the measure, for axes and reports."""
        whose = f" of {DASHPOTS}" if self.part == DASHPOTS else f" of part {self.part}"
        return f"dissipated power{'' if self.part is None else whose}"

    def _check(self, m: Mechanism) -> None:
        if isinstance(self.part, str):
            check_choice("part", self.part, [DASHPOTS], "Or the number of a contact or element.")
        else:
            _check_part(self.part, m)

    @property
    def observers(self) -> tuple[Observer, ...]:
        """Observers of impacts, of elements, or of dashpots."""
        contacts, elements = len(self._bound.rigid_stops), len(self._bound.switching)
        if isinstance(self.part, str):
            return (Dashpots(),)
        if self.part is not None:
            return (Power(),) if self.part < contacts else (Dissipation(),)
        return (*((Power(),) if contacts else ()), *((Dissipation(),) if elements else ()))

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:
        m = mechanism_of(system)
        contacts = len(m.rigid_stops)
        if isinstance(self.part, str):
            return members["power_of_dashpots"]
        if self.part is not None and self.part < contacts:
            return members["power_of_part"].isel({PART: self.part}, drop=True)
        if self.part is not None:
            return members["work_on_element"].isel({ELEMENT: self.part - contacts}, drop=True)
        parts = [members["power"]] if contacts else []
        if m.switching:
            parts.append(members["work_on_element"].sum(ELEMENT, skipna=False))
        return sum(parts[1:], parts[0])

    def _of(self, flights: Flights) -> Dual:
        if isinstance(self.part, str):
            return _of_dashpots(flights)
        contacts = len(flights.rows.mechanism.rigid_stops)
        of, _, losses = _impacts_at(flights, self.part)
        lost = flights.summed(losses, of) / flights.period
        for element in range(len(flights.rows.mechanism.switching)):
            if self.part in (None, contacts + element):
                lost = lost + _of_element(flights, element)
        return lost


def _impacts_at(flights: Flights, part: int | None) -> tuple[Integers, Dual, Dual]:
    """Number of the motion, impulse and energy lost of each impact at a contact or element; at all for None."""
    of, stops = flights.of[flights.struck.flights], flights.struck.stops
    laws = Dual(*(np.empty((len(stops), 2)) for _ in range(2)))
    for stop in {*stops}:
        there = np.array([one == stop for one in stops])
        for kept, given in zip(laws, flights.rows.impact(*stop), strict=True):
            kept[there] = given[of[there]]
    here = np.array([part is None or stop.contact == part for stop in stops], dtype=bool)
    speed, per_speed, per_square = (x[here] for x in (flights.closing(), laws[:, 0], laws[:, 1]))
    return of[here], per_speed * speed, per_square * (speed * speed)


def _of_element(flights: Flights, element: int) -> Dual:
    rows, part = flights.rows, len(flights.rows.mechanism.rigid_stops) + element
    force = flights.signal(partial(rows.force, part=part))
    speed = flights.signal(partial(rows.work_speed, element=element))
    return -force.mean_product(speed)


def _of_dashpots(flights: Flights) -> Dual:
    """Mean of v . C v."""
    rows = flights.rows
    damping = rows.numbers("damping", lambda pieces: pieces.mechanism.damping)
    n = rows.mechanism.degrees
    power = flights.period * 0.0
    speeds = [flights.signal(partial(_moved, rows, np.eye(n)[i], 1)) for i in range(n)]
    for i, j in itertools.product(range(n), repeat=2):
        constant = damping[:, i, j]
        if constant.value.any() or constant.by.any():
            power = power + constant * speeds[i].mean_product(speeds[j])
    return power


@dataclass(frozen=True)
class ContactForce(_OfPart):
    """Largest force of a contact or element over the steady motion, without impulses.

    Parameters
    ----------
    part
        Its number, as in ``run.contact``; by default the only one. A soft stop has its contact
        force, friction its force, a rigid stop the force at rest: 0 where it only impacts.
    """

    part: int | None = None

    DIMENSION: ClassVar[str] = "force"
    OBSERVERS: ClassVar[tuple[Observer, ...]] = (Forces(),)

    @property
    def label(self) -> str:
        """Name of the measure, for axes and reports."""
        return f"largest force{self._whose}"

    def _check(self, m: Mechanism) -> None:
        super()._check(m)
        self._number(m)

    def _number(self, m: Mechanism) -> int:
        if self.part is not None:
            return int(self.part)
        with_force = [i for i, one in enumerate(m.elements) if one.row]
        if len(with_force) != 1:
            raise InvalidParameterError(
                f"part = None: there are {len(m.elements)} contacts and elements. Give its number."
            )
        return with_force[0]

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:
        part = self._number(mechanism_of(system))
        low, high = (
            abs(members[f"force_{end}"].isel({PART: part}, drop=True))
            for end in ("smallest", "largest")
        )
        return low.where(low > high, high)

    def _of(self, flights: Flights) -> Dual:
        rows = flights.rows
        part = self._number(rows.mechanism)
        return _largest_modulus(flights.signal(partial(rows.force, part=part)))


@dataclass(frozen=True)
class Impulse(_OfPart):
    """Largest impulse of an impact at rigid stops.

    Parameters
    ----------
    part
        Number of the contact; by default of any.
    """

    DIMENSION: ClassVar[str] = "impulse"
    OBSERVERS: ClassVar[tuple[Observer, ...]] = (ImpulseObserver(),)

    @property
    def label(self) -> str:
        """Name of the measure, for axes and reports."""
        return f"largest impulse{self._whose}"

    def _check(self, m: Mechanism) -> None:
        super()._check(m)
        if not m.rigid_stops or (self.part is not None and self.part >= len(m.rigid_stops)):
            raise InvalidParameterError(
                f"part = {self.part}: impulses are those of rigid stops, and contacts are 0 to "
                f"{len(m.rigid_stops) - 1}. Of a soft stop or friction take ContactForce."
            )

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:  # noqa: ARG002
        largest = members["impulse_largest"]
        return (
            largest.max(PART) if self.part is None else largest.isel({PART: self.part}, drop=True)
        )

    def _of(self, flights: Flights) -> Dual:
        of, impulses, _ = _impacts_at(flights, self.part)
        return flights.extreme(impulses, of)


@dataclass(frozen=True)
class ImpactSpeed(Measure):
    """Closing speed of impacts, soft stops included; 0 where there are none.

    Parameters
    ----------
    kind
        "largest", "mean", "rms" or "smallest".
    """

    kind: Speed = "largest"

    DIMENSION: ClassVar[str] = "velocity"
    OBSERVERS: ClassVar[tuple[Observer, ...]] = (Speeds(),)

    def __post_init__(self) -> None:
        check_choice("kind", self.kind, ["largest", "mean", "rms", "smallest"])

    @property
    def label(self) -> str:
        """Name of the measure, for axes and reports."""
        return f"{self.kind} impact speed"

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:  # noqa: ARG002
        return members[f"speed_{self.kind}"].fillna(0.0)

    def _of(self, flights: Flights) -> Dual:
        speeds, of = flights.closing(), flights.of[flights.struck.flights]
        if self.kind in ("largest", "smallest"):
            return flights.extreme(speeds, of, largest=self.kind == "largest")
        met = np.maximum(np.bincount(of, minlength=flights.rows.count), 1).astype(float)
        count = Dual(met, np.zeros_like(met))
        if self.kind == "mean":
            return flights.summed(speeds, of) / count
        return (flights.summed(speeds * speeds, of) / count).sqrt()


@dataclass(frozen=True)
class ImpactRate(Measure):
    """Impacts per unit of time, at all stops, soft ones included: what is heard."""

    DIMENSION: ClassVar[str] = "rate"
    OBSERVERS: ClassVar[tuple[Observer, ...]] = (Impacts(),)

    @property
    def label(self) -> str:
        """Name of the measure, for axes and reports."""
        return "impacts per unit of time"

    def _members(self, members: xr.Dataset, system: System) -> xr.DataArray:
        count = members["impacts_a"] + members["impacts_b"]
        return count * _per_system(members, system, _cycles_per_time)

    def _of(self, flights: Flights) -> Dual:
        of = flights.of[flights.struck.flights]
        count = np.bincount(of, minlength=flights.rows.count).astype(float)
        return Dual(count, np.zeros_like(count)) / flights.period


def _cycles_per_time(system: System) -> float:
    m = mechanism_of(system)
    return m.omega / (2.0 * math.pi) if m.forces else 1.0


# ---- by name -------------------------------------------------------------------------------------

KINDS: dict[str, Callable[[str], Measure]] = {
    "amplitude": Amplitude,
    "peak": Peak,
    "rms": Rms,
    "transmissibility": Transmissibility,
}
PARTS: dict[str, Callable[[int | None], Measure]] = {
    "power": DissipatedPower,
    "dissipated power": DissipatedPower,
    "contact force": ContactForce,
    "impulse": Impulse,
}
PLAIN: dict[str, Callable[[], Measure]] = {
    "impact speed": ImpactSpeed,
    "impact rate": ImpactRate,
    "power of dashpots": partial(DissipatedPower, DASHPOTS),
}


def measure_of(system: System, measure: Measure | str) -> Measure:
    """Return a measure for a system, from a measure or its name.

    Parameters
    ----------
    system
        The system.
    measure
        A measure, as ``vi.measures.Amplitude("x1")``; or text: "x1", "v1", "a1" or "x2 - x1" for an
        amplitude, "peak x1", "rms v1", "harmonic 3 x1", "transmissibility x1", "power", "power 0",
        "power of dashpots", "contact force 0", "impulse", "impact speed", "impact rate".

    Raises
    ------
    InvalidParameterError
        No such measure, or one that the system does not have; the message lists what is allowed.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> orbit = vi.find_orbit(damper, vi.State((0.0, 0.0), (0.0, 1.0)))
    >>> round(vi.measure_of(damper, "x1").of_orbit(orbit), 6)
    0.497832
    """
    mechanism = mechanism_of(system)
    if isinstance(measure, str):
        measure = _named(measure)
    elif isinstance(measure, type) and issubclass(measure, Measure):
        raise refusal(
            "measure", measure, f"a measure with its arguments, such as {measure.__name__}()"
        )
    check_kind("measure", measure, Measure, "a measure or its name, such as 'x1' or 'rms v1'")
    measure._check(mechanism)
    return replace(measure, system=system)


def _named(text: str) -> Measure:
    """A measure by its name."""
    words = " ".join(text.split())
    if words in PLAIN:
        return PLAIN[words]()
    for name, kind in PARTS.items():
        if found := re.fullmatch(rf"{name}(?: (\d+))?", words):
            return kind(None if found[1] is None else int(found[1]))
    if found := re.fullmatch(r"harmonic (\S+) (.+)", words):
        order = real("harmonic", _number_of(found[1], text))
        return Harmonic(found[2], harmonic=order)
    head, _, rest = words.partition(" ")
    if head in KINDS and rest:
        return KINDS[head](rest)
    if _terms(words):
        return Amplitude(words)
    raise _unknown(text)


def _number_of(word: str, text: str) -> float:
    try:
        top, _, bottom = word.partition("/")
        return float(top) / float(bottom or 1.0)
    except (ValueError, ZeroDivisionError):
        raise _unknown(text) from None


def _unknown(text: str) -> InvalidParameterError:
    names = ", ".join(
        repr(f"{name} x1") for name in ("amplitude", "peak", "rms", "transmissibility")
    )
    others = ", ".join(map(repr, [*PARTS, *PLAIN]))
    return refusal(
        "measure", text, f"{ROWS}; {names}, 'harmonic 3 x1'; {others}; or a measure of vi.measures"
    )


# ---- rows ----------------------------------------------------------------------------------------


def _terms(text: str) -> list[tuple[float, str, int]]:
    """(coefficient, letter, number) of each term; none where the text is no such sum."""
    found, at = [], 0
    text = text.strip()
    while at < len(text):
        term = TERM.match(text, at)
        if not term or (at and not term[1]):
            return []
        size = float(term[2] or 1.0)
        found.append((-size if term[1] == "-" else size, term[3], int(term[4])))
        at = term.end()
    return found


def _parsed(text: str) -> tuple[list[tuple[int, float]], int]:
    """(number of the coordinate, coefficient) of each term, and the order of the derivative."""
    terms = _terms(text)
    letters = {letter for _, letter, _ in terms}
    if len(letters) != 1:
        raise refusal("row", text, ROWS)
    return [(number, size) for size, _, number in terms], LETTERS.index(letters.pop())


def _text(row: Sequence[float], order: int) -> str:
    """A row in letters, the positive terms first."""
    text = ""
    for i in sorted((i for i, x in enumerate(row) if x), key=lambda i: row[i] < 0.0):
        size = "" if abs(row[i]) == 1.0 else f"{abs(row[i]):g}*"
        sign = ("-" if row[i] < 0.0 else "+") if text else ("-" if row[i] < 0.0 else "")
        text += (f" {sign} " if text else sign) + f"{size}{LETTERS[order]}{i + 1}"
    return text


def _in_words(text: str) -> str:
    """A text with its signs as words, for names of variables."""
    for sign, word in SIGNS:
        text = text.replace(sign, word)
    return text


# ---- members of a sweep --------------------------------------------------------------------------


def _system_of(members: xr.Dataset) -> System:
    """The system of a sweep, from its attributes."""
    text = members.attrs.get("system_numbers")
    system = system_of(text) if text else None
    if system is None:
        raise InvalidParameterError(
            f"members: {members.attrs.get('system', 'its system')} is code, which no dataset holds. "
            "Bind the measure to it: vi.measure_of(system, measure)."
        )
    return system


def _swept(members: xr.Dataset) -> list[str]:
    return [name for name in members.attrs.get("swept", "").split(", ") if name in members.dims]


def _held(members: xr.Dataset, system: System) -> System:
    """The system with the values of parameters of which the dataset is a part."""
    names = [name for name in members.attrs.get("swept", "").split(", ") if name]
    scalars = {n: float(members[n]) for n in names if n in members.coords and not members[n].dims}
    return with_parameters(system, scalars)


def _per_system(
    members: xr.Dataset, system: System, of: Callable[[System], float]
) -> xr.DataArray | float:
    """A number of each system of a sweep."""
    names = _swept(members)
    axes = [members[name].values.tolist() for name in names]
    system = _held(members, system)
    values = [
        of(with_parameters(system, dict(zip(names, one, strict=True))))
        for one in itertools.product(*axes)
    ]
    if not names:
        return values[0]
    shaped = np.reshape(values, [len(axis) for axis in axes])
    return xr.DataArray(shaped, dims=names, coords={name: members[name] for name in names})
