"""Coulomb friction, with a normal load that may vary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from vibroimpact._core.checks import (
    check_kind,
    names_arguments,
    nonnegative,
    real,
    refusal,
    vector,
)
from vibroimpact._core.codes import NamedCode
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import ROUNDING_PER_TERM
from vibroimpact.model.elements.element import Element, Grip, Look, nonzero_row
from vibroimpact.model.harmonic import Harmonic, as_lines, by_frequency, empty

CONSTANT = (
    "A level that varies with time or speed is not supported; two levels are: kinetic, static."
)
BELT = "A belt whose speed varies has motion: a Harmonic of its displacement, or several."


class FrictionState(NamedCode):
    """States of a friction joint."""

    FORWARD = 0  #: slips with positive slip speed
    BACKWARD = 1
    STICK = 2
    LIFTED = 3  #: without normal load


@names_arguments(force="Give constant, position, velocity, motion.")
@dataclass(frozen=True, slots=True)
class NormalLoad:
    """A normal load that depends on the motion: constant + position . x + velocity . v + motion(t).

    Where it is negative the surfaces have lifted off and there is no friction.

    Parameters
    ----------
    constant
        Its constant part.
    position, velocity
        What coordinates and velocities add, shape (n,) each; nothing where left out.
    motion
        Harmonic parts: a :class:`Harmonic` with one amplitude, or several.
    """

    records: ClassVar[Mapping[str, type]] = {
        "motion": Harmonic
    }  #: fields that are records, for files

    constant: float = 0.0
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    motion: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "constant", real("constant", self.constant))
        for name in ("position", "velocity"):
            given = getattr(self, name)
            object.__setattr__(self, name, () if empty(given) else vector(name, given))
        object.__setattr__(self, "motion", as_lines("motion", self.motion))


@names_arguments(
    mu="Give kinetic, the friction force: coefficient times normal load.",
    normal="Give kinetic, the friction force: coefficient times normal load.",
    coefficient="Give kinetic, the friction force: coefficient times normal load.",
    velocity="Give belt_speed.",
    belt_motion="Give motion, the displacement of the belt: amplitudes of its speed over omega.",
)
@dataclass(frozen=True, slots=True)
class Friction(Element):
    """Coulomb friction between row . x and a belt.

    While it slips, the force -kinetic sign(row . v - belt speed) acts along ``row``. While it
    sticks, the force is what holds it, up to ``static``; it breaks away where more is needed.

    Parameters
    ----------
    row
        Slipping coordinate row . x, shape (n,), not all zero; (1, -1) for two masses on each other.
        On a coordinate without mass it is a slider: plastic soil, an elastoplastic spring.
    kinetic
        Friction force while it slips, >= 0; with ``load`` the coefficient of friction.
    static
        Largest friction force, or coefficient, while it sticks, >= kinetic; equal to it where left
        out.
    belt_speed
        Constant part of the speed of the belt.
    motion
        Displacement of the belt over time, as that of a stop: a :class:`Harmonic` with one
        amplitude, or several, which add up. Its derivative adds to ``belt_speed``; a speed s cos(omega t) has
        ``Harmonic(omega, (s / omega,))``.
    load
        A :class:`NormalLoad` that depends on the motion.
    """

    kind: ClassVar[str] = "friction"
    State = FrictionState
    looks: ClassVar[Mapping[int, Look]] = {
        FrictionState.STICK: Look("sticks", "green"),
        FrictionState.FORWARD: Look("slips forward", "orange", 0.25),
        FrictionState.BACKWARD: Look("slips backward", "purple", 0.25),
        FrictionState.LIFTED: Look("lifted off", "sky", 0.25),
    }
    records: ClassVar[Mapping[str, type]] = {"motion": Harmonic, "load": NormalLoad}
    holding = FrictionState.STICK
    slipping = frozenset({FrictionState.FORWARD, FrictionState.BACKWARD})

    row: tuple[float, ...]
    kinetic: float
    static: float | None = None
    belt_speed: float = 0.0
    motion: tuple[Harmonic, ...] = ()
    load: NormalLoad | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "row", nonzero_row(self.row, "friction"))
        for name in ("kinetic", "static"):
            if callable(value := getattr(self, name)):
                raise refusal(name, value, "a number", CONSTANT)
        if callable(self.belt_speed):
            raise refusal("belt_speed", self.belt_speed, "a number", BELT)
        object.__setattr__(self, "kinetic", nonnegative("kinetic", self.kinetic))
        static = self.kinetic if self.static is None else nonnegative("static", self.static)
        if static < self.kinetic:
            raise refusal(
                "static", self.static, f">= kinetic = {self.kinetic}",
                "Friction that grows with sliding has static = kinetic.",
            )  # fmt: skip
        object.__setattr__(self, "static", static)
        object.__setattr__(self, "belt_speed", real("belt_speed", self.belt_speed))
        object.__setattr__(self, "motion", as_lines("motion", self.motion))
        if self.load is not None:
            check_kind("load", self.load, NormalLoad, "a NormalLoad, or left out")

    @property
    def states(self) -> tuple[FrictionState, ...]:
        """The states that it can have."""
        found = tuple(FrictionState)
        return found if self.load else found[:3]

    @property
    def lines(self) -> tuple[Harmonic, ...]:
        """Forcing lines whose phases it needs: of the belt and of the load."""
        return (*self.motion, *(self.load.motion if self.load else ()))

    def check_size(self, n: int, name: str) -> None:
        """Refuse rows that do not have n entries; the element has this name."""
        vector(f"{name}.row", self.row, n)
        for part in ("position", "velocity"):
            if self.load and getattr(self.load, part):
                vector(f"{name}.load.{part}", getattr(self.load, part), n)

    def check_massless(self, light: Sequence[int], name: str) -> None:
        """Refuse two levels, or a load, on a coordinate without mass: its force would jump."""
        for i in light:
            if self.row[i] and (self.load is not None or self.static != self.kinetic):
                raise InvalidParameterError(
                    f"{name}: friction on coordinate {i}, which has no mass, has one constant level, "
                    "as its force could not jump. Leave out static and load, or give it a mass."
                )

    def changed(self, name: str, value: Any) -> Friction:
        """Copy with another value of a field; equal levels stay equal where the kinetic one changes."""
        both = name == "kinetic" and self.static == self.kinetic
        return replace(self, **{name: value, **({"static": value} if both else {})})

    def widened(self) -> Friction:
        """Copy on one coordinate more, on which neither friction nor its load depends."""
        load = self.load
        if load is not None:
            position, velocity = (
                (*part, 0.0) if part else () for part in (load.position, load.velocity)
            )
            load = replace(load, position=position, velocity=velocity)
        return replace(self, row=(*self.row, 0.0), load=load)

    @property
    def positions(self) -> list[tuple[float, ...]]:
        """Row of positions of the load, where it has one."""
        return [self.load.position] if self.load and any(self.load.position) else []

    @property
    def own_forces(self) -> tuple[tuple[float, ...], ...]:
        """Static force under the constant part of the load and its waves."""
        waves = self.load.motion if self.load else ()
        sizes = [abs(part) for line in waves for part in (*line.sine, *line.cosine)]
        load = [abs(self.load.constant), *sizes] if self.load else [1.0]
        level = self.grip.static * sum(load)
        return (tuple(level * x for x in self.row),)

    @property
    def grip(self) -> Grip:
        """Levels, constant load and belt speed of the friction."""
        assert self.static is not None
        load = 1.0 if self.load is None else self.load.constant
        return Grip(self.kinetic, self.static, load, self.belt_speed)

    @property
    def mirrored(self) -> tuple[tuple[Any, Any], ...] | None:
        """Levels, which both sides share, and the speed of what it rubs on; None where its load varies."""
        load = self.load
        if load is not None and (load.position or load.velocity or load.motion):
            return None
        grip = self.grip
        levels = (grip.kinetic * grip.load, grip.static * grip.load)
        return (*((level, level) for level in levels), (-grip.speed, grip.speed))

    def multiple_of(self, other: Element) -> float | None:
        """The factor of (1), friction_lines.py; None where lines or belts differ, or loads vary."""
        if self.load or not isinstance(other, Friction) or other.load:
            return None
        at = next(i for i, x in enumerate(other.row) if x)
        factor = self.row[at] / other.row[at]
        if not factor:
            return None
        here, there = by_frequency(other.motion), by_frequency(self.motion)
        pairs = [*zip(other.row, self.row, strict=True), (other.belt_speed, self.belt_speed)]
        for omega in {**here, **there}:
            x, y = (belt.get(omega, Harmonic(omega, (0.0,))) for belt in (here, there))
            pairs += [(x.sine[0], y.sine[0]), (x.cosine[0], y.cosine[0])]
        alike = all(
            abs(y - factor * x) <= ROUNDING_PER_TERM * (abs(y) + abs(factor * x)) for x, y in pairs
        )
        return factor if alike else None

    def caption(self, *sides: int) -> str:
        """Caption: the levels, and how the belt moves."""
        static = "" if self.static == self.kinetic else f", static {self.static:g}"
        speed = f"\nbelt {self.belt_speed:g}" if self.belt_speed else ""
        swings = (", swings" if speed else "\nbelt swings") if self.motion else ""
        return f"{self.kinetic:g}{static}{speed}{swings}"
