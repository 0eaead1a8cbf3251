"""Exact dynamics and bifurcations of vibro-impact systems.

Names are imported when they are first used: ``import vibroimpact`` loads none of its subpackages.
``__init__.pyi`` lists the public names and the module of each, for type checkers and editors too.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_ROOMS = {name: room for room, name in re.findall(r"^from (\S+) import \(?\s*(\w+)", _STUB, re.M)}
_MODULES = dict(re.findall(r"^(\w+) = (\w+)$", _STUB, re.M))  # public name: file

__all__ = sorted(
    {*_ROOMS}
    - {*_MODULES.values()}
    - {"continuation", "machines", "measures", "normal_forms", "plotting"}
)


def __getattr__(name: str) -> Any:
    """Import a public name on its first use."""
    if name == "__version__":
        value = import_module("vibroimpact._kernel").version()
    elif (original := _MODULES.get(name, name)) in _ROOMS:
        room = _ROOMS[original]
        value = vars(import_module(room)).get(original) or import_module(f"{room}.{original}")
    else:
        raise AttributeError(f"module 'vibroimpact' has no attribute {name!r}.{_meant(name)}")
    globals()[name] = value
    return value


@cache  # tools that look for attributes of their own ask again and again
def _meant(name: str) -> str:
    """The public name that is meant, as a question."""
    words = import_module("vibroimpact._core.words")
    if name.startswith("plot_"):
        pictures: str = words.meant(
            name, vars(import_module("vibroimpact.plotting")), prefix="vi.plotting."
        )
        return pictures or " Pictures are in vi.plotting, and every result has plot()."
    return str(words.meant(name, [*__dir__(), *_MODULES], words.OF_THE_PACKAGE, "vi."))


def __dir__() -> list[str]:
    return sorted({*_ROOMS, *_MODULES, "__version__"} - {*_MODULES.values()})
