"""Machines with rigid and soft stops, friction, belts and phase switches, on a fine grid of time.

Method      The whole state is one vector y = (x, v, sin and cos of every frequency, 1). With given states
            of all elements it obeys y' = A y, where the accelerations of A solve

                M a = f(y) + R^T mu,   R a = d/dt of prescribed speeds                                 (1)

            f are forces of springs, dashpots, lines and elements, R the rows of contacts at rest and of
            friction that sticks, mu the forces that hold them. Every state lasts while its margins
            g = G y are positive: gaps, forces that press, slip speeds, what a level has left.

            Grid: the margins at k = 1, ..., 64 steps of h = 1/8 of the fastest time are G exp(A h)^k y   (2)
            Within a step a margin is its Taylor polynomial, of degree 14: its roots by brentq, and its
            minimum where three points of the grid suggest one.                                         (3)
            Impacts: gap speeds w and impulses p of all that touch, by trying every set of them:
                w+ = w + R M^-1 R^T p,   0 <= p,   0 <= w+ + r w,   p (w+ + r w) = 0                  (4)
            States after an event: every combination of states of what is at a limit is tried. One lasts
            if the first Taylor coefficient that is not zero of each of its margins is positive; where
            friction can stick and slip it sticks, and what did not end keeps its state where it can.   (5)
            Chatter: impacts are followed until one leaves with less than SLOW of the speeds so far; it
            rests from there on, with what is left of the sum, 2 w / (a (1 - r)), added in time only.   (6)
Accuracy    rounding of some thousand steps, 1e-12 of the motion; what is within CLEAR of two answers is
            none: UndecidedError is raised.
Assumes     a mass at every coordinate; the attributes of a mechanism, and names of classes; nothing else
            of the library.
"""

from __future__ import annotations

import itertools
import math
import operator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

Array = Any
STEPS, DEGREE = 64, 14
ZERO, CLEAR = 1e-11, 1e-8  # of the scale of a margin: rounding is below, decisions are above
SLOW = 1e-9  # an impact this weak, of the speeds so far, ends a chatter
PARTS = 4  # of a step, between which a margin turns once at most
OPEN, UPPER, LOWER, BEHIND_UPPER, BEHIND_LOWER = range(5)
FORWARD, BACKWARD, STICK, LIFTED = range(4)


class UndecidedError(Exception):
    """Two answers are within rounding of each other."""


class CrowdedError(UndecidedError):
    """Two contacts bounce so low at once that rounding decides which is first: the end of what is followed."""


class Event(NamedTuple):
    time: float
    kind: str  # impact, rest (end of a chatter), release, change
    number: int  # contacts first, then elements
    position: Array
    states: tuple[int, ...]  # after it


@dataclass
class Mode:
    A: Array
    rows: Array  # of the margins
    owners: list[int]  # element of each
    held: Array  # rows of prescribed speeds, zero on the motion

    @cached_property
    def h(self) -> float:
        return 0.125 / float(np.abs(np.linalg.eigvals(self.A)).max())

    @cached_property
    def powers(self) -> list[Array]:
        """exp(A h)^k."""
        out = [expm(self.A * self.h)]
        while len(out) < STEPS:
            out.append(out[-1] @ out[0])
        return out

    @cached_property
    def on_grid(self) -> Array:
        """Margins on the grid as rows, k after k: (2)."""
        return np.array([self.rows @ power for power in self.powers])


def kind_of(part: Any) -> str:
    return {"RigidStop": "rigid", "SoftStop": "soft", "Friction": "friction"}.get(
        type(part).__name__, "switch"
    )


