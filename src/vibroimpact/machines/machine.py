"""Machines: systems by name, with parameters.

A machine is one file of this folder: a class with the decorator :func:`machine` that inherits
:class:`Machine`, whose fields are made by :func:`parameter`, and that has a ``mechanism``. Its fields are
its parameters: for sweeps and branches, for TOML and JSON, and as options of the command line,
described by its docstring. Besides those of :class:`Machine` it may have

- a field ``si``, whether its numbers are in SI units, which labels then name; where the fields are
  not the numbers that engineers have, a class method ``from_physical`` of its own, with ``physical``, the
  quantity of each of its arguments, and ``letters``, those of them that are a parameter but for a factor;
- a method ``on_stop(stop, *, x1, ..., v1, ..., phase)``: a state on stop "A" or "B", from the
  remaining coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, ClassVar, Self, TypeVar, cast, dataclass_transform

from vibroimpact._core.checks import check_flag, names_arguments
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.known_for import KnownFor
from vibroimpact.machines.units import Quantity, of_quantity
from vibroimpact.model.described import Described
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State

SI = "si"  # the field that is no parameter
CHECK = "check"  # metadata of a parameter: the function that refuses values
Class = TypeVar("Class", bound=type)


def parameter(
    check: Callable[..., Any], quantity: str = "", label: str = "", *,
    default: Any = MISSING, advice: str = "",
) -> Any:  # fmt: skip
    """Make a field of a machine.

    Parameters
    ----------
    check
        Function of a name and a value, and of advice where it is given, that returns the value or refuses it:
        one of ``_core/checks.py``.
    quantity
        What it is, a key of ``UNITS``; "" for a number without dimension.
    label
        Words and symbol for figures and tables, as in "gap $e$".
    default
        Its value where it is left out; without one it must be given.
    advice
        What a message that refuses a value ends with.
    """

    def checked(name: str, value: Any) -> Any:
        return check(name, value, advice) if advice else check(name, value)

    return field(default=default, metadata={**of_quantity(quantity, label), CHECK: checked})


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(parameter, field))
def machine(**advice: str) -> Callable[[Class], Class]:
    """Make a class a machine: a frozen, keyword-only dataclass that refuses unknown keywords.

    Parameters
    ----------
    **advice
        Advice for keywords that are often tried, by keyword.
    """

    def made(cls: Class) -> Class:
        made_of: Any = dataclass(frozen=True, slots=True, kw_only=True)(cls)
        return cast(Class, names_arguments(**advice)(made_of))

    return made


class Machine(Described):
    """Base class of systems with a name.

    Attributes
    ----------
    source
        Publication of its equations, with the numbers of the equations where they are known.
    to_try
        What to look at first: arguments of the command ``vibroimpact``, each with what they show.
    example
        Values of the parameters without default that make an example.
    known_for
        What the gallery shows of it.
    """

    __slots__ = ("__weakref__",)  # so that the mechanism is built once: model/system.py

    physical: ClassVar[Mapping[str, str]] = {}
    letters: ClassVar[Mapping[str, tuple[str, float]]] = {}
    source: ClassVar[str] = ""
    to_try: ClassVar[tuple[tuple[str, str], ...]] = ()
    example: ClassVar[Mapping[str, float]] = {}
    known_for: ClassVar[KnownFor] = KnownFor("A motion with the defaults.")

    def __post_init__(self) -> None:
        for one in fields(cast(Any, self)):
            value = getattr(self, one.name)
            if CHECK in one.metadata and not (value is None and one.default is None):
                object.__setattr__(self, one.name, one.metadata[CHECK](one.name, value))
        check_flag(SI, getattr(self, SI, False))
        self._check_together()

    def _check_together(self) -> None:
        """Refuse values that are allowed one by one, but not together."""

    @classmethod
    def from_physical(cls, **values: Any) -> Self:
        """Make a machine in SI units: its fields, all of those with a dimension that are not zero."""
        if SI not in {one.name for one in fields(cast(Any, cls))}:
            raise InvalidParameterError(
                f"from_physical: not all coordinates of {cls.__name__} are lengths, and labels name no other "
                f"units. Give its parameters in any one system of units to {cls.__name__}."
            )
        missing = [
            one.name
            for one in fields(cast(Any, cls))
            if one.metadata.get("quantity", Quantity()).quantity
            and one.name not in values
            and one.default not in (MISSING, None, 0.0)
        ]
        if missing:
            raise InvalidParameterError(
                f"{', '.join(missing)}: missing. Defaults are not in SI units: give every parameter that has a unit."
            )
        return cast(Self, cast(Any, cls)(**values, si=True))

    @property
    def mechanism(self) -> Mechanism:
        """Masses, springs, forces and stops."""
        raise NotImplementedError

    def free_start(self) -> State:
        """State with all coordinates and velocities zero."""
        zero = (0.0,) * self.mechanism.degrees
        return State(zero, zero)


def parameters_of(machine: type[Machine]) -> tuple[str, ...]:
    """Names of the parameters of a class of machines."""
    return tuple(f.name for f in fields(machine) if f.init and f.name != SI)  # type: ignore[arg-type]


def example_of(machine: type[Machine]) -> Machine:
    """Machine of a class with its defaults, and with those of ``example`` where there are none."""
    return machine(**machine.example)
