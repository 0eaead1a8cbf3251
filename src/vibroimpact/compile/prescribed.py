"""A system compiled for motions with prescribed impacts, with derivatives by one parameter.

States are zeta = (x, v, theta), theta the phase of the first forcing line. Where the order of
impacts is known, each flight and the impact at its end is an analytic function of zeta, the flight
time and the parameters (theory.md, "Periodic orbits"); the kernel evaluates it and its derivatives.
Physical coordinates, whose entries are smooth in every parameter, serve for all systems.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact import _kernel
from vibroimpact._core import linear
from vibroimpact._core.chebyshev import nodes
from vibroimpact._core.checks import shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.linear import Vector, apply, transpose
from vibroimpact._core.types import Floats
from vibroimpact._kernel import Jet
from vibroimpact.compile.coordinates import STEP_ANGLE, dense, dense_rate
from vibroimpact.compile.reduction import reduce
from vibroimpact.model.mechanism import Mechanism, infinite, needs_elements
from vibroimpact.model.parameters import expanded
from vibroimpact.model.stop import Stop
from vibroimpact.model.system import System, mechanism_of

COASTING = -1  # ends a segment without an impact
PARAMETER_ORDERS = (0, 1, 3, 7)  # f, f', f'', f''' among the coefficients of a jet
PROPORTIONAL = 1e-12  # rounding of derivatives of frequencies that have a constant ratio
WINDOW = 6.0  # radians of the fastest rate
NODES = 25  # Chebyshev: the series of a flight over a window has fallen below 2^-53 then


class Linearised(NamedTuple):
    """Segments and their derivatives by the state (2n + 1), the flight time and the parameter."""

    before: Floats  # (m, 2n + 1)
    after: Floats
    gap: Floats  # (m,) row . x - limit at the end
    rate: Floats  # (m,) of row . x, before and after the impact
    rate_after: Floats
    after_by: Floats  # (m, 2n + 1, 2n + 3)
    gap_by: Floats  # (m, 2n + 3)


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Compiled system for segments with prescribed impacts, and their derivatives.

    Copies and pickles are compiled again.

    Attributes
    ----------
    system, mechanism, parameter
        The system; the parameter by which it is differentiated, "" for none.
    degrees, omega
        n; frequency of the first line, 0 where the system is autonomous.
    omega_orders
        omega and its derivatives by the parameter, shape (4,).
    rate
        Bounds every rate of the flight to a factor of two.
    """

    system: System
    mechanism: Mechanism
    parameter: str
    degrees: int
    omega: float
    omega_orders: Floats
    rate: float
    stops: tuple[Stop, ...]
    kernel: _kernel.Prescribed

    def __reduce__(self) -> tuple[Any, ...]:
        return compile_prescribed, (self.system, self.parameter)

    @property
    def size(self) -> int:
        """Entries of zeta, 2n + 1."""
        return 2 * self.degrees + 1

    def stop_numbers(self, impacts: list[Stop]) -> list[int]:
        """Numbers of the stops in the kernel."""
        return [self.stops.index(impact) for impact in impacts]

    def linearise(self, states: ArrayLike, durations: ArrayLike, impacts: list[Stop]) -> Linearised:
        """Each flight and the impact that ends it, with first derivatives."""
        out = self.kernel.linearise(
            _contiguous(states), _contiguous(durations), self.stop_numbers(impacts)
        )
        return Linearised(**out)

    def second(
        self, states: ArrayLike, durations: ArrayLike, impacts: list[Stop], along: Floats
    ) -> tuple[Floats, Floats]:
        """Second derivatives of each segment, once along a direction and once by every number.

        Parameters
        ----------
        states, durations, impacts
            As for :meth:`linearise`.
        along
            Directions in the state and the flight time of each segment, shape (m, 2n + 2).

        Returns
        -------
        (after_by, gap_by)
            Derivatives of those of :class:`Linearised` along the direction, of the same shapes.
        """
        numbers = self.stop_numbers(impacts)
        return self.kernel.second(
            _contiguous(states), _contiguous(durations), numbers, _contiguous(along)
        )

    def after(self, state: Floats, time: float) -> Floats:
        """(x, v, theta) after a time of free flight, shape (2n + 1,)."""
        inside = self.kernel.fly(_contiguous(state)[None, :], [1], np.array([time]), 1.0)[0, 0]
        return np.append(inside, state[-1] + self.omega * time)

    def window(self, durations: Floats) -> float:
        """Length of the windows on which flights are expanded; free masses have no fastest rate."""
        return min(WINDOW / self.rate, float(durations.max()))

    def flights(self, states: ArrayLike, durations: Floats) -> list[tuple[Floats, Floats]]:
        """Free flight at Chebyshev nodes of windows that cover each segment.

        Returns
        -------
        list of (start of each window, (windows, NODES, 2n) of x and v)
        """
        window = self.window(durations)
        counts = [max(1, math.ceil(t / window)) for t in durations]
        offsets = (1.0 + nodes(NODES)) * (window / 2.0)
        values = self.kernel.fly(_contiguous(states), counts, offsets, window)
        parts = np.split(values, np.cumsum(counts)[:-1])
        return [(np.arange(c) * window, part) for c, part in zip(counts, parts, strict=True)]

    def sampled(self, states: Floats, durations: Floats) -> Floats:
        """(x, v) at the start of each segment and at the nodes within its flight, (k, 2n)."""
        offsets = (1.0 + nodes(NODES)) * (self.window(durations) / 2.0)
        within = [
            values[starts[:, None] + offsets <= duration]
            for (starts, values), duration in zip(
                self.flights(states, durations), durations, strict=True
            )
        ]
        return np.vstack([states[:, : 2 * self.degrees], *within])