class Machine:
    def __init__(self, m: Any, position: Any, velocity: Any, phase: float) -> None:
        self.parts = m.elements
        self.kinds = [kind_of(part) for part in self.parts]
        self.n = n = len(m.mass)
        self.M, self.C, self.K = (np.array(a, float) for a in (m.mass, m.damping, m.stiffness))
        self.inverse = np.linalg.inv(self.M)
        self.omegas = sorted({line.omega for line in m.forces})
        self.size = 2 * n + 2 * len(self.omegas) + 1
        self.first, self.phase = m.omega, phase
        self.force = np.zeros((n, self.size))
        self.force[:, :n], self.force[:, n : 2 * n] = -self.K, -self.C
        self.force[:, -1] = m.constant_force
        for line in m.forces:
            at = 2 * n + 2 * self.omegas.index(line.omega)
            self.force[:, at] += line.sine
            self.force[:, at + 1] += line.cosine
        self.modes: dict[tuple[int, ...], Mode | None] = {}
        self.y = np.concatenate([position, velocity, np.zeros(self.size - 2 * n)])
        self.time = 0.0
        self.set_waves()
        self.scale = np.ones(self.size)
        self.scale[: 2 * n] = 1e-3 + np.abs(self.y[: 2 * n])
        self.events: list[Event] = []
        self.arcs = {i: arcs_of(p) for i, p in enumerate(self.parts) if self.kinds[i] == "switch"}
        self.switching: list[tuple[float, int, int, int]] = []  # time, element, piece, impulse

    def set_waves(self) -> None:
        """Sines and cosines from the time: they gather no rounding."""
        for k, w in enumerate(self.omegas):
            angle = self.phase * (w / self.first) + w * self.time
            self.y[2 * self.n + 2 * k :][:2] = math.sin(angle), math.cos(angle)
        self.y[-1] = 1.0

    # ---- rows on y ------------------------------------------------------------------------------------

    def along(self, row: Any, *, speed: bool = False) -> Array:
        out = np.zeros(self.size)
        out[self.n * speed : self.n * (speed + 1)] = row
        return out

    def waves(self, lines: Any, derivatives: int = 0) -> Array:
        out = np.zeros(self.size)
        for line in lines:
            at, (a, b) = (
                2 * self.n + 2 * self.omegas.index(line.omega),
                (line.sine[0], line.cosine[0]),
            )
            for _ in range(derivatives):
                a, b = -line.omega * b, line.omega * a
            out[at : at + 2] += a, b
        return out

    def constant(self, value: float) -> Array:
        out = np.zeros(self.size)
        out[-1] = value
        return out

    def gap(self, part: Any, side: int) -> Array:
        """Distance to the stop of a side, positive before it."""
        u = self.along(part.row) - self.waves(part.motion)
        return self.constant(side * limit(part, side)) - side * u

    def rate(self, part: Any, side: int) -> Array:
        return -side * (self.along(part.row, speed=True) - self.waves(part.motion, 1))

    def press(self, part: Any, side: int) -> Array:
        k, c = (pair[side > 0] for pair in (part.stiffness, part.damping))
        return -k * self.gap(part, side) - c * self.rate(part, side)

    def slip(self, part: Any) -> Array:
        belt = self.waves(part.motion, 1) + self.constant(part.belt_speed)
        return self.along(part.row, speed=True) - belt

    def load(self, part: Any) -> Array:
        """Normal load; without one 1, and levels are forces."""
        load = part.load
        if load is None:
            return self.constant(1.0)
        out = self.constant(load.constant) + self.waves(load.motion)
        out += self.along(load.position or 0.0) + self.along(load.velocity or 0.0, speed=True)
        return out

    # ---- (1), margins, (2) ----------------------------------------------------------------------------

    def mode(self, states: tuple[int, ...]) -> Mode | None:
        if states not in self.modes:
            self.modes[states] = self.compiled(states)
        return self.modes[states]

    def compiled(self, states: tuple[int, ...]) -> Mode | None:
        """The mode of these states; None where constraints depend on each other."""
        n, force = self.n, self.force.copy()
        margins: list[tuple[int, Array]] = []
        held: list[tuple[int, Array, Array, Array]] = []  # number, row, speed, acceleration
        for i, (part, kind, q) in enumerate(zip(self.parts, self.kinds, states, strict=True)):
            if kind == "switch":
                force[:, -1] += part.forces[self.arcs[i][q][1]]
                continue
            row = np.array(part.row)
            if kind == "rigid" and q != OPEN:
                held.append((i, row, self.rate(part, 1), self.waves(part.motion, 2)))
            elif kind == "rigid" or (kind == "soft" and q == OPEN):
                margins += [(i, self.gap(part, side)) for side in sides(part)]
            elif kind == "soft":
                side = 1 if q in (UPPER, BEHIND_UPPER) else -1
                press, inside = self.press(part, side), -self.gap(part, side)
                if q in (UPPER, LOWER):
                    force -= side * np.outer(row, press)
                    margins.append((i, press if part.law == "unilateral" else inside))
                else:
                    margins += [(i, -press), (i, inside)]
            elif q == STICK:
                held.append((i, row, self.slip(part), self.waves(part.motion, 2)))
            else:
                load, sign = self.load(part), {FORWARD: 1, BACKWARD: -1, LIFTED: 0}[q]
                force -= sign * part.kinetic * np.outer(row, load)
                if sign:
                    margins.append((i, sign * self.slip(part)))
                if part.load is not None:
                    margins.append((i, load if sign else -load))
        acceleration = self.inverse @ force
        R = np.array([row for _, row, _, _ in held]).reshape(-1, n)
        lift = self.inverse @ R.T
        if held:
            along = R @ lift
            size = np.sqrt(np.diag(along))
            if np.linalg.cond(along / np.outer(size, size)) > 1e8:
                return None
            mu = np.linalg.solve(along, np.array([a for *_, a in held]) - R @ acceleration)
            acceleration = acceleration + lift @ mu
            for (i, *_), f in zip(held, mu, strict=True):
                part = self.parts[i]
                if self.kinds[i] == "rigid":
                    margins.append((i, -f if states[i] == UPPER else f))
                    continue
                level = part.static * self.load(part)
                margins += [(i, level - f), (i, level + f)]
                if part.load is not None:
                    margins.append((i, self.load(part)))
        A = np.zeros((self.size, self.size))
        A[:n, n : 2 * n], A[n : 2 * n] = np.eye(n), acceleration
        for k, w in enumerate(self.omegas):
            at = 2 * n + 2 * k
            A[at, at + 1], A[at + 1, at] = w, -w
        rows = np.array([row for _, row in margins]).reshape(-1, self.size)
        speeds = np.array([speed for *_, speed, _ in held]).reshape(-1, self.size)
        return Mode(A, rows, [i for i, _ in margins], speeds)

    # ---- (5) states -----------------------------------------------------------------------------------

    def compare(self, row: Array) -> int:
        """Sign of a row on y; 0 within rounding."""
        value, scale = float(row @ self.y), float(np.abs(row) @ self.scale)
        if abs(value) <= ZERO * scale:
            return 0
        if abs(value) < CLEAR * scale:
            raise UndecidedError(f"{value} of {scale}")
        return 1 if value > 0.0 else -1

    def choices(self, i: int, now: int, loose: bool) -> list[int]:
        """States that element i may have at y; ``loose`` where what it did before does not count."""
        part, kind = self.parts[i], self.kinds[i]
        if kind == "switch":
            return [now]
        if kind == "friction":
            sign = self.compare(self.slip(part))
            found = [STICK, FORWARD, BACKWARD] if sign == 0 else [FORWARD if sign > 0 else BACKWARD]
            if part.load is not None:
                pressed = self.compare(self.load(part))
                found = [*(found if pressed >= 0 else []), *([LIFTED] if pressed <= 0 else [])]
            return found
        found = []
        for side in sides(part):
            pressed, behind = (UPPER, BEHIND_UPPER) if side > 0 else (LOWER, BEHIND_LOWER)
            if not loose and now not in (OPEN, pressed, behind):
                continue
            at = self.compare(self.gap(part, side))
            if kind == "rigid":
                if at == 0 and self.compare(self.rate(part, side)) == 0:
                    found.append(pressed)
                continue
            if at > 0:
                continue
            waits = part.law == "unilateral"
            force = self.compare(self.press(part, side)) if waits else 1
            found += [pressed] * (force >= 0) + [behind] * (force <= 0 and waits)
            if at < 0:
                return found
        return [*found, OPEN]

    def lasts(self, states: tuple[int, ...], known: dict[int, int]) -> bool:
        """Whether states last by (5); those that are known leave their stops, or are elsewhere."""
        mode = self.mode(states)
        if mode is None:
            return False
        if any(self.compare(row) for row in mode.held):
            return False
        coefficients = self.series(mode, self.y)
        for row, owner in zip(mode.rows, mode.owners, strict=True):
            if owner in known:
                continue
            scale = float(np.abs(row) @ self.scale)
            for c in row @ coefficients[:, :6]:
                if abs(c) > CLEAR * scale:
                    if c < 0.0:
                        return False
                    break
                if abs(c) > ZERO * scale:
                    raise UndecidedError(f"states {states}: a margin of {c}")
        return True

    def decide(
        self, states: tuple[int, ...], forced: dict[int, int], number: int, loose: bool = False
    ) -> tuple[int, ...]:
        """The states from y on after an event of an element; those of ``forced`` are known."""
        options = [
            [forced[i]] if i in forced else self.choices(i, q, loose) for i, q in enumerate(states)
        ]
        if math.prod(map(len, options)) > 400:
            raise UndecidedError("too many states")
        found = [chosen for chosen in itertools.product(*options) if self.lasts(chosen, forced)]
        best = [c for c in found if not any(self.beats(other, c) for other in found)]
        if (
            number >= 0
            and self.kinds[number] == "friction"
            and len({self.closed(c) for c in best}) > 1
        ):
            raise UndecidedError("a contact opens as a joint sticks, or stays closed as it slips")
        kept = {c: {j for j, q in enumerate(c) if q == states[j] and j != number} for c in best}
        best = [c for c in best if not any(kept[other] > kept[c] for other in best)]
        if len(best) > 1 and self.alike(best):
            best.sort(key=lambda c: sum(map(operator.ne, c, states)))
            del best[1:]
        if len(best) != 1:
            raise UndecidedError(f"{len(best)} combinations of states last")
        held = self.mode(best[0])
        assert held is not None
        if len(held.held):  # rounding of the speeds that are prescribed from here on
            R = np.array([row[self.n : 2 * self.n] for row in held.held])
            lift = self.inverse @ R.T
            self.y[self.n : 2 * self.n] -= lift @ np.linalg.solve(R @ lift, held.held @ self.y)
        return best[0]

    def closed(self, states: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(q for q, kind in zip(states, self.kinds, strict=True) if kind == "rigid")

    def alike(self, several: list[tuple[int, ...]]) -> bool:
        """Whether they are one motion: of joints without speed on a contact that is at rest."""
        slopes = [mode.A @ self.y for mode in map(self.mode, several) if mode is not None]
        size = float(max(np.abs(slope).max() for slope in slopes))
        return all(float(np.abs(slope - slopes[0]).max()) <= ZERO * size for slope in slopes)

    def beats(self, other: tuple[int, ...], one: tuple[int, ...]) -> bool:
        """Whether the other differs by friction that sticks only: the law."""
        apart = [i for i, (a, b) in enumerate(zip(other, one, strict=True)) if a != b]
        return bool(apart) and all(self.kinds[i] == "friction" and other[i] == STICK for i in apart)

    # ---- (3) flights ----------------------------------------------------------------------------------

    def series(self, mode: Mode, y: Array) -> Array:
        """Taylor coefficients of y in steps of h, shape (size, DEGREE + 1)."""
        terms = [y]
        for k in range(1, DEGREE + 1):
            terms.append(mode.A @ terms[-1] * (mode.h / k))
        return np.array(terms).T

    def fly(self, mode: Mode, last: float) -> int | None:
        """Fly to the first margin that ends the mode, its number; None at ``last``."""
        silent = self.leave(mode, last)
        if isinstance(silent, int):
            return silent
        while self.time < last:
            self.scale = np.maximum(self.scale, np.abs(self.y))
            grid = mode.on_grid @ self.y
            room = int(min(STEPS, math.ceil((last - self.time) / mode.h)))
            values = np.vstack([mode.rows @ self.y, grid[:room]])
            values[:, list(silent)] = 1.0
            k = self.suspect(values)
            if k:
                self.advance(mode, k)
            hit = None
            if k < room:
                hit = self.within(mode, min(1.0, (last - self.time) / mode.h), silent)
            if hit is not None:
                return hit
            left = (last - self.time) / mode.h
            if left <= 1.0:
                self.to(mode, left)
                self.time = last
                return None
            if k < room:
                self.advance(mode, 1)
        return None

    def leave(self, mode: Mode, last: float) -> int | set[int]:
        """The first step, from margins that are zero; what stays zero, or the number of what ends it."""
        polynomials = mode.rows @ self.series(mode, self.y)
        silent, shift = set(), {}
        for j, c in enumerate(polynomials):
            scale = float(np.abs(mode.rows[j]) @ self.scale)
            if abs(c[0]) <= ZERO * scale or j in self.fresh:
                order = next(
                    (
                        k
                        for k in range(1, 6)
                        if abs(c[k]) > ZERO * scale or (j in self.fresh and k == 1)
                    ),
                    0,
                )
                if order:
                    shift[j] = order
                elif self.kinds[mode.owners[j]] == "rigid" and self.states[mode.owners[j]] == OPEN:
                    raise CrowdedError(f"contact {mode.owners[j]} is open and stays on its stop")
                else:
                    silent.add(j)
        hit = self.within(mode, min(1.0, (last - self.time) / mode.h), silent, shift)
        if hit is not None:
            return hit
        self.to(mode, min(1.0, (last - self.time) / mode.h))
        return silent

    def suspect(self, values: Array) -> int:
        """Steps that can be taken at once: up to the first where a margin may cross."""
        low = values[1:].min(axis=1) < 0.0
        if len(values) > 2:
            bend = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
            dips = (
                (values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:]) & (values[1:-1] < bend)
            )
            near = dips.any(axis=1)
            low[:-1] |= near
            low[1:] |= near
        return int(np.argmax(low)) if low.any() else len(low)

    def advance(self, mode: Mode, steps: int) -> None:
        self.y = mode.powers[steps - 1] @ self.y
        self.time += steps * mode.h
        self.set_waves()

    def to(self, mode: Mode, share: float) -> None:
        self.y = self.series(mode, self.y) @ share ** np.arange(DEGREE + 1)
        self.time += share * mode.h
        self.set_waves()

    def within(
        self, mode: Mode, share: float, silent: set[int], shift: dict[int, int] | None = None
    ) -> int | None:
        """The first margin that crosses within a share of a step, landed on; its number."""
        polynomials = mode.rows @ self.series(mode, self.y)
        found, orders = [], shift or {}
        for j, order in orders.items():  # divided by s^order: what remains begins above zero
            polynomials[j] = [*polynomials[j, order:], *[0.0] * order]
        values = (
            polynomials
            @ (share * np.linspace(0.0, 1.0, PARTS + 1)) ** np.arange(DEGREE + 1)[:, None]
        )
        low = (values[:, 1:] < 0.0).any(axis=1)
        places = (share * np.linspace(0.0, 1.0, PARTS + 1)) ** np.arange(DEGREE)[:, None]
        slopes = (polynomials[:, 1:] * np.arange(1, DEGREE + 1)) @ places
        low |= ((slopes[:, :-1] < 0.0) & (slopes[:, 1:] > 0.0)).any(axis=1)
        for j in np.flatnonzero(low):
            if j in silent:
                continue
            noise = CLEAR * float(np.abs(mode.rows[j]) @ self.scale)
            at = root(polynomials[j], share, values[j], 0.0 if j in orders else noise)
            if at is not None:
                found.append((at, int(j)))
        if not found:
            return None
        found.sort()
        at, j = found[0]
        for other, i in found[1:]:
            if (other - at) * mode.h < ZERO * self.time:
                rigid = all(self.kinds[mode.owners[k]] == "rigid" for k in (i, j))
                raise (CrowdedError if rigid else UndecidedError)(
                    f"margins {j} and {i} at one time"
                )
        self.to(mode, at)
        return j

    # ---- (4) impacts ----------------------------------------------------------------------------------

    def touching(
        self, states: tuple[int, ...], struck: set[tuple[int, int]]
    ) -> list[tuple[int, int]]:
        out = []
        for i, (part, kind) in enumerate(zip(self.parts, self.kinds, strict=True)):
            if kind != "rigid":
                continue
            for side in sides(part):
                closed = states[i] == (UPPER if side > 0 else LOWER)
                if struck and not closed and (i, side) not in struck:
                    row = self.gap(part, side)
                    if abs(row @ self.y) <= CLEAR * (np.abs(row) @ self.scale):
                        raise CrowdedError(f"contacts {i} and {struck}")
                elif closed or struck or self.at_stop(part, side):
                    out.append((i, side))
        return out

    def at_stop(self, part: Any, side: int) -> bool:
        """Whether a gap is zero; that of an open contact, whose flights are followed, is known well."""
        row = self.gap(part, side)
        return bool(abs(row @ self.y) <= ZERO * (np.abs(row) @ self.scale))

    def strike(self, states: tuple[int, ...], touching: list[tuple[int, int]]) -> dict[int, float]:
        """Speeds after the impact by (4), of contacts that touch; 0 where they stay."""
        n = self.n
        rows = np.array([-side * np.array(self.parts[i].row) for i, side in touching])
        speeds = np.array([self.rate(self.parts[i], side) @ self.y for i, side in touching])
        fast = max(1e-300, float(self.scale[n : 2 * n].max()))
        speeds[[states[i] != OPEN for i, _ in touching]] *= (
            np.abs(speeds[[states[i] != OPEN for i, _ in touching]]) > ZERO * fast
        )
        r = np.array([self.parts[i].restitution[side > 0] for i, side in touching])
        G = rows @ self.inverse @ rows.T
        for count in range(1, len(touching) + 1):
            for chosen in itertools.combinations(range(len(touching)), count):
                at = list(chosen)
                block = G[np.ix_(at, at)]
                if np.linalg.cond(block) > 1e8:
                    continue
                p = np.zeros(len(touching))
                p[at] = np.linalg.solve(block, -(1.0 + r[at]) * speeds[at])
                after = speeds + G @ p
                if p.min() < -ZERO * fast or (after + r * speeds).min() < -ZERO * fast:
                    continue
                self.y[n : 2 * n] += self.inverse @ rows.T @ p
                after[at] = -r[at] * speeds[at]
                return {i: float(w) for (i, _), w in zip(touching, after, strict=True)}
        raise UndecidedError("no impulses")

    # ---- the motion -----------------------------------------------------------------------------------

    def switch_at(self, i: int) -> tuple[float, int]:
        """When element i takes its next piece, and which."""
        pieces = self.arcs[i]
        omega = self.parts[i].omega
        angle = self.phase * (omega / self.first) + omega * self.time
        best = None
        for k, (begin, _, _) in enumerate(pieces):
            left = (begin - angle) % (2.0 * math.pi)
            if left < 1e-9 or left > 2.0 * math.pi - 1e-9:
                left = 2.0 * math.pi if self.states[i] == k else 0.0 if self.time == 0.0 else left
            if left < 1e-9:
                left += 2.0 * math.pi
            if best is None or left < best[0]:
                best = left, k
        assert best is not None
        return self.time + best[0] / omega, best[1]

    def record(self, kind: str, number: int) -> None:
        self.events.append(Event(self.time, kind, number, self.y[: self.n].copy(), self.states))

    def begin(self) -> None:
        states = []
        for i, kind in enumerate(self.kinds):
            state = 0
            if kind == "switch":
                omega = self.parts[i].omega
                angle = self.phase * (omega / self.first)
                state = min(
                    range(len(self.arcs[i])),
                    key=lambda k: (angle - self.arcs[i][k][0]) % (2 * math.pi),
                )
            states.append(state)
        self.fresh: set[int] = set()
        self.states = tuple(states)
        self.states = self.decide(self.states, self.departing({}), -1, loose=True)

    def departing(self, speeds: dict[int, float]) -> dict[int, int]:
        """Contacts that are open, since they leave their stops or are elsewhere."""
        forced = {}
        fast = float(self.scale[self.n : 2 * self.n].max())
        for i, (part, kind) in enumerate(zip(self.parts, self.kinds, strict=True)):
            if (kind == "rigid" and i in speeds and speeds[i] > SLOW * fast) or (
                kind == "rigid"
                and i not in speeds
                and not any(self.at_stop(part, side) for side in sides(part))
            ):
                forced[i] = OPEN
        return forced

    def run(self, t_max: float, events: int = 100_000) -> list[Event]:
        """Events up to a time, in order; raises UndecidedError, with ``events`` up to there kept."""
        self.begin()
        while self.time < t_max and len(self.events) < events:
            mode = self.mode(self.states)
            assert mode is not None
            switches = [(*self.switch_at(i), i) for i in self.arcs]
            when, piece, number = min(switches, default=(math.inf, 0, -1))
            hit = self.fly(mode, min(t_max, when))
            self.fresh = set()
            if hit is not None:
                self.end_of(mode.owners[hit], mode.rows[hit])
            elif when < t_max:
                self.switched(number, piece)
            else:
                break
        return self.events

    def switched(self, i: int, piece: int) -> None:
        states = list(self.states)
        states[i] = piece
        self.states = tuple(states)
        begin, arc, starts = self.arcs[i][piece]
        assert begin >= 0.0
        impulses = self.parts[i].impulses
        struck = False
        if starts and impulses and any(impulses[arc]):
            self.y[self.n : 2 * self.n] += self.inverse @ np.array(impulses[arc])
            struck = True
        speeds: dict[int, float] = {}
        closed = [(j, s) for j, s in self.touching(self.states, set())]
        if struck and any(self.compare(self.rate(self.parts[j], s)) < 0 for j, s in closed):
            speeds = self.strike(self.states, closed)
        elif struck:
            speeds = {j: float(self.rate(self.parts[j], s) @ self.y) for j, s in closed}
        self.settle("change", i, speeds)

    def end_of(self, i: int, row: Array) -> None:
        if self.kinds[i] != "rigid":
            self.settle("change", i, {})
            return
        if self.states[i] != OPEN:
            self.settle("release", i, {})
            return
        part = self.parts[i]
        side = next(s for s in sides(part) if np.array_equal(row, self.gap(part, s)))
        fast = float(self.scale[self.n : 2 * self.n].max())
        r, mode = part.restitution[side > 0], self.mode(self.states)
        assert mode is not None
        speeds = self.strike(self.states, self.touching(self.states, {(i, side)}))
        if not 0.0 < speeds[i] <= SLOW * fast:
            self.settle("impact", i, speeds)
            return
        pull = -float(self.rate(part, side) @ mode.A @ self.y)
        if pull <= 0.0 or r == 1.0:
            raise UndecidedError("a touch")
        self.settle("rest", i, speeds)
        if self.states[i] == OPEN:
            raise UndecidedError("a touch")
        left = 2.0 * speeds[i] / (pull * (1.0 - r))  # (6)
        e, slope = self.events[-1], self.y[self.n : 2 * self.n]
        self.events[-1] = e._replace(time=e.time + left, position=e.position + left * slope)

    def refuse_low_bounces(self, speeds: dict[int, float]) -> None:
        """Another event within a bounce too low to be told from rest: neither is decided."""
        for j, (part, kind) in enumerate(zip(self.parts, self.kinds, strict=True)):
            if kind == "rigid" and self.states[j] == OPEN and j not in speeds:
                for side in sides(part):
                    row = self.gap(part, side)
                    if abs(row @ self.y) <= CLEAR * (np.abs(row) @ self.scale):
                        raise CrowdedError(f"contact {j} bounces")

    def settle(self, kind: str, i: int, speeds: dict[int, float]) -> None:
        """Decide the states after an event, and record it."""
        forced = self.departing(speeds) if speeds else {
            j: OPEN for j, k in enumerate(self.kinds) if k == "rigid" and self.states[j] == OPEN
            and not (j == i and kind == "release")
        }  # fmt: skip
        if kind == "change":
            self.refuse_low_bounces(speeds)
        fast = float(self.scale[self.n : 2 * self.n].max())
        for j, w in speeds.items():  # too slow to bounce again: (6)
            if j not in forced and abs(w) > 0.0:
                row = np.array(self.parts[j].row)
                lift = self.inverse @ row
                rate = self.rate(self.parts[j], 1) @ self.y
                self.y[self.n : 2 * self.n] += lift * rate / (row @ lift)
                assert abs(w) <= SLOW * fast
        self.states = self.decide(self.states, forced, i)
        mode = self.mode(self.states)
        assert mode is not None
        self.fresh = {
            k for k, owner in enumerate(mode.owners)
            if self.kinds[owner] == "rigid" and self.states[owner] == OPEN and speeds.get(owner, 0.0) > 0.0
            and self.compare(mode.rows[k]) == 0
        }  # fmt: skip
        self.record(kind, i)


