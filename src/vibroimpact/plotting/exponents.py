"""Pictures of Lyapunov exponents: how their averages settle."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_kind
from vibroimpact.machines.units import units_of
from vibroimpact.plotting import style
from vibroimpact.simulation.lyapunov import LyapunovEstimate
from vibroimpact.simulation.lyapunov_spectrum import LyapunovSpectrum


def plot_exponents(
    exponents: LyapunovEstimate | LyapunovSpectrum, *, ax: Axes | None = None
) -> Axes:
    """Draw the averages of the growth from the start of the average to each time, and the exponents as dashes.

    Parameters
    ----------
    exponents
        A result of :func:`vibroimpact.lyapunov_exponent` or :func:`vibroimpact.lyapunov_spectrum`.

    Returns
    -------
    Axes
        The Axes drawn on. The shade is one standard error around each exponent.
    """
    kinds = (LyapunovEstimate, LyapunovSpectrum)
    check_kind(
        "exponents", exponents, kinds, "what vi.lyapunov_exponent or vi.lyapunov_spectrum gives"
    )
    if isinstance(exponents, LyapunovEstimate):
        values, errors = np.array([exponents.value]), np.array([exponents.error])
    else:
        values, errors = exponents.values, exponents.errors
    time = np.cumsum(exponents.duration)
    growth = np.cumsum(exponents.growth.reshape(len(time), -1), axis=0)
    with style.drawing(ax) as ax:
        for k, colour in enumerate(style.series(len(values))):
            if k < growth.shape[1]:
                ax.plot(time, growth[:, k] / time, color=colour, label=rf"$\lambda_{{{k + 1}}}$")
            if np.isfinite(values[k]):
                ax.axhline(values[k], color=colour, linestyle="--", linewidth=0.8)
                low, high = values[k] - errors[k], values[k] + errors[k]
                ax.axhspan(low, high, color=colour, alpha=0.15, linewidth=0.0)
        units = units_of(exponents.system)
        ax.set(
            xlabel=units.label("time $t$", "time"),
            ylabel=units.label(r"average growth $\lambda$", "rate"),
        )
        if len(time):
            style.legend_outside(ax)
    return ax
