"""Mechanisms: masses, dashpots, springs, forces and stops.

A mechanism is

    M x'' + C x' + K x = f0 + sum over lines of (sine sin(omega t) + cosine cos(omega t))

with contacts ``lower <= row . x <= upper``, each an impact pair with its own restitution
(theory.md, "Model"). :mod:`vibroimpact.hybrid` compiles it for the kernel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact import linear
from vibroimpact.errors import InvalidParameterError
from vibroimpact.scalars import is_finite, is_infinite, is_number

MAX_DEGREES, MAX_CONTACTS, MAX_LINES = 10, 8, 6


def real(name: str, value: Any, allowed: str = "a finite number") -> float:
    """Return value as a float, or raise naming the parameter.

    A jet or a column is a number too, and stays one (scalars.py).
    """
    if is_number(value) and is_finite(value):
        return cast(float, value)
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise InvalidParameterError(f"{name} = {value!r}: must be {allowed}.")
    return number


def infinite(value: Any) -> bool:
    """Whether a limit stands for no stop."""
    return is_infinite(value)


def positive(name: str, value: Any, advice: str = "") -> float:
    """Return value as a float > 0, or raise naming the parameter."""
    number = real(name, value, "a finite number > 0")
    if number <= 0.0:
        raise InvalidParameterError(f"{name} = {value!r}: must be > 0.{advice and ' ' + advice}")
    return number


def nonnegative(name: str, value: Any, advice: str = "") -> float:
    """Return value as a float >= 0, or raise naming the parameter."""
    number = real(name, value, "a finite number >= 0")
    if number < 0.0:
        raise InvalidParameterError(f"{name} = {value!r}: must be >= 0.{advice and ' ' + advice}")
    return number


def fraction(name: str, value: Any) -> float:
    """Return a coefficient of restitution, or raise naming the parameter."""
    number = real(name, value, "in [0, 1]")
    if not 0.0 <= number <= 1.0:
        raise InvalidParameterError(
            f"{name} = {value!r}: must be in [0, 1] (0 plastic, 1 elastic). "
            "An impact cannot add energy."
        )
    return number


def check_count(name: str, value: object, least: int, most: int | None = None) -> None:
    """Refuse a count that is no integer, too small or too large."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InvalidParameterError(f"{name} = {value!r}: must be an integer >= {least}.")
    if most is not None and value > most:
        raise InvalidParameterError(f"{name} = {value!r}: must be at most {most}.")


def vector(name: str, value: ArrayLike, size: int | None = None) -> tuple[float, ...]:
    """Return value as a tuple of finite floats, or raise naming shape or entry."""
    array = _numbers(f"{name} = {value!r}", value, "numbers")
    if array.ndim != 1 or (size is not None and array.size != size):
        wanted = "(n,)" if size is None else f"({size},)"
        raise InvalidParameterError(f"{name} has shape {array.shape}; expected {wanted}.")
    return tuple(array.tolist())


def _numbers(label: str, value: ArrayLike, kind: str) -> NDArray[Any]:
    """Value as an array of floats or other numbers."""
    try:
        array = np.asarray(value)
        if any(is_number(x) for x in array.flat):
            floats = [x if is_number(x) else float(x) for x in array.flat]
            array = np.array(floats, dtype=object).reshape(array.shape)
        else:
            array = array.astype(float)
    except (TypeError, ValueError):
        raise InvalidParameterError(f"{label}: must be {kind}.") from None
    if not all(is_finite(x) for x in array.flat):
        raise InvalidParameterError(f"{label}: every entry must be finite.")
    return array


@dataclass(frozen=True, slots=True)
class Harmonic:
    """A forcing line: ``sine sin(omega t) + cosine cos(omega t)`` on the coordinates.

    Parameters
    ----------
    omega
        Angular frequency, > 0.
    sine, cosine
        Force amplitudes, one per coordinate, shape (n,). ``cosine`` defaults to zero.
    """

    omega: float
    sine: tuple[float, ...]
    cosine: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "omega", positive("omega", self.omega, "For a constant force use constant_force.")
        )
        object.__setattr__(self, "sine", vector("sine", self.sine))
        cosine = self.cosine if len(self.cosine) else (0.0,) * len(self.sine)
        object.__setattr__(self, "cosine", vector("cosine", cosine, len(self.sine)))


