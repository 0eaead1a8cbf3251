"""All Lyapunov exponents along the route of each set, followed towards lower frequencies."""

from __future__ import annotations

import numpy as np
import xarray as xr

from vibroimpact.simulation.lyapunov_spectrum import lyapunov_spectrum
from vibroimpact_papers.impact_damper import ParameterSet
from vibroimpact_papers.impact_damper.datasets import attributes
from vibroimpact_papers.impact_damper.panel_results import Followed
from vibroimpact_papers.impact_damper.plan import Plan, damper_of
from vibroimpact_papers.impact_damper.planes import frequencies

EXPONENTS = 4  # of the impact map of the damper
BESIDE = 0.1  # of the range: how far the route is followed beyond its ends


def spectrum_data(
    chosen: ParameterSet, followed: Followed, highest: float, plan: Plan
) -> xr.Dataset:
    """Return the spectrum on evenly chosen steps of the way down, from the states reached there.

    The route goes from a little above ``highest``, where circles begin, to the lowest section of
    the paper.

    Steps at which the motion sticks to a stop, or no longer impacts, have what is defined.
    """
    low, high = min(frequencies(chosen)), highest
    margin = BESIDE * (high - low)
    inside = np.flatnonzero((followed.omega >= low - margin) & (followed.omega <= high + margin))
    kept = inside[np.unique(np.linspace(0, len(inside) - 1, plan.spectrum_points).round()
                            .astype(int))]  # fmt: skip
    values, errors = (np.full((len(kept), EXPONENTS), np.nan) for _ in range(2))
    for i, k in enumerate(kept):
        omega = float(followed.omega[k])
        found = lyapunov_spectrum(
            damper_of(chosen, omega), followed.down[k].last,
            impacts=plan.spectrum_impacts, settle_impacts=0,
        )  # fmt: skip
        values[i, : len(found.values)] = found.values
        errors[i, : len(found.errors)] = found.errors
    return xr.Dataset(
        {"exponent": (("omega", "order"), values), "error": (("omega", "order"), errors)},
        coords={"omega": followed.omega[kept]},
        attrs=attributes(f"spectra-{chosen.name}", chosen, plan),
    )
