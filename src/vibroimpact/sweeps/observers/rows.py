"""Observers of coordinates: of a row on them, or of each."""

from __future__ import annotations

from vibroimpact._core.errors import InvalidParameterError
from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import COORDINATE, Variables, real


def row_variables(
    table: str, kinds: dict[str, str], row: tuple[float, ...], label: str, mechanism: Mechanism
) -> Variables:
    """One variable of each kind, in the order of the kernel's columns."""
    n = mechanism.degrees
    if row and len(row) != n:
        raise InvalidParameterError(f"row has shape ({len(row)},); expected ({n},).")
    dims, shape = ((), ()) if row else ((COORDINATE,), (n,))
    what, rows = (f"{label} = {row} . x", 1) if row else ("coordinates", n)
    count = len(kinds)
    return {
        f"{label}_{kind}": real(
            table, f"{text} of {what}", slice(i, count * rows, count),
            dims=dims, shape=shape, quantity="length",
        )
        for i, (kind, text) in enumerate(kinds.items())
    }  # fmt: skip
