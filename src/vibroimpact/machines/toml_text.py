"""Systems as TOML text, which :func:`~vibroimpact.load_machine` and the command line read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, cast

from vibroimpact.machines.json_text import MOREAU, stored
from vibroimpact.machines.registry import name_of
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.model.state import State
from vibroimpact.model.system import System, mechanism_of


def toml_of(system: System, start: State | None = None) -> str:
    """Text of a system, and of a start: of a machine its parameters, of any other system its mechanism."""
    name = name_of(system)
    table = asdict(cast(Any, system)) if name else None
    parts = [_table(name, table)] if name and table else _of_mechanism(mechanism_of(system))
    if start is not None:
        parts.append(_table("start", asdict(start)))
    return "\n".join(parts)


def _of_mechanism(m: Mechanism) -> list[str]:
    """Tables of a mechanism, its forces and its elements."""
    law = {"impact_law": m.impact_law} if m.impact_law != MOREAU else {}
    held = {"constant_force": m.constant_force} if any(m.constant_force) else {}
    si = {"si": True} if m.si else {}
    plain = {"mass": m.mass, "damping": m.damping, "stiffness": m.stiffness} | held | law | si
    forces = [_table("[mechanism.forces]", asdict(line)) for line in m.forces]
    elements = [_table("[mechanism.elements]", stored(element)) for element in m.elements]
    return [_table("mechanism", plain), *forces, *elements]


def _table(name: str, entries: Mapping[str, Any]) -> str:
    """Table with its entries, a line each; what is None or empty is left out."""
    lines = (f"{key} = {_value(x)}\n" for key, x in entries.items() if not _is_nothing(x))
    return f"[{name}]\n{''.join(lines)}"


def _is_nothing(value: Any) -> bool:
    return value is None or value is False or (isinstance(value, tuple | list | dict) and not value)


def _value(value: Any) -> str:
    """A value of TOML, of nested records inline tables."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        inside = (f"{key} = {_value(x)}" for key, x in value.items() if not _is_nothing(x))
        return f"{{ {', '.join(inside)} }}"
    return repr(value)
