"""Mechanisms: masses, dashpots, springs, forces and stops.

A mechanism is

    M x'' + C x' + K x = f0 + sum over lines of (sine sin(omega t) + cosine cos(omega t))

with contacts ``lower <= row . x <= upper``, each an impact pair with its own restitution
(theory.md, "Model"). :mod:`vibroimpact.compile.hybrid` compiles it for the kernel.
"""

from __future__ import annotations

import math
from collections.abc import Sized
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact._core import linear
from vibroimpact._core.checks import (
    fraction,
    names_arguments,
    numbers,
    positive,
    real_or_infinite,
    refusal,
    vector,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact._kernel import MAX_CONTACTS, MAX_DEGREES, MAX_LINES

HARMONIC_ONLY = "A force is a sum of harmonic lines: one Harmonic each."
NUMBER_OR_NONE = "a finite number, or left out where there is no stop"
STANDS_STILL = "Stops stand still: take a coordinate relative to a stop that moves."
FRICTIONLESS = "Contacts have no friction."
RIGID = "Stops are rigid, with a coefficient of restitution. Soft stops are not supported."


def infinite(value: Any) -> bool:
    """Whether a limit is infinite: there is no stop."""
    return is_infinite(value)


@names_arguments(
    amplitude="Give sine and cosine, a number for each coordinate.",
    phase="A sin(omega t + phi) is sine = A cos(phi), cosine = A sin(phi).",
)
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
        object.__setattr__(self, "sine", vector("sine", self.sine, None, HARMONIC_ONLY))
        cosine = (0.0,) * len(self.sine) if _empty(self.cosine) else self.cosine
        object.__setattr__(self, "cosine", vector("cosine", cosine, len(self.sine), HARMONIC_ONLY))


@names_arguments(
    friction=FRICTIONLESS, mu=FRICTIONLESS, stiffness=RIGID, damping=RIGID, velocity=STANDS_STILL,
    motion=STANDS_STILL, amplitude=STANDS_STILL, omega=STANDS_STILL,
)  # fmt: skip
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
            value = real_or_infinite(name, getattr(self, name), NUMBER_OR_NONE, STANDS_STILL)
            object.__setattr__(self, name, value)
        if not self.lower < self.upper or (infinite(self.lower) and infinite(self.upper)):
            raise InvalidParameterError(
                f"lower = {self.lower}, upper = {self.upper}: need lower < upper, one finite."
            )
        pair = self.restitution
        both = pair if isinstance(pair, tuple | list) else (pair, pair)
        if len(both) != 2:
            raise refusal("restitution", pair, "one number, or (lower, upper)")
        object.__setattr__(self, "restitution", tuple(fraction("restitution", r) for r in both))

    @property
    def restitutions(self) -> tuple[float, float]:
        """Restitution at the lower and at the upper stop."""
        r = self.restitution
        return r if isinstance(r, tuple) else (r, r)


def _square(name: str, value: ArrayLike, n: int | None = None) -> linear.Matrix:
    """Return a symmetric matrix of finite floats as rows, or raise naming the matrix."""
    array = numbers(name, value, "a square matrix of numbers")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or (n and array.shape[0] != n):
        wanted = "(n, n)" if n is None else f"({n}, {n})"
        raise InvalidParameterError(f"{name} has shape {array.shape}; expected {wanted}.")
    rows = array.tolist()
    skew = linear.plus(rows, linear.transpose(rows), -1.0)
    if linear.largest(skew) > 1e-12 * linear.largest(rows):
        raise InvalidParameterError(f"{name}: must be symmetric.")
    return [[x / 2.0 for x in row] for row in linear.plus(rows, linear.transpose(rows))]


@names_arguments(
    friction=FRICTIONLESS, M="Give mass.", C="Give damping.", K="Give stiffness.",
    force="Give forces, a Harmonic each, or constant_force.",
)  # fmt: skip
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
        constant = (0.0,) * n if _empty(self.constant_force) else self.constant_force
        object.__setattr__(self, "constant_force", vector("constant_force", constant, n))
        contacts = _several("contacts", self.contacts, Contact, 1, MAX_CONTACTS)
        object.__setattr__(self, "contacts", contacts)
        object.__setattr__(self, "forces", _several("forces", self.forces, Harmonic, 0, MAX_LINES))
        names = _several("contact_names", self.contact_names, str, 0, len(contacts))
        object.__setattr__(self, "contact_names", names)
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


def _empty(value: object) -> bool:
    return isinstance(value, Sized) and not len(value)


def _several(name: str, items: Any, kind: type, low: int, high: int) -> tuple[Any, ...]:
    """Return a sequence as a tuple, or raise naming it."""
    allowed = f"{low} to {high} of {kind.__name__} in a tuple or list"
    if not isinstance(items, list | tuple):
        raise refusal(name, items, allowed)
    for i, item in enumerate(items):
        if not isinstance(item, kind):
            raise refusal(f"{name}[{i}]", item, f"a {kind.__name__}")
    if not low <= len(items) <= high:
        raise InvalidParameterError(f"{name}: {len(items)} are given; must be {allowed}.")
    return tuple(items)


def as_array(rows: linear.Matrix) -> NDArray[np.float64]:
    """Rows as an array."""
    return np.array(rows, dtype=float)
