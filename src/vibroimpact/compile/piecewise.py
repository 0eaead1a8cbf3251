"""Compile a mechanism with elements: one mode for every state of each, in common coordinates.

A mode is a state of every element and a set of closed contacts. With x the coordinates, v their
velocities and w = (sin theta, cos theta) of every line,

    M v' = f0 + F w - K x - C v + forces of the states + R^T mu,    R v = s(t)              (1)

R are the rows of the constraints: contacts that are closed move with their stops, friction that
sticks with its belt. They give mu, and with it contact and friction forces, as rows on (x, v, w, 1):

    mu = (R M^-1 R^T)^-1 (s' - R M^-1 (the other forces))                                    (2)

All modes have the coordinates y = (x_1, v_1 / scale, ..., sin theta, cos theta), scale a power of two,
so that a change of state leaves y as it is; a mode with constraints is entered by

    v <- v - M^-1 R^T (R M^-1 R^T)^-1 (R v - s)                                              (3)

Coordinates z without mass have no velocity among y: their equations of (1) give v_z as rows, which
are put in wherever v_z stands (4). The unused entry of y is 1, for the constant part of v_z, and returns
there, so that a tangent vector loses its part along it.

A slider is friction on one such coordinate. While it sticks, v_z is that of its belt and the equation of z
gives its force; while it slips and no dashpot holds it and what dashpots join to it (model/dashpots.py),
the forces g on all these z balance, and

    g' = -scale g                                                                           (5)

gives v_z: from g = 0, where slipping begins, g stays zero, and what rounding leaves of it dies out.

Frictions on the same line (model/friction_lines.py) are one: the first of them holds it, up to the sum of
the levels, and all have its limits and states. A mode in which they have others does not occur.

Each element gives its rows (compile/elements/).

(theory.md, "Elements").
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

from vibroimpact._core import linear
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.linear import Matrix, Vector, apply, dot, product, transpose
from vibroimpact._core.scalars import (
    DIFFERENTIABLE,
    ROUNDING_PER_TERM,
    cleared,
    greatest,
    is_infinite,
    least,
    rounded_down,
    square_root,
)
from vibroimpact.compile.coordinates import STEP_ANGLE, ModeCoordinates, energy_norm, units_of
from vibroimpact.compile.elements.element import (
    Constraint,
    ElementRows,
    Hold,
    Limits,
    StateRows,
    plus,
)
from vibroimpact.compile.elements.rigid_stop import RigidStopRows
from vibroimpact.compile.elements.table import ROWS
from vibroimpact.compile.modes import (
    STEP_BITS,
    ElementOfKernel,
    Guard,
    Jump,
    Law,
    Mode,
    Watch,
    Work,
    closed_from_code,
    code_of,
    contact_laws,
)
from vibroimpact.compile.pace import PACE_RATIO, paced_rate
from vibroimpact.compile.reduction import Closed
from vibroimpact.model.dashpots import Weights, loose_groups
from vibroimpact.model.friction_lines import along_line, friction_lines
from vibroimpact.model.mechanism import Mechanism, held_last, with_mass
from vibroimpact.model.stop import Stop

STATES_PER_ELEMENT = 7  # an element has so many states in a code
MOST_MODES_AT_FIRST = 32  # up to this number of modes, all are built at first
HELD_TOGETHER = "mobility of the contacts that are closed and the friction that sticks"
# Sine squared of the angle of two lines: forces of each are good to half the digits.
SAME_LINE_SINE_SQUARED = 2.0**-26


def code_of_states(states: tuple[int, ...], contacts: int) -> int:
    """Code of the mode with these states and no closed contact."""
    number = sum(int(state) * STATES_PER_ELEMENT**i for i, state in enumerate(states))
    return int(number * 3**contacts)


def states_from_code(code: int, contacts: int, elements: int) -> tuple[int, ...]:
    """State of each element in a mode of this code."""
    code //= 3**contacts
    return tuple(code // STATES_PER_ELEMENT**i % STATES_PER_ELEMENT for i in range(elements))


def state_in(m: Mechanism, code: int, contact: int) -> int:
    """State of an element, no rigid stop, in a mode of this code."""
    contacts = len(m.rigid_stops)
    return states_from_code(code, contacts, len(m.switching))[contact - contacts]


class Light(NamedTuple):
    """Coordinates without mass in one mode."""

    speeds: dict[int, Vector]  # (4): v / scale of each, rows on (y, 1), by coordinate
    held: dict[int, Vector]  # force of each slider that sticks, by number of the element
    # sum g of the forces on each slider that slips and on what moves with it, by number of the element; a slider
    # that a dashpot holds has none
    balance: dict[int, Vector]
    # a slider that slips though no spring holds it and what moves with it, which cannot be
    idle: int | None = None


NO_LIGHT = Light({}, {}, {})


@dataclass(frozen=True)
class Forces:
    """Equations (1) of one mode: everything but the constraints as rows on (y, 1)."""

    pull: Matrix
    constraints: list[Constraint]
    multipliers: Matrix  # (2), rows on (y, 1)
    light: Light
    never: int | None = None  # an element that cannot be in its state beside the others


class Piecewise:
    """A mechanism with elements as modes, guards and jumps, in numbers of any kind (scalars.py).

    Where events are searched for (``searched``), modes are in units of their own (``units_of``), and the
    step is that of the pace of the motions, where it is given (pace.py).
    """

    dense, mixed = True, False

    def __init__(self, mechanism: Mechanism, *, searched: bool = False, pace: float = 0.0) -> None:
        self.mechanism = m = mechanism
        self.lines, self.degrees = len(m.forces), m.degrees
        self.size = 2 * (self.degrees + self.lines)
        self.light = m.massless
        self.sliders = m.sliders
        self.shared = friction_lines(m.switching, [*self.sliders])
        self.first_on_line = {i: first for first, line in self.shared.items() for i in line}
        self.heavy = with_mass(m)
        self.mass = [[m.mass[i][j] for j in self.heavy] for i in self.heavy]
        self._by_mass = linear.solver_of_definite(self.mass)
        self.omegas = [force.omega for force in m.forces]
        self.kappas = [1.0] * self.lines
        self.own = self._rate()
        self.most_pace = PACE_RATIO * self.own
        self.rate = paced_rate(self.own, pace) if searched else self.own or 1.0
        self.scale = rounded_down(self.rate, 1)
        self.rows = StateRows(self.degrees, self.omegas, self.scale)
        self.rigid = [RigidStopRows(stop, self.rows) for stop in m.rigid_stops]
        self.parts: list[ElementRows[Any]] = [ROWS[e.kind](e, self.rows) for e in m.switching]
        self._check_lines()
        self.units = list[float]()
        if searched:
            flow = self._flow(self._forces((), tuple(0 for _ in m.switching)))
            self.units = units_of(m, flow, self.scale)
        self.free = self._coordinates(Forces([], [], [], NO_LIGHT))
        self.resets = self._resets()
        self.given = any(e.whole for e in m.switching)
        self.elements = [
            ElementOfKernel(
                sum(1 << s for s in e.states), e.is_stop, any(e.row[i] for i in self.light if e.row)
            )
            for e in m.switching
        ]

    @cached_property
    def step(self) -> float:
        """Step of the flights of a mode whose norm is no larger than the rate."""
        return rounded_down(STEP_ANGLE / self.rate, STEP_BITS)

    def _check_lines(self) -> None:
        """Refuse frictions on nearly the same line: by what holds one, the other is not determined."""
        frictions = [
            (number, e) for number, e in enumerate(self.mechanism.switching)
            if e.holding is not None and number not in self.sliders
        ]  # fmt: skip
        first = len(self.rigid)
        for (i, one), (j, other) in itertools.combinations(frictions, 2):
            rows = [list(one.row), list(other.row)]
            if linear.null_space(rows) is None:
                continue  # the same
            (a, b), (_, c) = product(rows, self._accelerations(transpose(rows)))
            if a * c - b * b <= SAME_LINE_SINE_SQUARED * (a * c):
                raise InvalidParameterError(
                    f"elements[{first + i}] and elements[{first + j}]: frictions on nearly the same line (rows "
                    f"{one.row} and {other.row}), so that the force of each is not determined while both "
                    "stick. Make one row a multiple of the other, or let them differ more."
                )

    def _is_parted(self, states: tuple[int, ...]) -> bool:
        """Whether frictions on the same line have states that cannot be together."""
        return any(
            states[i] != along_line(states[first], factor)
            for first, line in self.shared.items()
            for i, factor in line.items()
        )

    def _level(self, number: int) -> float:
        """Level up to which a friction holds its line, those of others on it included."""
        line, elements = self.shared.get(number, {number: 1.0}), self.mechanism.switching
        return sum(abs(factor) * elements[i].grip.static for i, factor in line.items())

    def _share(self, number: int) -> float:
        """Part of the force that holds its line, along the row of the first on it, that a friction carries."""
        first = self.first_on_line.get(number, number)
        if (first == number and number not in self.shared) or not (level := self._level(first)):
            return float(number == first)
        own = self.mechanism.switching[number].grip.static
        return own / level if self.shared[first][number] > 0.0 else -own / level

    def _rate(self) -> float:
        """Rate of the motion with all soft stops pressed, as a scale."""
        m = self.mechanism
        stiff = [[abs(x) for x in row] for row in m.stiffness]
        damp = [[abs(x) for x in row] for row in m.damping]
        for e in m.switching:
            for k, c in e.stiffest:
                square = [[abs(x * y) for y in e.row] for x in e.row]
                stiff, damp = linear.plus(stiff, square, k), linear.plus(damp, square, c)
        norms = [self._rate_norm(self._accelerations(a)) for a in (stiff, damp)]
        rates = [square_root(norms[0]), norms[1], *self.omegas]
        for flow in (linear.absolute(a) for e in m.switching for a in e.flows):
            rates.append(square_root(linear.row_sum_norm(product(flow, flow))))
        return greatest([*rates, 2.0**-500]) if any(rates) else 0.0

    def _rate_norm(self, a: Matrix) -> float:
        """Row sum norm, of which massless coordinates, in a unit of their own, may be at most half."""
        own = linear.row_sum_norm([[row[j] for j in self.heavy] for row in a])
        return (
            least([linear.row_sum_norm(a), 2.0 * own])
            if self.light and own
            else linear.row_sum_norm(a)
        )

    def _accelerations(self, forces: Matrix) -> Matrix:
        """M^-1 of rows of forces; zero for coordinates without mass."""
        solved = self._by_mass([forces[i] for i in self.heavy])
        out = linear.zeros(self.degrees, len(forces[0]))
        for i, row in zip(self.heavy, solved, strict=True):
            out[i] = row
        return out

    @cached_property
    def codes(self) -> list[int]:
        """Modes that are built at first: all, all without closed contacts, or the free one."""
        m, contacts = self.mechanism, len(self.rigid)
        states = list(itertools.product(*(e.states for e in m.switching)))
        sides = [
            [0, *(s for s in (1, -1) if not is_infinite(Stop(i, s).limit(m.elements)))]
            for i in range(contacts)
        ]
        closed = list(itertools.product(*sides))
        if len(states) > MOST_MODES_AT_FIRST:
            return [0]
        if len(states) * len(closed) > MOST_MODES_AT_FIRST:
            closed = closed[:1]
        pairs = itertools.product(closed, states)  # open ones come first
        return [
            code_of(stops) + code_of_states(taken, contacts)
            for sides_, taken in pairs
            for stops in [tuple(Stop(i, s) for i, s in enumerate(sides_) if s)]
            if self._exists(stops, taken)
        ]

    def _exists(self, closed: Closed, states: tuple[int, ...]) -> bool:
        """Whether the forces of a mode's constraints are determined."""
        m = self.mechanism
        rows = [list(m.rigid_stops[i].row) for i, _ in closed]
        rows += [
            list(e.row) for e, state in zip(m.switching, states, strict=True) if state == e.holding
        ]
        return not rows or linear.null_space(rows) is not None

    def mode(self, code: int) -> Mode:
        """Compile the mode with this code."""
        closed, states = self._read(code)
        forces = self._forces(closed, states)
        mode = Mode(
            code, self._coordinates(forces), self._guards(closed, forces),
            self._watches(states, forces, len(closed)), self._work(states, forces, len(closed)),
        )  # fmt: skip
        return mode.rows_in(self.units) if self.units else mode

    def prescribed_mode(self, code: int) -> Mode:
        """The mode of a motion whose events are known: nothing that only a search for them asks for.

        The flow has no step and no norm, the mode no map by which it is entered, and no work of elements.
        """
        closed, states = self._read(code)
        forces = self._forces(closed, states)
        b, constant = self._equations(forces)
        return Mode(
            code, replace(self._places(forces), flow={"b": b, "constant": constant}),
            self._guards(closed, forces), self._watches(states, forces, len(closed)), [],
        )  # fmt: skip

    def _read(self, code: int) -> tuple[Closed, tuple[int, ...]]:
        """Closed stops and states of a mode."""
        contacts = len(self.rigid)
        closed = closed_from_code(code, contacts)
        return closed, states_from_code(code, contacts, len(self.parts))

    def _resets(self) -> list[Jump]:
        """Maps of y that watches name by their number: the resets and impulses of all elements."""
        out = list[Jump]()
        for e in self.mechanism.switching:
            if e.whole:
                nothing = linear.identity(self.degrees), [0.0] * self.degrees
                out.append(self._reset(*nothing)._replace(kind="kept"))
            out += [self._reset(jump.matrix, jump.shift) for jump in e.resets]
            for impulse in e.own_impulses:
                change = self._accelerations([[x] for x in impulse])
                shift = [0.0] * self.size
                for i, (x,) in enumerate(change):
                    unit = self.units[2 * i + 1] if self.units else 1.0
                    shift[2 * i + 1] = x / self.scale / unit
                out.append(Jump(linear.identity(self.size), shift, "impulse"))
        return out

    def _reset(self, matrix: Matrix, shift: Vector) -> Jump:
        """Map of y by which positions x, all without mass, become matrix x + shift."""
        whole, moved = linear.identity(self.size), [0.0] * self.size
        units = self.units[: 2 * self.degrees : 2] or [1.0] * self.degrees
        for i, row in enumerate(matrix):
            for j, x in enumerate(row):
                whole[2 * i][2 * j] = x * units[j] / units[i]
            moved[2 * i] = shift[i] / units[i]
            whole[2 * i + 1][2 * i + 1], moved[2 * i + 1] = 0.0, 1.0  # unused
        return Jump(whole, moved, "reset")

    # ---- equations -------------------------------------------------------------------------------

    def _forces(self, closed: Closed, states: tuple[int, ...]) -> Forces:
        m, n = self.mechanism, self.degrees
        pull = [[0.0] * (self.size + 1) for _ in range(n)]
        for i in range(n):
            for j in range(n):
                pull[i][2 * j] = -m.stiffness[i][j]
                pull[i][2 * j + 1] = -m.damping[i][j] * self.scale
            for line, force in enumerate(m.forces):
                pull[i][2 * (n + line)] = force.sine[i]
                pull[i][2 * (n + line) + 1] = force.cosine[i]
            pull[i][-1] = m.constant_force[i]
        constraints: list[Constraint] = []
        held: dict[int, ElementRows[Any]] = {}
        never = len(self.parts) if self._is_parted(states) else None
        constraints += [self.rigid[i].constraint() for i, _ in closed]
        for number, (part, state) in enumerate(zip(self.parts, states, strict=True)):
            if state != part.element.holding:
                part.add_force(pull, state)
            elif number in self.sliders:
                held[number] = part
            elif self.first_on_line.get(number, number) == number:
                row = list(part.element.row)
                if linear.null_space([*(c.row for c in constraints), row]) is None:
                    never = number
                else:
                    constraints.append(part.constraint())
        light = self._without_mass(pull, held)
        pull = [self._put_in(row, light.speeds) for row in pull]
        for number, part in held.items():
            at, row = self.sliders[number], part.element.row
            light.held[number] = [-x / row[at] for x in pull[at]]
            for i, x in enumerate(row):
                pull[i] = plus(pull[i], light.held[number], x)
        multipliers = self._multipliers(pull, constraints)
        return Forces(pull, constraints, multipliers, light, light.idle if never is None else never)

    def _without_mass(self, pull: Matrix, held: dict[int, ElementRows[Any]]) -> Light:
        """Solve (4) and (5) for the speeds of coordinates without mass."""
        speeds = {
            self.sliders[number]: self._held_speed(number, part) for number, part in held.items()
        }
        holder = {i: number for number, i in self.sliders.items()}
        unknown = [i for i in held_last(self.mechanism) if i not in speeds]
        groups = loose_groups([row[1 : 2 * self.degrees : 2] for row in pull], unknown)
        given = [i for i in unknown if i not in groups]
        speeds |= self._solved(given, [self._put_in(pull[i], speeds) for i in given])
        balance = {i: self._balance(pull, weights) for i, weights in groups.items()}
        rates = [self._put_in(self._rate_of_balance(row), speeds) for row in balance.values()]
        idle = self._idle(pull, groups, rates)
        moved = (
            self._solved([*groups], rates)
            if idle is None
            else {i: [0.0] * (self.size + 1) for i in groups}
        )
        speeds = {i: self._put_in(row, moved) for i, row in speeds.items()} | moved
        return Light(
            speeds, {}, {holder[i]: row for i, row in balance.items()},
            None if idle is None else holder[idle],
        )  # fmt: skip

    def _solved(self, coordinates: list[int], rows: Matrix) -> dict[int, Vector]:
        """Speeds / scale of coordinates, for which these rows vanish."""
        slots = [2 * i + 1 for i in coordinates]
        own = [[-row[j] for j in slots] for row in rows]
        rest = [[0.0 if j in slots else x for j, x in enumerate(row)] for row in rows]
        inverse = linear.solve_regular(own, linear.identity(len(own)))
        terms = product(linear.absolute(inverse), linear.absolute(rest)) if rest else []
        found = map(_cleared, linear.solve_regular(own, rest), terms)
        return dict(zip(coordinates, found, strict=True))

    def _balance(self, pull: Matrix, weights: Weights) -> Vector:
        """Sum of the forces on a group that moves as one (dashpots.py): no speeds are in it."""
        total = [0.0] * (self.size + 1)
        for i, weight in weights.items():
            total = plus(total, pull[i], weight)
        total[1 : 2 * self.degrees : 2] = [0.0] * self.degrees
        return total

    def _idle(self, pull: Matrix, groups: dict[int, Weights], rates: Matrix) -> int | None:
        """Find a slider that slips with a group which no spring holds, so that its forces cannot balance."""
        block = [[-row[2 * i + 1] for i in groups] for row in rates]
        sizes = [
            sum(abs(a * pull[i][2 * j] * b) for i, a in d.items() for j, b in d.items())
            for d in groups.values()
        ]
        lost = linear.eliminated(block, sizes)[1]
        return [*groups][lost[0]] if lost else None

    def _held_speed(self, number: int, part: ElementRows[Any]) -> Vector:
        """Speed / scale of the coordinate of a slider that sticks, by r v = s."""
        at, row = self.sliders[number], part.element.row
        others = [0.0 if j == at else x for j, x in enumerate(row)]
        moved = plus(self.rows.waves(part.held_speed), self.rows.velocity(others), -1.0)
        return [x / (self.scale * row[at]) for x in moved]

    def _rate_of_balance(self, row: Vector) -> Vector:
        """Return the row that is zero where (5), over scale, holds.

        ``row`` is that of g, on positions, waves and 1.
        """
        out = list(row)
        for i in range(self.degrees):
            out[2 * i + 1] = row[2 * i]
        for line, omega in enumerate(self.omegas):
            at = 2 * (self.degrees + line)
            turn = omega / self.scale
            out[at] = out[at] - turn * row[at + 1]
            out[at + 1] = out[at + 1] + turn * row[at]
        return out

    def _put_in(self, row: Vector, speeds: dict[int, Vector]) -> Vector:
        """Replace the speeds of coordinates without mass in a row by the rows that give them."""
        out = list(row)
        for i in speeds:
            out[2 * i + 1] = 0.0
        terms = list(map(abs, out))
        for i, speed in speeds.items():
            out = plus(out, speed, row[2 * i + 1])
            terms = plus(terms, list(map(abs, speed)), abs(row[2 * i + 1]))
        return _cleared(out, terms) if speeds else out

    def force_rows(self, code: int) -> Matrix:
        """Force of every element along its row in a mode, as rows on (x, v, w, 1).

        x_i and v_i / scale alternate, as in y.
        """
        closed, states = self._read(code)
        forces = self._forces(closed, states)
        nothing = self.rows.constant()
        at_rest = dict(zip([i for i, _ in closed], forces.multipliers, strict=False))
        rows = [at_rest.get(i, nothing) for i in range(len(self.rigid))]
        return [*rows, *(work.force for work in self._work(states, forces, len(closed)))]

    def gap_row(self, number: int) -> Vector:
        """Gap coordinate ``row . x`` of an element, relative to what moves, as a row on (x, v, w, 1)."""
        return [*self.rigid, *self.parts][number].gap

    def _work(self, states: tuple[int, ...], forces: Forces, closed: int) -> list[Work]:
        """Force and speed of every element that switches."""
        nothing, speeds = self.rows.constant(), forces.light.speeds
        held = iter(forces.multipliers[closed:])
        on_line: dict[int, Vector] = {}  # what holds a line, by the first on it
        out = []
        for number, (part, state) in enumerate(zip(self.parts, states, strict=True)):
            if state == part.element.holding:
                force = forces.light.held.get(number)
                if force is None:
                    first = self.first_on_line.get(number, number)
                    if first == number and number != forces.never:
                        on_line[number] = next(held, nothing)
                    force = [self._share(number) * x for x in on_line.get(first, nothing)]
                out.append(Work(force, nothing))
            elif (found := part.force(state)) is None:
                out.append(Work(nothing, nothing))
            else:
                row, sign = found
                force = self._put_in([sign * x for x in row], speeds)
                out.append(Work(force, self._put_in(part.speed, speeds)))
        return out

    def _multipliers(self, pull: Matrix, constraints: list[Constraint]) -> Matrix:
        """Multipliers (2) of the constraints as rows."""
        if not constraints:
            return []
        rows = [c.row for c in constraints]
        lift = self._accelerations(transpose(rows))
        free = product(transpose(lift), pull)
        wanted = [self.rows.waves(c.acceleration) for c in constraints]
        missing = [plus(a, b, -1.0) for a, b in zip(wanted, free, strict=True)]
        return linear.solve_definite(self._mobility(rows, lift), missing, HELD_TOGETHER)

    def _mobility(self, rows: Matrix, lift: Matrix) -> Matrix:
        mobility = product(rows, lift)
        if linear.null_space(rows) is None:
            raise InvalidParameterError(
                "contacts that are closed and friction that sticks constrain the same coordinate "
                "twice, so their forces are not determined. Remove one of them."
            )
        return mobility

    def _coordinates(self, forces: Forces) -> ModeCoordinates:
        c = self._places(forces)
        if forces.constraints:
            self._project(forces.constraints, c.from_v, c.particular, c.shift)
        c = replace(c, flow=self._flow(forces)) if forces.pull else c
        return c.in_units(self.units) if self.units else c

    def _places(self, forces: Forces) -> ModeCoordinates:
        """Positions and speeds in a mode, without its flow and what its constraints change at its begin."""
        n, size, lines, scale = self.degrees, self.size, self.lines, self.scale
        to_x, to_v = linear.zeros(n, size), linear.zeros(n, size)
        from_x, from_v = linear.zeros(size, n), linear.zeros(size, n)
        for i in range(n):
            to_x[i][2 * i] = from_x[2 * i][i] = 1.0
            if i in self.heavy:
                to_v[i][2 * i + 1] = scale
                from_v[2 * i + 1][i] = 1.0 / scale
        shift, particular = [0.0] * size, linear.zeros(size, 2 * lines)
        for i, speed in forces.light.speeds.items():
            to_v[i] = [scale * x for x in speed[:-1]]
            to_v[i][2 * i + 1] = scale * speed[-1]
            shift[2 * i + 1] = 1.0
        return ModeCoordinates({}, to_x, to_v, [0.0] * n, from_x, from_v, particular, shift)

    def _project(
        self, constraints: list[Constraint], from_v: Matrix, particular: Matrix, shift: Vector
    ) -> None:
        """Change the rows by which a mode is entered, as (3) does for its constraints."""
        rows = [c.row for c in constraints]
        lift = self._accelerations(transpose(rows))
        inverse = linear.solve_definite(
            self._mobility(rows, lift), linear.identity(len(rows)), HELD_TOGETHER
        )
        push = product(lift, inverse)
        for i in range(self.degrees):
            change = apply(transpose(rows), push[i])
            for j, x in enumerate(change):
                from_v[2 * i + 1][j] -= x / self.scale
            speeds = apply(transpose([c.speed for c in constraints]), push[i])
            for j, x in enumerate(speeds[:-1]):
                particular[2 * i + 1][j] = x / self.scale
            if i in self.heavy:
                shift[2 * i + 1] = speeds[-1] / self.scale

    def _equations(self, forces: Forces) -> tuple[Matrix, Vector]:
        """Matrix and constant of y' in a mode."""
        n, size = self.degrees, self.size
        total = [list(row) for row in forces.pull]
        terms = linear.absolute(total)
        for c, mu in zip(forces.constraints, forces.multipliers, strict=True):
            for i in range(n):
                total[i] = plus(total[i], mu, c.row[i])
                terms[i] = plus(terms[i], list(map(abs, mu)), abs(c.row[i]))
        total = list(map(_cleared, total, terms)) if forces.constraints else total
        acceleration = self._accelerations(total)
        b, constant = linear.zeros(size, size), [0.0] * size
        for i, speed in forces.light.speeds.items():
            b[2 * i] = [self.scale * x for x in speed[:-1]]
            constant[2 * i] = self.scale * speed[-1]
            b[2 * i + 1][2 * i + 1], constant[2 * i + 1] = -self.scale, self.scale
        for i in self.heavy:
            b[2 * i][2 * i + 1] = self.scale
            b[2 * i + 1] = [x / self.scale for x in acceleration[i][:-1]]
            constant[2 * i + 1] = acceleration[i][-1] / self.scale
        for line, omega in enumerate(self.omegas):
            at = 2 * (n + line)
            b[at][at + 1], b[at + 1][at] = omega, -omega
        return b, constant

    def _flow(self, forces: Forces) -> dict[str, object]:
        b, constant = self._equations(forces)
        norm = self._norm(b)
        if self.light and norm > 2.0 * (other := self._norm(self._in_own_units(b))):
            norm = other
        step = rounded_down(STEP_ANGLE / norm, STEP_BITS)
        energy, growth = self._energy(forces)
        return {
            "b": b, "constant": constant, "step": [step], "norm": energy, "growth": [growth],
        }  # fmt: skip

    def _energy(self, forces: Forces) -> tuple[Matrix, float]:
        """Norm of a mode and its growth rate; infinite where none is known.

        The forces that hold contacts and friction do no work on a motion that keeps their constraints
        at rest.
        """
        n, pull = self.degrees, forces.pull
        none = linear.zeros(self.size, self.size), math.inf
        if self.light or any(any(map(bool, c.speed)) for c in forces.constraints):
            return none
        k, c = ([[-x for x in row[at : 2 * n : 2]] for row in pull] for at in (0, 1))
        sizes = linear.plus(linear.absolute(k), linear.absolute(transpose(k)))
        if any(map(any, map(_cleared, linear.plus(k, transpose(k), -1.0), sizes))):
            return none  # a load of friction that depends on positions
        k, c = (linear.plus(a, transpose(a)) for a in (k, c))
        unit = linear.unit_of(self.mass)  # roots of masses have the same bits in every unit then
        stiffness, damping = linear.over(k, 2.0 * unit), linear.over(c, 2.0 * unit * self.scale)
        return energy_norm(self.size, linear.over(self.mass, unit), stiffness, damping, self.scale)

    def _norm(self, b: Matrix) -> float:
        """Row sum norm of a flow with velocities in the best scale, but not below half of its own.

        All modes have common coordinates, not a common rate: in a scale up to four times the common one,
        a step of 7/10 leaves out 4 0.7^19 / 19! < 2^-64 of the Taylor series of a flight. The entries by
        which lines push are not counted: a large unit of the lines makes them as small as one likes, and
        what the series leaves out is then as small against what the lines add to the motion in a step.
        """
        first = 2 * self.degrees
        sums = [[sum(map(abs, row[k:first:2])) for k in (0, 1)] for row in b[:first]]
        waves = [linear.row_sum_norm(b[first:])] if self.lines else []
        norms = []
        for scale in (0.25, 0.5, 1.0, 2.0, 4.0):
            own = [x / scale + v if i % 2 else x + v * scale for i, (x, v) in enumerate(sums)]
            norms.append(greatest([*own, *waves]))
        return greatest([least(norms), *(0.5 * (x + v) for x, v in sums)])

    def _in_own_units(self, b: Matrix) -> Matrix:
        """A flow with massless coordinates in units, powers of two, that make rows and columns alike.

        One that stands still, or that nothing depends on, has the unit in which its column or row is the scale.
        """
        rows, others = list(map(list, b)), range(2 * self.degrees)
        for i in [2 * i for i in self.light] * len(self.light):
            into = sum(abs(rows[i][j]) for j in others if j != i)
            out = sum(abs(rows[j][i]) for j in others if j != i)
            if not into and not out:
                continue
            both = into and out
            unit = square_root(into / out) if both else into / self.scale or self.scale / out
            unit = rounded_down(unit, 1)
            own, rows[i] = rows[i][i], [x / unit for x in rows[i]]
            for row in rows:
                row[i] = row[i] * unit
            rows[i][i] = own
        return rows

    # ---- guards ----------------------------------------------------------------------------------

    def _guards(self, closed: Closed, forces: Forces) -> list[Guard]:
        """Gaps of open contacts, forces of closed ones."""
        held = dict(zip(dict(closed), forces.multipliers, strict=False))  # contacts come first
        return [
            stop.closed(dict(closed)[i], held[i])
            if i in held
            else stop.open(pinned=self._is_pinned(stop, forces.constraints))
            for i, stop in enumerate(self.rigid)
        ]

    def _is_pinned(self, part: ElementRows[Any], constraints: list[Constraint]) -> bool:
        """Whether constraints determine row . v of an element, and it is the speed at which it is held."""
        rows, row, speed = [c.row for c in constraints], list(part.element.row), part.held_speed
        if not rows or linear.null_space([*rows, row]) is not None:
            return False
        across = [[dot(row, other)] for other in rows]
        shares = linear.solve_definite(product(rows, transpose(rows)), across, HELD_TOGETHER)
        size = linear.largest([speed])
        for (share,), c in zip(shares, constraints, strict=True):
            taken = [share * x for x in c.speed]
            speed, size = plus(speed, taken, -1.0), size + linear.largest([taken])
        return linear.largest([speed]) <= 2.0**-40 * size

    def _watches(self, states: tuple[int, ...], forces: Forces, closed: int) -> list[Watch]:
        if forces.never is not None:  # 0 >= 1: of two constraints alike one slips at speed zero
            return [Watch([0.0] * self.size, 0.0, 1.0, math.inf, forces.never)]
        watches: list[Watch] = []
        on_line: dict[int, list[Limits]] = {}  # limits of frictions that share one, by the first
        stuck = iter(forces.multipliers[closed:])
        resets = 0
        for number, (part, state) in enumerate(zip(self.parts, states, strict=True)):
            e, slider = part.element, number in self.sliders
            first, zero = self.first_on_line.get(number, number), None
            if first == number:
                hold, pinned = None, False
                if state == e.holding:
                    force = forces.light.held[number] if slider else next(stuck)
                    hold, zero = Hold(force, self._level(number)), None if slider else part.speed
                elif slider:
                    zero = forces.light.balance.get(number)
                elif state in e.slipping and self._is_pinned(part, forces.constraints):
                    pinned, zero = True, part.speed  # it slips at speed zero
                on_line[number] = part.limits(state, hold, pinned=pinned)
            found = [] if zero is None else [Limits(zero, 0.0, 0.0)]
            for row, lower, upper, jump, target in (*found, *on_line[first]):
                whole, reset = self._put_in(row, forces.light.speeds), resets + jump
                watches.append(
                    Watch(
                        whole[:-1], whole[-1], lower, upper, number, held=row is zero,
                        reset=reset if jump >= 0 else -1, target=target,
                    )
                )  # fmt: skip
            resets += e.whole + len(e.resets) + len(e.own_impulses)
        return watches

    def held_rows(self, code: int, held: Stop) -> Iterator[tuple[int, Vector, float]]:
        """Rows on (y, 1) of what a mode holds, a contact or an element: order, row, and the limit at which it stays.

        The order is 0 of the place, which of friction is anywhere and no limit, and 1 of the speed, which of
        coordinates without mass is no state.
        """
        contacts = len(self.rigid)
        rigid = held.contact < contacts
        part = self.rigid[held.contact] if rigid else self.parts[held.contact - contacts]
        if rigid:
            yield 0, part.gap, held.limit(self.mechanism.elements)
        if any(part.element.row[i] for i in self.heavy):
            speeds = self._forces(*self._read(code)).light.speeds
            yield 1, self._put_in(part.speed, speeds), 0.0

    def laws(self) -> list[Law]:
        """Jump at every contact."""
        return contact_laws(self.mechanism, self.free, self._accelerations)


def held_in(m: Mechanism, codes: Iterable[int]) -> list[Stop]:
    """What every one of some modes holds: stops that are rested on, and friction that sticks, with 1 as its side."""
    contacts, every = len(m.rigid_stops), []
    for code in codes:
        states = states_from_code(code, contacts, len(m.switching))
        sticks = [
            Stop(contacts + i, 1)
            for i, (e, state) in enumerate(zip(m.switching, states, strict=True))
            if e.holding is not None and state == e.holding
        ]
        every.append([*closed_from_code(code, contacts), *sticks])
    return [held for held in every[0] if all(held in others for others in every)]


def _cleared(row: list[Any], terms: Vector) -> list[Any]:
    """A row of sums with zeros where rounding of terms of these sizes left something.

    A speed or force that cannot change is then constant to the bit, and no rounding decides what it does. Jets keep
    what is left: their derivatives count.
    """
    return [
        x if isinstance(x, DIFFERENTIABLE) else cleared(x, ROUNDING_PER_TERM * size)
        for x, size in zip(row, terms, strict=True)
    ]