def _contiguous(a: ArrayLike) -> Floats:
    return np.ascontiguousarray(a, dtype=float)


def _orders(x: Any) -> list[float]:
    """f, f', f'', f''' of a number or a jet."""
    if isinstance(x, Jet):
        c = x.coefficients
        return [c[k] for k in PARAMETER_ORDERS]
    return [float(x), 0.0, 0.0, 0.0]


def _array(values: Vector | list[Vector]) -> Floats:
    """Array of numbers or jets, with the order of the derivative as first axis."""
    flat = np.array(values, dtype=object)
    parts = np.array([_orders(x) for x in flat.ravel()])
    return np.ascontiguousarray(parts.T).reshape(len(PARAMETER_ORDERS), *flat.shape)


def _stops(
    m: Mechanism, free: linear.Matrix, rate: float
) -> tuple[tuple[Stop, ...], list[tuple[Floats, ...]]]:
    """Every finite limit of every contact as (row, limit, impulse, restitution)."""
    names, laws = [], []
    for i, contact in enumerate(m.contacts):
        row = list(contact.row)
        lift = [x for (x,) in linear.solve_definite(m.mass, [[r] for r in row])]
        mobility = linear.dot(row, lift)
        size = len(free[0])
        impulse, on_y = [0.0] * size, apply(transpose(free), row)
        for j, x in enumerate(lift):
            impulse[2 * j + 1] = x / mobility / rate
        for side, limit, restitution in zip(
            (-1, 1), (contact.lower, contact.upper), contact.restitutions, strict=True
        ):
            if not infinite(limit):
                names.append(Stop(i, side))
                laws.append(tuple(map(_array, (on_y, [limit], impulse, [restitution]))))
    return tuple(names), laws


def compile_prescribed(system: System, parameter: str = "") -> Prescribed:
    """Compile a system; ``parameter`` names the number by which it is differentiated.

    Raises
    ------
    InvalidParameterError
        No such parameter, a system that cannot be differentiated with respect to it, or a
        parameter that changes the ratios of the forcing frequencies.
    """
    try:
        return _cached(cast(Hashable, system), parameter)
    except TypeError:  # a system that cannot be hashed
        return _compile(system, parameter)


def _check_ratios(varied: Mechanism, parameter: str) -> None:
    """Refuse a parameter that changes the ratios of the forcing frequencies."""
    for line in varied.forces[1:]:
        first, other = np.array(_orders(varied.omega)), np.array(_orders(line.omega))
        scaled = first * (other[0] / first[0])
        if np.any(np.abs(other - scaled) > PROPORTIONAL * (np.abs(other) + np.abs(scaled))):
            raise InvalidParameterError(
                f"parameter = {parameter!r}: changes the ratios of the forcing frequencies, so "
                "there is no common period. Take one that keeps them, as omega of a Mechanism does."
            )


def check_rigid(system: System) -> Mechanism:
    """The mechanism of a system, refused where motions with prescribed impacts do not cover it."""
    m = mechanism_of(system)
    if needs_elements(m):
        raise InvalidParameterError(
            f"system = {shown(system)}: orbits are found for rigid stops that stand still, with "
            "symmetric matrices. Take simulate, sections, classify, sweeps, Lyapunov exponents."
        )
    return m


def _compile(system: Any, parameter: str) -> Prescribed:
    m = check_rigid(system)
    varied = expanded(system, parameter) if parameter else m
    _check_ratios(varied, parameter)
    n, lines = m.degrees, len(m.forces)
    rate = dense_rate(m)
    whole = reduce(varied, ())
    assert whole is not None  # nothing is closed
    c = dense(varied, whole, 2 * (n + lines), rate)
    omega = _array([varied.omega])[:, 0]
    names, stops = _stops(varied, c.to_x, rate)
    ratios = [force.omega / m.omega for force in m.forces]
    kernel = _kernel.Prescribed(
        degrees=n, ratios=ratios, rate=rate, step=STEP_ANGLE / (2.0 * rate),
        field=_array(cast(Any, c.flow["b"])), constant=_array(cast(Any, c.flow["constant"])),
        omega=omega, stops=stops,
    )  # fmt: skip
    return Prescribed(system, m, parameter, n, m.omega, omega, rate, names, kernel)


_cached = lru_cache(maxsize=4096)(_compile)  # a few kilobytes each
