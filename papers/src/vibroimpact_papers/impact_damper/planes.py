"""The plane of each parameter set around the paper's frequencies, and basins where motions coexist.

The paper varies the frequency alone. The plane shows how far its motions reach in the clearance;
the basins, the attractor of each start where several coexist at one of its frequencies.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from vibroimpact.model.state import State
from vibroimpact.sweeps.analyses.basins import basins
from vibroimpact.sweeps.analyses.plane import plane
from vibroimpact_papers.impact_damper import ParameterSet, panels
from vibroimpact_papers.impact_damper.datasets import attributes
from vibroimpact_papers.impact_damper.panel_results import PanelResult
from vibroimpact_papers.impact_damper.plan import Plan, damper_of

START = State((0.0, 0.0), (0.0, 1.0))  # both masses in the middle, the free one moving
REACH = (0.25, 1.75)  # of a plane, in half clearances of the set
MULTISTABLE = "B"
HALF_WIDTH = 0.75  # of the basins, in half clearances: every start is between the stops


def plane_data(chosen: ParameterSet, plan: Plan) -> xr.Dataset:
    """Return the plane (omega, half_clearance) of a set, with the paper's frequencies."""
    sweep, clearance = plan.sweeps[chosen.name], chosen.parameters.half_clearance
    across, up = plan.plane_points
    found = plane(
        damper_of(chosen, sweep.low),
        over={
            "omega": np.linspace(sweep.low, sweep.high, across),
            "half_clearance": clearance * np.linspace(*REACH, up),
        },
        start=START, observe="lyapunov", settle_periods=plan.plane_settle, periods=plan.plane_periods,
        progress=False,
    )[["motion", "period", "impacts", "lyapunov"]]  # fmt: skip
    found["paper_omega"] = "panel", frequencies(chosen)
    return _signed(found, f"plane-{chosen.name}", chosen, plan)


def frequencies(chosen: ParameterSet) -> list[float]:
    """Return the frequencies of the paper's sections of a set."""
    return [p.omega for p in panels() if p.set == chosen.name and isinstance(p.omega, float)]


def multistable_panel(results: Mapping[str, PanelResult]) -> PanelResult | None:
    """Return the panel of set B with the lowest frequency at which attractors coexist."""
    several = [r for r in results.values() if r.panel.set == MULTISTABLE and len(r.distinct) > 1]
    return min(several, key=lambda r: r.omega, default=None)


def basin_data(chosen: ParameterSet, plan: Plan, omega: float) -> xr.Dataset:
    """Return the basins over place and velocity of the main mass, the rest as in ``START``."""
    axis = HALF_WIDTH * chosen.parameters.half_clearance * np.linspace(-1.0, 1.0, plan.basin_points)
    found = basins(
        damper_of(chosen, omega), over={"x1": axis, "v1": axis}, start=START,
        settle_periods=plan.basin_settle, periods=plan.plane_periods, progress=False,
    )  # fmt: skip
    kept = ["attractor", "final_position", "final_velocity"]
    table = [str(name) for name, v in found.data_vars.items() if v.dims[:1] == ("label",)]
    signed = _signed(found[kept + table], f"basins-{chosen.name}", chosen, plan)
    signed.attrs["omega"] = omega
    return signed


def _signed(data: xr.Dataset, figure: str, chosen: ParameterSet, plan: Plan) -> xr.Dataset:
    """Return a dataset with the attributes of every file of the report."""
    data.attrs = attributes(figure, chosen, plan) | {
        "start_position": list(START.position),
        "start_velocity": list(START.velocity),
        "start_phase": START.phase,
    }
    return data
