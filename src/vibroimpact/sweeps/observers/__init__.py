"""Observers: what is computed of a motion while it runs, without storing it.

One class each, with its options: ``vi.observe.Section(points=50)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vibroimpact.sweeps.observers.table import OBSERVERS

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...


__all__ = [kind.__name__ for kind in OBSERVERS.values()]
globals().update({kind.__name__: kind for kind in OBSERVERS.values()})
