"""Parameters of a system by name: read, replace, and differentiate.

A parameter is

- a field of a system that is a dataclass with a ``mechanism``, such as ``"omega"`` of
  :class:`~vibroimpact.ImpactDamper`;
- a keyword of a :class:`Family`, a function that builds a mechanism;
- a path into a :class:`~vibroimpact.HybridSystem`: ``"modes.on.matrix[0][0]"``, ``"guards.upper.level"``,
  ``"transitions[0].shift[1]"``, or ``"omega"``: all frequencies in proportion;
- a path into a :class:`~vibroimpact.Mechanism`: ``"stiffness[0][0]"`` (with its mirror entry, where
  the matrix is symmetric), ``"elements[0].upper"``, ``"elements[0].restitution"``,
  ``"forces[0].sine[1]"``, ``"constant_force[0]"``, ``"elements[0].motion[0].sine[0]"``,
  ``"elements[1].stiffness"``, or ``"omega"``: all frequencies in proportion.

Numbers in a path are those of ``mechanism.elements``, where rigid stops come first. Of a pair, [0] is
at the lower and [1] at the upper stop. A
frequency belongs to a forcing line: forces and motions of stops and belts that have it change
together. Friction whose static level equals the kinetic one keeps both equal when kinetic varies.

Derivatives with respect to it are exact: the system is built once more with a jet for the number,
and every entry of M, C, K, of the stops and of the forces comes out with its derivatives.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from vibroimpact._core.checks import check_choice, check_kind, real, refusal, shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.scalars import as_python
from vibroimpact._kernel import Jet
from vibroimpact.model.described import Described
from vibroimpact.model.elements.element import Element
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.hybrid_system import HybridSystem
from vibroimpact.model.mechanism import Mechanism, symmetric
from vibroimpact.model.system import System, mechanism_of

MATRICES = ("mass", "damping", "stiffness")
PAIRS = ("restitution", "stiffness", "damping")  # of stops: (at lower, at upper)
Step = str | int


@dataclass(frozen=True, repr=False)
class Family(Described):
    """Mechanism, or hybrid system, with named parameters, given by a function of them: a system like any other.

    Parameters
    ----------
    build
        Called with the parameters as keywords; returns a :class:`Mechanism` or a :class:`HybridSystem`. It computes
        with + - * / ** and numpy functions (np.sqrt, np.sin, np.cos, np.exp, np.log), so that it can be
        differentiated, and compiled for many values at once: numbers may be jets or columns.
    **parameters
        Their values; those that are left out have the defaults of ``build``. Integers count something: only
        floats can be varied.

    Raises
    ------
    InvalidParameterError
        A keyword that ``build`` does not take, or one that it misses.

    Examples
    --------
    >>> import vibroimpact as vi
    >>> def oscillator(k, A):
    ...     return vi.Mechanism(mass=[[1.0]], damping=[[0.1]], stiffness=[[k]],
    ...                         forces=(vi.Harmonic(1.0, (A,)),),
    ...                         elements=(vi.RigidStop((1.0,), upper=1.0, restitution=0.8),))
    >>> vi.Family(oscillator, k=1.0, A=2.0)
    Family(oscillator, k=1.0, A=2.0)
    """

    build: Callable[..., Mechanism | HybridSystem]
    parameters: tuple[tuple[str, float], ...]

    def __init__(self, build: Callable[..., Mechanism | HybridSystem], **parameters: float) -> None:
        if isinstance(build, Mechanism):
            raise InvalidParameterError(
                "build: is a mechanism, whose numbers vary as they are: name one by its path, such as "
                '"stiffness[0][0]", or change it by replace(). A Family takes a function that returns a Mechanism.'
            )
        if not callable(build):
            raise refusal("build", build, "a function that returns a Mechanism")
        name, taken = getattr(build, "__name__", repr(build)), inspect.signature(build).parameters
        known = {n: p.default for n, p in taken.items() if p.default is not p.empty}
        try:
            inspect.signature(build).bind(**parameters)
        except TypeError as error:
            listed = ", ".join(f"{one}=..." for one in taken)
            raise InvalidParameterError(
                f"build = {name}: {error}. Give Family({name}, {listed})."
            ) from None
        if not known | parameters:
            raise InvalidParameterError(
                f"build = {name}: has no parameter. Give it arguments, the numbers that vary; or take the "
                f"mechanism that it returns, {name}(), whose numbers vary by path."
            )
        object.__setattr__(self, "build", build)
        self._set(known | parameters)

    def _set(self, parameters: Mapping[str, float]) -> None:
        plain = ((name, as_python(value)) for name, value in parameters.items())
        object.__setattr__(self, "parameters", tuple(plain))

    def _changed(self, values: Mapping[str, float]) -> Family:
        """The family with other values of some of its parameters."""
        other = copy(self)
        other._set(dict(self.parameters) | dict(values))
        return other

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism for the present values."""
        try:
            built = self.build(**dict(self.parameters))
        except InvalidParameterError as error:
            raise InvalidParameterError(f"system = {shown(self)}: {error}") from error
        except TypeError as error:
            jets = any(isinstance(value, Jet) for _, value in self.parameters)
            if jets or not re.search("integer|non-int", str(error)):
                raise  # with jets, :func:`expanded` names the parameter
            raise InvalidParameterError(
                f"system = {shown(self)}: cannot be built ({error}). A parameter that counts "
                "something must be an integer, and cannot be varied."
            ) from error
        if isinstance(built, HybridSystem):
            return built.mechanism
        if not isinstance(built, Mechanism):
            raise InvalidParameterError(
                f"build = {shown(self.build)}: must return a Mechanism or HybridSystem, not {shown(built)}."
            )
        return built

    @property
    def si(self) -> bool:
        """Whether the numbers of the mechanism are in SI units."""
        return self.mechanism.si

    def __repr__(self) -> str:
        name = getattr(self.build, "__name__", repr(self.build))
        return f"Family({', '.join([name, *(f'{k}={v!r}' for k, v in self.parameters)])})"


