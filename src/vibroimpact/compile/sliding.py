"""Hybrid systems given as data in the kernel, with the modes in which they slide on a guard.

Let A be left for B where u = row . y rises to its level, and B for A where it falls to it, without resets. Where
u'_A > 0 > u'_B each undoes the other at once, and the motion stays on the surface [filippov1988],

    f = (1 - a) f_A + a f_B,   a = u'_A / (u'_A - u'_B),                                     (1)

until a leaves [0, 1]: at 0 to A, at 1 to B. This is linear where f_B - f_A = D is constant, or a. It is entered by
a projection along D, and leads back to the surface what rounding has led away,

    y <- y - D (u - level) / (row . D),   f <- f - rate D (u - level) / (row . D)            (2)

In the kernel A and B have twins that are entered on the surface alone: a mode that is entered beyond it, at the
start or by a reset, crosses it at once and does not slide there. From a twin the surface is met by sliding,
which is left at once where it cannot last; events of one instant and one surface are one event of the run. A
guard that A and B leave for modes that slide on the same surface is left for these; one that says nothing of the
combination ends the run, and so does (1) where it is not linear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from vibroimpact import _kernel
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import ROUNDING_PER_TERM, rounded_down
from vibroimpact._core.types import Floats
from vibroimpact.compile.coordinates import STEP_ANGLE
from vibroimpact.compile.modes import STEP_BITS, ElementOfKernel, Watch
from vibroimpact.compile.units import Units, balanced_norm
from vibroimpact.model.hybrid_system import MOST_GUARDS, HybridSystem, Transition, is_identity

Row = tuple[Floats, float]  # on (y, 1)

# Rates of modes are so large at least, relative to that of the mode at the start.
SLOWEST_MODE_RELATIVE = 1e-12
FASTEST_MODE_RELATIVE = 1e12  # they are so large at most


class Flow(NamedTuple):
    """y' = matrix y + constant in units of the kernel, forcing lines among y, and the least rate."""

    matrix: Floats
    constant: Floats
    floor: float

    def derivative(self, row: Row) -> Row:
        """Row of u'."""
        return row[0] @ self.matrix, float(row[0] @ self.constant)


@dataclass(frozen=True)
class Surface:
    """A guard on which two modes may slide: A below it, B above; what (1) needs."""

    below: str
    above: str
    guard: str
    rates: tuple[Row, Row]  # u'_A, u'_B
    flow: Flow | None  # (1), None where it is not linear
    reset: tuple[Floats, Floats] | None  # (2)

    @property
    def name(self) -> str:
        """Name of the mode that slides."""
        return f"{self.below}|{self.above}"

    def share(self, y: Floats) -> float:
        """Share a of (1) at a state of the kernel."""
        a, b = (row @ y + gain for row, gain in self.rates)
        return float(a / (a - b))


class WayOut(NamedTuple):
    """A way out of a mode: the limits of a row, where it leads, and what it belongs to."""

    row: Row
    lower: float
    upper: float
    guard: str
    to: tuple[str, int]  # name, number of a surface or -1
    reset: tuple[Floats, Floats] | None
    surface: int  # number, -1: none
    unclear: str = ""  # why the run ends here


