"""Observers of coordinates: of a row on positions, velocities and accelerations, or of each coordinate."""

from __future__ import annotations

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import COORDINATE, Variables, real

QUANTITIES = ("length", "velocity", "acceleration")  # of the parts of a row


def row_variables(
    table: str, kinds: dict[str, str], row: tuple[float, ...], label: str, mechanism: Mechanism
) -> Variables:
    """One variable of each kind, in the order of the kernel's columns."""
    n = mechanism.degrees
    parts = [row[i : i + n] for i in range(0, len(row), n)]
    if len(row) not in (0, n, 2 * n, 3 * n):
        raise InvalidParameterError(
            f"row has shape ({len(row)},); expected ({n},) for positions, ({2 * n},) with velocities behind "
            f"them, or ({3 * n},) with accelerations, too."
        )
    dims, shape = ((), ()) if row else ((COORDINATE,), (n,))
    on = ("", "x", "(x, v)", "(x, v, a)")[len(parts)]
    what, rows = (f"{label} = {row} . {on}", 1) if row else ("coordinates", n)
    measured = [q for q, part in zip(QUANTITIES, parts, strict=False) if any(part)]
    quantity = measured[0] if len(measured) == 1 else ""
    count = len(kinds)
    return {
        f"{label}_{kind}": real(
            table, f"{text} of {what}", slice(i, count * rows, count),
            dims=dims, shape=shape, quantity=quantity if row else "length",
        )
        for i, (kind, text) in enumerate(kinds.items())
    }  # fmt: skip
