"""Observers: what is computed of a motion while it runs, without storing it.

One class each, with its options: ``vi.observe.Section(points=50)``. ``__init__.pyi`` lists them for
editors and type checkers.
"""

from __future__ import annotations

from vibroimpact.sweeps.observers.table import OBSERVERS

__all__ = [kind.__name__ for kind in OBSERVERS.values()]
globals().update({kind.__name__: kind for kind in OBSERVERS.values()})
