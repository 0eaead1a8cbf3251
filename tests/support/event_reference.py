"""Machines with elements, integrated step by step by SciPy: a witness that shares no code.

Method      The laws of springs, dashpots, friction, constraints are written down as forces on
            z = (x, v, sin and cos of every frequency, 1), for given states of the elements:
            z' = A z, and the margins G z, which are positive while the states last. DOP853
            integrates; in every step margins are sampled, and minima between samples searched, so
            that no two roots hide in one step.
            After an event all elements that are at a limit are decided together: every combination
            of their states is tried, and one lasts if its margins are positive a moment later.
Assumes     events that are further apart than that moment; no rest but of plastic impacts
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

from vibroimpact import Friction, Mechanism, SoftStop, State

Array = NDArray[np.float64]
MOMENT = 5e-5  # margins of states that last have grown beyond the errors of an event by then
NEAR = 1e-8  # at a limit: a margin within this, far above the errors of an event
OPEN, UPPER, LOWER, BEHIND_UPPER, BEHIND_LOWER, LIMITED_UPPER, LIMITED_LOWER = range(7)
FORWARD, BACKWARD, STICK = range(3)


class Happening(NamedTuple):
    time: float
    what: str  # impact, stick, release, engage, change
    number: int  # contacts first, then elements
    z: Array  # after it


class Margin(NamedTuple):
    number: int
    row: Array
    resting: bool = False  # force of a closed contact
    held: bool = False  # zero while it lasts


class Reference:
    def __init__(self, m: Mechanism, start: State) -> None:
        self.m, self.n = m, m.degrees
        moving = [e.lines for e in m.elements]
        lines = [*m.forces, *itertools.chain(*moving)]
        self.omegas = sorted({line.omega for line in lines})
        self.size = 2 * self.n + 2 * len(self.omegas) + 1
        self.mass = np.array(m.mass)
        first = m.forces[0].omega if m.forces else 1.0
        waves = []
        for w in self.omegas:
            waves += [math.sin(start.phase * w / first), math.cos(start.phase * w / first)]
        self.z = np.array([*start.position, *start.velocity, *waves, 1.0])
        self.known: dict[tuple[int, ...], tuple[Array, list[Margin]]] = {}

    # ---- laws, as rows on z ----------------------------------------------------------------------

    def one(self, row: tuple[float, ...], velocity: bool = False) -> Array:
        out = np.zeros(self.size)
        out[self.n * velocity : self.n * velocity + self.n] = row
        return out

    def motion(self, lines: Any, derivatives: int = 0) -> Array:
        out = np.zeros(self.size)
        for line in lines:
            at = 2 * self.n + 2 * self.omegas.index(line.omega)
            a, b = line.sine[0], line.cosine[0]
            for _ in range(derivatives):
                a, b = -line.omega * b, line.omega * a
            out[at] += a
            out[at + 1] += b
        return out

    def gap(self, e: Any, derivatives: int = 0) -> Array:
        """Place relative to the moving stop, or its rate."""
        return self.one(e.row, derivatives == 1) - self.motion(e.motion, derivatives)

    def slip(self, e: Friction) -> Array:
        out = self.one(e.row, True) - self.motion(e.motion, 1)
        out[-1] -= e.belt_speed
        return out

    def press(self, e: SoftStop, side: int, sign: float = 1.0) -> Array:
        """Force of spring and dashpot; of the spring less the dashpot, or of the spring alone."""
        i = 1 if side > 0 else 0
        k, c = (p[i] if isinstance(p, tuple) else p for p in (e.stiffness, e.damping))
        c = sign * c
        out = side * (k * self.gap(e) + c * self.gap(e, 1))
        out[-1] -= side * k * (e.upper if side > 0 else e.lower)
        return out

    def within(self, e: Any, side: int) -> Array:
        """Distance to the stop of a side, positive before it."""
        out = -side * self.gap(e)
        out[-1] += side * (e.upper if side > 0 else e.lower)
        return out

    # ---- equations -------------------------------------------------------------------------------

    def mode(self, states: tuple[int, ...]) -> tuple[Array, list[Margin]]:
        if states not in self.known:
            self.known[states] = self.equations(states)
        return self.known[states]

    def equations(self, states: tuple[int, ...]) -> tuple[Array, list[Margin]]:
        m, n = self.m, self.n
        contacts = len(m.rigid_stops)
        force = np.zeros((n, self.size))
        force[:, :n], force[:, n : 2 * n] = -np.array(m.stiffness), -np.array(m.damping)
        force[:, -1] = m.constant_force
        for line in m.forces:
            at = 2 * n + 2 * self.omegas.index(line.omega)
            force[:, at] += line.sine
            force[:, at + 1] += line.cosine
        held: list[tuple[int, Array, Array]] = []  # number, row, acceleration
        margins = []
        for i, (contact, q) in enumerate(zip(m.rigid_stops, states, strict=False)):
            if q != OPEN:
                held.append((i, np.array(contact.row), self.motion(contact.motion, 2)))
                continue
            for side, limit in ((1, contact.upper), (-1, contact.lower)):
                if math.isfinite(limit):
                    margins.append(Margin(i, self.within(contact, side)))
        for i, (e, q) in enumerate(zip(m.switching, states[contacts:], strict=True), contacts):
            row = np.array(e.row)
            if isinstance(e, SoftStop):
                if q in (UPPER, LOWER):
                    side = 1 if q == UPPER else -1
                    force -= side * np.outer(row, self.press(e, side))
                elif q in (LIMITED_UPPER, LIMITED_LOWER):
                    side = 1 if q == LIMITED_UPPER else -1
                    force -= side * np.outer(row, 2.0 * self.press(e, side, 0.0))
                margins += self.soft_margins(i, e, q)
            elif q == STICK:
                held.append((i, row, self.motion(e.motion, 2)))
            else:
                sign = 1 if q == FORWARD else -1
                force[:, -1] -= sign * e.kinetic * row
                margins.append(Margin(i, sign * self.slip(e)))
        acceleration = np.linalg.solve(self.mass, force)
        if held:
            rows = np.array([row for _, row, _ in held])
            lift = np.linalg.solve(self.mass, rows.T)
            wanted = np.array([a for _, _, a in held])
            mu = np.linalg.solve(rows @ lift, wanted - rows @ acceleration)
            acceleration = acceleration + lift @ mu
            for (i, _, _), f in zip(held, mu, strict=True):
                margins += self.held_margins(i, states[i], f)
        a = np.zeros((self.size, self.size))
        a[:n, n : 2 * n] = np.eye(n)
        a[n : 2 * n] = acceleration
        for i, w in enumerate(self.omegas):
            at = 2 * n + 2 * i
            a[at, at + 1], a[at + 1, at] = w, -w
        return a, margins

    def soft_margins(self, i: int, e: SoftStop, q: int) -> list[Margin]:
        if q == OPEN:
            limits = ((1, e.upper), (-1, e.lower))
            return [Margin(i, self.within(e, s)) for s, limit in limits if math.isfinite(limit)]
        side = 1 if q in (UPPER, BEHIND_UPPER, LIMITED_UPPER) else -1
        beyond, press = Margin(i, -self.within(e, side)), Margin(i, self.press(e, side))
        room = Margin(i, self.press(e, side, -1.0))  # of the spring force above the damping force
        if q in (BEHIND_UPPER, BEHIND_LOWER):
            return [beyond, Margin(i, -press.row)]
        if q in (LIMITED_UPPER, LIMITED_LOWER):
            return [beyond, Margin(i, -room.row)]
        if e.law == "limited":
            return [press, room]
        return [beyond if e.law == "linear" else press]

    def held_margins(self, i: int, q: int, force: Array) -> list[Margin]:
        if i < len(self.m.rigid_stops):
            return [Margin(i, (-1 if q == UPPER else 1) * force, resting=True)]
        e = self.m.switching[i - len(self.m.rigid_stops)]
        assert isinstance(e, Friction)
        assert e.static is not None
        level = np.zeros(self.size)
        level[-1] = e.static
        return [
            Margin(i, self.slip(e), held=True), Margin(i, level - force), Margin(i, level + force)
        ]  # fmt: skip

    # ---- states ----------------------------------------------------------------------------------

    def choices(self, i: int, z: Array) -> list[int]:
        contacts = len(self.m.rigid_stops)
        if i < contacts:
            c = self.m.rigid_stops[i]
            resting = abs(self.gap(c, 1) @ z) < NEAR
            sides = [
                q for q, side, limit in ((UPPER, 1, c.upper), (LOWER, -1, c.lower))
                if resting and math.isfinite(limit) and abs(self.within(c, side) @ z) < NEAR
            ]  # fmt: skip
            return [*sides, OPEN]
        e = self.m.switching[i - contacts]
        if isinstance(e, Friction):
            return [STICK, FORWARD, BACKWARD]
        found = [OPEN]
        for side, limit in ((1, e.upper), (-1, e.lower)):
            if math.isfinite(limit):
                found += [UPPER, BEHIND_UPPER] if side > 0 else [LOWER, BEHIND_LOWER]
                if e.law == "limited":
                    found.append(LIMITED_UPPER if side > 0 else LIMITED_LOWER)
        return found

    def decide(self, states: tuple[int, ...], z: Array, asked: set[int]) -> tuple[int, ...]:
        """States that last from z on, those of the asked elements being open."""
        options = [self.choices(i, z) if i in asked else [q] for i, q in enumerate(states)]
        for chosen in itertools.product(*options):
            a, margins = self.mode(chosen)
            later = expm(a * MOMENT) @ z
            if all(
                abs(m.row @ z) < NEAR
                if m.held
                else m.row @ z > NEAR or (m.row @ z > -NEAR and m.row @ later > 0.0)
                for m in margins
            ):
                return chosen
        raise RuntimeError(f"no states last from {z}")

    def at_limits(self, states: tuple[int, ...], z: Array) -> set[int]:
        return {
            m.number for m in self.mode(states)[1]
            if (abs(m.row @ z) > NEAR if m.held else m.row @ z < NEAR)
        }  # fmt: skip

    def settle(self, states: tuple[int, ...], z: Array) -> tuple[int, ...]:
        """Decide what is at a limit, then what that takes along."""
        asked = self.at_limits(states, z)
        for _ in range(8):
            try:
                after = self.decide(states, z, asked)
            except RuntimeError:
                if len(asked) == len(states):
                    raise
                asked = set(range(len(states)))
                continue
            more = self.at_limits(after, z) - asked
            if not more:
                return after
            asked |= more
        raise RuntimeError("states change for ever")

    def strike(self, i: int, z: Array) -> Array:
        c = self.m.rigid_stops[i]
        rate = self.gap(c, 1) @ z
        r = c.restitutions[1 if rate > 0 else 0]
        lift = np.linalg.solve(self.mass, np.array(c.row))
        out = z.copy()
        out[self.n : 2 * self.n] -= lift * (1.0 + r) * rate / (np.array(c.row) @ lift)
        return out

    def states_between(self, z: Array) -> tuple[int, ...]:
        """States of a segment from its values: columns z within it."""
        found = []
        for contact in self.m.rigid_stops:
            closed = [
                q for q, side, limit in ((UPPER, 1, contact.upper), (LOWER, -1, contact.lower))
                if math.isfinite(limit) and np.abs(self.within(contact, side) @ z).max() < 1e-11
                and np.abs(self.gap(contact, 1) @ z).max() < 1e-11
            ]  # fmt: skip
            found.append(closed[0] if closed else OPEN)
        for e in self.m.switching:
            middle = z[:, z.shape[1] // 2]
            if isinstance(e, Friction):
                slip = self.slip(e) @ z
                forward = FORWARD if slip[z.shape[1] // 2] > 0.0 else BACKWARD
                found.append(STICK if np.abs(slip).max() < 1e-11 else forward)
                continue
            q = OPEN
            for side, pressed, behind in ((1, UPPER, BEHIND_UPPER), (-1, LOWER, BEHIND_LOWER)):
                if self.within(e, side) @ middle < 0.0:
                    lets_go = e.law != "linear" and self.press(e, side) @ middle < 0.0
                    q = behind if lets_go else pressed
                    if e.law == "limited" and self.press(e, side, -1.0) @ middle < 0.0:
                        q = LIMITED_UPPER if side > 0 else LIMITED_LOWER
            found.append(q)
        return tuple(found)

    # ---- motion ----------------------------------------------------------------------------------

    def events(self, count: int, t_max: float, rtol: float = 1e-13) -> list[Happening]:
        """The first events; fewer where impacts become too weak to be followed (chatter)."""
        contacts = len(self.m.rigid_stops)
        t, z, out = 0.0, self.z, []
        states: tuple[int, ...] = (0,) * (contacts + len(self.m.switching))
        states = self.decide(states, z, set(range(len(states))))
        while len(out) < count:
            hit = self.fly(states, t, z, t_max, rtol)
            if hit is None:
                break
            t, z, margin = hit
            i, what = margin.number, "change"
            if i < contacts:
                what = "release" if margin.resting else "impact"
            if what == "impact":
                if abs(self.gap(self.m.rigid_stops[i], 1) @ z) < 100.0 * MOMENT:
                    break
                z = self.strike(i, z)
            before, states = states, self.settle(states, z)
            soft = what == "change" and isinstance(self.m.switching[i - contacts], SoftStop)
            if soft and before[i] == OPEN and states[i] not in (OPEN, BEHIND_UPPER, BEHIND_LOWER):
                what = "engage"
            out.append(Happening(t, what, i, z))
            if what == "impact" and states[i] != OPEN:
                out.append(Happening(t, "stick", i, z))
        return out[:count]

    def fly(
        self, states: tuple[int, ...], t: float, z: Array, t_max: float, rtol: float
    ) -> tuple[float, Array, Margin] | None:
        """To the first margin that falls to zero."""
        a, margins = self.mode(states)
        searched = [m for m in margins if not m.held]
        rows = np.array([m.row for m in searched]).reshape(-1, self.size)
        z = expm(a * (MOMENT / 8)) @ z  # off the limits that it starts on
        t += MOMENT / 8
        solver = DOP853(lambda _, y: a @ y, t, z, t_max, rtol=rtol, atol=rtol / 10, max_step=0.1)
        while solver.status == "running":
            solver.step()
            dense = solver.dense_output()
            times = np.linspace(solver.t_old, solver.t, 9)
            values = rows @ dense(times)
            found = [
                (self.root(dense, m.row, times, g), j)
                for j, (m, g) in enumerate(zip(searched, values, strict=True))
                if min(g) < max(g) - min(g)
            ]
            roots = [(r, j) for r, j in found if r is not None]
            if roots:
                r, j = min(roots)
                return r, dense(r), searched[j]
        return None

    @staticmethod
    def root(dense: Any, row: Array, times: Array, g: Array) -> float | None:
        for k in range(1, len(g)):
            if g[k] < 0.0 <= g[k - 1]:
                return float(brentq(lambda s: row @ dense(s), times[k - 1], times[k], xtol=1e-15))
            if k + 1 < len(g) and g[k] <= min(g[k - 1], g[k + 1]) < 4.0 * np.ptp(g[k - 1 : k + 2]):
                low = minimize_scalar(
                    lambda s: row @ dense(s), bounds=(times[k - 1], times[k + 1]),
                    method="bounded", options={"xatol": 1e-10},
                )  # fmt: skip
                if low.fun < 0.0:
                    return float(brentq(lambda s: row @ dense(s), times[k - 1], low.x, xtol=1e-15))
        return None
