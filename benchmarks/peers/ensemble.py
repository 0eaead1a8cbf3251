"""vibroimpact's ensembles: all starts in one call, one thread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.ensemble_run import Prepared
from benchmarks.peers.method import Result
from benchmarks.structures import damper
from vibroimpact.ensembles.observers import Section


@dataclass(frozen=True, slots=True)
class RunMembers:
    """`run_members`, the compute function below `vibroimpact.sweep`, nothing observed."""

    name: str = "vibroimpact ensemble"
    settings: str = "first contact certified; one call for all starts, one thread"
    max_starts: int | None = None
    tolerance: float = 1e-9

    def run(self, starts: Floats, parameters: Parameters, impacts: int) -> Result:
        """Time the run without observers; take the impact times from the same run with sections."""
        prepared = Prepared(damper(parameters, starts), impacts)
        seconds = prepared.seconds()
        return Result(seconds, impact_times(prepared))


def impact_times(prepared: Prepared) -> Floats:
    """Return the times of all impacts, those at both stops in their order."""
    points = prepared.impacts
    stops = [prepared.run((Section(points=points, stop=stop),)) for stop in ("A", "B")]
    times = np.concatenate([found["section_time"] for found in stops], axis=1)
    return np.sort(times, axis=1)[:, :points]  # NaN, for impacts at the other stop, comes last
