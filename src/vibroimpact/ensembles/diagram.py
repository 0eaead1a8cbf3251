"""Bifurcation diagrams by brute force: where motions end, value by value of a parameter.

The motion at a value starts where the one at the value before ended, upwards and then back, so that
attractors that coexist are both seen; or every value has the same random starts.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from vibroimpact.ensembles.asked import Observe, check_axes, together
from vibroimpact.ensembles.observers import Section
from vibroimpact.ensembles.starts import RandomStarts
from vibroimpact.ensembles.sweep import sweep
from vibroimpact.errors import InvalidParameterError
from vibroimpact.mechanism import check_count
from vibroimpact.motion import Stop
from vibroimpact.simulate import System
from vibroimpact.state import State

Way = Literal["up", "down", "both"]
WAYS = ("up", "down", "both")
SECTION = ("position", "velocity", "phase")


def bifurcation_sweep(
    system: System, *, over: Mapping[str, ArrayLike], start: State | RandomStarts,
    way: Way = "both", stop: Stop = "A", contact: int = 0, points: int = 60,
    observe: Observe = (), **options: Any,
) -> xr.Dataset:  # fmt: skip
    """Compute section points along a parameter, followed up and down or from random starts.

    Parameters
    ----------
    system
        Gives the other parameters.
    over
        Values of one parameter, such as ``{"omega": np.linspace(0.9, 1.1, 400)}``.
    start
        A state at the first value, which is followed; or random starts, the same at every value.
    way
        "up", "down", or "both": up from ``start``, then down from where that ended. Random starts
        are not followed.
    stop, contact
        The section, as in :func:`~vibroimpact.impact_section`.
    points
        Last section points kept at every value, >= 1.
    observe
        More observers, such as "lyapunov".
    **options
        Of :func:`~vibroimpact.sweep`: settle, periods, most_impacts, backend, workers, progress.

    Returns
    -------
    Dataset
        ``x1``, ``x2``, ..., ``v1``, ..., ``phase``: the states just after the impacts, with dims
        "direction" ("up", "down") or "start", the parameter, and "point"; NaN where the motion has
        fewer points in its window. Beside them what else was observed. Draw it by
        :func:`vibroimpact.plotting.plot_bifurcation_diagram`.

    Raises
    ------
    InvalidParameterError
        Other than one parameter, no such stop, what ``sweep`` refuses.

    Notes
    -----
    The cost of ``settle + periods`` forcing periods at every value, twice for both ways. ``points``
    should fit into ``periods``. Near a bifurcation motions settle slowly.

    Examples
    --------
    >>> import numpy as np
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> over = {"omega": np.linspace(1.15, 1.2, 6)}
    >>> diagram = vi.bifurcation_sweep(damper, over=over, start=vi.State((0, 0), (0, 1)), points=5,
    ...                               progress=False)
    >>> dict(diagram["v1"].sizes)
    {'direction': 2, 'omega': 6, 'point': 5}
    """
    check_axes(over, 1, "one parameter with its values", '{"omega": np.linspace(0.9, 1.1, 400)}')
    if way not in WAYS:
        raise InvalidParameterError(f"way = {way!r}: must be one of {', '.join(WAYS)}.")
    check_count("points", points, 1)
    section = Section(points=points, contact=contact, stop=stop)
    asked = {"over": over, "observe": together([section, "final"], observe)} | options
    if isinstance(start, RandomStarts):
        return _columns(sweep(system, start=start, **asked))
    return _columns(_followed(system, next(iter(over)), way, start, asked))


def _followed(
    system: System, name: str, way: Way, start: State, asked: dict[str, Any]
) -> xr.Dataset:
    """One sweep per direction, the second from where the first ended."""
    directions = ("up", "down") if way == "both" else (way,)
    parts = []
    for direction in directions:
        sign = "" if direction == "up" else "-"
        parts.append(sweep(system, start=start, follow=sign + name, **asked))
        start = _last(parts[-1], name, direction)
    joined = xr.concat(parts, "direction", combine_attrs="override")
    return joined.assign_coords(direction=list(directions))


def _last(part: xr.Dataset, name: str, direction: str) -> State:
    """Where the motion ended at the last value."""
    values = part[name].values
    row = part.isel({name: int(np.argmax(values) if direction == "up" else np.argmin(values))})
    return State(
        tuple(row["final_position"].values), tuple(row["final_velocity"].values),
        float(row["final_phase"]),
    )  # fmt: skip


def _columns(members: xr.Dataset) -> xr.Dataset:
    """Each coordinate of the section under its own name."""
    drawn = [name for name in members.coords if name not in members.dims]
    members = members.drop_vars(drawn)  # coordinates of random starts: x1, v1, ... themselves
    columns = {"phase": members["section_phase"]}
    for kind, letter in (("position", "x"), ("velocity", "v")):
        array = members[f"section_{kind}"]
        for i in range(array.sizes["coordinate"]):
            columns[f"{letter}{i + 1}"] = array.isel(coordinate=i, drop=True)
    return members.drop_vars([f"section_{kind}" for kind in SECTION]).assign(columns)
