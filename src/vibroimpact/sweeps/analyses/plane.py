"""Planes of two parameters: motions and numbers of attractors at every point."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibroimpact._core.checks import share, shown
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import ProgressOption, interruptible
from vibroimpact.attractors.classify import rest_on_stops
from vibroimpact.attractors.matching import (
    MEMBER_DISTANCE,
    count_attractors,
    count_symbols,
    observed_section,
    scale_of,
    strobe_symbols,
)
from vibroimpact.model.parameters import with_parameters
from vibroimpact.model.state import STATE, State
from vibroimpact.model.system import System
from vibroimpact.simulation.places import AtPhase, AtStop
from vibroimpact.sweeps.analyses.motion_codes import (
    NO_IMPACTS,
    NOT_PERIODIC,
    column_of,
    motions,
    symbols_of,
)
from vibroimpact.sweeps.observers.attractor_section import observed_place, section_observer
from vibroimpact.sweeps.options import (
    Observe,
    call_of,
    check_axes,
    together,
)
from vibroimpact.sweeps.starts import Start, grid_of
from vibroimpact.sweeps.sweep import sweep

COUNTED_POINTS = 16  # so many points of each member are counted
EXAMPLE = '{"omega": np.linspace(0.9, 1.1, 200), "half_clearance": np.linspace(1, 10, 200)}'


@interruptible
def plane(
    system: System,
    *,
    over: Mapping[str, ArrayLike],
    start: State,
    observe: Observe = (),
    follow: str | None = None,
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
    """Compute the motion at every point of a plane of two parameters, or coordinates of the start.

    Parameters
    ----------
    system
        System with the other parameters.
    over
        Values of two parameters of the system or coordinates of the start (x1, v1, ..., phase), or of one of each;
        the first is the abscissa of figures.
    start
        Start of every member, with the coordinates that ``over`` does not vary.
    observe
        Further observers, such as "lyapunov"; "symbol" and "impacts" are always included,
        ``Symbol`` with other options if it is given.
    follow, settle_periods, periods, most_impacts, store, backend, workers, client, tile, progress
        As for :func:`~vibroimpact.sweep`.

    Returns
    -------
    Dataset
        The sweep, with ``motion`` (code of the symbol n-p-q, or of another motion: see its
        ``flag_meanings``; chaos is one of them if "lyapunov" is observed), ``period`` (n, 0 where
        not periodic) and ``impacts`` at all stops, per forcing period or, without forcing, unit of
        time. :func:`vibroimpact.plotting.plot_plane` draws it.

    Raises
    ------
    InvalidParameterError
        Other than two axes; as for ``sweep``.

    Notes
    -----
    Of coexisting attractors, one start finds one at each point. Compare ``follow``, other
    starts, or :func:`~vibroimpact.multistability`.

    The added variables are made in memory, some 100 bytes a member, and are not in ``store``.
    For more members use :func:`~vibroimpact.sweep` with a store, and ``plot_plane`` of a part,
    such as ``members.isel(omega=slice(None, None, 30))``.

    Examples
    --------
    >>> import numpy as np
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> over = {"omega": np.linspace(1.15, 1.25, 3), "half_clearance": [4.5, 5.0]}
    >>> found = vi.plane(damper, over=over, start=vi.State((0, 0), (0, 1)), settle_periods=1000,
    ...                  progress=False)
    >>> found["motion"].attrs["flag_meanings"]
    '1-1-1'
    """
    check_axes(over, 2, "two parameters, or coordinates of the start, with their values", EXAMPLE)
    observers = together(["symbol", "impacts"], observe)
    members = sweep(
        system, over=over, start=start, observe=observers, follow=follow,
        settle_periods=settle_periods, periods=periods, most_impacts=most_impacts, store=store,
        backend=backend, workers=workers, client=client, tile=tile, progress=progress,
    )  # fmt: skip
    return with_motions(members.transpose(*over, ...)).assign_attrs(call_of("plane"))


def _impacts(members: xr.Dataset) -> xr.Variable:
    a, b = (members[f"impacts_{stop}"].variable for stop in "ab")
    both = a + b
    both.attrs = a.attrs | {"long_name": "impacts at all stops"}
    return both


ADDED = {"motion": motions, "period": lambda members: members["n"].variable, "impacts": _impacts}
MADE_OF = ("end", "n", "p", "q", "impacts_a", "impacts_b")


def with_motions(members: xr.Dataset, names: Iterable[str] = tuple(ADDED)) -> xr.Dataset:
    """Add ``motion``, ``period`` and ``impacts`` to a sweep, from the symbol and the impacts."""
    return members.assign({name: ADDED[name](members) for name in names})


@interruptible
def multistability(
    system: System,
    *,
    over: Mapping[str, ArrayLike],
    start: Start,
    at: AtStop | AtPhase | None = None,
    same_within: float = MEMBER_DISTANCE,
    follow: str | None = None,
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
    """Count the attractors reached from several starts, at every point of a grid of parameters.

    Parameters
    ----------
    system
        System with the other parameters.
    over
        Values of one, two or more parameters. Coordinates of the start among them are no points of the grid, but
        make the starts.
    start
        The starts, the same ones at every point; or, with coordinates in ``over``, a
        :class:`~vibroimpact.State` that gives the others.
    at
        Where the points are by which attractors are compared, as for :func:`~vibroimpact.basins`.
    same_within
        As for :func:`~vibroimpact.basins`.
    follow, settle_periods, periods, most_impacts, store, backend, workers, client, tile, progress
        As for :func:`~vibroimpact.sweep`.

    Returns
    -------
    Dataset
        The sweep with ``attractors``: the number of different attractors. Motions without impacts
        count as one, rest as one for each set of stops, motions that impact but never at this stop
        as one for each ratio n : p : q; starts behind a stop and members that did not reach their
        end do not count.

    Raises
    ------
    InvalidParameterError
        A single start, other observers; as for ``sweep``.

    Notes
    -----
    Small basins are missed. The last 16 points of each member are compared, without classification:
    motions that are not periodic, or have more impacts at the stop than that, count as one where
    one lies in the gaps between the points of the other; near attractors are joined rather than
    one counted twice. Transients longer than ``settle_periods`` count as attractors.
    """
    over, start = grid_of(system, over, start)
    if isinstance(start, State) or not over:
        raise InvalidParameterError(
            f"start = {shown(start)}, over = {shown(over)}: must be RandomStarts, GridStarts or "
            "ListedStarts, or a State that coordinates in over vary, and at least one parameter. For one system take "
            "vi.basins."
        )
    share("same_within", same_within)
    place = observed_place(system, at)
    section = section_observer(place, COUNTED_POINTS)
    members = sweep(
        system, over=over, start=start, follow=follow,
        observe=[section, "symbol", "impacts", "speeds", "final"],
        settle_periods=settle_periods, periods=periods, most_impacts=most_impacts, store=store,
        backend=backend, workers=workers, client=client, tile=tile, progress=progress,
    )  # fmt: skip
    counted = _counted(system, members, list(over), place, same_within)
    call = call_of("multistability", at=place, same_within=same_within)
    return members.assign(attractors=counted).assign_attrs(call)


def _counted(
    system: System, members: xr.Dataset, over: list[str], at: AtStop | AtPhase, tolerance: float
) -> xr.DataArray:
    """Number of attractors at every point of the parameters."""
    codes = motions(members)
    shape = [members.sizes[name] for name in over]

    def column(array: xr.DataArray) -> NDArray[Any]:
        values = array.transpose(*codes.dims, ...).values
        return values.reshape(*shape, -1, *values.shape[codes.ndim :])

    section = (column(members[f"{observed_section(members)}_{kind}"]) for kind in STATE)
    points = scale_of(members, system).points(*section)
    each = symbols_of(members)
    symbols = column(xr.DataArray(each, dims=(*codes.dims, "symbol")))
    kinds, ends = column(codes), column(members["final_position"])
    if isinstance(at, AtStop):
        impacts = column_of(at.contact, at.stop, each.shape[-1])
    else:  # motions are distinguished by their points at a phase
        symbols, impacts = strobe_symbols(points), 1
        kinds = np.where(kinds == NO_IMPACTS, NOT_PERIODIC, kinds)
    points[kinds <= NO_IMPACTS] = np.nan
    elsewhere = (kinds > NO_IMPACTS) & np.isnan(points).all(axis=(-2, -1))
    counts = np.zeros(shape, dtype=np.int16)
    for k in np.ndindex(*shape):
        others = count_symbols(symbols[k][elsewhere[k]])
        silent = ends[k][kinds[k] == NO_IMPACTS]
        if len(silent):
            values = {name: float(members[name][i]) for name, i in zip(over, k, strict=True)}
            others += len(set(rest_on_stops(with_parameters(system, values), silent)))
        counts[k] = count_attractors(points[k], symbols[k], impacts, tolerance) + others
    return xr.DataArray(counts, dims=over, coords={name: members[name] for name in over})
