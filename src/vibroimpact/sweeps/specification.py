"""Specification of a sweep: everything that determines its results, bit for bit."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from vibroimpact import _kernel
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.machines.json_text import text_of
from vibroimpact.model.parameters import names_of, with_parameters
from vibroimpact.model.system import System, mechanism_of
from vibroimpact.sweeps.observers.selection import describe
from vibroimpact.sweeps.plan import Plan

Values = tuple[float, ...]

SPECIFICATION_ATTRIBUTE = "question"  # datasets and stores hold the text of the specification in it


@dataclass(frozen=True)
class SweepSpec:
    """Everything that determines the results of a sweep."""

    # JSON: parameters of the system, its mechanism at the first and the last values of the swept ones, names of the
    # axes, starts, window, observers, version of the kernel
    text: str
    axes: tuple[tuple[str, Values], ...]  # values of the swept parameters and of the starts

    def differences(self, other: SweepSpec) -> list[str]:
        """Differences from another specification, one phrase each: ``name: this, not that``."""
        mine, yours = (_flat("", json.loads(one.text)) for one in (self, other))
        names = [*mine, *(name for name in yours if name not in mine)]
        phrases = {
            name: f"{name} = {_shown(mine, name)}, not {_shown(yours, name)}"
            for name in names
            if mine.get(name) != yours.get(name)
        }
        here, there = dict(self.axes), dict(other.axes)
        axes = [
            _axis_phrase(name, here.get(name, ()), there.get(name, ()))
            for name in here | there
            if here.get(name) != there.get(name)
        ]
        effects = {name: text for name, text in phrases.items() if name.startswith("mechanism.")}
        chosen = [text for name, text in phrases.items() if name not in effects]
        return [*chosen, *axes, *effects.values()]


def specification_of(plan: Plan) -> SweepSpec:
    """Specification of the sweep that a plan computes."""
    ends = {
        end: json.loads(text_of(mechanism_of(at_end(plan, place))))
        for end, place in (("first", 0), ("last", -1))
    }
    starts = plan.starts.coords.items()
    axes = plan.axes | {name: values for name, (dim, values) in starts if dim == name}
    described = {
        "version": _kernel.version(),
        "system": {"type": type(plan.system).__name__, **_fixed(plan.system, plan)},
        "mechanism": ends,
        "start": plan.starts.describe(),
        "observe": describe(plan.observers),
        "window": plan.window._asdict(),
        "follow": plan.follow,
        "axes": list(axes),
    }
    values = tuple((name, tuple(axis.tolist())) for name, axis in axes.items())
    return SweepSpec(json.dumps(described), values)


def at_end(plan: Plan, place: int) -> System:
    """System at the first (0) or the last (-1) values of the swept parameters."""
    return with_parameters(
        plan.system, {name: float(axis[place]) for name, axis in plan.axes.items()}
    )


def _fixed(system: System, plan: Plan) -> dict[str, float]:
    """Parameters that are not swept; none for a system without names for them."""
    try:
        return {name: x for name, x in names_of(system).items() if name not in plan.axes}
    except InvalidParameterError:
        return {}


def _flat(name: str, value: Any) -> dict[str, Any]:
    """Flatten {"a": {"b": [1, 2]}} to {"a.b[0]": 1, "a.b[1]": 2}."""
    if isinstance(value, dict):
        parts = [(f"{name}.{key}" if name else key, inside) for key, inside in value.items()]
    elif isinstance(value, list):
        parts = [(f"{name}[{i}]", inside) for i, inside in enumerate(value)]
    else:
        return {name: value}
    return {k: v for key, inside in parts for k, v in _flat(key, inside).items()}


def _axis_phrase(name: str, mine: Values, yours: Values) -> str:
    """Size and ends of an axis, or the first value that differs where these agree."""
    if _span(mine) != _span(yours):
        return f"{name} = {_span(mine)}, not {_span(yours)}"
    i = next(i for i, (x, y) in enumerate(zip(mine, yours, strict=True)) if x != y)
    return f"{name}[{i}] = {mine[i]!r}, not {yours[i]!r}"


def _span(values: Values) -> str:
    if not values:
        return "nothing"
    return f"{len(values)} value{'s' * (len(values) > 1)} from {values[0]!r} to {values[-1]!r}"


def _shown(flat: dict[str, Any], name: str) -> str:
    return repr(flat[name]) if name in flat else "nothing"
