"""Table of the observers: those of the kernel, each in the file that has its name."""

from __future__ import annotations

from importlib import import_module

from vibroimpact.sweeps.observers.observer import KERNEL, Observer


def _observer_in(name: str) -> type[Observer]:
    module = import_module(f"{__package__}.{name}")
    (found,) = (
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, Observer)
        and vars(value).get("name") == name
    )
    return found


OBSERVERS = {name: _observer_in(name) for name in KERNEL}
