"""Fixed points of a map given by a formula, over its two parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.equations import Pair
from vibroimpact.normal_forms.explicit import ExplicitMap, FixedPoint, MapForms
from vibroimpact.orbits.problem import latest


@dataclass
class MapPlane:
    """Fixed points of an :class:`ExplicitMap` over its two parameters: ``Equations`` of bifurcations."""

    map: ExplicitMap

    def __post_init__(self) -> None:
        first, second = self.map.parameters
        self.names = (first, second)
        self.sizes = np.array(self.map.sizes[: self.map.dimension])
        self.rows = self.sizes
        self.closing = np.eye(self.map.dimension)
        self._linearised: dict[tuple[bytes, Pair], tuple[Floats, Floats]] = {}

    def residual(self, z: Floats, a: Pair) -> Floats:
        """F(z, a) - z."""
        return self.map.residual(z, a)

    def by_both(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        """Derivatives by z, shape (d, d), and by both parameters, shape (d, 2)."""
        by_x, by_a = self.linearised(z, a)
        return by_x - self.closing, by_a

    def linearised(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        """Derivatives of the map itself; the latest ones are kept."""
        key = z.tobytes(), a
        return latest(self._linearised, key, lambda _: self.map.linearised(z, a))

    def by_first(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        """Derivatives by z, shape (d, d), and by the first parameter, shape (d,)."""
        by_z, by_a = self.by_both(z, a)
        return by_z, by_a[:, 0]

    def second(self, z: Floats, a: Pair, v: Floats) -> Floats:
        """Derivatives of F_z v by z and by both parameters, shape (r, d, d + 2), for r directions v in rows."""
        units = np.eye(len(z) + 2)
        columns = [[self.map.derivative(z, a, one, unit) for unit in units] for one in v]
        return np.array(columns).transpose(0, 2, 1)

    def multipliers(self, z: Floats, a: Pair) -> Complexes:
        """Multipliers, largest modulus first."""
        by_x = self.linearised(z, a)[0]
        if not np.all(np.isfinite(by_x)):
            return np.full(len(z), complex(np.nan, np.nan))
        values = np.linalg.eigvals(by_x).astype(np.complex128)
        return values[np.argsort(-np.abs(values), kind="stable")]

    def weight(self, _z: Floats, _a: Pair, /) -> float:
        """Return one: no multiplier is infinite."""
        return 1.0

    def forms(self, z: Floats, a: Pair) -> MapForms:
        """Multilinear forms at the fixed point."""
        return self.map.forms(z, a)

    def on_section(self, v: Complexes) -> Complexes:
        """The change itself."""
        return v

    def repeated(self, times: int) -> MapPlane:
        """Fixed points of an iterate of the map."""
        return MapPlane(replace(self.map, iterate=self.map.iterate * times))

    def unrolled(self, z: Floats, changes: Floats) -> Floats:
        """The first point: later ones are no unknowns."""
        first: Floats = z + changes[0]
        return first

    def touches(self, _z: Floats, _a: Sequence[Pair], /) -> Mapping[str, Floats]:
        """Return nothing: a map has no stops that an orbit could touch."""
        return {}

    def solution(self, z: Floats, a: Pair) -> FixedPoint:
        """Fixed point."""
        return self.map.point(z, a)
