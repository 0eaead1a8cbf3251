"""Systems, and where a motion starts, from TOML files."""

from __future__ import annotations

import inspect
import os
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vibroimpact._core.checks import unknown_keyword
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.impact_damper import ImpactDamper
from vibroimpact.model.mechanism import Contact, Harmonic, Mechanism
from vibroimpact.model.state import State


@dataclass(frozen=True, slots=True)
class Case:
    """A system and, where the file gives one, a start."""

    system: ImpactDamper | Mechanism
    start: State | None = None


def read_case(path: str | os.PathLike[str]) -> Case:
    """Read a system, and perhaps a start, from a TOML file.

    Parameters
    ----------
    path
        The file. One table gives the system: ``[damper]`` (the parameters of
        :class:`~vibroimpact.ImpactDamper`), ``[physical]`` (those of ``from_physical``) or
        ``[mechanism]`` (those of :class:`~vibroimpact.Mechanism`, with ``[[mechanism.forces]]``
        and ``[[mechanism.contacts]]``). A table ``[start]`` (those of
        :class:`~vibroimpact.State`) is optional.

    Raises
    ------
    InvalidParameterError
        No such file, no TOML, an unknown or missing table or name, a value out of range.
    """
    tables = _read_toml(Path(path))
    systems = sorted(set(tables) & set(_SYSTEMS))
    unknown = sorted(set(tables) - set(_SYSTEMS) - {"start"})
    if len(systems) != 1 or unknown:
        raise InvalidParameterError(
            f"config = {path}: holds {', '.join(tables) or 'nothing'}; must hold one of "
            f"{', '.join(f'[{name}]' for name in _SYSTEMS)}, and [start] if wanted."
        )
    name = systems[0]
    system = _built(path, f"[{name}]", _SYSTEMS[name], _parts(path, name, tables[name]))
    start = tables.get("start")
    return Case(system, None if start is None else _built(path, "[start]", State, start))


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no UTF-8 text"
        raise InvalidParameterError(
            f"config = {path}: cannot be read ({reason}). Name a TOML file."
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise InvalidParameterError(
            f"config = {path}: is no TOML ({error}). Correct that place."
        ) from error


_SYSTEMS: Mapping[str, Callable[..., Any]] = {
    "damper": ImpactDamper,
    "physical": ImpactDamper.from_physical,
    "mechanism": Mechanism,
}
_PARTS: Mapping[str, Callable[..., Any]] = {"forces": Harmonic, "contacts": Contact}


def _parts(path: Any, name: str, table: Any) -> Any:
    """A table of a mechanism with its forces and contacts built, any other as it is."""
    if name != "mechanism" or not isinstance(table, dict):
        return table
    return table | {key: _several(path, key, table[key]) for key in _PARTS if key in table}


def _several(path: Any, key: str, items: Any) -> list[Any]:
    label = f"[[mechanism.{key}]]"
    if not isinstance(items, list):
        raise InvalidParameterError(f"config = {path}: {key} must be tables {label}.")
    numbered = [f"{label} {i + 1}" for i in range(len(items))] if len(items) > 1 else [label]
    return [
        _built(path, where, _PARTS[key], item) for where, item in zip(numbered, items, strict=False)
    ]


def _built(path: Any, where: str, make: Callable[..., Any], table: Any) -> Any:
    """Call ``make`` with the entries of a table; what is wrong is said with file and table."""
    if not isinstance(table, dict):
        raise InvalidParameterError(
            f"config = {path}: {where} must be a table of names and values."
        )
    names = inspect.signature(make).parameters
    missing = [n for n, p in names.items() if p.default is p.empty and n not in table]
    try:
        for name in table:
            if name not in names and not isinstance(make, type):  # classes say more themselves
                raise unknown_keyword(where, name, [*names])
        if missing and not table.keys() - names:
            raise InvalidParameterError(f"{', '.join(missing)}: missing.")
        return make(**table)
    except InvalidParameterError as error:
        raise InvalidParameterError(f"config = {path}: {where}: {error}") from error