def parameter_value(system: System, name: str) -> float:
    """Present value of a parameter.

    Raises
    ------
    InvalidParameterError
        No such parameter; the message lists the parameters.
    """
    known = names_of(system)
    if isinstance(system, Mechanism | HybridSystem) and name not in [*known]:
        check_kind("parameter", name, str, "a name or a path")
        return _at_path(system, name)
    check_kind("parameter", name, str, "the name of a parameter")
    letters = getattr(system, "letters", {})
    if name in letters:
        own, factor = letters[name]
        raise InvalidParameterError(
            f"parameter = {name!r}: is {own}{'' if factor == 1.0 else f' = {factor:g} {name}'} here. Give {own}."
        )
    check_choice("parameter", name, known)
    return float(known[name])


def with_parameter(system: System, name: str, value: Any) -> System:
    """The system with another value of one parameter; the value may be a jet or a column."""
    return with_parameters(system, {name: value})


def with_parameters(system: System, values: Mapping[str, Any]) -> System:
    """The system with new values of some parameters; in a mechanism, one after the other."""
    if not values:
        return system  # which may be of any class then
    for name in values:
        parameter_value(system, name)
    return changed(system, values)


def changed(system: System, values: Mapping[str, Any]) -> System:
    """The system with new values of parameters that it has, numbers of any kind (scalars.py)."""
    if isinstance(system, Family):
        return system._changed(values)
    if isinstance(system, Mechanism | HybridSystem):
        for name, value in values.items():
            system = _with_entry(system, name, value)
        return system
    return cast(System, replace(cast(Any, system), **values))


def replaced(system: System, changes: Mapping[str, Any]) -> System:
    """The system with other values of parameters, and of whole fields."""
    if isinstance(system, Family):
        for name in changes:
            check_choice("parameter", name, dict(system.parameters))
        return system._changed(changes)
    if not isinstance(system, Mechanism | HybridSystem):
        return cast(System, replace(cast(Any, system), **changes))
    fields = {f.name for f in dataclasses.fields(system)}
    whole = {name: value for name, value in changes.items() if name in fields}
    numbers = {name: real(name, value) for name, value in changes.items() if name not in whole}
    return with_parameters(replace(system, **whole), numbers)


