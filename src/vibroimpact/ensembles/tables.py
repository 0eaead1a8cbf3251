"""Compiled systems as the arrays that the kernel's ``Batch`` takes: leading axis, the systems."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vibroimpact import _kernel
from vibroimpact.columns import Column
from vibroimpact.hybrid import Hybrid, Mode, closed_from_code

Floats = NDArray[np.float64]


class Runs(Protocol):
    """What runs members of systems of one structure: ``_kernel.Batch``, or its like elsewhere."""

    def run(self, *args: Any, **kwargs: Any) -> dict[str, NDArray[Any]]:
        """Arguments and results are those of ``_kernel.Batch.run``."""


@dataclass(frozen=True)
class Tables:
    """Systems of one structure: arguments of ``_kernel.Batch`` and of its ``add_mode``.

    Attributes
    ----------
    dense, degrees
        What all systems share.
    systems
        Arrays with one entry per system; shapes as ``_kernel.Batch`` says.
    modes
        One dictionary per mode, arrays likewise.
    """

    dense: bool
    degrees: int
    systems: dict[str, Floats]
    modes: list[dict[str, Any]]

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Coordinates, contacts and forcing lines."""
        lines = self.systems["omegas"].shape[1]
        return self.degrees, self.systems["restitution"].shape[1], lines

    @property
    def structure(self) -> tuple[object, ...]:
        """What systems of one kernel batch have in common."""
        return self.dense, self.sizes, tuple(mode["code"] for mode in self.modes)

    def kernel(self) -> _kernel.Batch:
        """Hand them to the kernel."""
        batch = _kernel.Batch(dense=self.dense, degrees=self.degrees, **self.systems)
        for mode in self.modes:
            batch.add_mode(**mode)
        return batch


def tables_of(hybrid: Hybrid, count: int, codes: Sequence[int] = ()) -> Tables:
    """Arrays of compiled systems.

    Parameters
    ----------
    hybrid
        Compiled with columns of ``count`` numbers, or with floats where ``count`` is 1.
    codes
        Modes wanted beside those that every system begins with.

    Raises
    ------
    InvalidParameterError
        A mode wanted whose contact forces are not determined.
    """
    m, laws = hybrid.mechanism, hybrid.laws()
    contacts, lines, size = len(m.contacts), len(m.forces), hybrid.size
    systems = {
        "omegas": _stacked(hybrid.omegas, count, lines),
        "kappas": _stacked(hybrid.kappas, count, lines),
        "steps": _stacked(hybrid.step, count),
        "impulse": _stacked([law[0] for law in laws], count, contacts, size),
        "mobility": _stacked([law[1] for law in laws], count, contacts, contacts),
        "shift": _stacked([law[2] for law in laws], count, contacts, size),
        "restitution": _stacked([law[3:] for law in laws], count, contacts, 2),
    }
    wanted = [(), *hybrid.closed, *(closed_from_code(code, contacts) for code in codes)]
    modes = [_mode(hybrid.mode(closed), hybrid, count) for closed in wanted]
    return Tables(hybrid.dense, m.degrees, systems, modes)


def _mode(mode: Mode, hybrid: Hybrid, count: int) -> dict[str, Any]:
    c, n, size = mode.coordinates, hybrid.mechanism.degrees, hybrid.size
    contacts, lines = len(mode.guards), len(hybrid.omegas)
    rows, gains, lower, upper, side = zip(*mode.guards, strict=True)
    shapes = {"b": (size, size), "constant": (size,)} if hybrid.dense else {}
    flow = {k: _stacked(x, count, *shapes.get(k, (size // 2,))) for k, x in c.flow.items()}
    return {
        "code": mode.code,
        "flow": flow,
        "rows": _stacked(rows, count, contacts, size),
        "gains": _stacked(gains, count, contacts),
        "lower": _stacked(lower, count, contacts),
        "upper": _stacked(upper, count, contacts),
        "side": list(side),
        "to_x": _stacked(c.to_x, count, n, size),
        "to_v": _stacked(c.to_v, count, n, size),
        "offset": _stacked(c.offset, count, n),
        "from_x": _stacked(c.from_x, count, size, n),
        "from_v": _stacked(c.from_v, count, size, n),
        "particular": _stacked(c.particular, count, size, 2 * lines),
    }


def _stacked(entries: Any, count: int, *shape: int) -> Floats:
    """Nested entries, floats or columns, as an array of shape (count, *shape)."""
    flat = list(entries) if shape else [entries]
    for _ in shape[1:]:
        flat = list(chain.from_iterable(flat))
    columns = {i: x.values for i, x in enumerate(flat) if isinstance(x, Column)}
    row = [0.0 if i in columns else x for i, x in enumerate(flat)]
    out = np.repeat(np.array([row], dtype=float), count, axis=0)
    for i, values in columns.items():
        out[:, i] = values
    return out.reshape(count, *shape)


def joined(parts: Sequence[Tables]) -> Tables:
    """Systems of one structure, one part after the other."""
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    systems = {name: np.concatenate([p.systems[name] for p in parts]) for name in first.systems}
    modes = [_joined_modes(modes) for modes in zip(*(p.modes for p in parts), strict=True)]
    return Tables(first.dense, first.degrees, systems, modes)


def _joined_modes(modes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    first = modes[0]
    flow = {k: np.concatenate([mode["flow"][k] for mode in modes]) for k in first["flow"]}
    same = {"code": first["code"], "flow": flow, "side": first["side"]}
    return {k: same[k] if k in same else np.concatenate([mode[k] for mode in modes]) for k in first}