@dataclass(frozen=True, slots=True)
class Contact:
    """A two-sided or one-sided clearance: ``lower <= row . x <= upper``.

    Parameters
    ----------
    row
        Contact coordinate u = row . x, shape (n,), not all zero.
    lower, upper
        Stops; at least one finite, lower < upper.
    restitution
        Coefficient of restitution in [0, 1], or a pair (at lower, at upper).
    """

    row: tuple[float, ...]
    lower: float = -math.inf
    upper: float = math.inf
    restitution: float | tuple[float, float] = 1.0

    def __post_init__(self) -> None:
        row = vector("row", self.row)
        if not any(row):
            raise InvalidParameterError("row = 0: a contact must involve a coordinate.")
        object.__setattr__(self, "row", row)
        for name in ("lower", "upper"):
            value = getattr(self, name)
            if not infinite(value):
                object.__setattr__(self, name, real(name, value))
        if not self.lower < self.upper or (infinite(self.lower) and infinite(self.upper)):
            raise InvalidParameterError(
                f"lower = {self.lower}, upper = {self.upper}: need lower < upper, one finite."
            )
        pair = self.restitution
        both = pair if isinstance(pair, tuple) else (pair, pair)
        if len(both) != 2:
            raise InvalidParameterError(f"restitution = {pair}: one number, or (lower, upper).")
        object.__setattr__(self, "restitution", tuple(fraction("restitution", r) for r in both))

    @property
    def restitutions(self) -> tuple[float, float]:
        """Restitution at the lower and at the upper stop."""
        r = self.restitution
        return r if isinstance(r, tuple) else (r, r)


def _square(name: str, value: ArrayLike, n: int | None = None) -> linear.Matrix:
    """Return a symmetric matrix of finite floats as rows, or raise naming the matrix."""
    array = _numbers(name, value, "a square matrix of numbers")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or (n and array.shape[0] != n):
        wanted = "(n, n)" if n is None else f"({n}, {n})"
        raise InvalidParameterError(f"{name} has shape {array.shape}; expected {wanted}.")
    rows = array.tolist()
    skew = linear.plus(rows, linear.transpose(rows), -1.0)
    if linear.largest(skew) > 1e-12 * linear.largest(rows):
        raise InvalidParameterError(f"{name}: must be symmetric.")
    return [[x / 2.0 for x in row] for row in linear.plus(rows, linear.transpose(rows))]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanism:
    """Masses, dashpots, springs, forces and stops.

    Parameters
    ----------
    mass, damping, stiffness
        M (positive definite), C and K, symmetric, shape (n, n), 1 <= n <= 10. K may be singular:
        free masses are ordinary. Damping need not be proportional.
    forces
        Harmonic lines, at most 6.
    contacts
        Impact pairs, at most 8.
    constant_force
        f0, shape (n,): gravity, preload.

    Raises
    ------
    InvalidParameterError
        Wrong shapes, non-finite entries, M not positive definite, restitution outside [0, 1].
    """

    mass: linear.Matrix
    damping: linear.Matrix
    stiffness: linear.Matrix
    contacts: tuple[Contact, ...]
    forces: tuple[Harmonic, ...] = ()
    constant_force: tuple[float, ...] = ()
    contact_names: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        mass = _square("mass", self.mass)
        n = len(mass)
        if not 1 <= n <= MAX_DEGREES:
            raise InvalidParameterError(f"mass has {n} coordinates: must be 1 to {MAX_DEGREES}.")
        if linear.cholesky(mass) is None:
            raise InvalidParameterError(
                "mass: must be positive definite. Remove massless coordinates, and negative masses."
            )
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "damping", _square("damping", self.damping, n))
        object.__setattr__(self, "stiffness", _square("stiffness", self.stiffness, n))
        constant = self.constant_force if len(self.constant_force) else (0.0,) * n
        object.__setattr__(self, "constant_force", vector("constant_force", constant, n))
        contacts = _several("contacts", self.contacts, Contact, 1, MAX_CONTACTS)
        object.__setattr__(self, "contacts", contacts)
        object.__setattr__(self, "forces", _several("forces", self.forces, Harmonic, 0, MAX_LINES))
        for contact in self.contacts:
            vector("row", contact.row, n)
        for force in self.forces:
            vector("sine", force.sine, n)

    def __hash__(self) -> int:
        """Hash the numbers: the rows of the matrices are lists, which have no hash."""
        matrices = (self.mass, self.damping, self.stiffness)
        rows = tuple(tuple(map(tuple, matrix)) for matrix in matrices)
        return hash((rows, self.contacts, self.forces, self.constant_force))

    @property
    def degrees(self) -> int:
        """Number of coordinates n."""
        return len(self.mass)

    @property
    def omega(self) -> float:
        """Angular frequency of the first forcing line, 0 where there is none."""
        return self.forces[0].omega if self.forces else 0.0


def stop_sizes(m: Mechanism) -> list[float]:
    """|limit| of every stop: lengths of the mechanism."""
    return [abs(x) for c in m.contacts for x in (c.lower, c.upper) if not infinite(x)]


def _several(name: str, items: Any, kind: type, low: int, high: int) -> tuple[Any, ...]:
    """Return a sequence as a tuple, or raise naming it."""
    listed = isinstance(items, Sequence) and low <= len(items) <= high
    if not listed or not all(isinstance(item, kind) for item in items):
        raise InvalidParameterError(
            f"{name}: must be {low} to {high} of {kind.__name__} in a tuple or list, not {items!r}."
        )
    return tuple(items)


def as_array(rows: linear.Matrix) -> NDArray[np.float64]:
    """Rows as an array."""
    return np.array(rows, dtype=float)
