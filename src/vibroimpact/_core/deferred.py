"""Functions of rooms above, for methods that only hand a result over to them.

``section.plot()`` draws, ``branch.to_dataset()`` writes: the method stands where a user looks for
it, the work is done by a room that imports this one. The name is resolved by the first call, so
that nobody who does not draw imports matplotlib.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def deferred(module: str, function: str) -> Any:
    """A function of ``vibroimpact.<module>``."""
    return getattr(import_module(f"vibroimpact.{module}"), function)
