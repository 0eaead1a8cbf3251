"""Systems and starts from TOML files."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from vibroimpact._core.checks import names_arguments, path_of, shown, unknown_keyword
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.texts import read_toml
from vibroimpact.machines.machine import Machine, parameters_of
from vibroimpact.machines.quantities import Measured, checked, number_in
from vibroimpact.machines.registry import MACHINES, SHORT_TABLES, machine_of
from vibroimpact.machines.units import quantities_of
from vibroimpact.model.elements.table import KINDS
from vibroimpact.model.harmonic import Harmonic
from vibroimpact.model.hybrid_system import HybridSystem, LinearGuard, LinearMode, Transition
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State

OF_STATE = {"position": "length", "velocity": "velocity", "phase": "angle"}
MECHANISM, PHYSICAL, HYBRID = "mechanism", "physical", "hybrid"
TABLES = (*SHORT_TABLES, MECHANISM, HYBRID, *MACHINES)


@dataclass(frozen=True, slots=True)
class Case:
    """A system and, where the file gives one, a start."""

    system: Machine | Mechanism | HybridSystem
    start: State | None = None


@names_arguments()
@dataclass(frozen=True, slots=True)
class HybridStart:
    """Start of a hybrid system: the arguments of :func:`vibroimpact.simulate_hybrid`."""

    mode: str
    state: tuple[float, ...]
    phase: float = 0.0


@dataclass(frozen=True, slots=True)
class HybridCase:
    """A hybrid system and, where the file gives one, a start."""

    system: HybridSystem
    start: HybridStart | None = None


def read_case(path: str | os.PathLike[str], argument: str = "config") -> Case | HybridCase:
    """Read a system, and perhaps a start, from a TOML file.

    Parameters
    ----------
    path
        The file. One table gives the system: that of a machine, such as ``[impact-damper]`` with
        the parameters of :class:`~vibroimpact.ImpactDamper`; ``[impact-damper.physical]`` with
        those of ``from_physical``; or ``[mechanism]`` with those of
        :class:`~vibroimpact.Mechanism`, and ``[[mechanism.forces]]`` and
        ``[[mechanism.elements]]``, each element with its ``kind``,
        "rigid_stop", "soft_stop", "friction" or "phase_switch"; motions of stops and belts are
        tables with the parameters of :class:`~vibroimpact.Harmonic`, or lists of such tables, and so
        is ``base_motion``, with which and ``base_direction`` the mechanism is put on a moving base;
        a normal load is a table ``load``. The tables of the damper are also called ``[damper]`` and
        ``[physical]``. A table ``[start]`` (those of :class:`~vibroimpact.State`) is optional.
        A table ``[hybrid]`` has the parameters of :class:`~vibroimpact.HybridSystem`, as
        ``[hybrid.modes.NAME]``, ``[hybrid.guards.NAME]`` and ``[[hybrid.transitions]]``; its
        ``[start]`` has ``mode``, ``state`` and ``phase``.
    argument
        What messages call the file.

    Raises
    ------
    InvalidParameterError
        No such file, no TOML, an unknown or missing table or name, a value out of range.
    """
    tables = read_toml(argument, path_of(argument, path))
    systems = sorted(set(tables) & set(TABLES))
    unknown = sorted(set(tables) - set(TABLES) - {"start"})
    if len(systems) != 1 or unknown:
        raise InvalidParameterError(
            f"config = {path}: holds {', '.join(tables) or 'nothing'}; must hold one of "
            f"{', '.join(f'[{name}]' for name in TABLES)}, and may hold [start]."
        )
    system = _system(path, systems[0], tables[systems[0]])
    start = tables.get("start")
    if isinstance(start, dict) and systems != [HYBRID]:
        start = _measured(path, "[start]", start, OF_STATE, si=getattr(system, "si", False))
    case, kind = (HybridCase, HybridStart) if systems == [HYBRID] else (Case, State)
    made: Case | HybridCase = case(
        system, None if start is None else _built(path, "[start]", kind, start)
    )
    return made


def load_machine(path: str | os.PathLike[str]) -> Machine | Mechanism | HybridSystem:
    """Read a machine from a TOML file, as the command line does for ``--config``.

    Parameters
    ----------
    path
        The file; docs/cli.md describes it. ``machine.to_toml()`` is the text of one.

    Returns
    -------
    Machine, Mechanism or HybridSystem
        What the file describes; its start, where it has one, is read by :func:`load_start`.

    Raises
    ------
    InvalidParameterError
        No such file, no TOML, an unknown or missing table or name, a value out of range.
    """
    return read_case(path, "path").system


def load_start(path: str | os.PathLike[str]) -> State | HybridStart | None:
    """Read the start from a TOML file of a machine.

    Parameters
    ----------
    path
        The file, as for :func:`load_machine`.

    Returns
    -------
    State, HybridStart or None
        None where the file has no table ``[start]``; of a hybrid system mode, state and phase.

    Raises
    ------
    InvalidParameterError
        As of :func:`load_machine`.
    """
    return read_case(path, "path").start


def machine_in(path: str | os.PathLike[str]) -> str | None:
    """Name of the machine in a file; None if there is none, or if the file cannot be read."""
    try:
        tables = read_toml("config", path_of("config", path))
    except InvalidParameterError:
        return None
    names = (SHORT_TABLES.get(table, table).partition(".")[0] for table in tables)
    return next((name for name in names if name in MACHINES), None)


def _system(path: Any, name: str, table: Any) -> Any:
    """The system of a table."""
    if name == MECHANISM:
        return _mechanism(path, table)
    if name == HYBRID:
        return _hybrid(path, table)
    machine, _, physical = SHORT_TABLES.get(name, name).partition(".")
    make: Callable[..., Any] = machine_of(machine)
    if isinstance(table, dict) and [*table] == [PHYSICAL]:
        physical, name, table = PHYSICAL, f"{name}.{PHYSICAL}", table[PHYSICAL]
    if physical:
        quantities = machine_of(machine).physical or _quantities(machine_of(machine))
        table = _measured(path, f"[{name}]", table, quantities, si=True)
        make = cast(Any, make).from_physical
    elif isinstance(table, dict):
        quantities = _quantities(machine_of(machine))
        table = _measured(path, f"[{name}]", table, quantities, si=table.get("si") is True)
    return _built(path, f"[{name}]", make, table)


def _quantities(machine: type[Machine]) -> dict[str, str]:
    """Quantities of the parameters of a machine."""
    known = {name: one.quantity for name, one in quantities_of(machine).items()}
    return dict.fromkeys(parameters_of(machine), "") | known


def _measured(path: Any, where: str, table: Any, quantities: Mapping[str, str], *, si: bool) -> Any:
    """A table with numbers in place of texts such as "4 mm", where these are numbers with units."""

    def number(name: str, value: Any) -> Any:
        if isinstance(value, list):
            return [number(name, one) for one in value]
        if not isinstance(value, str):
            return value
        try:
            found = number_in(value)
            return (
                checked(name, found, quantities[name], si=si)
                if isinstance(found, Measured)
                else value
            )
        except InvalidParameterError as error:
            raise InvalidParameterError(f"config = {path}: {where}: {error}") from error
        except ValueError as error:
            raise InvalidParameterError(f"config = {path}: {where}: {name} = {error}.") from error

    if not isinstance(table, dict):
        return table
    return {
        name: number(name, value) if name in quantities else value for name, value in table.items()
    }


def _hybrid(path: Any, table: Any) -> HybridSystem:
    """A hybrid system with its modes, guards and transitions built."""
    made = dict(table) if isinstance(table, dict) else {}
    for key, kind in (("modes", LinearMode), ("guards", LinearGuard)):
        if isinstance(made.get(key), dict):
            parts = made[key].items()
            made[key] = {n: _built(path, f"[{HYBRID}.{key}.{n}]", kind, x) for n, x in parts}
    if isinstance(made.get("transitions"), list):
        label = f"[[{HYBRID}.transitions]]"
        made["transitions"] = tuple(
            _built(path, f"{label} {i}", Transition, x)
            for i, x in enumerate(made["transitions"], 1)
        )
    system: HybridSystem = _built(path, f"[{HYBRID}]", HybridSystem, made or table)
    return system


def _element(path: Any, where: str, table: Any) -> Any:
    kinds = ", ".join(f'"{kind}"' for kind in KINDS)
    kind = table.get("kind") if isinstance(table, dict) else None
    if not isinstance(kind, str) or kind not in KINDS:
        kind = "kind: missing" if kind is None else f"kind = {shown(kind)}"
        raise InvalidParameterError(f"config = {path}: {where}: {kind}; must be one of {kinds}.")
    rest = {name: value for name, value in table.items() if name != "kind"}
    return _nested(path, where, KINDS[kind], rest)


def _nested(path: Any, where: str, make: Any, given: Any) -> Any:
    """A record, or several where a list is given, with the records among its fields."""
    if isinstance(given, list):
        return tuple(_nested(path, where, make, one) for one in given)
    records = getattr(make, "records", {})
    if isinstance(given, dict):
        given = {
            name: _nested(path, f"{where}: {name}", records[name], value)
            if name in records
            else value
            for name, value in given.items()
        }
    return _built(path, where, make, given)


def _force(path: Any, where: str, table: Any) -> Any:
    return _built(path, where, Harmonic, table)


_BASE = {"base_motion": "motion", "base_direction": "direction"}
_PARTS: Mapping[str, Callable[[Any, str, Any], Any]] = {
    "forces": _force, "elements": _element
}  # fmt: skip


def _mechanism(path: Any, table: Any) -> Mechanism:
    """A mechanism, on a base that moves where its table says so."""
    where, base = f"[{MECHANISM}]", {}
    if isinstance(table, dict):
        base = {name: table[key] for key, name in _BASE.items() if key in table}
        table = {key: value for key, value in table.items() if key not in _BASE}
    still: Mechanism = _built(path, where, Mechanism, _parts(path, table))
    if not base:
        return still
    if "motion" in base:
        base["motion"] = _nested(path, f"{where}: base_motion", Harmonic, base["motion"])
    moved: Mechanism = _built(path, f"{where}: base_motion", still.on_moving_base, base)
    return moved


def _parts(path: Any, table: Any) -> Any:
    """The table of a mechanism with its forces and elements built."""
    if not isinstance(table, dict):
        return table
    return table | {key: _several(path, key, table[key]) for key in _PARTS if key in table}


def _several(path: Any, key: str, items: Any) -> list[Any]:
    label = f"[[mechanism.{key}]]"
    if not isinstance(items, list):
        raise InvalidParameterError(f"config = {path}: {key} must be tables {label}.")
    numbered = [f"{label} {i + 1}" for i in range(len(items))] if len(items) > 1 else [label]
    return [_PARTS[key](path, where, item) for where, item in zip(numbered, items, strict=False)]


def _built(path: Any, where: str, make: Callable[..., Any], table: Any) -> Any:
    """Call ``make`` with the entries of a table; an error names the file and the table."""
    if not isinstance(table, dict):
        raise InvalidParameterError(
            f"config = {path}: {where} must be a table of names and values."
        )
    names = inspect.signature(make).parameters
    free = any(p.kind is p.VAR_KEYWORD for p in names.values())
    missing = [n for n, p in names.items() if not free and p.default is p.empty and n not in table]
    try:
        for name in table:
            if not (free or name in names or isinstance(make, type)):  # which have better messages
                raise unknown_keyword(where, name, [*names])
        if missing and not table.keys() - names:
            raise InvalidParameterError(f"{', '.join(missing)}: missing.")
        return make(**table)
    except InvalidParameterError as error:
        raise InvalidParameterError(f"config = {path}: {where}: {error}") from error
