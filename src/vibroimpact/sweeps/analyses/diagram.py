"""Bifurcation diagrams by brute force: section points of motions, value by value of a parameter.

The motion at a value starts where the one at the former value ended, upwards and then back, to find
coexisting attractors; or every value has the same random starts.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import check_choice, check_kind
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, interruptible
from vibroimpact.model.state import STATE, State
from vibroimpact.model.system import System
from vibroimpact.simulation.places import AtPhase, AtStop
from vibroimpact.sweeps.axes import is_coordinate
from vibroimpact.sweeps.observers.attractor_section import observed_place, section_observer
from vibroimpact.sweeps.observers.selection import describe
from vibroimpact.sweeps.options import (
    Observe,
    call_of,
    check_axes,
    observers_of,
    together,
)
from vibroimpact.sweeps.starts import ListedStarts, RandomStarts
from vibroimpact.sweeps.sweep import sweep

Way = Literal["up", "down", "both"]
WAYS = ("up", "down", "both")


@interruptible
def bifurcation_sweep(
    system: System,
    *,
    over: Mapping[str, ArrayLike],
    start: State | RandomStarts | ListedStarts,
    way: Way = "both",
    at: AtStop | AtPhase | None = None,
    points: int = 60,
    observe: Observe = (),
    settle_periods: float = 250,
    periods: float = 50,
    most_impacts: int | None = None,
    store: str | os.PathLike[str] | None = None,
    backend: str = "threads",
    workers: int | None = None,
    client: Any = None,
    tile: int | None = None,
    progress: ProgressOption = True,
) -> xr.Dataset:
    """Compute section points along a parameter, followed up and down or from many starts.

    Parameters
    ----------
    system
        System with the other parameters.
    over
        Values of one parameter, such as ``{"omega": np.linspace(0.9, 1.1, 400)}``.
    start
        A state at the first value, which is followed; or random or listed starts, the same at
        every value.
    way
        "up", "down", or "both": up from ``start``, then down from where that ended, or from
        ``start`` if nothing ran at the last value. Several starts are not followed.
    at
        Where the points are, as in :func:`~vibroimpact.section`; at a phase a motion without impacts
        has points, too.
    points
        Number of last section points kept at every value, 1 to 10^6.
    observe
        Further observers, such as "lyapunov".
    settle_periods, periods, most_impacts, store, backend, workers, client, tile, progress
        As for :func:`~vibroimpact.sweep`; no store if both ways are followed: each is a sweep of its
        own.

    Returns
    -------
    Dataset
        ``x1``, ``x2``, ..., ``v1``, ..., ``phase``: the states just after the impacts, or at the
        phase, with dims "direction" ("up", "down") or "start", the parameter, and "point" ("strobe"
        at a phase); NaN where the motion has fewer points in its window. Also the variables of the
        other observers. :func:`vibroimpact.plotting.plot_bifurcation_diagram` draws it.

    Raises
    ------
    InvalidParameterError
        Other than one parameter, no such stop, a grid of starts, a store for both
        ways; as for ``sweep``.

    Notes
    -----
    The cost of ``settle_periods + periods`` forcing periods at every value, twice for both ways. ``points``
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
    (name,) = over
    if is_coordinate(system, name):
        raise InvalidParameterError(
            f"over = {name}: a diagram is along a parameter. Along a coordinate of the start take vi.sweep, along "
            "two vi.basins."
        )
    check_choice("way", way, WAYS)
    check_kind(
        "start", start, (State, RandomStarts, ListedStarts),
        "a State, which is followed, RandomStarts or ListedStarts",
    )  # fmt: skip
    place = observed_place(system, at)
    section = section_observer(place, points, strobes=points)
    observers = together([section, "final"], observe)
    requested: dict[str, Any] = {
        "over": over, "observe": observers, "settle_periods": settle_periods, "periods": periods,
        "most_impacts": most_impacts, "store": store, "backend": backend, "workers": workers,
        "client": client, "tile": tile, "progress": progress,
    }  # fmt: skip
    if isinstance(start, State):
        members = _followed(system, name, way, start, requested)
    else:
        members = sweep(system, start=start, **requested)
    more = describe(observers_of(observe))
    call = call_of("bifurcation_sweep", way=way, at=place, points=points, observe=more)
    return _columns(members, section.name).assign_attrs(call)


def _followed(
    system: System, name: str, way: Way, start: State, requested: dict[str, Any]
) -> xr.Dataset:
    """One sweep per direction, the second from the end of the first."""
    directions = ("up", "down") if way == "both" else (way,)
    if len(directions) > 1 and requested["store"] is not None:
        raise InvalidParameterError(
            f'store = {requested["store"]!r}, way = "both": a store holds one sweep. Take way = "up", '
            'then way = "down" with another store.'
        )
    parts: list[xr.Dataset] = []
    for direction in directions:
        sign = "" if direction == "up" else "-"
        begin = _last_state(parts[-1], name, start) if parts else start
        parts.append(sweep(system, start=begin, follow=sign + name, **requested))
    joined = xr.concat(parts, "direction", combine_attrs="override")
    follow = ", ".join(part.attrs["follow"] for part in parts)
    sizes = json.loads(joined.attrs["sizes"]) | {"direction": len(directions)}
    made = {"follow": follow, "sizes": json.dumps(sizes)}
    return joined.assign_coords(direction=list(directions)).assign_attrs(made)


def _last_state(part: xr.Dataset, name: str, start: State) -> State:
    """Final state of the motion at the greatest value; ``start`` if none ran there."""
    row = part.isel({name: int(np.argmax(part[name].values))})
    position, velocity, phase = (row[f"final_{kind}"].values for kind in STATE)
    if not np.isfinite([*position, *velocity, phase]).all():
        return start
    return State(tuple(position), tuple(velocity), float(phase))


def _columns(members: xr.Dataset, name: str) -> xr.Dataset:
    """Each coordinate of the section under its own name."""
    drawn = [name for name in members.coords if name not in members.dims]
    members = members.drop_vars(drawn)  # coordinates of the starts: x1, v1, ... themselves
    columns = {"phase": members[f"{name}_phase"]}
    for kind, letter in (("position", "x"), ("velocity", "v")):
        array = members[f"{name}_{kind}"]
        for i in range(array.sizes["coordinate"]):
            columns[f"{letter}{i + 1}"] = array.isel(coordinate=i, drop=True)
    return members.drop_vars([f"{name}_{kind}" for kind in STATE]).assign(columns)
