"""Records of a force or of the acceleration of a base over time, from arrays or a CSV file.

Between its samples a record is linear in time, before and after them zero.
"""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact._core.checks import (
    check_choice,
    check_flag,
    nonnegative,
    numbers,
    path_of,
    positive,
    real,
    shown,
    vector,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.texts import read_text
from vibroimpact._core.types import Floats, Rising
from vibroimpact.machines.units import units_of
from vibroimpact.measures.measure import Peak, Row
from vibroimpact.results.result import Result, along

if TYPE_CHECKING:
    from vibroimpact.model.mechanism import Mechanism

Kind = Literal["force", "base"]
KINDS = ("force", "base")
DELIMITERS = ";\t,"
MOST_BYTES = 2**28  # of a file of a record
COMMENT = "#"
# Samples that are so near to a straight line, in ulp of the largest value, are on it.
STRAIGHT_ULPS = 4.0
EXTRA = "A jump takes two samples a short time apart."


class Pieces(NamedTuple):
    """The straight pieces of a record: where each begins, its value there, slope and length."""

    begin: Floats
    value: Floats
    slope: Floats
    length: Floats


@dataclass(frozen=True, eq=False)
class ForceRecord(Result):
    """A force, or the acceleration of a base, as samples over time, linear in between.

    Parameters
    ----------
    time
        Times of the samples, rising, shape (k,), k >= 2.
    values
        Forces or accelerations at these times, shape (k,).
    row
        Row on which it acts. A force: "x1" or a sum such as "x2 - x1" (a force between two masses), or
        what it adds to the force on each coordinate, shape (n,); "x1" where left out. The
        acceleration of a base: how far each coordinate is carried along by the base, shape (n,) or
        a sum; each by 1 where left out.
    kind
        ``"force"``, or ``"base"``: coordinates are then relative to the base, and on each mass
        acts its inertia, -M row values(t).
    si
        Whether times are in seconds, and values in N, or m/s² of a base: datasets, pictures and what is printed,
        also of its response spectrum, have these units then.

    Attributes
    ----------
    time, values
        Read-only arrays.

    Raises
    ------
    InvalidParameterError
        Times that do not rise, other shapes, entries that are not finite; the message names the
        first such entry.

    Notes
    -----
    Units are those of the machine that it drives, whatever ``si`` is.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> pulse = vi.ForceRecord([0.0, 0.5, 1.0], [0.0, 2.0, 0.0])
    >>> pulse.at(0.75).item(), pulse.peak, pulse.impulse
    (1.0, 2.0, 1.0)
    """

    time: Rising = field(metadata=along("time", quantity="time"))
    values: Floats = field(metadata=along("time"))
    row: Row | None = None
    kind: Kind = "force"
    si: bool = False

    def __post_init__(self) -> None:
        check_choice("kind", self.kind, KINDS)
        check_flag("si", self.si)
        time, values = _samples("time", self.time), _samples("values", self.values)
        if time.size < 2:
            raise InvalidParameterError(f"time has {time.size} entries: a record has 2 or more.")
        if values.size != time.size:
            raise InvalidParameterError(
                f"values has shape {values.shape}; expected {time.shape}, one for each time."
            )
        falls = np.flatnonzero(np.diff(time) <= 0.0)
        if falls.size:
            i = int(falls[0]) + 1
            raise InvalidParameterError(
                f"time[{i}] = {time[i]}: must be greater than time[{i - 1}] = {time[i - 1]}. {EXTRA}"
            )
        if self.row is not None and not isinstance(self.row, str):
            object.__setattr__(self, "row", vector("row", self.row))
        if self.row is not None:
            Peak(self.row)  # checks it
        for name, array in (("time", time), ("values", values)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        *,
        time: str | int = 0,
        values: str | int | None = None,
        step: float | None = None,
        factor: float = 1.0,
        time_factor: float = 1.0,
        row: Row | None = None,
        kind: Kind = "force",
        si: bool = False,
    ) -> ForceRecord:
        """Read a record from a text file of columns.

        Columns are separated by commas, semicolons, tabs or blanks. Empty lines and those that begin
        with # are left out; a first line of names is recognised.

        Parameters
        ----------
        path
            The file.
        time, values
            Columns of the times and of the values, by number from 0 or by name; by default the
            first two, with ``step`` the first.
        step
            Time between samples, > 0, instead of a column of times; the first is at 0.
        factor, time_factor
            What values and times are multiplied by: 9.80665 for accelerations in g, 0.001 for times
            in milliseconds.
        row, kind, si
            As for the class.

        Raises
        ------
        InvalidParameterError
            A file that cannot be read, a line with too few columns or with what is no number, times
            that do not rise; the message names file, line and value.
        """
        file = path_of("path", path)
        scale, clock = real("factor", factor), positive("time_factor", time_factor)
        spacing = None if step is None else positive("step", step)
        table = _table(file)
        if values is None:
            values = 1 if spacing is None else 0
        found = table.column(values)
        count = np.arange(len(found), dtype=float)
        if len(found) < 2:
            raise InvalidParameterError(f"{file}: {len(found)} samples; a record has 2 or more.")
        with np.errstate(over="ignore"):  # what is infinite is refused
            times: Floats = table.times(time) if spacing is None else spacing * count
            return cls(times * clock, found * scale, row, kind, si)

    def __len__(self) -> int:
        return int(self.time.size)

    def __repr__(self) -> str:
        what = "base acceleration" if self.kind == "base" else "force"
        where = "" if self.row is None else f" on {self.row}"
        units = units_of(self)
        return (
            f"ForceRecord: {what}{where}, {len(self)} samples over {units.text(self.duration, quantity='time')}, "
            f"peak {units.text(self.peak, quantity=self.quantity)}"
        )

    def to_dataset(self) -> xr.Dataset:
        """Convert to an xarray dataset along ``time``."""
        return units_of(self).of_variables(super().to_dataset(), {"values": self.quantity})

    @property
    def quantity(self) -> str:
        """What its values are: "force" or "acceleration"."""
        return "acceleration" if self.kind == "base" else "force"

    @property
    def duration(self) -> float:
        """Time from the first to the last sample."""
        return float(self.time[-1] - self.time[0])

    @property
    def peak(self) -> float:
        """Largest modulus."""
        return float(np.abs(self.values).max())

    @property
    def rms(self) -> float:
        """Root mean square over its duration, exact for straight pieces."""
        a, b, dt = self.values[:-1], self.values[1:], np.diff(self.time)
        return math.sqrt(float(np.sum((a * a + a * b + b * b) * dt)) / 3.0 / self.duration)

    @property
    def impulse(self) -> float:
        """Integral over time, exact for straight pieces."""
        return float(np.sum((self.values[1:] + self.values[:-1]) * np.diff(self.time)) / 2.0)

    def at(self, t: ArrayLike) -> Floats:
        """Values at any times: linear between samples, zero outside."""
        times = numbers("t", t, "times")
        found: Floats = np.interp(times, self.time, self.values, left=0.0, right=0.0)
        return found

    def scaled(self, factor: float) -> ForceRecord:
        """The record with all values multiplied by a factor."""
        return replace(self, values=self.values * real("factor", factor))

    def influence(self, mechanism: Mechanism) -> Floats:
        """Force on each coordinate of a mechanism per unit of the record, shape (n,)."""
        n = mechanism.degrees
        if self.row is None:
            carried = np.ones(n) if self.kind == "base" else np.eye(n)[0]
        else:
            carried = Peak(self.row).coefficients(mechanism)
        return -np.array(mechanism.mass) @ carried if self.kind == "base" else carried

    def pieces(self, after: float = 0.0) -> Pieces:
        """Its straight pieces, samples on a common line merged, and a piece without force after it.

        Parameters
        ----------
        after
            Length of the last piece, >= 0; none for 0.
        """
        corners = _corners(self.time, self.values)
        t, s = self.time[corners], self.values[corners]
        length = np.diff(t)
        begin, value, slope = t[:-1], s[:-1], np.diff(s) / length
        if nonnegative("after", after):
            begin, length = np.append(begin, t[-1]), np.append(length, after)
            value, slope = np.append(value, 0.0), np.append(slope, 0.0)
        return Pieces(begin, value, slope, length)


def _samples(name: str, value: ArrayLike) -> Floats:
    array = numbers(name, value)
    if array.ndim != 1 or array.dtype != float:
        raise InvalidParameterError(f"{name} has shape {array.shape}; expected (k,).")
    return array


def _corners(t: Floats, s: Floats) -> NDArray[np.intp]:
    """Samples between which all others lie on straight lines to rounding, first and last included.

    From each corner the slopes that pass all later samples within rounding are an interval; the
    line ends before the first sample whose own slope is outside.
    """
    room = STRAIGHT_ULPS * float(np.spacing(np.abs(s).max()))
    corners, low, high = [0], -math.inf, math.inf
    times, values = t.tolist(), s.tolist()
    t0, s0 = times[0], values[0]
    for i in range(1, len(times)):
        dt, ds = times[i] - t0, values[i] - s0
        if not low <= ds / dt <= high:
            corners.append(i - 1)
            t0, s0, low, high = times[i - 1], values[i - 1], -math.inf, math.inf
            dt, ds = times[i] - t0, values[i] - s0
        low, high = max(low, (ds - room) / dt), min(high, (ds + room) / dt)
    return np.array([*corners, len(times) - 1])


# ---- files ---------------------------------------------------------------------------------------


class _Table(NamedTuple):
    """Fields of a file: names of the columns, rows, and the number of the line of each."""

    file: str
    names: list[str]
    rows: list[list[str]]
    lines: list[int]

    def column(self, wanted: str | int) -> Floats:
        """A column by its name or number."""
        number = self._number(wanted)
        out = np.empty(len(self.rows))
        for i, row in enumerate(self.rows):
            where = f"{self.file}, line {self.lines[i]}"
            if number >= len(row):
                raise InvalidParameterError(
                    f"{where}: has {len(row)} columns; column {number} was to be read. Name "
                    "columns by time=... and values=..., numbered from 0; for values alone give step."
                )
            try:
                out[i] = float(row[number])
            except ValueError:
                out[i] = math.nan
            if not math.isfinite(out[i]):
                raise InvalidParameterError(
                    f"{where}, column {number}: {row[number]!r}: must be a finite number, with a "
                    "point, not a comma, before its decimals."
                )
        return out

    def times(self, wanted: str | int) -> Floats:
        """A column that rises."""
        found = self.column(wanted)
        falls = np.flatnonzero(np.diff(found) <= 0.0)
        if falls.size:
            i = int(falls[0]) + 1
            raise InvalidParameterError(
                f"{self.file}, line {self.lines[i]}: time {found[i]:g}: must be greater than "
                f"{found[i - 1]:g} of the sample before. {EXTRA}"
            )
        return found

    def _number(self, wanted: str | int) -> int:
        count = max(map(len, [self.names, *self.rows[:1]]))
        if isinstance(wanted, str) and wanted in self.names:
            return self.names.index(wanted)
        whole = isinstance(wanted, int | np.integer) and not isinstance(wanted, bool)
        if whole and -count <= int(wanted) < count:
            return int(wanted) % count
        listed = f", or by name: {', '.join(map(repr, self.names))}" if self.names else ""
        raise InvalidParameterError(
            f"column = {shown(wanted)}: {self.file} has {count} columns, 0 to {count - 1}{listed}. A "
            "file of values alone is read with values=0, step=..."
        )


def _table(path: Path) -> _Table:
    """The fields of a file."""
    name = str(path)
    text = read_text("path", path, MOST_BYTES, "Give the arrays: ForceRecord(time, values).")
    kept = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith(COMMENT)
    ]
    if not kept:
        raise InvalidParameterError(f"{name}: holds no samples.")
    rows = _fields([line for _, line in kept])
    lines = [number for number, _ in kept]
    names = [] if any(_is_number(field) for field in rows[0]) else rows[0]
    skipped = 1 if names else 0
    return _Table(name, names, rows[skipped:], lines[skipped:])


def _fields(lines: Sequence[str]) -> list[list[str]]:
    """Fields of each line, by the separator that the last line has."""
    separator = next((c for c in DELIMITERS if c in lines[-1]), None)
    if separator is None:
        return [line.split() for line in lines]
    return [[field.strip() for field in _split(line, separator)] for line in lines]


def _split(line: str, separator: str) -> list[str]:
    """Fields of one line: a quotation mark that is not closed ends with it."""
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:  # a field too large for the reader
        return line.split(separator)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
