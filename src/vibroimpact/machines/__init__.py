"""Machines by name, how they are read and written (TOML, JSON), and published parameter sets.

A machine is one file: a class with the decorator ``machine`` and a ``mechanism``. ``vi.machines.Shaker`` is
imported when it is first used; ``__init__.pyi`` lists the machines for editors and type checkers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vibroimpact._core.words import missing_name
from vibroimpact.machines.registry import MACHINES, machine_of_class

if TYPE_CHECKING:
    from vibroimpact.machines.machine import Machine

__all__ = [entry.place.partition(":")[2] for entry in MACHINES.values()]


def __getattr__(name: str) -> Any:
    """Import a machine on its first use."""
    found: type[Machine] | None = machine_of_class(name)
    if found is None:
        raise missing_name(__name__, name, __all__)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
