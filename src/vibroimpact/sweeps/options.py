"""Options of planes, basins and diagrams for their sweeps: observers, axes, arguments."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from vibroimpact._core.checks import shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.sweeps.observers.observer import Observer
from vibroimpact.sweeps.observers.selection import key_of, resolve

Observe = str | Observer | Sequence[str | Observer]


def observers_of(more: Observe) -> tuple[Observer, ...]:
    """Observers of the user, who may have none."""
    return () if isinstance(more, Sequence) and not more else resolve(more)


def together(own: Observe, more: Observe) -> tuple[Observer, ...]:
    """Needed observers and those of the user, which replace needed ones of their kind and label."""
    given = observers_of(more)
    keys = {key_of(observer) for observer in given}
    return *(one for one in resolve(own) if key_of(one) not in keys), *given


def call_of(made_by: str, **own: Any) -> dict[str, str]:
    """Attributes of a dataset that say by which function it was made, and with which arguments of its own."""

    def plain(value: Any) -> Any:
        return value.item() if isinstance(value, np.generic) else asdict(value)

    return {"made_by": made_by, "call": json.dumps(own, default=plain)}


def check_axes(over: Any, count: int, what: str, example: str) -> None:
    """Refuse another number of axes."""
    if not isinstance(over, Mapping) or len(over) != count:
        given = ", ".join(map(str, over)) if isinstance(over, Mapping) and over else shown(over)
        raise InvalidParameterError(f"over = {given}: must be {what}, such as {example}.")
