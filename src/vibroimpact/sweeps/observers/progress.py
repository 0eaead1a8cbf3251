"""Progress: how far a coordinate drifts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from vibroimpact.model.mechanism import Mechanism
from vibroimpact.sweeps.observers.observer import Observer, Variables
from vibroimpact.sweeps.observers.rows import row_variables


@dataclass(frozen=True, kw_only=True)
class Progress(Observer):
    """Drift of a coordinate per forcing period, without forcing per unit of time.

    The mean over the observed time: of a motion that repeats itself but for a drift, over whole
    periods, it is that drift.

    Parameters
    ----------
    row, label
        As in :class:`Extremes`; the variable is ``<label>_progress``.
    """

    name: ClassVar[str] = "progress"
    row: tuple[float, ...] = ()
    label: str = "x"

    def variables(self, mechanism: Mechanism) -> Variables:
        """One variable; with dim ``coordinate`` without a row."""
        per = "forcing period" if mechanism.forces else "unit of time"
        kinds = {"progress": f"progress per {per}"}
        return row_variables("per_period", kinds, self.row, self.label, mechanism)
