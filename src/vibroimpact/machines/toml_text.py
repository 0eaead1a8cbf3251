"""Systems as TOML text, which :func:`~vibroimpact.load_machine` and the command line read."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from vibroimpact.machines.json_text import MOREAU
from vibroimpact.machines.registry import name_of
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of


def toml_of(system: System, start: State | None = None) -> str:
    """Text of a system, and of a start: of a machine its parameters, of any other system its mechanism."""
    name = name_of(system)
    parts = [_table(name, _entries(system))] if name else _of_mechanism(mechanism_of(system))
    if start is not None:
        parts.append(_table("start", _entries(start)))
    return "\n".join(parts)


def _of_mechanism(m: Mechanism) -> list[str]:
    """Tables of a mechanism, its forces and its elements."""
    law = {"impact_law": m.impact_law} if m.impact_law != MOREAU else {}
    held = {"constant_force": m.constant_force} if any(m.constant_force) else {}
    si = {"si": True} if m.si else {}
    plain = {"mass": m.mass, "damping": m.damping, "stiffness": m.stiffness} | held | law | si
    forces = [_table("[mechanism.forces]", _entries(line)) for line in m.forces]
    elements = [
        _table("[mechanism.elements]", {"kind": element.kind} | _entries(element))
        for element in m.elements
    ]
    return [_table("mechanism", plain), *forces, *elements]


def _table(name: str, entries: Mapping[str, Any]) -> str:
    """Table with its entries, a line each."""
    lines = (f"{key} = {_value(x)}\n" for key, x in entries.items())
    return f"[{name}]\n{''.join(lines)}"


def _entries(record: Any) -> dict[str, Any]:
    """Fields of a record, but for those left out: None, and by default False, empty or infinite."""
    values = ((field, getattr(record, field.name)) for field in fields(record))
    return {
        field.name: value
        for field, value in values
        if value is not None and (value != field.default or not _is_nothing(value))
    }


def _is_nothing(value: Any) -> bool:
    if isinstance(value, float):
        return math.isinf(value)
    return value is False or (isinstance(value, tuple) and not value)


def _value(value: Any) -> str:
    """A value of TOML, of nested records inline tables."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_value, value))}]"
    if is_dataclass(value):
        inside = (f"{key} = {_value(x)}" for key, x in _entries(value).items())
        return f"{{ {', '.join(inside)} }}"
    return repr(value)
