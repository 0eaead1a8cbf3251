"""Duration of the chaotic transient at Fig. 4(f): starts that have not settled, after some time.

All starts end on periodic motions, but the chaos before is long: a figure drawn after the
thousands of impacts that it needs shows chaos.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibroimpact.sweeps.starts import GridStarts
from vibroimpact.sweeps.sweep import sweep
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.planes import HALF_WIDTH, START

PANEL = "4f"


class Survivors(NamedTuple):
    """Starts whose motion has not settled on a periodic one.

    Attributes
    ----------
    starts
        Number of starts.
    impacts
        Impacts of a motion so far, at both stops; the largest number among the starts.
    left
        Starts that have not settled after them.
    """

    starts: int
    impacts: tuple[int, ...]
    left: tuple[int, ...]

    @property
    def fold(self) -> float:
        """Impacts in which the remaining number falls by a factor e.

        Infinite if none settles, NaN if all have at the second count.
        """
        last = max((i for i, left in enumerate(self.left) if left), default=0)
        if last == 0:
            return math.nan
        gone = math.log(self.left[0] / self.left[last])
        return (self.impacts[last] - self.impacts[0]) / gone if gone else math.inf

    def record(self) -> dict[str, object]:
        """Return the numbers as plain data."""
        return {"panel": PANEL, **self._asdict(), "e_folding_impacts": self.fold}


def survivors(chosen: ParameterSet, omega: float, plan: Plan) -> Survivors:
    """Count the starts on a grid, as wide as that of the basins, that have not settled in time."""
    half = HALF_WIDTH * chosen.parameters.half_clearance
    axes = (half * np.linspace(-1.0, 1.0, count) for count in plan.transient_starts)
    grid = GridStarts(dict(zip(("x1", "v1"), axes, strict=True)), START)
    impacts, left = [], []
    for periods in plan.transient_periods:
        found = sweep(
            damper_of(chosen, omega), over={"omega": [omega]}, start=grid, progress=False,
            observe=("symbol", "impacts"), settle_periods=periods, periods=plan.plane_periods,
            most_impacts=16 * periods,
        )  # fmt: skip
        a_period = float((found["impacts_a"] + found["impacts_b"]).max())
        impacts.append(round(a_period * periods))
        left.append(int((found["n"] == 0).sum()))
    return Survivors(grid.states().position.shape[0], tuple(impacts), tuple(left))