def with_values(message: str, values: Mapping[str, float]) -> str:
    """Append the values of a system's parameters to the message that refuses it."""
    which = ", ".join(f"{name} = {value!r}" for name, value in values.items())
    return f"{message} System: {which}." if which else message


def expanded(system: System, name: str) -> Mechanism:
    """The mechanism with jets seeded in one parameter: derivatives are coefficients 1, 3, 7.

    Raises
    ------
    InvalidParameterError
        A system whose code cannot compute with jets.
    """
    try:
        varied = changed(system, {name: Jet.variable(parameter_value(system, name))})
        return mechanism_of(varied)
    except TypeError as error:
        raise InvalidParameterError(
            f"parameter = {name!r}: {system!r} cannot be differentiated with respect to it "
            f"({error}). Compute with + - * / ** and numpy functions only."
        ) from error
    except InvalidParameterError:
        mechanism_of(system)  # says it in plain numbers
        raise


def names_of(system: System) -> dict[str, float]:
    """Real parameters by name, with their values; of a mechanism only ``omega``."""
    if isinstance(system, Family):
        return _numbers(dict(system.parameters))
    if isinstance(system, Mechanism):
        return {"omega": system.omega} if system.forces else {}
    if isinstance(system, HybridSystem):
        return {"omega": system.omegas[0]} if system.omegas else {}
    if not dataclasses.is_dataclass(cast(Any, system)) or isinstance(system, type):
        raise InvalidParameterError(
            f"system = {shown(system)}: has no parameters by name. Make it a dataclass, or a "
            "vi.Family."
        )
    fields = {f.name: getattr(system, f.name) for f in dataclasses.fields(cast(Any, system))}
    return _numbers(fields)


def _numbers(values: dict[str, Any]) -> dict[str, float]:
    return {
        k: v for k, v in values.items() if isinstance(v, float | int) and not isinstance(v, bool)
    }


def _steps(path: str) -> list[Step]:
    """'forces[0].sine[1]' -> ['forces', 0, 'sine', 1]."""
    if not re.fullmatch(r"[a-z_]+(\[\d+\]|\.[^][.]+)*", path):
        return []
    parts = re.findall(r"\[(\d+)\]|([^][.]+)", path)
    return [int(number) if number else name for number, name in parts]


def _at_path(mechanism: Mechanism | HybridSystem, path: str) -> float:
    here: Any = mechanism
    try:
        for step in _steps(path):
            inside = isinstance(step, int) or isinstance(here, Mapping)
            here = here[step] if inside else _field(here, cast(str, step))
    except (AttributeError, IndexError, KeyError, TypeError):
        here = None
    if isinstance(mechanism, HybridSystem):
        if isinstance(here, float):  # those of numpy, too
            return float(here)
        mode, guards = next(iter(mechanism.modes)), mechanism.guards
        paths = [f"modes.{mode}.matrix[0][0]", *(f"guards.{name}.level" for name in [*guards][:1])]
        raise InvalidParameterError(
            f"parameter = {path!r}: is no number of this hybrid system. Take "
            f"{'omega, or ' if mechanism.omegas else ''}a path such as {', '.join(paths)}."
        )
    if path.endswith(PAIRS) and isinstance(here, tuple) and _element_of(mechanism, path).is_stop:
        if here[0] != here[1]:
            raise InvalidParameterError(
                f"parameter = {path!r}: is {here[0]} at the lower and {here[1]} at the upper stop. "
                f"Take {path}[0] or {path}[1]."
            )
        here = here[0]
    if isinstance(here, float) and math.isfinite(here):
        return here
    forced = ("omega", ", forces[0].sine[0]") if mechanism.forces else ("", "")
    raise InvalidParameterError(
        f"parameter = {path!r}: is no finite number of this mechanism. Take "
        f"{forced[0] and 'omega, or '}a path such as stiffness[0][0]{_examples(mechanism)}"
        f"{forced[1]}."
    )