def sides(part: Any) -> list[int]:
    return [side for side in (1, -1) if math.isfinite(limit(part, side))]


def limit(part: Any, side: int) -> float:
    return float(part.upper if side > 0 else part.lower)


def arcs_of(switch: Any) -> list[tuple[float, int, bool]]:
    """Begin, number of the arc, and whether it begins there, of pieces up to half a turn long."""
    out = []
    turn = 2.0 * math.pi
    for k, begin in enumerate(switch.phases):
        end = switch.phases[k + 1] if k + 1 < len(switch.phases) else switch.phases[0] + turn
        pieces = max(1, math.ceil((end - begin) / math.pi - 1e-12))
        out += [((begin + (end - begin) * j / pieces) % turn, k, j == 0) for j in range(pieces)]
    return out


def value(c: list[float], s: float) -> float:
    """A polynomial by Horner's rule."""
    out = 0.0
    for one in reversed(c):
        out = out * s + one
    return out


def root(c: Array, share: float, values: Array, noise: float) -> float | None:
    """The first place in (0, share] where a polynomial with these values falls below zero: (3).

    It begins above; a minimum within ``noise`` of zero is a near miss.
    """
    at = [share * k / PARTS for k in range(PARTS + 1)]
    g = c.tolist()
    slope = [k * x for k, x in enumerate(g)][1:]
    for k in range(1, PARTS + 1):
        if values[k] < 0.0:
            return at[k - 1] if values[k - 1] <= 0.0 else zero(g, at[k - 1], at[k])
        if value(slope, at[k - 1]) < 0.0 < value(slope, at[k]):
            lowest = zero(slope, at[k - 1], at[k])
            least = value(g, lowest)
            if abs(least) < noise:
                raise UndecidedError("a near miss")
            if least < 0.0:
                return zero(g, at[k - 1], lowest)
    return None


def zero(c: list[float], low: float, high: float) -> float:
    return float(brentq(lambda s: value(c, s), low, high, xtol=1e-16, rtol=1e-15))