class GivenSystem:
    """A hybrid system in the kernel, states in units of it, entries of y in pairs, then the forcing pairs."""

    def __init__(self, system: HybridSystem, units: Units) -> None:
        self.system, self.units = system, units
        self.n, self.lines = system.states, len(system.omegas)
        self.pairs = (self.n + 1) // 2
        self.size = 2 * (self.pairs + self.lines)
        self.unit = np.ones(2 * self.pairs)
        self.unit[: self.n] = units.states
        self.omegas = [w * units.time for w in system.omegas]
        self.flows = {
            name: self._flow(name, floor)
            for name, floor in zip(system.modes, units.floors, strict=True)
        }
        self.rows = {name: self._row(name) for name in system.guards}
        self.surfaces = self._surfaces()
        self.watches: list[WayOut] = []
        self.names: list[str] = []  # of modes, by their codes
        self.steps: list[float] = []
        self._compile()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies, in other processes too, are compiled again."""
        return GivenSystem, (self.system, self.units)

    def code(self, mode: str, surface: int = -1) -> int:
        """Code of a mode: those given, then of every surface A, B entered there, and what slides."""
        if surface < 0:
            return list(self.system.modes).index(mode)
        of = self.surfaces[surface]
        place = 2 if mode == of.name else [of.below, of.above].index(mode)
        return len(self.system.modes) + 3 * surface + place

    def slides(self, code: int) -> int:
        """Number of the surface on which a mode slides, -1 for none."""
        place = code - len(self.system.modes)
        return place // 3 if place >= 0 and place % 3 == 2 else -1

    # ---- numbers -----------------------------------------------------------------------------------

    def _flow(self, name: str, floor: float) -> Flow:
        mode, n, first = self.system.modes[name], self.n, 2 * self.pairs
        unit, time = self.units.states, self.units.time
        assert mode.constant is not None
        assert mode.waves is not None
        matrix, constant = np.zeros((self.size, self.size)), np.zeros(self.size)
        matrix[:n, :n] = mode.matrix * unit[None, :] / unit[:, None] * time
        matrix[:n, first:] = mode.waves / unit[:, None] * time
        constant[:n] = mode.constant / unit * time
        for line, omega in enumerate(self.omegas):
            at = first + 2 * line
            matrix[at, at + 1], matrix[at + 1, at] = omega, -omega
        return Flow(matrix, constant, floor * time)

    def _row(self, name: str) -> Row:
        guard, row = self.system.guards[name], np.zeros(self.size)
        row[: self.n], row[2 * self.pairs :] = guard.row * self.units.states, guard.waves
        return row, 0.0

    def _step(self, name: str, flow: Flow) -> float:
        rate = max(balanced_norm(flow.matrix[: self.n, : self.n]), *self.omegas, flow.floor)
        if not rate <= FASTEST_MODE_RELATIVE:
            raise InvalidParameterError(
                f"mode {name!r} has the rate {rate / self.units.time!r}, {rate:.3g} times that of the mode at the "
                f"start: must be at most {FASTEST_MODE_RELATIVE} times."
            )
        return rounded_down(STEP_ANGLE / max(rate, SLOWEST_MODE_RELATIVE), STEP_BITS)

    def _map(self, matrix: Floats, shift: Floats) -> tuple[Floats, Floats] | None:
        n, unit = self.n, self.units.states
        if is_identity(matrix, shift):
            return None
        whole, more = np.eye(self.size), np.zeros(self.size)
        whole[:n, :n], more[:n] = matrix * unit[None, :] / unit[:, None], shift / unit
        return whole, more

    # ---- surfaces ----------------------------------------------------------------------------------

    def _surfaces(self) -> list[Surface]:
        plain = [
            t for t in self.system.transitions if is_identity(t.matrix, t.shift) and t.mode != t.to
        ]
        back = {(t.mode, t.to, t.guard) for t in plain if t.direction == "falling"}
        found = [
            self._surface(t.mode, t.to, t.guard)
            for t in plain
            if t.direction == "rising" and (t.to, t.mode, t.guard) in back
        ]
        return [surface for surface in found if surface]

    def _surface(self, below: str, above: str, guard: str) -> Surface | None:
        a, b, row = self.flows[below], self.flows[above], self.rows[guard]
        rates = a.derivative(row), b.derivative(row)
        level = self.system.guards[guard].level
        change = b.constant - a.constant
        if np.array_equal(a.matrix, b.matrix):  # D is constant
            closing = -float(row[0] @ change)  # u'_A - u'_B
            terms = float(np.abs(row[0]) @ (np.abs(a.constant) + np.abs(b.constant)))
            if not closing > ROUNDING_PER_TERM * terms:
                return None  # what leads to the surface leads on from there
            along = change / closing
            back = max(flow.floor or 1.0 for flow in (a, b))
            matrix = a.matrix + np.outer(along, rates[0][0]) + back * np.outer(along, row[0])
            constant = a.constant + along * (rates[0][1] - back * level)
            reset = np.eye(self.size) + np.outer(along, row[0]), along * -level
            return Surface(below, above, guard, rates, Flow(matrix, constant, a.floor), reset)
        flow = None
        if not np.any(rates[0][0]) and not np.any(rates[1][0]):  # a is constant
            share = (
                rates[0][1] / (rates[0][1] - rates[1][1])
                if rates[0][1] > 0.0 > rates[1][1]
                else 0.0
            )
            matrix = (1.0 - share) * a.matrix + share * b.matrix
            first = 2 * self.pairs
            matrix[first:] = a.matrix[first:]
            flow = Flow(
                matrix, (1.0 - share) * a.constant + share * b.constant, max(a.floor, b.floor)
            )
        return Surface(below, above, guard, rates, flow, None)

    # ---- modes of the kernel -----------------------------------------------------------------------

    def _compile(self) -> None:
        flows: list[Flow] = []
        watched: list[list[WayOut]] = []
        for name, flow in self.flows.items():
            self.names.append(name)
            flows.append(flow)
            watched.append([self._watch(t, -1) for t in self._of(name)])
        still = Flow(np.zeros((self.size, self.size)), np.zeros(self.size), 1.0)
        for number, surface in enumerate(self.surfaces):
            for name in (surface.below, surface.above):
                self.names.append(name)
                flows.append(self.flows[name])
                watched.append([self._watch(t, number) for t in self._of(name)])
            self.names.append(surface.name)
            flows.append(surface.flow or still)
            watched.append(self._sliding_watches(number, surface))
        self.steps = [self._step(name, flow) for name, flow in zip(self.names, flows, strict=True)]
        self.kernel = _kernel.System(
            dense=True, mixed=False, dimension=self.size, degrees=self.pairs, omegas=self.omegas,
            kappas=[1.0] * self.lines, step=self.steps[0], laws=[], elements=[ElementOfKernel(1, False, False)],
            given=True, sequential=False,
        )  # fmt: skip
        to_x, to_v = np.zeros((self.pairs, self.size)), np.zeros((self.pairs, self.size))
        from_x, from_v = np.zeros((self.size, self.pairs)), np.zeros((self.size, self.pairs))
        for i in range(self.pairs):
            to_x[i, 2 * i], to_v[i, 2 * i + 1] = self.unit[2 * i], self.unit[2 * i + 1]
            from_x[2 * i, i], from_v[2 * i + 1, i] = (
                1.0 / self.unit[2 * i],
                1.0 / self.unit[2 * i + 1],
            )
        for code, (flow, watches) in enumerate(zip(flows, watched, strict=True)):
            if len(watches) > MOST_GUARDS:
                raise InvalidParameterError(
                    f"transitions: {len(watches)} leave the sliding mode {self.names[code]!r}; must be at most "
                    f"{MOST_GUARDS}."
                )
            self.kernel.add_mode(
                code=code,
                flow={"b": flow.matrix.tolist(), "constant": flow.constant.tolist(), "step": [self.steps[code]]},
                guards=[], watches=[self._put(w) for w in watches], to_x=to_x, to_v=to_v, offset=[0.0] * self.pairs,
                from_x=from_x, from_v=from_v, particular=np.zeros((self.size, 2 * self.lines)), shift=[],
            )  # fmt: skip

    def _put(self, w: WayOut) -> Watch:
        reset = -1
        if w.reset is not None:
            reset = int(self.kernel.add_reset(matrix=w.reset[0], shift=w.reset[1].tolist()))
        self.watches.append(w)
        row, gain = w.row
        number, target = len(self.watches) - 1, self.code(*w.to)
        return Watch(
            row.tolist(), gain, w.lower, w.upper, number, reset=reset, target=target
        )  # fmt: skip

    def _of(self, mode: str) -> list[Transition]:
        return [t for t in self.system.transitions if t.mode == mode]

    def _on(self, t: Transition) -> int:
        """Number of the surface that a transition belongs to, -1 for none."""
        if not is_identity(t.matrix, t.shift):
            return -1
        modes = (t.mode, t.to) if t.direction == "rising" else (t.to, t.mode)
        known = [(s.below, s.above, s.guard) for s in self.surfaces]
        return known.index((*modes, t.guard)) if (*modes, t.guard) in known else -1

    def _limits(self, t: Transition) -> tuple[float, float]:
        level = self.system.guards[t.guard].level
        return (-math.inf, level) if t.direction == "rising" else (level, math.inf)

    def _watch(self, t: Transition, twin_on: int) -> WayOut:
        """A transition from a mode, or from its twin on a surface."""
        assert t.matrix is not None
        assert t.shift is not None
        number = self._on(t)
        to, reset = (t.to, number), self._map(t.matrix, t.shift)
        if number >= 0 and number == twin_on:
            to, reset = (self.surfaces[number].name, number), self.surfaces[number].reset
        return WayOut(self.rows[t.guard], *self._limits(t), t.guard, to, reset, number)

    def _sliding_watches(self, number: int, s: Surface) -> list[WayOut]:
        out = [
            WayOut(s.rates[0], 0.0, math.inf, s.guard, (s.below, number), s.reset, number),
            WayOut(s.rates[1], -math.inf, 0.0, s.guard, (s.above, number), s.reset, number),
        ]
        if s.flow is None:
            return out
        ways = {(t.guard, t.direction): t for name in (s.above, s.below) for t in self._of(name)}
        for guard, direction in ways:
            if guard == s.guard:
                continue
            both = [
                next(
                    (t for t in self._of(name) if (t.guard, t.direction) == (guard, direction)),
                    None,
                )
                for name in (s.below, s.above)
            ]
            out.append(self._sliding_watch(number, s, both[0], both[1]))
        return out

    def _sliding_watch(
        self, number: int, s: Surface, a: Transition | None, b: Transition | None
    ) -> WayOut:
        """Way out where both modes are left alike, or for modes on the same surface; else the run ends."""
        known = [(x.below, x.above, x.guard) for x in self.surfaces]
        t = a or b
        assert t is not None
        place = self.rows[t.guard], *self._limits(t), t.guard
        plain = a and b and is_identity(a.matrix, a.shift) and is_identity(b.matrix, b.shift)
        if a and b and plain and (a.to, b.to, s.guard) in known:
            other = known.index((a.to, b.to, s.guard))
            reset = self.surfaces[other].reset
            return WayOut(*place, (self.surfaces[other].name, other), reset, -1)
        if a and b and a.to == b.to and same_reset(a, b):
            assert a.matrix is not None
            assert a.shift is not None
            return WayOut(*place, (a.to, -1), self._map(a.matrix, a.shift), -1)
        says = [
            f"{m!r} goes to {x.to!r}" if x else f"{m!r} goes on"
            for m, x in ((s.below, a), (s.above, b))
        ]
        return WayOut(
            *place, (s.name, number), None, -1,
            f"it slides on {s.guard!r} as {s.name!r}, and {t.guard!r} is {t.direction} there: {says[0]}, {says[1]}, "
            "and their combination is not determined",
        )  # fmt: skip


def same_reset(a: Transition, b: Transition) -> bool:
    """Whether two transitions do the same to the state."""
    pairs = (a.matrix, b.matrix), (a.shift, b.shift)
    return all(x is not None and y is not None and np.array_equal(x, y) for x, y in pairs)
