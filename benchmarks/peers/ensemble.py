"""vibroimpact's ensembles: all starts in one call, one thread."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.case import Floats, Parameters
from benchmarks.ensemble_run import Prepared
from benchmarks.peers.method import Result
from benchmarks.structures import damper
from vibroimpact.ensembles.batch import run_members
from vibroimpact.ensembles.observers import Section

JUST_AFTER = 1e-12  # of the time


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
    points, last = prepared.impacts, prepared.run()["time"]
    # a window that ends just after the last of them: runs that end before their window keep nothing
    members = replace(prepared.members, observe=last * (1.0 + JUST_AFTER), most_impacts=2 * points)
    stops = [Section(points=points + 1, stop=stop) for stop in ("A", "B")]
    found = [run_members(prepared.batch, members, (stop,))["section_time"] for stop in stops]
    # NaN, for impacts at the other stop, comes last
    return np.sort(np.concatenate(found, axis=1), axis=1)[:, :points]
