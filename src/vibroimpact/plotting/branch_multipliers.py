"""Plot of the paths of the multipliers along a branch, with the unit circle."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from scipy.optimize import linear_sum_assignment

from vibroimpact._core.checks import check_kind
from vibroimpact._core.types import Complexes
from vibroimpact.branches.branch import Branch, BranchProfile, profile
from vibroimpact.branches.point import BifurcationPoint
from vibroimpact.machines.units import units_of
from vibroimpact.plotting import style
from vibroimpact.plotting.branch_looks import marker_of, parameter_label
from vibroimpact.plotting.labels import Labels
from vibroimpact.plotting.multipliers import COLOURS, unit_circle

CRITICAL_DISTANCE = 1e-4  # a critical multiplier is no farther from the unit circle
# Multipliers are drawn at these shares of a step in which two meet.
STEP_SHARES = np.linspace(0.0, 1.0, 33)
# Multipliers grow without bound towards grazing: the picture has this half width.
SHOWN_HALF_WIDTH = 1.6


def plot_branch_multipliers(branch: Branch, *, ax: Axes | None = None) -> Axes:
    """Draw the paths of the multipliers in the complex plane, coloured by the parameter.

    Parameters
    ----------
    branch
        A result of :func:`vibroimpact.continue_orbit`; its multipliers are those of the full map.

    Returns
    -------
    Axes
        The Axes drawn on. The critical multipliers of special points are marked. Stars on
        the unit circle are the strong resonances 1:1 to 1:4. Multipliers beyond 1.6 lie outside
        the picture.
    """
    check_kind("branch", branch, Branch, "a Branch, as continue_orbit gives")
    with style.drawing(ax, width=1.25 * style.WIDTH, height=1.15 * style.WIDTH) as ax:
        unit_circle(ax)
        _paths(ax, branch)
        ax.set(
            xlabel=r"$\mathrm{Re}\,\lambda$", ylabel=r"$\mathrm{Im}\,\lambda$", aspect="equal",
            xlim=(-SHOWN_HALF_WIDTH, SHOWN_HALF_WIDTH), ylim=(-SHOWN_HALF_WIDTH, SHOWN_HALF_WIDTH),
        )  # fmt: skip
        marked = [point for point in branch.special_points if len(_critical(point))]
        for kind in dict.fromkeys(point.record for point in marked):
            ax.plot([], [], label=kind.name, **marker_of(kind))
        style.legend_outside(ax, columns=2)
        _mark(ax, marked)
    return ax


def _critical(point: BifurcationPoint) -> Complexes:
    """Multipliers of a special point on the unit circle, the upper one of each pair."""
    values = point.multipliers
    near = np.abs(np.abs(values) - 1.0) < CRITICAL_DISTANCE
    return values[near & (values.imag >= 0.0)]


def _mark(ax: Axes, points: list[BifurcationPoint]) -> None:
    labels = Labels(ax)
    for point in points:
        for value in _critical(point):
            for place in {value, value.conjugate()}:
                ax.plot([place.real], [place.imag], **marker_of(point.record))
            labels.add(point.label, value.real, value.imag, style.BLACK)
    labels.place()


def _paths(ax: Axes, branch: Branch) -> None:
    points = profile(branch)
    units = units_of(branch.family.system)
    values = _sorted(_multipliers(branch, points))
    parameter = points.parameter
    norm = Normalize(float(parameter.min()), float(parameter.max()))
    look: dict[str, Any] = {"cmap": COLOURS, "norm": norm, "linewidths": 1.6, "zorder": 3}
    middle = (parameter[1:] + parameter[:-1]) / 2.0
    for i in range(values.shape[1]):
        steps = [_step(pair, i) for pair in pairwise(values)]
        lines = LineCollection([np.column_stack([z.real, z.imag]) for z in steps], **look)
        lines.set_array(middle)
        lines.set_capstyle("round")
        ax.add_collection(lines, autolim=False)
    for path in values.T:
        ax.scatter(path.real, path.imag, c=parameter, s=3.0, linewidths=0.0, cmap=COLOURS,
                   norm=norm, zorder=3)  # fmt: skip
    colours = ScalarMappable(norm, mpl.colormaps[COLOURS])
    style.colour_bar(ax, colours, parameter_label(branch.parameter, units), shrink=0.85)


def _multipliers(branch: Branch, points: BranchProfile) -> Complexes:
    """Multipliers of points and special points in order."""
    theirs = [branch.special_points[i].multipliers for i in points.special if i >= 0]
    values = np.empty((len(points.special), branch.multipliers.shape[1]), dtype=np.complex128)
    values[points.special < 0] = branch.multipliers
    values[points.special >= 0] = np.reshape(theirs, (-1, values.shape[1]))
    return values


def _step(rows: tuple[Complexes, Complexes], i: int) -> Complexes:
    """Path of multiplier i from one row to the next: a straight line, unless a pair meets there.

    Mean m and squared half difference h of the two then change linearly: m +- sqrt(h), which turn
    by a right angle at h = 0.
    """
    first, last = rows
    ends = np.array([first[i], last[i]])
    if (ends[0].imag == 0.0) == (ends[1].imag == 0.0) or not np.isfinite(ends).all():
        return ends
    row = first if first[i].imag else last
    j = int(np.argmin(np.abs(row - row[i].conjugate())))
    other = np.array([first[j], last[j]])
    mean, half = (ends + other).real / 2.0, (ends - other) / 2.0
    squares = (half**2).real
    shares = np.sort(np.append(STEP_SHARES, squares[0] / (squares[0] - squares[1])))
    root = np.sqrt((1.0 - shares) * squares[0] + shares * squares[1] + 0j)
    root.real *= np.sign(half.real.sum())
    root.imag *= np.sign(half.imag.sum())
    return np.asarray((1.0 - shares) * mean[0] + shares * mean[1] + root)


def _sorted(values: Complexes) -> Complexes:
    """Multipliers in an order in which each continues its own path."""
    rows = [values[0]]
    for _, row in pairwise(values):
        far = np.abs(rows[-1][:, None] - row[None, :])
        rows.append(row[linear_sum_assignment(np.nan_to_num(far, posinf=1e300))[1]])
    return np.array(rows)
