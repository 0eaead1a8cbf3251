"""Time histories of hybrid systems given as data, with the mode that lasts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_kind
from vibroimpact.plotting import style
from vibroimpact.plotting.history import COLOURS, HISTORY_POINTS
from vibroimpact.simulation.hybrid_run import HybridRun

WHITE_SHARE = 0.75  # the shade of a mode has this share of white


def plot_hybrid_run(run: HybridRun, *, ax: Axes | None = None) -> Axes:
    """Draw the states of a hybrid system over time, on the shade of the mode that lasts, or that slides.

    Parameters
    ----------
    run
        A result of :func:`vibroimpact.simulate_hybrid`.
    """
    check_kind("run", run, HybridRun, "a HybridRun, as vi.simulate_hybrid gives")
    last = float(run.time[-1]) if len(run) else 0.0
    t = np.union1d(np.linspace(0.0, last, HISTORY_POINTS), run.time)
    names = [name for name in run.system.modes if name in run.modes]
    names += sorted(set(run.modes) - set(names))  # those that slide
    shades = {
        name: style.mixed(colour, "#FFFFFF", WHITE_SHARE)
        for name, colour in zip(names, style.series(len(names)), strict=True)
    }
    with style.drawing(ax, width=1.6 * style.WIDTH) as ax:
        labelled = set[str]()
        for (begin, end), name in zip(pairwise([0.0, *run.time]), run.modes, strict=False):
            label = "" if name in labelled else name
            ax.axvspan(begin, end, color=shades[name], linewidth=0.0, label=label)
            labelled.add(name)
        for i, y in enumerate(run.at(t).T):
            ax.plot(t, y, color=COLOURS[i % len(COLOURS)], label=f"$y_{{{i + 1}}}$")
        ax.set(xlabel="time $t$", ylabel="state", xlim=(0.0, last or 1.0))
        style.legend_outside(ax, columns=6)
    return ax
