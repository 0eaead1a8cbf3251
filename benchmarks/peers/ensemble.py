"""vibroimpact's ensembles: all starts in one call, one thread."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.case import Floats, Parameters
from benchmarks.ensemble_run import Prepared, impact_times
from benchmarks.peers.method import Result
from benchmarks.structures import damper


@dataclass(frozen=True, slots=True)
class RunMembers:
    """`run_members`, the compute function below `vibroimpact.sweep`, nothing observed."""

    name: str = "vibroimpact ensemble"
    settings: str = "first contact certified; one call for all starts, one thread"
    max_starts: int | None = None
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Time the run without observers; take the impact times from runs of 1, 2, ... impacts."""
        prepared = Prepared(damper(parameters, starts), impacts)
        seconds = prepared.seconds()
        return Result(seconds, impact_times(prepared))
