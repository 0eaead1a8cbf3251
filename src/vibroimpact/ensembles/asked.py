"""What planes, basins and diagrams ask of a sweep: observers of their own, axes, options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vibroimpact.ensembles.observers import Observer, key_of, resolve
from vibroimpact.errors import InvalidParameterError

Observe = str | Observer | Sequence[str | Observer]

MATCHED = "the matching of attractors fixes what is observed. For other observers: vi.sweep."


def together(own: Observe, more: Observe) -> tuple[Observer, ...]:
    """Observers that are needed, and those that the user adds; of one kind and label the user's."""
    given = resolve(more) if more else ()
    keys = {key_of(observer) for observer in given}
    return *(one for one in resolve(own) if key_of(one) not in keys), *given


def check_axes(over: Any, count: int, what: str, example: str) -> None:
    """Refuse another number of axes."""
    if not isinstance(over, Mapping) or len(over) != count:
        said = ", ".join(map(str, over)) if isinstance(over, Mapping) and over else repr(over)
        raise InvalidParameterError(f"over = {said}: must be {what}, such as {example}.")


def refuse(options: Mapping[str, Any], name: str, why: str) -> None:
    """Refuse an option of a sweep that the question itself decides."""
    if name in options:
        raise InvalidParameterError(f"{name} = {options[name]!r}: must be left out; {why}")
