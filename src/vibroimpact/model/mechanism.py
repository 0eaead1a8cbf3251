"""Mechanisms: masses, dashpots, springs, forces and stops.

A mechanism is

    M x'' + C x' + K x = f0 + sum over lines of (sine sin(omega t) + cosine cos(omega t))

with elements: rigid stops ``lower <= row . x <= upper``, each with its own restitution, soft stops, friction
(theory.md, "Model"). :mod:`vibroimpact.compile.hybrid` compiles it for the kernel.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact._core import linear
from vibroimpact._core.checks import (
    check_choice,
    check_flag,
    names_arguments,
    numbers,
    refusal,
    vector,
)
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import is_infinite
from vibroimpact._core.types import Floats
from vibroimpact._kernel import (
    BLOCK_CONTACTS,
    BLOCK_DEGREES,
    BLOCK_LINES,
    MAX_CONTACTS,
    MAX_DEGREES,
    MAX_LINES,
)
from vibroimpact.model.dashpots import linked, loose_groups
from vibroimpact.model.described import Described
from vibroimpact.model.elements.element import Element
from vibroimpact.model.elements.rigid_stop import FRICTIONLESS, RigidStop
from vibroimpact.model.elements.table import KINDS
from vibroimpact.model.harmonic import Harmonic, as_lines, empty

ImpactLaw = Literal["moreau", "sequential"]
# A limit that no list reaches: MOST_ELEMENTS is checked after the kinds.
UNBOUNDED_COUNT = 1_000_000
ZERO_OF_LARGEST = 1e-12  # a sum of entries below this share of the largest is zero to rounding
MOST_ELEMENTS = 8


def _square(name: str, value: ArrayLike, n: int | None = None) -> linear.Matrix:
    """Return a square matrix of finite floats as rows, or raise naming the matrix.

    One that is symmetric to rounding is made so exactly.
    """
    array = numbers(name, value, "a square matrix of numbers")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or (n and array.shape[0] != n):
        wanted = "(n, n)" if n is None else f"({n}, {n})"
        raise InvalidParameterError(f"{name} has shape {array.shape}; expected {wanted}.")
    rows: linear.Matrix = array.tolist()
    columns = linear.transpose(rows)
    if array.dtype == float and rows == columns:
        return rows
    if linear.largest(linear.plus(rows, columns, -1.0)) > 1e-12 * linear.largest(rows):
        return rows
    return [[x / 2.0 for x in row] for row in linear.plus(rows, columns)]


@names_arguments(
    friction=FRICTIONLESS, M="Give mass.", C="Give damping.", K="Give stiffness.",
    force="Give forces, a Harmonic each, or constant_force.",
)  # fmt: skip
@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanism(Described):
    """Masses, dashpots, springs, forces, stops and friction.

    Parameters
    ----------
    mass, damping, stiffness
        M (symmetric, positive definite), C and K, shape (n, n), 1 <= n <= 20. K may be singular:
        free masses are ordinary. Damping need not be proportional. C and K need not be symmetric:
        gyroscopic and circulatory forces, creep. Coordinates without mass, whose rows of M are zero,
        are first-order states, held by dashpots, or sliders, each held by friction.
    forces
        Harmonic lines, at most 12, those of moving stops and belts included.
    elements
        Rigid stops, soft stops, friction, phase switches, 1 to 16; at most 8 of them no rigid stops, and
        3^(rigid stops) 7^(others) below 2^31. They are put in order, rigid stops first; their numbers in
        results and in paths of parameters are those in this order.
    constant_force
        f0, shape (n,): gravity, preload.
    impact_law
        How contacts that touch at one instant share an impact. ``"moreau"``: all at once, one
        linear complementarity problem. ``"sequential"``: one after the other in the order of their
        numbers, round after round, until none approaches; rows of balls pass an impact on so.
    si
        Whether the numbers are in SI units, with all coordinates in metres; labels, tables and files then name them.

    Raises
    ------
    InvalidParameterError
        Wrong shapes, non-finite entries, M not positive definite, restitution outside [0, 1].
    """

    mass: linear.Matrix
    damping: linear.Matrix
    stiffness: linear.Matrix
    forces: tuple[Harmonic, ...] = ()
    constant_force: tuple[float, ...] = ()
    elements: tuple[Element, ...] = ()
    impact_law: ImpactLaw = "moreau"
    si: bool = field(default=False, compare=False)

    def __post_init__(self) -> None:
        check_flag("si", self.si)
        check_choice("impact_law", self.impact_law, list(get_args(ImpactLaw)))
        mass = _square("mass", self.mass)
        n = len(mass)
        if not 1 <= n <= MAX_DEGREES:
            raise InvalidParameterError(f"mass has {n} coordinates: must be 1 to {MAX_DEGREES}.")
        heavy = [i for i in range(n) if any(mass[i])]
        moved = [[mass[i][j] for j in heavy] for i in heavy]
        low = linear.cholesky(moved)
        if symmetric(mass) and (last := linear.dependent(moved, low)) is not None:
            raise InvalidParameterError(
                f"mass: is singular to rounding (condition number "
                f"{linear.condition_number(moved):.1e} in balanced units): coordinate {heavy[last]} has "
                "no inertia of its own beside the coordinates before it. Give it some, or remove it."
            )
        _check_symmetric(mass)
        if (not heavy and not self._is_whole()) or low is None:
            raise InvalidParameterError(
                "mass: must be positive definite, but for coordinates without mass (row and column zero). "
                f"{_advice(mass)}"
            )
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "damping", _square("damping", self.damping, n))
        object.__setattr__(self, "stiffness", _square("stiffness", self.stiffness, n))
        constant = (0.0,) * n if empty(self.constant_force) else self.constant_force
        object.__setattr__(self, "constant_force", vector("constant_force", constant, n))
        self._set_elements()
        self._set_lines()
        for i, element in enumerate(self.elements):
            element.check_size(n, f"elements[{i}]")
        self._check_massless()
        self._check_whole()
        for force in self.forces:
            vector("sine", force.sine, n)

    @property
    def massless(self) -> list[int]:
        """Coordinates without mass: first-order states, and sliders."""
        return [i for i, row in enumerate(self.mass) if not any(row)]

    @property
    def sliders(self) -> dict[int, int]:
        """Friction on a coordinate without mass: that coordinate, by the number among those that switch."""
        return {
            number: i
            for number, e in enumerate(self.switching)
            if e.holding is not None
            for i in self.massless
            if e.row[i]
        }

    def _check_massless(self) -> None:
        """Refuse a coordinate without mass that nothing holds, or that would need an impulse."""
        light = self.massless
        if not light:
            return
        self._check_sliders()
        self._check_dashpots()
        for i, e in enumerate(self.elements):
            e.check_massless(light, f"elements[{i}]")

    def _is_whole(self) -> bool:
        """Whether an element among what is given is all of the machine."""
        given: Any = self.elements
        return isinstance(given, tuple | list) and any(
            isinstance(element, Element) and element.whole for element in given
        )

    def _check_whole(self) -> None:
        """Refuse anything beside an element that is all of its machine."""
        for i, element in enumerate(self.elements):
            if element.whole and (len(self.elements) > 1 or len(self.massless) < self.degrees):
                raise InvalidParameterError(
                    f"elements[{i}]: a {element.kind.replace('_', ' ')} has all states of its machine. Take other "
                    "elements and masses away, or make them modes of the HybridSystem."
                )

    def _check_sliders(self) -> None:
        """Refuse friction on coordinates without mass whose forces or speeds are not determined."""
        light, sliders = self.massless, self.sliders
        for number, at in sliders.items():
            e, name = self.switching[number], f"elements[{len(self.rigid_stops) + number}]"
            if sum(1 for i in light if e.row[i]) > 1 or [*sliders.values()].count(at) > 1:
                raise InvalidParameterError(
                    f"{name}: of coordinates without mass each slider holds one of its own. Give the "
                    f"others than {at} a mass, or one friction for each."
                )

    def _check_dashpots(self) -> None:
        """Refuse coordinates without mass that nothing holds, or whose speeds are not determined."""
        free = [i for i in held_last(self) if i not in self.sliders.values()]
        both = linear.plus(self.damping, linear.transpose(self.damping))
        groups = loose_groups(both, held_last(self))
        loose = next((sorted(groups[i]) for i in free if i in groups), [])
        own = [[both[i][j] for j in free] for i in free]
        low = linear.cholesky(own)
        if loose or low is None or linear.dependent(own, low) is not None:
            raise InvalidParameterError(
                f"mass: coordinate {(loose or free)[0]} is massless, and neither a dashpot nor friction "
                "holds it (damping between massless coordinates must be positive definite). Give it a "
                "mass, a dashpot or friction, or remove it."
            )
        for last, weights in groups.items():
            if beside := linked(self.damping, weights):
                raise InvalidParameterError(
                    f"damping: no dashpot holds {_named(weights)} without mass where friction on "
                    f"coordinate {last} slips, and yet damping links this with coordinate {beside[0]}. "
                    f"Make damping symmetric, or give coordinate {last} a mass or a dashpot to one with "
                    "mass."
                )

    def _set_elements(self) -> None:
        """Put rigid stops first."""
        given = _several("elements", self.elements, tuple(KINDS.values()), 0, UNBOUNDED_COUNT)
        object.__setattr__(self, "elements", tuple(sorted(given, key=lambda e: not e.rigid)))
        rigid, others = len(self.rigid_stops), len(self.switching)
        many = 3**rigid * 7**others >= 2**31 or others > MOST_ELEMENTS
        if many or not 1 <= rigid + others <= MAX_CONTACTS:
            raise InvalidParameterError(
                f"elements: {rigid + others} are given; must be 1 to {MAX_CONTACTS}, at most "
                f"{MOST_ELEMENTS} of them no rigid stops, and with 3^(rigid stops) 7^(others) below 2^31. "
                "Stops on both sides of one coordinate are one, with lower and upper."
            )

    def _set_lines(self) -> None:
        """Make every frequency of a motion a forcing line, without force where none has it."""
        forces = list(_several("forces", self.forces, Harmonic, 0, MAX_LINES))
        nothing = (0.0,) * self.degrees
        for element in self.elements:
            for line in element.lines:
                if not any(line.omega is f.omega or line.omega == f.omega for f in forces):
                    forces.append(Harmonic(line.omega, nothing))
        if len(forces) > MAX_LINES:
            raise InvalidParameterError(
                f"forces: {len(forces)} frequencies are given; must be at most {MAX_LINES}, those of "
                "moving stops and belts included. Leave out the smallest."
            )
        object.__setattr__(self, "forces", tuple(forces))

    def __str__(self) -> str:
        """In one line what it has: repr has all numbers."""
        kinds = Counter(element.kind.replace("_", " ") for element in self.elements)
        held = ", ".join(
            f"{n} {kind}{'s' * (n > 1 and kind[-1] != 'n')}" for kind, n in kinds.items()
        )
        unit = " rad/s" if self.si else ""
        lines = ", ".join(f"{line.omega:.6g}" for line in self.forces)
        forced = f", forced at {lines}{unit}" if lines else ""
        return f"Mechanism: {self.degrees} coordinate{'s' * (self.degrees > 1)}, {held}{forced}"

    def __hash__(self) -> int:
        """Hash the numbers: the rows of the matrices are lists, which have no hash."""
        matrices = (self.mass, self.damping, self.stiffness)
        rows = tuple(tuple(map(tuple, matrix)) for matrix in matrices)
        parts = self.forces, self.constant_force, self.elements
        return hash((rows, parts, self.impact_law))

    def on_moving_base(
        self, motion: Harmonic | tuple[Harmonic, ...], direction: tuple[float, ...] | None = None
    ) -> Mechanism:
        """Return this machine on a base that moves; its coordinates are then relative to the base.

        Springs and dashpots to the ground, stops, and friction on the ground go with the base.

        Parameters
        ----------
        motion
            y(t) of the base: a :class:`Harmonic`, or several, with one amplitude each.
        direction
            How far each coordinate is carried where the base moves by 1, shape (n,): s. All by 1
            where left out; 0 for a rotation, or what the base does not carry.

        Returns
        -------
        Mechanism
            With the force -M s y'' added to ``forces``, to those of the same frequency.

        Raises
        ------
        InvalidParameterError
            Several amplitudes, a direction of another shape, more than 12 frequencies.
        """
        lines = as_lines("motion", motion)
        ones = (1.0,) * self.degrees
        along = vector("direction", ones if direction is None else direction, self.degrees)
        carried = linear.apply(self.mass, list(along))
        forces, nothing = list(self.forces), (0.0,) * self.degrees
        for line in lines:
            at = next((k for k, f in enumerate(forces) if f.omega == line.omega), len(forces))
            own = forces[at] if at < len(forces) else Harmonic(line.omega, nothing)
            square = line.omega * line.omega
            sine, cosine = (
                tuple(square * part[0] * x + y for x, y in zip(carried, old, strict=True))
                for part, old in ((line.sine, own.sine), (line.cosine, own.cosine))
            )
            forces[at : at + 1] = [Harmonic(line.omega, sine, cosine)]
        return replace(self, forces=tuple(forces))

    @property
    def rigid_stops(self) -> tuple[RigidStop, ...]:
        """The elements that are met with an impact: the first ones."""
        return tuple(e for e in self.elements if isinstance(e, RigidStop))

    @property
    def switching(self) -> tuple[Element, ...]:
        """The other elements, which switch between states with a force each."""
        return tuple(e for e in self.elements if not e.rigid)

    @property
    def degrees(self) -> int:
        """Number of coordinates n."""
        return len(self.mass)

    @property
    def omega(self) -> float:
        """Angular frequency of the first forcing line, 0 where there is none."""
        return self.forces[0].omega if self.forces else 0.0


def _check_symmetric(mass: linear.Matrix) -> None:
    """Refuse a matrix of masses that is not symmetric, with the entries that differ."""
    n = len(mass)
    for i, j in combinations(range(n), 2):
        if mass[i][j] is not mass[j][i] and mass[i][j] != mass[j][i]:
            raise InvalidParameterError(
                f"mass: must be symmetric; mass[{i}][{j}] = {mass[i][j]}, mass[{j}][{i}] = {mass[j][i]}. Give both "
                "their mean: kinetic energy is half of v . M v."
            )


def _advice(mass: linear.Matrix) -> str:
    """What is wrong with masses that are not positive definite."""
    negative = next((i for i, row in enumerate(mass) if row[i] < 0.0), None)
    if negative is not None:
        return f"mass[{negative}][{negative}] = {mass[negative][negative]}: remove negative masses."
    return "Some velocities have no positive kinetic energy: make entries off the diagonal smaller."


def _named(coordinates: Iterable[int]) -> str:
    """Return "coordinate 1", or "coordinates 1, 2"."""
    several = sorted(coordinates)
    return f"coordinate{'s' * (len(several) > 1)} {', '.join(map(str, several))}"


def symmetric(a: linear.Matrix) -> bool:
    """Whether a matrix is symmetric, as it is stored."""
    return all(a[i][j] is a[j][i] or a[i][j] == a[j][i] for i in range(len(a)) for j in range(i))


def check_all_have_mass(m: Mechanism) -> None:
    """Refuse coordinates without mass where all exponents are asked for: their number is another."""
    if m.massless:
        raise InvalidParameterError(
            f"system: coordinate {m.massless[0]} is massless; spectra in sweeps need masses. Take "
            "vi.lyapunov_spectrum, or the largest exponent, observe='lyapunov'."
        )


def needs_elements(m: Mechanism) -> bool:
    """Whether a mechanism is more than a few rigid stops that stand still, and symmetric matrices."""
    moving = any(stop.motion for stop in m.rigid_stops)
    even = symmetric(m.damping) and symmetric(m.stiffness)
    sizes = m.degrees, len(m.rigid_stops), len(m.forces)
    large = any(
        size > most
        for size, most in zip(sizes, (BLOCK_DEGREES, BLOCK_CONTACTS, BLOCK_LINES), strict=True)
    )
    return bool(m.switching) or moving or large or bool(m.massless) or not even


def element_labels(m: Mechanism) -> list[str]:
    """Name of every element with its number, as in "soft stop 1"."""
    return [f"{e.kind.replace('_', ' ')} {i}" for i, e in enumerate(m.elements)]


def stop_sizes(m: Mechanism) -> list[float]:
    """|limit| of every stop: lengths of the mechanism."""
    limits = [e.limit_at(side) for e in m.elements for side in (-1, 1)]
    return [abs(x) for x in limits if not is_infinite(x)]


def with_mass(m: Mechanism) -> list[int]:
    """Coordinates with mass."""
    return [i for i, row in enumerate(m.mass) if any(row)]


def held_last(m: Mechanism) -> list[int]:
    """Coordinates without mass, those that friction holds last."""
    sliders = [*m.sliders.values()]
    return sorted(m.massless, key=lambda i: i in sliders)


def accelerations(m: Mechanism, forces: ArrayLike) -> Floats:
    """M^-1 f for forces of shape (n,) or (n, k); zero at coordinates without mass."""
    forces = np.array(forces)
    heavy = with_mass(m)
    out = np.zeros(forces.shape)
    out[heavy] = np.linalg.solve(np.array(m.mass)[np.ix_(heavy, heavy)], forces[heavy])
    return out


def links(matrix: Sequence[Sequence[float]]) -> Iterator[tuple[int, int | None, float]]:
    """Springs of K, or dashpots of C: from coordinate i to j, or to the ground for None."""
    n = len(matrix)
    largest = max((abs(x) for row in matrix for x in row), default=0.0)
    for i in range(n):
        ground = sum((matrix[i][j] + matrix[j][i]) / 2.0 for j in range(n))
        if abs(ground) > ZERO_OF_LARGEST * largest:
            yield i, None, ground
        for j in range(i + 1, n):
            both = -(matrix[i][j] + matrix[j][i]) / 2.0
            if abs(both) > ZERO_OF_LARGEST * largest:
                yield i, j, both


def _several(
    name: str, items: Any, kind: type | tuple[type, ...], low: int, high: int
) -> tuple[Any, ...]:
    """Return a sequence as a tuple, or raise naming it."""
    counted = isinstance(items, list | tuple) and low <= len(items) <= high
    if counted and all(isinstance(item, kind) for item in items):
        return tuple(items)
    kinds = " or ".join(k.__name__ for k in (kind if isinstance(kind, tuple) else (kind,)))
    where = f"{kinds} in a tuple or list"
    allowed = where if high == UNBOUNDED_COUNT else f"{low} to {high} of {where}"
    if not isinstance(items, list | tuple):
        raise refusal(name, items, allowed)
    for i, item in enumerate(items):
        if not isinstance(item, kind):
            raise refusal(f"{name}[{i}]", item, f"a {kinds}")
    raise InvalidParameterError(f"{name}: {len(items)} are given; must be {allowed}.")


def as_array(rows: linear.Matrix) -> NDArray[np.float64]:
    """Rows as an array."""
    return np.array(rows, dtype=float)
