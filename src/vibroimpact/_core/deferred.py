"""Functions of higher layers, for methods that only pass a result to them.

``section.plot()`` draws, ``branch.to_dataset()`` converts: the method belongs to the result, the
work is done by a package of a higher layer. The name is resolved by the first call, so that
matplotlib is imported only when something is drawn.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def deferred(module: str, function: str) -> Any:
    """A function of ``vibroimpact.<module>``."""
    return getattr(import_module(f"vibroimpact.{module}"), function)