def _element_of(m: Mechanism, path: str) -> Element:
    """The element that a path leads into."""
    return m.elements[cast(int, _steps(path)[1])]


def _examples(m: Mechanism) -> str:
    """Paths of numbers of the first element."""
    values = {
        f.name: getattr(m.elements[0], f.name) for f in dataclasses.fields(cast(Any, m.elements[0]))
    }
    return "".join(
        f", elements[0].{name}"
        for name, value in values.items()
        if name in PAIRS or (isinstance(value, float) and math.isfinite(value))
    )


def _field(part: Any, name: str) -> Any:
    """A field of a mechanism or of a part of it; properties, and those of numbers, are refused."""
    if name not in {f.name for f in dataclasses.fields(part)}:
        raise AttributeError(name)
    return getattr(part, name)


def _replaced(here: Any, steps: list[Step], value: Any) -> Any:
    """A copy of a mechanism, a part of it or a sequence with one number replaced."""
    if not steps:
        return value
    first, rest = steps[0], steps[1:]
    if isinstance(here, Mapping):
        return {**here, first: _replaced(here[first], rest, value)}
    if isinstance(first, int):
        items = list(here)
        items[first] = _replaced(items[first], rest, value)
        return items if isinstance(here, np.ndarray) else type(here)(items)
    before = getattr(here, first)
    inside = _replaced(before, rest, value)
    mirrored = first in MATRICES and len(rest) == 2 and rest[0] != rest[1]
    if mirrored and symmetric(before):
        inside = _replaced(inside, rest[::-1], value)
    if isinstance(here, Element):
        return here.changed(first, inside)
    return replace(here, **{first: inside})


def _with_entry(
    mechanism: Mechanism | HybridSystem, path: str, value: Any
) -> Mechanism | HybridSystem:
    if isinstance(mechanism, HybridSystem):
        if path == "omega":
            first = mechanism.omegas[0]
            return replace(mechanism, omegas=tuple(value * (w / first) for w in mechanism.omegas))
        return cast(HybridSystem, _replaced(mechanism, _steps(path), value))
    if path == "omega":
        first = mechanism.omega
        return _at_frequencies(
            mechanism, [value * (line.omega / first) for line in mechanism.forces]
        )
    steps = _steps(path)
    if steps[-1] == "omega":
        number = cast(int, steps[1])
        if steps[0] != "forces":  # a motion has the first line of its frequency
            number = _line_of(mechanism.forces, _at_path(mechanism, path))
        omegas = [line.omega for line in mechanism.forces]
        omegas[number] = value
        return _at_frequencies(mechanism, omegas)
    return cast(Mechanism, _replaced(mechanism, steps, value))


def _line_of(lines: tuple[Harmonic, ...], omega: float) -> int:
    """Number of the first line of a frequency."""
    return next(i for i, line in enumerate(lines) if line.omega is omega or line.omega == omega)


def _at_frequencies(mechanism: Mechanism, omegas: list[Any]) -> Mechanism:
    """Copy with other frequencies of the lines, and of the motions of stops and belts that have them."""
    lines = mechanism.forces

    def moved(part: Any) -> Any:
        """The part with the frequencies of its records, or of its own."""
        changes: dict[str, Any] = {}
        for name in {f.name for f in dataclasses.fields(part)}:
            value = getattr(part, name)
            if name == "omega":
                changes[name] = omegas[_line_of(lines, value)]
            elif name == "omegas":
                changes[name] = tuple(omegas[_line_of(lines, w)] for w in value)
            elif name in getattr(part, "records", ()) and value:
                changes[name] = (
                    tuple(map(moved, value)) if isinstance(value, tuple) else moved(value)
                )
        return replace(part, **changes) if changes else part

    elements = tuple(map(moved, mechanism.elements))
    forces = tuple(replace(line, omega=w) for line, w in zip(lines, omegas, strict=True))
    varied = copy(mechanism)  # the rest has been checked
    for name, parts in (("forces", forces), ("elements", elements)):
        object.__setattr__(varied, name, parts)
    return varied
