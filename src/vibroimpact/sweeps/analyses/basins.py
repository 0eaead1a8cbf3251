"""Basins of attraction over two coordinates of the start."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vibroimpact._core.checks import check_choice, check_count, check_kind, share
from vibroimpact._core.errors import InvalidParameterError
from vibroimpact._core.lazy import xr
from vibroimpact._core.progress import INTERRUPTED, ProgressOption, interruptible
from vibroimpact.attractors.matching import MEMBER_DISTANCE
from vibroimpact.model.state import STATE, State
from vibroimpact.model.system import System
from vibroimpact.simulation.places import AtPhase, AtStop
from vibroimpact.sweeps.analyses.label_attractors import LabelledAttractor, label_attractors
from vibroimpact.sweeps.analyses.member_table import ExtendRun
from vibroimpact.sweeps.analyses.motion_codes import BELOW
from vibroimpact.sweeps.member_status import MemberStatus
from vibroimpact.sweeps.observers.attractor_section import observed_place, section_observer
from vibroimpact.sweeps.options import (
    call_of,
    check_axes,
)
from vibroimpact.sweeps.starts import GridStarts, ListedStarts, States
from vibroimpact.sweeps.sweep import sweep

EXAMPLE = '{"x1": np.linspace(-1, 1, 200), "v1": np.linspace(-1, 1, 200)}'
MATCHED_POINTS = 8  # the rule of matching.py needs so many points of each member


@interruptible
def basins(
    system: System,
    *,
    over: Mapping[str, ArrayLike],
    start: State,
    at: AtStop | AtPhase | None = None,
    same_within: float = MEMBER_DISTANCE,
    most_classified: int = 64,
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
    """Compute basins of attraction on a grid of two state coordinates.

    Parameters
    ----------
    system
        The system.
    over
        Values of two coordinates: "x1", "x2", ..., "v1", "v2", ..., "phase"; the first is the
        abscissa of figures.
    start
        State with the coordinates that are not varied.
    at
        Where the points are by which attractors are compared, as in :func:`~vibroimpact.section`.
    same_within
        Periodic orbits nearer than this, in units of the largest position and velocity, count as
        one; in (0, 1).
    most_classified
        Largest number of members that are classified, >= 1; members that match none of them are
        "not matched": give a longer ``settle_periods``, or classify more.
    settle_periods, periods, most_impacts, store, backend, workers, client, tile, progress
        As for :func:`~vibroimpact.sweep`.

    Returns
    -------
    Dataset
        ``attractor``: the label of every start, 0 for the most frequent; below zero a status, with
        the meanings in ``flag_meanings``. With dim ``label``: ``name`` ("1-1-1 a", "chaotic b",
        "without impacts", "at rest on stop A"), ``kind``, ``share`` of the starts that are not
        behind a stop, ``exponent`` (NaN for motions that never hit this stop), and a state on it
        for further computations, ``attractor_position``, ``attractor_velocity``,
        ``attractor_phase``: :func:`~vibroimpact.attractor_state`. Where no start leads to an
        attractor, ``label`` has length 0. Also the variables of the sweep.

    Raises
    ------
    InvalidParameterError
        Other than two coordinates, no such stop, other observers; as for ``sweep``.

    Notes
    -----
    The cost of the sweep, and of a :func:`~vibroimpact.classify` per attractor: 0.03 to 0.3 s, a
    second or two where it stays undecided. At most ``most_classified`` members are classified.
    Members without a label after that have not settled; they are continued for 8, then 64 times
    ``settle_periods + periods``; ``final_position``, ``final_velocity`` and ``final_phase`` are then those
    of the continued motions, the other variables those of the requested window. "Without impacts"
    are motions in flight that had none for as long: one attractor, also where a free or undamped
    mass may rest, or swing, anywhere in its clearance. Rest is an attractor for each set of stops.
    Mirror images of each other are two attractors. Attractors that are nearer to each other than
    ``same_within`` (periodic), or than neighbouring points among 4000 on one of them (others), count
    as one. Motions that impact, but never at this stop, are distinguished by their symbol only.
    With longer ``settle_periods`` and ``periods``, fewer transients are mistaken for attractors.

    Examples
    --------
    >>> import numpy as np
    >>> import vibroimpact as vi
    >>> damper = vi.ImpactDamper(mass_ratio=0.1, omega_n=0.5, zeta=0.045, restitution=0.8,
    ...                          half_clearance=5.0, omega=1.2)
    >>> axis = np.linspace(-2.0, 2.0, 4)
    >>> found = vi.basins(damper, over={"x1": axis, "v2": axis}, start=vi.State((0, 0), (0, 0)),
    ...                   progress=False)
    >>> found["name"].values.tolist()
    ['1-1-1 a']
    """
    check_axes(over, 2, "two coordinates of the state with their values", EXAMPLE)
    check_count("most_classified", most_classified, 1)
    share("same_within", same_within)
    place, starts = observed_place(system, at), GridStarts(over, start)
    section = section_observer(place, MATCHED_POINTS)
    requested: dict[str, Any] = {
        "over": {}, "observe": [section, "symbol", "impacts", "speeds", "final"],
        "settle_periods": settle_periods, "periods": periods, "most_impacts": most_impacts, "store": store,
        "backend": backend, "workers": workers, "client": client, "tile": tile, "progress": progress,
    }  # fmt: skip
    members = sweep(system, start=starts, **requested)
    labels, found, ends = label_attractors(
        system, members, starts.states().phase, _extension(system, members, requested),
        at=place, tolerance=same_within, most_classified=most_classified,
    )  # fmt: skip
    members = _ended(members, ends)
    table = _table(labels, found, members.sizes["coordinate"])
    call = call_of(
        "basins",
        over=starts.over,
        start=starts.base,
        at=place,
        same_within=same_within,
        most_classified=most_classified,
    )
    return members.assign(attractor=labels, **table).assign_attrs(call)


def attractor_state(basins: xr.Dataset, name: str) -> State:
    """Return a state on an attractor, for ``classify``, ``find_orbit`` or ``simulate``.

    Parameters
    ----------
    basins
        A result of :func:`~vibroimpact.basins`.
    name
        Name of the attractor, such as "1-1-1 a".
    """
    check_kind("basins", basins, xr.Dataset, "a Dataset, as vi.basins gives")
    if "name" not in basins or "attractor_position" not in basins:
        raise InvalidParameterError("basins: have no attractors. Compute them with vi.basins.")
    names = [str(one) for one in basins["name"].values]
    check_choice("name", name, names)
    row = basins.isel(label=names.index(name))
    position, velocity = (row[f"attractor_{kind}"].values for kind in ("position", "velocity"))
    return State(tuple(position), tuple(velocity), float(row["attractor_phase"]))


def share_of_starts(labels: xr.DataArray, label: int) -> float:
    """Share of a label among the starts that are not behind a stop."""
    started = int((labels.values != BELOW - MemberStatus.INITIAL_PENETRATION).sum())
    return int((labels.values == label).sum()) / max(started, 1)


def _ended(members: xr.Dataset, ends: States) -> xr.Dataset:
    """Sweep with the final states of its members at the time of their labels."""
    names = {f"final_{kind}": values for kind, values in zip(STATE, ends, strict=True)}
    names["final_phase"] = names["final_phase"] % (2.0 * math.pi)
    arrays = {name: members[name].transpose(*members["end"].dims, ...) for name in names}
    return members.assign(
        {name: array.copy(data=names[name].reshape(array.shape)) for name, array in arrays.items()}
    )


def _extension(system: System, members: xr.Dataset, requested: dict[str, Any]) -> ExtendRun:
    """Function that continues members, for a multiple of the length of their sweep.

    Whole periods in all: motions end at the phase at which they ended before.
    """
    same = {name: x for name, x in requested.items() if name not in ("store", "most_impacts")}
    length = members.attrs["settle_periods"] + members.attrs["periods"]

    def run(states: States, times: int, whole: bool) -> xr.Dataset:
        periods = math.ceil(times * length) if whole else members.attrs["periods"]
        settle_periods = 0 if whole else math.ceil(times * length + periods) - periods
        window = {
            "settle_periods": settle_periods,
            "periods": periods,
            "start": ListedStarts(*states),
        }
        try:
            return sweep(system, **same | window)
        except KeyboardInterrupt:
            store = requested["store"]
            kept = f"the window is whole in {store}" if store else "nothing is kept"
            raise KeyboardInterrupt(
                f"{INTERRUPTED}members were being continued towards their attractors; {kept}. "
                "The same call continues them anew."
            ) from None

    return run


def _table(
    labels: xr.DataArray, found: tuple[LabelledAttractor, ...], degrees: int
) -> dict[str, Any]:
    """Variables of the attractors, with dim ``label``."""
    states = [one.state for one in found]
    row = ("label",)
    both, shape = ("label", "coordinate"), (len(found), degrees)
    return {
        "label": np.arange(len(found)),
        "name": (row, np.array([one.word for one in found], dtype=object)),
        "kind": (row, np.array([one.kind for one in found], dtype=object)),
        "share": (row, [share_of_starts(labels, i) for i in range(len(found))]),
        "exponent": (row, [one.exponent for one in found]),
        "attractor_position": (both, np.reshape([s.position for s in states], shape)),
        "attractor_velocity": (both, np.reshape([s.velocity for s in states], shape)),
        "attractor_phase": (row, [s.phase for s in states]),
    }
