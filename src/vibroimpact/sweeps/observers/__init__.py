"""Observers: what is computed of a motion while it runs, without storing it.

One class each, with its options: ``vi.observe.Section(points=50)``. ``__init__.pyi`` lists them for
editors and type checkers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vibroimpact._core.words import missing_name
from vibroimpact.sweeps.observers.table import OBSERVERS

__all__ = [kind.__name__ for kind in OBSERVERS.values()]
globals().update({kind.__name__: kind for kind in OBSERVERS.values()})

if not TYPE_CHECKING:  # type checkers know the names

    def __getattr__(name: str) -> Any:
        """Say which name is meant by one that is not there."""
        raise missing_name(__name__, name, __all__)
