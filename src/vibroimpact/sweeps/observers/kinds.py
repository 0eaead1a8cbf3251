"""The kinds of observers: options, and the variables that each returns.

The kernel computes them (include/vibroimpact/observe). A new one is a dataclass here, in the order
of the kernel's columns, and in OBSERVERS of observers.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from vibroimpact._core.checks import check_count, check_stop_name, share, vector
from vibroimpact._core.checks import real as real_number
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.stop import StopName
from vibroimpact.simulation.sections import check_stop
from vibroimpact.sweeps.observers.variables import (
    CONTACT,
    COORDINATE,
    EXPONENT,
    POINT,
    STROBE,
    Output,
    Table,
    check_label,
    labelled,
    real,
    reals,
    whole,
)  # fmt: skip


class Observer(Protocol):
    """An observer with its options: a frozen dataclass."""

    name: ClassVar[str]

    def outputs(self, mechanism: Mechanism) -> Table:
        """By name: what it returns of a member."""


MEASURED = {"position": "length", "velocity": "velocity", "time": "time"}  # quantities
MOST = 10**6  # of a count: so many section points of two coordinates are 48 MB per member


@dataclass(frozen=True, kw_only=True)
class Section:
    """The last impacts at one stop: states just after them.

    Parameters
    ----------
    points
        How many are kept, 1 to 10^6; NaN stands for those that did not come.
    stride
        Every stride-th impact is a point, 1 to 10^6, from the first in the window on.
    contact, stop
        As in :func:`~vibroimpact.impact_section`.
    label
        Of another section: it names the variables, ``section_<label>_position`` and so on. Members
        are run as often as there are sections.
    """

    name: ClassVar[str] = "section"
    points: int = 100
    stride: int = 1
    contact: int = 0
    stop: StopName = "A"
    label: str = ""

    def __post_init__(self) -> None:
        check_count("points", self.points, 1, MOST)
        _check_section(self)

    def outputs(self, mechanism: Mechanism) -> Table:
        """States (..., point, coordinate), phases and times (..., point)."""
        check_stop(mechanism, self.contact, self.stop)
        where = f"after impact at stop {self.stop} of contact {self.contact}"

        return _points(self, "section", POINT, where, mechanism)


@dataclass(frozen=True, kw_only=True)
class Stroboscopic:
    """The last states at one phase of the force, with impacts or without.

    Parameters
    ----------
    points
        How many are kept, one per forcing period, 1 to 10^6; NaN stands for those that did not
        come.
    phase
        Of the first forcing line, radians.
    label
        Of another one, as in :class:`Section`: ``stroboscopic_<label>_position`` and so on.
    """

    name: ClassVar[str] = "stroboscopic"
    points: int = 100
    phase: float = 0.0
    label: str = ""

    def __post_init__(self) -> None:
        check_count("points", self.points, 1, MOST)
        object.__setattr__(self, "phase", real_number("phase", self.phase))
        _check_own_label(self.label)

    def outputs(self, mechanism: Mechanism) -> Table:
        """States (..., strobe, coordinate), phases and times (..., strobe)."""
        if not mechanism.forces:
            raise InvalidParameterError(
                "observe = Stroboscopic: the system has no forcing, so that no phase repeats. Take "
                "Section."
            )
        return _points(self, "strobe", STROBE, f"at phase {self.phase:g} of the force", mechanism)


def _points(
    observer: Section | Stroboscopic, table: str, dim: str, where: str, mechanism: Mechanism
) -> Table:
    """Position, velocity, phase and time of the points of a section."""
    along = labelled(dim, observer.label)
    both, sizes = (along, COORDINATE), (observer.points, mechanism.degrees)

    def of(kind: str, units: str = "") -> Output:
        dims, shape = (both, sizes) if kind in ("position", "velocity") else (both[:1], sizes[:1])
        return real(
            f"{table}_{kind}", f"{kind} {where}", units=units, dims=dims, shape=shape,
            quantity=MEASURED.get(kind, ""),
        )  # fmt: skip

    units = {"position": "", "velocity": "", "phase": "rad", "time": ""}
    name = labelled(observer.name, observer.label)
    return {f"{name}_{kind}": of(kind, unit) for kind, unit in units.items()}


@dataclass(frozen=True, kw_only=True)
class Symbol:
    """The symbol n-p-q of a periodic motion: forcing periods, impacts at stops A and B.

    With several contacts p and q have a dimension of them.

    Parameters
    ----------
    tolerance
        The motion is back where x, v / omega, and sine and cosine of the phase differ by at most
        ``tolerance`` times the largest |x| and |v| / omega, before the impact or after it, and
        1; in (0, 1). Without forcing omega is the inverse of the kernel's step.
    returns
        It is periodic if it returns at every multiple of its period to the end of the window, and
        at least so often, 1 to 10^6.

    Notes
    -----
    Zeros: not periodic within tolerance and window, or without impacts ("impacts" tells them
    apart). Completed chatter is one impact; without forcing n = 0. Of a window with more than 4096
    impacts the first ones decide.
    """

    name: ClassVar[str] = "symbol"
    tolerance: float = 1e-6
    returns: int = 2

    def __post_init__(self) -> None:
        share("tolerance", self.tolerance)
        check_count("returns", self.returns, 1, MOST)

    def outputs(self, mechanism: Mechanism) -> Table:
        """``n``, ``p``, ``q``: (...) with one contact, p and q (..., contact) with several."""
        count = len(mechanism.contacts)
        more = ((CONTACT,), (count,)) if count > 1 else ((), ())
        text = "until the motion repeats itself"
        return {"n": whole("symbol", f"forcing periods {text}", 0, "int16")} | {
            name: whole("symbol", f"impacts at stop {stop} {text}", 1 + i * count, "int16", *more)
            for i, (name, stop) in enumerate(zip("pq", "AB", strict=True))
        }


@dataclass(frozen=True)
class Impacts:
    """Impacts at stops A and B of all contacts per forcing period, without forcing per time."""

    name: ClassVar[str] = "impacts"

    def outputs(self, mechanism: Mechanism) -> Table:
        """``impacts_a``, ``impacts_b``."""
        texts = {f"impacts_{stop.lower()}": f"impacts at stops {stop}" for stop in "AB"}
        per = "forcing period" if mechanism.forces else "unit of time"
        return reals("impacts", texts, f"per {per}")


@dataclass(frozen=True)
class Speeds:
    """Impact speeds, the rates at which gaps close; completed chatter has none."""

    name: ClassVar[str] = "speeds"

    def outputs(self, mechanism: Mechanism) -> Table:  # noqa: ARG002
        """``speed_mean``, ``speed_rms``, ``speed_smallest``, ``speed_largest``."""
        kinds = {"mean": "mean", "rms": "root mean square", "smallest": "smallest"}
        kinds |= {"largest": "largest"}
        texts = {f"speed_{k}": f"{text} impact speed" for k, text in kinds.items()}
        return reals("speeds", texts, quantity="velocity")


@dataclass(frozen=True)
class Power:
    """Energy lost in impacts per unit of time."""

    name: ClassVar[str] = "power"

    def outputs(self, mechanism: Mechanism) -> Table:  # noqa: ARG002
        """``power``."""
        text = "energy lost in impacts per unit of time"
        return reals("power", {"power": text}, quantity="power")


@dataclass(frozen=True, kw_only=True)
class Extremes:
    """Smallest and largest value of a coordinate over the observed time, flights included.

    Parameters
    ----------
    row
        The coordinate is row . x, shape (n,); without a row, each coordinate of the mechanism.
    label
        Names the variables: ``<label>_smallest``, ``<label>_largest``.
    """

    name: ClassVar[str] = "extremes"
    row: tuple[float, ...] = ()
    label: str = "x"

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", _row(self.row, self.label))

    def outputs(self, mechanism: Mechanism) -> Table:
        """Two variables; with dim ``coordinate`` without a row."""
        return _watched(self, {"smallest": "smallest", "largest": "largest"}, mechanism)


@dataclass(frozen=True, kw_only=True)
class Rms:
    """Mean and root mean square of a coordinate over the observed time, flights included.

    Parameters
    ----------
    row, label
        As in :class:`Extremes`; the variables are ``<label>_mean``, ``<label>_rms``.
    """

    name: ClassVar[str] = "rms"
    row: tuple[float, ...] = ()
    label: str = "x"

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", _row(self.row, self.label))

    def outputs(self, mechanism: Mechanism) -> Table:
        """Two variables; with dim ``coordinate`` without a row."""
        return _watched(self, {"mean": "mean", "rms": "root mean square"}, mechanism)


def _row(row: Sequence[float], label: Any) -> tuple[float, ...]:
    check_label(label)
    numbers = vector("row", row)
    if numbers and not any(numbers):
        raise InvalidParameterError("row = 0: must involve a coordinate.")
    if not numbers and label != "x":
        raise InvalidParameterError(f"label = {label!r}: give the row that it names.")
    return numbers


def _watched(observer: Extremes | Rms, kinds: dict[str, str], mechanism: Mechanism) -> Table:
    n, row, label = mechanism.degrees, observer.row, observer.label
    if row and len(row) != n:
        raise InvalidParameterError(f"row has shape ({len(row)},); expected ({n},).")
    table = "extremes" if isinstance(observer, Extremes) else "averages"
    dims, shape = ((), ()) if row else ((COORDINATE,), (n,))
    what, columns = (f"{label} = {row} . x", 2) if row else ("coordinates", 2 * n)
    return {
        f"{label}_{kind}": real(
            table, f"{text} of {what}", slice(i, columns, 2),
            dims=dims, shape=shape, quantity="length",
        )
        for i, (kind, text) in enumerate(kinds.items())
    }  # fmt: skip


@dataclass(frozen=True)
class Lyapunov:
    """Largest Lyapunov exponent per unit of time, the direction of the flow (exponent 0) left out.

    NaN without two events in the window; -inf where the tangent vector vanished, as at rest.
    """

    name: ClassVar[str] = "lyapunov"

    def outputs(self, mechanism: Mechanism) -> Table:  # noqa: ARG002
        """``lyapunov``."""
        text = "largest Lyapunov exponent per unit of time"
        return reals("lyapunov", {"lyapunov": text}, quantity="rate")


@dataclass(frozen=True)
class Spectrum:
    """All Lyapunov exponents per unit of time, as :class:`Lyapunov`.

    In the order of the tangent vectors: the longer the window, the surer the largest is first.
    """

    name: ClassVar[str] = "spectrum"

    def outputs(self, mechanism: Mechanism) -> Table:
        """``spectrum`` with dim ``exponent``: 2 n + (lines) - 1."""
        count = 2 * mechanism.degrees + len(mechanism.forces) - 1
        text = "Lyapunov exponents per unit of time"
        found = real("spectrum", text, dims=(EXPONENT,), shape=(count,), quantity="rate")
        return {"spectrum": found}


@dataclass(frozen=True)
class Shares:
    """Share of time at rest on a stop, completed chatter sequences, grazes."""

    name: ClassVar[str] = "shares"

    def outputs(self, mechanism: Mechanism) -> Table:  # noqa: ARG002
        """``share_at_rest``, ``chatters``, ``grazes``."""
        return {
            **reals("shares", {"share_at_rest": "share of time at rest on a stop"}),
            "chatters": whole("counts", "completed chatter sequences", 0, "int32"),
            "grazes": whole("counts", "grazing contacts", 1, "int32"),
        }


@dataclass(frozen=True, kw_only=True)
class Rotation:
    """Rotation number: turns about a centre from one section point to the next, in [0, 1/2].

    Parameters
    ----------
    stride
        Every stride-th impact at the stop is a section point, 1 to 10^6.
    contact, stop
        As in :func:`~vibroimpact.impact_section`.
    tolerance
        Where the impact speeds of three points in a row differ by at most this share of the largest
        of them, the motion is at a fixed point, which does not turn; in (0, 1).
    label
        Of another rotation number, as in :class:`Section`: ``rotation_<label>``.

    Notes
    -----
    That of :attr:`Attractor.rotation` where the points lie on one closed curve of one turn; rho and
    1 - rho are the same. The fraction p/q where they repeat themselves: 1/2 after a period
    doubling. Points at k impacts per turn, or on k curves in turn, have the fraction of their
    order; stride k looks at one of them.

    The weighted average converges faster than any power of the number of points (some 10^-4 for
    100, 10^-9 for 2000 in smooth motion); ``rotation_error``, an estimate, is its larger change to
    that of either half of the window: large in weak chaos and near locking. A motion that has not
    settled turns by the angle of its multiplier.

    NaN: at a fixed point ("symbol" says so), without impacts, with fewer than 8 turns in a half of
    the window, and where turns are so uneven that they cannot be counted, as in strong chaos.

    References
    ----------
    das2017, hopf1935
    """

    name: ClassVar[str] = "rotation"
    stride: int = 1
    contact: int = 0
    stop: StopName = "A"
    tolerance: float = 1e-6
    label: str = ""

    def __post_init__(self) -> None:
        _check_section(self)
        share("tolerance", self.tolerance)

    def outputs(self, mechanism: Mechanism) -> Table:
        """``rotation``, ``rotation_error``."""
        check_stop(mechanism, self.contact, self.stop)
        name, where = labelled(self.name, self.label), f"stop {self.stop} of contact {self.contact}"
        texts = {
            name: f"rotation number per section point at {where}",
            f"{name}_error": "change of the rotation number between parts of the window",
        }
        return reals("rotation", texts)


def _check_own_label(label: Any) -> None:
    """Refuse a label that is neither empty nor a name."""
    if not isinstance(label, str) or label:
        check_label(label)


def _check_section(observer: Section | Rotation) -> None:
    _check_own_label(observer.label)
    check_count("stride", observer.stride, 1, MOST)
    check_count("contact", observer.contact, 0)
    check_stop_name(observer.stop)


@dataclass(frozen=True, kw_only=True)
class Settling:
    """Time from which on a motion stays within a tolerance of its periodic orbit.

    The motion is run twice. NaN where it is not periodic, as :class:`Symbol` says with these
    options.

    Parameters
    ----------
    tolerance, returns
        As in :class:`Symbol`.
    longest
        Most impacts of the orbit, 1 to 10^6.
    """

    name: ClassVar[str] = "settling"
    tolerance: float = 1e-6
    returns: int = 2
    longest: int = 64

    def __post_init__(self) -> None:
        share("tolerance", self.tolerance)
        check_count("returns", self.returns, 1, MOST)
        check_count("longest", self.longest, 1, MOST)

    def outputs(self, mechanism: Mechanism) -> Table:  # noqa: ARG002
        """``settling``."""
        text = "time until the motion stays on its orbit"
        return reals("settling", {"settling": text}, quantity="time")


@dataclass(frozen=True)
class Final:
    """Position, velocity and phase at the end of the run."""

    name: ClassVar[str] = "final"

    def outputs(self, mechanism: Mechanism) -> Table:
        """``final_position``, ``final_velocity`` (..., coordinate), ``final_phase``."""
        dims, shape = (COORDINATE,), (mechanism.degrees,)

        def of(kind: str) -> Output:
            name, text = f"final_{kind}", f"{kind} at the end"
            return real(name, text, dims=dims, shape=shape, quantity=MEASURED[kind])

        table = {f"final_{kind}": of(kind) for kind in ("position", "velocity")}
        return table | {"final_phase": real("final_phase", "phase at the end", units="rad")}
