"""Plot of branches of periodic orbits, with special points and attractors behind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from vibroimpact._core.checks import check_flag, check_kind, ends_of
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.types import Floats
from vibroimpact.branches.branch import Branch, BranchProfile, profile
from vibroimpact.branches.profile import ONE_PER_ORBIT, coordinate, impacts_at, mirrored
from vibroimpact.machines.units import OF_ORBITS, Units, units_of
from vibroimpact.orbits.find import impact_of
from vibroimpact.orbits.stability import Stability
from vibroimpact.plotting import style
from vibroimpact.plotting.bifurcation_diagram import NO_IMPACT
from vibroimpact.plotting.branch_looks import in_order, marker_of, parameter_label
from vibroimpact.plotting.labels import Labels
from vibroimpact.plotting.motion_colours import colours_of
from vibroimpact.plotting.sections import coordinate_label
from vibroimpact.plotting.variables import check_dataset

LINES = {
    Stability.STABLE: "-", Stability.NEUTRAL: (0, (6.0, 1.5, 1.0, 1.5)),
    Stability.UNSTABLE: (0, (4.0, 2.0)), Stability.INADMISSIBLE: ":",
}  # fmt: skip
CLOUD = "#A8A8A8"  # attractors, behind
LEGEND_COLUMNS = 4  # the legend has so many columns
WORDS_OF_ORBITS = {
    "speed": "smallest impact speed", "clearance": "least gap between impacts",
    "period": "period $T$",
}  # fmt: skip


class _View(NamedTuple):
    """Variable that is drawn for each orbit, and the stop whose impacts it is drawn at."""

    variable: str
    stop: tuple[int, int] | None


def plot_branches(
    branches: Branch | Sequence[Branch], *, variable: str = "v1", ax: Axes | None = None,
    marks: bool = True, stop: tuple[int, int] | None = None, mirror: bool = False,
    attractors: xr.Dataset | None = None, bounds: tuple[float, float] | None = None,
) -> Axes:  # fmt: skip
    """Draw branches: stable solid, neutral dash-dotted, unstable dashed, not admissible dotted.

    Parameters
    ----------
    branches
        A branch, or several in the same parameter; each has its colour, and among several its number.
    variable
        "x1", "x2", ... places and "v1", "v2", ... velocities just after an impact, "phase" of the
        force there; or, of the whole orbit, "speed" (smallest closing speed of an impact),
        "clearance" (least gap between the impacts), "period".
    marks
        Mark and label the special points. Labels without space are left out.
    stop
        Draw the value after every impact at this stop, (contact, side); by default after the first
        impact of each orbit.
    mirror
        With ``stop``: draw the mirror images as well, thin. Only in a symmetric system is the
        mirror image of an orbit an orbit.
    attractors
        Section points behind the branches: dims named as the parameter and "point", optionally
        "direction", as for :func:`plot_bifurcation_diagram`. NaN points are left out; values of the
        parameter with NaN points only are marked at the foot of the axes.
    bounds
        Range of the parameter that is shown; by default that of the branches and attractors.
    """
    branches = _checked(branches)
    check_kind("variable", variable, str, "the name of a coordinate")
    check_flag("marks", marks)
    check_flag("mirror", mirror)
    if stop is not None:
        stop = impact_of("stop", stop)
    if attractors is not None:
        check_dataset("attractors", attractors, "vi.bifurcation_sweep")
    if bounds is not None:
        bounds = ends_of("bounds", bounds)
    names = {branch.parameter for branch in branches}
    if len(names) != 1:
        raise InvalidParameterError(
            f"branches in {', '.join(sorted(names)) or 'no parameter'}: need one or more in one."
        )
    (name,) = names
    units = units_of(*(branch.family.system for branch in branches))
    view = _View(variable, stop)
    colours = colours_of([branch.symbol for branch in branches])
    rows = -(-len(branches) // LEGEND_COLUMNS)
    height = 1.25 * style.HEIGHT + rows * style.LEGEND_ROW_INCHES
    with style.drawing(ax, width=1.6 * style.WIDTH, height=height) as ax:
        if attractors is not None:
            _cloud(ax, attractors, name, view)
        seen: set[Stability] = set()
        for branch, colour in zip(branches, colours, strict=True):
            seen |= _branch(ax, branch, view, {"color": colour, "linewidth": 1.2})
            if mirror and stop and variable not in ONE_PER_ORBIT:
                _branch(ax, branch, view, {"color": colour, "linewidth": 0.7}, image=True)
        style.widen_constant(ax)
        shown = bounds or _range(branches, attractors)
        style.whole_range(ax, shown)
        ax.set(xlabel=parameter_label(name, units), ylabel=_label(variable, units))
        _legend(ax, branches, colours, seen, points=marks, cloud=attractors is not None)
        if marks:
            _special_points(ax, branches, colours, view)
    return ax


def _checked(branches: Any) -> Sequence[Branch]:
    """Return the branches, or refuse an object that is not a branch."""
    branches = [branches] if isinstance(branches, Branch) else branches
    check_kind("branches", branches, (list, tuple), "a branch, or a list of branches")
    for i, branch in enumerate(branches):
        check_kind(f"branches[{i}]", branch, Branch, "a Branch, as continue_orbit gives")
    return cast(Sequence[Branch], branches)


def _range(branches: Sequence[Branch], attractors: xr.Dataset | None) -> list[float]:
    """Range of the parameter over branches and attractors."""
    parts = [branch.values for branch in branches]
    parts += [] if attractors is None else [attractors[branches[0].parameter].values]
    return [min(float(p.min()) for p in parts), max(float(p.max()) for p in parts)]


def _label(variable: str, units: Units) -> str:
    if variable in WORDS_OF_ORBITS:
        return units.label(WORDS_OF_ORBITS[variable], OF_ORBITS[variable])
    return coordinate_label(variable, units)


def _cloud(ax: Axes, attractors: xr.Dataset, name: str, view: _View) -> None:
    variable = view.variable
    if variable not in attractors or name not in attractors[variable].dims:
        held = ", ".join(map(str, attractors.data_vars))
        raise InvalidParameterError(
            f"attractors: hold {held} over {', '.join(map(str, attractors.dims))}; need "
            f"{variable} over {name}."
        )
    across, values = xr.broadcast(attractors[name], attractors[variable])
    known = np.isfinite(values.values)
    x, y = across.values[known], values.values[known]
    style.points(ax, x, y, color=CLOUD, zorder=1)
    found = values.transpose(name, ...).notnull().values.reshape(len(attractors[name]), -1)
    silent = attractors[name].values[~found.any(axis=1)]
    style.at_foot(ax, silent, CLOUD)
    if silent.size:
        ax.plot([], [], "s", color=CLOUD, markeredgewidth=0.0, label=NO_IMPACT)


def _curves(branch: Branch, points: BranchProfile, view: _View) -> list[Floats]:
    """Values that are drawn, one array for each impact drawn."""
    stop, variable = view.stop, view.variable
    every = [0] if stop is None or variable in ONE_PER_ORBIT else impacts_at(branch, stop)
    return [coordinate(branch, points, variable, impact) for impact in every]


def _image(branch: Branch, points: BranchProfile, view: _View) -> list[Floats]:
    """Values after the impacts of the mirror image at a stop."""
    opposite = view._replace(stop=view.stop and (view.stop[0], -view.stop[1]))
    return [mirrored(values, view.variable) for values in _curves(branch, points, opposite)]


def _branch(
    ax: Axes, branch: Branch, view: _View, look: dict[str, Any], *, image: bool = False
) -> set[Stability]:
    """Draw a branch, or its mirror image, by stability; return the kinds that occur."""
    points, variable = profile(branch), view.variable
    across = points.parameter
    if not len(points.stability):
        return set()  # a single point is not a curve
    for values in (_image if image else _curves)(branch, points, view):
        breaks = np.flatnonzero(np.diff(points.stability)) + 1
        if variable == "phase":
            turns = np.flatnonzero(np.abs(np.diff(values)) > np.pi)
            breaks = np.union1d(breaks, [*turns, *(turns + 1)]).astype(np.int64)
        for first, last in zip([0, *breaks], [*breaks, len(values) - 1], strict=True):
            if variable == "phase" and np.ptp(values[first : last + 1]) > np.pi:
                continue  # from 2 pi to 0
            line = LINES[Stability(points.stability[min(first, len(values) - 2)])]
            ax.plot(across[first : last + 1], values[first : last + 1], linestyle=line,
                    dash_capstyle="butt", zorder=2, **look)  # fmt: skip
    return {Stability(s) for s in points.stability}


def _special_points(
    ax: Axes, branches: Sequence[Branch], colours: Sequence[str], view: _View
) -> None:
    labels = Labels(ax)
    for branch, colour in zip(branches, colours, strict=True):
        points = profile(branch)
        across = points.parameter
        for values in _curves(branch, points, view)[:1]:
            for i in np.flatnonzero(points.special >= 0):
                point = branch.special_points[points.special[i]]
                ax.plot(across[i], values[i], **marker_of(point.record))
                labels.add(point.label, across[i], values[i], colour)
    labels.place()


def _legend(
    ax: Axes,
    branches: Sequence[Branch],
    colours: Sequence[str],
    seen: set[Stability],
    *,
    points: bool,
    cloud: bool,
) -> None:
    """Add the entries of the legend; they hold no data."""
    if len(branches) > 1:
        for number, (branch, colour) in enumerate(zip(branches, colours, strict=True)):
            kind = ", symmetric" if branch.family.signature.symmetric else ""
            ax.plot([], [], color=colour, linewidth=1.2, label=f"{number}: {branch.symbol}{kind}")
    for stability in sorted(seen):
        ax.plot([], [], linestyle=LINES[stability], color=style.BLACK, label=stability.words)
    kinds = (point.record for branch in branches for point in branch.special_points if points)
    for one in in_order(kinds):
        ax.plot([], [], label=one.name, **marker_of(one))
    if cloud:
        ax.plot([], [], "o", color=CLOUD, markeredgewidth=0.0, label="attractors")
    if ax.get_legend_handles_labels()[0]:
        style.legend_outside(ax, columns=LEGEND_COLUMNS)
