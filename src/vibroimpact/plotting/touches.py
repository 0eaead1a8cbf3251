"""Plot of the normal form at a touch: impact speeds next to it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from vibroimpact._core.checks import check_kind, ends_of, numbers
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.normal_forms.touch import SQUARE_ROOT, Touch
from vibroimpact.plotting import style

VALUES = 400  # of the parameter
TURNS = 150  # at each, after the map has settled
TURNS_OF_BOUNDS = 3  # the range ends, by default, with the window of one impact in so many turns
MOST_TURNS = 8  # orbits with one impact are drawn up to so many


def plot_touch(
    form: Touch,
    bounds: tuple[float, float] | None = None,
    *,
    simulated: tuple[ArrayLike, ArrayLike] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the impact speeds that the normal form at a touch predicts.

    Parameters
    ----------
    form
        A touch, ``branch["GR1"].normal_form``.
    bounds
        Range of dp, the distance of the parameter from the touch; by default that down to one impact in three turns.
    simulated
        Distances dp and impact speeds of simulations, shapes (n,) and (n,) or (n, m), to draw beside; zeros and NaN are
        left out.

    Returns
    -------
    Axes
        The Axes drawn on: dots where the map of the normal form settles; lines, dashed where unstable, for the orbits
        with one impact in n turns; dotted the law sqrt|dp| of a first impact.
    """
    check_kind("form", form, Touch, "a Touch, as branch['GR1'].normal_form gives")
    low, high = _range(form) if bounds is None else ends_of("bounds", bounds)
    dp = np.linspace(low, high, VALUES)
    pairs = None if simulated is None else _pairs(simulated)
    with style.drawing(ax) as ax:
        speeds = form.impacts(dp, TURNS)
        struck = speeds > 0.0
        style.points(
            ax,
            np.repeat(dp, TURNS)[struck.ravel()],
            speeds[struck],
            color=style.SILVER,
            markersize=1.2,
            label="map",
        )
        if pairs is not None:
            at, seen = pairs
            inside = (at >= low) & (at <= high)
            style.points(
                ax, at[inside], seen[inside], color=style.BLUE, markersize=1.2, label="simulated"
            )
        ahead = dp[np.sign(dp) == form.side]
        law = form.speed_factor * np.sqrt(np.abs(ahead))
        ax.plot(ahead, law, ":", color=style.GREY, linewidth=0.8, label=r"$\propto\sqrt{|dp|}$")
        _draw_orbits(ax, form, dp)
        ax.axvline(0.0, color=style.GREY, linewidth=0.5)
        ax.set(xlabel=f"{form.parameter} - {form.at:.6g}", ylabel="impact speed", xlim=(low, high))
        ax.set_ylim(bottom=0.0)
        ax.locator_params(axis="x", nbins=5)
        style.legend_outside(ax, columns=2)
    return ax


def _range(form: Touch) -> tuple[float, float]:
    """Range around the touch in which the map has what it is drawn for."""
    if form.power != SQUARE_ROOT:
        reach = 1e-2 * form.acceleration / abs(form.opening)
    else:
        windows = {w.turns: w for w in form.windows(TURNS_OF_BOUNDS)}
        ends = [abs(x) for w in windows.values() for x in (w.low, w.high) if np.isfinite(x)]
        reach = min(ends, default=0.0) * 4.0 or form.reaction() ** 2 / abs(form.opening)
    return (-reach, reach / 4.0) if form.side < 0 else (-reach / 4.0, reach)


def _draw_orbits(ax: Axes, form: Touch, dp: Floats) -> None:
    """Lines of the orbits with one impact in n turns."""
    looks: dict[str, Any] = {"color": style.VERMILION, "linewidth": 0.8}
    ax.plot([], [], label="one impact in $n$ turns", **looks)
    if form.power != SQUARE_ROOT:
        speeds = [next(iter(form.speed(x)), np.nan) for x in dp]
        ax.plot(dp, speeds, "-" if form.added().stable else "--", **looks)
        return
    for turns in range(1, MOST_TURNS + 1):
        at, speed, stable = form.orbits(turns)
        for kept, line in ((stable, "-"), (~stable, "--")):
            drawn = np.where(kept & (at >= dp[0]) & (at <= dp[-1]), speed, np.nan)
            if np.any(np.isfinite(drawn)):
                ax.plot(at, drawn, line, **looks)


def _pairs(simulated: Any) -> tuple[Floats, Floats]:
    """Distances and speeds of simulations, one of each for every impact."""
    if not isinstance(simulated, tuple | list) or len(simulated) != 2:
        raise InvalidParameterError("simulated: must be (dp, speeds), two arrays.")
    at, speeds = numbers("dp", simulated[0]), np.asarray(simulated[1], dtype=float)
    if at.ndim != 1 or speeds.shape[:1] != at.shape:
        raise InvalidParameterError(
            f"simulated: dp has shape {at.shape}, speeds {speeds.shape}; must be (n,) and (n,) or (n, m)."
        )
    every = np.repeat(at, int(np.prod(speeds.shape[1:], dtype=int)))
    struck = np.nan_to_num(speeds).ravel() > 0.0
    return every[struck], speeds.ravel()[struck]
