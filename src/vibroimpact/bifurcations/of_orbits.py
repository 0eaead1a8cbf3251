"""Periodic orbits with one signature over two parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Complexes, Floats
from vibroimpact.bifurcations.equations import Pair
from vibroimpact.branches.family import OrbitFamily
from vibroimpact.compile.along import Along
from vibroimpact.compile.prescribed import NONE_LEFT_OUT, Prescribed
from vibroimpact.model.parameters import parameter_value
from vibroimpact.model.system import System
from vibroimpact.normal_forms.kind import PointKinds
from vibroimpact.orbits.find import later
from vibroimpact.orbits.newton import scale_of
from vibroimpact.orbits.orbit import Orbit
from vibroimpact.orbits.problem import OrbitProblem, Signature, Value, latest
from vibroimpact.orbits.simultaneous import staying_at_once


class OrbitPlane(OrbitFamily):
    """Orbits with one signature over a plane of two parameters: ``Equations`` of bifurcations.

    Parameters
    ----------
    system, signature
        As for :class:`~vibroimpact.orbits.problem.OrbitProblem`.
    names
        Names of the two parameters; values of the parameter are pairs here.
    sizes
        Sizes of the changes of the unknowns.
    events
        As for :class:`~vibroimpact.branches.family.OrbitFamily`.
    """

    def __init__(
        self,
        system: System,
        signature: Signature,
        names: tuple[str, str],
        sizes: Floats,
        events: PointKinds,
    ) -> None:
        super().__init__(system, signature, names[0], np.append(sizes, 1.0), events)
        self.names = names
        self.along = Along(system, names, self.codes)
        self.sizes = sizes
        self.closing = self._closing()
        self._by_second: dict[Value, Prescribed] = {}
        self._derivatives: dict[tuple[bytes, Value], tuple[Floats, Floats]] = {}

    @classmethod
    def around_orbit(
        cls, orbit: Orbit, names: tuple[str, str], spans: tuple[float, float], events: PointKinds
    ) -> OrbitPlane:
        """Plane through an orbit, which gives the sizes, over ranges of these lengths."""
        z = orbit.problem.packed(orbit.states, orbit.durations)
        sizes = scale_of(OrbitProblem(orbit.system, orbit.signature, ""), z)
        plane = cls(orbit.system, orbit.signature, names, sizes, events)
        here = parameter_value(orbit.system, names[0]), parameter_value(orbit.system, names[1])
        plane.at_once = staying_at_once(plane, z, lambda: plane.by_both(z, here), spans)
        return plane

    def _closing(self) -> Floats:
        m, q = len(self.impacts), self.size
        marks = np.zeros((m, q + 1, m, q + 1))
        marks[-1, :q, 0, :q] = self.relative @ self.reflected(np.eye(q))
        marks[-1, self.held.entries] = 0.0
        return marks.reshape(m * (q + 1), m * (q + 1))

    def forget(self) -> None:
        """Release the evaluations that are kept."""
        super().forget()
        self._by_second.clear()
        self._derivatives.clear()

    def by_second(self, a: Pair) -> Prescribed:
        """System compiled for derivatives by the second parameter; the latest ones are kept."""
        return latest(self._by_second, a, lambda _: self.along.at(a, 1))

    def by_both(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        """F_z, shape (d, d), and the derivatives by both parameters, shape (d, 2); kept."""
        key = z.tobytes(), a
        return latest(self._derivatives, key, lambda _: self._by_both(z, a))

    def _by_both(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        try:
            by_z, first = OrbitProblem.jacobian(self, z, a)
            parts = self.by_second(a).linearise(*self.unpacked(z), self.ends)
        except InvalidParameterError:
            return np.full((len(z), len(z)), np.nan), np.full((len(z), 2), np.nan)
        moved = parts.after_by[:, self.kept, -1]
        if self.pivots:
            moved[-1] = self.relative @ moved[-1]
        if self.held.entries:
            moved[-1, self.held.entries] = self.keeping(z, self.by_second(a)).rows[:, -1]
        second = np.column_stack([moved, parts.gap_by[:, -1]])
        return by_z, np.column_stack([first, second.ravel()])

    def by_first(self, z: Floats, a: Pair) -> tuple[Floats, Floats]:
        """F_z, shape (d, d), and the derivative by the first parameter, shape (d,)."""
        return self.jacobian(z, a)

    def second(self, z: Floats, a: Pair, v: Floats) -> Floats:
        """Derivatives of F_z v by z and by both parameters, shape (r, d, d + 2), for r directions v in rows."""
        m, q, n, r = len(self.impacts), self.size, 2 * self.degrees + 1, len(v)
        states, durations = self.unpacked(z)
        rows = v.reshape(r, m, q + 1).transpose(1, 0, 2)
        # those of one segment side by side, as its flight is the same
        along = np.zeros((m, r, n + 1))
        along[:, :, self.kept], along[:, :, -1] = rows[:, :, :-1], rows[:, :, -1]
        segments = (
            states.repeat(r, axis=0),
            durations.repeat(r),
            [end for end in self.ends for _ in v],
        )
        after, gap = self.compiled(a).second(*segments, along.reshape(m * r, -1))
        other, other_gap = self.by_second(a).second(
            *segments, along.reshape(m * r, -1), by_parameter=True
        )
        columns = [*self.kept, n, n + 1]
        # of state and gap, by the own unknowns and both parameters
        both = np.empty((m, r, q + 1, q + 3))
        both[:, :, :q, :-1] = after.reshape(m, r, n, n + 2)[:, :, self.kept][..., columns]
        both[:, :, q, :-1] = gap.reshape(m, r, n + 2)[..., columns]
        both[:, :, :q, -1] = other.reshape(m, r, n)[:, :, self.kept]
        both[:, :, q, -1] = other_gap.reshape(m, r)
        if self.pivots:
            both[-1, :, :q] = self.relative @ both[-1, :, :q]
        whole = np.zeros((r, m, q + 1, m * (q + 1) + 2))
        for k, part in enumerate(both):
            whole[:, k, :, k * (q + 1) : (k + 1) * (q + 1)] = part[..., :-2]
            whole[:, k, :, -2:] = part[..., -2:]
        if self.held.entries:
            whole[:, -1, self.held.entries] = 0.0
            for last, moved in zip(whole[:, -1], along[0, :, :-1], strict=True):
                self._bend(last, states[:1], moved, a)
        return whole.reshape(r, m * (q + 1), -1)

    def _bend(self, last: Floats, state: Floats, moved: Floats, a: Pair) -> None:
        """Add the second derivatives of what is held to those of the last equations, shape (q + 1, d + 2)."""
        ends, _, entries = self.held
        count, q = len(ends), self.size
        here, times = np.repeat(state, count, axis=0), np.zeros(count)
        along = np.repeat(np.append(moved, 0.0)[None], count, axis=0)
        by_each = self.compiled(a).second(here, times, ends, along)[1]
        by_other = self.by_second(a).second(here, times, ends, along, by_parameter=True)[1]
        rows = entries[:count]
        last[rows, :q] = by_each[:, self.kept]
        last[rows, -2], last[rows, -1] = by_each[:, -1], by_other[:, -1]

    def followed(self, p: Value) -> dict[str, Any]:
        """Values of both parameters, by name."""
        assert isinstance(p, tuple)
        return dict(zip(self.names, p, strict=True))

    def on_section(self, v: Complexes) -> Complexes:
        """Change of the first state, without what the section, a drift and what is held leave out."""
        without = (self.left_out(self.own), *self.pivots, *self.held.entries)
        left_out = [j for j in without if j != NONE_LEFT_OUT]
        return np.delete(v[: self.size], left_out)

    def repeated(self, times: int) -> OrbitPlane:
        """Orbits that close after so many iterates of the solved map; even ones lose the symmetry."""
        own = self.signature
        symmetric = own.symmetric and times % 2 == 1
        turns = times // 2 if own.symmetric and not symmetric else times
        signature = replace(own.repeated(turns), symmetric=symmetric)
        plane = OrbitPlane(
            self.system, signature, self.names, np.tile(self.sizes, times), self.events
        )
        count = len(self.impacts)
        plane.at_once = frozenset(k + i * count for k in self.at_once for i in range(times))
        return plane

    def unrolled(self, z: Floats, changes: Floats) -> Floats:
        """Unknowns of :meth:`repeated` from z and the change of each iterate, shape (times, d)."""
        symmetric, turn = self.signature.symmetric, float(self.turn[-1]) if self.turn.any() else 0.0
        states, durations = [], []
        for j, change in enumerate(changes):
            here, times = self.unpacked(z + change)
            back = symmetric and j % 2 == 1
            image = self.symmetry.image if back and self.symmetry else later
            states.append(image(here, j * turn))
            durations.append(times)
        return self.packed(np.vstack(states), np.concatenate(durations))

    def solution(self, z: Floats, a: Pair) -> Orbit:
        """Orbit at a point of the plane."""
        return self.orbit(z, a)
